"""Places, the walkable parts of floors, and the leaves in which visitors stand.

A **place** is a point of a surface within 45° of level over which an upright cylinder, the body of
a walker from the height of a step to that of the head, meets nothing structural; in doubt the body
fits. For each flat region of floor, the part of the structure in the band of heights above it is
projected onto it along the vertical, widened by the radius and subtracted. Circles are polygons
inside them. Floors and triangles are sorted by storeys, and regions with many triangles about them
are cut in two, so the time is proportional to the triangles near floors.

Leaves that meet the eye region are standing. Ceilings lower than the eyes may be are ignored: a
small cost that hides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, normals, ranges
from ptmtools.cells.facets import Facets, Welded
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.planar import (
    Geometry,
    buffer,
    delaunay,
    difference,
    intersection,
    straightened,
    united_by,
)
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.portals import FLOOR_COSINE
from ptmtools.cells.roles import Designated, detail_by_shape
from ptmtools.cells.search import ByHeight
from ptmtools.cells.structure import Structure
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance

#: Floors within this height, as a share of the band, are compared together.
_STOREY = 0.2
#: A shape of less area for its length than this share of a radius is a line.
_THIN = 4e-3
#: A region is compared with one of the triangles about it, then with this many times more.
_GROWTH = 1.25
#: Regions with more triangles about them, and shapes of more corners, are cut in two,
_CROWD, CORNERS = 256, 256
#: unless they are no longer than this many times the height of the band, or the margin.
_SHORT, _NARROW = 1.2, 8.0
#: Corners of a quarter of a circle.
QUARTER = 4
#: Axes of the plan.
PLAN = [0, 2]


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
    left, owner, region = [plan[:0]], [np.zeros(0, dtype=np.int64)], np.arange(len(plan))
    by_height = ByHeight(corners[:, :, 1].min(axis=1), corners[:, :, 1].max(axis=1))
    while len(region):
        row, near = _about(corners, by_height, plan, slope, band, radius)
        crowded = (np.bincount(row, minlength=len(plan)) > _CROWD) & (
            _length(plan) > _SHORT * band[1]
        )
        some = ~crowded[row]
        free = _less(plan, slope, corners[near[some]], row[some], band, radius, tolerance)
        kept = ~crowded & ~shapely.is_empty(free)
        left.append(free[kept])
        owner.append(region[kept])
        plan, half = halves(plan[crowded], tolerance.grid)
        slope, region = slope[crowded][half], region[crowded][half]
    return np.concatenate(left), np.concatenate(owner)


def _about(
    corners: Floats,
    by_height: ByHeight,
    plan: Geometry,
    slope: Floats,
    band: tuple[float, float],
    radius: float,
) -> tuple[Ints, Ints]:
    """(p,) and (p,): pairs of a region of floor and a triangle, (n, 3, 3), as high above it as a
    ``band``, whose box in plan is no more than a radius away."""
    least, most = heights(plan, slope)
    margin = radius * np.linalg.norm(slope[:, :2], axis=1)  # the slope goes on beyond the region
    least, most = least - margin, most + margin
    storey = np.floor(least / (_STOREY * (band[1] - band[0])))
    rows, hits = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    # Storey by storey, so that a floor is compared only with triangles of its height.
    for name in np.unique(storey):
        here = np.flatnonzero(storey == name)
        about = by_height.between(least[here].min() + band[0], most[here].max() + band[1])
        flat = corners[about][:, :, PLAN]
        boxes = shapely.box(*flat.min(axis=1).T, *flat.max(axis=1).T)
        row, near = shapely.STRtree(boxes).query(plan[here], "dwithin", distance=radius)
        row, near = here[row], about[near]
        height = above(corners[near], slope[row])
        meets = (height.min(axis=1) <= band[1]) & (height.max(axis=1) >= band[0])
        rows.append(row[meets])
        hits.append(near[meets])
    return np.concatenate(rows), np.concatenate(hits)


def _less(
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
    left = plan.copy()
    first, end = 0, 1
    while (turn >= first).any():
        at = np.flatnonzero((turn >= first) & (turn < end))
        at = at[~shapely.is_empty(left[row[at]])]
        height = above(corners[at], slope[row[at]])
        each, shadow = shadows(corners[at][:, :, PLAN], height, band, at)
        # A radius away is not near, but for rounding.
        near = shapely.dwithin(shadow, left[row[each]], (1 - 1e-6) * radius)
        shadow, target = _merged(shadow[near], row[each[near]], radius, tolerance)
        # One by one: GEOS 3.14 buffers many lines at once with holes where they meet.
        wide = buffer(shadow, radius, quad_segs=QUARTER)
        names, taken = united_by(target, wide, tolerance.grid)
        left[names] = difference(left[names], taken, tolerance.grid)
        first, end = end, int(_GROWTH * end) + 1
    return left


def _merged(
    shapes: Geometry, row: Ints, radius: float, tolerance: Tolerance
) -> tuple[Geometry, Ints]:
    """Shapes and the (n,) row of each, those with an area united row by row: fewer to widen. Thin
    ones, such as a wall's, would vanish; those without width are lines."""
    size, around = shapely.area(shapes), shapely.length(shapes)
    line = size <= tolerance.rounding * around
    flat = ~line & (size > _THIN * radius * around)
    shapes[line] = _lines(shapes[line])
    names, united = united_by(row[flat], shapes[flat], tolerance.grid)
    parts, which = shapely.get_parts(united, return_index=True)
    return np.append(shapes[~flat], parts), np.append(row[~flat], names[which])


