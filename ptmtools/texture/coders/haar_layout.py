"""Weights and classes of the `fast` profile, shared by encoder and decoder and never sent.

The built-in weights and the classes of activity were fitted once to photographs (12 of the Kodak
images and 7 textures) and are part of the format. An encoder may send weights of its own, fitted to
one group: weighted least squares over a sample of block rows, one system of at most seven unknowns
for each plane and Haar difference, solved exactly (`group.solve_normal_equations`); the decoder
only reads them.

With the built-in weights alone, photographs grow by 1.5 % and other textures by 10.7 % (normal maps
most: their components are correlated differently).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.group import plane_order, reference_counts, solve_normal_equations

#: Weights are in 1/256 and stay within ± this, so that predictions fit in 32 bits.
WEIGHT_TOP = 2047


#: Activity below which lies class 0, 1, 2 …: in sixteenths of the expected residual.
CLASS_BOUNDS = (1, 3, 7, 12, 20, 32, 50, 76, 115, 170, 250, 370, 560)
CLASSES = len(CLASS_BOUNDS) + 1
#: One table for each class of V and h1, one for each class of h2', one for the edge texels.
TABLES = 2 * CLASSES + 1
#: The table of the edge texels, which alone has no escape.
EDGE_TABLE = TABLES - 1
#: Weights in 1/256 for a plane with 0, 1, 2 references: V, h1, h2' by seven features.
BUILT_IN_WEIGHTS = np.array(
    [
        [[-158, -5, 31, 29, 0, 0, 0], [-79, 5, 6, -18, 0, 0, 0], [-22, 10, 44, 44, 10, 0, 0]],
        [[-167, -2, 32, 32, 0, 241, 0], [-78, 1, 4, -18, 0, 241, 0], [-19, 10, 47, 49, 9, 235, 0]],
        [
            [-152, -7, 25, 22, 0, 236, 35],
            [-78, 0, 3, -18, 0, 236, 28],
            [-19, 9, 46, 46, 10, 228, 70],
        ],
    ],
    np.int32,
)  # fmt: skip
#: Activity weights in 1/64 of a sixteenth, likewise.
ACTIVITY_WEIGHTS = np.array(
    [
        [[154, 139, 0, 0, 0, 0, 0], [61, 153, 0, 0, 25, 0, 0], [11, 67, 0, 0, 22, 66, 88]],
        [[9, 98, 36, 0, 0, 0, 0], [3, 99, 51, 0, 60, 0, 0], [1, 27, 57, 0, 17, 50, 49]],
        [[8, 74, 31, 128, 0, 0, 0], [3, 88, 23, 131, 38, 0, 0], [1, 24, 20, 61, 25, 39, 55]],
    ],
    np.int32,
)  # fmt: skip


@cache
def sent_mask(components: int) -> NDArray[np.bool_]:
    """Which weights (c, 3, 7) are sent, in this order."""
    mask = np.zeros((components, 3, 7), np.bool_)
    mask[:, :, :4] = mask[:, 2, 4] = True
    for c, others in enumerate(reference_counts(components)):
        mask[c, :, 5 : 5 + others] = True
    return mask


@cache
def class_of_activity() -> NDArray[np.int64]:
    """Class of each activity 0 … 1023."""
    return np.searchsorted(np.array(CLASS_BOUNDS), np.arange(1024), side="right")


#: Groups of fewer blocks use the built-in weights: sending others would not pay.
FEWEST_BLOCKS = 96 * 96
#: Block rows sampled, about.
SAMPLED_ROWS = 12
Ranks = NDArray[np.int32]
#: Weight of a block by the magnitude of its first feature: steep blocks tell less.
_SLOPE_WEIGHTS = 4096 // (4 + np.arange(256))


def fit_weights(
    level: NDArray[np.uint8], below: NDArray[np.uint8], ranks: NDArray[np.int32]
) -> NDArray[np.int32] | None:
    """Weights (c, 3, 7), or None if the built-in ones suffice.

    Parameters
    ----------
    level: (h, w, c) uint8. below: (h >> 1, w >> 1, c) uint8, the level below.
    ranks: (c, 256) int32, the rank of each value of each component.
    """
    bh, bw, nc = below.shape
    if bh * bw < FEWEST_BLOCKS or min(bh, bw) < 4:
        return None
    step = max(1, bh // SAMPLED_ROWS)
    y = np.arange(step // 2, bh, step)
    around = np.clip(y + np.arange(-2, 3)[:, None], 0, bh - 1)
    rows = below[around], level[np.stack([2 * y, 2 * y + 1, 2 * around[3]]), : 2 * bw]
    weights, sent = np.zeros((nc, 3, 7), np.int32), sent_mask(nc)
    residuals = np.zeros((nc, 3, len(y), bw), np.int32)
    for c, (plane, others) in enumerate(zip(plane_order(nc), reference_counts(nc), strict=True)):
        means, texels = (ranks[plane].take(rank_rows[..., plane]) for rank_rows in rows)
        for k, (coefficient, terms) in enumerate(_coefficients(means, texels)):
            samples = np.stack([*terms, *residuals[:others, k], coefficient], dtype=np.float64)
            samples = samples.reshape(-1, coefficient.size)
            features = samples[:-1]
            # Whole numbers, the sums of their products below 2^50.
            weighted = features * _SLOPE_WEIGHTS.take(np.abs(terms[0])).reshape(-1)
            fit = solve_normal_equations(weighted @ samples.T, 8, WEIGHT_TOP, ridge=4096, share=16)
            weights[c, k, sent[c, k]] = fit
            predicted = np.floor((fit @ features + 128) / 256)
            residuals[c, k] = coefficient - predicted.reshape(coefficient.shape)
    return weights


def _coefficients(means: Ranks, texels: Ranks) -> list[tuple[Ranks, list[Ranks]]]:
    """V, h1 and h2' of the blocks of some rows, each with its first features.

    means: (5, n, w), the rows two above to two below. texels: (3, n, 2 w), the two rows of the
    blocks and the one under them.
    """
    wide = np.pad(means, ((0, 0), (0, 0), (1, 1)), "edge")
    across = wide[..., 2:] - wide[..., :-2]
    down = wide[3] - wide[1]
    h = texels[..., ::2] - texels[..., 1::2]
    v = texels[0, :, ::2] + texels[0, :, 1::2] - texels[1, :, ::2] - texels[1, :, 1::2]
    slope = np.pad(v, ((0, 0), (1, 1)))
    slope = slope[:, 2:] - slope[:, :-2]
    vertical = [
        down[:, 1:-1], down[:, :-2] + down[:, 2:], means[4] - means[2], means[2] - means[0]
    ]  # fmt: skip
    return [
        (v, vertical),
        (h[0], [across[2], across[1], across[3], slope]),
        (h[1] >> 1, [across[2], across[3], h[0], h[2], slope]),
    ]
