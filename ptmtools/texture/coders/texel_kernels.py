"""Compiled loop of the texel coder: one pass over a group in either direction.

The pass walks the blocks of a level row by row; in a block the planes in coding order, in a plane
the texels p, q, r, s. Each texel is predicted from the level below and from what was decoded before
it; the residual becomes a token (coded with rANS by a table that the residuals around it choose)
and plain bits. Encoder and decoder share all of it, so they cannot disagree about a prediction.

Everything is exact: integers below 2^53, and for the range of the fourth texel of floats additions
and multiplications of float64 in a fixed order. The format is specified in
``docs/formats/ptm-kinds.md``.

A whole row at a time, as in the Haar coder, was rejected: it must do without the texels to the
left, and a texel at a time is fast enough for what is not 8 bits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ptmtools.jit import inlined_kernel, kernel
from ptmtools.texture.coders.group import ESCAPE, IMPOSSIBLE, OK, TRUNCATED
from ptmtools.texture.coders.rans_kernels import STATE_LOW, decode_single, start_states

#: Rule for the fourth texel from the others: none, as integers, as floats of 16, 32 bits.
FREE, WHOLE, HALF, SINGLE = 0, 1, 2, 3
#: Texels of the work plane outside the level: above and left, below and right.
BEFORE, BEHIND = 2, 3
#: Neighbours that a prediction looks at, besides the planes coded before.
FEATURES = 10
#: Fractional bits of weights.
WEIGHT_BITS = 12
HALF_WEIGHT = 1 << (WEIGHT_BITS - 1)
#: Classes of activity: none, then one for each doubling.
CLASSES = 18
#: Tables: for planes of no, one, two references those of p, of q, of r, of s; then those of a
#: fourth texel of few possible values, by their number and by four grades of activity; those of
#: flags for low bits of 0, by the flags before.
NARROW = 12 * CLASSES
GRID = NARROW + 16
TABLES = GRID + 4
#: Ranges of at most this number of values are narrow.
NARROW_TOP = 16
#: Numbers below this are tokens; above it a token has the leading three bits, the rest is plain.
DIRECT = 16
#: Plain bits of the longest number.
PLAIN_TOP = 30
_ZERO, _ONE, _TWO, _THREE = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3)
_SIX, _TEN, _ELEVEN, _TWELVE = np.uint64(6), np.uint64(10), np.uint64(11), np.uint64(12)


class TexelSource(NamedTuple):
    """A decoder's source of symbols."""

    words: Any  # uint16, and
    escapes: Any  # uint16: as in `rans.Stream`
    table: Any  # uint32 of `rans.single_tables`


class TexelWorkspace(NamedTuple):
    """Scratch arrays of a pass, allocated outside, which compiles faster."""

    errors: Any
    residual: Any
    range: Any
    grid: Any
    state: Any


def workspace(width: int, components: int) -> TexelWorkspace:
    """Allocates the workspace of groups ``width`` texels wide."""
    return TexelWorkspace(
        errors=np.zeros(components * 4 * (width + BEFORE + BEHIND), np.int64),
        # One additional plane, which stays 0, stands for an absent reference.
        residual=np.zeros((components + 1) * 4, np.int64),
        range=np.zeros(2, np.int64),
        grid=np.zeros(components, np.int64),
        state=np.zeros(4, np.uint64),
    )


@kernel
def _bit_length(n: Any) -> Any:
    """Bit length of 0 … 2^53 - 1, from the exponent of a float64; 0 for 0."""
    return (np.float64(n).view(np.int64) >> 52) - 1022 if n > 0 else np.int64(0)


@kernel
def float_value(number: Any, kind: int) -> Any:
    """The float that an ordered integer stands for, as float64."""
    if kind == SINGLE:
        single = np.uint32(number ^ 0x80000000 if number & 0x80000000 else ~number)
        return np.float64(single.view(np.float32))
    bits = np.int64(number ^ 0x8000 if number & 0x8000 else ~number & 0xFFFF)
    exponent, mantissa = (bits >> 10) & 31, bits & 1023
    if exponent == 31:
        value = np.inf if mantissa == 0 else np.nan
    elif exponent == 0:
        value = mantissa / 16777216.0
    else:
        value = ((1024 + mantissa) << (exponent - 1)) / 16777216.0
    return -value if bits & 0x8000 else value


