"""From points of the simplified mesh to those of the source that they stand for (paper 2, §3.1).

Rays go both ways along the normal; the nearest hit that faces the same way counts. A surface that
faces away is the other side of something thin, or the far side of a hole, and is passed through.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.apo.painting import Paint
from ptmtools.arrays import Bools, Floats, Ints, Singles

#: Rays begin so far behind their point, and go on so far behind what they pass through: sixteen
#: roundings of a float32 within the cube, of which it is a share.
STEP = 2.0**-20
#: How far a ray goes, likewise. What is farther away is another part of the source.
REACH = 0.1
#: Surfaces that face away and are passed through before a ray is given up.
LAYERS = 4


@dataclass(frozen=True)
class Source:
    """The mesh that the normals are taken from, in the cube of the octree.

    Attributes
    ----------
    points: (V, 3) float32. triangles: (T, 3) int32.
    normals: (T, 3, 3) float32 unit normals of the corners.
    paint: of the triangles, if colours are kept.
    """

    points: Singles
    triangles: NDArray[np.int32]
    normals: Singles
    paint: Paint | None = None

    @cached_property
    def facing(self) -> Singles:
        """(T, 3) normals of the triangles, of any length."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def tree(self) -> Any:
        """Embree's."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        tree = EmbreeScene(robust=True)
        TriangleMesh(tree, self.points, self.triangles)
        return tree

    def __getstate__(self) -> dict[str, Any]:
        """Without what is derived: Embree's tree cannot travel."""
        return {name: value for name, value in vars(self).items() if name not in ("facing", "tree")}


@dataclass(frozen=True)
class Hits:
    """Points of the source.

    Attributes
    ----------
    triangle: (n,) -1 for none. weight: (n, 3) of its corners. distance: (n,) shares of the cube.
    """

    triangle: Ints
    weight: Singles
    distance: Singles


def nearest(source: Source, origin: Floats, normal: Floats) -> Hits:
    """What (n, 3) points of the cube with (n, 3) unit normals stand for."""
    forth = _cast(source, origin, normal, normal, np.full(len(origin), REACH, np.float32))
    back = _cast(source, origin, -normal, normal, forth.distance)
    better = back.triangle >= 0
    return Hits(
        np.where(better, back.triangle, forth.triangle),
        np.where(better[:, None], back.weight, forth.weight),
        np.where(better, back.distance, forth.distance),
    )


def _cast(source: Source, origin: Floats, along: Floats, normal: Floats, limit: Singles) -> Hits:
    """The first hit along rays that faces the way of ``normal``, nearer than ``limit``."""
    count = len(origin)
    triangle, weight = np.full(count, -1, np.int64), np.zeros((count, 3), np.float32)
    distance = limit.copy()
    waiting, gone = np.arange(count), np.full(count, -STEP)
    for _ in range(LAYERS + 1):
        rays = along[waiting].astype(np.float32)
        begin = (origin[waiting] + gone[waiting, None] * along[waiting]).astype(np.float32)
        left = np.maximum(limit[waiting] - gone[waiting], 0).astype(np.float32)
        found = source.tree.run(begin, rays, dists=left, output=True)
        hit = found["primID"].astype(np.int64)
        met = hit >= 0
        far = gone[waiting] + found["tfar"]
        same = met & _same_way(source.facing[hit], normal[waiting])
        taken = waiting[same]
        u, v = found["u"][same], found["v"][same]
        triangle[taken], distance[taken] = hit[same], np.abs(far[same])
        weight[taken] = np.stack([1 - u - v, u, v], axis=1)
        on = met & ~same & (far < limit[waiting])
        gone[waiting[on]] = far[on] + STEP
        waiting = waiting[on]
        if not len(waiting):
            break
    return Hits(triangle, weight, distance)


def _same_way(facing: Singles, normal: Floats) -> Bools:
    same: Bools = np.einsum("ij,ij->i", facing, normal) > 0
    return same
