"""Places, the walkable parts of floors, and the leaves in which visitors stand.

A **place** is a point of a surface within 45° of level over which an upright cylinder, the body of
a walker from the height of a step to that of the head, meets nothing structural; in doubt the body
fits (`clearance`). Floors are searched in blocks of neighbours, so that the time of each depends on
the triangles about it alone.

Leaves that meet the eye region are standing. Ceilings lower than the eyes may be are ignored: a
small cost that hides nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, ranges
from ptmtools.cells.clearance import (
    CORNERS,
    QUARTER,
    above,
    clear_of,
    halves,
    heights,
    longest,
    shadows,
    tiled,
)
from ptmtools.cells.floors import Floors
from ptmtools.cells.options import Walker
from ptmtools.cells.planar import (
    Geometry,
    buffer,
    count,
    counting,
    delaunay,
    intersection,
    straightened,
    united_by,
)
from ptmtools.cells.planes import PLAN, boxes_meet
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.search import along_a_curve
from ptmtools.executor import Executor
from ptmtools.tolerance import Tolerance

#: Places are sampled once in this area, m², and so often at most.
_SAMPLE_AREA, _MOST_SAMPLES = 0.05, 500_000
#: 1/g and 1/g², where g³ = g + 1 (Roberts' sequence): where in a triangle.
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True)
class Places:
    """Flat regions of floor."""

    plan: Geometry  # (r,) seen from above, x and z in metres
    slope: Floats  # (r, 3): the height is a·x + b·z + c
    front: Bools  # (r,) `Floors.front`

    def only(self, rows: Bools) -> Places:
        """The regions of some rows, (r,)."""
        return Places(self.plan[rows], self.slope[rows], self.front[rows])

    def near(self, boxes: Floats) -> Bools:
        """(r,) which regions have a box that meets one of (m, 2, 3) boxes, metres."""
        least, most = heights(self.plan, self.slope)
        x0, z0, x1, z1 = shapely.bounds(self.plan).reshape(-1, 4).T
        low, high = np.column_stack([x0, least, z0]), np.column_stack([x1, most, z1])
        return boxes_meet(low, high, boxes)

    def without_tops(self, ceiling: float, radius: float) -> Places:
        """The regions without those above a height that are narrower than a body of a radius,
        metres: the tops of the walls of rooms without a ceiling."""
        kept = heights(self.plan, self.slope)[0] < ceiling
        kept[~kept] = ~shapely.is_empty(buffer(self.plan[~kept], -radius))
        return self.only(kept)

    def triangles(self, tolerance: Tolerance) -> Floats:
        """(n, 3, 3) triangles of the regions, on their slopes, metres."""
        parts, region = shapely.get_parts(self.plan, return_index=True)
        flat = shapely.get_dimensions(parts) == 2
        parts, region = parts[flat], region[flat]
        corners, of = [np.zeros((0, 3, 2))], [np.zeros(0, dtype=np.int64)]
        while len(parts):
            # Of many corners, or none that GEOS can divide: cut in two, and tried again.
            large = shapely.get_num_coordinates(parts) > CORNERS
            triangles = delaunay(np.where(large, shapely.Polygon(), parts))
            pieces, part = shapely.get_parts(triangles, return_index=True)
            corners.append(shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3])
            of.append(region[part])
            left = shapely.is_empty(triangles)
            parts, which = halves(parts[left], tolerance.grid)
            region = region[left][which]
        plan, slope = np.concatenate(corners), self.slope[np.concatenate(of)]
        height = np.einsum("ncx,nx->nc", plan, slope[:, :2]) + slope[:, 2:]
        return np.stack([plan[..., 0], height, plan[..., 1]], axis=2)


def find_places(
    floors: Floors,
    structure: Floats,
    walker: Walker,
    tolerance: Tolerance,
    executor: Executor | None = None,
) -> Places:
    """The places of a walker on floors, among the triangles of a structure, (n, 3, 3)."""
    plan, region = _tiles(floors, tolerance)
    search = _Search(
        _with_boxes(floors.corners), floors.slope, _with_boxes(structure), walker, tolerance
    )
    middle = shapely.get_coordinates(shapely.centroid(plan))
    order = along_a_curve(middle) if len(plan) else np.arange(0)
    blocks = np.array_split(order, max(1, -(-len(order) // _BLOCK)))
    tasks = ((plan[block], region[block]) for block in blocks)
    doer = executor if executor and len(blocks) >= _MANY_BLOCKS else Executor()
    done = doer.each(_Search.places, search, tasks)
    plans, regions, undecided = zip(*done, strict=True)
    for names in undecided:
        count(names)
    names, plan = united_by(
        np.concatenate(regions), np.concatenate(plans), tolerance.grid, more=True
    )
    # Without corners on straight edges, and in an order independent of the computation.
    plan = straightened(shapely.normalize(plan), tolerance.grid)
    # Walls part what is inside from what is outside.
    plan, part = shapely.get_parts(plan, return_index=True)
    names = names[part]
    return Places(plan, floors.slope[names], floors.front[names])


#: Parts of floors longer than this, metres, and than this share of the model, are cut in two.
_LONG, _LONG_SHARE = 16.0, 1 / 32
#: Number of parts of floors in a block, and of blocks that are worth starting workers for.
_BLOCK, _MANY_BLOCKS = 512, 8


def _tiles(floors: Floors, tolerance: Tolerance) -> tuple[Geometry, Ints]:
    """(k,) the floors in parts that are not long, seen from above, and (k,) the region of each."""
    region = np.arange(len(floors.slope))
    plan = floors.plan(region, tolerance.grid)
    region = region[some := ~shapely.is_empty(plan)]
    plan = plan[some]
    plans, regions = [plan[:0]], [region[:0]]
    most = max(_LONG, _LONG_SHARE * tolerance.extent)
    while len(plan):
        long = longest(plan) > most
        plans.append(plan[~long])
        regions.append(region[~long])
        plan, half = halves(plan[long], tolerance.grid)
        region = region[long][half]
    return np.concatenate(plans), np.concatenate(regions)


class _Search(NamedTuple):
    """What places are searched among: triangles of floors and of the structure, (n, 3, 3)."""

    floors: tuple[Floats, Floats]  # and their boxes, see `_with_boxes`
    slope: Floats  # `Floors.slope`
    structure: tuple[Floats, Floats]
    walker: Walker
    tolerance: Tolerance

    def places(self, block: tuple[Geometry, Ints]) -> tuple[Geometry, Ints, Counter[str]]:
        """The walkable parts of (k,) parts of floors, the region of each, and the operations that
        ended in a safe answer."""
        with counting() as undecided:
            return *self._places(*block), undecided

    def _places(self, plan: Geometry, region: Ints) -> tuple[Geometry, Ints]:
        walker, tolerance = self.walker, self.tolerance
        body, foot = (walker.step, walker.height), (2 * tolerance.plane, walker.step)
        slope = self.slope[region]
        around = self._around(self.structure, plan, walker.radius)
        plan, part = clear_of(around, plan, slope, body, walker.radius, tolerance)
        region = region[part]
        # A foot is on the uppermost of surfaces one step apart: not on the underside of a slab.
        around = self._around(self.floors, plan, 0.0)
        plan, part = clear_of(around, plan, self.slope[region], foot, 0.0, tolerance)
        return plan, region[part]

    @staticmethod
    def _around(boxed: tuple[Floats, Floats], plan: Geometry, radius: float) -> Floats:
        """The triangles with a box, seen from above, no more than a radius from that of parts."""
        corners, (x0, z0, x1, z1) = boxed
        if not len(plan):
            return corners[:0]
        left, low, right, high = shapely.total_bounds(plan)
        near = (x0 <= right + radius) & (x1 >= left - radius)
        near &= (z0 <= high + radius) & (z1 >= low - radius)
        result: Floats = corners[near]
        return result


def _with_boxes(corners: Floats) -> tuple[Floats, Floats]:
    """Triangles, (n, 3, 3), and the (4, n) least and greatest coordinates of each in plan."""
    flat = corners[:, :, PLAN]
    return corners, np.concatenate([flat.min(axis=1), flat.max(axis=1)], axis=1).T.copy()


def spread(corners: Floats) -> tuple[Floats, Floats]:
    """(m, 3) points spread evenly over (n, 3, 3) triangles, and (m,) the m² of each."""
    size = areas(corners)
    each = max(_SAMPLE_AREA, float(size.sum()) / _MOST_SAMPLES)
    number = np.maximum(np.ceil(size / each), 1).astype(np.int64)
    row = np.repeat(np.arange(len(corners)), number)
    share = np.mod((ranges(np.zeros_like(number), number)[:, None] + 0.5) * _STEPS, 1.0)
    share = np.where(share.sum(axis=1, keepdims=True) > 1, 1 - share, share)
    weight = np.column_stack([1 - share.sum(axis=1), share])
    return np.einsum("mc,mcx->mx", weight, corners[row]), (size / number)[row]


#: Eyes stay farther from what the body touches than rounding, but by no more of its radius.
_SLACK = 0.1
#: Pairs of leaf and floor that are compared at a time.
_AT_ONCE = 1 << 13


def eye_region(places: Places, walker: Walker, tolerance: Tolerance) -> Places:
    """The floor below the eyes: the places, widened by the body's radius less a slack."""
    inside = walker.radius * np.cos(np.pi / (4 * QUARTER))  # of a circle that is a polygon
    reach = inside - min(2 * tolerance.plane, _SLACK * walker.radius)
    box, plan, which = tiled(places.plan, walker.radius, tolerance.grid)
    wide = buffer(plan, reach, more=True, quad_segs=QUARTER)
    eyes = intersection(wide, box, tolerance.grid, more=True)
    some = ~shapely.is_empty(eyes)
    which = which[some]
    return Places(eyes[some], places.slope[which], places.front[which])


