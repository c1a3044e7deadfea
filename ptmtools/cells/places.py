"""Places, the walkable parts of floors, and the leaves in which visitors stand.

A **place** is a point of a surface within 45° of level over which an upright cylinder, the body of
a walker from the height of a step to that of the head, meets nothing structural; in doubt the body
fits. For each flat region of floor, the part of the structure in a band of heights above it is
projected onto it along the vertical, widened by the radius and subtracted (`clear_of`). Circles are
polygons inside them. Floors are searched in blocks of neighbours, a compiled loop (`shadows_near`)
discards triangles whose shadows are beside a floor, such as its neighbours in a scan, and regions
with many triangles about them are cut in two, so the time is proportional to the triangles near
floors.

Leaves that meet the eye region are standing. Ceilings lower than the eyes may be are ignored: a
small cost that hides nothing.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, ranges
from ptmtools.cells.floors import Floors
from ptmtools.cells.options import Walker
from ptmtools.cells.planar import (
    Geometry,
    buffer,
    count,
    counting,
    delaunay,
    difference,
    intersection,
    straighten,
    unite_rows,
)
from ptmtools.cells.planes import PLAN, Polyhedron, boxes_meet
from ptmtools.cells.search import along_a_curve
from ptmtools.cells.structure import points_in
from ptmtools.executor import Executor
from ptmtools.tolerance import TOUCH_SHARE, Tolerance

#: A shape of less area for its length than this share of a radius is a line.
_THIN = 4e-3
#: A region is compared with one of the triangles about it, then with this many times more.
_GROWTH = 1.5
#: Number of pairs of a region and a triangle for which there is space at first, for each region.
_PAIRS = 16
#: Regions with more triangles about them, and shapes of more corners, are cut in two,
_CROWD, CORNERS = 256, 256
#: unless they are no longer than this many times the height of the band, or the margin.
_SHORT, _NARROW = 1.2, 8.0
#: Corners of a quarter of a circle.
QUARTER = 4


def clear_of(
    corners: Floats,
    plan: Geometry,
    slope: Floats,
    band: tuple[float, float],
    radius: float,
    tolerance: Tolerance,
) -> tuple[Geometry, Ints]:
    """(k,) pieces of regions of floor that are no less than a ``radius`` from triangles, (n, 3, 3),
    as high above them as a ``band``, metres; in plan. And (k,) the region of each.

    The regions are (r,) polygons in ``plan``, whose heights are a·x + b·z + c by (r, 3) ``slope``.
    """
    pieces, owner, region = [plan[:0]], [np.zeros(0, dtype=np.int64)], np.arange(len(plan))
    corners = corners[np.argsort(corners[:, :, 0].min(axis=1), kind="stable")]
    while len(region):
        row, near = _pairs_near(corners, plan, slope, band, radius + tolerance.rounding)
        crowded = (np.bincount(row, minlength=len(plan)) > _CROWD) & (
            longest(plan) > _SHORT * band[1]
        )
        some = ~crowded[row]
        free = _subtract_near(plan, slope, corners[near[some]], row[some], band, radius, tolerance)
        kept = ~crowded & ~shapely.is_empty(free)
        pieces.append(free[kept])
        owner.append(region[kept])
        plan, half = halves(plan[crowded], tolerance.grid)
        slope, region = slope[crowded][half], region[crowded][half]
    return np.concatenate(pieces), np.concatenate(owner)


def _pairs_near(
    corners: Floats, plan: Geometry, slope: Floats, band: tuple[float, float], reach: float
) -> tuple[Ints, Ints]:
    """(p,) and (p,): pairs of a region of floor, ascending, and a triangle, (n, 3, 3), by the least
    x, among which are all whose shadow (`shadows`) is within reach of the region."""
    from ptmtools.cells.kernels import shadows_near

    farthest = np.maximum.accumulate(corners[:, :, 0].max(axis=1))
    hull = shapely.orient_polygons(shapely.convex_hull(plan))
    point, owner = shapely.get_coordinates(hull, return_index=True)
    start = np.searchsorted(owner, np.arange(len(plan) + 1))
    count, pairs, shadow = 1, np.empty((2, 0), dtype=np.int64), np.empty((9, 2))
    while count > pairs.shape[1]:
        pairs = np.empty((2, max(count, _PAIRS * len(plan))), dtype=np.int64)
        count = shadows_near(corners, farthest, point, start, slope, band, reach, shadow, pairs)
    return pairs[0, :count], pairs[1, :count]


def _subtract_near(
    plan: Geometry,
    slope: Floats,
    corners: Floats,
    row: Ints,
    band: tuple[float, float],
    radius: float,
    tolerance: Tolerance,
) -> Geometry:
    """(r,) regions without the points less than a radius from triangles, (n, 3, 3), each near the
    region of its ``row``.

    The first few triangles leave nothing of most regions, such as the tops of mouldings, and a few
    triangles of a large wall remove as much as all do. So they are tried by turns, those first that
    may remove most, and only the ones that are still near the rest."""
    low, high = corners.min(axis=1)[:, PLAN] - radius, corners.max(axis=1)[:, PLAN] + radius
    x0, z0, x1, z1 = shapely.bounds(plan).reshape(-1, 4)[row].T
    across = np.minimum(high[:, 0], x1) - np.maximum(low[:, 0], x0)
    along = np.minimum(high[:, 1], z1) - np.maximum(low[:, 1], z0)
    order = np.lexsort((-across * along, row))
    row, corners = row[order], corners[order]
    turn = np.arange(len(row)) - np.searchsorted(row, row)
    rest = plan.copy()
    first, end = 0, 1
    while (turn >= first).any():
        at = np.flatnonzero((turn >= first) & (turn < end))
        at = at[~shapely.is_empty(rest[row[at]])]
        height = heights_above(corners[at], slope[row[at]])
        caster, shadow = shadows(corners[at][:, :, PLAN], height, band, at)
        near = shapely.dwithin(shadow, rest[row[caster]], (1 - TOUCH_SHARE) * radius)
        shadow, target = _merge(shadow[near], row[caster[near]], radius, tolerance)
        # One by one: GEOS 3.14 buffers many lines at once with holes where they meet.
        wide = buffer(shadow, radius, quad_segs=QUARTER)
        names, taken = unite_rows(target, wide, tolerance.grid)
        rest[names] = difference(rest[names], taken, tolerance.grid)
        first, end = end, int(_GROWTH * end) + 1
    return rest


def _merge(
    shapes: Geometry, row: Ints, radius: float, tolerance: Tolerance
) -> tuple[Geometry, Ints]:
    """Shapes and the (n,) row of each, those with an area united row by row: fewer to widen. Thin
    ones, such as a wall's, would vanish; those without width are lines."""
    size, around = shapely.area(shapes), shapely.length(shapes)
    line = size <= tolerance.rounding * around
    flat = ~line & (size > _THIN * radius * around)
    shapes[line] = _lines(shapes[line])
    names, united = unite_rows(row[flat], shapes[flat], tolerance.grid)
    parts, which = shapely.get_parts(united, return_index=True)
    return np.append(shapes[~flat], parts), np.append(row[~flat], names[which])