def _lines(shapes: Geometry) -> Geometry:
    """(n,) from end to end of shapes without width, of which GEOS would widen one end only."""
    points, of = shapely.get_coordinates(shapes, return_index=True)
    first = np.searchsorted(of, np.arange(len(shapes)))
    for _ in range(2):  # the farthest point from any point is an end, and from that, the other one
        away = np.linalg.norm(points - points[first[of]], axis=1)
        last, first = first, np.lexsort((-away, of))[np.searchsorted(of, np.arange(len(shapes)))]
    return shapely.linestrings(np.stack([points[last], points[first]], axis=1))


def _length(shapes: Geometry) -> Floats:
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


def above(corners: Floats, slope: Floats) -> Floats:
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
    names, group = np.unique(owner[row][order], return_inverse=True)
    clouds = shapely.multipoints(every[which][order], indices=group.reshape(-1))
    return names, np.asarray(shapely.convex_hull(clouds))


def tiled(shapes: Geometry, margin: float, grid: float) -> tuple[Geometry, Geometry, Ints]:
    """(m,) boxes that divide the surroundings, up to a margin, of each of (n,) shapes, (m,) the
    part of the shape up to a margin from each box, with few corners, and (m,) its shape: GEOS takes
    more than linear time in the number of corners."""
    x0, y0, x1, y1 = shapely.bounds(shapes).reshape(-1, 4).T
    own = shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)
    which = np.arange(len(shapes))
    tiles: list[tuple[Geometry, Geometry, Ints]] = []
    while True:
        large = (shapely.get_num_coordinates(shapes) > CORNERS) & (_length(own) > _NARROW * margin)
        tiles.append((own[~large], shapes[~large], which[~large]))
        if not large.any():
            boxes, pieces, names = zip(*tiles, strict=True)
            return np.concatenate(boxes), np.concatenate(pieces), np.concatenate(names)
        own, half = halves(own[large], grid)
        x0, y0, x1, y1 = shapely.bounds(own).T
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
#: 1/g and 1/g², where g³ = g + 1 (Roberts' sequence): where in a triangle.
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True)
class Floors:
    """The flat regions of all nearly level triangles that are no detail."""

    corners: Floats  # (n, 3, 3) metres
    region: Ints  # (n,) ascending from 0

    @staticmethod
    def of(scene: Scene, detail: Bools, *, backs: bool = False) -> Floors:
        """The floors of a scene but for its ``detail``, (T,); of one-sided faces the fronts only,
        or the inside of a solid would be a room; or their ``backs`` as well."""
        normal = normals(scene.corners)
        up = np.where(scene.two_sided | backs, np.abs(normal[:, 1]), normal[:, 1])
        level = up > FLOOR_COSINE * np.linalg.norm(normal, axis=1)
        mesh = Welded.of(scene.points, scene.triangles[np.flatnonzero(level & ~detail)])
        facets = Facets.of(mesh, scene.tolerance)
        corners, source = facets.fewer(np.ones(len(mesh.source), dtype=bool), scene.tolerance)
        order = np.argsort(facets.region[source], kind="stable")
        region = np.unique(facets.region[source[order]], return_inverse=True)[1].reshape(-1)
        return Floors(corners[order], region)

    def within(self, boxes: Floats, above: float, grid: float) -> tuple[Geometry, Ints]:
        """(k,) pieces of floor in plan whose points ``above`` metres higher lie in one of (m, 2, 3)
        boxes, and (k,) the region of each, ascending."""
        plan = shapely.polygons(self.corners[:, :, PLAN])
        (x0, y0, z0), (x1, y1, z1) = boxes.transpose(1, 2, 0)
        areas = shapely.box(x0, z0, x1, z1)
        box, row = shapely.STRtree(plan).query(areas, "intersects")
        height = self.corners[row, :, 1] + above
        meets = (height.min(axis=1) <= y1[box]) & (height.max(axis=1) >= y0[box])
        box, row = box[meets], row[meets]
        pieces = intersection(plan[row], areas[box], grid, more=True)
        flat = np.flatnonzero(~shapely.is_empty(pieces))
        order = flat[np.argsort(self.region[row[flat]], kind="stable")]
        return pieces[order], self.region[row[order]]


