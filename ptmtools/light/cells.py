"""Bakes the light of the cells: one task for each cell.

The surfaces of a cell share one lightmap. Objects of thousands of small triangles have their light
at vertices, as colours: an atlas would have a chart for each few of them, and their coarser meshes
take over colours, but no charts. So have objects that ``--apo`` replaces: their second coordinates
are those of their relief.

The light is that of the model's own lightmaps, or that of the building (`light.building`): what the
sky and surfaces send, without its grain, and what lamps send. Texels that something covers, as a
wall by a picture, take that of their neighbours.

A piece that shows both sides has the light of the side on which its cell lies. If that is either,
as of a screen within a room, the side with more light counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas, plane_areas
from ptmtools.light.atlas import FILLED, unwrap
from ptmtools.light.building import BuildingLight
from ptmtools.light.lightmap import SMOOTH, TexelGrid, vertex_light
from ptmtools.light.looks import SMALLEST, Look, PaintedLight, planes
from ptmtools.light.model import CellSurfaces, light_codes
from ptmtools.light.occlusion import normals
from ptmtools.light.options import RANGES
from ptmtools.scene.colors import encode_srgb, luminance

if TYPE_CHECKING:
    from ptmtools.light.options import LightOptions

#: Rays from a point of a face with light at vertices, of those from a texel: a vertex has the light
#: of many points.
_AT_VERTICES = 0.125
#: The least light of the model's own lightmaps.
_PAINTED = 0.15
#: Each texel has this share of the rays of the options at first.
_FIRST = 0.5
#: Texels among whose neighbours the deviation is more than this share of their light, beside
#: `_DIM` of the usual light, have this multiple of the first rays more, turned by `_AGAIN` of a
#: turn for each. (All rays for each texel: the hospital has 1.5 times as many, and the same error.)
_MORE = ((0.1, 1), (0.3, 6))
_DIM, _AGAIN = 0.1, 0.381966
#: Differences of light by this share of the usual one do not show.
_LEAST = 0.01
#: The share of a cell's light that its white is not less than, and how much more it is, so that
#: codes of bright light have room for their hue.
_WHITE, _ROOM = 0.995, 1.9
#: What shows as this many times white shows as no more: the spot beside a lamp would take the codes
#: of the room.
_GLARE = 4.0
#: The factor by which exposures of cells differ from that of the building at most.
FARTHEST = 4.0
#: The mean of the logarithms of what surfaces reflect shows as this, as that of a photograph does,
#: and a white surface in the usual light as the other number, so that white rooms are not grey.
_KEY, _KEY_OF_WHITE = 0.3, 0.7
#: The share of the surfaces that is no brighter than the other number: white walls keep their
#: texture.
_HIGH, _MOST_OF_WHITE = 0.9, 0.65
#: Eyes get used to this share of a hue, as photographers balance white, a logarithm; and components
#: of light count as at least this share of its luminance.
_ADAPTATION, _LEAST_HUE = 0.7, 0.1
#: The side of a lightmap is a multiple of this, so that four of its levels halve exactly,
_MULTIPLE = 16
#: and at most this, texels.
_LARGEST = 2048
#: Texels between charts: coordinates are rounded by up to a tenth of a texel in GLBs, and would
#: read the edge of another chart, a thin dark line.
_PADDING = 1
#: By default, lightmaps are to have at most this share of the bytes of the model's images, or this
#: number of bytes, whichever is more. They have fewer texels to the metre if necessary.
SHARE, BYTES = 0.1, 400_000
#: Beside a small model it is less: this, the images, and this for each triangle, as in a file.
LEAST, TRIANGLE = 16_000, 24
#: Texels of the smallest lightmap: a building with fewer shows no light, but is of another scale.
_SMALLEST = 16**2
#: Bytes of a texel.
_TEXEL_BYTES = 0.12


@dataclass(frozen=True)
class CellLight:
    """The light of one cell: see `Light`.

    Attributes
    ----------
    white: the light of which texels and `vertex` are shares.
    texels: (side, side, 3) codes, see `light_codes`; None without a lightmap.
    exposure, balance: logarithms of the factor with which it shows by itself, and (3,) of those of
        red, green and blue beside it, see `_exposure`.
    area: of its lit surfaces, m².
    crowded: whether neighbours in the lightmap run into each other.
    density: texels to the metre, of those that were asked for; 1 without a lightmap.
    """

    mapped: Bools
    lit: Bools
    uv: Singles
    vertex: NDArray[np.uint8]
    white: float
    texels: Singles | None
    exposure: float
    balance: Floats
    area: float
    crowded: bool
    density: float = 1.0


@dataclass(frozen=True)
class LightBaking:
    """The shared input of all tasks.

    Attributes
    ----------
    options: of the stage.
    building: the light of the building; None if the model has its own,
    painted: for the faces of the scene.
    reflectance: (T,) luminance of the mean colour of each face of the scene.
    """

    options: LightOptions
    building: BuildingLight | None
    painted: PaintedLight | None
    reflectance: Singles

    def light(self, piece: CellSurfaces) -> CellLight:
        """The light of a cell. Raises MissingComponentError PTM-M100: xatlas is not installed."""
        count = int(piece.shape[-1]) + 1 if len(piece.shape) else 0
        dense, flat = piece.dense & ~piece.glass, ~piece.dense & ~piece.glass
        corner = piece.corner.astype(np.float64)
        lit, mapped = np.zeros((2, count), np.bool_)
        lit[piece.shape[~piece.glass]] = True
        mapped[piece.shape[flat]] = True
        side = self.sides(corner, piece)
        vertex = np.zeros((len(corner), 3, 3), np.float32)
        for rows in _objects(piece.object, dense):
            look = self._look(piece, corner, side, rows, _AT_VERTICES)
            vertex[rows] = vertex_light(look, corner[rows], normals(corner[rows]))
        uv, texels, rest = np.zeros((len(corner), 3, 2), np.float32), None, (False, 1.0)
        rows = np.flatnonzero(flat)
        samples = [vertex[dense].mean(axis=1)]
        weights = [areas(corner[dense])]
        faces = [piece.face[dense]]
        if len(rows):
            grid, uv[rows], rest = self._grid(piece, corner, side, rows)
            light = self._texels(piece, corner, side, rows, grid)
            texels = grid.fill(light)
            samples.append(np.nan_to_num(light))
            faces.append(piece.face[rows[grid.face]])
            area = areas(corner[rows]).sum() / max(len(light), 1)
            weights.append(np.where(np.isnan(light[:, 0]), 0.0, area))
        sample, weight = np.concatenate(samples), np.concatenate(weights)
        reflectance = self.reflectance[np.concatenate(faces)]
        shown = _exposure(sample.astype(np.float64), reflectance, weight)
        white = self._white(sample, reflectance, weight, shown[0])
        shares = encode_srgb(vertex.astype(np.float64) / white)
        shares = np.where(dense[:, None, None], shares, np.uint8(255))
        codes = None if texels is None else light_codes(texels, white)
        return CellLight(mapped, lit, uv, shares, white, codes, *shown, *rest)

    def sides(self, corner: Floats, piece: CellSurfaces) -> Floats:
        """(n,) 1 where the front of (n, 3, 3) faces is lit, -1 the back."""
        either = (piece.side == 0) & ~piece.glass
        result = np.where(piece.side < 0, -1.0, 1.0)
        if either.any() and self.building is not None:
            result[either] = self.building.brighter_sides(corner[either])
        return result

    def _grid(
        self, piece: CellSurfaces, corner: Floats, side: Floats, rows: Ints
    ) -> tuple[TexelGrid, Floats, tuple[bool, float]]:
        """The texels of the lightmap of some pieces, their coordinates in it, and the last two
        fields of `CellLight`."""
        points, triangles = np.unique(
            piece.corner[rows].reshape(-1, 3), axis=0, return_inverse=True
        )
        area, density = areas(corner[rows]), self.options.light_density
        if self.painted is not None:
            density = min(density, self.painted.density(piece.face[rows], area))
        sizes = _sizes(float(area.sum()), density)
        atlas = unwrap(
            points.astype(np.float64),
            triangles.reshape(-1, 3).astype(np.int32),
            sizes,
            padding=_PADDING,
            group=_groups(corner[rows], side[rows]),
        )
        size = atlas.side or sizes[-1]
        texels_a_metre = size * math.sqrt(plane_areas(atlas.uv).sum() / max(area.sum(), SMALLEST))
        reached = texels_a_metre / max(density, SMALLEST)
        grid = TexelGrid.of_atlas(corner[rows], atlas, size)
        return grid, atlas.uv, (atlas.side is None, min(reached, 1.0))

    def _texels(
        self, piece: CellSurfaces, corner: Floats, side: Floats, rows: Ints, grid: TexelGrid
    ) -> Singles:
        """(n, 3) the light of the texels; NaN where something covers them."""
        turn = grid.turns()
        if self.building is None:
            look = self._look(piece, corner, side, rows, 1.0)
            return np.repeat(look(grid.face, grid.points(), turn), 3, axis=1)
        near = 0.5 * grid.texel
        # Of one ray no variance is known.
        first = max(2, math.ceil(self.options.light_samples * _FIRST))
        lit = self.building.look(corner[rows], side[rows], first, near)
        point = grid.reading_points(lit.goes_on)
        light, variance, covered = lit.indirect(grid.face, point, turn)
        # What few rays meet, as a window far away, is missed by most of the texels around.
        rays = np.ones(len(light), np.float32)
        for grain, times in _MORE:
            bright = light.mean(axis=1) + _DIM * self.building.usual
            grainy = np.flatnonzero(grid.blur(variance) > (grain * bright) ** 2)
            more, rest, _ = lit.indirect(
                grid.face[grainy], point[grainy], (turn[grainy] + times * _AGAIN) % 1.0, times
            )
            rays[grainy] += times
            share = times / rays[grainy]
            light[grainy] += share[:, None] * (more - light[grainy])
            variance[grainy] = rest * share
        # A gap narrower than a texel, all of which is covered, has the light that it has.
        light[covered & grid.is_in_chart_of(~covered)] = np.nan
        indirect = grid.smooth(light, variance, _LEAST * self.building.usual)
        return np.asarray(indirect + lit.direct(grid.face, point, turn), np.float32)

    def _look(
        self, piece: CellSurfaces, corner: Floats, side: Floats, rows: Ints, rays: float
    ) -> Look:
        """The light of some pieces, by this share of the rays of the options."""
        if self.painted is not None:
            return _brighten(replace(self.painted, source=self.painted.source[piece.face[rows]]))
        assert self.building is not None
        samples = math.ceil(rays * self.options.light_samples)
        return self.building.look(corner[rows], side[rows], samples, 0.0)

    def _white(
        self, light: Singles, reflectance: Singles, weight: Floats, exposure: float
    ) -> float:
        """The white of a cell with this (n, 3) light on surfaces of (n,) reflectance, and this
        logarithm of its exposure."""
        if self.building is None:
            return 1.0
        exposure = min(exposure, math.log(FARTHEST * _KEY_OF_WHITE / self.building.usual))
        glare = _GLARE / (math.exp(exposure) * np.maximum(reflectance.astype(float), SMALLEST))
        bright = np.minimum(light.max(axis=1, initial=0.0), glare)[weight > 0]
        white = _ROOM * float(np.quantile(bright, _WHITE)) if len(bright) else 0.0
        # Three digits, as in GLBs.
        return float(f"{white:.3g}") if white > 0 else self.building.usual


def _brighten(painted: PaintedLight) -> Look:
    def look(face: Ints, point: Floats, turn: Floats) -> Singles:
        return np.maximum(painted(face, point, turn), np.float32(_PAINTED))

    return look


def _exposure(light: Floats, reflectance: Singles, weight: Floats) -> tuple[float, Floats, float]:
    """Logarithms of the factor with which (n, 3) light of this weight shows on surfaces of (n,)
    reflectance, and (3,) of those that balance white; the weight of what is not black."""
    bright = luminance(light)
    radiance = bright * reflectance
    shows = np.flatnonzero((radiance > 0) & (weight > 0))
    if not len(shows):
        return 0.0, np.zeros(3), 0.0
    order = shows[np.argsort(radiance[shows], kind="stable")]
    total = np.cumsum(weight[order])
    # No dot product: its rounding follows the number of threads.
    reflected, sent = (
        float((weight[order] * np.log(values[order])).sum()) / float(total[-1])
        for values in (radiance, bright)
    )
    high = radiance[order[np.searchsorted(total, _HIGH * total[-1])]]
    wished = max(math.log(_KEY) - reflected, math.log(_KEY_OF_WHITE) - sent)
    exposure = min(wished, math.log(_MOST_OF_WHITE / high))
    # Eyes get used to what is bright, but not to what glares, as a wall beside a lamp.
    seen = weight[order] * np.minimum(1.0, high / radiance[order])
    mean_light = (seen[:, None] * reflectance[order, None] * light[order]).sum(axis=0)
    tint = np.log(np.maximum(mean_light / luminance(mean_light), _LEAST_HUE))
    balanced = (1 - _ADAPTATION) * tint
    # A white surface keeps its luminance.
    kept = np.log(luminance(np.exp(tint)) / luminance(np.exp(balanced)))
    return exposure, balanced - tint + kept, float(total[-1])


def _objects(number: Ints, chosen: Bools) -> list[Ints]:
    """The chosen pieces of each object."""
    return [
        np.flatnonzero(chosen & (number == object_number))
        for object_number in np.unique(number[chosen]).tolist()
    ]


def _groups(corner: Floats, side: Floats) -> Ints:
    """(n,) numbers, equal for faces that one chart may have: light differs on the two sides of an
    edge, and of a wall."""
    normal = normals(corner)
    smooth = planes(corner, normal, np.ones(len(corner), np.bool_), SMOOTH)
    along = np.einsum("nx,nx->n", normal, normal[smooth])
    return np.asarray(2 * smooth + (side * along > 0))


def _sizes(area: float, density: float) -> tuple[int, ...]:
    """The sides of lightmaps to try for an area, m², with ``density`` texels to the metre."""
    texels = math.sqrt(area / FILLED) * density
    side = min(_LARGEST, _MULTIPLE * max(1, math.ceil(texels / _MULTIPLE)))
    return tuple(dict.fromkeys(min(_LARGEST, side * k) for k in (1, 2, 4)))


def expected_bytes(pieces: Sequence[CellSurfaces], density: float) -> float:
    """The bytes that lightmaps are expected to have; ``density``: texels to the metre."""
    flat = (surfaces.corner[~surfaces.dense & ~surfaces.glass] for surfaces in pieces)
    area = sum(float(areas(corner.astype(np.float64)).sum()) for corner in flat)
    return area / FILLED * density**2 * _TEXEL_BYTES


def affordable_density(pieces: Sequence[CellSurfaces], density: float, images: int) -> float:
    """The texels to the metre of lightmaps beside ``images`` bytes of images, at most
    ``density``; 0 if there is no surface for light, or too much of it for the options."""
    cost = expected_bytes(pieces, density)
    if cost < _SMALLEST * _TEXEL_BYTES:
        return 0.0
    faces = np.unique(np.concatenate([surfaces.face for surfaces in pieces]))
    model = LEAST + images + TRIANGLE * len(faces)
    reached = density * min(1.0, math.sqrt(max(SHARE * images, min(BYTES, model)) / cost))
    return reached if reached >= RANGES["light_density"][0] else 0.0