def _lines(shapes: Geometry) -> Geometry:
    """(n,) from end to end of shapes without width, of which GEOS would widen one end only."""
    points, owner = shapely.get_coordinates(shapes, return_index=True)
    first = np.searchsorted(owner, np.arange(len(shapes)))
    for _ in range(2):  # the farthest point from any point is an end, and from that, the other one
        away = np.linalg.norm(points - points[first[owner]], axis=1)
        order = np.lexsort((-away, owner))
        last, first = first, order[np.searchsorted(owner, np.arange(len(shapes)))]
    return shapely.linestrings(np.stack([points[last], points[first]], axis=1))


def longest(shapes: Geometry) -> Floats:
    """(n,) the longer sides of the boxes around shapes."""
    x0, y0, x1, y1 = shapely.bounds(shapes).reshape(-1, 4).T
    longer: Floats = np.maximum(x1 - x0, y1 - y0)
    return longer


def heights(plan: Geometry, slope: Floats) -> tuple[Floats, Floats]:
    """(r,) and (r,): the least and the greatest height, or a little beyond, of regions in plan."""
    x0, z0, x1, z1 = shapely.bounds(plan).reshape(-1, 4).T
    middle = slope[:, 0] * (x0 + x1) / 2 + slope[:, 1] * (z0 + z1) / 2 + slope[:, 2]
    half = np.abs(slope[:, 0]) * (x1 - x0) / 2 + np.abs(slope[:, 1]) * (z1 - z0) / 2
    return middle - half, middle + half


