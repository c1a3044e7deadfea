"""Compiled loops of the `fast` profile: the Haar pass over one group.

One pass serves both directions, so that encoder and decoder cannot disagree about a prediction:
it walks the block rows of a level, predicts the three Haar differences of every block from what
the decoder knows, and either collects the residuals (encoding) or takes them from the rANS stream
and writes the texels (decoding). A whole row of one coefficient is predicted before its first
residual is needed, which lets the compiler use vector instructions and keeps four rANS lanes busy.
The arithmetic is exact in 32-bit integers; the format is specified in ``docs/formats/ptm.md``.

Allocating scratch arrays inside the pass was rejected: it added half to the time to compile it.

Rows of texels become rows of Haar differences, and back.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ptmtools.jit import plain_kernel as kernel
from ptmtools.texture.coders.group import ESCAPE, IMPOSSIBLE, OK, TRUNCATED
from ptmtools.texture.coders.haar_contexts import context_g, context_h, context_v, gradient_row
from ptmtools.texture.coders.haar_layout import CLASSES, EDGE_TABLE
from ptmtools.texture.coders.rans_kernels import (
    STATE_LOW,
    decode_row,
    fill_escapes,
    rotate_states,
    start_states,
)

i32, u16 = np.int32, np.uint16


@kernel
def read_differences(level: Any, plane: int, y: int, rank: Any, v: Any, h: Any, g: Any) -> None:
    """V, h1 and h2' of block row y, from the ranks of the texels."""
    upper, lower = level[2 * y], level[2 * y + 1]
    c = np.uint64(plane)
    for x in range(v.size - 2):
        even, odd = np.uint64(2 * x), np.uint64(2 * x + 1)
        p, q = rank[np.uint64(upper[even, c])], rank[np.uint64(upper[odd, c])]
        r, s = rank[np.uint64(lower[even, c])], rank[np.uint64(lower[odd, c])]
        v[x + 1] = i32(p + q - r - s)
        h[x + 1] = i32(p - q)
        g[x + 1] = i32(r - s) >> 1


@kernel
def rebuild(row: Any, v: Any, h: Any, g: Any, upper: Any, lower: Any) -> int:
    """Two rows of texels of a plane from their differences, two texels to a number, the left one
    in the low byte; returns bits outside a byte, if any were set.
    """
    stray = i32(0)
    for x in range(row.size - 4):
        vx, hx = v[x + 1], h[x + 1]
        t = i32(i32(vx + (vx & 1)) >> 1)
        top = i32(2 * row[x + 2] + ((hx ^ t) & 1) + t)
        bottom = i32(top - vx)
        p = i32(i32(top + hx) >> 1)
        q = i32(p - hx)
        d = i32(2 * g[x + 1] + (bottom & 1))
        r = i32(i32(bottom + d) >> 1)
        s = i32(r - d)
        stray |= p | q | r | s
        upper[x] = u16(i32((p & 255) | i32(q << 8)))
        lower[x] = u16(i32((r & 255) | i32(s << 8)))
    return int(stray & ~255)


@kernel
def rebuild_ranked(
    below: Any, rank: Any, value: Any, top: int, v: Any, h: Any, g: Any, plane: int, upper: Any,
    lower: Any,
) -> int:  # fmt: skip
    """As `rebuild`, for a plane whose differences are those of ranks 0 … ``top``.

    The differences fix the four ranks up to a common shift; each step of it raises the sum of the
    four values by at least 4, so exactly one leaves a remainder of 0 … 3 over the texel of
    ``below``, a row. Returns nonzero if there is none.
    """
    stray = 0
    for x in range(v.size - 2):
        vx, hx = v[x + 1], h[x + 1]
        dr = 2 * g[x + 1] + ((vx ^ hx) & 1)
        dp = (dr + vx + hx) >> 1
        dq = dp - hx
        least = max(0, -min(dp, dq, dr))
        highest = top - max(0, max(dp, dq, dr))
        if least > highest:
            upper[x] = lower[x] = 0
            stray = 1
            continue
        wanted = 4 * np.int64(below[x, plane])
        u = rank[below[x, plane]] - ((dp + dq + dr + 2) >> 2)
        u = min(max(u, least), highest)
        total = value[u] + value[u + dp] + value[u + dq] + value[u + dr]
        while total < wanted and u < highest:
            u += 1
            total = value[u] + value[u + dp] + value[u + dq] + value[u + dr]
        while total > wanted + 3 and u > least:
            u -= 1
            total = value[u] + value[u + dp] + value[u + dq] + value[u + dr]
        if total < wanted or total > wanted + 3:
            stray = 1
        upper[x] = value[u + dp] | value[u + dq] << 8
        lower[x] = value[u + dr] | value[u] << 8
    return stray


