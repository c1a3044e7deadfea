"""The grids of positions and texture coordinates in compressed cells.

All cells share one grid, so points that are equal before rounding are equal after it and cells meet
without cracks. Its step is a power of two of at most 1 mm, 2^-14 of the extent and a tenth of the
least thickness, so that thin sheets keep their distance and their order.

Rays measure the *least thickness*: from the middle of each triangle along its normal, both ways, to
the next triangle, if that is parallel, so solids count and pictures in front of walls. The thinnest
parts, with less than `DUST` of the model's area together, do not: for chamfers 0.7 mm wide the step
of the sample hospital would be an eighth.

Texture coordinates have a grid for each texture and axis, of at least five steps to a texel of its
finest level, a power of two: the error is a tenth of a texel at most.

A coordinate has 24 bits (`ptmtools.meshopt.encoding.exponential`). In models of more than 2^23
steps, and for textures repeated so often, the step is the least that 24 bits hold, which is that of
float32.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, areas, normals
from ptmtools.embree import ray_tree
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance

#: Exponent of the coarsest step of positions, 0.98 mm.
COARSEST = -10
#: Steps in the least thickness; in a texel.
_IN_THICKNESS, _IN_TEXEL = 10, 5
#: Largest step as a share of the extent.
_OF_EXTENT = 2.0**-14
#: Share of the area that the thinnest parts have before they count: 100 cm² of 1000 m².
DUST = 1e-5
#: Least exponent of steps that float32 holds.
_FINEST = -126
#: Largest absolute number of steps.
MOST = (1 << 23) - 1


def position_exponent(scene: Scene, step: float | None = None) -> int:
    """k of the step 2^k m of a scene's positions; ``step`` is the largest one, metres, if given."""
    if step is None:
        thickness = least_thickness(scene.corners, scene.tolerance)
        step = min(thickness / _IN_THICKNESS, _OF_EXTENT * scene.tolerance.extent, 2.0**COARSEST)
    exponent = math.floor(math.log2(step))
    return max(exponent, _least(float(np.abs(scene.points).max(initial=0.0))))


def texture_exponents(uv: NDArray[np.floating], width: int, height: int) -> tuple[int, int]:
    """Exponents of the steps of (n, 2) coordinates of a texture, across and up."""
    largest = np.abs(uv).max(axis=0, initial=0.0).tolist()
    u, v = (
        max(-math.ceil(math.log2(_IN_TEXEL * side)), _least(extreme))
        for side, extreme in zip((width, height), largest, strict=True)
    )
    return u, v


def _least(largest: float) -> int:
    """The exponent of the least step of which 24 bits hold enough for a number."""
    return math.ceil(math.log2(max(largest / MOST, 2.0**_FINEST)))


def least_thickness(corners: Floats, tolerance: Tolerance) -> float:
    """Least distance of parallel (n, 3, 3) triangles that face each other or turn their backs,
    metres; at most that for the coarsest step. Nearer ones than ``tolerance.plane`` are one."""
    limit = _IN_THICKNESS * 2.0**COARSEST
    area = areas(corners)
    corners, area = corners[area > 0], area[area > 0]
    if not len(corners):
        return limit
    normal = normals(corners) / (2 * area[:, None])
    points = corners.reshape(-1, 3)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    local = (corners - centre) / tolerance.extent
    tree, middle = ray_tree(local), local.mean(axis=1)
    near = tolerance.plane / tolerance.extent
    thickness = []
    for way in (normal, -normal):
        hits = tree.run(
            (middle + near * way).astype(np.float32),
            way.astype(np.float32),
            dists=np.full(len(way), limit / tolerance.extent, np.float32),
            output=True,
        )
        opposite = hits["primID"]
        cosine = np.abs((normal * normal[opposite]).sum(axis=1))
        parallel = (opposite >= 0) & (cosine >= tolerance.cosine)
        distance = (hits["tfar"].astype(np.float64) + near) * tolerance.extent
        thickness.append(np.where(parallel, distance, np.inf))
    least = np.minimum(*thickness)
    order = np.argsort(least, kind="stable")
    thin = np.cumsum(area[order]) > DUST * area.sum()
    return min(limit, float(least[order][np.argmax(thin)]))
