"""An image as interlaced files and back, in numpy: the reference of what a client does on its GPU.

Splitting takes every second line away as a file, odd rows first, then odd columns of what is left,
and so on; what is left in the end is the first file (paper §3.1, oriented on Adam7). Joining puts
the lines of the next file between those that are there (§3.2). Every texel is in one file. So the
image after a step is the whole one with every 2^i-th column and 2^j-th row, unfiltered: a fine
pattern becomes a coarse one (aliasing), which means of blocks, such as levels of a `.ptm`, do not
show.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.interlace.model import Axis

Texels = NDArray[Any]


def split(image: Texels, axes: Sequence[Axis]) -> list[Texels]:
    """The images of the files of an (h, w, …) image, the first file first; views.

    ``axes``: of the steps that join them, the first step first. Sides must halve as often as there
    are steps along them.
    """
    parts: list[Texels] = []
    for axis in reversed(axes):
        if axis == "rows":
            parts.append(image[1::2])
            image = image[0::2]
        else:
            parts.append(image[:, 1::2])
            image = image[:, 0::2]
    return [image, *reversed(parts)]


def join(first: Texels, second: Texels, axis: Axis) -> Texels:
    """One step: the lines of two (h, w, …) images of the same shape and type, in turn, those of
    ``first`` as the even ones: rows, (2h, w, …), or columns, (h, 2w, …)."""
    height, width, *rest = first.shape
    if axis == "rows":
        joined = np.empty((2 * height, width, *rest), first.dtype)
        joined[0::2], joined[1::2] = first, second
    else:
        joined = np.empty((height, 2 * width, *rest), first.dtype)
        joined[:, 0::2], joined[:, 1::2] = first, second
    return joined


def stride(axes: Sequence[Axis], step: int) -> tuple[int, int]:
    """(rows, columns): every how many-th of them the first ``step`` files show."""
    left = axes[step - 1 :]
    return 1 << left.count("rows"), 1 << left.count("columns")
