"""Places to stand in the rooms of a scene, at eye height, away from the walls, with the best view
(`views`): one in each room, in the order of `visits`.

`FloorFinder` finds the floor below a point: the nearest upward-facing surface. The squares of a
grid in plan list the floor triangles whose boxes they touch, so that a query looks at the triangles
of one square.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.output.model import Vector
from ptmtools.output.storeys import area, leaf_section
from ptmtools.output.views import Outlook
from ptmtools.output.visits import Room, rooms_to_visit
from ptmtools.scene.model import Scene
from ptmtools.tolerance import ROUNDING_SHARE

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


#: Number of leaves of a room searched for a place, the largest first.
_OF_A_ROOM = 12
#: Places tried in a leaf, along each axis of its plan.
_GRID = 7
#: Places of a room whose views are compared, the freest first.
_TRIES = 12
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
    storey: height of the storey's main floor.
    indoors: whether the room has a name or a ceiling.
    """

    cell: int
    position: Floats
    yaw: float
    worth: float
    storey: float
    indoors: bool


def places(
    scene: Scene,
    cells: Cells,
    ground: FloorFinder,
    outlook: Outlook,
    avatar_size: Vector,
    count: int,
    taken: Set[int],
) -> tuple[list[Standpoint], int]:
    """At most ``count`` places in rooms whose numbers are not ``taken``: first the best view among
    the largest of the rooms that are as good to begin in as the first one, then the others in the
    order of `rooms_to_visit`; and the number of rooms under a ceiling, or with a name, that come
    after these."""
    rooms = rooms_to_visit(scene, cells, ground.floor_below, avatar_size[1])
    by_room: dict[int, Standpoint] = {}
    best: list[tuple[Room, Standpoint]] = []
    waiting: set[int] = set()
    for room in rooms:
        as_good = not best or (
            room.rank == best[0][0].rank and room.size >= _AS_LARGE * best[0][0].size
        )
        if room.number in taken or room.number in by_room:
            continue
        if len(by_room) >= count and not as_good:
            waiting |= {room.number} if room.is_indoors else set()
        elif place := _place_in(room, cells, ground, outlook, avatar_size):
            by_room[room.number] = place
            best += [(room, place)] if as_good else []
    first = max((place for _, place in best), key=lambda place: place.worth, default=None)
    ordered = sorted(by_room.values(), key=lambda place: place is not first)
    return ordered[:count], len(waiting - by_room.keys()) + len(ordered[count:])


def _place_in(
    room: Room,
    cells: Cells,
    ground: FloorFinder,
    outlook: Outlook,
    avatar_size: Vector,
) -> Standpoint | None:
    """The best view from the freest places on the floor that is most of the room's."""
    keep_off, eye, step = avatar_size
    leaves, heights = room.leaves[:_OF_A_ROOM], room.floors[:_OF_A_ROOM] + eye
    sections = [
        leaf_section(cells, *at) for at in zip(leaves.tolist(), heights.tolist(), strict=True)
    ]
    cut = [i for i, section in enumerate(sections) if len(section) >= 3]
    if not cut:
        return None
    grids = [_grid(sections[i]) for i in cut]
    number = np.repeat(cut, [len(grid) for grid in grids])
    position = np.insert(np.concatenate(grids), 1, heights[number], axis=1)
    floor = ground.floor_below(position)
    share = np.array([area(section) for section in sections])
    share /= np.bincount(number, minlength=len(sections)).clip(1)
    near = abs(floor - room.storey) <= eye
    if not near.any():
        return None
    main = _main_floor(floor, share[number] * near, step)
    walls = outlook.walls(main + eye)
    clearance = np.concatenate(
        [_clearance(g, sections[i], walls) for g, i in zip(grids, cut, strict=True)]
    )
    position[:, 1] = floor + eye
    good = near & (abs(floor - main) <= step) & (clearance >= keep_off)
    good &= cells.locate_leaf(position) == leaves[number]
    waiting, tried = np.flatnonzero(good), np.zeros(0, dtype=np.int64)
    waiting = waiting[np.argsort(-clearance[waiting], kind="stable")]
    while len(waiting) and len(tried) < _TRIES:
        batch, waiting = waiting[:_TRIES], waiting[_TRIES:]
        level = _level(position[batch], floor[batch], ground, keep_off)
        tried = np.append(tried, batch[level])[:_TRIES]
    if len(tried) == 0:
        return None
    view = outlook.best(position[tried], main + eye)
    i = tried[view.place]
    cell = int(cells.leaf_cell[leaves[number[i]]])
    return Standpoint(cell, position[i], view.yaw, view.worth, room.storey, room.is_indoors)


def _main_floor(floor: Floats, area: Floats, step: float) -> float:
    """The height within a ``step`` of which the most floor lies, the lowest of equal ones: of a
    platform and its tracks the one that is larger, of a floor and the tables on it the floor.

    Parameters
    ----------
    floor, area: (n,) heights of points, and what each stands for, m².
    """
    order = np.argsort(floor, kind="stable")
    height, total = floor[order], np.append(0.0, np.cumsum(area[order]))
    low = np.searchsorted(height, height - step)
    high = np.searchsorted(height, height + step, side="right")
    near = np.where(np.isfinite(height), total[high] - total[low], -1.0)
    return float(height[near >= (1 - ROUNDING_SHARE) * near.max()][0])


def _clearance(grid: Floats, section: Floats, walls: Floats) -> Floats:
    """(n,) distance of (n, 2) points in a section to its sides and the ``walls`` in it: others are
    farther off."""
    least, greatest = section.min(axis=0), section.max(axis=0)
    near = ((walls.max(axis=1) >= least) & (walls.min(axis=1) <= greatest)).all(axis=1)
    sides = np.stack([section, np.roll(section, -1, axis=0)], axis=1)
    return _distance(grid, np.concatenate([walls[near], sides]))


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
