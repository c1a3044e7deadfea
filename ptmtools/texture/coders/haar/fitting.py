"""Compiled loop of the fit: sums for the normal equations."""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel


@kernel
def fit_sums(features: Any, weights: Any, used: Any, sums: Any) -> None:
    """Normal equations of a predictor.

    features: (9, n) int32: seven features, the coefficient, and a row that is overwritten.
    weights: (n,) int32. used: (m,) int64, the features to fit.
    sums: (m, m + 1) int64: of weight * feature * feature, and of weight * feature * coefficient.
    """
    m = used.size
    weighted = features[8]
    for a in range(m):
        one = features[used[a]]
        for at in range(one.size):
            weighted[at] = one[at] * weights[at]
        for b in range(a, m + 1):
            other = features[used[b] if b < m else 7]
            total = np.int64(0)
            for at in range(one.size):
                total += np.int64(weighted[at]) * np.int64(other[at])
            sums[a, b] = total
            if b < m:
                sums[b, a] = total
