"""Tables of declared values that installed packages fill through entry points.

A package adds a command, stage, input format, texture profile and so on by an entry point of the
group ``ptmtools.<kind>``, whose name is the key in the table and whose value is the declaration:

    [project.entry-points."ptmtools.commands"]
    largest = "my_package:LARGEST"

The laboratory and the neighbouring systems attach in this way, as any other package does. Modules
of declarations are imported when a table is read, so they import nothing that takes long.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

from ptmtools.errors import MissingComponentError

D = TypeVar("D")

#: The kinds of declarations; the group of each is ``ptmtools.<kind>``.
KINDS = (
    "commands",
    "emitters",
    "formats",
    "pages",
    "policies",
    "profiles",
    "representations",
    "stages",
)


@cache
def installed_points() -> Any:
    """All entry points, of which ``select(group=…)`` returns some: a search for one group opens the
    metadata of every package, too."""
    return entry_points()


@cache
def points(kind: str) -> Mapping[str, EntryPoint]:
    """The entry points of a kind by name, in the order of their names.

    Raises MissingComponentError: PTM-M110 two packages declare the same name.
    """
    table: dict[str, EntryPoint] = {}
    group = installed_points().select(group=f"ptmtools.{kind}")
    for point in sorted(group, key=lambda point: point.name):
        first = table.setdefault(point.name, point)
        if first.value != point.value:
            raise MissingComponentError(
                "PTM-M110",
                f"{first.value} and {point.value} both declare {point.name!r} in ptmtools.{kind}",
                remedy="uninstall one of the two packages",
            )
    return table


def load(kind: str, point: EntryPoint, cls: type[D]) -> D:
    """The declaration of an entry point.

    Raises MissingComponentError: PTM-M110 it cannot be imported, or is not of the class.
    """
    try:
        declaration = point.load()
    except Exception as fault:  # a stranger's module may raise anything
        reason = f"{type(fault).__name__}: {fault}"
    else:
        if isinstance(declaration, cls):
            return declaration
        reason = f"{point.value} is not of the class {cls.__name__}"
    package = f" of {point.dist.name} {point.dist.version}" if point.dist else ""
    raise MissingComponentError(
        "PTM-M110",
        f"the plug-in {point.name!r}{package} (ptmtools.{kind}) cannot be used ({reason})",
        remedy="update or uninstall that package",
    )


@cache
def declarations(kind: str, cls: type[D]) -> Mapping[str, D]:
    """The declarations of a kind by name, in the order of their names; raises as `points` and
    `load`."""
    return {name: load(kind, point, cls) for name, point in points(kind).items()}
