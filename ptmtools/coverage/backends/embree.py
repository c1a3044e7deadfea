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

from ptmtools.coverage.item_buffer import BEFORE, VIEWS, Surfaces
from ptmtools.coverage.sample_points import SamplePoints

#: Rays that are cast together: their arrays stay within the processor's cache.
RAYS = 2**16
#: What a ray takes, µs; fitted, as `opengl.TRIANGLE_COST`, to `benchmarks/ach.py`.
RAY_COST = 0.25


def cost(_triangles: float, pixels: int, _gpu: int | None) -> float:
    """See `Backend.coster`."""
    return RAY_COST * pixels


class EmbreeRenderer:
    """Draws with Embree, which keeps the interpreter's lock: processes, not threads, add speed."""

    def __init__(self, surfaces: Surfaces, face: int, _gpu: int | None = None) -> None:
        """Builds the trees over ``surfaces``, for views of ``face`` pixels a side."""
        self._surfaces = surfaces
        self._face = face
        self.most = max(1, RAYS // (len(VIEWS) * face * face))
        opaque, transparent = np.flatnonzero(surfaces.opaque), np.flatnonzero(~surfaces.opaque)
        self._opaque, self._transparent = _Tree(surfaces, opaque), _Tree(surfaces, transparent)

    @property
    def name(self) -> str:
        """Embree and the version of its binding."""
        from importlib.metadata import version

        return f"Embree (embreex {version('embreex')})"

    def show(
        self, points: SamplePoints, needed: NDArray[np.bool_] | None = None
    ) -> NDArray[np.int32]:
        """See `Renderer.show`."""
        origin, along = self._rays(points)
        if self._transparent.empty:
            layers = self._opaque.nearest(origin, along)[None]
        else:
            layers = self._two_layers(origin, along)[0]
        return layers.reshape(-1, len(points), len(VIEWS), self._face**2)

    def trace(
        self, points: SamplePoints, pixels: NDArray[np.int64]
    ) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """See `Renderer.trace`."""
        origin, along = (rays[pixels] for rays in self._rays(points))
        layers = slice(1 if self._transparent.empty else 2)
        found, depth = self._two_layers(origin, along)
        point = pixels // (len(VIEWS) * self._face**2)
        exact = self._surfaces.normalised(points.position)[point]
        return found[layers], self._surfaces.world(exact + depth[layers, :, None] * along)

    def _rays(self, points: SamplePoints) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        from ptmtools.coverage.tally_kernels import cast_rays

        count = len(points) * len(VIEWS) * self._face**2
        origin, along = (np.empty((count, 3), dtype=np.float32) for _ in range(2))
        position = self._surfaces.normalised(points.position)
        cast_rays(position, points.shift / self._face, self._face, VIEWS, origin, along)
        return origin, along

    def _two_layers(
        self, origin: NDArray[np.float32], along: NDArray[np.float32]
    ) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """(2, n) opaque and transparent triangles that the (n, 3) rays hit, or -1; (2, n) depths,
        0 where there is none."""
        opaque, depth = self._opaque.hits(origin, along)
        limit = np.where(opaque >= 0, depth / np.float32(BEFORE), np.float32(np.inf))
        pane, pane_depth = self._transparent.hits(origin, along, limit.astype(np.float32))
        found, depths = np.stack([opaque, pane]), np.stack([depth, pane_depth]).astype(np.float64)
        return found, np.where(found >= 0, depths, 0.0)

    def close(self) -> None:
        """Drops the trees."""
        vars(self).clear()


class _Tree:
    """A committed Embree scene over some of the surfaces."""

    def __init__(self, surfaces: Surfaces, which: NDArray[np.int64]) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.empty = len(which) == 0
        self._all = len(which) == len(surfaces.triangle)
        self._which = np.append(which, -1).astype(np.int32)
        self._tree: Any = None
        if not self.empty:
            self._tree = EmbreeScene(robust=True)
            mesh = surfaces.vertex.astype(np.float32), surfaces.triangle[which]
            TriangleMesh(self._tree, *mesh)
            ray = np.ones((1, 3), dtype=np.float32)
            self._tree.run(ray, ray)  # builds the tree now

    def nearest(self, origin: NDArray[np.float32], along: NDArray[np.float32]) -> NDArray[np.int32]:
        """(n,) the triangle that each of the (n, 3) rays hits first, or -1."""
        if self.empty:
            return np.full(len(origin), -1, dtype=np.int32)
        return self._named(self._tree.run(origin, along))

    def hits(
        self,
        origin: NDArray[np.float32],
        along: NDArray[np.float32],
        limit: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """`nearest` within (n,) ``limit`` depths, and their (n,) depths."""
        if self.empty:
            return self.nearest(origin, along), np.zeros(len(origin), dtype=np.float32)
        found = self._tree.run(origin, along, dists=limit, output=True)
        return self._named(found["primID"]), found["tfar"]

    def _named(self, found: NDArray[np.int32]) -> NDArray[np.int32]:
        """Numbers within the tree, -1 for a miss, as numbers of the surfaces in it."""
        return found if self._all else self._which[found]
