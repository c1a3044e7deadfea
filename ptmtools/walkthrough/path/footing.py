"""Places on floors, on a grid, and steps between them.

The eye region's floor (`Cells.eye_floor`) is as wide as a body around where its middle can be, so
it leads through the narrowest door. It is widened over lower floor too: of surfaces one step apart
the foot is on the one that is there, which a ray straight down tells, and of these on the upper.

An eye never goes through a surface. A body does where there is no other way: what the subdivision
takes for detail, such as a chair, does not keep the walker from a room beyond. Such steps are dear.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.eyes import EyeRegion
from ptmtools.cells.model import Cells
from ptmtools.cells.options import Walker
from ptmtools.cells.vectors import ranges
from ptmtools.walkthrough.path.ground import Ground
from ptmtools.walkthrough.path.obstacles import Obstacles

#: Metres between places; and of the finer grid in cells that the first one misses, as a share.
GRID, _FINE = 0.25, 0.2
#: Where the grid begins, as a share: not at round numbers, where walls are.
_SHIFT = (5**0.5 - 1) / 2
#: Metres from a place within which things stand about.
ABOUT = 0.6
#: The foot is on what is so near below or above a place, as a share of a step.
_UNDERFOOT = 0.2
#: Heights of the body that things are looked for at, as shares of that of the eye.
BODY = (0.19, 0.62, 1.0)
#: A step costs so many times its length: at most where things stand about, more where no body fits,
#: where it goes up or down by more than half of a step, and through what an eye would see over.
_BESIDE, _NARROW, _STEEP, _THROUGH = 4.0, 10.0, 3.0, 20.0
#: Level directions in which things are looked for.
_RAYS = 8


def over_floors(cells: Cells, obstacles: Obstacles, eye_height: float) -> Ground:
    """Places an eye's height above floors, metres, and the steps between them."""
    eyes, walker = cells.eyes, cells.walker
    point, firm = _surfaces(cells.eye_floor, GRID, eyes, obstacles, walker, eye_height)
    cell = cells.locate(point).astype(np.int64)
    missed = cells.standing
    missed[cell[cell >= 0]] = False
    floor = cells.eye_floor[_below(cells, missed, eye_height)]
    if len(floor):
        fine, there = _surfaces(floor, _FINE * GRID, eyes, obstacles, walker, eye_height)
        within = cells.locate(fine)
        extra = (within >= 0) & missed[within]
        point, cell = np.concatenate([point, fine[extra]]), np.append(cell, within[extra])
        firm = np.append(firm, there[extra])
    steps = _steps(point, walker, eyes, obstacles)
    space = np.where(firm, _space(point, obstacles, eye_height), 0.0)
    return Ground.of(
        point, cell, space, steps, _cost(point, space, steps, obstacles, walker, eye_height)
    )


def _below(cells: Cells, missed: Bools, eye_height: float) -> Bools:
    """(n,) which triangles of floor some eye is above in a leaf of the (C,) cells marked."""
    corner = cells.eye_floor + [0, eye_height, 0]
    low, high = corner.min(axis=1), corner.max(axis=1)
    found = np.zeros(len(corner), dtype=np.bool_)
    leaves = np.flatnonzero(cells.leaf_standing & (cells.leaf_cell >= 0))
    for leaf in leaves[missed[cells.leaf_cell[leaves]]]:
        point = cells.leaf_points(leaf)
        found |= ((low <= point.max(axis=0)) & (high >= point.min(axis=0))).all(axis=1)
    return found


def _surfaces(
    floor: Floats,
    grid: float,
    eyes: EyeRegion,
    obstacles: Obstacles,
    walker: Walker,
    eye_height: float,
) -> tuple[Floats, Bools]:
    """(n, 3) eyes over columns of a grid, one for each surface that a foot can be on, and (n,)
    whether it is there: not over an edge, or within a table."""
    column, point = grid_points(floor, grid)
    eye = point + [0, eye_height, 0]
    inside = eyes.contains(eye)
    column, eye = column[inside], eye[inside]
    down = np.tile([0.0, -1.0, 0.0], (len(eye), 1))
    _, far = obstacles.first(eye, down, 2 * eye_height)
    there = abs(far - eye_height) <= _UNDERFOOT * walker.step
    chosen = _footholds(column, eye[:, 1], there, walker.step)
    return eye[chosen], there[chosen]


