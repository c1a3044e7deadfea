"""The parts of floors at a distance from a structure.

For each flat region of floor, the part of the structure in a band of heights above it is projected
onto it along the vertical, widened by a radius and subtracted. Circles are polygons inside them.
Floors and triangles are sorted by storeys, and regions with many triangles about them are cut in
two, so the time is proportional to the triangles near floors.
"""

from __future__ import annotations

import numpy as np
import shapely

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.planar import Geometry, buffer, difference, intersection, united_by
from ptmtools.cells.planes import PLAN
from ptmtools.cells.search import ByHeight
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
        row, near = _pairs_near(corners, by_height, plan, slope, band, radius)
        crowded = (np.bincount(row, minlength=len(plan)) > _CROWD) & (
            longest(plan) > _SHORT * band[1]
        )
        some = ~crowded[row]
        free = _subtract_near(plan, slope, corners[near[some]], row[some], band, radius, tolerance)
        kept = ~crowded & ~shapely.is_empty(free)
        left.append(free[kept])
        owner.append(region[kept])
        plan, half = halves(plan[crowded], tolerance.grid)
        slope, region = slope[crowded][half], region[crowded][half]
    return np.concatenate(left), np.concatenate(owner)


def _pairs_near(
    corners: Floats,
    by_height: ByHeight,
    plan: Geometry,
    slope: Floats,
    band: tuple[float, float],
    radius: float,
) -> tuple[Ints, Ints]:
    """(p,) and (p,): pairs of a region of floor and a triangle, (n, 3, 3), as high above it as a
    ``band``, whose boxes in plan are no more than a radius apart."""
    least, most = heights(plan, slope)
    margin = radius * np.linalg.norm(slope[:, :2], axis=1)  # the slope goes on beyond the region
    least, most = least - margin, most + margin
    storey = np.floor(least / (_STOREY * (band[1] - band[0])))
    rows, hits = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    flat = corners[:, :, PLAN]
    boxes = shapely.box(*flat.min(axis=1).T, *flat.max(axis=1).T)
    x0, z0, x1, z1 = shapely.bounds(plan).reshape(-1, 4).T
    reach = shapely.box(x0 - radius, z0 - radius, x1 + radius, z1 + radius)
    # Storey by storey, so that a floor is compared only with triangles of its height.
    for name in np.unique(storey):
        here = np.flatnonzero(storey == name)
        about = by_height.between(least[here].min() + band[0], most[here].max() + band[1])
        row, near = shapely.STRtree(boxes[about]).query(reach[here])
        row, near = here[row], about[near]
        height = above(corners[near], slope[row])
        meets = (height.min(axis=1) <= band[1]) & (height.max(axis=1) >= band[0])
        rows.append(row[meets])
        hits.append(near[meets])
    return np.concatenate(rows), np.concatenate(hits)


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
    left = plan.copy()
    first, end = 0, 1
    while (turn >= first).any():
        at = np.flatnonzero((turn >= first) & (turn < end))
        at = at[~shapely.is_empty(left[row[at]])]
        height = above(corners[at], slope[row[at]])
        each, shadow = shadows(corners[at][:, :, PLAN], height, band, at)
        # A radius away is not near, but for rounding.
        near = shapely.dwithin(shadow, left[row[each]], (1 - 1e-6) * radius)
        shadow, target = _merge(shadow[near], row[each[near]], radius, tolerance)
        # One by one: GEOS 3.14 buffers many lines at once with holes where they meet.
        wide = buffer(shadow, radius, quad_segs=QUARTER)
        names, taken = united_by(target, wide, tolerance.grid)
        left[names] = difference(left[names], taken, tolerance.grid)
        first, end = end, int(_GROWTH * end) + 1
    return left


def _merge(
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
        large = (shapely.get_num_coordinates(shapes) > CORNERS) & (longest(own) > _NARROW * margin)
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
