"""Blocks and texels of the repeats coder: repeated ones, by the place of an earlier one, and new
ones, as Haar differences, samples and remainders of a sum.

A texel is one number of 32 bits; numbers are of 64, sums modulo 2^32. A block is its four texels
p q r s.

`symbol` codes one symbol in either direction, by a table that depends on the symbol before.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ptmtools.jit import plain_kernel as kernel
from ptmtools.texture.coders.group import ESCAPE
from ptmtools.texture.coders.rans_kernels import decode_single

#: First table of each sort of symbol: whether the block is the first guess; the block's guess; a
#: texel's guess, by position; samples of texels outside blocks; Haar differences; samples of other
#: texels; remainders of the sum; the part of a run that is not flat.
FIRST, GUESS, TEXEL, EDGE, HAAR, SAMPLE, REMAINDER, RUN = 0, 12, 24, 84, 85, 145, 185, 188
#: Classes of activity of Haar differences; tables for V, h and g, without and with a reference.
CLASSES = 10
TABLES = RUN + 8
#: Places in `state`: the four rANS states first; then symbols so far, the next word, the
#: next escape, the index behind the last escape, nonzero once something was impossible.
COUNT, WORD, NEXT_ESCAPE, ESCAPES_END, STRAY = 4, 5, 6, 7, 8


class RepeatsSource(NamedTuple):
    """A decoder's source of symbols."""

    table: Any  # uint32 of `rans.single_tables`
    words: Any  # uint16, the escapes and behind them the words, with room for a block's more
    limit: Any  # index of the word behind the last


@kernel
def symbol(z: Any, context: Any, sink: Any, source: Any, state: Any) -> Any:
    """Symbol ``z`` to ``sink`` as symbol | context << 16 or, decoding, the next of ``source``."""
    n = state[COUNT]
    state[COUNT] = n + 1
    if sink is not None:
        sink[np.uint64(n)] = z | context << 16
    if source is not None:
        at = np.uint64(state[WORD])
        z, refill = decode_single(source.table, context, state, np.uint64(n & 3), source.words[at])
        state[WORD] = at + (np.uint64(1) if refill else np.uint64(0))
        if z == ESCAPE:
            at = np.uint64(state[NEXT_ESCAPE])
            if state[NEXT_ESCAPE] < state[ESCAPES_END]:
                z = np.int64(source.words[at])
                state[NEXT_ESCAPE] = at + np.uint64(1)
            else:
                state[STRAY] = 1
    return np.int64(z)


#: Stands for a texel that is none of the guesses.
OTHER = np.uint64(1 << 32)
#: Factors of the components of a key.
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
def shift_block(block: Any, change: Any) -> Any:
    """A block with ``change`` added to each byte of its texels."""
    p, q, r, s = block
    return _plus(p, change), _plus(q, change), _plus(r, change), _plus(s, change)


@kernel
def same(block: Any, guess: Any) -> Any:
    p, q, r, s = block
    a, b, c, d = guess
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
    """Slot of the last texel in these surroundings."""
    return slot(mean * k + w * kw + n * kn + nw * knw + ne * kne, shift)


@kernel
def guess_rank(texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any) -> Any:
    """Number of the first guess that is the texel; 5 for none."""
    rank = 4 if texel == ne else 5
    if texel == nw:
        rank = 3
    if texel == n:
        rank = 2
    if texel == w:
        rank = 1
    return 0 if texel == seen else rank


@kernel
def seen_texel(
    texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any, context: Any, sink: Any, source: Any,
    state: Any,
) -> Any:  # fmt: skip
    """A texel that is one of five guesses, or `OTHER`."""
    rank = guess_rank(texel, seen, w, n, nw, ne)
    if w == n:
        context += 1
    if (seen == w) | (seen == n):
        context += 2
    rank = symbol(rank, context, sink, source, state)
    if source is not None:
        texel = nw if rank == 3 else ne
        if rank == 2:
            texel = n
        if rank == 1:
            texel = w
        if rank == 0:
            texel = seen
    return texel if rank < 5 else OTHER


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
        candidate = texels[i]
        fresh = _fits(mean, p, q, r, candidate)
        for j in range(i):
            fresh &= texels[j] != candidate
        if fresh:
            if candidate == wanted:
                place = possible
            if possible == nth:
                chosen = candidate
            possible += 1
    return possible, place, chosen


