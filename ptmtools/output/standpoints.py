"""Places to stand in the rooms of a scene, at eye height, away from the walls, with the best view
(`views`): one in each of the rooms that the model names, then in spaces that a visitor would call
rooms, then in courts, on open ground and in the rest (`room_kinds`); of each kind in those with the
largest floors first, the lower of equal ones. A room that the model names has one only.

`FloorFinder` finds the floor below a point: the nearest upward-facing surface. The squares of a
grid in plan list the floor triangles whose boxes they touch, so that a query looks at the triangles
of one square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.cells.options import WALKER
from ptmtools.cells.room_kinds import SpaceKind, space_kinds
from ptmtools.cells.structure import Surroundings
from ptmtools.output.model import EYE, Vector
from ptmtools.output.storeys import area, leaf_section
from ptmtools.output.views import Outlook
from ptmtools.scene.model import Scene

#: A surface is a floor if its normal is at most 45° off the vertical.
_FLOOR_SLOPE = np.cos(np.pi / 4)
#: Squares along each side of the grid, at most.
_SQUARES = 128


class FloorFinder:
    """The floors of a scene."""

    def __init__(self, scene: Scene) -> None:
        corners = scene.corners
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        up, length = normal[:, 1], np.linalg.norm(normal, axis=1)
        floor = np.where(scene.two_sided, abs(up), up) > _FLOOR_SLOPE * length
        self._corners = corners[floor & (length > 0)]
        plan = self._corners[:, :, [0, 2]]
        low, high = plan.min(axis=1, initial=np.inf), plan.max(axis=1, initial=-np.inf)
        self._side = int(np.clip(np.sqrt(len(plan)), 1, _SQUARES))
        self._least = low.min(axis=0, initial=np.inf)
        self._most = high.max(axis=0, initial=-np.inf)
        first, last = self._square(low), self._square(high)
        wide = last - first + 1
        count = wide.prod(axis=1)
        triangle = np.repeat(np.arange(len(plan)), count)
        place = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
        across = wide[triangle, 1]
        square = (first[triangle, 0] + place // across) * self._side
        square += first[triangle, 1] + place % across
        order = np.argsort(square, kind="stable")
        self._triangle = triangle[order]
        self._start = np.searchsorted(square[order], np.arange(self._side**2 + 1))

    def floor_below(self, points: Floats) -> Floats:
        """(n,) height of the nearest floor at or below each of (n, 3) points, or -inf."""
        heights = np.full(len(points), -np.inf)
        plan = points[:, [0, 2]]
        over = np.flatnonzero(((self._least <= plan) & (plan <= self._most)).all(axis=1))
        square = self._square(plan[over]) @ [self._side, 1]
        count = self._start[square + 1] - self._start[square]
        point = np.repeat(over, count)
        place = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
        near = self._triangle[np.repeat(self._start[square], count) + place]
        a, b, c = np.moveaxis(self._corners[near], 1, 0)
        ab, ac, ap = b - a, c - a, points[point] - a
        det = ab[:, 0] * ac[:, 2] - ab[:, 2] * ac[:, 0]
        u = (ap[:, 0] * ac[:, 2] - ap[:, 2] * ac[:, 0]) / det
        v = (ab[:, 0] * ap[:, 2] - ab[:, 2] * ap[:, 0]) / det
        height = a[:, 1] + u * ab[:, 1] + v * ac[:, 1]
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (height <= points[point, 1])
        np.maximum.at(heights, point[hit], height[hit])
        return heights

    def _square(self, plan: Floats) -> Ints:
        """(n, 2) row and column of the squares of (n, 2) points within the floors' box."""
        extent = np.maximum(self._most - self._least, np.finfo(np.float64).tiny)
        share = (plan - self._least) / extent
        square: Ints = (share * self._side).astype(np.int64)
        return np.minimum(np.maximum(square, 0), self._side - 1)


#: Number of leaves searched for a place, the largest first: of one cell, of all cells at least, and
#: for every requested room.
_OF_A_CELL = 3
_LEAVES = 96
_PER_ROOM = 4
#: Places tried in a leaf, along each axis of its plan.
_GRID = 7
#: Places of a leaf whose views are compared, the freest first.
_TRIES = 12
#: A roof is no thicker than this, metres for the default visitor.
_SLAB = 1.0
#: Without ceilings, rooms with one have at most this share of the space between walls, and at least
#: this number of courts are as large as the largest of them.
_ROOFLESS_SHARE, _ROOFLESS_COURTS = 0.05, 4
#: A walk may begin in a room with at least this share of the largest floor.
_AS_LARGE = 0.5
#: A browser stands on the highest surface around the eye: X_ITE in a square of half that side,
#: turned with the view. A bench or a step next to the feet would lift the eye, by this or more,
#: metres.
_LIFT = 0.01
_AROUND = np.array(
    [
        (share * np.cos(turn), share * np.sin(turn))
        for share in (np.sqrt(2), 1.0, 0.5)
        for turn in np.arange(16) * np.pi / 8
    ]
)


