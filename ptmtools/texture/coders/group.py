"""Reading and writing the bytes of a group, shared by all coders.

- `GroupReader` bounds every read; `group_error` is the error for bytes that no encoder writes.
- The components of a texel are coded as *planes*: green, red, blue, alpha; grey and alpha. Red
  refers to green, blue to both, the others to none.
- A coarsest level of any size is coded as the pyramid of its own: levels in one string of bytes,
  each with its length in four bytes before it.
- `solve_normal_equations` solves weighted least squares without rounding, the same on every
  machine.
- Deflated groups of files of version 1 are read and no longer written: the group of `raw` or, for
  each 2×2 block, p - I, q - I and r - I modulo 256 and the remainder of the sum. Deflate made the
  bytes of a file depend on the zlib that wrote it; `repeats` has taken its place.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture.coder import Coding, Data, Samples, Shape, Tile
from ptmtools.texture.pyramid import level_sizes


def group_error(what: str) -> InputError:
    """The error for a group whose contents contradict each other."""
    return InputError(
        "PTM-I112",
        f"the group cannot be decoded: {what}",
        remedy="the file is damaged or was not written by a conforming encoder; encode it again",
    )


class GroupReader:
    """Bytes from the front; asking for more than there are raises InputError PTM-I112."""

    def __init__(self, data: Data) -> None:
        self._left = memoryview(data)

    def take(self, size: int) -> memoryview:
        """The next ``size`` bytes, not copied."""
        if size > len(self._left):
            raise group_error("it is cut short")
        taken, self._left = self._left[:size], self._left[size:]
        return taken

    def number(self, size: int) -> int:
        """The next little-endian integer of ``size`` bytes."""
        return int.from_bytes(self.take(size), "little")

    def varint(self) -> int:
        """A number below 2^35, as `pack_varints` writes it."""
        number = 0
        for shift in range(0, 35, 7):
            byte = self.take(1)[0]
            number |= (byte & 127) << shift
            if byte < 128:
                return number
        raise group_error("a number is too long")

    def numbers(self, dtype: str, count: int) -> NDArray[Any]:
        """The next (count,) numbers of a little-endian type, copied."""
        return np.frombuffer(self.take(count * np.dtype(dtype).itemsize), dtype).copy()

    def texels(self, shape: Shape, dtype: np.dtype[Any]) -> Samples:
        """Samples one after another, little endian, as an array of that shape."""
        size = shape[0] * shape[1] * shape[2] * dtype.itemsize
        samples = np.frombuffer(self.take(size), dtype.newbyteorder("<"))
        return samples.astype(dtype).reshape(shape)

    def rest(self) -> memoryview:
        """The bytes left."""
        return self.take(len(self._left))

    def end(self) -> None:
        """Raise InputError PTM-I112 if anything is left."""
        if self._left:
            raise group_error(f"{len(self._left)} bytes are left over")


def pack_varints(*numbers: int) -> bytes:
    """Numbers one after another, seven bits a byte, lowest first, 128 added where more follow."""
    out = bytearray()
    for number in numbers:
        while number > 127:
            out.append(128 | number & 127)
            number >>= 7
        out.append(number)
    return bytes(out)


def plane_order(components: int) -> NDArray[np.int64]:
    """Components (c,) in coding order."""
    return np.array([1, 0, 2, 3][:components] if components > 2 else range(components), np.int64)


def reference_counts(components: int) -> NDArray[np.int64]:
    """How many of the planes coded first each plane (c,) refers to."""
    return np.array([0, 1, 2, 0][:components] if components > 2 else [0] * components, np.int64)


_LENGTH = 4


def pack_levels(
    encode_tile: Callable[..., Tile], below: Samples, levels: Iterable[Samples]
) -> bytes:
    """Levels, coarsest first, each refining the one before it and the first ``below``."""
    parts, memory = [], None
    for level in levels:
        tile = encode_tile(level, below, Coding(memory=memory))
        parts += [len(tile.data).to_bytes(_LENGTH, "little"), tile.data]
        below, memory = level, tile.memory
    return b"".join(parts)


def unpack_levels(
    decode_tile: Callable[..., Tile], reader: GroupReader, below: Samples, shapes: Iterable[Shape]
) -> Samples:
    """The last of the levels of `pack_levels`, which have these shapes.

    Raises InputError PTM-I112.
    """
    memory = None
    for shape in shapes:
        data = reader.take(reader.number(_LENGTH))
        tile = decode_tile(data, below, shape, Coding(memory=memory))
        below, memory = tile.texels, tile.memory
    reader.end()
    return below


def shapes_to(shape: Shape) -> list[Shape]:
    """Shapes of the pyramid of a level, coarsest first."""
    height, width, components = shape
    return [(h, w, components) for w, h in level_sizes(width, height)]


def solve_normal_equations(
    sums: NDArray[np.float64], bits: int, top: int, ridge: int, share: int
) -> NDArray[np.int64]:
    """Weights (m,) in 1/2^bits, within ± ``top``, that solve normal equations.

    Parameters
    ----------
    sums: (m, m + 1), those of the products of two features and, last, of a feature and the target:
        whole numbers below 2^53, which come out the same in whatever order they are added.
    ridge, share: each element of the diagonal is increased by ``ridge`` and by 1/2^share of itself,
        so that a feature that never varies gets the weight 0.
    """
    rows = sums.astype(np.int64).tolist()
    for i, row in enumerate(rows):
        row[i] += (row[i] >> share) + ridge
    numerators, determinant = bareiss(rows)
    unit = 2 << bits
    solution = [(unit * n + determinant) // (2 * determinant) for n in numerators]
    return np.clip(solution, -top, top).astype(np.int64)


def bareiss(rows: list[list[int]]) -> tuple[list[int], int]:
    """Numerators and denominator of the x of symmetric, positive definite equations.

    ``rows``: the matrix with the right side as its last column, overwritten. By Bareiss'
    fraction-free elimination (1968). Only the upper half is eliminated: it stays symmetric, and all
    divisions are exact.
    """
    n = len(rows)
    previous = 1
    for k in range(n - 1):
        pivot_row = rows[k]
        pivot = pivot_row[k]
        for i in range(k + 1, n):
            row, factor = rows[i], pivot_row[i]
            for j in range(i, n + 1):
                row[j] = (row[j] * pivot - factor * pivot_row[j]) // previous
        previous = pivot
    determinant = rows[-1][n - 1]
    numerators = [0] * n
    for i in range(n - 1, -1, -1):
        row = rows[i]
        total = determinant * row[n] - sum(row[j] * numerators[j] for j in range(i + 1, n))
        numerators[i] = total // row[i]
    return numerators, determinant


def inflate(data: Data, length: int) -> bytes:
    """Inflates exactly ``length`` bytes and never unpacks more. Raises InputError PTM-I112."""
    unpacker = zlib.decompressobj(-15)
    try:
        out = unpacker.decompress(data, length + 1)
    except zlib.error as error:
        raise group_error(f"its deflated data is invalid ({error})") from None
    if len(out) != length or not unpacker.eof or unpacker.unused_data:
        raise group_error(f"its deflated data does not hold {length} bytes")
    return out


def decode_differences(data: Data, below: NDArray[np.uint8], shape: Shape) -> NDArray[np.uint8]:
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


#: Bits of a table and its size: the frequencies of a table in use sum to this.
TABLE_BITS = 11
TABLE_SIZE = 1 << TABLE_BITS
#: Symbols of this number escape to a 16-bit value, but for tables without escape.
ESCAPE = 255
#: Results of a pass over a group: TRUNCATED if its stream ended early, IMPOSSIBLE if no encoder
#: writes it.
OK, TRUNCATED, IMPOSSIBLE = 0, 1, 2
