"""What encoder and decoder of the `fast` profile agree on without sending it.

The built-in weights and the classes of activity. The numbers were fitted once to photographs (12 of
the Kodak images and 7 textures) and are part of the format.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.planes import references

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
    for c, others in enumerate(references(components)):
        mask[c, :, 5 : 5 + others] = True
    return mask


@cache
def class_of_activity() -> NDArray[np.int64]:
    """Class of each activity 0 … 1023."""
    return np.searchsorted(np.array(CLASS_BOUNDS), np.arange(1024), side="right")
