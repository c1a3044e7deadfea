"""Places: where somebody can stand.

A **place** is a point of a surface within 45° of level over which an upright cylinder, the body of
a walker from the height of a step to that of the head, meets nothing structural. It is found in
the structure itself and not in leaves: a walker spans slivers, and does not fit into the hollow of
a wall. In doubt it fits.

For each flat region of floor: what of the structure is as high above it as the body is projected
onto the floor along the vertical, widened by the body's radius, and taken away. Above a slope,
heights are measured from the slope. A circle is a polygon inside it, so that a body is never wider
than asked for. Curved floors are many small regions; what is far above or below them is sorted out
by boxes, so the time is in proportion to what stands about.

Tried and rejected: a grid of columns, as navigation meshes are made. Doors of 60 cm need cells of
5 cm, of which a campus has a hundred million.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.facets import Facets
from ptmtools.cells.naming import named
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.planar import Geometry, delaunay
from ptmtools.cells.reach import FLOOR_COSINE
from ptmtools.cells.structure import Structure
from ptmtools.cells.vectors import areas, normals, ranges
from ptmtools.cells.welding import Welded
from ptmtools.scene.model import Scene

#: Floors so near to each other in height, as a share of the band that is looked at, are looked at
#: together.
_STOREY = 0.2
#: A shape of less area for its length than this share of a radius is a line.
_THIN = 4e-3
#: A region is first held against one of the triangles about it, then against so many times more.
_GROWTH = 1.25
#: Regions with more triangles about them, and shapes of more corners, are cut in two,
_CROWD, _CORNERS = 256, 256
#: unless they are no longer than this many times what they are held against is high, or wide.
_SHORT, _NARROW = 1.2, 8.0
#: Corners of a quarter of a circle.
QUARTER = 4
#: Places are sampled once in this area, m², and so often at most.
_SAMPLE_AREA, _MOST_SAMPLES = 0.05, 500_000
#: 1/g and 1/g², where g³ = g + 1 (Roberts' sequence): where in a triangle.
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])
#: Axes of the plan.
PLAN = [0, 2]


@dataclass(frozen=True)
class Floors:
    """The flat regions of all that is nearly level and no detail."""

    corners: Floats  # (n, 3, 3) metres
    region: Ints  # (n,) ascending from 0

    @staticmethod
    def of(
        scene: Scene, structure: Structure, options: SubdivideOptions, *, backs: bool = False
    ) -> Floors:
        """The floors of a scene, of one-sided faces the fronts only, or the inside of a solid would
        be a room; or their ``backs`` as well."""
        detail = named(scene, options.detail) & ~named(scene, options.structural)
        detail[structure.detail] = True
        normal = normals(scene.corners)
        up = np.where(scene.two_sided | backs, np.abs(normal[:, 1]), normal[:, 1])
        level = up > FLOOR_COSINE * np.linalg.norm(normal, axis=1)
        mesh = Welded.of(scene.points, scene.triangles[np.flatnonzero(level & ~detail)])
        facets = Facets.of(mesh, scene.tolerance)
        corners, source = facets.fewer(np.ones(len(mesh.source), dtype=bool), scene.tolerance)
        order = np.argsort(facets.region[source], kind="stable")
        region = np.unique(facets.region[source[order]], return_inverse=True)[1].reshape(-1)
        return Floors(corners[order], region)

    def within(self, boxes: Floats, above: float) -> tuple[Geometry, Ints]:
        """(k,) pieces of floor in plan, what is ``above`` metres over which lies in one of
        (m, 2, 3) boxes, and (k,) the region of each, ascending."""
        plan = shapely.polygons(self.corners[:, :, PLAN])
        (x0, y0, z0), (x1, y1, z1) = boxes.transpose(1, 2, 0)
        areas = shapely.box(x0, z0, x1, z1)
        box, row = shapely.STRtree(plan).query(areas, "intersects")
        height = self.corners[row, :, 1] + above
        meets = (height.min(axis=1) <= y1[box]) & (height.max(axis=1) >= y0[box])
        box, row = box[meets], row[meets]
        pieces = shapely.intersection(plan[row], areas[box])
        flat = np.flatnonzero(shapely.get_dimensions(pieces) == 2)
        order = flat[np.argsort(self.region[row[flat]], kind="stable")]
        return pieces[order], self.region[row[order]]


@dataclass(frozen=True)
class Places:
    """Flat regions of floor."""

    plan: Geometry  # (r,) seen from above, x and z in metres
    slope: Floats  # (r, 3): the height is a·x + b·z + c

    def triangles(self) -> Floats:
        """(n, 3, 3) corners, metres."""
        return _triangles(self.plan, self.slope)


def find_places(floors: Floors, structure: Structure, walker: Walker, boxes: Floats) -> Places:
    """Where somebody can stand, the middle of whose body is in one of (m, 2, 3) boxes, metres."""
    pieces, region = floors.within(boxes, walker.middle)
    names, plan = _joined_by(region, pieces)
    slope = _slopes(floors)[names]
    body = (walker.step, walker.height)
    plan, whose = _left(structure.corners, plan, slope, body, walker.radius)
    # A foot is on the uppermost of surfaces one step apart: not on the underside of a slab.
    foot = (2 * structure.tolerance.plane, walker.step)
    plan, which = _left(floors.corners, plan, slope[whose], foot, 0.0)
    names, plan = _joined_by(whose[which], plan)
    # Less corners on straight edges, and with the rest in an order that does not depend on the way.
    plan = shapely.simplify(shapely.normalize(plan), structure.tolerance.grid)
    return Places(plan, slope[names])


def spread(corners: Floats) -> tuple[Floats, Floats]:
    """(m, 3) points spread evenly over (n, 3, 3) triangles, and (m,) the m² that each is for."""
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


def _joined_by(row: Ints, shapes: Geometry) -> tuple[Ints, Geometry]:
    """(g,) the rows, (n,), that shapes have, ascending, and the union of those of each; none of
    those only that are as wide as rounding, whose union is empty."""
    if not len(shapes):
        return row, shapes
    order = np.argsort(row, kind="stable")
    names, first = np.unique(row[order], return_index=True)
    parts = np.split(shapes[order], first[1:])
    united = np.array([part[0] if len(part) == 1 else shapely.union_all(part) for part in parts])
    some = ~shapely.is_empty(united)
    return names[some], united[some]


def _left(
    corners: Floats, plan: Geometry, slope: Floats, band: tuple[float, float], radius: float
) -> tuple[Geometry, Ints]:
    """(k,) pieces of regions of floor that are no less than a radius from triangles, (n, 3, 3), as
    high above them as a ``band``; in plan. And (k,) the region of each."""
    left, whose, region = [plan[:0]], [np.zeros(0, dtype=np.int64)], np.arange(len(plan))
    while len(region):
        row, near = _about(corners, plan, slope, band, radius)
        crowded = (np.bincount(row, minlength=len(plan)) > _CROWD) & (
            _length(plan) > _SHORT * band[1]
        )
        some = ~crowded[row]
        free = _less(plan, slope, corners[near[some]], row[some], band, radius)
        kept = ~crowded & ~shapely.is_empty(free)
        left.append(free[kept])
        whose.append(region[kept])
        plan, half = halves(plan[crowded])
        slope, region = slope[crowded][half], region[crowded][half]
    return np.concatenate(left), np.concatenate(whose)


def _about(
    corners: Floats, plan: Geometry, slope: Floats, band: tuple[float, float], radius: float
) -> tuple[Ints, Ints]:
    """(p,) and (p,): pairs of a region of floor and a triangle, (n, 3, 3), as high above it as a
    ``band``, whose box in plan is no more than a radius away."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    boxes = shapely.box(*low[:, PLAN].T, *high[:, PLAN].T)
    least, most = heights(plan, slope)
    storey = np.floor(least / (_STOREY * (band[1] - band[0])))
    rows, found = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    # Storey by storey, so that a floor is held against what is as high only.
    for name in np.unique(storey):
        here = np.flatnonzero(storey == name)
        lowest, highest = least[here].min() + band[0], most[here].max() + band[1]
        about = np.flatnonzero((high[:, 1] >= lowest) & (low[:, 1] <= highest))
        row, near = shapely.STRtree(boxes[about]).query(plan[here], "dwithin", distance=radius)
        row, near = here[row], about[near]
        height = above(corners[near], slope[row])
        meets = (height.min(axis=1) <= band[1]) & (height.max(axis=1) >= band[0])
        rows.append(row[meets])
        found.append(near[meets])
    return np.concatenate(rows), np.concatenate(found)


