"""The inner loops of `detail`: sums of the squared differences between (h, w, c) samples and those
of (h >> 1, w >> 1, c) enlarged, over the first ``colours`` components."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.compiled import kernel


@kernel
def integer_squares(level: NDArray[Any], below: NDArray[Any], colours: int) -> float:
    """Of integers of up to 16 bits; exact up to 2^53, and a row always. Two texels at a time take a
    third of the time of one."""
    height, width = below.shape[:2]
    total = 0.0
    for y in range(level.shape[0]):
        row = min(y >> 1, height - 1)
        squares = np.int64(0)
        for c in range(colours):
            for x in range(width):
                under = np.int64(below[row, x, c])
                left = np.int64(level[y, 2 * x, c]) - under
                right = np.int64(level[y, 2 * x + 1, c]) - under
                squares += left * left + right * right
            for x in range(2 * width, level.shape[1]):
                odd = np.int64(level[y, x, c]) - np.int64(below[row, width - 1, c])
                squares += odd * odd
        total += squares
    return total


@kernel
def float_squares(level: NDArray[Any], below: NDArray[Any], colours: int) -> float:
    """Of floats; what is not finite differs from nothing."""
    height, width = below.shape[:2]
    total = 0.0
    for y in range(level.shape[0]):
        row = min(y >> 1, height - 1)
        for x in range(level.shape[1]):
            column = min(x >> 1, width - 1)
            for c in range(colours):
                difference = float(level[y, x, c]) - float(below[row, column, c])
                if math.isfinite(difference):
                    total += difference * difference
    return total
