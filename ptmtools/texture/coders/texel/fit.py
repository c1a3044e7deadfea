"""Weights of the texel coder's predictors, fitted to one group, the same on every machine.

Least squares over a sample of block rows, one system of ten to twelve unknowns for each plane and
each of p, q, r, s. Each sample is divided by the spread of its neighbours first, so that smooth and
rough parts, dark and bright ones have the same say: what counts is bits, the logarithm of an error.
The normal equations are sums of whole numbers and solved exactly (`coders.equations`).

Beside the fitted weights stand those that continue drawn and computed images exactly (the texel
above, the one to the left, the plane through both): a depth map of 512² texels takes 44 kB with
them, 98 kB without. On photographs they never win.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.equations import fitted
from ptmtools.texture.coders.planes import plane_order, references
from ptmtools.texture.coders.texel.layout import NEIGHBOURS, WEIGHT_BITS, WEIGHT_SUM, WEIGHT_TOP

#: About so many blocks are sampled.
SAMPLED_BLOCKS = 6144
#: Features are brought to about ± this, and cut off at the other.
SCALE = 1 << 9
FEATURE_TOP = 1 << 12
#: Spread of the neighbours to which every sample is thought to have at least.
LEAST_SPREAD = 4
#: From this error on, the sample is fitted with neighbours that are as wrong as they will be. It
#: saves 4 % at an error of 8 in photographs and costs 0.4 % at one of 1.
ROUGH_ERROR = 3

Array = NDArray[np.int64]


def fit_weights(work: NDArray[np.uint32], level: NDArray[np.uint32], max_error: int) -> Array:
    """Weights (c, 4, 12) in coding order.

    work: (c, rows, columns), the level below enlarged, with a frame. level: (h, w, c), numbers of
    what is to be predicted.
    """
    nc = level.shape[2]
    bh, bw = level.shape[0] >> 1, level.shape[1] >> 1
    apart = max(1, bh * bw // SAMPLED_BLOCKS)
    y = np.arange(apart // 2, bh, apart)
    weights = np.zeros((nc, 4, 12), np.int64)
    errors = np.zeros((nc, 4, len(y), bw), np.int64)
    rough = max_error if max_error >= ROUGH_ERROR else 0
    for c, (plane, others) in enumerate(zip(plane_order(nc), references(nc), strict=True)):
        sample = _Sample(work[plane], level[:, :, plane], y, rough)
        for k in range(4):
            neighbours, target = sample.of(k)
            f = np.stack([*neighbours, *errors[:others, k]])
            candidates = [_solve(f, target, LEAST_SPREAD + max_error), *_continuations(len(f))]
            found = [target - _predicted(w, f) for w in candidates]
            costs = [_cost(one) for one in found]
            # The others have to be better by a sixteenth of a bit each.
            costs[0] -= target.size // 16
            best = costs.index(min(costs))
            weights[c, k, : len(f)] = candidates[best]
            errors[c, k] = _rounded(found[best], rough)
    return weights


class _Sample:
    """Some block rows of a plane, as they look when each of their texels is to be predicted."""

    def __init__(
        self, work: NDArray[np.uint32], level: NDArray[np.uint32], y: Array, max_error: int
    ) -> None:
        width = 2 * (level.shape[1] >> 1)
        self._exact = level.astype(np.int64)[:, :width]
        self._y = y
        # Rows and columns -2 … 3 of every block, with all texels of the blocks unknown, and known.
        self._unknown = work[2 * y[:, None] + np.arange(6)].astype(np.int64)
        known = _rounded(self._exact, max_error)
        above = y > 0
        for row in (0, 1):
            self._unknown[above, row, 2 : 2 + width] = known[2 * y[above] - 2 + row]
        self._known = self._unknown.copy()
        self._known[:, 2:4, 2 : 2 + width] = known[2 * y[:, None] + np.arange(2)]

    def of(self, k: int) -> tuple[list[Array], Array]:
        """The ten neighbours of texel k of each block and itself, less the block's mean."""
        base = self._at(self._unknown, 0, 0)
        own = self._exact[2 * self._y + (k >> 1), k & 1 :: 2]
        return [self._neighbour(k, *place) - base for place in NEIGHBOURS[k]], own - base

    def _neighbour(self, k: int, dy: int, dx: int) -> Array:
        # To the left in the rows of the block, or in the block itself: known by now.
        known = 0 <= dy <= 1 and (dx < 0 or (dx <= 1 and 2 * dy + dx < k))
        return self._at(self._known if known else self._unknown, dy, dx)

    def _at(self, rows: Array, dy: int, dx: int) -> Array:
        end = 2 + dx + self._exact.shape[1]
        return rows[:, dy + 2, 2 + dx : end : 2]


def _rounded(values: Array, max_error: int) -> Array:
    """Values with errors as they are to be expected."""
    step = 2 * max_error + 1
    return (values + max_error) // step * step if max_error else values


def _predicted(weights: Array, features: Array) -> Array:
    total = np.tensordot(weights, features, axes=1)
    half: int = 1 << WEIGHT_BITS - 1
    return np.asarray((total + half) >> WEIGHT_BITS)


def _solve(f: Array, target: Array, least: int) -> Array:
    """Weights of the features f (m, rows, blocks) that fit the target (rows, blocks)."""
    # Single operations of float64 on whole numbers, rounded as IEEE says: alike on every machine.
    scale = SCALE / (np.abs(f[:6]).sum(axis=0) / 4 + least)
    g = np.clip(np.rint(np.stack([*f, target]) * scale), -FEATURE_TOP, FEATURE_TOP)
    g = g.reshape(len(f) + 1, -1)
    weights = fitted(g[:-1] @ g.T, WEIGHT_BITS, WEIGHT_TOP, ridge=SCALE * SCALE, share=12)
    total = int(np.abs(weights).sum())
    if total <= WEIGHT_SUM:
        return weights
    return np.asarray(np.sign(weights) * (np.abs(weights) * WEIGHT_SUM // total))


def _continuations(used: int) -> list[Array]:
    """Weights for the texel to the left, the one above, and the plane through both and a third."""
    weights = np.zeros((3, used), np.int64)
    weights[0, 0] = weights[1, 1] = 1 << WEIGHT_BITS
    weights[2, :3] = np.array([1, 1, -1]) << WEIGHT_BITS
    return list(weights)


def _cost(residual: Array) -> int:
    """About how many bits these residuals take: one more for each doubling."""
    return int(np.frexp(np.abs(residual).astype(np.float64))[1].sum())