@kernel
def ordered_value(value: Any, kind: int) -> Any:
    """The ordered integer of a float64, no NaN, rounded to the kind, half to even."""
    if kind == SINGLE:
        bits = np.int64(np.float32(value).view(np.uint32))
        return bits ^ 0xFFFFFFFF if bits & 0x80000000 else bits | 0x80000000
    negative = np.float64(value).view(np.int64) < 0
    size = min(abs(value), 131008.0) * 16777216.0
    # Halves are whole multiples of 2^-24, those of an exponent of 2^shift times that.
    shift = max(_bit_length(np.int64(size)) - 11, np.int64(0))
    scale = np.float64(np.int64(1) << shift)
    bits = np.int64(size / scale)
    rest = size - bits * scale
    if rest * 2 > scale or (rest * 2 == scale and bits & 1):
        bits += 1
    bits = min(bits + (shift << 10), np.int64(0x7C00))
    return 0x7FFF - bits if negative else 0x8000 + bits


@kernel
def _unit(value: Any, kind: int) -> Any:
    """The unit in the last place of a float of that kind, finite, given as float64."""
    least, mantissa = (-126, 23) if kind == SINGLE else (-14, 10)
    exponent: Any = ((np.float64(value).view(np.int64) >> 52) & 2047) - 1023
    return np.int64((max(exponent, least) - mantissa + 1023) << 52).view(np.float64)


@kernel
def _value(number: Any, plane: int, numbering: Any) -> Any:
    """The ordered value with that number."""
    step = numbering.steps[plane]
    if step == 0:
        return numbering.lists[plane, number]
    return numbering.offsets[plane] + np.int64(number) * step


@kernel
def _numbers_below(bound: Any, plane: int, numbering: Any, top: Any) -> Any:
    """How many values of a plane are below ``bound``."""
    step = numbering.steps[plane]
    if step > 0:
        rest = bound - numbering.offsets[plane]
        if step > 1:
            rest = (rest + step - 1) // step
        return min(max(rest, np.int64(0)), top + 1)
    low, high = np.int64(0), top + 1
    while low < high:
        middle = (low + high) >> 1
        if numbering.lists[plane, middle] < bound:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def _last_range(
    p: Any, q: Any, r: Any, mean: Any, kind: int, plane: int, numbering: Any, top: Any, out: Any,
) -> None:  # fmt: skip
    """Lowest and highest number of s, given the values p, q, r and the mean of the block."""
    low, high = np.int64(0), np.int64(0xFFFFFFFF)
    if kind == WHOLE:
        low = 4 * mean - p - q - r
        high = low + 3
    else:
        a, b, c = float_value(p, kind), float_value(q, kind), float_value(r, kind)
        m = float_value(mean, kind)
        value = 4.0 * m - ((a + b) + c)
        if abs(value) < np.inf:
            # The mean is off by half a unit of its last place, the sum by a few of float64's.
            unit = _unit(m, kind)
            margin = 2.0 * unit + (4.0 * abs(m) + ((abs(a) + abs(b)) + abs(c))) * 2.0**-50
            low, high = ordered_value(value - margin, kind), ordered_value(value + margin, kind)
    out[0] = _numbers_below(low, plane, numbering, top)
    out[1] = _numbers_below(high + 1, plane, numbering, top) - 1


@kernel
def _fold(number: Any, guess: Any, low: Any, high: Any) -> Any:
    """number in low … high as 0 … high - low: those nearest to the guess first."""
    e = number - guess
    near = min(guess - low, high - guess)
    if abs(e) > near:
        return abs(e) + near
    return 2 * e if e >= 0 else -2 * e - 1


