"""Compiled shading of octree textures (`ptm build-scene --apo`).

A pixel shows the normal of the deepest loaded node around its point that is no smaller than a pixel
(Lacoste et al., section 4.2).
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import kernel, plain_kernel
from ptmtools.rendering.light import AMBIENT, LAMP
from ptmtools.rendering.records import Sight, Triangles
from ptmtools_systems.apo.model import Octrees
from ptmtools_systems.apo.traversal import child_at

#: Largest coordinate in a unit cube.
_LAST = float(np.nextafter(1.0, 0.0))
#: Depth beyond that of any octree.
DEEP = 64
_X, _Y, _Z = LAMP


@plain_kernel
def lamp(x: float, y: float, z: float) -> float:
    """Light on a normal of any length, see `ptmtools.rendering.light.lamps`."""
    length = np.sqrt(x * x + y * y + z * z)
    along = (x * _X + y * _Y + z * _Z) / length if length > 0.0 else 0.0
    return AMBIENT + (1.0 - AMBIENT) * ((1.0 + along) / 2.0) ** 2


@plain_kernel
def depth_of(sight: Sight, i: int, triangles: Triangles) -> float:
    """Distance along the view to the triangle of a pixel, infinite for none."""
    f = sight.triangle[i]
    if f < 0:
        return np.inf
    facing, depth = 0.0, 0.0
    for k in range(3):
        facing += triangles.normal[f, k] * sight.ray[i, k]
        depth += triangles.normal[f, k] * (triangles.corner[f, 0, k] - sight.eye[k])
    return depth / facing if facing != 0.0 else np.inf


@plain_kernel
def stop_of(sight: Sight, i: int, triangles: Triangles, depth: float, side: float) -> int:
    """Depth of the first nodes no larger than a pixel of the screen, in a cube of this ``side``:
    ⌈log₂(1 / D)⌉ for the smaller step D to the adjacent pixels beside and above (paper 2, §4.2)."""
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
    """Writes the light on a point (metres) by the normals of the nodes around it, from the root to
    depth ``stop`` or a leaf, to ``light`` (L,); returns their number."""
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
        address, x, y, z = child_at(texel, address, x, y, z)
        if address < 0:
            break
        depth += 1
    return depth + 1


@kernel
def relieve(
    sight: Sight,
    triangles: Triangles,
    lamps: Floats,
    octrees: Octrees,
    loaded: Bools,
    loaded_levels: Ints,
    shown: Floats,
) -> None:
    """Lights the pixels ``shown`` (n, 3) by the ``loaded_levels`` (O,) of the octrees; pixels
    without an octree keep their colours. ``loaded`` (C,): the cells whose geometry is loaded."""
    light = np.zeros(DEEP)
    for i in range(len(shown)):
        f = sight.triangle[i]
        if f < 0 or not loaded[triangles.cell[f]]:
            continue
        o = octrees.of[f]
        if o < 0 or loaded_levels[o] == 0:
            continue
        depth, ray = depth_of(sight, i, triangles), sight.ray[i]
        stop = min(stop_of(sight, i, triangles, depth, octrees.side[o]), loaded_levels[o] - 1)
        place = depth * ray + sight.eye
        count = descend(octrees, o, place[0], place[1], place[2], stop, light)
        for k in range(3):
            shown[i, k] *= light[count - 1] / lamps[f]
