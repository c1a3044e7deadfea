"""Mipmap levels by the floor of the 2×2 mean (paper Eq. 1), for any size.

Level n-1 is max(1, side >> 1) wide and high, as in OpenGL and WebGPU, so that a decoded level can
be uploaded as it is. An odd last row or column belongs to no 2×2 block and does not reach the
level below.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def level_sizes(width: int, height: int, min_side: int = 1) -> list[tuple[int, int]]:
    """(width, height) of every level, coarsest first.

    Down to the first level whose shorter side is 1, or to the last one whose shorter side is at
    least ``min_side``; the image itself is always among them.
    """
    sizes = [(width, height)]
    while min(sizes[-1]) >> 1 >= max(1, min_side):
        sizes.append((sizes[-1][0] >> 1, sizes[-1][1] >> 1))
    return sizes[::-1]


def build_pyramid(image: NDArray[np.uint8], min_side: int = 1) -> list[NDArray[np.uint8]]:
    """Levels of an (h, w, c) or (h, w) uint8 image, coarsest first, the image itself last."""
    levels = [image]
    while min(levels[-1].shape[:2]) >> 1 >= max(1, min_side):
        levels.append(mean_below(levels[-1]))
    return levels[::-1]


def mean_below(level: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The level below: floor of the mean of every whole 2×2 block (paper Eq. 1)."""
    import numpy as np

    height, width = level.shape[0] & ~1, level.shape[1] & ~1
    rows = level[0:height:2, :width].astype(np.uint16)
    rows += level[1:height:2, :width]
    total = rows[:, 0::2] + rows[:, 1::2]
    total >>= 2
    return total.astype(np.uint8)
