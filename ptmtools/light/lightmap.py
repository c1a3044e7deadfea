"""The lightmap of a mesh, and light at vertices.

A texel has the light of its centre, also where a look-up on a face reads it but no face holds its
centre, if the surface goes on there, as in another cell; else, as on sills, that of the nearest
point of its face. What no face reads, and what is covered, takes the nearest value.

Light by rays has grain. Four rounds take the plane through 25 texels of the same chart, the first
their mean, at twice the distance of the round before, of which those count less that differ by more
than the grain, as its variance tells (means alone would be wrong at the edges of charts, where
light has a slope, and show as seams; Dammertz et al. 2010, Edge-Avoiding À-Trous Wavelet Transform;
Schied et al. 2017, Spatiotemporal Variance-Guided Filtering).

A lightmap belongs to the charts of one mesh. Coarse meshes carry their light at vertices: values
whose linear interpolation is nearest to the light at many points of the faces, in the least squares
(Kavan, Bargteil and Sloan 2011); a value taken at the vertex itself often lies in a dark corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas, fill_gaps, plane_areas
from ptmtools.jit import kernel
from ptmtools.light.atlas import Atlas, claim, coordinates, cover, nearest
from ptmtools.light.looks import SMALLEST, Look
from ptmtools.light.occlusion import SPREAD, hemisphere, turns
from ptmtools.tolerance import INWARD_SHARE, TIE_SHARE

#: The distance of the texels of each round, and the variance of their places along an axis,
#: texels², below which values lie in no plane.
_ROUNDS = ((1, math.inf), (2, 0.05), (4, 0.05), (8, 0.05))
#: By how many deviations the light of texels differs that do not count.
_APART = 3.0
#: Texels by which what is open grows into what is covered: beyond, the light of other rooms counts.
_GROWN = 2
#: Texels from a face to the centre of a texel that it reads, at most.
_BEYOND = 2.0
#: Weights of the texels of a round along an axis, by their distance.
_SPLINE = (3 / 8, 1 / 4, 1 / 16)


@dataclass(frozen=True)
class TexelGrid:
    """The texels of a lightmap that faces read.

    Attributes
    ----------
    corner, uv: (T, 3, 3) and (T, 3, 2) of the faces.
    row, column, face: (n,) of each texel, rows from the top.
    chart: (size, size) the chart of each texel, -1 if no face reads it.
    centred: (size, size) whether a face holds the centre of a texel.
    """

    corner: Floats
    uv: Floats
    row: Ints
    column: Ints
    face: Ints
    chart: NDArray[np.int32]
    centred: Bools

    @staticmethod
    def of_atlas(corner: Floats, atlas: Atlas, size: int) -> TexelGrid:
        """The texels of a square lightmap of ``size`` of (T, 3, 3) faces."""
        centre = cover(atlas.uv, size)
        owner = claim(atlas.uv, centre)
        chart = np.where(owner >= 0, atlas.chart[owner], -1).astype(np.int32)
        row, column = np.nonzero(owner >= 0)
        face = owner[row, column].astype(np.int64)
        return TexelGrid(corner, atlas.uv, row, column, face, chart, centre >= 0)

    @property
    def texel(self) -> float:
        """Metres of a texel."""
        share = plane_areas(self.uv).sum() / max(areas(self.corner).sum(), SMALLEST)
        return 1 / max(len(self.chart) * math.sqrt(share), SMALLEST)

    def points(self, number: Ints | slice = slice(None)) -> Floats:
        """(n, 3) the points of faces that are nearest to the centres of texels."""
        share = nearest(self.uv[self.face[number]], self._centres(number))
        # Texels whose centres are on the lower edge of a wall would be in the ground.
        share += INWARD_SHARE * (1 / 3 - share)
        return np.asarray(np.einsum("nk,nkx->nx", share, self.corner[self.face[number]]))

    def reading_points(self, goes_on: Callable[[Ints, Floats, Floats], Bools]) -> Floats:
        """(n, 3) `points`, or the centres of texels themselves, in the planes of faces, where the
        surface ``goes_on`` from the points of these to them: parts of a wall in two cells agree."""
        points = self.points()
        out = np.flatnonzero(~self.centred[self.row, self.column])
        face = self.face[out]
        share = coordinates(self.uv[face], self._centres(out))
        beyond = np.einsum("nk,nkx->nx", share, self.corner[face])
        # Coordinates in slivers are inexact.
        near = np.linalg.norm(beyond - points[out], axis=1) < _BEYOND * self.texel
        out, face, beyond = out[near], face[near], beyond[near]
        sound = goes_on(face, points[out], beyond)
        points[out[sound]] = beyond[sound]
        return points

    def _centres(self, number: Ints | slice) -> Floats:
        """(n, 2) coordinates of the centres of texels."""
        size = len(self.chart)
        across, up = (self.column[number] + 0.5) / size, 1 - (self.row[number] + 0.5) / size
        return np.stack([across, up], axis=1)

    def turns(self, number: Ints | slice = slice(None)) -> Floats:
        """(n,) turns from 0 to 1, far apart in neighbours."""
        return (self.column[number] * SPREAD[0] + self.row[number] * SPREAD[1]) % 1.0

    def smooth(self, light: Singles, variance: Singles, least: float) -> Singles:
        """(n, k) light of the texels without its grain, whose (n,) variance is that of the mean of
        k colours; differences of ``least`` do not count. NaN of covered texels stays."""
        covered = np.asarray(np.isnan(light).any(axis=1))
        chart = self.chart.copy()
        chart[self.row[covered], self.column[covered]] = -1
        value = np.zeros((*chart.shape, light.shape[1]), np.float32)
        grain = np.zeros(chart.shape, np.float32)
        value[self.row, self.column] = np.where(covered[:, None], 0, light)
        grain[self.row, self.column] = np.where(covered, 0, variance)
        for step, stiff in _ROUNDS:
            value, grain = smooth(value, blur(grain, chart), chart, step, least, stiff)
        return np.where(covered[:, None], np.nan, value[self.row, self.column])

    def is_in_chart_of(self, chosen: Bools) -> Bools:
        """(n,) whether one of the (n,) chosen texels is in the chart of each."""
        chart = self.chart[self.row, self.column]
        return np.asarray(np.isin(chart, chart[chosen]))

    def blur(self, variance: Singles) -> Singles:
        """(n,) the mean of (n,) variances over the texels around in each chart."""
        grain = np.zeros(self.chart.shape, np.float32)
        grain[self.row, self.column] = variance
        return blur(grain, self.chart)[self.row, self.column]

    def fill(self, light: Singles) -> Singles:
        """(size, size, k) the lightmap of (n, k) light, of which covered texels have NaN."""
        sound = ~np.asarray(np.isnan(light).any(axis=1))
        if not sound.any():
            sound, light = np.ones(len(light), np.bool_), np.nan_to_num(light)
        value = np.zeros((*self.chart.shape, light.shape[1]), np.float32)
        known = np.zeros(self.chart.shape, np.bool_)
        value[self.row[sound], self.column[sound]] = light[sound]
        known[self.row[sound], self.column[sound]] = True
        for _ in range(_GROWN):
            value, known = grow(value, known, self.chart)
        return fill_gaps(value, known)


@kernel
def blur(variance: Singles, chart: NDArray[np.int32]) -> Singles:
    """(h, w) the mean of the variances of the 7 × 7 texels around each in its chart: of rows, then
    of these along columns."""
    height, width = variance.shape
    sums, counts = np.zeros_like(variance), np.zeros_like(chart)
    for row in range(height):
        for column in range(width):
            if chart[row, column] < 0:
                continue
            for c in range(max(column - 3, 0), min(column + 4, width)):
                if chart[row, c] == chart[row, column]:
                    sums[row, column] += variance[row, c]
                    counts[row, column] += 1
    result = np.zeros_like(variance)
    for row in range(height):
        for column in range(width):
            if chart[row, column] < 0:
                continue
            total, count = 0.0, 0
            for r in range(max(row - 3, 0), min(row + 4, height)):
                if chart[r, column] == chart[row, column]:
                    total += sums[r, column]
                    count += counts[r, column]
            result[row, column] = total / count
    return result


@kernel
def smooth(
    value: Singles,
    variance: Singles,
    chart: NDArray[np.int32],
    step: int,
    least: float,
    stiff: float,
) -> tuple[Singles, Singles]:
    """One round: (h, w, k) ``value`` and its (h, w) ``variance`` after it; see `TexelGrid.smooth`
    and `_ROUNDS`."""
    height, width, channels = value.shape
    result, rest = np.zeros_like(value), np.zeros_like(variance)
    mean = np.zeros_like(variance)
    for k in range(channels):
        mean += value[:, :, k]
    share = np.empty(25)
    for row in range(height):
        for column in range(width):
            number = chart[row, column]
            if number < 0:
                continue
            centre = mean[row, column]
            sharp = 1 / (16 * channels * (_APART * np.sqrt(variance[row, column]) + least))
            total, x, y, xx, xy, yy, k = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
            for i in range(-2, 3):
                for j in range(-2, 3):
                    r, c, part = row + step * i, column + step * j, 0.0
                    if 0 <= r < height and 0 <= c < width and chart[r, c] == number:
                        # (1 - x / 16) ** 16, nearly exp(-x), in half the time.
                        part = max(1 - abs(centre - mean[r, c]) * sharp, 0.0)
                        part *= part
                        part *= part
                        part *= part
                        part *= part * _SPLINE[abs(i)] * _SPLINE[abs(j)]
                        total += part
                        x += part * i
                        y += part * j
                        xx += part * i * i
                        xy += part * i * j
                        yy += part * j * j
                    share[k] = part
                    k += 1
            # The first row of the inverse: weights of values for that of their plane here.
            first, second, third, whole = 1.0, 0.0, 0.0, total
            if stiff < np.inf:
                xx += stiff * total
                yy += stiff * total
                first = xx * yy - xy * xy
                second = xy * y - x * yy
                third = x * xy - xx * y
                whole = total * first + x * second + y * third
            for k in range(25):
                if share[k] > 0:
                    i, j = k // 5 - 2, k % 5 - 2
                    r, c = row + step * i, column + step * j
                    part = share[k] / whole * (first + second * i + third * j)
                    rest[row, column] += part * part * variance[r, c]
                    for a in range(channels):
                        result[row, column, a] += part * value[r, c, a]
    return np.maximum(result, 0), rest


@kernel
def grow(value: Singles, known: Bools, chart: NDArray[np.int32]) -> tuple[Singles, Bools]:
    """The (h, w, k) values and the (h, w) known ones, with those next to known ones in their
    chart, which have the mean of these."""
    height, width, channels = value.shape
    result, grown = value.copy(), known.copy()
    for row in range(height):
        for column in range(width):
            if known[row, column] or chart[row, column] < 0:
                continue
            count = 0
            for r in range(max(row - 1, 0), min(row + 2, height)):
                for c in range(max(column - 1, 0), min(column + 2, width)):
                    if known[r, c] and chart[r, c] == chart[row, column]:
                        count += 1
                        for k in range(channels):
                            result[row, column, k] += value[r, c, k]
            if count > 0:
                grown[row, column] = True
                for k in range(channels):
                    result[row, column, k] /= count
    return result, grown


#: Number of points of a face at which its light is computed.
POINTS = 8
#: Least dot product of the normals of faces whose corners in one place share a light.
SMOOTH = 0.8
#: Weight of the mean of a vertex's own points, beside the fit; rounds of conjugate gradients.
_STEADY = 0.01
_GRADIENTS = 24


def vertex_light(look: Look, corner: Floats, normal: Floats) -> Floats:
    """(T, 3, k) light of at least 0 at the corners of (T, 3, 3) faces with (T, 3) normals; ``look``
    is their light. Covered points do not count."""
    count = len(corner)
    share = _triangle_points()
    point = np.einsum("pk,tkx->tpx", share, corner).reshape(-1, 3)
    face = np.repeat(np.arange(count), POINTS)
    seen = look(face, point, turns(len(point))).astype(np.float64)
    sound = np.asarray(~np.isnan(seen).any(axis=1))
    mean = seen[sound].mean(axis=0) if sound.any() else np.zeros(seen.shape[1])
    seen = np.where(sound[:, None], seen, 0).reshape(count, POINTS, -1)
    number = sound.reshape(count, POINTS).sum(axis=1)
    usual = seen.sum(axis=1) / np.maximum(number, 1)[:, None]
    usual[number == 0] = mean
    seen = np.where(sound.reshape(count, POINTS, 1), seen, usual[:, None])
    vertex, area = _vertex_numbers(corner, normal), areas(corner) * (number > 0)
    fitted = np.stack([_fit(vertex, share, part, area) for part in np.moveaxis(seen, 2, 0)], axis=1)
    return np.maximum(fitted[vertex], 0.0)


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
    return number_by_way(order, place[order], facing).reshape(-1, 3)


@kernel
def number_by_way(order: Ints, place: Ints, way: Floats) -> Ints:
    """(n,) numbers, equal for rows in one place whose (n, 3) ways are nearly those of the first of
    them. ``order``: (n,) the rows by their ``place``."""
    number, given = np.empty(len(order), np.int64), 0
    first = np.empty(len(order), np.int64)  # the first row of each number
    for k in range(len(order)):
        if k == 0 or place[k] != place[k - 1]:
            low = given
        row, known = order[k], -1
        for candidate in range(low, given):
            cosine = 0.0
            for axis in range(3):
                cosine += way[first[candidate], axis] * way[row, axis]
            if cosine >= SMOOTH:
                known = candidate
                break
        if known < 0:
            known, first[given] = given, row
            given += 1
        number[row] = known
    return number


def _fit(vertex: Ints, share: Floats, seen: Floats, area: Floats) -> Floats:
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
    for _ in range(_GRADIENTS):
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
