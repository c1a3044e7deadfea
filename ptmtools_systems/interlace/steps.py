"""Interlacing and scaling of an image in numpy (Englert et al., §3.1 and §3.2).

Splitting takes every second line away as a file, odd rows and odd columns in turn; the rest is the
first file. Joining puts the lines of the next file between those of the image before. Every texel
is in one file, so the image after a step is the whole one with every 2^i-th column and 2^j-th row.

Scaling brings each side to the nearest power of two by ratio. The filter is the cubic of Catmull
and Rom (Keys 1981, a = -1/2), stretched by the factor where a side shrinks. It needs only the four
operations, which IEEE 754 rounds alike everywhere: the same bytes on every machine. Colours are
weighted by alpha; samples count as they are stored, without undoing gamma, as GPUs do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.texture.sources import RowSource
from ptmtools_systems.interlace.model import Axis

Texels = NDArray[Any]


def split(image: Texels, axes: Sequence[Axis]) -> list[Texels]:
    """The images of the files of an (h, w, …) image, the first file first; views.

    ``axes``: as `axes_of` returns them; sides are divisible by the steps along them.
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
    """(rows, columns): the distances of the lines that the first ``step`` files show."""
    remaining = axes[step - 1 :]
    return 1 << remaining.count("rows"), 1 << remaining.count("columns")


#: Half the width of the filter, texels.
_REACH = 2.0
#: Samples of the result that are computed at a time.
_STRIP_SAMPLES = 1 << 18


def nearest_power(side: int) -> int:
    """The power of two that is nearest by ratio."""
    below = 1 << (side.bit_length() - 1)
    # side / below < 2 below / side; never equal, √2 is irrational.
    return below if side * side < 2 * below * below else 2 * below


def scale(image: RowSource, width: int, height: int) -> NDArray[Any]:
    """An (h, w, c) image of unsigned integers, 1 to 4 components, at another size.

    Of 2 and 4 components the last is alpha.
    """
    old_height, old_width, components = image.shape
    across, across_weight = _taps(old_width, width)
    down, down_weight = _taps(old_height, height)
    top = np.iinfo(image.dtype).max
    result = np.empty((height, width, components), image.dtype)
    step = max(1, _STRIP_SAMPLES // (width * components))
    for y in range(0, height, step):
        rows = down[y : y + step]
        low, high = int(rows.min()), int(rows.max()) + 1
        strip = _premultiply(np.asarray(image[low:high]).astype(np.float64), top)
        strip = _filter(strip, rows - low, down_weight[y : y + step], 0)
        strip = _filter(strip, across, across_weight, 1)
        result[y : y + step] = np.floor(np.clip(_plain(strip, top), 0, top) + 0.5)
    return result


def _taps(old: int, new: int) -> tuple[Ints, Floats]:
    """(new, n) source lines of each new line, and their weights."""
    factor = max(1.0, old / new)
    centre = (np.arange(new) + 0.5) * (old / new)
    count = int(np.ceil(2 * _REACH * factor)) + 1
    first = np.floor(centre - _REACH * factor + 0.5)
    line = first[:, None] + np.arange(count)
    weight = _cubic((line + 0.5 - centre[:, None]) / factor)
    total = np.zeros(new)
    for column in weight.T:
        total += column
    weight /= total[:, None]
    return np.clip(line, 0, old - 1).astype(np.int64), weight


def _cubic(x: Floats) -> Floats:
    x = abs(x)
    near = (1.5 * x - 2.5) * x * x + 1.0
    outer = ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0
    return np.where(x < 1, near, np.where(x < _REACH, outer, 0.0))


def _filter(image: Floats, line: Ints, weight: Floats, axis: int) -> Floats:
    """An (h, w, c) image whose rows (axis 0) or columns (1) are sums of (n, k) weighted lines."""
    shape = [1, 1, 1]
    shape[axis] = -1
    # One after the other: numpy's own sum is pairwise, in blocks that depend on the machine.
    total = np.zeros(())
    for k in range(line.shape[1]):
        taken = np.take(image, line[:, k], axis)
        taken *= weight[:, k].reshape(shape)
        total = taken if k == 0 else np.add(total, taken, out=total)
    return total


def _premultiply(image: Floats, top: int) -> Floats:
    """Colours times alpha, 0 to 1, where there is alpha."""
    if image.shape[2] in (2, 4):
        image[:, :, :-1] *= image[:, :, -1:] / top
    return image


def _plain(image: Floats, top: int) -> Floats:
    """The inverse of `_premultiply`; colours of transparent texels are 0."""
    if image.shape[2] in (2, 4):
        alpha = image[:, :, -1:] / top
        seen = alpha > 0
        image[:, :, :-1] = np.where(seen, image[:, :, :-1] / np.where(seen, alpha, 1.0), 0.0)
    return image
