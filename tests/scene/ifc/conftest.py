"""IFC: the library."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import pytest


@pytest.fixture(autouse=True)
def ifcopenshell(require: Callable[[str, str], None]) -> None:
    if find_spec("ifcopenshell") is None:
        require("ifcopenshell", "pip install 'ptmtools[ifc]'")
