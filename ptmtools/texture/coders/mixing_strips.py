"""Compiled loop of the context mixing coder: one vertical strip of one plane of a level.

A strip is 32 blocks wide. Its blocks are walked row by row, the four texels of a block in the order
p q r s. Every texel is predicted by least squares; its residual becomes binary decisions
(`mixing_residuals`), in contexts of what lies around it. One pass serves both directions, so that
encoder and decoder cannot disagree about a prediction. See `mixing` for the planes and the order of
strips, and ``docs/formats/ptm-small.md`` for the format.

Everything here is in integers; `mixing_decisions` has the one part that is not.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ptmtools.jit import inlined_kernel, plain_kernel, prefetch
from ptmtools.texture.coders import mixing_tables as tables
from ptmtools.texture.coders.mixing_decisions import (
    CONFIRMED,
    COUNTERS,
    FEATURES,
    FOUND,
    KINDS,
    MATCHES,
    NODE_ROWS,
    NODES,
    RATE,
    SLOT,
    SURE,
    TARGET,
    WEIGHT_BITS,
    WHERE,
    decide_flat,
    learn,
    look_up,
    predict,
)
from ptmtools.texture.coders.mixing_residuals import BUCKETS, DEEP, code_residual

#: Before arithmetic that 32 bits do not hold.
wide: Any = np.int64

#: Positions of a texel: p q r s of a block, and an edge texel, which belongs to none.
POSITIONS = 5
EDGE = 4
MAGNITUDE = tables.magnitude()
MAGNITUDE_TOP = tables.MAGNITUDE_TOP
MAGNITUDES = tables.MAGNITUDES
#: Levels of the second magnitude of a scale's context.
SECOND = 12
#: Observations that count fully in a mean magnitude: later ones weigh 1/100.
SCALE_COUNT = 99
#: Weight of a sample in the least squares, by the mean magnitude in 1/8: 2^16 / (2 + mean).
IMPORTANCE = np.array([(1 << 19) // (16 + m) for m in range(2048)], np.int32)

# Where the features of the least squares lie, (dy, dx) from the texel or, of parents, in blocks
# from the block. Texels that are not known yet read as their parent.
W, N, NW, NE, WW, NN, NEE = (0, -1), (-1, 0), (-1, -1), (-1, 1), (0, -2), (-2, 0), (-1, 2)
TEXELS_AT = (
    (W, N, NW, NE, (1, -1), WW, NN, NEE),
    (W, N, NW, NE, WW, NEE, NN, (1, -2)),
    (W, N, NW, NE, NN, WW, (1, -1), (-2, 1)),
    (N, NW, NE, WW, NN),
    (W, N, NW, NE, WW, NN),
)
_E, _S, _SE, _SW, _NE = (0, 1), (1, 0), (1, 1), (1, -1), (-1, 1)
PARENTS_AT = (
    (_E, _S, _SE, _SW, _NE),
    (_E, _S, _SE, _NE, _SW),
    (_E, _S, _SE, _SW),
    (_E, _S, _SE),
    (),
)
_COLOUR = ((0, 0), W, N, (0, 1), (1, 0))
COLOUR_AT = (_COLOUR, _COLOUR, _COLOUR, ((0, 0), (1, 0), N, (0, 1)), ((0, 0), W, N))
TEXEL_COUNT = np.array([len(places) for places in TEXELS_AT], np.int64)
PARENT_COUNT = np.array([len(places) for places in PARENTS_AT], np.int64)
COLOUR_COUNT = np.array([len(places) for places in COLOUR_AT], np.int64)


class Canvas(NamedTuple):
    """All planes of a level, one after the other in flat arrays."""

    cells: Any  # int32: texels as decoded (first the parents of all), then residuals (first 0)
    parents: Any  # int32
    flats: Any  # uint8: 1 where a block was coded as equal to its parent
    goal: Any  # int32: the texels to encode; in decoding, anything of that size
    offsets: Any  # (3, 5, 8) int64: `TEXELS_AT`, `PARENTS_AT`, `COLOUR_AT` as flat offsets


class PlaneLayout(NamedTuple):
    """Where a plane lies in the flat arrays."""

    texels: int  # of its first texel, padding apart
    parents: int  # of its first parent
    stride: int  # from a texel to that below
    across: int  # from a parent to that below
    errors: int  # from a texel to its residual
    first: int  # from a texel to the same of the first reference, 0 if there is none
    second: int  # and of the second
    before: int  # from a parent to the same of the first reference


class PlaneState(NamedTuple):
    """The state that a plane learns over the levels; arrays are changed in place."""

    normal: Any  # (5, 24, 24) float64: see `mixing_decisions`
    pending: Any  # (5, 16, 25) int32
    weights: Any  # (5, 24) int32
    seen: Any  # (5, 2) int64
    bias: Any  # (5 * 729,) int32: mean residual by context, 16 fractional bits
    scale: Any  # (5 * 24 * 12, 2) int32: mean magnitude by context, 16 fractional bits; count
    mix: Any  # (rows, 16) int32: weights of the mixer, see `mixing_decisions`
    chances: Any  # (n,) int32
    flat: Any  # (432,) uint32: counters of flat blocks


class LevelTables(NamedTuple):
    """The state that a plane learns for one level only, and scratch space."""

    slots: Any  # (6 * 2^n * 16,) uint32: counters by hashed context
    values: Any  # (3 * 2^n,) int32: last value by hashed context | times confirmed << 8
    notes: Any  # (23,) int64
    x: Any  # (16,) int32
    weighted: Any  # (24, 24) float64
    samples: Any  # (24, 24) float64


@plain_kernel
def _grade(e: int) -> Any:
    """Residual to one of 9 classes: five magnitudes, two signs."""
    a = abs(e)
    return 0 if a == 0 else (1 if e > 0 else 2) + 2 * ((a > 1) + (a > 3) + (a > 8))


@plain_kernel
def _level(a: int) -> Any:
    return MAGNITUDE[min(a, MAGNITUDE_TOP)]


@plain_kernel
def _hash(a: int, b: int, c: int, d: int) -> Any:
    h = (a * 0x2F0B4C47 + b * 0x9E3779B1 + c * 0x85EBCA77 + d * 0xC2B2AE3D) & 0xFFFFFFFF
    h ^= h >> 15
    h = (h * 0x2C1B3C6D) & 0xFFFFFFFF
    return h ^ (h >> 13)


@inlined_kernel
def _gather(
    k: int, t: int, block: int, base: int, refs: int, place: Any, cells: Any, parents: Any,
    offsets: Any, pending: Any, n: int,
) -> Any:  # fmt: skip
    """Features of texel t into the sample pending[k, n]; returns how many there are."""
    count = TEXEL_COUNT[k]
    for i in range(count):
        pending[k, n, i] = cells[t + offsets[0, k, i]] - base
    for i in range(PARENT_COUNT[k]):
        pending[k, n, count + i] = parents[block + offsets[1, k, i]] - base
    count += PARENT_COUNT[k]
    for r in range(refs):
        at = t + (place.first if r == 0 else place.second)
        corner = at - (k >> 1) * place.stride - (k & 1)
        if k < 3:
            under = corner + place.stride
            mean = (cells[corner] + cells[corner + 1] + cells[under] + cells[under + 1]) >> 2
        else:
            mean = wide(cells[at - 1])
        for i in range(COLOUR_COUNT[k]):
            pending[k, n, count + i] = cells[at + offsets[2, k, i]] - mean
        count += COLOUR_COUNT[k]
    return count


@inlined_kernel
def _locate_matches(
    notes: Any, values: Any, k: int, t: int, block: int, refs: int, known: int, v1: int, v2: int,
    place: Any, cells: Any, parents: Any,
) -> None:  # fmt: skip
    """Where in ``values`` the matches of a texel lie; v1, v2: of the references."""
    stride, places = place.stride, values.size // MATCHES
    w, n = wide(cells[t - 1]), wide(cells[t - stride])
    nw, ne = wide(cells[t - stride - 1]), wide(cells[t - stride + 1])
    notes[WHERE] = _hash(7, (w * 256 + n) * 256 + ne, (nw * 256 + v1) * 256 + v2, 0)
    if refs > 0:
        v1w = wide(cells[t + place.first - 1])
        notes[WHERE + 1] = _hash(17, v1 * 256 + v2, v1w * 256 + w, 0)
        notes[WHERE + 2] = _hash(27, v1 * 256 + v2, 0, 0)
    else:
        mean = wide(parents[block])
        east, south = wide(parents[block + 1]), wide(parents[block + place.across])
        first = t - (k >> 1) * stride - (k & 1)
        sides = wide(cells[first - 1]) * 256 + cells[first - stride]
        notes[WHERE + 1] = _hash(17, mean * 65536 + sides, east * 256 + south, k * 131 + known * 4)
        notes[WHERE + 2] = _hash(27, w * 256 + n, ne, k)
    for i in range(MATCHES):
        notes[WHERE + i] = i * places + (notes[WHERE + i] & (places - 1))
        prefetch(values, notes[WHERE + i])


@inlined_kernel
def _activity(cells: Any, e: int, k: int, stride: int) -> Any:
    """Weighted sum of the residuals around the one at e."""
    near = abs(wide(cells[e - stride])) + abs(wide(cells[e - 1]))
    nw, ne = abs(wide(cells[e - stride - 1])), abs(wide(cells[e - stride + 1]))
    if k == 0:
        return 2 * near + nw + ne + abs(cells[e + stride - 1]) + abs(cells[e - 2 * stride])
    if k == 1:
        return 2 * near + nw + ne + abs(cells[e - 2]) + abs(cells[e - stride + 2])
    if k == 3:
        return 2 * near + 2 * nw + ne
    return 2 * near + nw + ne + abs(cells[e - 2]) + abs(cells[e - 2 * stride])


@inlined_kernel
def _magnitude_levels(
    activity: int, t: int, block: int, refs: int, e1: int, e2: int, place: Any, cells: Any,
    parents: Any,
) -> Any:  # fmt: skip
    """The two levels of magnitude, s1 and s2, that choose the scale of the residual."""
    stride, across = place.stride, place.across
    if refs == 0:
        mean = wide(parents[block])
        slope = (
            abs(parents[block + 1] - mean) + abs(parents[block + across] - mean)
            + abs(parents[block - 1] - mean) + abs(parents[block - across] - mean)
        )  # fmt: skip
        return _level(activity), _level(2 * slope) >> 1
    t1 = t + place.first + place.errors
    reference = 2 * abs(e1) if refs == 1 else abs(e1) + abs(e2)
    around = (
        abs(cells[t1 - 1]) + abs(cells[t1 - stride])
        + abs(cells[t1 + stride]) + abs(cells[t1 + 1])
    )  # fmt: skip
    return _level((activity + around) >> 1), _level(2 * reference) >> 1


@inlined_kernel
def _offset(value: int, reference: int, reference_value: int, guess: int) -> Any:
    """How far a neighbour's value, shifted as the reference shifts, lies from the guess."""
    return min(max(value + reference - reference_value - guess, -20), 20)


