"""Options of the subdivision, and the size of the visitor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple, get_args

from ptmtools.options import option, require

CellKind = Literal["leaf", "room"]
Reach = Literal["all", "main"]
Standing = Literal["places", "floors", "anywhere"]
CeilingKind = Literal["auto", "none"]
SpacesKind = Literal["auto", "none"]
DoorState = Literal["pass", "open", "closed", "hidden"]
Position = tuple[float, float, float]


def _positions(viewpoints: Sequence[tuple[float, ...]]) -> tuple[Position, ...]:
    """The positions (x, y, z) of viewpoints (x, y, z[, yaw])."""
    return tuple((x, y, z) for x, y, z, *_ in viewpoints)


class Walker(NamedTuple):
    """The body of a visitor: an upright cylinder from ``step`` to ``height`` above the floor, in
    metres."""

    radius: float
    step: float
    height: float

    @property
    def middle(self) -> float:
        """Height of the body's middle above the floor, metres."""
        return (self.step + self.height) / 2

    @property
    def reach(self) -> float:
        """Greatest height of eyes above the floor, metres: 2.2 for a height of 1.7, since visitors
        may be taller."""
        return 2.2 * self.scale

    @property
    def scale(self) -> float:
        """Height beside that of the default visitor: buildings in another unit have rooms in it."""
        return self.height / 1.7


#: The default visitor.
WALKER = Walker(0.25, 0.5, 1.7)
#: Upper bound of a visitor's size, metres, also for models in other units.
GIANT = 1e9


@dataclass(frozen=True)
class SubdivideOptions:
    """Options of `ptmtools.cells.subdivide`.

    Raises InputError PTM-I111 for values out of range.
    """

    heading: ClassVar[str] = "Cells"

    wall_area: float = option(
        2.0,
        "Minimum area of a wall that divides the building into leaves (its convex parts). Smaller "
        "values give more and smaller cells, and make the visibility stage slower.",
        metavar="M2",
    )
    wall_thickness: float = option(
        0.5,
        "Maximum distance between the two faces of a wall. Jambs, lintels and sills between them "
        "divide the building, whatever their area.",
        metavar="METRES",
    )
    max_leaves: int = option(
        50_000,
        "Maximum number of leaves. The most useful divisions are made first.",
    )
    structural: tuple[str, ...] = option(
        (),
        "Names of objects or materials that divide the building, whatever their area; * and ? are "
        "wildcards. Repeatable.",
        metavar="NAME",
    )
    detail: tuple[str, ...] = option(
        (),
        "Names of objects or materials that neither divide the building nor hide anything, such "
        "as furniture; * and ? are wildcards. --structural takes precedence. Repeatable.",
        metavar="NAME",
        basic=True,
    )
    detail_by_shape: bool = option(
        True, "Treat small, rounded objects with many triangles as detail: sofas, statues, plants."
    )
    cells: CellKind = option(
        "room",
        "Unit that clients load and draw: a convex leaf, or a room, which consists of all leaves "
        "between its doors; see --gain.",
    )
    gain: float = option(
        0.1,
        "Divide a room into its leaves if that saves clients at least this share of their "
        "download; 0 divides every room, 1 divides none.",
        metavar="SHARE",
    )
    walker: tuple[float, float, float] = option(
        WALKER,
        "Size of the visitor: radius, highest step and height, in metres. Space is walkable "
        "where a body of this size fits.",
        metavar="RADIUS,STEP,HEIGHT",
    )
    reach: Reach = option(
        "all",
        "Space that cannot be reached from a --viewpoint or, without that option, from the "
        "largest room, such as rooms behind closed doors: all keeps it where it is walkable, main "
        "drops it.",
    )
    standing: Standing = option(
        "places",
        "Possible positions of the eyes: above walkable floor to which a way leads from a room, up "
        "to 1.3 times the height of --walker (places), above any walkable floor, such as roofs and "
        "plenums (floors), or anywhere in the cell, for flying cameras (anywhere).",
    )
    doors: DoorState = option(
        "pass",
        "Doors between rooms: with pass, visitors walk through leaves that hide what is behind "
        "them; open leaves are drawn but hide nothing, hidden ones are not drawn, closed ones act "
        "as walls. Exterior doors stay shut.",
        basic=True,
    )
    door: tuple[str, ...] = option(
        (),
        "Names of objects or materials that are door leaves, in addition to door leaves that ptm "
        "recognises by name and shape; * and ? are wildcards. --structural takes precedence. "
        "Repeatable.",
        metavar="NAME",
    )
    ceiling: CeilingKind = option(
        "auto",
        "End of rooms without a ceiling: the top of their walls, so that they see one another "
        "through doorways only (auto), or that of the whole model (none).",
    )
    spaces: SpacesKind = option(
        "auto",
        "Spaces of an IFC model: they bound and name rooms (auto), or count for nothing (none).",
    )
    viewpoints: tuple[Position, ...] = option(
        (),
        "Viewpoint inside the building: position in metres, Y up, and yaw in degrees, "
        "counter-clockwise from -Z. Default: chosen automatically. Repeatable.",
        name="viewpoint",
        metavar="X,Y,Z[,YAW]",
        numbers=(3, 4),
        parse=_positions,
        basic=True,
    )
    strict: bool = option(
        False, "Fail if more than a tenth of the walkable floor or of the triangles is left out."
    )

    def __post_init__(self) -> None:
        area, thickness, gain = self.wall_area, self.wall_thickness, self.gain
        require(
            (area > 0, f"wall area {area:g} m² is not positive", "try 2"),
            (thickness >= 0, f"wall thickness {thickness:g} m is negative", "try 0.5"),
            (0 <= gain <= 1, f"a gain of {gain:g} is not between 0 and 1", "try 0.1"),
            (self.reach in get_args(Reach), f"unknown reach {self.reach!r}", "all or main"),
            (
                self.standing in get_args(Standing),
                f"unknown standing {self.standing!r}",
                "places, floors or anywhere",
            ),
            (
                self.doors in get_args(DoorState),
                f"doors are not {self.doors!r}",
                "pass, open, closed or hidden",
            ),
            (
                len(self.walker) == 3  # type: ignore[redundant-expr]  # may be a plain tuple
                and all(0 < length <= GIANT for length in self.walker)
                and self.walker[1] < self.walker[2],
                f"radius, step and height of {self.walker} metres are out of range",
                "try 0.25,0.5,1.7",
            ),
            (self.ceiling in get_args(CeilingKind), f"no ceiling {self.ceiling!r}", "auto or none"),
            (self.spaces in get_args(SpacesKind), f"no spaces {self.spaces!r}", "auto or none"),
            (self.cells in get_args(CellKind), f"unknown cells {self.cells!r}", "leaf or room"),
            (self.max_leaves >= 1, f"at most {self.max_leaves} leaves is too few", "try 500"),
        )