@dataclass(frozen=True)
class Standpoint:
    """A place to stand in a cell.

    Attributes
    ----------
    cell: its index.
    position: (3,) of the eye.
    yaw: radians, counter-clockwise from -Z, of the best view.
    worth: of that view.
    floor: height of the floor below.
    """

    cell: int
    position: Floats
    yaw: float
    worth: float
    floor: float


@dataclass(frozen=True)
class _Room:
    """A standing leaf: its rank, see `_ranks`, the height of its floor, and its section at eye
    height."""

    leaf: int
    rank: int
    floor: float
    section: Floats


def places(
    scene: Scene,
    cells: Cells,
    ground: FloorFinder,
    outlook: Outlook,
    avatar_size: Vector,
    count: int,
) -> list[Standpoint]:
    """At most ``count`` places: first the best view among the largest rooms of a storey that are
    of the best rank, then the others by rank and by the size of their floors."""
    eye = avatar_size[1]
    rooms = []
    ranks = _ranks(scene, cells, ground, eye)
    for leaf in largest_leaves(cells, max(_LEAVES, _PER_ROOM * count), ranks):
        floor = _floor(cells, leaf, ground)
        section = leaf_section(cells, leaf, floor + eye)
        if len(section) >= 3:
            rooms.append(_Room(leaf, int(ranks[leaf]), floor, section))
    by_room: dict[int, Standpoint] = {}
    numbers = cells.room_numbers.tolist()
    begin: list[Standpoint] = []
    best, least = 0, 0.0
    for room in sorted(rooms, key=_order):
        number, size = numbers[cells.leaf_cell[room.leaf]], area(room.section)
        as_good = not begin or (size >= least and room.rank == best)
        if len(by_room) >= count and not as_good:
            break
        if number not in by_room:
            place = _place_in(room, cells, ground, outlook, avatar_size)
            if place is not None:
                by_room[number] = place
                if not begin:
                    best, least = room.rank, _AS_LARGE * size
                if as_good and abs(place.floor - (begin or [place])[0].floor) < eye:
                    begin.append(place)
    first = max(begin, key=lambda place: place.worth, default=None)
    ordered = sorted(by_room.values(), key=lambda place: place is not first)
    return ordered[:count]


def _order(room: _Room) -> tuple[int, float, float, int]:
    """Rooms are ordered by rank and size; of those as large, the lowest come first."""
    return room.rank, -float(f"{area(room.section):.3g}"), room.floor, room.leaf


def largest_leaves(cells: Cells, count: int, ranks: Ints | None = None) -> list[int]:
    """At most ``count`` standing leaves, those of a lower rank of (L,) ``ranks`` first, then by the
    volume of their boxes, a few of each cell."""
    boxes = [np.ptp(cells.leaf_points(i), axis=0).prod() for i in range(cells.leaf_count)]
    taken = np.zeros(cells.cell_count, dtype=np.int64)
    leaves = []
    ranks = np.zeros(cells.leaf_count, dtype=np.int64) if ranks is None else ranks
    for leaf in np.lexsort((-np.array(boxes), ranks)).tolist():
        cell = cells.leaf_cell[leaf]
        if cells.leaf_standing[leaf] and taken[cell] < _OF_A_CELL:
            taken[cell] += 1
            leaves.append(leaf)
        if len(leaves) == count:
            break
    return leaves