@kernel
def _interleave(planes: Any, out: Any) -> None:
    """Rows of (c, n) pairs of texels, from `rebuild`, as one row of texels: n * c pairs of bytes.

    Spelled out for each c: bytes moved one by one take five times as long.
    """
    low, high, eight = u16(255), u16(0xFF00), u16(8)
    count = planes.shape[0]
    a = planes[0]
    if count == 1:
        for x in range(a.size):
            out[x] = a[x]
    elif count == 2:
        b = planes[1]
        for x in range(a.size):
            out[2 * x] = u16((a[x] & low) | u16(b[x] << eight))
            out[2 * x + 1] = u16(u16(a[x] >> eight) | (b[x] & high))
    elif count == 3:
        b, c = planes[1], planes[2]
        for x in range(a.size):
            out[3 * x] = u16((a[x] & low) | u16(b[x] << eight))
            out[3 * x + 1] = u16((c[x] & low) | (a[x] & high))
            out[3 * x + 2] = u16(u16(b[x] >> eight) | (c[x] & high))
    else:
        b, c, d = planes[1], planes[2], planes[3]
        for x in range(a.size):
            out[4 * x] = u16((a[x] & low) | u16(b[x] << eight))
            out[4 * x + 1] = u16((c[x] & low) | u16(d[x] << eight))
            out[4 * x + 2] = u16(u16(a[x] >> eight) | (b[x] & high))
            out[4 * x + 3] = u16(u16(c[x] >> eight) | (d[x] & high))


@kernel
def write_row(planes: Any, pairs: Any, row: Any) -> None:
    """A row of texels (bytes) from its planes, by way of ``pairs``."""
    _interleave(planes, pairs)
    for x in range(pairs.size):
        pair = pairs[x]
        row[2 * x] = pair & u16(255)
        row[2 * x + 1] = pair >> u16(8)


i32, u16 = np.int32, np.uint16

#: A component with more distinct values than this is not coded by rank.
MANY_VALUES = 225


class HaarWorkspace(NamedTuple):
    """Scratch arrays of a pass, allocated outside, so that no compiled code allocates.

    Coefficients are numbered: V, h1, h2'. Pairs of rows are block row y and block row y - 1.
    """

    rows: Any  # (c, 8, blocks + 4) int32: ranks of the level below
    gradient: Any  # (c, 2, blocks) int32
    differences: Any  # (3, c, 2, blocks + 2) int32
    residuals: Any  # (3, c + 1, 2, blocks + 2) int32: those of plane c stay 0, for no reference
    near: Any  # (3, c, blocks + 2) int32: magnitudes of the residuals above
    prediction: Any  # (blocks,) int32
    activity: Any  # (blocks,) int32


class HaarSource(NamedTuple):
    """A decoder's source of symbols, and the tables that turn them into texels."""

    words: Any  # uint16, the stream, with a row's length and 8 more of padding behind `limit`
    limit: Any
    escapes: Any  # uint16
    table: Any  # uint32 of `rans.row_tables`
    starts: Any  # (3, 1024) uint64: where the tables begin, by activity, of V and h1, h2', edges
    turning: Any  # the states take turns from row to row; in version 1 each row begins anew
    values: Any  # (c, 256) int32, by component: rank to value
    tops: Any  # (c,) int64: the highest rank, 0 where values stand for themselves
    flat: Any  # all samples of the level in one dimension
    state: Any  # (4,) uint64
    decoded: Any  # int32, a row or the edge
    zeros: Any  # int32, likewise
    pairs: Any  # (2, c, blocks) uint16
    mixed: Any  # (c * blocks,) uint16


