"""Compiled loops of the fit: sums for the normal equations, and what the weights leave."""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel

i32 = np.int32


@kernel
def fit_sums(
    level: Any, below: Any, plane: int, rank: Any, k: int, sampled: Any, used: Any, weights: Any,
    features: Any, sums: Any,
) -> None:  # fmt: skip
    """Normal equations of the predictor of coefficient k (V, h1, h2') of a plane.

    rank: (256,) int32. sampled: (n,) int64, block rows. used: (m,) int64, the features to fit.
    weights: (256,) int32, of a block by the magnitude of feature 0.
    features: (9, n * width) int32; 5 and 6, the residuals of the reference planes, are read, the
        others are filled; 7 is the coefficient itself, 8 is overwritten.
    sums: (m, m + 1) int64: of weight * feature * feature, and of weight * feature * coefficient.
    """
    bh, bw = below.shape[0], below.shape[1]
    for j in range(sampled.size):
        y = sampled[j]
        nn, n = below[max(y - 2, 0)], below[max(y - 1, 0)]
        i, s = below[y], below[min(y + 1, bh - 1)]
        ss = below[min(y + 2, bh - 1)]
        upper, lower = level[2 * y], level[2 * y + 1]
        under = level[2 * min(y + 1, bh - 1)]
        for x in range(bw):
            at = j * bw + x
            w, e = max(x - 1, 0), min(x + 1, bw - 1)
            p, q = rank[upper[2 * x, plane]], rank[upper[2 * x + 1, plane]]
            r, t = rank[lower[2 * x, plane]], rank[lower[2 * x + 1, plane]]
            slope = i32(0)
            if k > 0 and x > 0:
                slope -= rank[upper[2 * x - 2, plane]] + rank[upper[2 * x - 1, plane]]
                slope += rank[lower[2 * x - 2, plane]] + rank[lower[2 * x - 1, plane]]
            if k > 0 and x + 1 < bw:
                slope += rank[upper[2 * x + 2, plane]] + rank[upper[2 * x + 3, plane]]
                slope -= rank[lower[2 * x + 2, plane]] + rank[lower[2 * x + 3, plane]]
            if k == 0:
                features[0, at] = rank[s[x, plane]] - rank[n[x, plane]]
                features[1, at] = (rank[s[w, plane]] - rank[n[w, plane]]) + (
                    rank[s[e, plane]] - rank[n[e, plane]]
                )
                features[2, at] = rank[ss[x, plane]] - rank[i[x, plane]]
                features[3, at] = rank[i[x, plane]] - rank[nn[x, plane]]
                features[4, at] = 0
                features[7, at] = p + q - r - t
            elif k == 1:
                features[0, at] = rank[i[e, plane]] - rank[i[w, plane]]
                features[1, at] = rank[n[e, plane]] - rank[n[w, plane]]
                features[2, at] = rank[s[e, plane]] - rank[s[w, plane]]
                features[3, at] = slope
                features[4, at] = 0
                features[7, at] = p - q
            else:
                features[0, at] = rank[i[e, plane]] - rank[i[w, plane]]
                features[1, at] = rank[s[e, plane]] - rank[s[w, plane]]
                features[2, at] = p - q
                features[3, at] = rank[under[2 * x, plane]] - rank[under[2 * x + 1, plane]]
                features[4, at] = slope
                features[7, at] = (r - t) >> 1
    m = used.size
    weighted = features[8]
    for a in range(m):
        one = features[used[a]]
        for at in range(one.size):
            weighted[at] = one[at] * weights[abs(features[0, at])]
        for b in range(a, m + 1):
            other = features[used[b] if b < m else 7]
            total = np.int64(0)
            for at in range(one.size):
                total += np.int64(weighted[at]) * np.int64(other[at])
            sums[a, b] = total
            if b < m:
                sums[b, a] = total


@kernel
def fit_residuals(features: Any, weights: Any, out: Any) -> None:
    """What the weights (7,) int32 leave of the coefficients in ``features`` of `fit_sums`."""
    for at in range(out.size):
        total = i32(128)
        for a in range(7):
            total = i32(total + i32(weights[a] * features[a, at]))
        out[at] = features[7, at] - i32(total >> 8)