@kernel
def spread(block: Any, components: Any) -> Any:
    """The largest difference between texels of a block, over the components."""
    p, q, r, s = block
    widest: Any = 0
    for _ in range(components):
        a, b, c, d = p & _BYTE, q & _BYTE, r & _BYTE, s & _BYTE
        widest = max(widest, np.int64(max(max(a, b), max(c, d)) - min(min(a, b), min(c, d))))
        p, q, r, s = p >> _EIGHT, q >> _EIGHT, r >> _EIGHT, s >> _EIGHT
    return widest


LARGEST_ACTIVITY = 1023


@kernel
def sample(texel: Any, at: Any) -> Any:
    """The component of a texel in the bits from ``at`` on."""
    return np.int64((texel >> at) & np.uint64(255))


@kernel
def residual(e: Any, context: Any, sink: Any, source: Any, state: Any) -> Any:
    """A `symbol` with a sign: 0, -1, 1, -2, 2 …"""
    z = symbol((e << 1) ^ (e >> 63), context, sink, source, state)
    return (z >> 1) ^ -(z & 1)


@kernel
def _index(activity: Any) -> Any:
    return np.uint64(activity if activity < LARGEST_ACTIVITY else LARGEST_ACTIVITY)


@kernel
def _samples(
    texel: Any, mean: Any, w: Any, n: Any, nw: Any, ne: Any, position: Any, order: Any,
    weights: Any, classes: Any, sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """p, q or r of a block, sample by sample, each predicted from its surroundings."""
    out = np.uint64(0)
    reference = np.int64(0)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        i = sample(mean, at)
        fw, fn = sample(w, at) - i, sample(n, at) - i
        fnw, fne = sample(nw, at) - i, sample(ne, at) - i
        guess = i + (
            (weights[position, 0] * fw + weights[position, 1] * fn + weights[position, 2] * fnw
             + weights[position, 3] * fne + 32) >> 6
        )  # fmt: skip
        activity = abs(fw - fn) + abs(fn - fne) + abs(fw) + abs(fn)
        context = SAMPLE
        if position > 0:
            context += CLASSES
        if c > 0 and c < 3 and order.size > 2:
            guess += reference
            activity = (activity >> 2) + 4 * abs(reference)
            context += 2 * CLASSES
        guess = min(max(guess, 0), 255)
        level = np.int64(classes[_index(activity)])
        e = ((sample(texel, at) - guess + 128) & 255) - 128
        value = (guess + residual(e, context + level, sink, source, state)) & 255
        if c == 0:
            reference = value - guess
        elif c == 1:
            reference += (value - guess) >> 1
        out |= np.uint64(value) << at
    return out


@kernel
def texel(
    position: Any, wanted: Any, seen: Any, mean: Any, w: Any, n: Any, nw: Any, ne: Any,
    context: Any, order: Any, weights: Any, classes: Any, sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """p, q or r of a block."""
    result = seen_texel(wanted, seen, w, n, nw, ne, context, sink, source, state)
    if result == OTHER:
        result = _samples(
            wanted, mean, w, n, nw, ne, position, order, weights, classes, sink, source, state
        )
    return result


@kernel
def remainders(
    s: Any, mean: Any, p: Any, q: Any, r: Any, order: Any, sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """s of a block by the remainder of the sum in each component."""
    out = np.uint64(0)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        a, b, corner = sample(q, at), sample(r, at), sample(p, at)
        base = 4 * sample(mean, at) - a - b - corner
        guess: Any = max(min(a, b), min(max(a, b), a + b - corner)) - base
        kind = 0 if guess < 0 else 1 if guess < 4 else 2
        guess = min(max(guess, 0), 3)
        value = sample(s, at) - base
        z = symbol((value - guess) & 3, REMAINDER + kind, sink, source, state)
        value = base + ((z + guess) & 3)
        if value < 0 or value > 255:
            state[STRAY] = 1
        out |= np.uint64(value & 255) << at
    return out


@kernel
def differences(
    block: Any, mean: Any, around: Any, errors: Any, order: Any, classes: Any, sink: Any,
    source: Any, state: Any,
) -> Any:  # fmt: skip
    """A block by their Haar differences, component by component.

    around: w0, w1, n0, n1 and the means to the east, south, south-west and south-east.
    """
    out0, out1, out2, out3 = np.uint64(0), np.uint64(0), np.uint64(0), np.uint64(0)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        i = sample(mean, at)
        w0, w1 = sample(around[0], at), sample(around[1], at)
        n0, n1 = sample(around[2], at), sample(around[3], at)
        east, south = sample(around[4], at) - i, sample(around[5], at) - i
        tilt = sample(around[7], at) - sample(around[6], at)
        p, q = sample(block[0], at), sample(block[1], at)
        r, s = sample(block[2], at), sample(block[3], at)
        referring = c > 0 and c < 3 and order.size > 2
        if not referring:
            errors[0] = errors[1] = errors[2] = 0
        north, west = n0 + n1 - 2 * i, w0 + w1 - 2 * i
        across, down = n0 - n1, w0 - w1
        calm = abs(north) + abs(west) + abs(across) + abs(down)

        v, h, g = np.int64(0), np.int64(0), np.int64(0)
        for kind in range(3):
            if kind == 0:
                value, reference, activity = p + q - r - s, errors[0], calm + abs(south)
                guess = 88 * north - 50 * south + 176 * down + 220 * reference
            elif kind == 1:
                value, reference, activity = p - q, errors[1], calm + abs(east)
                guess = 46 * west - 22 * east + 93 * across + 240 * reference
            else:
                value, reference, activity = (r - s) >> 1, errors[2], calm + abs(tilt)
                guess = 20 * west - 8 * east - 2 * tilt + 47 * h + 235 * reference
            guess = np.int64((guess + 128) >> 8)
            context: Any = HAAR + kind * CLASSES
            if referring:
                context += 3 * CLASSES
                activity = (activity >> 2) + 3 * abs(reference)
            context += np.int64(classes[_index(activity)])
            e = residual(value - guess, context, sink, source, state)
            if kind == 0:
                v = guess + e
            elif kind == 1:
                h = guess + e
            else:
                g = guess + e
            if c == 0:
                errors[kind] = e

        half = (v + (v & 1)) >> 1
        top = 2 * i + ((h ^ half) & 1) + half
        bottom = top - v
        p = (top + h) >> 1
        q = p - h
        d = 2 * g + (bottom & 1)
        r = (bottom + d) >> 1
        s = r - d
        if (p | q | r | s) & ~255:
            state[STRAY] = 1
        out0 |= np.uint64(p & 255) << at
        out1 |= np.uint64(q & 255) << at
        out2 |= np.uint64(r & 255) << at
        out3 |= np.uint64(s & 255) << at
    return out0, out1, out2, out3


@kernel
def edge_texel(
    texel: Any, seen: Any, w: Any, n: Any, nw: Any, components: Any, sink: Any, source: Any,
    state: Any,
) -> Any:  # fmt: skip
    """A texel that belongs to no block; a new one sample by sample, less the median of W, N and
    W + N - NW.
    """
    result = seen_texel(texel, seen, w, n, nw, nw, TEXEL + 48, sink, source, state)
    if result != OTHER:
        return result
    out = np.uint64(0)
    for c in range(components):
        at = np.uint64(8 * c)
        a, b = sample(w, at), sample(n, at)
        guess = max(min(a, b), min(max(a, b), a + b - sample(nw, at)))
        e = ((sample(texel, at) - guess + 128) & 255) - 128
        out |= np.uint64((guess + residual(e, EDGE, sink, source, state)) & 255) << at
    return out
