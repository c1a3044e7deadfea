"""The normal of an octree texture at a point, as a client reads it (docs/formats/apo.md, "Looking a
normal up"; Lacoste et al., section 3.2).

Addresses outside of the octree, as in damaged files, count as absent children.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.jit import plain_kernel
from ptmtools_systems.apo.model import Octree

#: A depth below any octree, which never stops a look-up.
NEVER = 127
#: Texels in a row of the 2-D texture of graphics hardware.
WIDTH = 4096


@dataclass(frozen=True)
class Nodes:
    """The ends of look-ups of n points.

    Attributes
    ----------
    address: (n,) address of the texel with the normal.
    depth: (n,) depth of its node; 0 is the cube.
    normals: (n, 3) unit normals.
    """

    address: Ints
    depth: Ints
    normals: Floats


def look_up(
    octree: Octree, q: Floats, levels: int | None = None, stop: Ints | int | None = None
) -> Nodes:
    """The normals at (n, 3) points ``q`` of the cube with the first ``levels`` (all if None), at
    most to the depths ``stop``, one or (n,).

    Points outside the cube count as the nearest within it. Raises ValueError without a level.
    """
    deepest = (octree.levels if levels is None else min(levels, octree.levels)) - 1
    if deepest < 0:
        raise ValueError("the look-up needs at least one level")
    inside = np.nan_to_num(np.clip(np.asarray(q, np.float64), 0.0, np.nextafter(1.0, 0.0)), nan=0.0)
    depth = np.full(len(q), deepest, dtype=np.int64)
    if stop is not None:
        depth = np.minimum(depth, stop)
    at, deep = np.empty(len(q), dtype=np.int64), np.empty(len(q), dtype=np.int64)
    _walk(np.ascontiguousarray(octree.texels), inside, depth, at, deep)
    return Nodes(at, deep, unpack_normals(octree.texels[at]))


def stop_depth(step: Floats) -> Ints:
    """⌈log₂(1 / D)⌉ of distances D >= 0 in the cube; `NEVER` for 0. Exact: it is −⌊log₂ D⌋, from
    the floating-point exponent of D."""
    _, exponent = np.frexp(step)
    depth = np.where(step > 0, 1 - exponent, NEVER)
    return np.minimum(depth, NEVER).astype(np.int64)


def rows_of(texels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(n, 4) texels as (h, `WIDTH`, 4) rows of a texture, padded with zeros; texel a is in row a
    div `WIDTH`."""
    height = max(1, -(-len(texels) // WIDTH))
    out = np.zeros((height * WIDTH, 4), dtype=np.uint8)
    out[: len(texels)] = texels
    return out.reshape(height, WIDTH, 4)


def unpack_normals(texels: NDArray[np.uint8]) -> Floats:
    """(n, 3) unit normals of (n, 4) texels."""
    vector = texels[:, :3] / 127.5 - 1.0
    return np.asarray(vector / np.linalg.norm(vector, axis=1, keepdims=True))


@plain_kernel
def _ones(mask: int) -> int:
    count = 0
    while mask:
        mask &= mask - 1
        count += 1
    return count


@plain_kernel
def _child_of(texel: NDArray[np.uint8], address: int, child: int) -> int:
    """The address of child 0 to 7 of the node at an address of (n, 4) texels; -1 if absent."""
    count = np.int64(len(texel))
    present = int(np.int64(texel[address, 3]))
    if present >> child & 1 == 0 or address + 1 >= count:
        return -1
    below = (1 << child) - 1
    inner = int(np.int64(texel[address + 1, 3]))
    first = int(np.int64(texel[address + 1, 0]))
    first += int(np.int64(texel[address + 1, 1])) << 8
    first += int(np.int64(texel[address + 1, 2])) << 16
    result = first + _ones(present & below) + _ones(inner & below)
    return result if result < count else -1


@plain_kernel
def child_at(
    texel: NDArray[np.uint8], address: int, x: float, y: float, z: float
) -> tuple[int, float, float, float]:
    """The address of the child around a point of a node at an address of (n, 4) texels, -1 if it is
    absent, and the coordinates of the point in the child; those of a cube are 0 to below 1."""
    x, y, z = 2.0 * x, 2.0 * y, 2.0 * z
    child = 0
    if x >= 1.0:
        child, x = child + 1, x - 1.0
    if y >= 1.0:
        child, y = child + 2, y - 1.0
    if z >= 1.0:
        child, z = child + 4, z - 1.0
    return _child_of(texel, address, child), x, y, z


@plain_kernel
def _walk(texel: NDArray[np.uint8], q: Floats, limit: Ints, at: Ints, deep: Ints) -> None:
    for i in range(len(q)):
        x, y, z = q[i, 0], q[i, 1], q[i, 2]
        address, depth = 0, 0
        while depth < limit[i]:
            next_address, x, y, z = child_at(texel, address, x, y, z)
            if next_address < 0:
                break
            address = next_address
            depth += 1
        at[i], deep[i] = address, depth