@kernel
def _unfold(z: Any, guess: Any, low: Any, high: Any) -> Any:
    """The inverse of `_fold`; outside low … high for a z that it does not make."""
    near = min(guess - low, high - guess)
    beyond = z - near if guess - low == near else near - z
    return guess + (beyond if z > 2 * near else (z >> 1) ^ -(z & 1))


@kernel
def _next_symbol(state: Any, n: Any, words: Any, at: Any, table: Any, context: Any) -> Any:
    """The symbol number n of the stream, and the next word's index."""
    z, refill = decode_single(table, context, state, n & np.uint64(3), words[at])
    return z, at + np.uint64(1 if refill else 0)


@inlined_kernel
def _weigh(
    work: Any, place: Any, around: Any, nearest: Any, base: Any, weights: Any, w: Any,
) -> Any:  # fmt: skip
    """Σ weight · (neighbour - base) over the ten neighbours, and Σ |neighbour - base| over the
    first six; ``nearest`` and ``w``: of the first in ``around`` and ``weights``."""
    total, slope = np.int64(0), np.int64(0)
    j = _ZERO
    while j < _SIX:
        f = np.int64(work[place + around[nearest + j]]) - base
        total += weights[w + j] * f
        slope += abs(f)
        j += _ONE
    while j < _TEN:
        total += weights[w + j] * (np.int64(work[place + around[nearest + j]]) - base)
        j += _ONE
    return total, slope


@inlined_kernel
def _activity(
    errors: Any, row: Any, up: Any, k: Any, slope: Any, count: Any, e1: Any, e2: Any,
) -> Any:  # fmt: skip
    """How large an error is to be expected, in sixteenths, from those around and of references."""
    # Right of s and above it, p of the next block is not known yet.
    activity = errors[up + _THREE] if k < 3 else errors[row + _ONE]
    activity += 2 * (errors[row + _ONE] + errors[up + _TWO]) + errors[up + _ONE]
    if count == 0:
        activity = 16 * activity + 2 * slope
    elif count == 1:
        activity = 8 * activity + slope + 16 * abs(e1)
    else:
        activity = 8 * activity + slope + 8 * abs(e1) + 24 * abs(e2)
    return activity


@inlined_kernel
def _context(activity: Any, narrow: bool, size: Any, window: Any, count: Any, k: Any) -> Any:
    """The table of a token; ``size``: the highest number, if it is ``narrow``."""
    if narrow:
        grade = min((_bit_length(activity >> 4) + 1) >> 1, np.int64(3))
        return NARROW + 4 * (_bit_length(size) - 1) + grade
    context = CLASSES * (4 * count + k)
    if activity > 0:
        octave = _bit_length(activity) - window
        context += min(max(octave, np.int64(1)), np.int64(CLASSES - 1))
    return context


@inlined_kernel
def _put_number(z: Any, plain: Any, bit: Any) -> Any:
    """The token of a number, whose rest is written at ``bit``; the next bit."""
    token = z
    if z >= DIRECT:
        bits = _bit_length(z) - 3
        token = DIRECT + 4 * (bits - 2) + ((z >> bits) & 3)
        rest = z & ((np.int64(1) << bits) - 1)
        i, skip = bit >> 5, bit & 31
        plain[i] |= np.uint32((rest << skip) & 0xFFFFFFFF)
        plain[i + 1] |= np.uint32(rest >> (32 - skip))
        bit += bits
    return token, bit


@inlined_kernel
def _take_number(token: Any, plain: Any, bit: Any) -> Any:
    """The inverse of `_put_number`: the number, and the next bit or -1 for an impossible token."""
    # Without branches, which would be guessed wrong often.
    bits = max((token - (DIRECT - 8)) >> 2, np.int64(0)) if token >= DIRECT else 0
    if bits > PLAIN_TOP:
        return token, np.int64(-1)
    word, skip = np.uint64(bit >> 5), np.uint64(bit & 31)
    both = np.uint64(plain[word]) | np.uint64(plain[word + _ONE]) << np.uint64(32)
    rest = np.int64(both >> skip) & ((np.int64(1) << bits) - 1)
    z = (((4 + (token & 3)) << bits) | rest) if token >= DIRECT else token
    return z, bit + bits


