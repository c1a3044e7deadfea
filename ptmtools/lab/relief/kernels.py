"""Compiled sums of errors for octrees and for another geometry on the screen (see `tables`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import kernel, plain_kernel
from ptmtools.lab.relief.octrees import Octrees
from ptmtools.neighbours.apo.traversal import child_of
from ptmtools.rendering.kernels import GREY, Sums, blend, distance, texel_under
from ptmtools.rendering.light import AMBIENT, LAMP
from ptmtools.rendering.records import Pyramids, Sight, Triangles

#: The greatest coordinate in a cube.
_LAST = float(np.nextafter(1.0, 0.0))
#: Deeper than any octree.
DEEP = 64
_X, _Y, _Z = LAMP


@plain_kernel
def lamp(x: float, y: float, z: float) -> float:
    """As `ptmtools.rendering.light.lamps`, of a normal of any length."""
    length = np.sqrt(x * x + y * y + z * z)
    along = (x * _X + y * _Y + z * _Z) / length if length > 0.0 else 0.0
    return AMBIENT + (1.0 - AMBIENT) * ((1.0 + along) / 2.0) ** 2


@plain_kernel
def depth_of(sight: Sight, i: int, triangles: Triangles) -> float:
    """Distance along the view to the triangle of a pixel; infinite without one."""
    f = sight.triangle[i]
    if f < 0:
        return np.inf
    facing, depth = 0.0, 0.0
    for k in range(3):
        facing += triangles.normal[f, k] * sight.ray[i, k]
        depth += triangles.normal[f, k] * (triangles.corner[f, 0, k] - sight.eye[k])
    return depth / facing if facing != 0.0 else np.inf


@plain_kernel
def depths(sight: Sight, triangles: Triangles, depth: Floats) -> None:
    """Writes `depth_of` each pixel to ``depth`` (n,)."""
    for i in range(len(depth)):
        depth[i] = depth_of(sight, i, triangles)


@plain_kernel
def stop_of(sight: Sight, i: int, triangles: Triangles, depth: float, side: float) -> int:
    """The depth of the nodes no larger than a pixel of the screen, in a cube of this ``side``:
    ⌈log₂(1 / D)⌉ of the smaller step D to the next pixel beside or above (paper 2, §4.2)."""
    f = sight.triangle[i]
    ray, normal = sight.ray[i], triangles.normal[f]
    facing = normal[0] * ray[0] + normal[1] * ray[1] + normal[2] * ray[2]
    if facing == 0.0:
        return 0
    least = np.inf
    for k in range(2):
        axis = sight.axes[k]
        slope = (normal[0] * axis[0] + normal[1] * axis[1] + normal[2] * axis[2]) / facing
        total = 0.0
        for j in range(3):
            total += (axis[j] - ray[j] * slope) ** 2
        least = min(least, total)
    step = np.sqrt(least) * abs(depth) * sight.pixel / side
    return max(int(np.ceil(-np.log2(step))), 0) if step > 0.0 else DEEP


@plain_kernel
def descend(
    octrees: Octrees, o: int, x: float, y: float, z: float, stop: int, light: Floats
) -> int:
    """Writes to ``light`` (L,) the light on a point (metres) by the normals of the nodes around it,
    from the root to depth ``stop`` or the last node; returns their number."""
    texel = octrees.texel[octrees.begin[o] : octrees.begin[o + 1]]
    low, side = octrees.low[o], octrees.side[o]
    x = min(max((x - low[0]) / side, 0.0), _LAST)
    y = min(max((y - low[1]) / side, 0.0), _LAST)
    z = min(max((z - low[2]) / side, 0.0), _LAST)
    address, depth = 0, 0
    while True:
        node = texel[address]
        light[depth] = lamp(node[0] / 127.5 - 1.0, node[1] / 127.5 - 1.0, node[2] / 127.5 - 1.0)
        if depth >= stop or depth + 1 >= octrees.levels[o]:
            break
        x, y, z = 2.0 * x, 2.0 * y, 2.0 * z
        child = 0
        if x >= 1.0:
            child, x = child + 1, x - 1.0
        if y >= 1.0:
            child, y = child + 2, y - 1.0
        if z >= 1.0:
            child, z = child + 4, z - 1.0
        address = child_of(texel, address, child)
        if address < 0:
            break
        depth += 1
    return depth + 1


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


@kernel
def relieve(
    sight: Sight,
    triangles: Triangles,
    lamps: Floats,
    octrees: Octrees,
    loaded: Bools,
    held: Ints,
    shown: Floats,
) -> None:
    """Lights the pixels ``shown`` (n, 3) by the levels ``held`` (O,) of the octrees; pixels without
    an octree keep their light. ``loaded`` (C,) is the loaded geometry."""
    light = np.zeros(DEEP)
    for i in range(len(shown)):
        f = sight.triangle[i]
        if f < 0 or not loaded[triangles.cell[f]]:
            continue
        o = octrees.of[f]
        if o < 0 or held[o] == 0:
            continue
        depth, ray = depth_of(sight, i, triangles), sight.ray[i]
        stop = min(stop_of(sight, i, triangles, depth, octrees.side[o]), held[o] - 1)
        place = depth * ray + sight.eye
        count = descend(octrees, o, place[0], place[1], place[2], stop, light)
        for k in range(3):
            shown[i, k] *= light[count - 1] / lamps[f]


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
