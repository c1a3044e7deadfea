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

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.facets import Facets
from ptmtools.cells.naming import named
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.planar import Geometry
from ptmtools.cells.reach import FLOOR_COSINE
from ptmtools.cells.structure import Structure
from ptmtools.cells.vectors import areas, normals
from ptmtools.cells.welding import Welded
from ptmtools.scene.model import Scene

#: Places smaller than this, m², are noise: a foot is larger.
LEAST_AREA = 1e-2
#: Corners of a quarter of a circle.
_QUARTER = 4
#: Places are sampled in parts whose sides are at most this long, metres.
_SAMPLE_SIDE = 0.25
_PLAN = [0, 2]


@dataclass(frozen=True)
class Floors:
    """The flat regions of all that is nearly level and no detail; one-sided faces from their front
    only, or the inside of a solid would be a room."""

    corners: Floats  # (n, 3, 3) metres
    region: Ints  # (n,) ascending from 0

    @staticmethod
    def of(scene: Scene, structure: Structure, options: SubdivideOptions) -> Floors:
        """The floors of a scene."""
        detail = named(scene, options.detail) & ~named(scene, options.structural)
        detail[structure.detail] = True
        normal = normals(scene.corners)
        up = np.where(scene.two_sided, np.abs(normal[:, 1]), normal[:, 1])
        level = up > FLOOR_COSINE * np.linalg.norm(normal, axis=1)
        mesh = Welded.of(scene.points, scene.triangles[np.flatnonzero(level & ~detail)])
        facets = Facets.of(mesh, scene.tolerance)
        corners, source = facets.fewer(np.ones(len(mesh.source), dtype=bool), scene.tolerance)
        order = np.argsort(facets.region[source], kind="stable")
        region = np.unique(facets.region[source[order]], return_inverse=True)[1].reshape(-1)
        return Floors(corners[order], region)

    def only(self, which: Bools) -> Floors:
        """The regions of which one of the (n,) triangles is asked for."""
        wanted = np.zeros(int(self.region.max(initial=-1)) + 1, dtype=bool)
        wanted[self.region[which]] = True
        rows = np.flatnonzero(wanted[self.region])
        region = np.unique(self.region[rows], return_inverse=True)[1].reshape(-1)
        return Floors(self.corners[rows], region)


def find_places(floors: Floors, structure: Structure, walker: Walker) -> Floats:
    """(n, 3, 3) triangles, metres, on which somebody can stand."""
    if not len(floors.region):
        return np.zeros((0, 3, 3))
    slope = _slopes(floors.corners, floors.region)
    plan = _joined(shapely.polygons(floors.corners[:, :, _PLAN]), floors.region)
    return _triangles(shapely.difference(plan, _taken(structure, plan, slope, walker)), slope)


def spread(corners: Floats) -> tuple[Floats, Floats, Ints]:
    """(m, 3) points spread over (n, 3, 3) triangles, (m,) the m² that each stands for, and (m,) the
    triangle of each."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0)
    times = np.maximum(np.ceil(sides / _SAMPLE_SIDE), 1).astype(np.int64)
    points, weights, rows = [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, dtype=np.int64)]
    for n in np.unique(times).tolist():
        row, share = np.flatnonzero(times == n), _centroids(n)
        points.append(np.einsum("kc,tcx->tkx", share, corners[row]).reshape(-1, 3))
        weights.append(np.repeat(areas(corners[row]) / len(share), len(share)))
        rows.append(np.repeat(row, len(share)))
    return np.concatenate(points), np.concatenate(weights), np.concatenate(rows)


def _slopes(corners: Floats, region: Ints) -> Floats:
    """(r, 3): a region's height is a·x + b·z + c, by its largest triangle."""
    size = areas(corners)
    order = np.lexsort((-size, region))
    largest = order[np.unique(region[order], return_index=True)[1]]
    normal = normals(corners[largest])
    slope = -normal[:, _PLAN] / normal[:, 1:2]
    at = corners[largest].mean(axis=1)
    return np.column_stack([slope, at[:, 1] - np.einsum("ij,ij->i", slope, at[:, _PLAN])])


