"""The ground of a walk as a graph: places of the eye, and steps between them.

A step costs metres, and more where it is narrow or steep or leads over furniture, so that the
cheapest way is one that a visitor would take.

`WalkObstacles` blocks bodies and eyes: rays against the whole model, glass and furniture included,
except open door leaves. Embree computes in single precision, here around the middle of the model.

`over_floors` places the eye over floors, on a grid. The eye region's floor (`Cells.eye_floor`) is
as wide as a body around the possible positions of its middle, so it leads through the narrowest
door. It also widens over lower floor: of surfaces one step apart the foot is on the existing one,
which a ray straight down finds, and of several existing ones on the upper.

An eye never goes through a surface. A body does where there is no other way: detail of the
subdivision, such as a chair, does not keep the walker from a room beyond. Such steps have a high
cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, ranges
from ptmtools.cells.model import Cells, EyeRegion
from ptmtools.cells.options import Walker
from ptmtools.embree import ray_tree
from ptmtools.jit import kernel
from ptmtools.scene.model import Scene


@kernel
def nearest_goal(start: Ints, target: Ints, cost: Floats, source: int, goal: Bools) -> Ints:
    """Dijkstra's algorithm from a ``source`` to the nearest of the (n,) ``goal`` places: the places
    on the way, or none."""
    count = len(start) - 1
    least = np.full(count, np.inf)
    before = np.full(count, -1, dtype=np.int64)
    least[source] = 0.0
    heap = [(0.0, source)]
    nearest = -1
    while len(heap):
        paid, place = heappop(heap)
        if paid > least[place]:
            continue
        if goal[place]:
            nearest = place
            break
        for step in range(start[place], start[place + 1]):
            to, sum_ = target[step], paid + cost[step]
            if sum_ < least[to]:
                least[to] = sum_
                before[to] = place
                heappush(heap, (sum_, to))
    length, place = 0, nearest
    while place >= 0:
        length += 1
        place = before[place]
    way = np.empty(length, dtype=np.int64)
    place = nearest
    while place >= 0:
        length -= 1
        way[length] = place
        place = before[place]
    return way


@kernel
def spread_parts(start: Ints, target: Ints, part: Ints) -> int:
    """Writes the number of the connected part of each place to (n,) ``part``, all -1 before;
    returns the number of parts."""
    waiting = np.empty(len(part), dtype=np.int64)
    parts = 0
    for first in range(len(part)):
        if part[first] >= 0:
            continue
        part[first] = parts
        waiting[0] = first
        count = 1
        while count:
            count -= 1
            place = waiting[count]
            for step in range(start[place], start[place + 1]):
                to = target[step]
                if part[to] < 0:
                    part[to] = parts
                    waiting[count] = to
                    count += 1
        parts += 1
    return parts


@dataclass(frozen=True)
class WalkGround:
    """Places of the eye, and the steps between them.

    Attributes
    ----------
    eye: (n, 3) metres.
    cell: (n,) cell of each place, or -1.
    space: (n,) metres to the nearest obstacle, at most `ABOUT`; 0 where nothing supports the foot.
    start, target, cost: steps as CSR over places: (n + 1,), (m,) target places, and (m,) costs.
    """

    eye: Floats
    cell: Ints
    space: Floats
    start: Ints
    target: Ints
    cost: Floats

    @staticmethod
    def from_steps(eye: Floats, cell: Ints, space: Floats, steps: Ints, cost: Floats) -> WalkGround:
        """From (k, 2) steps, walkable in both directions, and their (k,) costs."""
        both = np.concatenate([steps, steps[:, ::-1]])
        order = np.lexsort((both[:, 1], both[:, 0]))
        start = np.searchsorted(both[order, 0], np.arange(len(eye) + 1))
        return WalkGround(eye, cell, space, start, both[order, 1], np.tile(cost, 2)[order])

    def main_part(self, standing: Bools) -> WalkGround:
        """The connected part that reaches most of the (C,) ``standing`` cells; of equal parts the
        one with most places."""

        if not len(self.eye):
            return self
        part = np.full(len(self.eye), -1, dtype=np.int64)
        parts = spread_parts(self.start, self.target, part)
        known = self.cell >= 0
        known[known] = standing[self.cell[known]]
        reached = np.unique(np.column_stack([part[known], self.cell[known]]), axis=0)[:, 0]
        cells, places = np.bincount(reached, minlength=parts), np.bincount(part)
        return self._keep(part == np.lexsort((-places, -cells))[0])

    def _keep(self, kept: Bools) -> WalkGround:
        name = np.cumsum(kept) - 1
        source = np.repeat(np.arange(len(self.eye)), np.diff(self.start))
        inside = kept[source] & kept[self.target]
        start = np.searchsorted(name[source[inside]], np.arange(int(kept.sum()) + 1))
        target, cost = name[self.target[inside]], self.cost[inside]
        return WalkGround(self.eye[kept], self.cell[kept], self.space[kept], start, target, cost)

    def way_to_nearest(self, source: int, goal: Bools) -> Ints:
        """The places on the cheapest way from ``source`` to the nearest of the (n,) ``goal``
        places, both ends included; none without a way."""

        return np.asarray(nearest_goal(self.start, self.target, self.cost, source, goal))


#: Rays cast together; their arrays fit the processor's cache.
_RAYS = 1 << 16


class WalkObstacles:
    """The triangles of a scene that block a walker."""

    def __init__(self, scene: Scene, cells: Cells) -> None:
        solid = np.ones(len(scene.triangles), dtype=np.bool_)
        solid[cells.opened] = False
        self._which = np.append(np.flatnonzero(solid), -1)
        self._middle = (scene.points.min(axis=0) + scene.points.max(axis=0)) / 2
        self._tree: Any = None
        if solid.any():
            self._tree = ray_tree(scene.points[scene.triangles[solid]] - self._middle)

    def blocks(self, start: Floats, end: Floats) -> Bools:
        """(n,) whether a surface lies between (n, 3) points and (n, 3) others, metres."""
        result: Bools = self.first(start, end - start, 1.0)[0] >= 0
        return result

    def first(self, points: Floats, along: Floats, reach: float = np.inf) -> tuple[Ints, Floats]:
        """The first hits of rays from (n, 3) points along (n, 3) vectors within a ``reach``: (n,)
        the scene's triangle, or -1, and (n,) the distance, or the reach; in lengths of the
        vectors."""
        met, distance = np.full(len(points), -1, dtype=np.int64), np.full(len(points), reach)
        for row in range(0, len(points) if self._tree is not None else 0, _RAYS):
            some = slice(row, row + _RAYS)
            origin = np.ascontiguousarray(points[some] - self._middle, dtype=np.float32)
            direction = np.ascontiguousarray(along[some], dtype=np.float32)
            limit = np.full(len(origin), reach, dtype=np.float32)
            hit = self._tree.run(origin, direction, dists=limit, output=True)
            met[some] = self._which[hit["primID"]]
            distance[some] = np.where(met[some] >= 0, hit["tfar"], reach)
        return met, distance


#: Metres between places; and the finer grid, as a share, in cells that the first one misses.
GRID, _FINE = 0.25, 0.2
#: Offset of the grid, as a share: not at round numbers, where walls are.
_SHIFT = (5**0.5 - 1) / 2
#: Largest distance to an obstacle that matters, metres.
ABOUT = 0.6
#: Largest vertical distance of the surface under the foot from a place, as a share of a step.
_UNDERFOOT = 0.2
#: Heights at which the body is tested, as shares of that of the eye.
BODY = (0.19, 0.62, 1.0)
#: Factors of the length of a step in its cost: most beside obstacles, and added where no body fits,
#: where it rises or falls by more than half a step, and through surfaces below the eye.
_BESIDE, _NARROW, _STEEP, _THROUGH = 4.0, 10.0, 3.0, 20.0
#: Level directions in which obstacles are searched.
_STEP_RAYS = 8


def over_floors(cells: Cells, obstacles: WalkObstacles, eye_height: float) -> WalkGround:
    """Places an eye's height, metres, above floors, and the steps between them."""
    eyes, walker = cells.eyes, cells.walker
    point, firm = _surfaces(cells.eye_floor, GRID, eyes, obstacles, walker, eye_height)
    cell = cells.locate(point).astype(np.int64)
    missed = cells.standing
    missed[cell[cell >= 0]] = False
    floor = cells.eye_floor[_floors_below(cells, missed, eye_height)]
    if len(floor):
        fine, present = _surfaces(floor, _FINE * GRID, eyes, obstacles, walker, eye_height)
        within = cells.locate(fine)
        extra = (within >= 0) & missed[within]
        point, cell = np.concatenate([point, fine[extra]]), np.append(cell, within[extra])
        firm = np.append(firm, present[extra])
    steps = _steps(point, walker, eyes, obstacles)
    space = np.where(firm, _space(point, obstacles, eye_height), 0.0)
    return WalkGround.from_steps(
        point, cell, space, steps, _cost(point, space, steps, obstacles, walker, eye_height)
    )


