"""What is in the way of a body or of an eye: rays against all that a model shows, glass and
furniture included, but for door leaves that stand open.

Embree computes in single precision, here around the middle of the model.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.scene.model import Scene

#: Rays that are cast together: their arrays stay within the processor's cache.
_RAYS = 1 << 16


class Obstacles:
    """The triangles of a scene that stand in the way."""

    def __init__(self, scene: Scene, cells: Cells) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        solid = np.ones(len(scene.triangles), dtype=np.bool_)
        solid[cells.opened] = False
        self._which = np.append(np.flatnonzero(solid), -1)
        self._middle = (scene.points.min(axis=0) + scene.points.max(axis=0)) / 2
        self._tree: Any = None
        if solid.any():
            self._tree = EmbreeScene(robust=True)
            corners = scene.points[scene.triangles[solid]] - self._middle
            TriangleMesh(self._tree, np.ascontiguousarray(corners, dtype=np.float32))

    def crossed(self, start: Floats, end: Floats) -> Bools:
        """(n,) whether something is between (n, 3) points and (n, 3) others, metres."""
        found: Bools = self.first(start, end - start, 1.0)[0] >= 0
        return found

    def first(self, points: Floats, along: Floats, reach: float = np.inf) -> tuple[Ints, Floats]:
        """What rays from (n, 3) points along (n, 3) vectors meet first within a ``reach``: (n,) the
        scene's triangle, or -1, and (n,) how far away, or the reach; in lengths of the vectors."""
        met, far = np.full(len(points), -1, dtype=np.int64), np.full(len(points), reach)
        for row in range(0, len(points) if self._tree is not None else 0, _RAYS):
            some = slice(row, row + _RAYS)
            origin = np.ascontiguousarray(points[some] - self._middle, dtype=np.float32)
            direction = np.ascontiguousarray(along[some], dtype=np.float32)
            limit = np.full(len(origin), reach, dtype=np.float32)
            hit = self._tree.run(origin, direction, dists=limit, output=True)
            met[some] = self._which[hit["primID"]]
            far[some] = np.where(met[some] >= 0, hit["tfar"], reach)
        return met, far