@inlined_kernel
def _note_offsets(
    notes: Any, k: int, t: int, refs: int, guess: int, size: int, v1: int, v2: int, place: Any,
    cells: Any,
) -> None:  # fmt: skip
    """The contexts of where the neighbours' values lie from the guess."""
    stride, r1 = place.stride, t + place.first
    w, n = wide(cells[t - 1]), wide(cells[t - stride])
    nw, ne = wide(cells[t - stride - 1]), wide(cells[t - stride + 1])
    if refs == 0:
        d_w, d_n = _offset(w, 0, 0, guess), _offset(n, 0, 0, guess)
        d_nw, d_ne = _offset(nw, 0, 0, guess), _offset(ne, 0, 0, guess)
    else:
        d_w = _offset(w, v1, cells[r1 - 1], guess)
        d_n = _offset(n, v1, cells[r1 - stride], guess)
        if refs == 1:
            d_nw = _offset(nw, v1, cells[r1 - stride - 1], guess)
            d_ne = _offset(ne, v1, cells[r1 - stride + 1], guess)
        else:
            r2 = t + place.second
            d_nw = _offset(w, v2, cells[r2 - 1], guess)
            d_ne = _offset(n, v2, cells[r2 - stride], guess)
    notes[4] = _hash(90 + k, d_w * 41 + d_n, size >> 2, 0)
    notes[5] = _hash(110 + k, d_nw * 41 + d_ne, d_w * 41 + d_n, 0)


