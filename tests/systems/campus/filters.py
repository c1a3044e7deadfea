"""The filters of lightmaps with arrays alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Ints, Singles
from ptmtools_systems.campus.lightmaps import AGREE

_ENOUGH = 0.5
_KERNEL = ((-1, 0.25), (0, 0.5), (1, 0.25))


def enlarged(
    value: Singles, chart: NDArray[np.int32], centred: Bools, larger: NDArray[np.int32]
) -> tuple[Singles, Bools]:
    """A lightmap of twice the size by bilinear filtering, and the texels in which it is valid:
    enough of the four texels belong to the chart of the one between them, these agree, and a face
    holds the centre of one of them."""
    size = len(larger)
    place = (np.arange(size) + 0.5) / 2 - 0.5
    first = np.clip(np.floor(place).astype(np.int64), 0, len(value) - 2)
    share = np.clip(place - first, 0, 1).astype(np.float32)
    rows, columns = (first, first + 1), (first, first + 1)
    mean = np.zeros((size, size), np.float32)
    least, most = np.full_like(mean, np.inf), np.full_like(mean, -np.inf)
    weight, known = np.zeros_like(mean), np.zeros((size, size), np.bool_)
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            four = value[row[:, None], column]
            same = chart[row[:, None], column] == larger
            part = np.where(same, np.abs(1 - i - share)[:, None] * np.abs(1 - j - share), 0)
            weight += part
            known |= same & centred[row[:, None], column]
            mean += part * four
            np.minimum(least, four, out=least, where=same)
            np.maximum(most, four, out=most, where=same)
    believed = (larger >= 0) & (weight >= _ENOUGH) & known
    believed[believed] = (most - least)[believed] <= AGREE
    mean /= np.maximum(weight, np.finfo(np.float32).tiny)
    return mean, believed


def smoothed(
    value: Singles, chart: NDArray[np.int32], row: Ints, column: Ints, grain: float
) -> Singles:
    """(n,) the binomial mean of some texels and of those neighbours on the same chart that differ
    from them by no more than ``grain``."""
    held, charts = np.pad(value, 1), np.pad(chart, 1, constant_values=-2)
    total, weight = np.zeros(len(row), np.float32), np.zeros(len(row), np.float32)
    here, own = chart[row, column], value[row, column]
    for i, down in _KERNEL:
        for j, across in _KERNEL:
            place = row + 1 + i, column + 1 + j
            alike = (charts[place] == here) & (np.abs(held[place] - own) <= grain)
            share = np.where(alike, np.float32(down * across), np.float32(0))
            total += share * held[place]
            weight += share
    return np.asarray(total / weight)