def meets(
    eyes: Places, bodies: Sequence[Polyhedron], walker: Walker, tolerance: Tolerance
) -> Bools:
    """(L,) which of the leaves meet an eye region."""
    result = np.zeros(len(bodies), dtype=np.bool_)
    band = 2 * tolerance.plane, walker.reach
    low = np.array([body.points.min(axis=0) for body in bodies]).reshape(-1, 3)
    high = np.array([body.points.max(axis=0) for body in bodies]).reshape(-1, 3)
    boxes = shapely.box(*low[:, PLAN].T, *high[:, PLAN].T)
    leaf, floor = shapely.STRtree(eyes.plan).query(boxes, "intersects")
    least, most = heights(eyes.plan, eyes.slope)
    near = (high[leaf, 1] > least[floor] + band[0]) & (low[leaf, 1] < most[floor] + band[1])
    leaf, floor = leaf[near], floor[near]
    edges = [body.points[body.edges] for body in bodies]
    number = np.array([len(each) for each in edges], dtype=np.int64)
    for first in range(0, len(leaf), _AT_ONCE):
        some = np.arange(first, min(first + _AT_ONCE, len(leaf)))
        some = some[~result[leaf[some]]]
        if not len(some):
            continue
        pair = np.repeat(np.arange(len(some)), number[leaf[some]])
        edge = np.concatenate([edges[i] for i in leaf[some].tolist()])
        height = above(edge, eyes.slope[floor[some]][pair])
        names, shadow = shadows(edge[:, :, PLAN], height, band, pair)
        touches = shapely.intersects(shadow, eyes.plan[floor[some]][names])
        result[leaf[some][names[touches]]] = True
    return result
