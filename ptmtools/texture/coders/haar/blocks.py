"""Rows of blocks: from texels to Haar differences, and back to rows of texels."""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel

i32, u16 = np.int32, np.uint16


@kernel
def read_differences(level: Any, plane: int, y: int, rank: Any, v: Any, h: Any, g: Any) -> None:
    """V, h1 and h2' of block row y, from the ranks of the texels."""
    upper, lower = level[2 * y], level[2 * y + 1]
    c = np.uint64(plane)
    for x in range(v.size - 2):
        left, right = np.uint64(2 * x), np.uint64(2 * x + 1)
        p, q = rank[np.uint64(upper[left, c])], rank[np.uint64(upper[right, c])]
        r, s = rank[np.uint64(lower[left, c])], rank[np.uint64(lower[right, c])]
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
        most = top - max(0, max(dp, dq, dr))
        if least > most:
            upper[x] = lower[x] = 0
            stray = 1
            continue
        wanted = 4 * np.int64(below[x, plane])
        u = rank[below[x, plane]] - ((dp + dq + dr + 2) >> 2)
        u = min(max(u, least), most)
        total = value[u] + value[u + dp] + value[u + dq] + value[u + dr]
        while total < wanted and u < most:
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
