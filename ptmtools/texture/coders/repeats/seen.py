"""Blocks and texels that were seen before: where they are looked for, and which of them it is.

A texel is one number of 32 bits; numbers are of 64, sums modulo 2^32.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.repeats.symbols import symbol

#: Stands for a texel that is none of the guesses.
OTHER = np.uint64(1 << 32)
#: Factors of what a key is made of.
K0, K1, K2 = np.uint64(0x9E3779B1), np.uint64(0x85EBCA6B), np.uint64(0xC2B2AE35)
K3, K4, K5 = np.uint64(0x27D4EB2F), np.uint64(0x165667B1), np.uint64(0xA24BAED5)
_MASK32 = np.uint64(0xFFFFFFFF)
_HIGH = np.uint64(0x80808080)
_LOW7 = np.uint64(0x7F7F7F7F)
_ONE = np.uint64(1)


@kernel
def slot(h: Any, shift: Any) -> Any:
    h &= _MASK32
    h ^= h >> np.uint64(15)
    return ((h * K1) & _MASK32) >> shift


@kernel
def minus(a: Any, b: Any) -> Any:
    """a - b, byte by byte."""
    return ((a | _HIGH) - (b & _LOW7)) ^ ((a ^ b ^ _HIGH) & _HIGH)


@kernel
def plus(a: Any, b: Any) -> Any:
    """a + b, byte by byte."""
    return ((a & _LOW7) + (b & _LOW7)) ^ ((a ^ b) & _HIGH)


@kernel
def known(texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any) -> int:
    """Number of the first guess that is the texel; 5 for none."""
    found = 4 if texel == ne else 5
    if texel == nw:
        found = 3
    if texel == n:
        found = 2
    if texel == w:
        found = 1
    return 0 if texel == seen else found


@kernel
def seen_texel(
    encoding: bool, texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any, context: int,
    numbers: Any, words: Any, state: Any,
) -> Any:  # fmt: skip
    """A texel that is one of five guesses, or `OTHER`."""
    found = known(texel, seen, w, n, nw, ne)
    if w == n:
        context += 1
    if seen in (w, n):
        context += 2
    found = symbol(encoding, found, context, numbers, words, state)
    if found == 0:
        texel = seen
    elif found == 1:
        texel = w
    elif found == 2:
        texel = n
    elif found == 3:
        texel = nw
    elif found == 4:
        texel = ne
    else:
        texel = OTHER
    return texel


@kernel
def _fits(mean: Any, p: Any, q: Any, r: Any, s: Any) -> Any:
    """Whether a block has this mean in every component."""
    even = np.uint64(0x00FF00FF)
    eight = np.uint64(8)
    low = (p & even) + (q & even) + (r & even) + (s & even)
    high = (
        ((p >> eight) & even) + ((q >> eight) & even) + ((r >> eight) & even)
        + ((s >> eight) & even)
    )  # fmt: skip
    return ((low >> np.uint64(2)) & even) == (mean & even) and ((high >> np.uint64(2)) & even) == (
        (mean >> eight) & even
    )


@kernel
def choices(mean: Any, p: Any, q: Any, r: Any, seen: Any, west: Any, wanted: Any, nth: int) -> Any:
    """Fourth texels that the mean allows: their number, the place of ``wanted``, the ``nth``."""
    texels = (seen, r, q, p, west)
    possible, place, chosen = 0, -1, seen
    for i in range(5):
        one = texels[i]
        fresh = True
        for j in range(i):
            fresh &= texels[j] != one
        if fresh and _fits(mean, p, q, r, one):
            if one == wanted:
                place = possible
            if possible == nth:
                chosen = one
            possible += 1
    return possible, place, chosen


@kernel
def kept_block(flat: Any, place: Any, wide: Any, mean: Any, kept: Any) -> Any:
    """The block that begins at ``place``, if one is kept, else four times the mean."""
    p, q, r, s = mean, mean, mean, mean
    if kept:
        p, q = np.uint64(flat[place]), np.uint64(flat[place + _ONE])
        r, s = np.uint64(flat[place + wide]), np.uint64(flat[place + wide + _ONE])
    return p, q, r, s


@kernel
def spread(p: Any, q: Any, r: Any, s: Any, components: int) -> Any:
    """The largest difference between texels of a block, over the components."""
    most: Any = 0
    for c in range(components):
        at = np.uint64(8 * c)
        byte = np.uint64(255)
        a, b = np.int64((p >> at) & byte), np.int64((q >> at) & byte)
        d, e = np.int64((r >> at) & byte), np.int64((s >> at) & byte)
        most = max(most, max(max(a, b), max(d, e)) - min(min(a, b), min(d, e)))
    return most
