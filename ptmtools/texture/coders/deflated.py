"""Deflated groups of files of version 1; they are read and no longer written.

What is deflated is either the group of `raw` or, for each 2×2 block, p - I, q - I and r - I modulo
256 and the remainder of the sum. Deflate made the bytes of a file depend on the zlib that wrote
it; `repeats` has taken its place.
"""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.reading import damaged


def inflate(data: bytes | memoryview, length: int) -> bytes:
    """Exactly ``length`` bytes; more are never unpacked. Raises InputError PTM-I112."""
    unpacker = zlib.decompressobj(-15)
    try:
        out = unpacker.decompress(data, length + 1)
    except zlib.error as error:
        raise damaged(f"its deflated data is invalid ({error})") from None
    if len(out) != length or not unpacker.eof or unpacker.unused_data:
        raise damaged(f"its deflated data does not hold {length} bytes")
    return out


def decode_differences(
    data: bytes | memoryview, below: NDArray[np.uint8], shape: tuple[int, int, int]
) -> NDArray[np.uint8]:
    """The level (h, w, c) that deflated differences refine ``below`` to."""
    height, width, components = shape
    bh, bw, _ = below.shape
    edges = np.zeros((height, width), np.bool_)
    edges[2 * bh :] = edges[:, 2 * bw :] = True
    numbers = np.frombuffer(inflate(data, 4 * below.size + int(edges.sum()) * components), np.uint8)
    level = np.empty(shape, np.uint8)
    level[edges] = numbers[4 * below.size :].reshape(-1, components)
    blocks = numbers[: 4 * below.size].reshape(bh, bw, 4, components)
    p, q, r, s = (level[j : 2 * bh : 2, i : 2 * bw : 2] for j in range(2) for i in range(2))
    p[:], q[:], r[:] = (blocks[:, :, i] + below for i in range(3))
    s[:] = 4 * below + blocks[:, :, 3] - p - q - r
    return level
