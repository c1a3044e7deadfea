"""Linear equations of integers, solved without rounding, so that every machine finds the same."""

from __future__ import annotations


def bareiss(matrix: list[list[int]], right: list[int]) -> tuple[list[int], int]:
    """Numerators and denominator of the x with matrix · x = right; symmetric, positive definite.

    Bareiss' fraction-free elimination (1968). Only the upper half is eliminated: it stays
    symmetric, and all divisions are exact.
    """
    n = len(matrix)
    rows = [[*row, b] for row, b in zip(matrix, right, strict=True)]
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
