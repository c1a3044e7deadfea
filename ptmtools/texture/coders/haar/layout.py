"""What encoder and decoder of the `fast` profile agree on without sending it.

Planes in coding order, which earlier planes each refers to, the built-in weights, and the classes
of activity. The numbers were fitted once to photographs (12 of the Kodak images and 7 textures)
and are part of the format.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

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


def plane_order(components: int) -> list[int]:
    """Components in coding order: green, red, blue, alpha; grey, alpha."""
    return [1, 0, 2, 3][:components] if components >= 3 else list(range(components))


def reference_count(components: int, c: int) -> int:
    """How many of the planes coded first plane c (in coding order) refers to: alpha to none."""
    return c if components >= 3 and c < 3 else 0


def features_used(k: int, references: int) -> list[int]:
    """Indices of the weights of coefficient k (0 V, 1 h1, 2 h2') that are sent."""
    return [*range(5 if k == 2 else 4), *range(5, 5 + references)]


def references(components: int) -> NDArray[np.int64]:
    """`reference_count` of every plane, in coding order."""
    return np.array([reference_count(components, c) for c in range(components)], np.int64)


@cache
def class_of_activity() -> NDArray[np.int64]:
    """Class of each activity 0 … 1023."""
    return np.searchsorted(np.array(CLASS_BOUNDS), np.arange(1024), side="right")
