"""The knobs of the subdivision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, get_args

from ptmtools.errors import InputError

CellKind = Literal["leaf", "room"]
Reach = Literal["all", "main"]
Standing = Literal["places", "anywhere"]
DoorState = Literal["open", "closed", "hidden"]
Position = tuple[float, float, float]


def _positions(viewpoints: Sequence[tuple[float, ...]]) -> tuple[Position, ...]:
    """The positions (x, y, z) of viewpoints (x, y, z[, yaw])."""
    return tuple((x, y, z) for x, y, z, *_ in viewpoints)


class Walker(NamedTuple):
    """The body of whoever walks: an upright cylinder from ``step`` to ``height`` above the floor,
    metres."""

    radius: float
    step: float
    height: float

    @property
    def middle(self) -> float:
        """How high above the floor the body's middle is."""
        return (self.step + self.height) / 2

    @property
    def reach(self) -> float:
        """How high above the floor eyes are at most: somebody may be taller, 2.2 m to the 1.7."""
        return self.height * (2.2 / 1.7)


#: Whoever walks unless another is asked for.
WALKER = Walker(0.25, 0.5, 1.7)
#: Nobody is wider or taller, metres: in a model in another unit neither.
GIANT = 1e9


@dataclass(frozen=True)
class SubdivideOptions:
    """What may split, and how far. The metadata of a field name its option and older spellings.

    Attributes
    ----------
    wall_area: walls of at least this area, in m², divide the building into leaves, its convex
        pieces. A smaller value gives more and tighter cells, and slower visibility.
    wall_thickness: parallel walls closer together than this, in metres, are the two faces of one
        wall; jambs, lintels and sills between them divide the building whatever their area.
        Whatever stands off a wall by less than 0.12 of this, or by less than 1/1000 of the
        building's extent, is part of the wall.
    max_leaves: stop at this many leaves. The best splits come first.
    structural: objects or materials (names, with * and ?) that divide the building whatever their
        area. May be given several times.
    detail: objects or materials (names, with * and ?) that never divide the building and never hide
        anything, such as furniture; --structural takes precedence. May be given several times.
    detail_by_shape: take for detail, too, what is small, dense and round, such as sofas, statues
        and plants: it can neither divide nor hide anything.
    cells: what a cell, the unit that clients load and draw, consists of: a single "leaf", or a
        "room", all leaves between its doors; but see --gain.
    gain: keep the leaves of a room as separate cells if that saves viewers at least this share of
        what they download; 0 keeps all of them apart, 1 makes every room one cell.
    walker: radius, highest step and height, in metres, of whoever walks. Where such a body fits
        is not left out, even if it cannot be reached; see --reach.
    standing: where visitors are: at "places", on floors where the body of --walker fits, their eyes
        up to 1.3 times its height; or "anywhere" in the cells, as cameras that fly are.
    viewpoints: a starting point inside the building: metres, Y up, and the yaw in degrees,
        counter-clockwise from -Z. By default one is chosen. May be given several times.
    reach: what becomes of space that cannot be reached from the start, behind closed doors or in
        another building: "all" keeps what has a place in it, "main" drops everything.
    doors: "open" lets everybody see through the leaves of doors between rooms, though they are
        drawn; "hidden" does not draw them either; to "closed" ones they are walls. Entrances, with
        nothing but the outside beyond, stay shut.
    door: objects or materials (names, with * and ?) that are door leaves, whatever their shape;
        --structural takes precedence. Others are recognised by name and shape. May be given
        several times.
    strict: stop the build if more than a tenth of where one could stand is left out.
    """

    wall_area: float = 2.0
    wall_thickness: float = 0.5
    max_leaves: int = field(default=10_000, metadata={"was": ("max-cells",)})
    structural: tuple[str, ...] = ()
    detail: tuple[str, ...] = ()
    detail_by_shape: bool = True
    cells: CellKind = "room"
    gain: float = 0.1
    walker: tuple[float, float, float] = WALKER
    reach: Reach = "all"
    standing: Standing = "places"
    doors: DoorState = "open"
    door: tuple[str, ...] = ()
    viewpoints: tuple[Position, ...] = field(
        default=(), metadata={"option": "viewpoint", "numbers": (3, 4), "parse": _positions}
    )
    strict: bool = False

    def __post_init__(self) -> None:
        area, thickness, gain = self.wall_area, self.wall_thickness, self.gain
        for sound, fault, remedy in (
            (area > 0, f"wall area {area:g} m² is not positive", "try 2"),
            (thickness >= 0, f"wall thickness {thickness:g} m is negative", "try 0.5"),
            (0 <= gain <= 1, f"a gain of {gain:g} is not between 0 and 1", "try 0.1"),
            (self.reach in get_args(Reach), f"unknown reach {self.reach!r}", "all or main"),
            (
                self.standing in get_args(Standing),
                f"unknown standing {self.standing!r}",
                "places or anywhere",
            ),
            (
                self.doors in get_args(DoorState),
                f"doors are not {self.doors!r}",
                "open, closed or hidden",
            ),
            (
                len(self.walker) == 3
                and all(0 < length <= GIANT for length in self.walker)
                and self.walker[1] < self.walker[2],
                f"nobody's radius, step and height are {self.walker} metres",
                "try 0.25,0.5,1.7",
            ),
            (self.cells in get_args(CellKind), f"unknown cells {self.cells!r}", "leaf or room"),
            (self.max_leaves >= 1, f"at most {self.max_leaves} leaves is too few", "try 500"),
        ):
            if not sound:
                raise InputError("PTM-I300", fault, remedy=remedy)
