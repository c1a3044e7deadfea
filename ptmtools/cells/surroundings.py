"""What somebody who stands somewhere has around: walls that face them, or away, and a roof.

A column that stands on a floor has a place inside, as far as surfaces tell: floor, and head room.
But all its sides face outwards. And of the outside of a building what is under a roof and between
walls is another building, with a door or a window open. Rays from the middle of the body tell.

Where a solid touches another, two faces lie in one plane, and which of them a ray meets is chance.
So it is cast at all triangles moved a little to their fronts, and to their backs: where what it
meets faces one way in the one and the other way in the other, it tells nothing.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.vectors import normals
from ptmtools.tolerance import Tolerance

#: Level rays from a point.
_RAYS = 32
#: Somebody is inside if as large a share of them meets a wall: under eaves half of them do.
_INSIDE = 0.75
#: It is the inside of a solid if as large a share of the walls around faces away.
_AWAY = 0.9


#: From so many points walls are looked at.
LOOKS = 16


def spread_over(points: Floats, count: int) -> Floats:
    """About so many of (n, 3) points."""
    return points[:: -(-len(points) // count)] if len(points) else points


class Surroundings:
    """(T, 3, 3) triangles, counter-clockwise as seen from their front."""

    def __init__(self, corners: Floats, tolerance: Tolerance) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._corners = corners
        self._middle = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
        self._scale = 1 / (float(np.ptp(corners.reshape(-1, 3), axis=0).max()) or 1.0)
        front = normals(corners)
        length = np.linalg.norm(front, axis=1, keepdims=True)
        self._front = np.divide(front, length, out=np.zeros_like(front), where=length > 0)
        self._scenes = []
        for step in (tolerance.plane, -tolerance.plane):
            local = (corners + step * self._front[:, None] - self._middle) * self._scale
            self._scenes.append(EmbreeScene(robust=True))
            TriangleMesh(self._scenes[-1], np.ascontiguousarray(local, dtype=np.float32))
        angle = 2 * np.pi * (np.arange(_RAYS) + 0.5) / _RAYS
        self._level = np.stack([np.cos(angle), np.zeros(_RAYS), np.sin(angle)], axis=1)

    def solid(self, points: Floats) -> bool:
        """Whether (n, 3) points are inside a solid: the walls that level rays from them meet face
        away, nearly all."""
        along = np.tile(self._level, (len(points), 1))
        hit = self._hits(np.repeat(points, _RAYS, axis=0), along)
        away = np.einsum("sij,ij->si", self._front[hit], along) > 0
        told = (hit >= 0).all(axis=0) & (away[0] == away[1])
        return bool(told.any() and away[0, told].mean() >= _AWAY)

    def floored(self, points: Floats) -> Bools:
        """(n,) whether what is straight below each of (n, 3) points faces up."""
        hit = self._hits(points, np.tile([0.0, -1.0, 0.0], (len(points), 1)))
        found: Bools = ((hit >= 0) & (self._front[hit, 1] > 0)).all(axis=0)
        return found

    def first(self, points: Floats, along: Floats) -> tuple[Floats, Floats]:
        """What rays from (n, 3) points along (n, 3) unit vectors meet first: (n,) how far away,
        metres, infinite where there is nothing, and (n, 3) its unit normal."""
        hit = self._hits(points, along)[0]
        far, facing = np.full(len(points), np.inf), np.zeros((len(points), 3))
        met = np.flatnonzero(hit >= 0)
        normal = self._front[hit[met]]
        to = np.einsum("ij,ij->i", self._corners[hit[met], 0] - points[met], normal)
        turn = np.einsum("ij,ij->i", along[met], normal)
        far[met] = np.divide(to, turn, out=np.zeros(len(met)), where=turn != 0)
        facing[met] = normal
        return far, facing

    def inside(self, points: Floats, roofed: bool = True) -> Bools:
        """(n,) which of (n, 3) points are between walls, and under a roof if there are ``roofed``
        ones."""
        found: Bools = self._hits(points, np.tile([0.0, 1.0, 0.0], (len(points), 1)))[0] >= 0
        found |= not roofed
        under = np.flatnonzero(found)
        along = np.tile(self._level, (len(under), 1))
        met = self._hits(np.repeat(points[under], _RAYS, axis=0), along)[0] >= 0
        found[under] = met.reshape(-1, _RAYS).mean(axis=1) >= _INSIDE
        return found

    def _hits(self, points: Floats, along: Floats) -> Ints:
        """(2, n) the triangle that each ray meets first, or -1, with all moved to their fronts, and
        to their backs."""
        origin = np.ascontiguousarray((points - self._middle) * self._scale, dtype=np.float32)
        direction = np.ascontiguousarray(along, dtype=np.float32)
        if not len(origin):
            return np.zeros((2, 0), dtype=np.int64)
        hits = [scene.run(origin, direction, query="INTERSECT") for scene in self._scenes]
        return np.array(hits, dtype=np.int64)
