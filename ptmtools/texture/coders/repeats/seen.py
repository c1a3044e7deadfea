"""Blocks and texels that were seen before: where they are looked for, and which of them it is.

A texel is one number of 32 bits; numbers are of 64, sums modulo 2^32. A block is its four texels
p q r s.
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
_EVEN = np.uint64(0x00FF00FF)
_ONE, _TWO, _EIGHT, _FIFTEEN = np.uint64(1), np.uint64(2), np.uint64(8), np.uint64(15)
_BYTE = np.uint64(255)


@kernel
def slot(h: Any, shift: Any) -> Any:
    h &= _MASK32
    h ^= h >> _FIFTEEN
    return ((h * K1) & _MASK32) >> shift


@kernel
def minus(a: Any, b: Any) -> Any:
    """a - b, byte by byte."""
    return ((a | _HIGH) - (b & _LOW7)) ^ ((a ^ b ^ _HIGH) & _HIGH)


@kernel
def _plus(a: Any, b: Any) -> Any:
    """a + b, byte by byte."""
    return ((a & _LOW7) + (b & _LOW7)) ^ ((a ^ b) & _HIGH)


@kernel
def shifted(block: Any, change: Any) -> Any:
    """A block with ``change`` added to each byte of its texels."""
    p, q, r, s = block
    return _plus(p, change), _plus(q, change), _plus(r, change), _plus(s, change)


@kernel
def same(one: Any, other: Any) -> Any:
    p, q, r, s = one
    a, b, c, d = other
    return (p == a) & (q == b) & (r == c) & (s == d)


@kernel
def block_at(texels: Any, place: Any, wide: Any) -> Any:
    """The block that begins at ``place``."""
    return (
        np.uint64(texels[place]),
        np.uint64(texels[place + _ONE]),
        np.uint64(texels[place + wide]),
        np.uint64(texels[place + wide + _ONE]),
    )


@kernel
def put_block(texels: Any, place: Any, wide: Any, block: Any) -> None:
    p, q, r, s = block
    texels[place] = p
    texels[place + _ONE] = q
    texels[place + wide] = r
    texels[place + wide + _ONE] = s


@kernel
def texel_slot(
    mean: Any, k: Any, w: Any, kw: Any, n: Any, kn: Any, nw: Any, knw: Any, ne: Any, kne: Any,
    shift: Any,
) -> Any:  # fmt: skip
    """Where the last texel in such surroundings is kept."""
    return slot(mean * k + w * kw + n * kn + nw * knw + ne * kne, shift)


@kernel
def known(texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any) -> Any:
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
    texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any, context: Any, sink: Any, source: Any,
    state: Any,
) -> Any:  # fmt: skip
    """A texel that is one of five guesses, or `OTHER`."""
    found = known(texel, seen, w, n, nw, ne)
    if w == n:
        context += 1
    if (seen == w) | (seen == n):
        context += 2
    found = symbol(found, context, sink, source, state)
    if source is not None:
        texel = nw if found == 3 else ne
        if found == 2:
            texel = n
        if found == 1:
            texel = w
        if found == 0:
            texel = seen
    return texel if found < 5 else OTHER


@kernel
def _fits(mean: Any, p: Any, q: Any, r: Any, s: Any) -> Any:
    """Whether a block has this mean in every component."""
    low = (p & _EVEN) + (q & _EVEN) + (r & _EVEN) + (s & _EVEN)
    high = (
        ((p >> _EIGHT) & _EVEN) + ((q >> _EIGHT) & _EVEN) + ((r >> _EIGHT) & _EVEN)
        + ((s >> _EIGHT) & _EVEN)
    )  # fmt: skip
    return (((low >> _TWO) & _EVEN) | (((high >> _TWO) & _EVEN) << _EIGHT)) == mean


@kernel
def choices(mean: Any, p: Any, q: Any, r: Any, seen: Any, west: Any, wanted: Any, nth: Any) -> Any:
    """Fourth texels that the mean allows: their number, the place of ``wanted``, the ``nth``."""
    texels = (seen, r, q, p, west)
    possible, place, chosen = 0, -1, seen
    for i in range(5):
        one = texels[i]
        fresh = _fits(mean, p, q, r, one)
        for j in range(i):
            fresh &= texels[j] != one
        if fresh:
            if one == wanted:
                place = possible
            if possible == nth:
                chosen = one
            possible += 1
    return possible, place, chosen


@kernel
def spread(block: Any, components: Any) -> Any:
    """The largest difference between texels of a block, over the components."""
    p, q, r, s = block
    most: Any = 0
    for _ in range(components):
        a, b, c, d = p & _BYTE, q & _BYTE, r & _BYTE, s & _BYTE
        most = max(most, np.int64(max(max(a, b), max(c, d)) - min(min(a, b), min(c, d))))
        p, q, r, s = p >> _EIGHT, q >> _EIGHT, r >> _EIGHT, s >> _EIGHT
    return most
