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
    """What may split, and how far.

    Attributes
    ----------
    wall_area: the least area in m² of a polygon that may split a cell. Smaller: more and tighter
        cells, and a slower portal flow.
    wall_thickness: parallel walls nearer than this (metres) are the two faces of one wall; there,
        polygons that bridge its thickness (jambs, lintels, sills) split whatever their area. What
        stands off a wall by less than 0.12 of it, or 1/1000 of the extent, hangs on it.
    max_cells: stop at this many leaves, best splits first.
    structural: globs over object and material names; what matches may split whatever its area.
    detail: globs; what matches never splits a cell nor blocks a portal. `structural` wins.
    cells: every convex "leaf" of the subdivision is a cell, or the leaves of a "room", which ends
        at its doors, are one; but see `gain`.
    gain: leaves of one room stay cells of their own if that saves at least this share of what has
        to be fetched in them and for them; 0 joins nothing, 1 leaves every room whole.
    viewpoints: a place to start from, and from which cells are to be reached, X,Y,Z[,YAW]: world
        metres; the yaw in degrees, counter-clockwise from -Z.
    """

    wall_area: float = 2.0
    wall_thickness: float = 0.5
    max_cells: int = 10_000
    structural: tuple[str, ...] = ()
    detail: tuple[str, ...] = ()
    cells: CellKind = "room"
    gain: float = 0.1
    viewpoints: tuple[Position, ...] = field(
        default=(), metadata={"option": "viewpoint", "numbers": (3, 4), "parse": _positions}
    )
