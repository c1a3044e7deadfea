"""Compiled loops of the `fast` profile: the Haar pass over one group.

One pass serves both directions, so that encoder and decoder cannot disagree about a prediction:
it walks the block rows of a level, predicts the three Haar differences of every block from what
the decoder knows, and either collects the residuals (encoding) or takes them from the rANS stream
and writes the texels (decoding). A whole row of one coefficient is predicted before its first
residual is needed, which lets the compiler use vector instructions and keeps four rANS lanes busy.
The arithmetic is exact in 32-bit integers; the format is specified in ``docs/format-ptm.md``.

Allocating scratch arrays inside the pass was rejected: it added half to the time to compile it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.haar.blocks import (
    read_differences,
    rebuild,
    rebuild_ranked,
    write_row,
)
from ptmtools.texture.coders.haar.contexts import (
    context_g,
    context_h,
    context_v,
    gradient_row,
)
from ptmtools.texture.coders.rans.kernels import (
    ESCAPE,
    STATE_LOW,
    decode_row,
    fill_escapes,
    rotate_states,
    start_states,
)

i32, u16 = np.int32, np.uint16

#: A component with more distinct values than this is not coded by rank.
MANY_VALUES = 225
OK, TRUNCATED, IMPOSSIBLE = 0, 1, 2


class Workspace(NamedTuple):
    """What a pass needs besides its arguments.

    Made outside the compiled code, which is quicker to compile without allocations.
    """

    rows: Any
    gradient: Any
    v: Any
    h: Any
    g: Any
    ev: Any
    eh: Any
    eg: Any
    near_v: Any
    near_h: Any
    near_g: Any
    prediction: Any
    activity: Any
    decoded: Any
    pairs: Any
    mixed: Any
    zeros: Any
    starts: Any
    state: Any


def workspace(blocks: int, components: int, edge: int, activities: int) -> Workspace:
    """For groups ``blocks`` wide, with so many ``edge`` samples and distinct ``activities``."""
    wide = blocks + 2
    # One plane more than there are: its residuals stay 0 and stand for an absent reference.
    more = components + 1
    return Workspace(
        rows=np.zeros((components, 8, blocks + 4), i32),
        gradient=np.zeros((components, 2, blocks), i32),
        v=np.zeros((components, 2, wide), i32),
        h=np.zeros((components, 2, wide), i32),
        g=np.zeros((components, 2, wide), i32),
        ev=np.zeros((more, 2, wide), i32),
        eh=np.zeros((more, 2, wide), i32),
        eg=np.zeros((more, wide), i32),
        near_v=np.zeros((components, wide), i32),
        near_h=np.zeros((components, wide), i32),
        near_g=np.zeros((components, wide), i32),
        prediction=np.zeros(blocks, i32),
        activity=np.zeros(blocks, i32),
        decoded=np.zeros(max(blocks, edge), i32),
        pairs=np.zeros((2, components, blocks), u16),
        mixed=np.zeros(components * blocks, u16),
        zeros=np.zeros(edge, i32),
        starts=np.zeros((3, activities), np.uint64),
        state=np.zeros(4, np.uint64),
    )


@kernel
def _load_row(below: Any, plane: int, y: int, rank: Any, row: Any) -> None:
    """Ranks of row y into ``row`` (width + 4), both ends and y replicated at the border."""
    height, width = below.shape[0], below.shape[1]
    samples = below[min(max(y, 0), height - 1)]
    for x in range(width):
        row[np.uint64(x + 2)] = rank[np.uint64(samples[np.uint64(x), np.uint64(plane)])]
    row[0] = row[1] = row[2]
    row[width + 3] = row[width + 2] = row[width + 1]


@kernel
def _emit(
    values: Any, prediction: Any, activity: Any, classes: Any, first: Any, residual: Any, near: Any,
    symbols: Any, contexts: Any, counts: Any,
) -> None:  # fmt: skip
    """Encoding: residuals of a row, zigzag, with the table each is to be coded by."""
    # Two loops: the first works on several blocks at once.
    for x in range(prediction.size):
        e = i32(values[x + 1] - prediction[x])
        residual[x + 1] = e
        near[x + 1] = abs(e)
        symbols[x] = u16(i32(i32(e << 1) ^ i32(e >> 31)))
    for x in range(prediction.size):
        t = first + classes[np.uint64(activity[x])]
        contexts[x] = t
        counts[np.uint64(t), np.uint64(min(symbols[x], u16(ESCAPE)))] += 1


@kernel
def _absorb(decoded: Any, prediction: Any, residual: Any, near: Any, values: Any) -> None:
    """Decoding: what `_emit` does, the other way round."""
    for x in range(prediction.size):
        z = decoded[x]
        e = i32(i32(z >> 1) ^ i32(-(z & 1)))
        residual[x + 1] = e
        near[x + 1] = abs(e)
        values[x + 1] = i32(e + prediction[x])


@kernel
def _edge_prediction(level: Any, y: int, x: int, plane: int) -> Any:
    """Median of left, upper and left + upper - upper left; what lies outside gives way."""
    left, up, corner = i32(0), i32(0), i32(0)
    if x > 0:
        left = i32(level[y, x - 1, plane])
    if y > 0:
        up = i32(level[y - 1, x, plane])
    if x == 0:
        return up
    if y == 0:
        return left
    corner = i32(level[y - 1, x - 1, plane])
    return max(min(left, up), min(max(left, up), i32(left + up - corner)))


@kernel
def mark_values(level: Any, used: Any) -> None:
    """Which values occur in each component; used: (c, 256) uint8, zeros before.

    Stops where every component has more than `MANY_VALUES`.
    """
    components = level.shape[2]
    for y in range(level.shape[0]):
        row = level[y]
        for x in range(level.shape[1]):
            for c in range(components):
                used[c, row[np.uint64(x), np.uint64(c)]] = 1
        if y & 15 == 15:
            least = 256
            for c in range(components):
                total = 0
                for value in range(256):
                    total += int(used[c, value])
                least = min(least, total)
            if least > MANY_VALUES:
                return


@kernel
def haar_pass(
    encoding: bool, turning: bool, level: Any, flat: Any, below: Any, planes: Any, references: Any,
    weights: Any, activities: Any, classes: Any, ranks: Any, values: Any, tops: Any, symbols: Any,
    contexts: Any, counts: Any, words: Any, limit: int, escapes: Any, table: Any, begins: Any,
    work: Any,
) -> int:  # fmt: skip
    """One group in either direction.

    Parameters
    ----------
    encoding: True reads ``level`` and fills ``symbols``, ``contexts`` and ``counts``; False reads
        ``words``, ``escapes`` and ``table`` and fills ``level``.
    turning: the states take turns from row to row; False in version 1, where each row begins with
        the first.
    level: (h, w, c) uint8; ``flat``: decoding, all its samples in one dimension.
    below: (h >> 1, w >> 1, c) uint8, the level below.
    planes: (c,) int64, the components in coding order.
    references: (c,) int64, how many of the planes coded first each plane's residuals refer to.
    weights: (c, 3, 7) int32 and activities: (c, 3, 7) int32, by plane in coding order.
    classes: (1024,) int64, class of an activity.
    ranks, values: (c, 256) int32, by component: value to rank, rank to value. tops: (c,) int64, the
        highest rank, or 0 where values stand for themselves (``ranks`` is the identity then).
    symbols: (n,) uint16, contexts: (n,) uint8, counts: (2 * classes + 1, 256) int64; decoding,
        (2 * classes + 1, 0).
    words: uint16, the stream, with a row's length and 8 more of padding behind ``limit``.
    escapes: uint16. table: uint32 and begins: (2 * classes + 1,) int64 of `rans.tables.row_tables`.
    work: from `workspace`.

    Returns OK, TRUNCATED (the stream ended early) or IMPOSSIBLE (no encoder writes this).
    """
    bh, bw, nc = below.shape
    per_kind = (counts.shape[0] - 1) // 2
    rows, gradient, state, starts = work.rows, work.gradient, work.state, work.starts
    v, h, g = work.v, work.h, work.g
    ev, eh, eg = work.ev, work.eh, work.eg
    near_v, near_h, near_g = work.near_v, work.near_h, work.near_g
    prediction, activity, decoded = work.prediction, work.activity, work.decoded
    pairs, mixed = work.pairs, work.mixed
    height, width = level.shape[0], level.shape[1]
    tall = 2 * bh if width > 2 * bw else 0
    edge = nc * (tall + (width if height > 2 * bh else 0))
    for j in range(classes.size):
        starts[0, j] = begins[classes[j]]
        starts[1, j] = begins[per_kind + classes[j]]
        starts[2, j] = begins[2 * per_kind]

    # Of one type, or the helpers are compiled once more for the literal 0.
    zero: Any = np.int64(0)
    at, escaped, n = zero, zero, zero
    if not encoding:
        start_states(words, state)
        at = np.int64(8)

    for c in range(nc if below.size else 0):
        for y in range(-2, 2):
            _load_row(below, planes[c], y, ranks[planes[c]], rows[c, y & 7])
    stray = 0
    for y in range(bh + 1):
        now, before = y & 1, 1 - (y & 1)
        for c in range(nc):
            plane = planes[c]
            ref1 = 0 if references[c] > 0 else nc
            ref2 = 1 if references[c] > 1 else nc
            if y < bh:
                _load_row(below, plane, y + 2, ranks[plane], rows[c, (y + 2) & 7])
                gradient_row(
                    rows[c, (y - 1) & 7], rows[c, y & 7], rows[c, (y + 1) & 7], gradient[c, now]
                )
                if encoding:
                    read_differences(level, plane, y, ranks[plane], v[c, now], h[c, now], g[c, now])
                for k in range(2):
                    if k == 0:
                        found, residual, near = v[c, now], ev[c, now], near_v[c]
                        context_v(
                            rows[c], y, gradient[c, now], ev[ref1, now], ev[ref2, now], near,
                            weights[c, 0], activities[c, 0], prediction, activity,
                        )  # fmt: skip
                    else:
                        found, residual, near = h[c, now], eh[c, now], near_h[c]
                        context_h(
                            rows[c], y, gradient[c, now], v[c, now], ev[c, now], eh[ref1, now],
                            eh[ref2, now], near, weights[c, 1], activities[c, 1], prediction,
                            activity,
                        )  # fmt: skip
                    if encoding:
                        _emit(
                            found, prediction, activity, classes, zero, residual, near,
                            symbols[n : n + bw], contexts[n : n + bw], counts,
                        )  # fmt: skip
                        n += bw
                    else:
                        at = decode_row(state, words, at, table, starts[0], activity, bw, decoded)
                        if turning:
                            rotate_states(state, bw)
                        escaped = fill_escapes(decoded, bw, escapes, escaped)
                        if at > limit or escaped < 0:
                            return TRUNCATED
                        _absorb(decoded, prediction, residual, near, found)
            else:
                for x in range(bw + 2):
                    h[c, now, x] = h[c, before, x]
                    eh[c, now, x] = 0
            if y > 0:
                context_g(
                    rows[c], y - 1, gradient[c, before], v[c, before], h[c, before], h[c, now],
                    ev[c, before], eh[c, before], eh[c, now], eg[ref1], eg[ref2], near_g[c],
                    weights[c, 2], activities[c, 2], prediction, activity,
                )  # fmt: skip
                if encoding:
                    _emit(
                        g[c, before], prediction, activity, classes, per_kind, eg[c], near_g[c],
                        symbols[n : n + bw], contexts[n : n + bw], counts,
                    )  # fmt: skip
                    n += bw
                else:
                    at = decode_row(state, words, at, table, starts[1], activity, bw, decoded)
                    if turning:
                        rotate_states(state, bw)
                    escaped = fill_escapes(decoded, bw, escapes, escaped)
                    if at > limit or escaped < 0:
                        return TRUNCATED
                    _absorb(decoded, prediction, eg[c], near_g[c], g[c, before])
                    upper, lower = pairs[0, plane], pairs[1, plane]
                    if tops[plane] > 0:
                        stray |= rebuild_ranked(
                            below[y - 1], ranks[plane], values[plane], tops[plane], v[c, before],
                            h[c, before], g[c, before], plane, upper, lower,
                        )  # fmt: skip
                    else:
                        stray |= rebuild(
                            rows[c, (y - 1) & 7],
                            v[c, before],
                            h[c, before],
                            g[c, before],
                            upper,
                            lower,
                        )
        if y > 0 and not encoding:
            for i in range(2):
                begin = (2 * y - 2 + i) * width * nc
                write_row(pairs[i], mixed, flat[begin : begin + 2 * bw * nc])
    if edge:
        # The odd last column, then the odd last row: modulo 256, so nothing can escape.
        if not encoding:
            at = decode_row(state, words, at, table, starts[2], work.zeros, edge, decoded)
            if at > limit:
                return TRUNCATED
        i = 0
        for j in range(edge // nc):
            y, x = (j, width - 1) if j < tall else (height - 1, j - tall)
            for plane in range(nc):
                guess = _edge_prediction(level, y, x, plane)
                if encoding:
                    e = i32(i32(i32(i32(level[y, x, plane]) - guess + 128) & 255) - 128)
                    z = i32(i32(e << 1) ^ i32(e >> 31))
                    symbols[n + i] = z
                    contexts[n + i] = 2 * per_kind
                    counts[2 * per_kind, z] += 1
                else:
                    z = decoded[i]
                    level[y, x, plane] = (guess + ((z >> 1) ^ -(z & 1))) & 255
                i += 1
    if encoding:
        return OK
    for lane in range(4):
        stray |= state[lane] != STATE_LOW
    return IMPOSSIBLE if stray or at != limit or escaped != escapes.size else OK
