"""What somebody who stands somewhere has around: walls that face them, or away, and a roof.

A column that stands on a floor has a place inside, as far as surfaces tell: floor, and head room.
But all its sides face outwards. And of the outside of a building what is under a roof and between
walls is another building, with a door or a window open. Rays from the middle of the body tell.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.vectors import normals

#: Level rays from a point.
_RAYS = 32
#: Somebody is inside if as large a share of them meets a wall: under eaves half of them do.
_INSIDE = 0.75


class Surroundings:
    """(T, 3, 3) triangles, counter-clockwise as seen from their front."""

    def __init__(self, corners: Floats) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._corners = corners
        self._middle = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
        self._scale = 1 / (float(np.ptp(corners.reshape(-1, 3), axis=0).max()) or 1.0)
        self._scene = EmbreeScene(robust=True)
        local = (corners - self._middle) * self._scale
        TriangleMesh(self._scene, np.ascontiguousarray(local, dtype=np.float32))
        angle = 2 * np.pi * (np.arange(_RAYS) + 0.5) / _RAYS
        self._level = np.stack([np.cos(angle), np.zeros(_RAYS), np.sin(angle)], axis=1)

    def turned_away(self, points: Floats) -> float:
        """The share that faces away of the walls that level rays from (n, 3) points meet; 0 where
        they meet none."""
        along = np.tile(self._level, (len(points), 1))
        hit = self._hit(np.repeat(points, _RAYS, axis=0), along)
        met = hit >= 0
        away = np.einsum("ij,ij->i", normals(self._corners[hit[met]]), along[met]) > 0
        return float(away.mean()) if len(away) else 0.0

    def first(self, points: Floats, along: Floats) -> tuple[Floats, Floats]:
        """What rays from (n, 3) points along (n, 3) unit vectors meet first: (n,) how far away,
        metres, infinite where there is nothing, and (n, 3) its unit normal."""
        hit = self._hit(points, along)
        far, facing = np.full(len(points), np.inf), np.zeros((len(points), 3))
        met = np.flatnonzero(hit >= 0)
        normal = normals(self._corners[hit[met]])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        to = np.einsum("ij,ij->i", self._corners[hit[met], 0] - points[met], normal)
        turn = np.einsum("ij,ij->i", along[met], normal)
        far[met] = np.divide(to, turn, out=np.zeros(len(met)), where=turn != 0)
        facing[met] = normal
        return far, facing

    def inside(self, points: Floats, roofed: bool = True) -> Bools:
        """(n,) which of (n, 3) points are between walls, and under a roof if there are ``roofed``
        ones."""
        found: Bools = self._hit(points, np.tile([0.0, 1.0, 0.0], (len(points), 1))) >= 0
        found |= not roofed
        under = np.flatnonzero(found)
        along = np.tile(self._level, (len(under), 1))
        met = self._hit(np.repeat(points[under], _RAYS, axis=0), along) >= 0
        found[under] = met.reshape(-1, _RAYS).mean(axis=1) >= _INSIDE
        return found

    def _hit(self, points: Floats, along: Floats) -> Ints:
        """(n,) the triangle that each ray meets first, or -1."""
        origin = np.ascontiguousarray((points - self._middle) * self._scale, dtype=np.float32)
        direction = np.ascontiguousarray(along, dtype=np.float32)
        if not len(origin):
            return np.zeros(0, dtype=np.int64)
        return np.asarray(self._scene.run(origin, direction, query="INTERSECT"), dtype=np.int64)
