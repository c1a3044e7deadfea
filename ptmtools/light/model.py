"""The surfaces of a cell, and the light of a building as stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Ints
from ptmtools.store.archive import Stored


@dataclass(frozen=True)
class CellSurfaces:
    """The surfaces of one cell.

    Attributes
    ----------
    corner: (n, 3, 3) float32 metres.
    object, shape: (n,) of the scene; of the cell, ascending.
    glass: (n,) whether the surface has no light of its own: it is seen through, or glows.
    dense: (n,) whether its light is at vertices.
    side: (n,) 1 where the front of a face counts, -1 the back, 0 the more open of the two.
    face: (n,) the triangle of the scene that it is a piece of.
    """

    corner: NDArray[np.float32]
    object: Ints
    shape: Ints
    glass: Bools
    dense: Bools
    side: NDArray[np.int8]
    face: Ints


@dataclass(frozen=True)
class Light:
    """The light of all cells, in the order of triangles and shapes of `output.geometry.Geometry`.

    Attributes
    ----------
    side: (C,) int32 texels, width and height of the lightmap of each cell; 0 without one.
    mapped: (S,) whether a shape is lit by the lightmap of its cell, or at its vertices.
    uv: (M, 3, 2) float32 coordinates in that lightmap, in [0, 1], origin at the lower left.
    vertex: (M, 3) uint8 linear light at the corners, of 255; 255 in shapes with a lightmap.
    """

    side: NDArray[np.int32]
    mapped: Bools
    uv: NDArray[np.float32]
    vertex: NDArray[np.uint8]

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The light as plain arrays."""
        return dict(vars(self))

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Light:
        """Inverse of `to_arrays`. Raises KeyError or ValueError for other arrays."""
        stored = Stored(arrays)
        uv = stored.array("uv", np.float32, None, 3, 2, finite=True)
        if uv.size and not (uv.min() >= 0 and uv.max() <= 1):
            raise ValueError("a coordinate lies outside of its lightmap")
        side = stored.array("side", np.int32, None)
        if (side < 0).any():
            raise ValueError("a lightmap has a negative size")
        return Light(
            side,
            stored.array("mapped", np.bool_, None),
            uv,
            stored.array("vertex", np.uint8, len(uv), 3),
        )
