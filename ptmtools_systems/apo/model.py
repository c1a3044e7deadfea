"""The octree texture, its options, and several for kernels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.options import option
from ptmtools_systems.apo.options import check_ranges

#: Bits of the address of a child, which limit the number of texels.
ADDRESS_BITS = 24


@dataclass(frozen=True)
class ApoOptions:
    """Options of `make_apo`. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "Octree texture"

    faces: int = option(10_000, "Maximum number of faces of the simplified mesh.")
    error: float = option(
        0.05,
        "Maximum deviation of the normals in a leaf of the octree from their mean, as a root mean "
        "square from 0 to 2. Leaves that exceed it are divided.",
    )
    depth: int = option(
        13,
        "Maximum depth of the octree. A leaf at depth 13 has 1/8192 of the width of the "
        "mesh's bounding cube.",
    )
    density: float = option(8.0, "Samples per triangle of the mesh, on average.")
    method: Literal["quadric", "meshlab"] = option(
        "quadric",
        "Method of simplification: quadric (implemented in ptmtools) or meshlab (implemented in "
        "pymeshlab; used by Lacoste et al.).",
    )
    color: bool = option(False, "Also keep the colours of vertices or of the texture.")
    color_error: float = option(
        0.05, "Like --error, but for colours, as a share of the full range."
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class Octree:
    """An octree texture, or its first levels; docs/formats/apo.md describes its texels.

    Attributes
    ----------
    texels: (n, 4) uint8, breadth first.
    start: (L + 1,) int64, first texel of each of the L levels, from the root on; the last is n.
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
        """Number of levels."""
        return len(self.start) - 1


class Octrees(NamedTuple):
    """Concatenated octree textures.

    Attributes
    ----------
    texel: (N, 4) uint8. begin: (O + 1,) first texel of each octree.
    levels: (O,) number of levels.
    low, side: (O, 3), (O,) lower corner and side of the cubes, metres.
    of: (m,) int32 octree of each triangle of the surfaces, -1 for none.
    """

    texel: NDArray[np.uint8]
    begin: Ints
    levels: Ints
    low: Floats
    side: Floats
    of: NDArray[np.int32]

    @property
    def number(self) -> int:
        """Number of octrees."""
        return len(self.levels)
