"""The knobs of the subdivision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

CellKind = Literal["leaf", "room"]
Position = tuple[float, float, float]


def _positions(viewpoints: Sequence[tuple[float, ...]]) -> tuple[Position, ...]:
    """The positions (x, y, z) of viewpoints (x, y, z[, yaw])."""
    return tuple((x, y, z) for x, y, z, *_ in viewpoints)


@dataclass(frozen=True)
class SubdivideOptions:
    """What may split, and how far. The metadata of a field name its option and older spellings.

    Attributes
    ----------
    wall_area: walls of at least this area, in m², divide the building into leaves, its convex
        pieces. Smaller: more and tighter cells, and slower visibility.
    wall_thickness: parallel walls nearer to each other than this, in metres, are the two faces of
        one wall; jambs, lintels and sills between them divide it whatever their area. What stands
        off a wall by less than 0.12 of this, or 1/1000 of the building's extent, is part of it.
    max_leaves: stop at this many leaves; the best splits come first.
    structural: names of objects or materials, with * and ?, that divide whatever their area.
    detail: names, with * and ?, of what never divides the building nor hides anything, such as
        furniture. structural wins.
    cells: a cell, the unit that is loaded and drawn, is a single "leaf" or a "room", all leaves
        between its doors; but see gain.
    gain: keep the leaves of a room as separate cells if that saves viewers at least this share of
        what they download; 0 keeps all of them apart, 1 makes every room one cell.
    viewpoints: a place X,Y,Z[,YAW] to start from, inside the building: metres, Y up; the yaw in
        degrees, counter-clockwise from -Z. What cannot be reached from the places given is
        dropped. If none is given, one is chosen.
    """

    wall_area: float = 2.0
    wall_thickness: float = 0.5
    max_leaves: int = field(default=10_000, metadata={"was": ("max-cells",)})
    structural: tuple[str, ...] = ()
    detail: tuple[str, ...] = ()
    cells: CellKind = "room"
    gain: float = 0.1
    viewpoints: tuple[Position, ...] = field(
        default=(), metadata={"option": "viewpoint", "numbers": (3, 4), "parse": _positions}
    )
