"""Imports at the first use, so that ``ptm --help`` is instant.

`Lazy` is a function in a table of declarations; `lazy_exports` are the names of a package.
"""

from __future__ import annotations

import builtins
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Generic, TypeVar, cast

from ptmtools.errors import MissingComponentError

T = TypeVar("T")


@dataclass(frozen=True)
class Lazy(Generic[T]):
    """A name of a module, such as ``Lazy("ptmtools.visibility.pvs:compute_pvs")``."""

    place: str

    def load(self) -> T:
        """The object; imports its module."""
        module, _, name = self.place.partition(":")
        return cast(T, getattr(import_module(module), name))


def lazy_exports(package: str, table: Mapping[str, str]) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package (PEP 562) whose names are imported when they are first used.

    ``table`` is module → its names, separated by blanks. They become the package's ``__all__``,
    without those of built-in functions. For type checkers the package imports the same names ``if
    TYPE_CHECKING``.
    """
    home = {name: module for module, names in table.items() for name in names.split()}
    sys.modules[package].__all__ = sorted(  # type: ignore[attr-defined]
        name for name in home if not hasattr(builtins, name)
    )

    def attribute(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(home[name]), name)

    return attribute


def component(module: str, code: str, message: str, extra: str) -> Any:
    """A module of an optional dependency, which the extra of that name installs.

    Raises MissingComponentError with the code and message if it is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        remedy = f"pip install 'ptmtools[{extra}]'"
        raise MissingComponentError(code, message, remedy=remedy) from None


def pymeshlab_absence() -> str:
    """The reason why pymeshlab is unavailable, or "". Without OpenGL it imports, prints a page of
    warnings and supports no format and no filter, so libOpenGL is checked first."""
    import ctypes

    try:
        if sys.platform == "linux":
            ctypes.CDLL("libOpenGL.so.0")
    except OSError as error:
        return str(error)
    return "" if find_spec("pymeshlab") else "No module named 'pymeshlab'"
