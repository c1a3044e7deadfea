"""Arrays of the kernels: portals, and working storage."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bits, Floats, Ints

Doubles = NDArray[np.complex128]


class PortalArrays(NamedTuple):
    """Portals ready for the kernels; `flow.geometry` fills it."""

    point: Floats  # (Q, 3) centred on the scene
    start: Ints  # (K + 1,)
    normal: Floats  # (K, 3)
    low: Floats  # (K,) least and
    high: Floats  # (K,) greatest normal·x over the portal's own points
    ball: Floats  # (K, 4) centre and radius of a ball around it
    leaf: Ints  # (2K,) the leaf that a directed portal leads into
    out_start: Ints  # (L + 1,) CSR over leaves:
    out: Ints  # (2K,) the directed portals that lead out of a leaf
    slack: float  # distances below this are rounding


class Polygons(NamedTuple):
    """Convex polygons in numbered slots, of which the last is spare, and rows of planes."""

    vertex: Floats  # (S, V, 3)
    size: Ints  # (S,) vertices of each
    plane: Floats  # (R, P, 4) unit normal n and offset d: kept is where n·x + d >= 0
    distance: Floats  # (V,) of the vertices from a plane
    slack: float  # distances below this are rounding


class Scratch(NamedTuple):
    """Working storage of one worker; `flow.scratch` sizes it."""

    polygons: Polygons  # 2D + 3 slots, D + 1 rows
    planes: Ints  # (D + 1,) how many
    might: Bits  # (D, W) bits
    via: Ints  # (D + 1,) the directed portal that led into the frame
    at: Ints  # (D,) next candidate, index into out
    line: Floats  # (2, 3) a point and a direction
    near_tie: Ints  # (H,) sequences of portals rejected by a near tie, each after its length


class DDPortals(NamedTuple):
    """Portals in double-double numbers (`double_double_kernels`); `double_double` fills it."""

    point: Doubles  # (Q, 3) at most 1
    start: Ints  # (K + 1,)
    normal: Floats  # (K, 3)


class DDScratch(NamedTuple):
    """Working storage of one worker for `DDPortals`."""

    polygon: Doubles  # (4, V, 3)
    size: Ints  # (4,)
    cuts: Ints  # (4,) how often each polygon was cut
    plane: Doubles  # (2, 2V + 1, 4) unit normal n and offset d: kept is where n·x + d >= 0
    side: Doubles  # (V,)
    vector: Doubles  # (2, 3)