def detail_of(scene: Scene, structure: Structure, options: SubdivideOptions) -> Bools:
    """(T,) which triangles are detail, including glass."""
    roles = Designated.of(scene, options)
    detail = roles.detail.copy()
    detail[structure.detail] = True
    glass = np.flatnonzero(~(scene.opaque | detail | roles.structural))
    if options.detail_by_shape and len(glass):
        mesh = Welded.of(scene.points, scene.triangles[glass])
        source, facets = glass[mesh.source], Facets.of(mesh, scene.tolerance)
        detail[source] = detail_by_shape(facets, scene.triangle_object[source], options.wall_area)
    return detail


@dataclass(frozen=True)
class Places:
    """Flat regions of floor."""

    plan: Geometry  # (r,) seen from above, x and z in metres
    slope: Floats  # (r, 3): the height is a·x + b·z + c

    def without_tops(self, ceiling: float, radius: float) -> Places:
        """The regions without those above a height that are narrower than a body of a radius,
        metres: the tops of the walls of rooms without a ceiling."""
        kept = heights(self.plan, self.slope)[0] < ceiling
        kept[~kept] = ~shapely.is_empty(buffer(self.plan[~kept], -radius))
        return Places(self.plan[kept], self.slope[kept])

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


def find_places(floors: Floors, structure: Structure, walker: Walker, boxes: Floats) -> Places:
    """The places of bodies whose middles are in one of (m, 2, 3) boxes, metres."""
    tolerance = structure.tolerance
    pieces, region = floors.within(boxes, walker.middle, tolerance.grid)
    names, plan = united_by(region, pieces, tolerance.grid, more=True)
    slope = _slopes(floors)[names]
    body = (walker.step, walker.height)
    plan, source = clear_of(structure.corners, plan, slope, body, walker.radius, tolerance)
    # A foot is on the uppermost of surfaces one step apart: not on the underside of a slab.
    foot = (2 * tolerance.plane, walker.step)
    plan, which = clear_of(floors.corners, plan, slope[source], foot, 0.0, tolerance)
    names, plan = united_by(source[which], plan, tolerance.grid, more=True)
    # Without corners on straight edges, and in an order independent of the computation.
    plan = straightened(shapely.normalize(plan), tolerance.grid)
    return Places(plan, slope[names])


def spread(corners: Floats) -> tuple[Floats, Floats]:
    """(m, 3) points spread evenly over (n, 3, 3) triangles, and (m,) the m² of each."""
    size = areas(corners)
    each = max(_SAMPLE_AREA, float(size.sum()) / _MOST_SAMPLES)
    count = np.maximum(np.ceil(size / each), 1).astype(np.int64)
    row = np.repeat(np.arange(len(corners)), count)
    share = np.mod((ranges(np.zeros_like(count), count)[:, None] + 0.5) * _STEPS, 1.0)
    share = np.where(share.sum(axis=1, keepdims=True) > 1, 1 - share, share)
    weight = np.column_stack([1 - share.sum(axis=1), share])
    return np.einsum("mc,mcx->mx", weight, corners[row]), (size / count)[row]


def _slopes(floors: Floors) -> Floats:
    """(r, 3): a region's height is a·x + b·z + c, by its largest triangle."""
    corners, region = floors.corners, floors.region
    size = areas(corners)
    order = np.lexsort((-size, region))
    largest = order[np.unique(region[order], return_index=True)[1]]
    normal = normals(corners[largest])
    slope = -normal[:, PLAN] / normal[:, 1:2]
    at = corners[largest].mean(axis=1)
    return np.column_stack([slope, at[:, 1] - np.einsum("ij,ij->i", slope, at[:, PLAN])])


#: Eyes stay farther from what the body touches than rounding, but by no more of its radius.
_SLACK = 0.1
#: Pairs of leaf and floor that are compared at a time.
_AT_ONCE = 1 << 16


def eye_region(places: Places, walker: Walker, tolerance: Tolerance) -> Places:
    """The floor below the eyes: the places, widened by the body's radius less a slack."""
    inside = walker.radius * np.cos(np.pi / (4 * QUARTER))  # of a circle that is a polygon
    reach = inside - min(2 * tolerance.plane, _SLACK * walker.radius)
    box, plan, which = tiled(places.plan, walker.radius, tolerance.grid)
    wide = buffer(plan, reach, more=True, quad_segs=QUARTER)
    eyes = intersection(wide, box, tolerance.grid, more=True)
    some = ~shapely.is_empty(eyes)
    return Places(eyes[some], places.slope[which[some]])


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
    count = np.array([len(each) for each in edges], dtype=np.int64)
    for first in range(0, len(leaf), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        pair = np.repeat(np.arange(len(leaf[some])), count[leaf[some]])
        edge = np.concatenate([edges[i] for i in leaf[some].tolist()])
        height = above(edge, eyes.slope[floor[some]][pair])
        names, shadow = shadows(edge[:, :, PLAN], height, band, pair)
        touches = shapely.intersects(shadow, eyes.plan[floor[some]][names])
        result[leaf[some][names[touches]]] = True
    return result
