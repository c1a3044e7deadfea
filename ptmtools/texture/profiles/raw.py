"""Profile `raw`: the layout of the paper (§4.3), uncompressed.

The coarsest level whole, in row-major order. Then for each level a group: the residual array, two
bits for every component of every 2×2 block, and the partial level, which is the level in row-major
order without the lower right texel of each block. The paper leaves bit order, texel order and odd
sizes open; ``docs/format-ptm.md`` fixes them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture.profiles import Tile


@dataclass(frozen=True)
class RawProfile:
    """The paper's layout; see the module."""

    name: str = "raw"

    def encode_base(self, level: NDArray[np.uint8]) -> bytes:
        """All texels, row by row."""
        return level.tobytes()

    def decode_base(
        self, data: bytes, shape: tuple[int, int, int], dtype: np.dtype[Any]
    ) -> NDArray[np.uint8]:
        """The inverse of `encode_base`. Raises InputError PTM-I112 if the length is wrong."""
        _expect_length(data, shape[0] * shape[1] * shape[2])
        return np.frombuffer(data, np.uint8).reshape(shape).copy()

    def encode_tile(
        self,
        level: NDArray[np.uint8],
        below: NDArray[np.uint8],
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """Residual array, then partial level."""
        return Tile(self.encode_group(level, below), level)

    def decode_tile(
        self,
        data: bytes,
        below: NDArray[np.uint8],
        shape: tuple[int, int, int],
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """The inverse of `encode_tile`. Raises InputError PTM-I112."""
        return Tile(b"", self.decode_group(data, below, shape))

    def encode_group(self, level: NDArray[np.uint8], below: NDArray[np.uint8]) -> bytes:
        """Residual array, then partial level."""
        bh, bw, _ = below.shape
        blocks = level[: 2 * bh, : 2 * bw].astype(np.uint16)
        rows = blocks[0::2] + blocks[1::2]
        # The remainder of a sum by 4 is its two low bits.
        residual = (rows[:, 0::2] + rows[:, 1::2]) & 3
        return _pack_residuals(residual.astype(np.uint8)) + _partial_level(level)

    def decode_group(
        self, data: bytes, below: NDArray[np.uint8], shape: tuple[int, int, int]
    ) -> NDArray[np.uint8]:
        """The inverse of `encode_group` (paper Eq. 3). Raises InputError PTM-I112."""
        _expect_length(data, group_length(shape))
        bh, bw, c = below.shape
        packed = -(-below.size // 4)
        residual = _unpack_residuals(data[:packed], below.size).reshape(bh, bw, c)
        level = np.empty(shape, np.uint8)
        _place_partial_level(np.frombuffer(data, np.uint8, offset=packed), level)
        blocks = level[: 2 * bh, : 2 * bw]
        # Modulo 256 the result is right even where the sums are not.
        last = 4 * below + residual - blocks[0::2, 0::2] - blocks[0::2, 1::2] - blocks[1::2, 0::2]
        blocks[1::2, 1::2] = last
        return level


def group_length(shape: tuple[int, int, int]) -> int:
    """Bytes of the group of a level (h, w, c) in this profile."""
    blocks = (shape[0] >> 1) * (shape[1] >> 1)
    return -(-blocks * shape[2] // 4) + (shape[0] * shape[1] - blocks) * shape[2]


def _partial_level(level: NDArray[np.uint8]) -> bytes:
    """Rows of even index whole, of the others the columns of even index, in row-major order.

    That leaves out the lower right texel of each block and nothing else: an odd last row or column
    has an even index.
    """
    pairs = level.shape[0] >> 1
    whole = level[: 2 * pairs : 2].reshape(pairs, -1)
    half = level[1 : 2 * pairs : 2, ::2].reshape(pairs, -1)
    return np.concatenate([whole, half], axis=1).tobytes() + level[2 * pairs :].tobytes()


def _place_partial_level(data: NDArray[np.uint8], level: NDArray[np.uint8]) -> None:
    height, width, components = level.shape
    pairs = height >> 1
    row = width * components
    both = row + (width + 1 >> 1) * components
    rows = data[: pairs * both].reshape(pairs, both)
    level[: 2 * pairs : 2] = rows[:, :row].reshape(pairs, width, components)
    level[1 : 2 * pairs : 2, ::2] = rows[:, row:].reshape(pairs, -1, components)
    level[2 * pairs :] = data[pairs * both :].reshape(-1, width, components)


def _pack_residuals(residual: NDArray[np.uint8]) -> bytes:
    flat = residual.reshape(-1)
    four = np.pad(flat, (0, -len(flat) % 4)).reshape(-1, 4)
    return (four[:, 0] | four[:, 1] << 2 | four[:, 2] << 4 | four[:, 3] << 6).tobytes()


def _unpack_residuals(data: bytes, n: int) -> NDArray[np.uint8]:
    packed = np.frombuffer(data, np.uint8)
    return np.stack([packed >> shift & 3 for shift in (0, 2, 4, 6)], axis=1).reshape(-1)[:n]


def _expect_length(data: bytes, length: int) -> None:
    if len(data) != length:
        raise InputError(
            "PTM-I112",
            f"the group cannot be decoded: it has {len(data)} bytes instead of {length}",
            remedy="the file is damaged or was not written by a conforming encoder; "
            "encode it again",
        )