def _less(
    plan: Geometry,
    slope: Floats,
    corners: Floats,
    row: Ints,
    band: tuple[float, float],
    radius: float,
) -> Geometry:
    """(r,) regions less what is less than a radius from triangles, (n, 3, 3), each of which stands
    about the region of its ``row``.

    Of most regions, such as the tops of mouldings, the first few leave nothing, and of a wall of
    many triangles, a few take what all do. So they are tried by turns, those first that may take
    most, and only the ones that still come near to what is left."""
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
        shadow, whose = _merged(shadow[near], row[each[near]], radius)
        # One by one: GEOS 3.14 buffers many lines at once with holes where they meet.
        names, taken = _joined_by(whose, shapely.buffer(shadow, radius, quad_segs=QUARTER))
        left[names] = shapely.difference(left[names], taken)
        first, end = end, int(_GROWTH * end) + 1
    return left


def _merged(shapes: Geometry, row: Ints, radius: float) -> tuple[Geometry, Ints]:
    """Shapes and the (n,) row of each, those with an area united row by row: fewer to widen. Of
    thin ones, such as a wall's, nothing would be left."""
    flat = shapely.area(shapes) > _THIN * radius * shapely.length(shapes)
    names, united = _joined_by(row[flat], shapes[flat])
    parts, which = shapely.get_parts(united, return_index=True)
    return np.append(shapes[~flat], parts), np.append(row[~flat], names[which])


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
    found: Floats = corners[:, :, 1] - plan - slope[:, 2:]
    return found


