"""Matrices of bits, (2K, W) little-endian words over directed portals: row p is what p sees.

The way back through portal q is ``q ^ 1``; p sees q if and only if the way back from q sees that
from p.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bits
from ptmtools.compiled import kernel, plain_kernel

ONE = np.uint64(1)
ZERO = np.uint64(0)
# Index of the lowest set bit: a De Bruijn sequence of order 6 and its inverse.
DE_BRUIJN = np.uint64(0x03F79D71B4CB0A89)
LOW_BIT = np.zeros(64, dtype=np.int64)
for _i in range(64):
    LOW_BIT[((0x03F79D71B4CB0A89 << _i) & 0xFFFFFFFFFFFFFFFF) >> 58] = _i


@plain_kernel
def has(rows: Bits, p: int, q: int) -> bool:
    """Whether bit q of row p is set."""
    return bool((rows[p, q >> 6] >> np.uint64(q & 63)) & ONE)


@plain_kernel
def lowest(row: np.uint64) -> int:
    """The index of the lowest bit of a word, not 0."""
    return int(LOW_BIT[((row & (~row + ONE)) * DE_BRUIJN) >> np.uint64(58)])


@plain_kernel
def transpose(square: Bits) -> None:
    """A square of 64 × 64 bits (64,), turned about its diagonal in place: halves change places,
    then the halves of halves (Warren, Hacker's Delight, 7-3)."""
    step, mask = 32, np.uint64(0x00000000FFFFFFFF)
    while step > 0:
        shift = np.uint64(step)
        i = 0
        while i < 64:
            moved = ((square[i] >> shift) ^ square[i | step]) & mask
            square[i] ^= moved << shift
            square[i | step] ^= moved
            i = ((i | step) + 1) & ~step
        step >>= 1
        mask ^= mask << np.uint64(step)


@kernel
def return_sight(known: Bits, first: int, last: int) -> None:
    """Rows of the blocks first … last - 1 of 64: p sees q only if the way back from q sees that
    from p. Rows may change meanwhile: what they lose so, p loses here anyway.
    """
    count, words = known.shape
    square = np.empty(64, np.uint64)
    odd = np.uint64(0xAAAAAAAAAAAAAAAA)
    for block in range(first, last):
        for w in range(words):
            for i in range(64):
                back = (w << 6) + i ^ 1
                row = known[back, block] if back < count else ZERO
                square[i] = (row & odd) >> ONE | (row & ~odd) << ONE
            transpose(square)
            for i in range(min(64, count - (block << 6))):
                known[(block << 6) + i, w] &= square[i]


@plain_kernel
def drop_unreturned(known: Bits, p: int, dropped: Bits) -> None:
    """Where p sees q no longer, ``dropped`` (W,), the way back from q does not see that from p."""
    back = p ^ 1
    w, keep = back >> 6, ~(ONE << np.uint64(back & 63))
    for v in range(len(dropped)):
        rest = dropped[v]
        while rest != ZERO:
            known[((v << 6) + lowest(rest)) ^ 1, w] &= keep
            rest &= rest - ONE
