"""Light probes: the light around a point of a cell, which its glossy surfaces reflect.

A probe is a panorama, prefiltered for four roughnesses with the lobe of GGX (Karis 2013, Real
Shading in Unreal Engine 4: the normal is the direction of the view), each an octahedral map
(Cigolle et al. 2014) in one image of codes as those of lightmaps. One image streams like any
texture, and a client needs no cube map, whose faces browsers would filter as codes.

Clients project directions to a box (Lagarde and Zanuttini 2012). Its sides are where most of the
rays end that meet surfaces parallel to them, not those of the cell: these may lie behind a wall.

Tried and rejected: patches of the transport instead of lightmaps (they show as a mosaic on polished
floors); samples of the lobe instead of all texels (grain from lamps).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import arrays
from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.jit import kernel
from ptmtools.light.baked import BakedSurfaces
from ptmtools.light.building import BuildingLight
from ptmtools.light.lamps import lamps_near
from ptmtools.light.model import PROBE_MAPS, PROBE_SIZE, STOPS, light_codes
from ptmtools.light.occlusion import SPREAD
from ptmtools.scene.colors import luminance

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells

#: Rays for each texel of the sharpest map.
_RAYS = 4
#: White is at most this multiple of the median: brighter texels, lamps, would take all stops.
_BRIGHTEST = 256.0
#: Height of a viewer's eyes, metres; candidates for the centre along each axis of the cell.
_EYES, _GRID = 1.6, 5
#: Level rays from a candidate, their greatest length that counts, metres, and the power, beside
#: that length, of the share of rays that end at no back of a wall, which counts as this at least.
_LEVEL_RAYS, _GREATEST_LENGTH, _POWER_OF_SHARE, _LEAST_SHARE = 32, 10.0, 4.0, 1e-3
#: Least cosine of a surface to a side of the box that it counts for.
_PARALLEL = 0.9
#: The least distance from the centre to a side of the box, metres.
_NEAREST = 0.1


@dataclass(frozen=True)
class Probe:
    """The probe of a cell.

    Attributes
    ----------
    texels: (128, 192, 3) codes.
    white: of the codes. mean: luminance over all directions.
    centre, low, high: (3,) metres, the point, and the corners of the box.
    """

    texels: Singles
    white: float
    mean: float
    centre: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True)
class ProbeBaking:
    """The shared input of all probes.

    Attributes
    ----------
    building, surfaces: the light.
    faces: the scene's triangle of each face that rays meet.
    corner: (F, 3, 3) of these.
    """

    building: BuildingLight
    surfaces: BakedSurfaces
    faces: Ints
    corner: Floats

    def probe(self, candidates: Floats) -> Probe:
        """The probe at the best of (n, 3) points."""
        centre = self._most_open(candidates)
        way, solid = directions(PROBE_MAPS[0][2] - 2, _RAYS)
        seen, hit = self._look(centre, way)
        low, high = _box(centre, way, hit)
        light = seen.reshape(-1, _RAYS, 3).mean(axis=1)
        light += self._lamps(centre, way.reshape(-1, _RAYS, 3).mean(axis=1), solid)
        mean = float((luminance(light) * solid).sum() / solid.sum())
        maps = [light, *_prefilter(light)]
        middle = float(np.median(light.max(axis=1)))
        white = max(texels.max() for texels in maps)
        white = float(f"{min(white, _BRIGHTEST * middle) if middle > 0 else white:.3g}") or 1.0
        mean = max(mean, white * 2.0**-STOPS)
        image = np.empty((*PROBE_SIZE[::-1], 3), np.float32)
        image[:] = light_codes(light.mean(axis=0), white)
        for (column, row, side), texels in zip(PROBE_MAPS, maps, strict=True):
            codes = light_codes(texels.reshape(side - 2, side - 2, 3), white)
            image[row : row + side, column : column + side] = with_border(codes)
        return Probe(image, white, mean, centre, low, high)

    def _most_open(self, candidates: Floats) -> Floats:
        """The candidate farthest from walls: with the longest quarter of level rays, of which few
        end at the backs of walls. (By the mean of all rays it would be in a doorway.)"""
        angle = 2 * math.pi * np.arange(_LEVEL_RAYS) / _LEVEL_RAYS
        way = np.stack([np.cos(angle), np.zeros(_LEVEL_RAYS), np.sin(angle)], axis=1)
        scores = []
        for point in candidates:
            hit = self._cast(point, way)
            share = max((hit.front | (hit.face < 0)).mean(), _LEAST_SHARE)
            length = np.quantile(np.clip(hit.distance, _NEAREST, _GREATEST_LENGTH), 0.25)
            scores.append(math.log(length) + _POWER_OF_SHARE * math.log(share))
        return np.asarray(candidates[int(np.argmax(scores))])

    def _cast(self, point: Floats, way: Floats) -> _Hits:
        around = self.building.field.around
        if around.tree is None:
            nothing = np.full(len(way), -1)
            zero = np.zeros(len(way))
            never, none = np.full(len(way), np.inf), nothing > 0
            return _Hits(nothing, zero, zero, never, none, none, np.zeros(way.shape))
        origin = np.tile((point - around.middle).astype(np.float32), (len(way), 1))
        hit = around.tree.run(origin, way.astype(np.float32), output=True)
        face = hit["primID"].astype(np.int64)
        first = self.building.field.patches.first
        back = np.einsum("nx,nx->n", hit["Ng"], way) > 0
        front = (face >= 0) & (first[face, back.astype(np.int64)] >= 0)
        distance = np.where(face >= 0, hit["tfar"].astype(np.float64), np.inf)
        normal = arrays.units(hit["Ng"].astype(np.float64)) * np.where(back, -1, 1)[:, None]
        return _Hits(face, hit["u"], hit["v"], distance, front, back, normal)

    def _look(self, point: Floats, way: Floats) -> tuple[Floats, _Hits]:
        """(n, 3) what arrives from (n, 3) directions, and what they meet."""
        hit, daylight = self._cast(point, way), self.building.field.daylight
        light = np.where(way[:, 1:2] >= 0, daylight.sky, daylight.ground)
        rows = np.flatnonzero(hit.face >= 0)
        face = hit.face[rows]
        u, v = hit.u[rows].astype(np.float64), hit.v[rows].astype(np.float64)
        a, b, c = np.moveaxis(self.corner[face], 1, 0)
        at = a + u[:, None] * (b - a) + v[:, None] * (c - a)
        light[rows] = self.surfaces.radiance(self.faces[face], u, v, at, ~hit.back[rows])
        return light, hit

    def _lamps(self, point: Floats, way: Floats, solid: Floats) -> Floats:
        """(n, 3) what lamps without a surface add to the texels in (n, 3) directions, of (n,)
        steradians."""
        around, lamps = self.building.field.around, self.building.lamps
        single = lamps.groups()
        lamps = lamps.only(single[0] | single[1])
        result = np.zeros_like(way)
        if not len(lamps):
            return result
        lamps = lamps_near(lamps, point[None, None], self.building.usual)
        to, power, target = lamps.arrival(point, around.size)
        free = around.free(np.tile(point, (len(target), 1)), target)
        for k in np.flatnonzero(free & (power > 0)).tolist():
            texel = int(np.argmax(np.einsum("nx,x->n", way, to[k])))
            result[texel] += power[k] * lamps.color[k] / solid[texel]
        return result


@dataclass(frozen=True)
class _Hits:
    """What n rays meet: (n,) faces, -1 for none, barycentric coordinates, metres, whether the side
    is one that shows, and whether it is the back; (n, 3) normals of that side."""

    face: Ints
    u: NDArray[np.floating[Any]]
    v: NDArray[np.floating[Any]]
    distance: Floats
    front: Bools
    back: Bools
    normal: Floats


@cache
def directions(side: int, rays: int) -> tuple[Floats, Floats]:
    """(side² · rays, 3) unit directions, ``rays`` in each texel of an octahedral map, rows from the
    top, and (side²,) steradians of the texels."""
    row, column = np.divmod(np.arange(side * side), side)
    number = np.arange(rays * side * side).reshape(-1, rays)
    # One ray goes through the middle.
    across, along = ((number * step + 0.5) % 1.0 if rays > 1 else 0.5 for step in SPREAD)
    place = np.stack([column[:, None] + across, row[:, None] + along], axis=-1).reshape(-1, 2)
    corner = _octahedron(2 * place / side - 1)
    middle = _octahedron((2 * np.stack([column, row], axis=1) + 1) / side - 1)
    solid = (2 / side) ** 2 / np.linalg.norm(middle, axis=1) ** 3
    return corner / np.linalg.norm(corner, axis=1, keepdims=True), solid


def _octahedron(place: Floats) -> Floats:
    """(n, 3) points of an octahedron at (n, 2) places of its map, in [-1, 1]."""
    x, z = place.T
    y = 1 - np.abs(x) - np.abs(z)
    below = y < 0
    over, along = (1 - np.abs(z)) * np.where(x < 0, -1, 1), (1 - np.abs(x)) * np.where(z < 0, -1, 1)
    return np.stack([np.where(below, over, x), y, np.where(below, along, z)], axis=1)


def _prefilter(light: Floats) -> list[Singles]:
    """(m, 3) each of the maps but the first, for (n, 3) light of the first."""
    side = PROBE_MAPS[0][2] - 2
    # No lobe is as narrow as two texels.
    source = light.reshape(side // 2, 2, side // 2, 2, 3).mean(axis=(1, 3)).astype(np.float32)
    # A lobe looks alike in all quarters of a map: they are filtered as twelve colours of one.
    quarters = [source[::down, ::across] for down in (1, -1) for across in (1, -1)]
    colors = np.ascontiguousarray(np.stack(quarters, axis=2).reshape(-1, 12))
    result = []
    for number, (_, _, border) in enumerate(PROBE_MAPS[1:], 1):
        alpha, target = (number / (len(PROBE_MAPS) - 1)) ** 2, border - 2
        half = target // 2
        filtered = weigh(_lobes(target, side // 2, alpha), colors).reshape(half, half, 2, 2, 3)
        texels = np.empty((target, target, 3), np.float32)
        for down, across in ((0, 0), (0, 1), (1, 0), (1, 1)):
            turned = texels[:: 1 - 2 * down, :: 1 - 2 * across]
            turned[:half, :half] = filtered[:, :, down, across]
        result.append(texels.reshape(-1, 3))
    return result


@cache
def _lobes(target: int, side: int, alpha: float) -> Singles:
    """(m, side²) the shares of the texels of a map of ``side`` in what a surface of GGX ``alpha``
    reflects towards each texel of the upper left quarter of one of ``target``, which is even; the
    normal is that direction."""
    half, (way, solid) = target // 2, directions(side, 1)
    to = directions(target, 1)[0].reshape(target, target, 3)[:half, :half].reshape(-1, 3)
    return share_lobes(to, way, solid, alpha)


@kernel
def share_lobes(target: Floats, way: Floats, solid: Floats, alpha: float) -> Singles:
    """(m, n) the shares of (n, 3) directions of (n,) steradians; see `_lobes`."""
    result = np.zeros((len(target), len(way)), np.float32)
    for t in range(len(target)):
        total = 0.0
        for s in range(len(way)):
            cosine = target[t, 0] * way[s, 0] + target[t, 1] * way[s, 1] + target[t, 2] * way[s, 2]
            if cosine <= 0:
                continue
            across = 0.5 * (1 + cosine) * (alpha * alpha - 1) + 1
            result[t, s] = solid[s] * cosine / (across * across)
            total += result[t, s]
        for s in range(len(way)):
            result[t, s] /= total
    return result


@kernel
def weigh(share: Singles, light: Singles) -> Singles:
    """(m, k) the product of (m, n) shares and (n, k) light, the same for any number of threads."""
    result = np.zeros((len(share), light.shape[1]), np.float32)
    for t in range(len(share)):
        for s in range(len(light)):
            weight = share[t, s]
            if weight == 0:
                continue
            for c in range(light.shape[1]):
                result[t, c] += weight * light[s, c]
    return result


def with_border(codes: Singles) -> Singles:
    """A map with a border of a texel, which repeats those on the other side of an edge."""
    side = len(codes)
    result = np.empty((side + 2, side + 2, 3), codes.dtype)
    result[1:-1, 1:-1] = codes
    result[0, 1:-1], result[-1, 1:-1] = codes[0, ::-1], codes[-1, ::-1]
    result[1:-1, 0], result[1:-1, -1] = codes[::-1, 0], codes[::-1, -1]
    result[[0, 0, -1, -1], [0, -1, 0, -1]] = codes[[-1, -1, 0, 0], [-1, 0, -1, 0]]
    return result


def _box(point: Floats, way: Floats, hit: _Hits) -> tuple[Floats, Floats]:
    """(3,) and (3,) the corners of a box around a point: each side is where most of the rays end
    that meet a surface parallel to it. A side without is as far as the farthest surface."""
    met = hit.face >= 0
    end, normal = (way * np.where(met, hit.distance, 0)[:, None])[met], hit.normal[met]
    farthest = hit.distance[met].max(initial=1.0)
    sides = np.zeros((2, 3))
    for axis in range(3):
        for side, sign in enumerate((-1, 1)):
            reached = sign * end[-sign * normal[:, axis] > _PARALLEL, axis]
            reached = reached[reached > 0]
            sides[side, axis] = np.median(reached) if len(reached) else farthest
    sides = np.maximum(sides, _NEAREST)
    return point - sides[0], point + sides[1]


def candidates(cells: Cells, cell: int) -> Floats:
    """(n, 3) points of a cell at which its probe may be: a grid at the height of the eyes, or the
    middles of its parts."""
    parts = [
        cells.leaf_point[slice(*cells.leaf_point_start[leaf : leaf + 2].tolist())]
        for leaf in np.flatnonzero(cells.leaf_cell == cell)
    ]
    points = np.concatenate(parts)
    low, high = points.min(axis=0), points.max(axis=0)
    share = (np.arange(_GRID) + 0.5) / _GRID
    grid = np.stack(np.meshgrid(share, [0.0], share), axis=-1).reshape(-1, 3)
    grid = low + (high - low) * grid
    grid[:, 1] = low[1] + min(_EYES, (high[1] - low[1]) / 2)
    inside = grid[cells.locate(grid) == cell]
    return inside if len(inside) else np.stack([part.mean(axis=0) for part in parts])
