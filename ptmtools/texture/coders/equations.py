"""Weights by least squares, solved without rounding, so that every machine finds the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def fitted(
    sums: NDArray[np.float64], bits: int, top: int, ridge: int, share: int
) -> NDArray[np.int64]:
    """Weights (m,) in 1/2^bits, within ± ``top``, that solve normal equations.

    Parameters
    ----------
    sums: (m, m + 1), those of the products of two features and, last, of a feature and the target:
        whole numbers below 2^53, which come out the same in whatever order they are added.
    ridge, share: so much, and 1/2^share of itself, is added to each of the diagonal, so that a
        feature that never varies gets the weight 0.
    """
    rows = sums.astype(np.int64).tolist()
    for i, row in enumerate(rows):
        row[i] += (row[i] >> share) + ridge
    numerators, determinant = bareiss(rows)
    one = 2 << bits
    found = [(one * n + determinant) // (2 * determinant) for n in numerators]
    return np.clip(found, -top, top).astype(np.int64)


def bareiss(rows: list[list[int]]) -> tuple[list[int], int]:
    """Numerators and denominator of the x of symmetric, positive definite equations.

    ``rows``: the matrix with the right side as its last column, overwritten. By Bareiss'
    fraction-free elimination (1968). Only the upper half is eliminated: it stays symmetric, and all
    divisions are exact.
    """
    n = len(rows)
    previous = 1
    for k in range(n - 1):
        pivot_row = rows[k]
        pivot = pivot_row[k]
        for i in range(k + 1, n):
            row, factor = rows[i], pivot_row[i]
            for j in range(i, n + 1):
                row[j] = (row[j] * pivot - factor * pivot_row[j]) // previous
        previous = pivot
    determinant = rows[-1][n - 1]
    numerators = [0] * n
    for i in range(n - 1, -1, -1):
        row = rows[i]
        total = determinant * row[n] - sum(row[j] * numerators[j] for j in range(i + 1, n))
        numerators[i] = total // row[i]
    return numerators, determinant