def _floors_below(cells: Cells, missed: Bools, eye_height: float) -> Bools:
    """(n,) which triangles of floor lie below an eye in a leaf of the (C,) ``missed`` cells."""
    corner = cells.eye_floor + [0, eye_height, 0]
    low, high = corner.min(axis=1), corner.max(axis=1)
    result = np.zeros(len(corner), dtype=np.bool_)
    leaves = np.flatnonzero(cells.leaf_standing & (cells.leaf_cell >= 0))
    for leaf in leaves[missed[cells.leaf_cell[leaves]]]:
        point = cells.leaf_points(leaf)
        result |= ((low <= point.max(axis=0)) & (high >= point.min(axis=0))).all(axis=1)
    return result


def _surfaces(
    floor: Floats,
    grid: float,
    eyes: EyeRegion,
    obstacles: WalkObstacles,
    walker: Walker,
    eye_height: float,
) -> tuple[Floats, Bools]:
    """(n, 3) eyes over columns of a grid, one for each surface that supports a foot, and (n,)
    whether the surface exists there: false over an edge or within a table."""
    column, point = grid_points(floor, grid)
    eye = point + [0, eye_height, 0]
    inside = eyes.contains(eye)
    column, eye = column[inside], eye[inside]
    down = np.tile([0.0, -1.0, 0.0], (len(eye), 1))
    _, depth = obstacles.first(eye, down, 2 * eye_height)
    underfoot = abs(depth - eye_height) <= _UNDERFOOT * walker.step
    chosen = _footholds(column, eye[:, 1], underfoot, walker.step)
    return eye[chosen], underfoot[chosen]