def workspace(blocks: int, components: int) -> HaarWorkspace:
    """Allocates the workspace of groups ``blocks`` wide."""
    wide = blocks + 2
    return HaarWorkspace(
        rows=np.zeros((components, 8, blocks + 4), i32),
        gradient=np.zeros((components, 2, blocks), i32),
        differences=np.zeros((3, components, 2, wide), i32),
        residuals=np.zeros((3, components + 1, 2, wide), i32),
        near=np.zeros((3, components, wide), i32),
        prediction=np.zeros(blocks, i32),
        activity=np.zeros(blocks, i32),
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
    """Decoding: the inverse of `_emit`."""
    for x in range(prediction.size):
        z = decoded[x]
        e = i32(i32(z >> 1) ^ i32(-(z & 1)))
        residual[x + 1] = e
        near[x + 1] = abs(e)
        values[x + 1] = i32(e + prediction[x])


@kernel
def _edge_prediction(level: Any, y: int, x: int, plane: int) -> Any:
    """Median of left, upper and left + upper - upper left; a neighbour outside is replaced by one
    inside."""
    if x == 0:
        return i32(level[y - 1, x, plane]) if y > 0 else i32(0)
    west = i32(level[y, x - 1, plane])
    if y == 0:
        return west
    north, corner = i32(level[y - 1, x, plane]), i32(level[y - 1, x - 1, plane])
    return max(min(west, north), min(max(west, north), i32(west + north - corner)))


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
    level: Any, below: Any, planes: Any, references: Any, weights: Any, activities: Any,
    classes: Any, ranks: Any, sink: Any, source: Any, work: Any,
) -> int:  # fmt: skip
    """One group in either direction: of ``sink`` and ``source`` one is None.

    Each direction is compiled on its own, without what only the other one needs.

    Parameters
    ----------
    level: (h, w, c) uint8. below: (h >> 1, w >> 1, c) uint8, the level below.
    planes: (c,) int64, the components in coding order.
    references: (c,) int64, how many of the planes coded first each plane's residuals refer to.
    weights: (c, 3, 7) int32 and activities: (c, 3, 7) int32, by plane in coding order.
    classes: (1024,) int64, class of an activity.
    ranks: (c, 256) int32, by component: value to rank.

    Returns OK, TRUNCATED (the stream ended early) or IMPOSSIBLE (no encoder writes this).
    """
    bh, bw, nc = below.shape
    prediction, activity = work.prediction, work.activity
    height, width = level.shape[0], level.shape[1]
    tall = 2 * bh if width > 2 * bw else 0
    edge = nc * (tall + (width if height > 2 * bh else 0))
    # Of one type, or the helpers are compiled once more for the literal 0.
    zero: Any = np.int64(0)
    at, escaped, n = zero, zero, zero
    if source is not None:
        start_states(source.words, source.state)
        at = np.int64(8)

    for c in range(nc if below.size else 0):
        for y in range(-2, 2):
            _load_row(below, planes[c], y, ranks[planes[c]], work.rows[c, y & 7])
    stray = 0
    for y in range(bh + 1):
        now, before = y & 1, 1 - (y & 1)
        for c in range(nc):
            plane, rows = planes[c], work.rows[c]
            ref1 = 0 if references[c] > 0 else nc
            ref2 = 1 if references[c] > 1 else nc
            v, h, g = work.differences[0, c], work.differences[1, c], work.differences[2, c]
            ev, eh = work.residuals[0, c], work.residuals[1, c]
            if y < bh:
                _load_row(below, plane, y + 2, ranks[plane], rows[(y + 2) & 7])
                gradient_row(
                    rows[(y - 1) & 7], rows[y & 7], rows[(y + 1) & 7], work.gradient[c, now]
                )
                if sink is not None:
                    read_differences(level, plane, y, ranks[plane], v[now], h[now], g[now])
            else:
                for x in range(bw + 2):
                    h[now, x] = h[before, x]
                    eh[now, x] = 0
            for k in range(3):
                row = before if k == 2 else now
                r1, r2 = work.residuals[k, ref1, row], work.residuals[k, ref2, row]
                residual, near = work.residuals[k, c, row], work.near[k, c]
                w, a = weights[c, k], activities[c, k]
                if k == 2:
                    if y == 0:
                        continue
                    context_g(
                        rows, y - 1, work.gradient[c, before], v[before], h[before], h[now],
                        ev[before], eh[before], eh[now], r1, r2, near, w, a, prediction, activity,
                    )  # fmt: skip
                elif y == bh:
                    continue
                elif k == 0:
                    context_v(
                        rows, y, work.gradient[c, now], r1, r2, near, w, a, prediction, activity
                    )
                else:
                    context_h(
                        rows, y, work.gradient[c, now], v[now], ev[now], r1, r2, near, w, a,
                        prediction, activity,
                    )  # fmt: skip
                difference = work.differences[k, c, row]
                if sink is not None:
                    _emit(
                        difference, prediction, activity, classes, CLASSES if k == 2 else zero,
                        residual, near, sink.symbols[n : n + bw], sink.contexts[n : n + bw],
                        sink.counts,
                    )  # fmt: skip
                    n += bw
                if source is not None:
                    at = decode_row(
                        source.state, source.words, at, source.table, source.starts[k >> 1],
                        activity, bw, source.decoded,
                    )  # fmt: skip
                    if source.turning:
                        rotate_states(source.state, bw)
                    escaped = fill_escapes(source.decoded, bw, source.escapes, escaped)
                    if at > source.limit or escaped < 0:
                        return TRUNCATED
                    _absorb(source.decoded, prediction, residual, near, difference)
            if source is not None and y > 0:
                upper, lower = source.pairs[0, plane], source.pairs[1, plane]
                if source.tops[plane] > 0:
                    stray |= rebuild_ranked(
                        below[y - 1], ranks[plane], source.values[plane], source.tops[plane],
                        v[before], h[before], g[before], plane, upper, lower,
                    )  # fmt: skip
                else:
                    stray |= rebuild(
                        rows[(y - 1) & 7], v[before], h[before], g[before], upper, lower
                    )
        if source is not None:
            for i in range(2 if y > 0 else 0):
                begin = (2 * y - 2 + i) * width * nc
                write_row(source.pairs[i], source.mixed, source.flat[begin : begin + 2 * bw * nc])
    # The odd last column, then the odd last row: modulo 256, so nothing can escape.
    if source is not None and edge:
        at = decode_row(
            source.state, source.words, at, source.table, source.starts[2], source.zeros, edge,
            source.decoded,
        )  # fmt: skip
        if at > source.limit:
            return TRUNCATED
    for i in range(edge):
        j, plane = i // nc, i % nc
        y, x = (j, width - 1) if j < tall else (height - 1, j - tall)
        guess = _edge_prediction(level, y, x, plane)
        if sink is not None:
            e = i32(i32(i32(i32(level[y, x, plane]) - guess + 128) & 255) - 128)
            z = i32(i32(e << 1) ^ i32(e >> 31))
            sink.symbols[n + i] = z
            sink.contexts[n + i] = EDGE_TABLE
            sink.counts[EDGE_TABLE, z] += 1
        if source is not None:
            z = source.decoded[i]
            level[y, x, plane] = (guess + ((z >> 1) ^ -(z & 1))) & 255
    if source is not None:
        for lane in range(4):
            stray |= source.state[lane] != STATE_LOW
        if stray or at != source.limit or escaped != source.escapes.size:
            return IMPOSSIBLE
    return OK