def heights_above(corners: Floats, slope: Floats) -> Floats:
    """(n, k) heights of the corners of shapes, (n, k, 3), above the slope of each, (n, 3)."""
    plan = np.einsum("ncx,nx->nc", corners[:, :, PLAN], slope[:, :2])
    result: Floats = corners[:, :, 1] - plan - slope[:, 2:]
    return result


def shadows(
    plan: Floats, height: Floats, band: tuple[float, float], owner: Ints
) -> tuple[Ints, Geometry]:
    """The parts of convex bodies in a band of heights, in plan: their owners, ascending, and
    shapes. Bodies are given by polygons or edges, (n, k, 2) in plan, (n, k) heights and (n,)
    owners."""
    points, valid = [plan], [(height >= band[0]) & (height <= band[1])]
    following, after = np.roll(plan, -1, axis=1), np.roll(height, -1, axis=1)
    for level in band:
        crosses = (height - level) * (after - level) < 0
        share = np.divide(level - height, after - height, out=np.zeros(height.shape), where=crosses)
        points.append(plan + share[..., None] * (following - plan))
        valid.append(crosses)
    every, which = np.concatenate(points, axis=1), np.concatenate(valid, axis=1)
    row, _ = np.nonzero(which)
    order = np.argsort(owner[row], kind="stable")
    names, first, size = np.unique(owner[row][order], return_index=True, return_counts=True)
    # Hulls of lines, at least from a point to itself: sets of points take twice as long to make.
    times = np.ones(len(order), dtype=np.int64)
    times[first] = 2
    group = np.repeat(np.arange(len(names)), size + 1)
    lines = shapely.linestrings(np.repeat(every[which][order], times, axis=0), indices=group)
    return names, np.asarray(shapely.convex_hull(lines))


def cut_tiles(shapes: Geometry, margin: float, grid: float) -> tuple[Geometry, Geometry, Ints]:
    """(m,) boxes that divide the surroundings, up to a margin, of each of (n,) shapes, (m,) the
    part of the shape up to a margin from each box, with few corners, and (m,) its shape: GEOS takes
    more than linear time in the number of corners."""
    x0, y0, x1, y1 = shapely.bounds(shapes).reshape(-1, 4).T
    tile = shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)
    which = np.arange(len(shapes))
    tiles: list[tuple[Geometry, Geometry, Ints]] = []
    while True:
        large = (shapely.get_num_coordinates(shapes) > CORNERS) & (longest(tile) > _NARROW * margin)
        tiles.append((tile[~large], shapes[~large], which[~large]))
        if not large.any():
            boxes, pieces, names = zip(*tiles, strict=True)
            return np.concatenate(boxes), np.concatenate(pieces), np.concatenate(names)
        tile, half = halves(tile[large], grid)
        x0, y0, x1, y1 = shapely.bounds(tile).T
        about = shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)
        shapes, which = shapes[large][half], which[large][half]
        shapes = intersection(shapes, about, grid, more=True)


