"""The cube of an octree, and the order of its nodes.

The Morton code of a node interleaves the bits of its place: three bits a level, x the lowest, the
root's level first. In the order of codes siblings lie side by side, and so do all that is below a
node: a range of sorted codes is a subtree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats

#: The cube is larger than what it holds by this share, lest rounding to float32 leads out of it.
MARGIN = 2.0**-12

#: Shifts and masks that put two zero bits behind each of 21.
_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)

Codes = NDArray[np.uint64]


@dataclass(frozen=True)
class Cube:
    """Corner (3,) and side, in the units of the mesh."""

    low: Floats
    side: float

    def inside(self, points: Floats) -> Floats:
        """(n, 3) points in the coordinates of the cube, 0 to less than 1."""
        last = np.nextafter(1.0, 0.0)
        found: Floats = np.clip((points - self.low) / self.side, 0.0, last)
        return found


def cube_around(points: Floats) -> Cube:
    """The cube around (n, 3) points, which are not all the same."""
    low, high = points.min(axis=0), points.max(axis=0)
    side = float((high - low).max()) * (1 + MARGIN)
    return Cube((low + high) / 2 - side / 2, side)


def codes_of(q: Floats, depth: int) -> Codes:
    """(n,) of the nodes of a depth, up to 20, in which (n, 3) points of the cube lie."""
    place = (q * float(1 << depth)).astype(np.uint64)
    x, y, z = (_spread(place[:, k]) for k in range(3))
    found: Codes = x | y << np.uint64(1) | z << np.uint64(2)
    return found


def _spread(value: Codes) -> Codes:
    for shift, mask in _SPREAD:
        value = (value | value << np.uint64(shift)) & np.uint64(mask)
    return value