def grid_points(floor: Floats, grid: float) -> tuple[Ints, Floats]:
    """The intersections of columns on a ``grid``, metres, with (m, 3, 3) triangles: (n, 2) the
    column, and (n, 3) the point."""
    plan = floor[:, :, [0, 2]] / grid - _SHIFT
    edge = np.roll(plan, -1, axis=1) - plan
    wide = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
    row = np.flatnonzero(wide != 0)
    # Along each grid line that a triangle meets, from the least to the greatest crossing.
    first = np.ceil(plan[row, :, 0].min(axis=1)).astype(np.int64)
    count = np.floor(plan[row, :, 0].max(axis=1)).astype(np.int64) - first + 1
    row, across = np.repeat(row, count), ranges(first, count)
    turn = np.where(edge[row, :, 0] != 0, edge[row, :, 0], 1.0)
    share = (across[:, None] - plan[row, :, 0]) / turn
    meets = (edge[row, :, 0] != 0) & (share >= 0) & (share <= 1)
    crossing = plan[row, :, 1] + share * edge[row, :, 1]
    least = np.ceil(np.where(meets, crossing, np.inf).min(axis=1))
    last = np.floor(np.where(meets, crossing, -np.inf).max(axis=1))
    some = last >= least
    row, across, first = row[some], across[some], least[some].astype(np.int64)
    count = last[some].astype(np.int64) - first + 1
    column = np.column_stack([np.repeat(across, count), ranges(first, count)])
    row = np.repeat(row, count)
    # Heights, by barycentric coordinates.
    away = column[:, None] - plan[row]
    offset = edge[row][:, :, 0] * away[:, :, 1] - edge[row][:, :, 1] * away[:, :, 0]
    share = np.roll(offset, -1, axis=1) / wide[row, None]
    height = (share * floor[row, :, 1]).sum(axis=1)
    at = (column + _SHIFT) * grid
    return column, np.column_stack([at[:, 0], height, at[:, 1]])