@kernel
def texel_pass(
    encoding: bool, level: Any, means: Any, work: Any, stride: int, near: Any, kind: int,
    planes: Any, references: Any, weights: Any, around: Any, numbering: Any, window: Any,
    sink: Any, source: Any, plain: Any, limits: Any, space: Any,
) -> int:  # fmt: skip
    """One group in either direction.

    Parameters
    ----------
    encoding: True reads ``level`` and fills ``sink`` and ``plain``, and leaves in ``limits`` how
        many symbols and plain bits there are; False reads ``source`` and ``plain``.
    level: (h, w, c) uint32, numbers of the values; written when decoding, and when encoding with
        an error.
    means: (h >> 1, w >> 1, c) uint32, ordered values of the level below; not empty.
    work: (c * rows * stride,) uint32, numbers of the level below at twice its size, with
        a frame; overwritten with the texels as they become known.
    near: the error allowed. kind: FREE, WHOLE, HALF, SINGLE.
    planes, references: (c,) int64, in coding order. weights: (c * 4 * 12,) int64, in coding order.
    around: (4 * 10,) uint64, offsets in ``work`` of the neighbours of p, q, r, s, modulo 2^64.
    numbering: `texel_layout.NumberingArrays`.
    window: doublings of activity that are one class at the low end.
    sink: `rans.Sink`, for n or with grids 2 * n symbols. source: `TexelSource`.
    plain: uint32 words of plain bits, with padding for a row of blocks.
    limits: (2,) int64, decoding: numbers of words and of plain bits.
    space: from `workspace`.

    Returns OK, TRUNCATED (the stream ended early) or IMPOSSIBLE (no encoder writes this).
    """
    height, width, nc = level.shape
    bh, bw = height >> 1, width >> 1
    errors, residual, state = space.errors, space.residual, space.state
    symbols, contexts, counts = sink.symbols, sink.contexts, sink.counts
    words, escapes, table = source.words, source.escapes, source.table
    # Indices are unsigned (numba need not look for negative ones) and arrays flat: a slice made in
    # the inner loop would cost more than its use.
    wide = np.uint64(width + BEFORE + BEHIND)
    size = np.uint64(work.size // nc)
    step = 2 * near + 1
    scale = _bit_length(step) - 1
    n, escaped, bit = np.uint64(0), np.int64(0), np.int64(0)
    at = np.uint64(8)
    if not encoding:
        start_states(words, state)
    for y in range((height + 1) >> 1):
        if not encoding and (np.int64(at) > limits[0] or bit > limits[1]):
            return TRUNCATED
        for x in range((width + 1) >> 1):
            whole = y < bh and x < bw
            for c in range(nc):
                plane = planes[c]
                pu = np.uint64(plane)
                count = references[c]
                place = pu * size
                place += np.uint64((2 * y + BEFORE) * stride + 2 * x + BEFORE)
                base_row = np.uint64(4 * c)
                first = _ZERO if count > 0 else np.uint64(4 * nc)
                second = np.uint64(4) if count > 1 else np.uint64(4 * nc)
                top, grid = numbering.tops[pu], numbering.grids[pu]
                for k in range(4):
                    py, px = 2 * y + (k >> 1), 2 * x + (k & 1)
                    if not whole and (py >= height or px >= width):
                        continue
                    ku = np.uint64(k)
                    # Until it is known, a texel reads as the one below it.
                    t = place + np.uint64((k >> 1) * stride + (k & 1))
                    base = np.int64(work[t])
                    w = _TWELVE * (base_row + ku)
                    e1, e2 = residual[first + ku], residual[second + ku]
                    total, slope = _weigh(work, place, around, _TEN * ku, base, weights, w)
                    total += weights[w + _TEN] * e1 + weights[w + _ELEVEN] * e2 + HALF_WEIGHT
                    guess = min(max(base + (total >> WEIGHT_BITS), np.int64(0)), top)
                    row = np.uint64(4 * plane + (py & 3)) * wide + np.uint64(px)
                    up = np.uint64(4 * plane + ((py - 1) & 3)) * wide + np.uint64(px)
                    activity = _activity(errors, row, up, k, slope, count, e1, e2) >> scale
                    low, high, target = np.int64(0), top, guess
                    last = k == 3 and whole and kind != FREE
                    if last:
                        p, q = work[place], work[place + _ONE]
                        _last_range(
                            _value(p, plane, numbering),
                            _value(q, plane, numbering),
                            _value(work[t - _ONE], plane, numbering),
                            np.int64(means[np.uint64(y), np.uint64(x), pu]), kind, plane,
                            numbering, top, space.range,
                        )  # fmt: skip
                        low, high = space.range[0], space.range[1]
                        if low > high:
                            return IMPOSSIBLE
                        target = min(max(guess, low), high)
                    shift = np.int64(0)
                    if grid > 0:
                        # For a whole multiple, all that follows counts multiples.
                        shift = grid
                        rest = (np.int64(1) << shift) - 1
                        context = (
                            GRID + 2 * space.grid[pu] + (space.grid[planes[0]] if c > 0 else 0)
                        )
                        off = np.int64(1)
                        if (low + rest) >> shift <= high >> shift:
                            if encoding:
                                off = np.int64(
                                    1 if level[np.uint64(py), np.uint64(px), pu] & rest else 0
                                )
                                symbols[n] = off
                                contexts[n] = context
                                counts[context, off] += 1
                            else:
                                off, at = _next_symbol(state, n, words, at, table, context)
                                off &= 1
                            n += _ONE
                        space.grid[pu] = off
                        if off:
                            shift = np.int64(0)
                        else:
                            low, high = (low + rest) >> shift, high >> shift
                            target = min(max((target + (rest >> 1)) >> shift, low), high)
                            activity >>= shift
                    narrow = last and high - low < NARROW_TOP
                    context = _context(activity, narrow, high - low, window, count, k)
                    z = np.int64(0)
                    if high > low and encoding:
                        number = np.int64(level[np.uint64(py), np.uint64(px), pu]) >> shift
                        if near > 0:
                            e = number - target
                            e = (e + near) // step if e >= 0 else -((near - e) // step)
                            z = 2 * e if e >= 0 else -2 * e - 1
                        else:
                            if number < low or number > high:
                                return IMPOSSIBLE
                            z = _fold(number, target, low, high)
                        token, bit = _put_number(z, plain, bit)
                        symbols[n] = token
                        contexts[n] = context
                        counts[context, token] += 1
                        n += _ONE
                    elif high > low:
                        z, at = _next_symbol(state, n, words, at, table, context)
                        n += _ONE
                        if z == ESCAPE:
                            if escaped == escapes.size:
                                return TRUNCATED
                            z = np.int64(escapes[escaped])
                            escaped += 1
                        z, bit = _take_number(z, plain, bit)
                        if bit < 0:
                            return IMPOSSIBLE
                    if near > 0:
                        e = (z >> 1) ^ -(z & 1)
                        number = min(max(target + e * step, np.int64(0)), top)
                    else:
                        number = _unfold(z, target, low, high)
                        if number < low or number > high:
                            return IMPOSSIBLE
                        number <<= shift
                    if near > 0 or not encoding:
                        level[np.uint64(py), np.uint64(px), pu] = number
                    work[t] = number
                    residual[base_row + ku] = number - guess
                    errors[row + _TWO] = abs(number - guess)
    if encoding:
        limits[0], limits[1] = np.int64(n), bit
        return OK
    stray = np.int64(at) != limits[0] or (bit + 7) >> 3 != limits[1] >> 3
    stray |= escaped != escapes.size
    for lane in range(4):
        stray |= state[np.uint64(lane)] != np.uint64(STATE_LOW)
    return IMPOSSIBLE if stray else OK
