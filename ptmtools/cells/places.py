"""Places: where somebody can stand.

A **place** is a point of a surface within 45° of level over which an upright cylinder, the body of
a walker from the height of a step to that of the head, meets nothing structural. It is found in
the structure itself and not in leaves: a walker spans slivers, and does not fit into the hollow of
a wall. In doubt it fits.

Of each flat region of floor it is what is clear of the structure (`clearance`). Circles are
polygons inside them, so that a body is never wider than asked for. Curved floors are many small
regions.

Tried and rejected: a grid of columns, as navigation meshes are made. Doors of 60 cm need cells of
5 cm, of which a campus has a hundred million.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.clearance import CORNERS, PLAN, clear_of, halves, united_by
from ptmtools.cells.detail import recognised
from ptmtools.cells.facets import Facets
from ptmtools.cells.naming import Designated
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.planar import Geometry, delaunay, intersection
from ptmtools.cells.reach import FLOOR_COSINE
from ptmtools.cells.structure import Structure
from ptmtools.cells.vectors import areas, normals, ranges
from ptmtools.cells.welding import Welded
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance

#: Places are sampled once in this area, m², and so often at most.
_SAMPLE_AREA, _MOST_SAMPLES = 0.05, 500_000
#: 1/g and 1/g², where g³ = g + 1 (Roberts' sequence): where in a triangle.
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True)
class Floors:
    """The flat regions of all that is nearly level and no detail."""

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
        """(k,) pieces of floor in plan, what is ``above`` metres over which lies in one of
        (m, 2, 3) boxes, and (k,) the region of each, ascending."""
        plan = shapely.polygons(self.corners[:, :, PLAN])
        (x0, y0, z0), (x1, y1, z1) = boxes.transpose(1, 2, 0)
        areas = shapely.box(x0, z0, x1, z1)
        box, row = shapely.STRtree(plan).query(areas, "intersects")
        height = self.corners[row, :, 1] + above
        meets = (height.min(axis=1) <= y1[box]) & (height.max(axis=1) >= y0[box])
        box, row = box[meets], row[meets]
        pieces = intersection(plan[row], areas[box], grid)
        flat = np.flatnonzero(~shapely.is_empty(pieces))
        order = flat[np.argsort(self.region[row[flat]], kind="stable")]
        return pieces[order], self.region[row[order]]


def detail_of(scene: Scene, structure: Structure, options: SubdivideOptions) -> Bools:
    """(T,) which triangles are detail, of glass as well."""
    said = Designated.of(scene, options)
    detail = said.detail.copy()
    detail[structure.detail] = True
    glass = np.flatnonzero(~(scene.opaque | detail | said.structural))
    if options.detail_by_shape and len(glass):
        mesh = Welded.of(scene.points, scene.triangles[glass])
        source, facets = glass[mesh.source], Facets.of(mesh, scene.tolerance)
        detail[source] = recognised(facets, scene.triangle_object[source], options.wall_area)
    return detail


@dataclass(frozen=True)
class Places:
    """Flat regions of floor."""

    plan: Geometry  # (r,) seen from above, x and z in metres
    slope: Floats  # (r, 3): the height is a·x + b·z + c

    def triangles(self, tolerance: Tolerance) -> Floats:
        """(n, 3, 3) corners, metres."""
        return _triangles(self.plan, self.slope, tolerance.grid)


def find_places(floors: Floors, structure: Structure, walker: Walker, boxes: Floats) -> Places:
    """Where somebody can stand, the middle of whose body is in one of (m, 2, 3) boxes, metres."""
    tolerance = structure.tolerance
    pieces, region = floors.within(boxes, walker.middle, tolerance.grid)
    names, plan = united_by(region, pieces, tolerance.grid)
    slope = _slopes(floors)[names]
    body = (walker.step, walker.height)
    plan, whose = clear_of(structure.corners, plan, slope, body, walker.radius, tolerance)
    # A foot is on the uppermost of surfaces one step apart: not on the underside of a slab.
    foot = (2 * tolerance.plane, walker.step)
    plan, which = clear_of(floors.corners, plan, slope[whose], foot, 0.0, tolerance)
    names, plan = united_by(whose[which], plan, tolerance.grid)
    # Less corners on straight edges, and with the rest in an order that does not depend on the way.
    plan = shapely.simplify(shapely.normalize(plan), tolerance.grid)
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


def _triangles(free: Geometry, slope: Floats, grid: float) -> Floats:
    """(n, 3, 3) triangles of regions in plan, on their slopes."""
    parts, region = shapely.get_parts(free, return_index=True)
    flat = shapely.get_dimensions(parts) == 2
    parts, region = parts[flat], region[flat]
    found, of = [np.zeros((0, 3, 2))], [np.zeros(0, dtype=np.int64)]
    while len(parts):
        # Of many corners, or none that GEOS can divide: cut in two, and tried again.
        large = shapely.get_num_coordinates(parts) > CORNERS
        triangles = delaunay(np.where(large, shapely.Polygon(), parts))
        pieces, part = shapely.get_parts(triangles, return_index=True)
        found.append(shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3])
        of.append(region[part])
        left = shapely.is_empty(triangles)
        parts, which = halves(parts[left], grid)
        region = region[left][which]
    plan, slope = np.concatenate(found), slope[np.concatenate(of)]
    height = np.einsum("ncx,nx->nc", plan, slope[:, :2]) + slope[:, 2:]
    return np.stack([plan[..., 0], height, plan[..., 1]], axis=2)