def _footholds(column: Ints, height: Floats, present: Bools, step: float) -> Ints:
    """The surfaces in each column that support a foot: existing ones before others, the upper
    before the lower, and none less than a step from another."""
    candidates = np.lexsort((-height, ~present, column[:, 1], column[:, 0]))
    kept = [candidates[:0]]
    while len(candidates):
        same = (np.diff(column[candidates], axis=0) == 0).all(axis=1)
        first = np.flatnonzero(np.append(True, ~same))
        best = np.repeat(candidates[first], np.diff(np.append(first, len(candidates))))
        kept.append(candidates[first])
        candidates = candidates[abs(height[candidates] - height[best]) > step]
    return np.sort(np.concatenate(kept))


def _steps(point: Floats, walker: Walker, eyes: EyeRegion, obstacles: WalkObstacles) -> Ints:
    """(k, 2) pairs of places between which an eye can move in a step."""
    reach = 1.5 * GRID
    box = np.floor(point[:, [0, 2]] / reach).astype(np.int64)
    box -= box.min(axis=0, initial=0) - 1
    wide = int(box[:, 1].max(initial=0)) + 2
    key = box[:, 0] * wide + box[:, 1]
    order = np.argsort(key, kind="stable")
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for neighbour in (0, 1, wide - 1, wide, wide + 1):
        low = np.searchsorted(key[order], key + neighbour)
        count = np.searchsorted(key[order], key + neighbour, "right") - low
        source, target = np.repeat(np.arange(len(point)), count), order[ranges(low, count)]
        offset = point[target] - point[source]
        near = (np.hypot(offset[:, 0], offset[:, 2]) <= reach) & (abs(offset[:, 1]) <= walker.step)
        near &= (source < target) | (neighbour > 0)
        pairs.append(np.column_stack([source, target])[near])
    steps = np.concatenate(pairs)
    steps = steps[np.lexsort((steps[:, 1], steps[:, 0]))]
    start, end = point[steps[:, 0]], point[steps[:, 1]]
    steps = steps[eyes.contains((start + end) / 2)]
    return steps[~obstacles.blocks(point[steps[:, 0]], point[steps[:, 1]])]


def _space(point: Floats, obstacles: WalkObstacles, eye_height: float) -> Floats:
    """(n,) metres to the nearest obstacle on one level with the body, at most `ABOUT`."""
    angle = 2 * np.pi * (np.arange(_STEP_RAYS) + 0.5) / _STEP_RAYS
    space = np.full(len(point), ABOUT)
    for height in BODY:
        body = point - [0, (1 - height) * eye_height, 0]
        for x, z in zip(np.cos(angle), np.sin(angle), strict=True):
            along = np.tile([x, 0.0, z], (len(point), 1))
            space = np.minimum(space, obstacles.first(body, along, ABOUT)[1])
    return space


def _cost(
    point: Floats,
    space: Floats,
    steps: Ints,
    obstacles: WalkObstacles,
    walker: Walker,
    eye_height: float,
) -> Floats:
    """(k,) costs of steps."""
    start, end = point[steps[:, 0]], point[steps[:, 1]]
    room = space[steps].min(axis=1)
    cost = 1 + _BESIDE * (1 - room / ABOUT) ** 2 + _NARROW * (room < walker.radius)
    cost += _STEEP * (abs(end[:, 1] - start[:, 1]) > walker.step / 2)
    through = np.zeros(len(steps), dtype=np.bool_)
    for height in BODY[:-1]:
        below = [0, (1 - height) * eye_height, 0]
        through |= obstacles.blocks(start - below, end - below)
    return np.asarray((cost + _THROUGH * through) * np.linalg.norm(end - start, axis=1))
