"""The lightmaps of an object: light in every texel of an atlas, in three sizes.

One of half the least size is computed texel by texel. Each larger one takes over what the four
texels below agree on, as their bilinear mean, and computes the rest anew: light is smooth but for
where surfaces meet. At the edge of a chart those of the four count that lie on it, if they have
half of the weight. What was computed is smoothed with its eight neighbours on the same chart. The
gaps between charts take the value of what is nearest, so that no filter brings in what is not there
and JPEG has few edges to code.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.campus.atlas import GAP, Atlas, cover
from ptmtools.campus.lights import Look
from ptmtools.campus.model import LIGHT_SIZES

#: Four texels agree if none differs from another by more.
AGREE = 8 / 255
#: Points are moved so far towards the middle of their face: a row of texels whose centres are the
#: lower edge of a wall would lie in the ground, and be black.
_INWARD = 1e-3
#: The share of the bilinear weight that texels of the same chart must have.
_ENOUGH = 0.5
#: By which the directions are turned from texel to texel: far apart in both directions
#: (Roberts' R2 sequence).
_TURN = 0.7548776662466927, 0.5698402909980532
_KERNEL = ((-1, 0.25), (0, 0.5), (1, 0.25))


@dataclass(frozen=True)
class Lit:
    """A lightmap: (size, size) linear light, rows from the top, and how many of its texels were
    computed and how many lie on faces."""

    value: Singles
    computed: int
    covered: int


def bake(
    look: Look, corner: Floats, atlas: Atlas, sizes: tuple[int, ...] = LIGHT_SIZES
) -> list[Lit]:
    """The lightmaps of (T, 3, 3) faces, whose light ``look`` says.

    ``sizes`` ascend, each twice the one before.
    """
    sizes = (sizes[0] // 2, *sizes)
    found: list[Lit] = []
    below: tuple[Singles, NDArray[np.int32]] | None = None
    for size in sizes:
        owner = cover(atlas.uv, size)
        chart = np.where(owner >= 0, atlas.chart[owner], -1).astype(np.int32)
        value = np.zeros((size, size), np.float32)
        known = np.zeros((size, size), np.bool_)
        if below is not None:
            value, known = _enlarged(*below, chart)
        row, column = np.nonzero((owner >= 0) & ~known)
        face = owner[row, column].astype(np.int64)
        point = _positions(atlas.uv, corner, face, row, column, size)
        turn = (column * _TURN[0] + row * _TURN[1]) % 1.0
        value[row, column] = look(face, point, turn)
        value[row, column] = _smoothed(value, chart, row, column)
        below = value, chart
        if size > sizes[0]:
            grown = spread(value, owner >= 0)
            found.append(Lit(fill(*grown), len(row), int((owner >= 0).sum())))
    return found


def spread(value: Singles, known: Bools) -> tuple[Singles, Bools]:
    """The same with the gap beside what is known: each texel there the mean of the known ones
    around it, so that either side of a gap has its own."""
    for _ in range(GAP):
        height, width = value.shape
        weight = np.pad(known, 1).astype(np.float32)
        held = np.pad(np.where(known, value, 0), 1).astype(np.float32)
        count, total = np.zeros_like(value), np.zeros_like(value)
        for down in range(3):
            for right in range(3):
                around = slice(down, down + height), slice(right, right + width)
                count, total = count + weight[around], total + held[around]
        new = ~known & (count > 0)
        value = np.where(new, total / np.maximum(count, 1), value).astype(np.float32)
        known = known | new
    return value, known


def fill(value: Singles, known: Bools) -> Singles:
    """The same where it is ``known``, and elsewhere what is nearest, by a pyramid of means."""
    if known.all() or not known.any():
        return np.asarray(np.where(known, value, 1), np.float32)
    height, width = value.shape
    # Even sides: a last row or column counts twice.
    grown = [(0, height % 2), (0, width % 2)]
    weight = np.pad(known, grown).astype(np.float32)
    held = np.pad(np.where(known, value, 0), grown).astype(np.float32)
    count = weight.reshape(weight.shape[0] // 2, 2, -1, 2).sum(axis=(1, 3))
    total = held.reshape(held.shape[0] // 2, 2, -1, 2).sum(axis=(1, 3))
    mean = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
    coarse = fill(mean, count > 0)
    fine = coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
    return np.asarray(np.where(known, value, fine), np.float32)


def _positions(
    uv: Floats, corner: Floats, face: Ints, row: Ints, column: Ints, size: int
) -> Floats:
    """(n, 3) where the centres of texels lie on their faces."""
    at = np.stack([(column + 0.5) / size, 1 - (row + 0.5) / size], axis=1)
    a, b, c = np.moveaxis(uv[face], 1, 0)
    area = _cross(b - a, c - a)
    second, third = _cross(at - a, c - a) / area, _cross(b - a, at - a) / area
    share = np.stack([1 - second - third, second, third], axis=1)
    share += _INWARD * (1 / 3 - share)
    return np.asarray(np.einsum("nk,nkx->nx", share, corner[face]))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _enlarged(
    value: Singles, chart: NDArray[np.int32], larger: NDArray[np.int32]
) -> tuple[Singles, Bools]:
    """A lightmap of twice the size as bilinear filtering has it, and where that can be believed:
    enough of the four texels are of the same chart as the one between them, and those agree."""
    size = len(larger)
    place = (np.arange(size) + 0.5) / 2 - 0.5
    first = np.clip(np.floor(place).astype(np.int64), 0, len(value) - 2)
    share = np.clip(place - first, 0, 1).astype(np.float32)
    rows, columns = (first, first + 1), (first, first + 1)
    mean = np.zeros((size, size), np.float32)
    least, most = np.full_like(mean, np.inf), np.full_like(mean, -np.inf)
    weight = np.zeros_like(mean)
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            four = value[row[:, None], column]
            same = chart[row[:, None], column] == larger
            part = np.where(same, np.abs(1 - i - share)[:, None] * np.abs(1 - j - share), 0)
            weight += part
            mean += part * four
            np.minimum(least, four, out=least, where=same)
            np.maximum(most, four, out=most, where=same)
    believed = (larger >= 0) & (weight >= _ENOUGH)
    believed[believed] = (most - least)[believed] <= AGREE
    mean /= np.maximum(weight, np.finfo(np.float32).tiny)
    return mean, believed


def _smoothed(value: Singles, chart: NDArray[np.int32], row: Ints, column: Ints) -> Singles:
    """(n,) the binomial mean of some texels and their neighbours on the same chart."""
    held, charts = np.pad(value, 1), np.pad(chart, 1, constant_values=-2)
    total, weight = np.zeros(len(row), np.float32), np.zeros(len(row), np.float32)
    here = chart[row, column]
    for i, down in _KERNEL:
        for j, across in _KERNEL:
            place = row + 1 + i, column + 1 + j
            share = np.where(charts[place] == here, np.float32(down * across), np.float32(0))
            total += share * held[place]
            weight += share
    return np.asarray(total / weight)
