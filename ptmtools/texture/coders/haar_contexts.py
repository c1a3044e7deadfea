"""Predictions and activities of a row of differences, known before its first residual.

Everything here works on several blocks at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.jit import plain_kernel as kernel

i32 = np.int32

#: Largest activity; larger ones count as this.
ACTIVITY_TOP = 1023
#: Predictions stay within the range of V, so that every residual fits in 16 bits.
PREDICTION_TOP = 1020


@kernel
def gradient_row(above: Any, row: Any, under: Any, out: Any) -> None:
    for x in range(out.size):
        out[x] = i32(abs(i32(row[x + 3] - row[x + 1])) + abs(i32(under[x + 2] - above[x + 2])))


@kernel
def _finish(p: Any, a: Any, x: int, prediction: Any, activity: Any) -> None:
    p = i32(i32(p + 128) >> 8)
    prediction[x] = min(max(p, i32(-PREDICTION_TOP)), i32(PREDICTION_TOP))
    activity[x] = min(i32(a >> 6), i32(ACTIVITY_TOP))


@kernel
def context_v(
    rows: Any, y: int, gradient: Any, r1: Any, r2: Any, near: Any, w: Any, a: Any,
    prediction: Any, activity: Any,
) -> None:  # fmt: skip
    """Predictions and activities of a row of V, the difference between a block's two rows."""
    nn, n, i = rows[(y - 2) & 7], rows[(y - 1) & 7], rows[y & 7]
    s, ss = rows[(y + 1) & 7], rows[(y + 2) & 7]
    w0, w1, w2, w3, w5, w6 = w[0], w[1], w[2], w[3], w[5], w[6]
    a0, a1, a2, a3 = a[0], a[1], a[2], a[3]
    for x in range(prediction.size):
        side = i32(i32(s[x + 1] - n[x + 1]) + i32(s[x + 3] - n[x + 3]))
        p = i32(
            w0 * i32(s[x + 2] - n[x + 2])
            + w1 * side
            + w2 * i32(ss[x + 2] - i[x + 2])
            + w3 * i32(i[x + 2] - nn[x + 2])
            + w5 * r1[x + 1]
            + w6 * r2[x + 1]
        )
        b = i32(
            a0 * gradient[x]
            + a1 * i32(2 * near[x + 1] + near[x] + near[x + 2])
            + a2 * abs(r1[x + 1])
            + a3 * abs(r2[x + 1])
        )
        _finish(p, b, x, prediction, activity)


@kernel
def context_h(
    rows: Any, y: int, gradient: Any, v: Any, ev: Any, r1: Any, r2: Any, near: Any, w: Any, a: Any,
    prediction: Any, activity: Any,
) -> None:  # fmt: skip
    """Predictions and activities of a row of h1, the difference along a block's upper row."""
    n, i, s = rows[(y - 1) & 7], rows[y & 7], rows[(y + 1) & 7]
    w0, w1, w2, w3, w5, w6 = w[0], w[1], w[2], w[3], w[5], w[6]
    a0, a1, a2, a3, a4 = a[0], a[1], a[2], a[3], a[4]
    for x in range(prediction.size):
        p = i32(
            w0 * i32(i[x + 3] - i[x + 1])
            + w1 * i32(n[x + 3] - n[x + 1])
            + w2 * i32(s[x + 3] - s[x + 1])
            + w3 * i32(v[x + 2] - v[x])
            + w5 * r1[x + 1]
            + w6 * r2[x + 1]
        )
        b = i32(
            a0 * gradient[x]
            + a1 * i32(2 * near[x + 1] + near[x] + near[x + 2])
            + a2 * abs(r1[x + 1])
            + a3 * abs(r2[x + 1])
            + a4 * abs(ev[x + 1])
        )
        _finish(p, b, x, prediction, activity)


@kernel
def context_g(
    rows: Any, y: int, gradient: Any, v: Any, h: Any, h_under: Any, ev: Any, eh: Any, eh_under: Any,
    r1: Any, r2: Any, near: Any, w: Any, a: Any, prediction: Any, activity: Any,
) -> None:  # fmt: skip
    """Predictions and activities of a row of h2', half the difference along the lower row."""
    i, s = rows[y & 7], rows[(y + 1) & 7]
    w0, w1, w2, w3, w4, w5, w6 = w[0], w[1], w[2], w[3], w[4], w[5], w[6]
    a0, a1, a2, a3, a4, a5, a6 = a[0], a[1], a[2], a[3], a[4], a[5], a[6]
    for x in range(prediction.size):
        p = i32(
            w0 * i32(i[x + 3] - i[x + 1])
            + w1 * i32(s[x + 3] - s[x + 1])
            + w2 * h[x + 1]
            + w3 * h_under[x + 1]
            + w4 * i32(v[x + 2] - v[x])
            + w5 * r1[x + 1]
            + w6 * r2[x + 1]
        )
        b = i32(
            a0 * gradient[x]
            + a1 * i32(2 * near[x + 1] + near[x] + near[x + 2])
            + a2 * abs(r1[x + 1])
            + a3 * abs(r2[x + 1])
            + a4 * abs(ev[x + 1])
            + a5 * abs(eh[x + 1])
            + a6 * abs(eh_under[x + 1])
        )
        _finish(p, b, x, prediction, activity)