@inlined_kernel
def _propose(notes: Any, values: Any, lo: int, hi: int) -> Any:
    """The proposals of the matches within lo … hi; which of the first two have one, how surely."""
    matched = 0
    for i in range(MATCHES):
        entry = wide(values[notes[WHERE + i]])
        v, times = entry & 255, entry >> 8
        notes[SURE + i] = times
        if times == 0 or v < lo or v > hi:
            v = wide(-1)
        elif i < 2:
            matched += (1 if i == 0 else 3) * (2 if times > 3 else 1)
        notes[FOUND + i] = v
    return matched


@inlined_kernel
def _confirm(notes: Any, values: Any, v: int) -> None:
    """The matches learn the value of their texel."""
    for i in range(MATCHES):
        at = notes[WHERE + i]
        entry = wide(values[at])
        times = entry >> 8
        if entry & 255 == v and times > 0:
            values[at] = v | min(times + 1, CONFIRMED - 1) << 8
        else:
            values[at] = v | (1 if times < 2 else times >> 2) << 8


@inlined_kernel
def _texel(
    encoding: bool, k: int, t: int, block: int, step: int, refs: int, place: Any,
    cells: Any, parents: Any, goal: Any, offsets: Any, state: Any, tables_: Any, coder: Any,
    buffer: Any,
) -> None:  # fmt: skip
    """Codes texel t, at position k of its block, and learns from it."""
    notes, slots, values = tables_.notes, tables_.slots, tables_.values
    mask, stride = slots.size // (SLOT * COUNTERS) - 1, place.stride
    mean = wide(parents[block])
    w, n = wide(cells[t - 1]), wide(cells[t - stride])
    nw, ne = wide(cells[t - stride - 1]), wide(cells[t - stride + 1])
    base = mean if k < 3 else w
    v1, v2 = wide(0), wide(0)
    if refs > 0:
        v1 = wide(cells[t + place.first])
    if refs > 1:
        v2 = wide(cells[t + place.second])

    # The range that the parent's sum leaves.
    lo, hi, known = wide(0), wide(255), wide(0)
    last = k == 3 and step == 1
    if step == 1 and k < EDGE:
        if k == 1:
            known = w
        elif k == 2:
            known = n + ne
        elif k == 3:
            known = nw + n + w
        rest = 4 * mean - known
        lo, hi = max(rest - 255 * (3 - k), 0), min(rest + 3, 255)

    _locate_matches(notes, values, k, t, block, refs, known, v1, v2, place, cells, parents)
    waiting = state.seen[k, 1]
    features = _gather(
        k, t, block, base, refs, place, cells, parents, offsets, state.pending, waiting
    )

    # Residuals around, and those of other planes here.
    e = t + place.errors
    ew, en, enw = wide(cells[e - 1]), wide(cells[e - stride]), wide(cells[e - stride - 1])
    e1, e2 = wide(0), wide(0)
    if refs > 0:
        e1 = wide(cells[t + place.first + place.errors])
    if refs > 1:
        e2 = wide(cells[t + place.second + place.errors])
    activity = _activity(cells, e, k, stride)
    s1, s2 = _magnitude_levels(activity, t, block, refs, e1, e2, place, cells, parents)

    row = (k * MAGNITUDES + s1) * SECOND + s2
    scale = wide(state.scale[row, 0])
    tilt = ((k * 9 + _grade(ew)) * 9 + _grade(en)) * 9 + (_grade(e1) if refs > 0 else _grade(enw))
    mu = (predict(state.pending, state.weights, k, waiting) + state.bias[tilt]) >> (WEIGHT_BITS - 8)
    mu = min(max(mu + base * 256, -32768), 98304)
    rounded = (mu + 128) >> 8
    m = min(max(rounded, lo), hi)
    # A quotient of integers, rounded down: float64 holds it exactly, and divides faster.
    inverse = wide(4294967296.0 / ((scale * 47186 >> 16) + 1311))
    fraction = min(max((mu - m * 256 + 128) >> 6, 0), 3)
    size = _level((scale * 6) >> 16)

    guess = lo if last else m
    final = 1 if last else 0
    notes[0] = _hash(k, size, fraction, 1)
    if last:
        notes[1] = _hash(20 + k, min(max((mu - lo * 256 + 2560) >> 6, 0), 99), s1 >> 1, 0)
    else:
        notes[1] = _hash(20 + k, tilt, fraction, s1 >> 2)
    if refs > 0:
        notes[2] = _hash(60 + final, guess, v1, v2)
        grades = _grade(e1) * 9 + (_grade(e2) if refs > 1 else _grade(ew))
        notes[3] = _hash(40 + k, grades, s1 >> 2, fraction)
    else:
        notes[2] = _hash(80 + final, guess, w, size >> 3)
        bend = ne - n if k == 1 else wide(parents[block + 1]) - mean
        grades = (_grade(w - nw) * 9 + _grade(n - nw)) * 9 + _grade(bend)
        notes[3] = _hash(40 + k, grades, size >> 1, fraction)
    _note_offsets(notes, k, t, refs, guess, size, v1, v2, place, cells)
    look_up(notes, slots, mask)
    matched = _propose(notes, values, lo, hi)

    deep = DEEP if refs > 0 else len(BUCKETS)
    v = code_residual(
        encoding, wide(goal[t]), m, mu, inverse, lo, hi, step, last, deep, k * NODES,
        NODE_ROWS + s1 * KINDS * 9 + matched, notes, tables_.x, state.mix, state.chances, slots,
        mask, coder, buffer,
    )  # fmt: skip

    cells[t] = v
    cells[e] = v - rounded if k == 3 else v - m
    count = wide(state.scale[row, 1])
    rate = RATE[count] if count < SCALE_COUNT else 655
    state.scale[row, 0] = scale + (((abs(v * 256 - mu) * 256 - scale) * rate) >> 16)
    state.scale[row, 1] = min(count + 1, SCALE_COUNT)
    if k != 3:
        state.bias[tilt] += ((v * 256 - mu) * 655) >> 8
    _confirm(notes, values, v)
    state.pending[k, waiting, TARGET] = v - base
    state.pending[k, waiting, FEATURES] = IMPORTANCE[min(scale >> 13, 2047)]
    learn(
        state.normal, state.pending, state.weights, state.seen, k, features, tables_.weighted,
        tables_.samples,
    )  # fmt: skip


