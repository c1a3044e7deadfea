"""What encoder and decoder of the texel coder agree on without sending it.

Which neighbours a texel is predicted from, the built-in weights and the built-in tables. The
numbers are part of the format.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.planes import references
from ptmtools.texture.coders.rans import tables

#: Rows and columns, from p, of the ten neighbours of p, q, r and s; the first three are those to
#: the left, above, and left above. What is not yet known there reads as the texel below it.
NEIGHBOURS = (
    ((0, -1), (-1, 0), (-1, -1), (-1, 1), (0, 2), (2, 0), (1, -1), (2, 2), (2, -1), (-1, 2)),
    ((0, 0), (-1, 1), (-1, 0), (-1, 2), (0, 2), (2, 0), (0, -1), (2, 2), (-1, 3), (1, -1)),
    ((1, -1), (0, 0), (0, -1), (0, 1), (0, 2), (2, 0), (-1, 0), (2, 2), (2, -1), (1, -2)),
    ((1, 0), (0, 1), (0, 0), (0, 2), (1, -1), (2, 0), (-1, 1), (2, 2), (2, -1), (-1, 2)),
)
#: Tokens of numbers up to 2^33.
TOKENS = 132
POWER = 4
#: Weights are in 1/4096 and stay within ± this …
WEIGHT_BITS = 12
WEIGHT_TOP = 32767
#: … as do the magnitudes of all weights of a texel together, so that a prediction of 16-bit samples
#: fits in 32 bits.
WEIGHT_SUM = 32767


def offsets(stride: int) -> NDArray[np.uint64]:
    """`NEIGHBOURS` (4, 10) as distances in a plane with rows so far apart, modulo 2^64."""
    return np.array([[y * stride + x for y, x in k] for k in NEIGHBOURS], np.int64).view(np.uint64)


#: Numbers of the built-in tables that spread evenly over so many symbols; the others follow.
EVEN = (2, 3, 4, 5, 6, 9, 16)


@cache
def table_family() -> tables.Family:
    """The built-in frequency tables.

    First even ones, for the fourth texels of few possible values. Then, of mean magnitude M = 1, 2,
    3, 4, 6, 8, 12 … sixteenths, weights that fall as (M / (M + 16·m))^POWER with the magnitude m.
    """
    rows = [[1 << 24] * n for n in EVEN]
    spans = [token_span(token) for token in range(TOKENS)]
    for mean in (1, *(m << i for i in range(35) for m in (2, 3))):
        magnitudes = [8 * (2 * first + count) for first, count in spans]
        rows.append(
            [
                (count * mean**POWER << 40) // (mean + magnitude) ** POWER
                for (_, count), magnitude in zip(spans, magnitudes, strict=True)
            ]
        )
    return tables.family(rows)


def token_span(token: int) -> tuple[int, int]:
    """The lowest number that a token stands for, and how many it does."""
    if token < 16:
        return token, 1
    bits = ((token - 16) >> 2) + 2
    return (4 + (token & 3)) << bits, 1 << bits


def sent_mask(components: int) -> NDArray[np.bool_]:
    """Which weights (c, 4, 12) are sent, in this order."""
    mask = np.zeros((components, 4, 12), np.bool_)
    for c, others in enumerate(references(components)):
        mask[c, :, : 10 + others] = True
    return mask


#: Weights in 1/4096 for a plane with 0, 1, 2 references: p, q, r, s by ten neighbours and the
#: errors of the references.
BUILT_IN_WEIGHTS = np.array(
    [
        [
            [1283, 850, -177, -296, -434, -352, -446, 35, 70, 100, 0, 0],
            [227, 949, -216, 82, 496, -332, 6, -60, -59, -430, 0, 0],
            [879, -1135, -63, -2041, -306, 64, 1, -37, 8, -95, 0, 0],
            [-2398, -2582, -3112, 124, -69, 120, -19, 49, -39, -26, 0, 0],
        ],
        [
            [1302, 842, -162, -324, -425, -337, -495, 16, 83, 120, 3189, 0],
            [230, 930, -202, 72, 490, -288, 23, -77, -47, -508, 3090, 0],
            [876, -1136, -54, -2058, -275, 82, 6, -56, 2, -102, 2994, 0],
            [-2437, -2642, -3130, 141, -51, 107, -6, 37, -42, -28, 2463, 0],
        ],
        [
            [1278, 772, -108, -294, -437, -329, -484, 26, 74, 114, 2451, 650],
            [223, 904, -195, 78, 452, -299, 22, -59, -38, -496, 2489, 512],
            [895, -1126, -42, -2016, -293, 62, 10, -31, 16, -108, 2541, 958],
            [-2226, -2459, -2986, 142, -50, 129, -2, 48, -46, -35, 3242, 869],
        ],
    ],
    np.int64,
)
