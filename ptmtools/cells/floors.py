"""Floors: the flat regions of nearly level triangles, seen from above.

A scanned floor has a region for every triangle, which takes as long to search as a room. Where very
many regions are smaller than a body can tell apart, those of one cube of space are a **patch**: the
hull of their plans, in a plane of their mean slope that none of them rises above.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, normals, ranges, summed
from ptmtools.cells.facets import Facets, Welded
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import Geometry, united_by
from ptmtools.cells.portals import FLOOR_COSINE
from ptmtools.cells.roles import Designated, detail_by_shape
from ptmtools.cells.search import distinct
from ptmtools.cells.structure import Structure
from ptmtools.scene.model import Scene

#: Seen from above.
PLAN = [0, 2]
#: Number of small regions from which a floor is a scan.
_SCAN = 20_000


@dataclass(frozen=True)
class Floors:
    """The flat regions of all nearly level triangles that are no detail, and patches."""

    corners: Floats  # (n, 3, 3) metres
    region: Ints  # (n,) ascending from 0
    front: Bools  # (r,) whether a part of the region is seen from above, not a back only
    slope: Floats  # (r, 3): the height is a·x + b·z + c
    patch: Bools  # (r,) whether it is one

    @staticmethod
    def of(scene: Scene, detail: Bools, grain: float = 0.0) -> Floors:
        """The floors of a scene but for its ``detail``, (T,); ``grain``: side of a patch, metres,
        none for 0."""
        normal = normals(scene.corners)
        steep = np.abs(normal[:, 1]) <= FLOOR_COSINE * np.linalg.norm(normal, axis=1)
        level = np.flatnonzero(~(steep | detail))
        mesh = Welded.of(scene.points, scene.triangles[level])
        facets = Facets.of(mesh, scene.tolerance)
        corners, source = facets.fewer(np.ones(len(mesh.source), dtype=bool), scene.tolerance)
        above = (scene.two_sided | (normal[:, 1] > 0))[level[mesh.source]]
        above = np.bincount(facets.region, above, len(facets.area)) > 0
        region, front = facets.region[source], above[facets.region[source]]
        patch = _small(corners, region, grain) if grain else np.zeros(len(region), dtype=bool)
        if np.count_nonzero(patch) < _SCAN:
            patch[:] = False
        cube = np.floor(corners[patch].mean(axis=1) / max(grain, np.finfo(float).tiny))
        _, of = distinct(np.column_stack([cube, front[patch]]))
        region = np.where(patch, 0, region + 1 + len(of))
        region[patch] = of
        order = np.argsort(region, kind="stable")
        first, region = np.unique(region[order], return_index=True, return_inverse=True)[1:]
        corners, region = corners[order], region.reshape(-1)
        patch, front = patch[order][first], front[order][first]
        return Floors(corners, region, front, _slopes(corners, region, patch), patch)

    @cached_property
    def _start(self) -> Ints:
        return np.searchsorted(self.region, np.arange(len(self.slope) + 1))

    def plan(self, regions: Ints, grid: float) -> Geometry:
        """(k,) the polygons of (k,) regions, seen from above."""
        count = self._start[regions + 1] - self._start[regions]
        rows = ranges(self._start[regions], count)
        of = np.repeat(np.arange(len(regions)), count)
        flat = self.corners[rows][:, :, PLAN]
        result = np.full(len(regions), shapely.Polygon(), dtype=object)
        patch = self.patch[regions]
        some = ~patch[of]
        names, united = united_by(of[some], shapely.polygons(flat[some]), grid, more=True)
        result[names] = united
        if patch.any():
            points, place = flat[~some].reshape(-1, 2), np.cumsum(patch) - 1
            clouds = shapely.multipoints(points, indices=np.repeat(place[of[~some]], 3))
            result[patch] = shapely.convex_hull(clouds)
        return result


def _small(corners: Floats, region: Ints, grain: float) -> Bools:
    """(n,) which of (n, 3, 3) triangles are in regions no larger than a patch in any direction."""
    low, high = np.full((2, int(region.max(initial=-1)) + 1, 3), [[[np.inf]], [[-np.inf]]])
    np.minimum.at(low, region, corners.min(axis=1))
    np.maximum.at(high, region, corners.max(axis=1))
    result: Bools = ((high - low) <= grain).all(axis=1)[region]
    return result


def _slopes(corners: Floats, region: Ints, patch: Bools) -> Floats:
    """(r, 3) the slope of each region, by its largest triangle, or the mean of a patch and the
    highest corner."""
    size = areas(corners)
    order = np.lexsort((-size, region))
    largest = order[np.unique(region[order], return_index=True)[1]]
    normal = normals(corners)
    normal *= np.where(normal[:, 1] < 0, -1.0, 1.0)[:, None]
    mean = np.stack([summed(region, column, len(patch)) for column in normal.T], axis=1)
    normal = np.where(patch[:, None], mean, normal[largest])
    slope = -normal[:, PLAN] / normal[:, 1:2]
    at = corners[largest].mean(axis=1)
    level = at[:, 1] - np.einsum("ij,ij->i", slope, at[:, PLAN])
    rise = corners[..., 1] - np.einsum("ncx,nx->nc", corners[..., PLAN], slope[region])
    top = np.full(len(patch), -np.inf)
    np.maximum.at(top, region, rise.max(axis=1))
    return np.column_stack([slope, np.where(patch, top, level)])


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
