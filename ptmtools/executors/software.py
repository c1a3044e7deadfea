"""What a process computes with: two processes of equal software give equal results."""

from __future__ import annotations

import sys
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ptmtools.version import __version__

#: Libraries whose arithmetic gets into the results of tasks.
LIBRARIES = ("numpy", "numba", "embreex", "pillow")


@cache
def software() -> tuple[str, ...]:
    """ptmtools and its sources, Python, and the libraries, each with its version."""
    digest = sha256()
    package = Path(__file__).parent.parent
    for file in sorted(package.rglob("*.py")):
        digest.update(file.relative_to(package).as_posix().encode() + b"\0" + file.read_bytes())
    python = f"Python {sys.version_info.major}.{sys.version_info.minor}"
    ours = f"ptmtools {__version__} ({digest.hexdigest()[:12]})"
    return ours, python, *(f"{name} {_version(name)}" for name in LIBRARIES)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"