def grid_points(floor: Floats, grid: float) -> tuple[Ints, Floats]:
    """What of columns on a ``grid``, metres, meets (m, 3, 3) triangles: (n, 2) the column, and
    (n, 3) the point."""
    plan = floor[:, :, [0, 2]] / grid - _SHIFT
    edge = np.roll(plan, -1, axis=1) - plan
    wide = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
    row = np.flatnonzero(wide != 0)
    # Along each line of the grid that a triangle meets, from the least to the greatest crossing.
    first = np.ceil(plan[row, :, 0].min(axis=1)).astype(np.int64)
    count = np.floor(plan[row, :, 0].max(axis=1)).astype(np.int64) - first + 1
    row, across = np.repeat(row, count), ranges(first, count)
    turn = np.where(edge[row, :, 0] != 0, edge[row, :, 0], 1.0)
    share = (across[:, None] - plan[row, :, 0]) / turn
    meets = (edge[row, :, 0] != 0) & (share >= 0) & (share <= 1)
    crossing = plan[row, :, 1] + share * edge[row, :, 1]
    least = np.ceil(np.where(meets, crossing, np.inf).min(axis=1))
    most = np.floor(np.where(meets, crossing, -np.inf).max(axis=1))
    some = most >= least
    row, across, first = row[some], across[some], least[some].astype(np.int64)
    count = most[some].astype(np.int64) - first + 1
    column = np.column_stack([np.repeat(across, count), ranges(first, count)])
    row = np.repeat(row, count)
    # By the shares of the corners.
    away = column[:, None] - plan[row]
    beside = edge[row][:, :, 0] * away[:, :, 1] - edge[row][:, :, 1] * away[:, :, 0]
    share = np.roll(beside, -1, axis=1) / wide[row, None]
    height = (share * floor[row, :, 1]).sum(axis=1)
    at = (column + _SHIFT) * grid
    return column, np.column_stack([at[:, 0], height, at[:, 1]])


def _footholds(column: Ints, height: Floats, there: Bools, step: float) -> Ints:
    """Which of the surfaces in each column a foot can be on: those that are there before those that
    are not, the upper before the lower, and none less than a step from another."""
    left = np.lexsort((-height, ~there, column[:, 1], column[:, 0]))
    kept = [left[:0]]
    while len(left):
        same = (np.diff(column[left], axis=0) == 0).all(axis=1)
        first = np.flatnonzero(np.append(True, ~same))
        best = np.repeat(left[first], np.diff(np.append(first, len(left))))
        kept.append(left[first])
        left = left[abs(height[left] - height[best]) > step]
    return np.sort(np.concatenate(kept))


def _steps(point: Floats, walker: Walker, eyes: EyeRegion, obstacles: Obstacles) -> Ints:
    """(k, 2) pairs of places from one of which an eye gets to the other in a step."""
    reach = 1.5 * GRID
    box = np.floor(point[:, [0, 2]] / reach).astype(np.int64)
    box -= box.min(axis=0, initial=0) - 1
    wide = int(box[:, 1].max(initial=0)) + 2
    key = box[:, 0] * wide + box[:, 1]
    order = np.argsort(key, kind="stable")
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for beside in (0, 1, wide - 1, wide, wide + 1):
        low = np.searchsorted(key[order], key + beside)
        count = np.searchsorted(key[order], key + beside, "right") - low
        one, other = np.repeat(np.arange(len(point)), count), order[ranges(low, count)]
        far = point[other] - point[one]
        near = (np.hypot(far[:, 0], far[:, 2]) <= reach) & (abs(far[:, 1]) <= walker.step)
        near &= (one < other) | (beside > 0)
        pairs.append(np.column_stack([one, other])[near])
    steps = np.concatenate(pairs)
    steps = steps[np.lexsort((steps[:, 1], steps[:, 0]))]
    start, end = point[steps[:, 0]], point[steps[:, 1]]
    steps = steps[eyes.contains((start + end) / 2)]
    return steps[~obstacles.crossed(point[steps[:, 0]], point[steps[:, 1]])]


def _space(point: Floats, obstacles: Obstacles, eye_height: float) -> Floats:
    """(n,) metres to the nearest thing on one level with the body, at most `ABOUT`."""
    angle = 2 * np.pi * (np.arange(_RAYS) + 0.5) / _RAYS
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
    obstacles: Obstacles,
    walker: Walker,
    eye_height: float,
) -> Floats:
    """(k,) what steps cost."""
    start, end = point[steps[:, 0]], point[steps[:, 1]]
    room = space[steps].min(axis=1)
    cost = 1 + _BESIDE * (1 - room / ABOUT) ** 2 + _NARROW * (room < walker.radius)
    cost += _STEEP * (abs(end[:, 1] - start[:, 1]) > walker.step / 2)
    through = np.zeros(len(steps), dtype=np.bool_)
    for height in BODY[:-1]:
        below = [0, (1 - height) * eye_height, 0]
        through |= obstacles.crossed(start - below, end - below)
    return np.asarray((cost + _THROUGH * through) * np.linalg.norm(end - start, axis=1))
