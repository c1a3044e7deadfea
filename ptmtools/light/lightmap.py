"""The lightmaps of a mesh, in one or several sizes, and light at vertices.

A texel has the light of the nearest point of its face, also where a look-up on a face reads it but
no face holds its centre, as of sills thinner than a texel. The map of half the least size is
computed texel by texel. Each larger one takes over the bilinear mean of the four texels below where
they agree, and computes the rest: light is smooth except where surfaces meet. Computed texels are
smoothed with neighbours on the same chart that differ by no more than the grain of the light. What
no face reads takes the nearest value. (Smoothing over edges made files a tenth smaller, and twice
as many points were off by a tenth.)

A lightmap belongs to the charts of one mesh. Coarse meshes carry their light at vertices: values
whose linear interpolation is nearest to the light at many points of the faces, in the least squares
(Kavan, Bargteil and Sloan 2011); a value taken at the vertex itself often lies in a dark corner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas
from ptmtools.jit import kernel
from ptmtools.light.atlas import Atlas, claim, cover, nearest
from ptmtools.light.looks import Look
from ptmtools.light.occlusion import SPREAD, hemisphere, turns
from ptmtools.tolerance import INWARD_SHARE, TIE_SHARE

#: Largest difference between four texels that agree.
AGREE = 8 / 255
#: Least share of the bilinear weight of texels of the same chart.
_ENOUGH = 0.5


@dataclass(frozen=True)
class Lightmap:
    """A lightmap: (size, size) linear light, rows from the top, and the numbers of its texels that
    were computed, and that are read on faces."""

    value: Singles
    computed: int
    covered: int


def bake(
    look: Look,
    corner: Floats,
    atlas: Atlas,
    grain: float,
    sizes: tuple[int, ...],
    least: float = 0.0,
) -> list[Lightmap]:
    """The lightmaps of (T, 3, 3) faces, whose light is ``look``.

    Neighbours that differ by more than ``grain`` stay apart; ``sizes`` ascend, each twice the one
    before; texels with less light than ``least`` take that of others nearby.
    """
    sizes = (sizes[0] // 2, *sizes)
    result: list[Lightmap] = []
    below: tuple[Singles, NDArray[np.int32], Bools] | None = None
    for size in sizes:
        centre = cover(atlas.uv, size)
        owner = claim(atlas.uv, centre)
        chart = np.where(owner >= 0, atlas.chart[owner], -1).astype(np.int32)
        value = np.zeros((size, size), np.float32)
        known = np.zeros((size, size), np.bool_)
        if below is not None:
            value, known = _enlarge(*below, chart)
        row, column = np.nonzero((owner >= 0) & ~known)
        face = owner[row, column].astype(np.int64)
        point = _positions(atlas.uv, corner, face, row, column, size)
        turn = (column * SPREAD[0] + row * SPREAD[1]) % 1.0
        value[row, column] = look(face, point, turn)
        value[row, column] = smooth(value, chart, row, column, np.float32(grain))
        below = value, chart, centre >= 0
        if size > sizes[0]:
            read = owner >= 0
            light = read & (value >= least)
            filled = fill(value, light if light.any() else read)
            result.append(Lightmap(filled, len(row), int(read.sum())))
    return result


def fill(value: Singles, known: Bools) -> Singles:
    """The known values, and nearby ones in the other texels, by a pyramid of means."""
    if known.all() or not known.any():
        return np.asarray(np.where(known, value, 1), np.float32)
    height, width = value.shape
    # Even sides: a last row or column counts twice.
    grown = [(0, height % 2), (0, width % 2)]
    weight = np.pad(known, grown).astype(np.float32)
    total_known = np.pad(np.where(known, value, 0), grown).astype(np.float32)
    count = weight.reshape(weight.shape[0] // 2, 2, -1, 2).sum(axis=(1, 3))
    total = total_known.reshape(total_known.shape[0] // 2, 2, -1, 2).sum(axis=(1, 3))
    mean = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
    coarse = fill(mean, count > 0)
    fine = coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
    return np.asarray(np.where(known, value, fine), np.float32)


def _positions(
    uv: Floats, corner: Floats, face: Ints, row: Ints, column: Ints, size: int
) -> Floats:
    """(n, 3) the points of faces that are nearest to the centres of texels."""
    at = np.stack([(column + 0.5) / size, 1 - (row + 0.5) / size], axis=1)
    share = nearest(uv[face], at)
    # Texels whose centres are on the lower edge of a wall would be in the ground.
    share += INWARD_SHARE * (1 / 3 - share)
    return np.asarray(np.einsum("nk,nkx->nx", share, corner[face]))


def _enlarge(
    value: Singles, chart: NDArray[np.int32], centred: Bools, larger: NDArray[np.int32]
) -> tuple[Singles, Bools]:
    """A lightmap of twice the size by bilinear filtering, and the texels in which it is valid:
    enough of the four texels belong to the chart of the one between them, these agree, and a face
    holds the centre of one of them."""
    place = (np.arange(len(larger)) + 0.5) / 2 - 0.5
    first = np.clip(np.floor(place).astype(np.int64), 0, len(value) - 2)
    second = np.clip(place - first, 0, 1).astype(np.float32)
    return interpolate(value, chart, centred, larger, first, np.stack([1 - second, second]))


@kernel
def interpolate(
    value: Singles,
    chart: NDArray[np.int32],
    centred: Bools,
    larger: NDArray[np.int32],
    first: Ints,
    share: Singles,
) -> tuple[Singles, Bools]:
    """See `_enlarge`; ``first``: (size,) the first of the two rows or columns for each of the
    larger lightmap, ``share``: (2, size) the shares of both."""
    size = len(larger)
    mean, believed = np.zeros((size, size), np.float32), np.zeros((size, size), np.bool_)
    for row in range(size):
        for column in range(size):
            own_chart, known = larger[row, column], False
            weight, total = np.float32(0), np.float32(0)
            smallest, largest = np.float32(np.inf), np.float32(-np.inf)
            for i in range(2):
                for j in range(2):
                    r, c = first[row] + i, first[column] + j
                    if chart[r, c] != own_chart:
                        continue
                    part = share[i, row] * share[j, column]
                    weight += part
                    total += part * value[r, c]
                    smallest, largest = min(smallest, value[r, c]), max(largest, value[r, c])
                    known |= centred[r, c]
            if weight > 0:
                mean[row, column] = total / weight
            agree = largest - smallest <= np.float32(AGREE)
            believed[row, column] = own_chart >= 0 and weight >= _ENOUGH and known and agree
    return mean, believed


@kernel
def smooth(
    value: Singles, chart: NDArray[np.int32], row: Ints, column: Ints, grain: np.float32
) -> Singles:
    """(n,) the binomial mean of some texels and of those neighbours on the same chart that differ
    from them by no more than ``grain``."""
    height, width = value.shape
    result = np.empty(len(row), np.float32)
    for n in range(len(row)):
        centre, centre_chart = value[row[n], column[n]], chart[row[n], column[n]]
        weight, total = np.float32(0), np.float32(0)
        for i in range(-1, 2):
            for j in range(-1, 2):
                r, c = row[n] + i, column[n] + j
                if not (0 <= r < height and 0 <= c < width) or chart[r, c] != centre_chart:
                    continue
                if abs(value[r, c] - centre) <= grain:
                    share = np.float32((2 - abs(i)) * (2 - abs(j)) / 16)
                    weight += share
                    total += share * value[r, c]
        result[n] = total / weight
    return result


#: Number of points of a face at which its light is computed.
POINTS = 8
#: Least dot product of the normals of faces whose corners in one place share a light.
SMOOTH = 0.8
#: Weight of the mean of a vertex's own points, beside the fit; rounds of conjugate gradients.
_STEADY = 0.01
_ROUNDS = 24


def vertex_light(look: Look, corner: Floats, normal: Floats) -> Floats:
    """(T, 3) light from 0 to 1 at the corners of (T, 3, 3) faces with (T, 3) normals; ``look`` is
    their light."""
    count = len(corner)
    share = _triangle_points()
    point = np.einsum("pk,tkx->tpx", share, corner).reshape(-1, 3)
    face = np.repeat(np.arange(count), POINTS)
    seen = look(face, point, turns(len(point))).reshape(count, POINTS)
    vertex = _vertex_numbers(corner, normal)
    fitted = _fit(vertex, share, seen, areas(corner))
    return np.clip(fitted[vertex], 0.0, 1.0)


def _triangle_points() -> Floats:
    """(POINTS, 3) barycentric coordinates spread over a triangle."""
    flat = hemisphere(POINTS).astype(np.float64)
    along = np.sqrt((np.arange(POINTS) + 0.5) / POINTS)
    across = np.arctan2(flat[:, 1], flat[:, 0]) / (2 * np.pi) % 1.0
    return np.stack([1 - along, along * (1 - across), along * across], axis=1)


def _vertex_numbers(corner: Floats, normal: Floats) -> Ints:
    """(T, 3) a number for each corner, equal for corners in one place on nearly parallel faces."""
    place = np.unique(corner.reshape(-1, 3), axis=0, return_inverse=True)[1].ravel()
    facing = np.repeat(normal, 3, axis=0)
    order = np.argsort(place, kind="stable")
    number = np.empty(len(place), np.int64)
    given = 0
    for these in np.split(order, np.flatnonzero(np.diff(place[order])) + 1):
        first: list[tuple[Floats, int]] = []
        for place_row in these.tolist():
            known = next((n for way, n in first if way @ facing[place_row] >= SMOOTH), -1)
            if known < 0:
                known, given = given, given + 1
                first.append((facing[place_row], known))
            number[place_row] = known
    return number.reshape(-1, 3)


def _fit(vertex: Ints, share: Floats, seen: Singles, area: Floats) -> Floats:
    """(V,) values at vertices whose interpolation is nearest to the light ``seen`` at the points of
    each face, by conjugate gradients on the normal equations."""
    count, weight = (
        int(vertex.max()) + 1,
        np.maximum(area, max(area.max() * TIE_SHARE, np.finfo(float).tiny)),
    )
    within = share.T @ share / POINTS

    def gather(at_corners: Floats) -> Floats:
        return np.asarray(np.bincount(vertex.ravel(), at_corners.ravel(), count), np.float64)

    mass = gather(np.repeat(weight, 3).reshape(-1, 3) / 3)
    mean = gather(np.outer(weight * seen.mean(axis=1), np.full(3, 1 / 3))) / mass

    def times(value: Floats) -> Floats:
        return gather(weight[:, None] * (value[vertex] @ within)) + _STEADY * mass * value

    target = gather(weight[:, None] * (seen @ share) / POINTS) + _STEADY * mass * mean
    value = mean.copy()
    rest = target - times(value)
    way = rest / mass
    size = float(rest @ way)
    for _ in range(_ROUNDS):
        if size <= 0:
            break
        moved = times(way)
        step = size / float(way @ moved)
        value += step * way
        rest -= step * moved
        ahead = rest / mass
        size, before = float(rest @ ahead), size
        way = ahead + size / before * way
    return value