def _joined(shapes: Geometry, group: Ints) -> Geometry:
    """(g,) the union of each group of shapes, (n,) ascending from 0."""
    if not len(shapes):
        return shapes
    cuts = np.flatnonzero(np.diff(group)) + 1
    return np.array(
        [part[0] if len(part) == 1 else shapely.union_all(part) for part in np.split(shapes, cuts)]
    )


def _taken(structure: Structure, plan: Geometry, slope: Floats, walker: Walker) -> Geometry:
    """(r,) where the middle of a body cannot be, over each region of floor."""
    corners = structure.corners
    low, high = corners.min(axis=1), corners.max(axis=1)
    boxes = shapely.box(*low[:, _PLAN].T, *high[:, _PLAN].T)
    region, obstacle = shapely.STRtree(boxes).query(plan, "dwithin", distance=walker.radius)
    height = _above(corners[obstacle], slope[region])
    meets = (height.min(axis=1) <= walker.height) & (height.max(axis=1) >= walker.step)
    region, obstacle, height = region[meets], obstacle[meets], height[meets]
    shadow = _shadows(corners[obstacle][:, :, _PLAN], height, walker)
    # One by one: GEOS 3.14 buffers many lines at once with holes where they meet.
    shadow = shapely.buffer(shadow, walker.radius, quad_segs=_QUARTER)
    order = np.argsort(region, kind="stable")
    names, group = np.unique(region[order], return_inverse=True)
    taken = np.full(len(plan), shapely.Polygon())
    taken[names] = _joined(shadow[order], group.reshape(-1))
    return taken


def _above(corners: Floats, slope: Floats) -> Floats:
    """(n, 3) heights of the corners of triangles above the slope of each."""
    plan = np.einsum("ncx,nx->nc", corners[:, :, _PLAN], slope[:, :2])
    above: Floats = corners[:, :, 1] - plan - slope[:, 2:]
    return above


def _shadows(plan: Floats, height: Floats, walker: Walker) -> Geometry:
    """(n,) what of triangles, (n, 3, 2) in plan and (n, 3) high, is as high as a body, in plan."""
    points, valid = [plan], [(height >= walker.step) & (height <= walker.height)]
    following, after = np.roll(plan, -1, axis=1), np.roll(height, -1, axis=1)
    for level in (walker.step, walker.height):
        crosses = (height - level) * (after - level) < 0
        share = np.divide(level - height, after - height, out=np.zeros(height.shape), where=crosses)
        points.append(plan + share[..., None] * (following - plan))
        valid.append(crosses)
    every, which = np.concatenate(points, axis=1), np.concatenate(valid, axis=1)
    row, _ = np.nonzero(which)
    found = np.full(len(plan), shapely.Polygon())
    if len(row):
        names, group = np.unique(row, return_inverse=True)
        clouds = shapely.multipoints(every[which], indices=group.reshape(-1))
        found[names] = shapely.convex_hull(clouds)
    return found


def _triangles(free: Geometry, slope: Floats) -> Floats:
    """(n, 3, 3) triangles of regions in plan, on their slopes."""
    parts, region = shapely.get_parts(free, return_index=True)
    large = shapely.area(parts) >= LEAST_AREA
    parts, region = parts[large], region[large]
    pieces, part = shapely.get_parts(
        shapely.constrained_delaunay_triangles(parts), return_index=True
    )
    plan = shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3]
    slope = slope[region[part]]
    height = np.einsum("ncx,nx->nc", plan, slope[:, :2]) + slope[:, 2:]
    return np.stack([plan[..., 0], height, plan[..., 1]], axis=2)


def _centroids(times: int) -> Floats:
    """(times², 3) barycentric coordinates of the middles of a triangle's equal parts."""
    i, j = (k.ravel() for k in np.meshgrid(np.arange(times), np.arange(times), indexing="ij"))
    first = np.stack([i, j], axis=1)[i + j < times] + 1 / 3
    second = np.stack([i, j], axis=1)[i + j < times - 1] + 2 / 3
    share = np.concatenate([first, second]) / times
    return np.column_stack([share, 1 - share.sum(axis=1)])