@plain_kernel
def _flat_context(block: int, refs: int, place: Any, parents: Any, flats: Any) -> Any:
    """Context of "this block equals its parent", -1 where this is not coded."""
    mean, across = parents[block], place.across
    same = 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            same += 1 if parents[block + dy * across + dx] == mean else 0
    near = wide(flats[block - 1]) + 2 * wide(flats[block - across])
    if near == 0 and same < 6:
        return -1
    diagonal = wide(flats[block - across - 1]) + 2 * wide(flats[block - across + 1])
    reference = 1 + wide(flats[block + place.before]) if refs > 0 else 0
    return ((near + 4 * diagonal) * 3 + reference) * 9 + same - 1


@plain_kernel
def _is_flat(t: int, mean: int, step: int, stride: int, goal: Any) -> Any:
    for at in (t, t + 1, t + stride, t + stride + 1):
        if abs(goal[at] - mean) > step >> 1:
            return 0
    return 1


@plain_kernel
def code_strip(
    encoding: bool, height: int, width: int, first: int, end: int, step: int, refs: int,
    place: Any, canvas: Any, state: Any, tables_: Any, coder: Any, buffer: Any,
) -> None:  # fmt: skip
    """Block columns first … end - 1 of a plane of height x width texels.

    The strip that ends the level (2 end >= width - 1) takes the edge texels with it: the odd last
    column from the top, then the odd last row from the left.
    """
    cells, parents, flats = canvas.cells, canvas.parents, canvas.flats
    goal, offsets = canvas.goal, canvas.offsets
    stride = place.stride
    across, blocks = end - first, (end - first) * (height >> 1)
    column = height & ~1 if width & 1 else 0
    edges = column + (width if height & 1 else 0) if 2 * end >= width - 1 else 0
    for i in range(blocks + edges):
        if i < blocks:
            by, bx = i // across, first + i % across
            block = place.parents + by * place.across + bx
            corner = place.texels + 2 * by * stride + 2 * bx
            context = _flat_context(block, refs, place, parents, flats)
            if context >= 0:
                flat = 0
                if encoding:
                    flat = _is_flat(corner, parents[block], step, stride, goal)
                flats[block] = decide_flat(encoding, flat, state.flat, context, coder, buffer)
            begin, stop = (0, 4) if flats[block] == 0 else (0, 0)
        else:
            edge = i - blocks
            y, x = (edge, width - 1) if edge < column else (height - 1, edge - column)
            block, corner = place.parents, place.texels + y * stride + x
            begin, stop = EDGE, EDGE + 1
        for k in range(begin, stop):
            t = corner + (k >> 1) * stride + (k & 1) if k < EDGE else corner
            _texel(
                encoding, k, t, block, step, refs, place, cells, parents, goal, offsets, state,
                tables_, coder, buffer,
            )  # fmt: skip