def shadows(
    plan: Floats, height: Floats, band: tuple[float, float], whose: Ints
) -> tuple[Ints, Geometry]:
    """What of convex things is in a band of heights, in plan: their names, ascending, and shapes.
    They are given by polygons or edges, (n, k, 2) in plan and (n, k) high, and (n,) names."""
    points, valid = [plan], [(height >= band[0]) & (height <= band[1])]
    following, after = np.roll(plan, -1, axis=1), np.roll(height, -1, axis=1)
    for level in band:
        crosses = (height - level) * (after - level) < 0
        share = np.divide(level - height, after - height, out=np.zeros(height.shape), where=crosses)
        points.append(plan + share[..., None] * (following - plan))
        valid.append(crosses)
    every, which = np.concatenate(points, axis=1), np.concatenate(valid, axis=1)
    row, _ = np.nonzero(which)
    order = np.argsort(whose[row], kind="stable")
    names, group = np.unique(whose[row][order], return_inverse=True)
    clouds = shapely.multipoints(every[which][order], indices=group.reshape(-1))
    return names, np.asarray(shapely.convex_hull(clouds))


def tiled(shapes: Geometry, margin: float) -> tuple[Geometry, Geometry, Ints]:
    """(m,) boxes that share out what is up to a margin from each of (n,) shapes, (m,) what of the
    shape is up to a margin from each box, of few corners each, and (m,) its shape: what is done to
    corners one by one is in proportion to their number."""
    x0, y0, x1, y1 = shapely.bounds(shapes).reshape(-1, 4).T
    own = shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)
    which = np.arange(len(shapes))
    found: list[tuple[Geometry, Geometry, Ints]] = []
    while True:
        large = (shapely.get_num_coordinates(shapes) > _CORNERS) & (_length(own) > _NARROW * margin)
        found.append((own[~large], shapes[~large], which[~large]))
        if not large.any():
            boxes, pieces, names = zip(*found, strict=True)
            return np.concatenate(boxes), np.concatenate(pieces), np.concatenate(names)
        own, half = halves(own[large])
        x0, y0, x1, y1 = shapely.bounds(own).T
        about = shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)
        shapes, which = shapely.intersection(shapes[large][half], about), which[large][half]


def _triangles(free: Geometry, slope: Floats) -> Floats:
    """(n, 3, 3) triangles of regions in plan, on their slopes."""
    parts, region = shapely.get_parts(free, return_index=True)
    flat = shapely.get_dimensions(parts) == 2
    parts, region = parts[flat], region[flat]
    found, of = [np.zeros((0, 3, 2))], [np.zeros(0, dtype=np.int64)]
    while len(parts):
        # Of many corners, or none that GEOS can divide: cut in two, and tried again.
        large = shapely.get_num_coordinates(parts) > _CORNERS
        triangles = delaunay(np.where(large, shapely.Polygon(), parts))
        pieces, part = shapely.get_parts(triangles, return_index=True)
        found.append(shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3])
        of.append(region[part])
        left = shapely.is_empty(triangles)
        parts, which = halves(parts[left])
        region = region[left][which]
    plan, slope = np.concatenate(found), slope[np.concatenate(of)]
    height = np.einsum("ncx,nx->nc", plan, slope[:, :2]) + slope[:, 2:]
    return np.stack([plan[..., 0], height, plan[..., 1]], axis=2)


def halves(shapes: Geometry) -> tuple[Geometry, Ints]:
    """(m,) the polygons to both sides of the middles of (n,) shapes, and (m,) the shape of each."""
    x0, y0, x1, y1 = shapely.bounds(shapes).reshape(-1, 4).T
    middle = np.where(x1 - x0 > y1 - y0, (x0 + x1) / 2, x1)
    level = np.where(x1 - x0 > y1 - y0, y1, (y0 + y1) / 2)
    sides = (
        shapely.box(x0, y0, middle, level),
        shapely.box(np.where(middle < x1, middle, x0), np.where(level < y1, level, y0), x1, y1),
    )
    both = np.concatenate([shapely.intersection(shapes, side) for side in sides])
    parts, which = shapely.get_parts(both, return_index=True)
    flat = (shapely.get_dimensions(parts) == 2) & (shapely.area(parts) > 0)
    return parts[flat], which[flat] % max(len(shapes), 1)
