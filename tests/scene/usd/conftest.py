"""USD stages: the library, and a reader."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from ptmtools.scene.options import MAX_VERTICES
from tests.scene.usd.reading import Read


@pytest.fixture(autouse=True)
def usd_core(require: Callable[[str, str], None]) -> None:
    if find_spec("pxr") is None:
        require("usd-core", "pip install 'ptmtools[usd]'")


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Read]:
    return lambda stage, most=MAX_VERTICES: Read(stage, tmp_path, most)
