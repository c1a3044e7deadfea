"""Modules of this package as processes of their own, for libraries that may crash."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import ptmtools


def module_process(module: str, *arguments: str | os.PathLike[str]) -> dict[str, Any]:
    """The ``args`` and ``env`` by which `subprocess` runs a module of this package with this
    interpreter. The module is not searched for in the working folder."""
    root = os.fspath(Path(ptmtools.__file__).parent.parent)
    search = os.environ.get("PYTHONPATH")
    return {
        "args": [sys.executable, "-P", "-m", module, *(os.fspath(each) for each in arguments)],
        "env": {**os.environ, "PYTHONPATH": f"{root}{os.pathsep}{search}" if search else root},
    }
