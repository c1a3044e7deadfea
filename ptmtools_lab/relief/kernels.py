"""Compiled sums of errors for octrees and for another geometry on the screen (see `tables`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import kernel, plain_kernel
from ptmtools.rendering.kernels import GREY, Sums, blend, distance, texel_under
from ptmtools.rendering.records import Pyramids, Sight, Triangles
from ptmtools_systems.apo.lighting import depth_of, descend, stop_of
from ptmtools_systems.apo.served_octrees import Octrees


@plain_kernel
def depths(sight: Sight, triangles: Triangles, depth: Floats) -> None:
    """Writes `depth_of` each pixel to ``depth`` (n,)."""
    for i in range(len(depth)):
        depth[i] = depth_of(sight, i, triangles)


@kernel
def add_relief(
    sight: Sight,
    triangles: Triangles,
    lamps: Floats,
    octrees: Octrees,
    full: Pyramids,
    exact: Floats,
    given: bool,
    special: Bools,
    seen: Bools,
    sums: Sums,
    stuck: Ints,
) -> None:
    """Adds the errors of the ``special`` (n,) pixels of a frame.

    Parameters
    ----------
    triangles: with the flat lighting of ``lamps`` (m,).
    full: the textures with all levels.
    exact: (n, 3) the reference colours if ``given``, else the output for those of all octree
        levels.
    seen: (n,) as in `add_frame`.
    sums: ``pair`` (m,) is that of the octree, whose columns are its levels in place of a texture's.
    stuck: (m,) the pair of errors that no download reduces.
    """
    wide = sums.error.shape[1]
    grey, color, work, coarse = np.full(3, GREY), np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    flat, light = np.zeros(3), np.zeros(wide)
    last = stuck[0] if len(stuck) else 0
    for i in range(len(special)):
        if not special[i]:
            continue
        f = sight.triangle[i]
        if f < 0:
            flat[:] = 0.0
            square = distance(flat, exact[i])
            for n in range(wide):
                sums.error[last, n] += np.sqrt(square)
                sums.square[last, n] += square
            continue
        last, t, o = stuck[f], triangles.texture[f], octrees.of[f]
        flat[:] = 255.0
        if t >= 0:
            u, v, detail = texel_under(sight, i, triangles, full, t, work)
            blend(full, t, detail, u, v, triangles.clamped[f], flat, coarse)
        for k in range(3):
            flat[k] *= triangles.color[f, k]
        if o < 0:
            for n in range(wide):
                square = distance(flat if n else grey, exact[i])
                sums.error[last, n] += np.sqrt(square)
                sums.square[last, n] += square
            continue
        p, depth, ray = sums.pair[f], depth_of(sight, i, triangles), sight.ray[i]
        stop = stop_of(sight, i, triangles, depth, octrees.side[o])
        place = depth * ray + sight.eye
        count = descend(octrees, o, place[0], place[1], place[2], stop, light)
        if not given:
            for k in range(3):
                exact[i, k] = flat[k] * light[count - 1] / lamps[f]
        for n in range(octrees.levels[o] + 2):
            if n == 0 and t >= 0:
                continue  # in the row of the texture
            for k in range(3):
                level = light[min(n - 2, count - 1)] / lamps[f] if n > 1 else 1.0
                color[k] = flat[k] * level if n else GREY
            square = distance(color, exact[i])
            sums.error[p, n] += np.sqrt(square)
            sums.square[p, n] += square
        for n in range(min(stop + 1, octrees.levels[o])):
            sums.need[p, n] += 1.0
            if seen[i]:
                sums.sight[p, n] += 1.0


@plain_kernel
def mark_special(
    sight: Sight, far: Floats, other: Floats, given: bool, of: NDArray[np.int32],
    texture: NDArray[np.int32], apart: float, special: Bools, plain: Ints,
) -> None:  # fmt: skip
    """Marks the ``special`` (n,) pixels: those of an octree's object, or whose depths ``far`` and
    ``other`` (n,) in the two geometries differ by more than the share ``apart``. Writes to
    ``plain`` (n,) the triangles for other tables, which have the textures of octrees' objects."""
    for i in range(len(special)):
        f = sight.triangle[i]
        octree = f >= 0 and of[f] >= 0
        differs = False
        if given and far[i] != other[i]:
            # Also if one of them is infinite.
            differs = not abs(far[i] - other[i]) <= apart * min(far[i], other[i])
        special[i] = octree or differs
        plain[i] = f if not special[i] or (octree and texture[f] >= 0) else -1
