"""What is imported when it is first used, so that ``ptm --help`` is instant.

A package imports its names for type checkers only, and takes what `names` makes of that for its
``__getattr__`` (PEP 562). A table says by `Lazy` where the function lives that does something.
"""

from __future__ import annotations

import ast
import builtins
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Generic, TypeVar, cast

from ptmtools.errors import MissingComponentError

T = TypeVar("T")


@dataclass(frozen=True)
class Lazy(Generic[T]):
    """A name of a module, such as ``Lazy("ptmtools.visibility.pvs:compute_pvs")``."""

    place: str

    def load(self) -> T:
        """What it stands for; imports the module."""
        module, _, name = self.place.partition(":")
        return cast(T, getattr(import_module(module), name))


def names(package: str) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package that imports what it offers ``if TYPE_CHECKING``, each name
    as itself: ``from ptmtools.scene.ingestion import ingest as ingest``.

    They are its ``__all__`` too, but for those that Python itself has.
    """
    module: Any = sys.modules[package]
    source = module.__loader__.get_source(package)
    if source is None:
        raise ImportError(f"{package} cannot be used without its source files")
    statements = ast.walk(ast.parse(source))
    imports = [node for node in statements if isinstance(node, ast.ImportFrom)]
    home = {a.name: node.module for node in imports for a in node.names if a.name == a.asname}
    module.__all__ = sorted(name for name in home if not hasattr(builtins, name))

    def attribute(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(str(home[name])), name)

    return attribute


def component(module: str, code: str, message: str, extra: str) -> Any:
    """A module that is an optional component, of the extra of that name.

    Raises MissingComponentError with that code and message where it is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        remedy = f"pip install 'ptmtools[{extra}]'"
        raise MissingComponentError(code, message, remedy=remedy) from None