def halves(shapes: Geometry, grid: float) -> tuple[Geometry, Ints]:
    """(m,) the polygons to both sides of the middles of (n,) shapes, and (m,) the shape of each."""
    x0, y0, x1, y1 = shapely.bounds(shapes).reshape(-1, 4).T
    middle = np.where(x1 - x0 > y1 - y0, (x0 + x1) / 2, x1)
    level = np.where(x1 - x0 > y1 - y0, y1, (y0 + y1) / 2)
    sides = (
        shapely.box(x0, y0, middle, level),
        shapely.box(np.where(middle < x1, middle, x0), np.where(level < y1, level, y0), x1, y1),
    )
    both = np.concatenate([intersection(shapes, side, grid, more=True) for side in sides])
    parts, which = shapely.get_parts(both, return_index=True)
    flat = shapely.area(parts) > 0
    return parts[flat], which[flat] % max(len(shapes), 1)


#: Places are sampled once in this area, m², and so often at most.
_SAMPLE_AREA, _MOST_SAMPLES = 0.05, 500_000


@dataclass(frozen=True)
class Places:
    """Flat regions of floor."""

    plan: Geometry  # (r,) seen from above, x and z in metres
    slope: Floats  # (r, 3): the height is a·x + b·z + c
    front: Bools  # (r,) `Floors.front`

    def only(self, rows: Bools) -> Places:
        """The regions of some rows, (r,)."""
        return Places(self.plan[rows], self.slope[rows], self.front[rows])

    def find_near(self, boxes: Floats) -> Bools:
        """(r,) which regions have a box that meets one of (m, 2, 3) boxes, metres."""
        least, greatest = heights(self.plan, self.slope)
        x0, z0, x1, z1 = shapely.bounds(self.plan).reshape(-1, 4).T
        low, high = np.column_stack([x0, least, z0]), np.column_stack([x1, greatest, z1])
        return boxes_meet(low, high, boxes)

    def without_tops(self, ceiling: float, radius: float) -> Places:
        """The regions without those above a height that are narrower than a body of a radius,
        metres: the tops of the walls of rooms without a ceiling."""
        kept = heights(self.plan, self.slope)[0] < ceiling
        kept[~kept] = ~shapely.is_empty(buffer(self.plan[~kept], -radius))
        return self.only(kept)

    def triangles(self, tolerance: Tolerance) -> Floats:
        """(n, 3, 3) triangles of the regions, on their slopes, metres."""
        return self.triangles_by_region(tolerance)[0]

    def triangles_by_region(self, tolerance: Tolerance) -> tuple[Floats, Ints]:
        """The `triangles`, and (n,) the region of each."""
        parts, region = shapely.get_parts(self.plan, return_index=True)
        flat = shapely.get_dimensions(parts) == 2
        parts, region = parts[flat], region[flat]
        corners, owner = [np.zeros((0, 3, 2))], [np.zeros(0, dtype=np.int64)]
        while len(parts):
            # Of many corners, or none that GEOS can divide: cut in two, and tried again.
            large = shapely.get_num_coordinates(parts) > CORNERS
            triangles = delaunay(np.where(large, shapely.Polygon(), parts))
            point, part = shapely.get_coordinates(triangles, return_index=True)
            corners.append(point.reshape(-1, 4, 2)[:, :3])
            owner.append(region[part[::4]])
            undivided = shapely.is_empty(triangles)
            parts, which = halves(parts[undivided], tolerance.grid)
            region = region[undivided][which]
        plan, region = np.concatenate(corners), np.concatenate(owner)
        slope = self.slope[region]
        height = np.einsum("ncx,nx->nc", plan, slope[:, :2]) + slope[:, 2:]
        return np.stack([plan[..., 0], height, plan[..., 1]], axis=2), region


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
    names, plan = unite_rows(
        np.concatenate(regions), np.concatenate(plans), tolerance.grid, more=True
    )
    # Without corners on straight edges, and in an order independent of the computation.
    plan = straighten(shapely.normalize(plan), tolerance.grid)
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
    limit = max(_LONG, _LONG_SHARE * tolerance.extent)
    while len(plan):
        long = longest(plan) > limit
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
        body, foot = (step := float(walker.step), float(walker.height)), (2 * tolerance.plane, step)
        slope = self.slope[region]
        around = self._select_near(self.structure, plan, walker.radius)
        plan, part = clear_of(around, plan, slope, body, walker.radius, tolerance)
        region = region[part]
        # A foot is on the uppermost of surfaces one step apart: not on the underside of a slab.
        around = self._select_near(self.floors, plan, 0.0)
        plan, part = clear_of(around, plan, self.slope[region], foot, 0.0, tolerance)
        return plan, region[part]

    @staticmethod
    def _select_near(boxed: tuple[Floats, Floats], plan: Geometry, radius: float) -> Floats:
        """The triangles with a box, seen from above, no more than a radius from that of parts."""
        corners, (x0, z0, x1, z1) = boxed
        if not len(plan):
            return corners[:0]
        x_low, z_low, x_high, z_high = shapely.total_bounds(plan)
        near = (x0 <= x_high + radius) & (x1 >= x_low - radius)
        near &= (z0 <= z_high + radius) & (z1 >= z_low - radius)
        result: Floats = corners[near]
        return result


