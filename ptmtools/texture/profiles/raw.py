"""Profile `raw`: the layout of the paper (§4.1, §4.3), uncompressed.

The coarsest level whole, then for each level a group: the residual array, two bits for every
component of every 2×2 block, and the partial level, which is the level without the lower right
texel s of each block. The paper leaves bit order, texel order and odd sizes open;
``docs/formats/ptm.md`` and ``docs/formats/ptm-kinds.md`` fix them. Samples are little endian.

Integers: the two bits are the remainder of the block's sum by 4 and give s exactly (Eq. 3).

Floats: s = 4·I - p - q - r (§4.1) is not exact, because I was rounded: a unit in the last place of
I is up to four of s. The formula is evaluated in float64 and rounded once; the two bits say by
how many units it is off, -1, 0 or 1, or that an escape behind the partial level says it. Bits per s
where samples of a block are of like magnitude: 3.0; in nibbles of three bits 4.0, in bytes 8.0. The
order 4·I - ((p + q) + r) was the best of three on data spanning 1e-38 … 1e38 by 1 %; they tie
elsewhere.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coder import PLAIN, Coding, Data, Samples, Shape, Tile
from ptmtools.texture.coders.group import GroupReader, group_error
from ptmtools.texture.samples import from_ordered, kind_of, round_to, to_ordered

#: Correction codes 0, 1, 2 stand for 0, -1, +1 units in the last place; this one for an escape.
ESCAPE = 3


def encode_base(level: Samples) -> bytes:
    """All texels, row by row."""
    return sample_bytes(level)


def decode_base(data: Data, shape: Shape, dtype: np.dtype[Any]) -> Samples:
    """The inverse of `encode_base`. Raises InputError PTM-I112 if the length is wrong."""
    reader = GroupReader(data)
    level = reader.texels(shape, dtype)
    reader.end()
    return level


def encode_tile(level: Samples, below: Samples, coding: Coding = PLAIN) -> Tile:
    """Residual array, partial level, escapes. Always exact, whatever error is allowed."""
    residual, escapes = residuals(level, below)
    return Tile(pack_pairs(residual) + sample_bytes(*_partial_level(level)) + escapes, level)


def decode_tile(data: Data, below: Samples, shape: Shape, coding: Coding = PLAIN) -> Tile:
    """The inverse of `encode_tile` (paper Eq. 3). Raises InputError PTM-I112."""
    reader = GroupReader(data)
    codes = read_pairs(reader, below)
    level = np.empty(shape, below.dtype)
    partial = level.size - below.size
    _place_partial_level(reader.texels((1, 1, partial), below.dtype)[0, 0], level)
    escapes = reader.rest() if kind_of(below.dtype).is_float else b""
    reader.end()
    place_last(level, below, codes, escapes)
    return Tile(b"", level)


def group_length(shape: Shape, dtype: np.dtype[Any] | type = np.uint8) -> int:
    """Bytes of the group of a level (h, w, c) in this profile; of floats, without escapes."""
    blocks = (shape[0] >> 1) * (shape[1] >> 1)
    texels = shape[0] * shape[1] - blocks
    return -(-blocks * shape[2] // 4) + texels * shape[2] * np.dtype(dtype).itemsize


def sample_bytes(*parts: Samples) -> bytes:
    """Samples one after another, little endian."""
    return b"".join(
        part.astype(part.dtype.newbyteorder("<"), copy=False).tobytes() for part in parts
    )


def residuals(level: Samples, below: Samples) -> tuple[NDArray[np.uint8], bytes]:
    """The code, 0 … 3, of every component of every block (bh, bw, c), and the escapes."""
    p, q, r, s = corners(level, below)
    if not kind_of(level.dtype).is_float:
        # The remainder of a sum by 4 is its two low bits, and they survive any overflow.
        return ((p + q + r + s) & 3).astype(np.uint8), b""
    signed = f"i{level.dtype.itemsize}"
    difference = (to_ordered(s) - _formula(p, q, r, below)).view(signed)
    sign = difference >> (8 * level.dtype.itemsize - 1)
    codes = ((difference << 1) ^ sign).view(f"u{level.dtype.itemsize}")
    escaped = codes >= ESCAPE
    return np.minimum(codes, ESCAPE).astype(np.uint8), _pack_numbers(codes[escaped] - ESCAPE)


def place_last(level: Samples, below: Samples, codes: NDArray[np.uint8], escapes: Data) -> None:
    """Fills in s of every block of ``level``. Raises InputError PTM-I112 for wrong escapes."""
    p, q, r, s = corners(level, below)
    if not kind_of(level.dtype).is_float:
        # Modulo 2^8 or 2^16 the result is right even where the sums are not.
        s[:] = below * 4 + codes - p - q - r
        return
    unsigned = np.dtype(f"u{level.dtype.itemsize}")
    escaped = codes == ESCAPE
    difference = codes.astype(unsigned)
    numbers = _unpack_numbers(escapes, int(escaped.sum()), 8 * unsigned.itemsize)
    difference[escaped] = numbers.astype(unsigned) + unsigned.type(ESCAPE)
    difference = (difference >> 1) ^ -(difference & 1)
    s[:] = from_ordered(_formula(p, q, r, below) + difference, level.dtype)


def corners(level: Samples, below: Samples) -> list[Samples]:
    """Views of the upper left, upper right, lower left and lower right texels of all blocks."""
    blocks = level[: 2 * below.shape[0], : 2 * below.shape[1]]
    return [blocks[j::2, i::2] for j in range(2) for i in range(2)]


def _formula(p: Samples, q: Samples, r: Samples, below: Samples) -> NDArray[Any]:
    """4·I - ((p + q) + r) as ordered integers; r where that is NaN."""
    with np.errstate(all="ignore"):
        total = p.astype(np.float64) + q
        total += r
        value = 4.0 * below.astype(np.float64) - total
    guess = to_ordered(round_to(value, below.dtype))
    undefined = np.isnan(value)
    guess[undefined] = to_ordered(r)[undefined]
    return guess


def _partial_level(level: Samples) -> tuple[Samples, Samples]:
    """Rows of even index whole, of the others the columns of even index, in row-major order.

    That leaves out the lower right texel of each block and nothing else: an odd last row or column
    has an even index.
    """
    pairs = level.shape[0] >> 1
    row = level.shape[1] * level.shape[2]
    whole = level[: 2 * pairs : 2].reshape(pairs, row)
    half = level[1 : 2 * pairs : 2, ::2].reshape(pairs, (level.shape[1] + 1 >> 1) * level.shape[2])
    return np.concatenate([whole, half], axis=1), level[2 * pairs :]


def _place_partial_level(data: Samples, level: Samples) -> None:
    height, width, components = level.shape
    pairs = height >> 1
    row = width * components
    half = (width + 1 >> 1, components)
    both = row + half[0] * components
    rows = data[: pairs * both].reshape(pairs, both)
    level[: 2 * pairs : 2] = rows[:, :row].reshape(pairs, width, components)
    level[1 : 2 * pairs : 2, ::2] = rows[:, row:].reshape(pairs, *half)
    level[2 * pairs :] = data[pairs * both :].reshape(height & 1, width, components)


def pack_pairs(codes: NDArray[np.uint8]) -> bytes:
    """Four codes of two bits to a byte, the first in the lowest bits."""
    flat = codes.reshape(-1)
    four = np.pad(flat, (0, -len(flat) % 4)).reshape(-1, 4)
    return (four[:, 0] | four[:, 1] << 2 | four[:, 2] << 4 | four[:, 3] << 6).tobytes()


def read_pairs(reader: GroupReader, below: Samples) -> NDArray[np.uint8]:
    """The inverse of `pack_pairs`: a code for every sample of ``below``."""
    packed = reader.numbers("u1", -(-below.size // 4))
    codes = np.stack([packed >> shift & 3 for shift in (0, 2, 4, 6)], axis=1)
    return codes.reshape(-1)[: below.size].reshape(below.shape)


def _pack_numbers(numbers: NDArray[Any]) -> bytes:
    """Numbers in nibbles of three bits, lowest first, 8 added where more follow; low nibble first.

    A last odd nibble is filled up with 0.
    """
    rest = numbers.astype(np.uint64)
    count = np.ones(len(rest), np.int64)
    for shift in range(3, 33, 3):
        count += rest >> np.uint64(shift) > 0
    first = np.cumsum(count) - count
    total = int(count.sum())
    nibbles = np.zeros(total + total % 2, np.uint8)
    while len(rest):
        more = rest > 7
        nibbles[first] = (rest & np.uint64(7)).astype(np.uint8) | (more.astype(np.uint8) << 3)
        rest, first = rest[more] >> np.uint64(3), first[more] + 1
    return (nibbles[::2] | nibbles[1::2] << 4).tobytes()


def _unpack_numbers(data: Data, n: int, bits: int) -> NDArray[np.uint64]:
    """Exactly n numbers of at most ``bits`` bits. Raises InputError PTM-I112."""
    pairs = np.frombuffer(data, np.uint8)
    nibbles = np.stack([pairs & 15, pairs >> 4], axis=1).reshape(-1)
    last = np.flatnonzero(nibbles < 8)
    # One more where the last nibble only fills up its byte.
    if not n <= len(last) <= n + 1 or (len(nibbles) and nibbles[-1] > 7):
        raise group_error("its escapes are not as many as its residuals say")
    used = int(last[n - 1]) + 1 if n else 0
    if used + used % 2 != len(nibbles) or nibbles[used:].any():
        raise group_error("its escapes are not as many as its residuals say")
    last = last[:n]
    first = np.concatenate([[0], last[:-1] + 1]) if n else last
    count = last - first + 1
    numbers = np.zeros(n, np.uint64)
    for i in range(int(count.max(initial=0))):
        if 3 * i > bits:
            raise group_error("an escape is too large")
        some = count > i
        digit = (nibbles[first[some] + i] & 7).astype(np.uint64)
        numbers[some] |= digit << np.uint64(3 * i)
    if n and int(numbers.max()) >> bits:
        raise group_error("an escape is too large")
    return numbers