def _ranks(scene: Scene, cells: Cells, ground: FloorFinder, eye: float) -> Ints:
    """(L,) the rank of each leaf: 0 of rooms with a name, else by its `SpaceKind`, roofs after the
    ground; that of leaves that do not stand is meaningless."""
    result = np.zeros(cells.leaf_count, dtype=np.int64)
    named = np.array([bool(cells.room_name(cell)) for cell in range(cells.cell_count)])
    leaves = np.flatnonzero(cells.leaf_standing & (cells.leaf_cell >= 0))
    leaves = leaves[~named[cells.leaf_cell[leaves]]]
    if not len(leaves):
        return result
    points = np.stack([_look_points(cells.leaf_points(leaf)) for leaf in leaves.tolist()])
    floor = ground.floor_below(points[:, 0])
    low, high = (
        np.array([fit(cells.leaf_points(leaf)[:, 1]) for leaf in leaves.tolist()])
        for fit in (np.min, np.max)
    )
    fits = (floor + eye > low) & (floor + eye < high)
    height = np.where(fits, eye, np.maximum(points[:, 0, 1] - floor, 0.0))
    points[:, :, 1] = np.where(fits, floor + eye, points[:, 0, 1])[:, None]
    around = Surroundings(scene.corners, scene.tolerance)
    volume = cells.leaf_volumes()[leaves]
    scale = eye / (WALKER.height * EYE)
    kind = space_kinds(around, points, height, volume, scale)
    # A roof, or a terrace, has a floor below.
    points[:, :, 1] = np.where(np.isfinite(floor), floor, 0.0)[:, None] - _SLAB * scale
    down = np.tile([0.0, -1.0, 0.0], (points.size // 3, 1))
    floors = around.first(points.reshape(-1, 3), down)[1][:, 1] > 0  # not the ground's underside
    roof = np.isin(kind, (SpaceKind.COURT, SpaceKind.OPEN))
    roof &= floors.reshape(len(leaves), -1).mean(axis=1) > 0.5
    court = (kind == SpaceKind.COURT) & ~roof
    if _is_roofless(cells.leaf_cell[leaves], volume * (kind <= SpaceKind.HALL), volume * court):
        kind[court] = SpaceKind.ROOM
    result[leaves] = 1 + 2 * kind + roof
    return result


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


def _floor(cells: Cells, leaf: int, ground: FloorFinder) -> float:
    """The height of the floor of a leaf: the median over a grid, so that a table in its middle does
    not count."""
    middle = cells.leaf_points(leaf).mean(axis=0)
    section = leaf_section(cells, leaf, float(middle[1]))
    plan = _grid(section) if len(section) >= 3 else middle[None, [0, 2]]
    below = np.sort(ground.floor_below(np.insert(plan, 1, middle[1], axis=1)))
    return float(below[len(below) // 2])


def _place_in(
    room: _Room,
    cells: Cells,
    ground: FloorFinder,
    outlook: Outlook,
    avatar_size: Vector,
) -> Standpoint | None:
    keep_off, eye, step = avatar_size
    grid, walls = _grid(room.section), outlook.walls(room.floor + eye)
    # A wall outside of the section is farther off than the section's own sides.
    least, greatest = room.section.min(axis=0), room.section.max(axis=0)
    near = ((walls.max(axis=1) >= least) & (walls.min(axis=1) <= greatest)).all(axis=1)
    sides = np.stack([room.section, np.roll(room.section, -1, axis=0)], axis=1)
    clearance = _distance(grid, np.concatenate([walls[near], sides]))
    grid = grid[np.argsort(-clearance, kind="stable")][: int((clearance >= keep_off).sum())]
    position = np.insert(grid, 1, room.floor + eye, axis=1)
    floor = ground.floor_below(position)
    position[:, 1] = floor + eye
    good = (abs(floor - room.floor) <= step) & (cells.locate_leaf(position) == room.leaf)
    waiting, tried = np.flatnonzero(good), np.zeros(0, dtype=np.int64)
    while len(waiting) and len(tried) < _TRIES:
        batch, waiting = waiting[:_TRIES], waiting[_TRIES:]
        level = _level(position[batch], floor[batch], ground, keep_off)
        tried = np.append(tried, batch[level])[:_TRIES]
    if len(tried) == 0:
        return None
    view = outlook.best(position[tried], room.floor + eye)
    cell, i = int(cells.leaf_cell[room.leaf]), tried[view.place]
    return Standpoint(cell, position[i], view.yaw, view.worth, float(floor[i]))


def _level(position: Floats, floor: Floats, ground: FloorFinder, radius: float) -> Bools:
    """(n,) whether no floor around (n, 3) positions lies above the one at the position itself."""
    around = np.repeat(position[:, None], len(_AROUND), axis=1)
    around[..., [0, 2]] += radius * _AROUND
    height = ground.floor_below(around.reshape(-1, 3)).reshape(len(position), len(_AROUND))
    return np.asarray((height < floor[:, None] + _LIFT).all(axis=1))


def _grid(polygon: Floats) -> Floats:
    """(n, 2) points of a regular grid that lie inside a convex counter-clockwise polygon."""
    share = (np.arange(_GRID) + 0.5) / _GRID
    least, greatest = polygon.min(axis=0), polygon.max(axis=0)
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
    points = least + grid * (greatest - least)
    a, b = polygon, np.roll(polygon, -1, axis=0)
    edge, to = b - a, points[:, None] - a
    inside = np.all(edge[:, 0] * to[..., 1] - edge[:, 1] * to[..., 0] > 0, axis=1)
    inner: Floats = points[inside]
    return inner if len(inner) else polygon.mean(axis=0)[None]


def _distance(points: Floats, segments: Floats) -> Floats:
    """(n,) distance of each (n, 2) point to the nearest of (m, 2, 2) segments."""
    a, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    length = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
    to = points[:, None] - a
    share = np.clip((to * along).sum(axis=2) / length, 0, 1)
    off = share[..., None] * along - to
    return np.asarray(np.sqrt((off**2).sum(axis=2)).min(axis=1))