def _with_boxes(corners: Floats) -> tuple[Floats, Floats]:
    """Triangles, (n, 3, 3), and the (4, n) least and greatest coordinates of each in plan."""
    flat = corners[:, :, PLAN]
    return corners, np.concatenate([flat.min(axis=1), flat.max(axis=1)], axis=1).T.copy()


def spread(corners: Floats) -> tuple[Floats, Floats]:
    """(m, 3) points spread evenly over (n, 3, 3) triangles, and (m,) the m² of each."""
    size = areas(corners)
    sample_area = max(_SAMPLE_AREA, float(size.sum()) / _MOST_SAMPLES)
    number = np.maximum(np.ceil(size / sample_area), 1).astype(np.int64)
    row = np.repeat(np.arange(len(corners)), number)
    points = points_in(corners[row], ranges(np.zeros_like(number), number))
    return points, (size / number)[row]


#: Eyes stay farther from what the body touches than rounding, but by no more of its radius.
_SLACK = 0.1
#: Pairs of leaf and floor that are compared at a time.
_AT_ONCE = 1 << 13


def eye_region(places: Places, walker: Walker, tolerance: Tolerance) -> Places:
    """The floor below the eyes: the places, widened by the body's radius less a slack."""
    inside = walker.radius * np.cos(np.pi / (4 * QUARTER))  # of a circle that is a polygon
    reach = inside - min(2 * tolerance.plane, _SLACK * walker.radius)
    box, plan, which = cut_tiles(places.plan, walker.radius, tolerance.grid)
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
    least, greatest = heights(eyes.plan, eyes.slope)
    near = (high[leaf, 1] > least[floor] + band[0]) & (low[leaf, 1] < greatest[floor] + band[1])
    leaf, floor = leaf[near], floor[near]
    edges = [body.points[body.edges] for body in bodies]
    number = np.array([len(segments) for segments in edges], dtype=np.int64)
    # By turns, one floor of each leaf, then more: most leaves meet the first.
    turn = np.frexp(np.arange(len(leaf)) - np.searchsorted(leaf, leaf))[1]
    order = np.argsort(turn, kind="stable")
    leaf, floor = leaf[order], floor[order]
    begins = np.union1d(np.arange(0, len(leaf), _AT_ONCE), np.cumsum(np.bincount(turn)))
    for first, end in itertools.pairwise(begins.tolist()):
        some = np.arange(first, end)
        some = some[~result[leaf[some]]]
        if not len(some):
            continue
        pair = np.repeat(np.arange(len(some)), number[leaf[some]])
        edge = np.concatenate([edges[i] for i in leaf[some].tolist()])
        height = heights_above(edge, eyes.slope[floor[some]][pair])
        names, shadow = shadows(edge[:, :, PLAN], height, band, pair)
        touches = shapely.intersects(shadow, eyes.plan[floor[some]][names])
        result[leaf[some][names[touches]]] = True
    return result
