"""The rooms of a scene, in the order in which a visitor would rather begin in them.

A *room* is here the floor of a cell, or of the cells of a room with a name, on a storey. Rooms come
first

1. with a floor that is no small part of the cell's: not the foot of a flight of stairs;
2. with a name, then under a ceiling, then courts, open ground and the rest (`room_kinds`), roofs
   after the ground;
3. on the storey at the height of the ground, then on storeys with daylight, then on dark ones; of
   these first those above the ground, and the nearer ones;
4. with a ceiling as low as that of a room, or with daylight: a ceiling may be a painted sky;
5. with large floors, of which dark ones count half; the lower of equal ones.

The ground is where rain falls around the building and no floor is below; without it, the lowest of
the large storeys, with daylight if any has, is at its height. A space has daylight if a ray out of
it leaves the model, or passes glass.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.cells.options import WALKER
from ptmtools.cells.room_kinds import SpaceKind, space_kinds
from ptmtools.cells.structure import Surroundings
from ptmtools.output.model import EYE
from ptmtools.output.storeys import main_floors
from ptmtools.scene.model import Scene

#: A roof is no thicker than this, and half a wall, metres for the default visitor.
_SLAB = 1.0
#: Without ceilings, rooms with one have at most this share of the space between walls, and at least
#: this number of courts are as large as the largest of them.
_ROOFLESS_SHARE, _ROOFLESS_COURTS = 0.05, 4
#: A floor is small with less than this share of the largest one of its cell and kind.
_SMALL = 0.15
#: Drops of rain along each side of a grid over the building, and how far that reaches beyond, in
#: heights of the eye. At least this share of them tells where the ground is, by this quantile:
#: others are on walls and on solid houses.
_DROPS, _BEYOND, _GROUND_SHARE, _LOW = 16, 3.0, 0.02, 0.25
#: A storey is at the ground if its floor is at most this far from it, in heights of the eye.
_AT_GROUND = 0.5
#: A storey is large with this share of the floor of the largest.
_MAIN_SHARE = 0.5
#: A floor without daylight counts as one of this share of its size.
_DARK = 0.5
#: A storey has daylight if at least this share of its floor has.
_LIT_SHARE = 0.1
#: Rises of rays to the light, for a length of 1 in plan; spaces looked out of at a time.
_RISES, _AT_ONCE = (0.0, 0.4, 1.0, 2.0), 256


@dataclass(frozen=True)
class Room:
    """The floor of a room on a storey.

    Attributes
    ----------
    number: of the room, see `Cells.room_numbers`.
    rank: its place in the order but for its size; lower ones come first.
    size: m² of its floor, about; less without daylight.
    storey: height of the storey's main floor.
    leaves: above that floor, the largest first.
    floors: (n,) height of the floor below them.
    """

    number: int
    rank: tuple[int, ...]
    size: float
    storey: float
    leaves: Ints
    floors: Floats

    @property
    def is_indoors(self) -> bool:
        """Whether it has a name or a ceiling."""
        return self.rank[1] <= 1


def rooms_to_visit(
    scene: Scene, cells: Cells, floor_below: Callable[[Floats], Floats], eye: float
) -> list[Room]:
    """The rooms in which an eye at a height of ``eye`` metres is inside, the best to begin in
    first. ``floor_below`` gives the heights of the floors below (n, 3) points."""
    leaves = np.flatnonzero(cells.leaf_standing & (cells.leaf_cell >= 0))
    corners = [cells.leaf_points(leaf) for leaf in leaves.tolist()]
    if not corners:
        return []
    points = np.stack([_look_points(leaf) for leaf in corners])
    low, high = (np.array([end(leaf[:, 1]) for leaf in corners]) for end in (np.min, np.max))
    floor = np.median(floor_below(points.reshape(-1, 3)).reshape(len(points), -1), axis=1)
    fits = (floor + eye > low) & (floor + eye < high)
    height = np.where(fits, eye, np.maximum(points[:, 0, 1] - floor, 0.0))
    points[:, :, 1] = np.where(fits, floor + eye, points[:, 0, 1])[:, None]
    volume, cell = cells.leaf_volumes()[leaves], cells.leaf_cell[leaves]
    around = Surroundings(scene.corners, scene.tolerance)
    kind, roof = _kinds(around, points, height, volume, eye)
    court = (kind == SpaceKind.COURT) & ~roof
    if _is_roofless(cell, volume * (kind <= SpaceKind.HALL), volume * court):
        kind[court] = SpaceKind.ROOM
    if not fits.any():
        return []
    level = _ground_level(scene, around, points[fits], floor_below, eye)
    named = np.array([bool(cells.room_name(i)) for i in range(cells.cell_count)])[cell]
    group = np.where(named, 0, np.where(kind <= SpaceKind.HALL, 1, 2 * kind + roof))[fits]
    leaves, points, kind, floor = leaves[fits], points[fits], kind[fits], floor[fits]
    area, indoors = (volume / (high - low))[fits], group <= 1
    covered = indoors | around.cover(points[:, 0])  # decks of a car park, not terrain
    heights = main_floors(floor, np.where(covered, area, 0.0), eye)
    storey = abs(floor[:, None] - heights).round(2).argmin(axis=1)
    keys, room = np.unique(
        np.stack([cells.room_numbers[cell[fits]], group, storey], axis=1),
        axis=0,
        return_inverse=True,
    )
    room, count = room.reshape(-1), len(keys)
    size = np.bincount(room, area, count)
    lit = np.zeros(len(leaves), dtype=np.bool_)
    lit[covered] = _have_daylight(scene, around, points[covered])
    dark = np.bincount(room, lit, count) == 0
    worth = size * np.where(dark, _DARK, 1.0)
    sky = dark & (2 * np.bincount(room, area * (kind == SpaceKind.HALL), count) > size)
    turn = _turns(heights, level, storey, area * covered, area * lit, eye)
    kinds, same = np.unique(keys[:, :2], axis=0, return_inverse=True)
    largest = np.zeros(len(kinds))
    np.maximum.at(largest, same.reshape(-1), size)
    small = size < _SMALL * largest[same.reshape(-1)]
    rooms = []
    for i, (number, kind_group, k) in enumerate(keys.tolist()):
        inside = np.flatnonzero(room == i)
        inside = inside[np.lexsort((leaves[inside], -area[inside]))]
        rank = (int(small[i]), kind_group, int(turn[k]), int(sky[i]))
        rooms.append(
            Room(number, rank, float(worth[i]), float(heights[k]), leaves[inside], floor[inside])
        )
    return sorted(rooms, key=lambda r: (r.rank, -float(f"{r.size:.3g}"), r.storey, r.leaves.min()))


def _turns(
    heights: Floats, level: float | None, storey: Ints, covered: Floats, lit: Floats, eye: float
) -> Ints:
    """The turn of storeys at (s,) ``heights`` above ground at a ``level``, None if unknown, by the
    (n,) ``storey`` of floors, and m² of each under a ceiling and with daylight."""
    total, bright = (np.bincount(storey, area, len(heights)) for area in (covered, lit))
    dim = bright < _LIT_SHARE * total
    if level is None:
        large = np.where(dim & ~dim.all(), 0.0, total)
        level = float(heights[large >= _MAIN_SHARE * large.max()][0])
    off = heights - level
    off_ground, below = abs(off) > _AT_GROUND * eye, off < 0
    return np.lexsort((abs(off), below, dim, off_ground)).argsort()


def _kinds(
    around: Surroundings, points: Floats, height: Floats, weight: Floats, eye: float
) -> tuple[Ints, Bools]:
    """The `SpaceKind` of spaces by (n, k, 3) points in them, (n,) ``height`` metres above floors,
    and whether they are on a roof or a terrace: with a floor below theirs."""
    scale = eye / (WALKER.height * EYE)
    kind = space_kinds(around, points, height, weight, scale)
    under = points.copy()
    under[:, :, 1] -= (np.where(np.isfinite(height), height, 0.0) + _SLAB * scale)[:, None]
    down = np.tile([0.0, -1.0, 0.0], (under.size // 3, 1))
    floors = around.first(under.reshape(-1, 3), down)[1][:, 1] > 0  # not the ground's underside
    roof = np.isin(kind, (SpaceKind.COURT, SpaceKind.OPEN))
    return kind, roof & (floors.reshape(len(points), -1).mean(axis=1) > 0.5)


def _ground_level(
    scene: Scene,
    around: Surroundings,
    points: Floats,
    floor_below: Callable[[Floats], Floats],
    eye: float,
) -> float | None:
    """The height of the ground around the building, which has (n, k, 3) points; None without it."""
    plan = points.reshape(-1, 3)[:, [0, 2]]
    low, high = plan.min(axis=0) - _BEYOND * eye, plan.max(axis=0) + _BEYOND * eye
    share = (np.arange(_DROPS) + 0.5) / _DROPS
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
    drops = np.insert(low + grid * (high - low), 1, scene.points[:, 1].max(), axis=1)
    height = floor_below(drops)
    drops[:, 1] = height + eye
    drops = drops[np.isfinite(height)]
    if not len(drops):
        return None
    eyes = np.full(len(drops), eye)
    kind, roof = _kinds(around, drops[:, None], eyes, np.ones(len(drops)), eye)
    slab = _SLAB * eye / (WALKER.height * EYE)
    wall = around.free_about(drops - [0.0, eye + slab, 0.0]).min(axis=1, initial=np.inf) < slab
    wet = np.isin(kind, (SpaceKind.COURT, SpaceKind.OPEN)) & ~roof & ~wall
    wet &= around.walls_met(drops) > 0  # not the highest of all
    if np.count_nonzero(wet) < _GROUND_SHARE * len(grid):
        return None
    return float(np.quantile(drops[wet, 1] - eye, _LOW))


def _have_daylight(scene: Scene, around: Surroundings, points: Floats) -> Bools:
    """(n,) which spaces have daylight, by (n, k, 3) points in them."""
    if scene.opaque.any() and not scene.opaque.all():
        around = Surroundings(scene.corners[scene.opaque], scene.tolerance)
    sees = np.zeros(points.shape[:2], dtype=np.bool_)
    for i in range(0, len(points), _AT_ONCE):
        some = points[i : i + _AT_ONCE]
        sees[i : i + _AT_ONCE] = around.see_out(some.reshape(-1, 3), _RISES).reshape(some.shape[:2])
    return np.asarray(sees.any(axis=1))


def _is_roofless(cell: NDArray[np.int32], room: Floats, court: Floats) -> bool:
    """Whether a building's model has lost its ceilings, so that its rooms seem courts: some are as
    large as the largest room, and rooms hold next to nothing, such as the cabin of a lift.
    ``cell``, ``room``, ``court``: (n,) of each leaf, and its volume if it is one."""
    rooms, courts = np.bincount(cell, room), np.bincount(cell, court)
    as_large = np.count_nonzero(courts >= max(rooms.max(), np.finfo(np.float64).tiny))
    few = room.sum() <= _ROOFLESS_SHARE * (room.sum() + court.sum())
    return bool(few and as_large >= _ROOFLESS_COURTS)


def _look_points(points: Floats) -> Floats:
    """(5, 3) points in a convex body with these corners: its middle, and half the way from there to
    its ends along x and z."""
    middle = points.mean(axis=0)
    ends = [points[pick(points[:, axis])] for axis in (0, 2) for pick in (np.argmin, np.argmax)]
    return np.array([middle, *(middle + (np.array(ends) - middle) / 2)])
