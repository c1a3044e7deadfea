"""The octree texture, and what it is made with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.neighbours.apo.options import RANGES, check_range

#: Bits of the address of a child, and so the most texels.
ADDRESS_BITS = 24


@dataclass(frozen=True)
class ApoOptions:
    """
    Attributes
    ----------
    faces: of the simplified mesh, at most.
    error: leaves are divided while the normals in them deviate more than this from their mean: the
        root mean square of the length of the difference, 0 to 2.
    depth: greatest depth of leaves; a leaf of depth 13 is 1/8192 of the cube wide.
    density: samples for each triangle of the source, on average.
    method: what simplifies; meshlab is pymeshlab, as the paper's tool.
    color: also keep the colours of vertices or of the texture, which the paper leaves for later.
    color_error: the same for colours, as a share of the full range.

    Raises InputError PTM-I840 for what is out of range.
    """

    faces: int = 10_000
    error: float = 0.05
    depth: int = 13
    density: float = 8.0
    method: Literal["quadric", "meshlab"] = "quadric"
    color: bool = False
    color_error: float = 0.05

    def __post_init__(self) -> None:
        for name in RANGES:
            check_range(name, getattr(self, name))


@dataclass(frozen=True)
class Octree:
    """An octree texture, whole or its first levels; docs/formats/apo.md has its texels.

    Attributes
    ----------
    texels: (n, 4) uint8, breadth first.
    start: (L + 1,) int64, the texel at which each of the L levels begins, from the root on; the
        last is n.
    low, side: corner (3,) and side of the cube, in the units of the mesh: p is at (p - low) / side.
    colors: (n, 4) uint8 sRGB and 255 at the addresses of `texels`, or None.
    """

    texels: NDArray[np.uint8]
    start: Ints
    low: Floats
    side: float
    colors: NDArray[np.uint8] | None = field(default=None)

    @property
    def levels(self) -> int:
        """How many there are."""
        return len(self.start) - 1
