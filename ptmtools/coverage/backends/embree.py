"""The item buffer by ray casting: one ray through every pixel centre, with Embree.

Needs no graphics system and costs the same whatever the number of triangles, so it serves where
there is no OpenGL, and is the oracle of the OpenGL backend's tests. The rays of many sample points
are cast together, since a single point has as few as a hundred.

Embree computes in float32. Its tree is built once, around the middle of the geometry: a vertex is
off by at most 6e-8 of the extent, 3 µm in a building of 50 m. Rebuilding it around every sample
point would be exact near the point and cost more than the rays. Directions have 1 for their forward
component, so a hit's distance is its depth in the view, as in OpenGL.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.coverage.item_buffer import BEFORE, VIEWS, ItemSurfaces
from ptmtools.coverage.sample_points import SamplePoints
from ptmtools.embree import ray_tree

#: Rays that are cast together: their arrays stay within the processor's cache.
RAYS = 2**16
#: Time of a ray, µs; fitted, as `opengl.TRIANGLE_COST`, to `benchmarks/ach.py`.
RAY_COST = 0.25


def cost(_triangles: float, pixels: int, _gpu: int | None) -> float:
    """See `Backend.coster`."""
    return RAY_COST * pixels


class EmbreeRenderer:
    """Draws with Embree, which keeps the interpreter's lock: processes, not threads, add speed."""

    def __init__(self, surfaces: ItemSurfaces, face: int, _gpu: int | None = None) -> None:
        """Builds the trees over ``surfaces``, for views of ``face`` pixels a side."""
        self._surfaces = surfaces
        self._face = face
        self.most = max(1, RAYS // (len(VIEWS) * face * face))
        layers = [surfaces.opaque] if surfaces.opaque.all() else [surfaces.opaque, ~surfaces.opaque]
        self._trees = [_RayTree(surfaces, np.flatnonzero(which)) for which in layers]

    @property
    def name(self) -> str:
        """Embree and the version of its binding."""
        from importlib.metadata import version

        return f"Embree (embreex {version('embreex')})"

    def show(self, points: SamplePoints, needed: Bools | None = None) -> NDArray[np.int32]:
        """See `Renderer.show`."""
        layers, _ = self._layers(*self._rays(points))
        return layers.reshape(-1, len(points), len(VIEWS), self._face**2)

    def trace(self, points: SamplePoints, pixels: Ints) -> tuple[NDArray[np.int32], Floats]:
        """See `Renderer.trace`."""
        origin, along = (rays[pixels] for rays in self._rays(points))
        layers, depth = self._layers(origin, along)
        point = pixels // (len(VIEWS) * self._face**2)
        exact = self._surfaces.normalise(points.position)[point]
        return layers, self._surfaces.world(exact + depth[..., None] * along)

    def _rays(self, points: SamplePoints) -> tuple[Singles, Singles]:
        from ptmtools.coverage.kernels import cast_rays

        count = len(points) * len(VIEWS) * self._face**2
        origin, along = (np.empty((count, 3), dtype=np.float32) for _ in range(2))
        position = self._surfaces.normalise(points.position)
        cast_rays(position, points.shift / self._face, self._face, VIEWS, origin, along)
        return origin, along

    def _layers(self, origin: Singles, along: Singles) -> tuple[NDArray[np.int32], Floats]:
        """(L, n) opaque and transparent triangles that the (n, 3) rays hit, or -1; (L, n) depths,
        0 where there is none."""
        triangles, depths = [], []
        limit = None
        for tree in self._trees:
            triangle, depth = tree.hits(origin, along, limit)
            triangles.append(triangle)
            depths.append(np.where(triangle >= 0, depth.astype(np.float64), 0.0))
            limit = np.where(triangle >= 0, depth / np.float32(BEFORE), np.float32(np.inf))
        return np.stack(triangles), np.stack(depths)

    def close(self) -> None:
        """Drops the trees."""
        vars(self).clear()


class _RayTree:
    """A committed Embree scene over some of the surfaces."""

    def __init__(self, surfaces: ItemSurfaces, which: Ints) -> None:
        self._which = np.append(which, -1).astype(np.int32)
        self._tree: Any = None
        if len(which):
            self._tree = ray_tree(surfaces.vertex, surfaces.triangle[which])
            ray = np.ones((1, 3), dtype=np.float32)
            self._tree.run(ray, ray)  # builds the tree now

    def hits(
        self, origin: Singles, along: Singles, limit: Singles | None
    ) -> tuple[NDArray[np.int32], Singles]:
        """(n,) the triangle that each of the (n, 3) rays hits first, up to (n,) ``limit`` depths,
        or -1; and their (n,) depths."""
        if self._tree is None:
            return np.full(len(origin), -1, np.int32), np.zeros(len(origin), np.float32)
        hits = self._tree.run(origin, along, dists=limit, output=True)
        return self._which[hits["primID"]], hits["tfar"]
