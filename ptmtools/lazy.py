"""What is imported when it is first used, so that ``ptm --help`` is instant.

A package says where each of its names lives, and takes what `names` returns for its
``__getattr__`` (PEP 562). A table says by `Lazy` where the function lives that does something.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
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


def names(package: str, home: Mapping[str, str]) -> Callable[[str], Any]:
    """The ``__getattr__`` of ``package``; ``home`` maps each name to its module, relative to it."""

    def attribute(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f"{package}.{home[name]}"), name)

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
