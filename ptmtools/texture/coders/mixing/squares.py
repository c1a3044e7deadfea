"""Weighted recursive least squares, in batches: the texel predictor's weights.

For each of the positions of a texel in its block, a linear model of the features f of a sample
predicts its target y. The normal equations A = Σ ω f fᵀ, b = Σ ω f y forget 1/32 of the past with
every batch of 16 samples and are solved anew after each, later after every other. The target is
kept as the last of the 24 features: A and b are one matrix.

Why the bits cannot differ between machines: A holds integers below 2^53 in float64, sums and
products of which are exact in any order. The elimination rounds, in a fixed order of operations
that numba does not change (no reassociation, no fused multiply-add, no library function);
magnitudes below 2^-100 become 0, so that subnormal numbers never arise and it does not matter
whether a processor is set to flush them. The weights are then rounded to multiples of 2^-16 and
all predictions made with them are integers.

Rejected: a Cholesky factor (square roots, not smaller); updating A with every sample (twice the
time: each row of A is loaded and stored sixteen times as often).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import inlined_kernel

i32 = np.int32

#: Features of a sample, the last of which is its target.
FEATURES = 24
TARGET = FEATURES - 1
#: A pending sample: its features, then its weight ω.
SAMPLE = FEATURES + 1
#: Samples between two solutions.
BATCH = 16
#: The first samples are used at once, in smaller batches, and without forgetting.
EARLY, EARLY_BATCH = 64, 4
#: From so many samples on, every other batch is enough.
OFTEN = 1024
#: Of A, with every batch, the past loses this share.
FORGET = 1.0 / 32.0
#: Added to the diagonal of A.
RIDGE = 20000.0
TINY = 2.0**-100
#: Fractional bits of a weight, and its limit.
WEIGHT_BITS = 16
WEIGHT_TOP = 4 << WEIGHT_BITS


@inlined_kernel
def learn(
    normal: Any, pending: Any, weights: Any, seen: Any, k: int, features: int,
    left: Any, right: Any,
) -> None:  # fmt: skip
    """One more sample of model k lies at the end of ``pending[k]``: count it; solve if it is time.

    normal: (models, 24, 24) float64; pending: (models, 16, 25) int32; weights: (models, 24) int32;
    seen: (models, 2) int64, all samples and those pending; left, right: (24, 24) float64 scratch.
    """
    seen[k, 0] += 1
    seen[k, 1] += 1
    count = seen[k, 1]
    early = seen[k, 0] <= EARLY
    if count < (EARLY_BATCH if early else BATCH):
        return
    seen[k, 1] = 0
    _accumulate(normal[k], pending[k], count, early, features, left, right)
    if seen[k, 0] < OFTEN or seen[k, 0] % (2 * BATCH) == 0:
        _solve(normal[k], weights[k], features, left, right[0])


@inlined_kernel
def _accumulate(
    A: Any, pending: Any, count: int, early: bool, features: int, left: Any, right: Any
) -> None:
    """A += Σ ω f fᵀ over the pending samples, on and above the diagonal."""
    for n in range(count):
        w = float(pending[n, FEATURES])
        for i in range(FEATURES):
            f = float(pending[n, i])
            right[n, i] = f
            left[n, i] = f * w
    forget = 0.0 if early else FORGET
    for i in range(features):
        row = A[i]
        for j in range(FEATURES):
            row[j] -= np.floor(row[j] * forget)
        for n in range(0, count, 4):
            t0, t1, t2, t3 = left[n, i], left[n + 1, i], left[n + 2, i], left[n + 3, i]
            for j in range(FEATURES):
                row[j] += (t0 * right[n, j] + t1 * right[n + 1, j]) + (
                    t2 * right[n + 2, j] + t3 * right[n + 3, j]
                )


@inlined_kernel
def _solve(A: Any, weights: Any, n: int, U: Any, inverse: Any) -> None:
    """weights[:n] = (A + ridge)⁻¹ b, rounded, by symmetric elimination without pivoting."""
    for i in range(n):
        for j in range(i & ~7, FEATURES):
            U[i, j] = A[i, j]
        U[i, i] += RIDGE
    for j in range(n):
        # At least the ridge but for rounding; at least 1 whatever a damaged file may say.
        inverse[j] = 1.0 / max(U[j, j], 1.0)
        for i in range(j + 1, FEATURES):
            if abs(U[j, i]) < TINY:
                U[j, i] = 0.0
        for i in range(j + 1, n):
            t = U[j, i] * inverse[j]
            if abs(t) >= TINY:
                for c in range(i & ~7, FEATURES):
                    U[i, c] -= t * U[j, c]
    for j in range(n - 1, -1, -1):
        w = U[j, TARGET] * inverse[j]
        if abs(w) < TINY:
            w = 0.0
        for i in range(j):
            U[i, TARGET] -= U[i, j] * w
        scaled = np.floor(w * float(1 << WEIGHT_BITS) + 0.5)
        weights[j] = i32(min(max(scaled, -float(WEIGHT_TOP)), float(WEIGHT_TOP)))


@inlined_kernel
def predict(pending: Any, weights: Any, k: int, at: int) -> Any:
    """Σ w f, with 16 fractional bits, in 32-bit integers: |f| < 256 and |w| <= 4 leave room."""
    total = i32(0)
    for i in range(FEATURES):
        total = i32(total + i32(weights[k, i] * pending[k, at, i]))
    return int(total)
