"""Facets: flat regions of a welded mesh, in as few triangles as their outlines need.

Triangles that share edges and lie in one plane are gathered into regions; a region of many is
replaced by as few as its outline allows, if that saves three quarters. No corner moves. Corners are
left out only where an outline runs on straight, so a crack beside one is narrower than a hairline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, normals, sum_by_group
from ptmtools.cells.planar import build_areas, count, simplify, triangulate_polygons
from ptmtools.cells.planes import UPWARD, plane_axes
from ptmtools.cells.search import distinct
from ptmtools.tolerance import Tolerance, rank


@dataclass(frozen=True)
class Welded:
    """The distinct triangles among some: neither repeated, whatever their winding, nor flat."""

    point: Floats  # (V, 3) distinct positions
    triangle: NDArray[np.int32]  # (n, 3) rows of them
    source: Ints  # (n,) the first of the original triangles equal to each, ascending

    @staticmethod
    def from_triangles(points: Floats, triangles: NDArray[np.integer]) -> Welded:
        """The mesh of (T, 3) triangles over (V, 3) points."""
        first, row = distinct(points)
        renamed = row[triangles]
        low, middle, high = np.sort(renamed, axis=1).T
        whole = np.flatnonzero((low < middle) & (middle < high))
        once, _ = distinct(np.stack([low, middle, high], axis=1)[whole])
        source = whole[once]
        return Welded(points[first], renamed[source].astype(np.int32), source)

    @property
    def corners(self) -> Floats:
        """(n, 3, 3) metres."""
        return self.point[self.triangle]


def across_edges(triangle: NDArray[np.integer], turned: Bools) -> NDArray[np.int32]:
    """(n, 3) the triangle beyond the edge from corner k to corner k + 1 of (n, 3) triangles, or -1
    where there is none or several, or it has the edge in the same direction. Triangles ``turned``
    count as wound the other way."""
    count = len(triangle)
    start, end = triangle.astype(np.int64), np.roll(triangle, -1, axis=1).astype(np.int64)
    low, high = np.minimum(start, end).ravel(), np.maximum(start, end).ravel()
    upward = ((start < end) ^ turned[:, None]).ravel()
    key = low * (int(high.max(initial=0)) + 1) + high
    order = np.argsort(key, kind="stable")
    begin = np.flatnonzero(np.append(True, key[order[1:]] != key[order[:-1]])[: len(order)])
    pairs = begin[np.diff(np.append(begin, len(order))) == 2]
    a, b = order[pairs], order[pairs + 1]
    facing = upward[a] != upward[b]
    a, b = a[facing], b[facing]
    beyond = np.full(3 * count, -1, dtype=np.int32)
    beyond[a], beyond[b] = b // 3, a // 3
    return beyond.reshape(-1, 3)


#: A corner lies in the plane of a region if it is within this share of the on-plane distance.
_FLAT_SHARE = 1 / 4
#: A corner may be left out if its distance from the outline is at most this share of it: more than
#: the rounding of single precision.
_STRAIGHT_SHARE = 1 / 32
#: Regions of fewer triangles are left alone, and those of which less than this share is saved.
_MANY = 16
_SAVED = 3 / 4


@dataclass(frozen=True)
class Facets:
    """The flat regions of a mesh."""

    mesh: Welded
    beyond: NDArray[np.int32]  # (n, 3) see `across_edges`
    turned: Bools  # (n,) whether a triangle faces away from `UPWARD`
    region: Ints  # (n,) the region of each triangle
    areas: Floats  # (n,) m² of each triangle
    area: Floats  # (r,) m² of each region
    normal: Floats  # (r, 3) unit vectors
    whole: Bools  # (r,) whether all of it lies in one plane

    @staticmethod
    def from_mesh(mesh: Welded, tolerance: Tolerance) -> Facets:
        """The regions of a mesh, the largest triangles first."""
        from ptmtools.cells.kernels import grow_regions

        corners = mesh.corners
        normal = normals(corners)
        turned = normal @ UPWARD < 0
        normal *= np.where(turned, -1.0, 1.0)[:, None]
        double = np.linalg.norm(normal, axis=1)
        beyond = across_edges(mesh.triangle, turned)
        region, queue = np.full(len(turned), -1), np.empty(len(turned), dtype=np.int64)
        slack = _FLAT_SHARE * tolerance.plane
        seeds = rank(double)
        count = grow_regions(mesh.point, mesh.triangle, beyond, normal, seeds, slack, region, queue)
        mean = np.stack([sum_by_group(region, column, count) for column in normal.T], axis=1)
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), np.finfo(float).tiny)
        height = np.einsum("tci,ti->tc", corners, mean[region])
        level = sum_by_group(region, double * height.mean(axis=1), count)
        weight = sum_by_group(region, double, count)
        level = np.divide(level, weight, out=level, where=weight > 0)
        away = np.abs(height - level[region, None]).max(axis=1) > 2 * slack
        whole = np.bincount(region, away, count) == 0
        return Facets(mesh, beyond, turned, region, double / 2, weight / 2, mean, whole)

    def reduce(self, which: Bools, tolerance: Tolerance) -> tuple[Floats, Ints]:
        """The surface of the triangles ``which``, (n,), in fewer triangles, (m, 3, 3), and (m,) the
        triangle of the mesh that each is, or the first of its region, ascending."""
        size = np.bincount(self.region, which, len(self.area))
        rim = which[:, None] & (self.beyond < 0)
        inner = ~rim & which[:, None]
        neighbour = np.where(inner, self.beyond, 0)
        rim |= inner & ((self.region[neighbour] != self.region[:, None]) | ~which[neighbour])
        edges = np.bincount(self.region, rim.sum(axis=1), len(self.area))
        # An outline of e edges takes e - 2 triangles or more; most of its corners are on straights.
        many = self.whole & (size >= _MANY) & (edges <= size / 2)
        chosen = np.flatnonzero(many)
        outline = rim & many[self.region][:, None]
        area = sum_by_group(self.region, self.areas * which, len(self.area))[chosen]
        corners, owner = self._retriangulate(chosen, area, outline, tolerance)
        # Wound as most of the region is.
        facing = self.areas * which * np.where(self.turned, -1.0, 1.0)
        facing = sum_by_group(self.region, facing, len(self.area))[chosen]
        turn = np.einsum("ij,ij->i", normals(corners), self.normal[chosen[owner]])
        back = turn * facing[owner] < 0
        corners[back] = corners[back][:, ::-1]
        count = np.bincount(owner, minlength=len(chosen))
        saved = (count > 0) & (count <= (1 - _SAVED) * size[chosen])
        kept = which.copy()
        replaced = np.zeros(len(self.area), dtype=bool)
        replaced[chosen[saved]] = True
        kept &= ~replaced[self.region]
        first = np.full(len(self.area), len(which))
        np.minimum.at(first, self.region, np.where(which, np.arange(len(which)), len(which)))
        fresh = saved[owner]
        source = np.concatenate([np.flatnonzero(kept), first[chosen[owner[fresh]]]])
        every = np.concatenate([self.mesh.corners[kept], corners[fresh]])
        order = np.argsort(source, kind="stable")
        return every[order], source[order]

    def _retriangulate(
        self, chosen: Ints, area: Floats, outline: Bools, tolerance: Tolerance
    ) -> tuple[Floats, Ints]:
        """Triangles (m, 3, 3) of the chosen regions, whose ``area`` these (n, 3) edges outline, and
        (m,) the region of each; regions whose outline bounds another area or has no triangulation
        are left out."""
        if not len(chosen):
            return np.zeros((0, 3, 3)), np.zeros(0, dtype=np.int64)
        at, k = np.nonzero(outline)
        place = np.full(len(self.area), -1)
        place[chosen] = np.arange(len(chosen))
        owner = place[self.region[at]]
        order = np.argsort(owner, kind="stable")
        at, k, owner = at[order], k[order], owner[order]
        ends = np.stack([self.mesh.triangle[at, k], self.mesh.triangle[at, (k + 1) % 3]], axis=1)
        u, v = plane_axes(self.normal[chosen])
        space = self.mesh.point[ends]
        flat = np.stack(
            [np.einsum("eki,ei->ek", space, u[owner]), np.einsum("eki,ei->ek", space, v[owner])],
            axis=2,
        )
        areas = build_areas(flat, owner)
        straight = _STRAIGHT_SHARE * tolerance.plane
        areas = simplify(areas, straight)
        allowed = straight * shapely.length(areas) + tolerance.rounding * tolerance.extent
        sound = shapely.is_valid(areas) & (np.abs(shapely.area(areas) - area) <= allowed)
        sound_rows = np.flatnonzero(sound)
        rings, which = triangulate_polygons(areas[sound_rows])
        return self._lift(rings, sound_rows[which], flat, owner, space)

    def _lift(
        self, rings: Floats, which: Ints, flat: Floats, owner: Ints, space: Floats
    ) -> tuple[Floats, Ints]:
        """(m, 3, 3) positions of (k, 3, 2) triangles of regions ``which``, those of the ends of
        edges, ``flat`` and in ``space``, (e, 2, …), of the regions ``owner``; and (m,) the region
        of each. None of a region with a corner where no edge ends: two of its edges cross."""
        known = np.column_stack([np.repeat(owner, 2).astype(np.float64), flat.reshape(-1, 2)])
        corners = np.column_stack([np.repeat(which, 3).astype(np.float64), rings.reshape(-1, 2)])
        first, row = distinct(np.concatenate([known, corners]))
        origin = first[row[len(known) :]]
        fresh = (origin >= len(known)).reshape(-1, 3).any(axis=1)
        crossed = np.unique(which[fresh])
        count(["triangles"] * len(crossed))
        kept = ~np.isin(which, crossed)
        return space.reshape(-1, 3)[origin.reshape(-1, 3)[kept]], which[kept]
