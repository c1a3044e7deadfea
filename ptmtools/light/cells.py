"""Bakes the light of the cells: one task for each cell.

The surfaces of a cell share one lightmap of linear light. Objects of thousands of small
triangles have their light at vertices, as colours: an atlas would have a chart for each few of
them, and their coarser meshes take over colours, but no charts. So have objects that
``--apo`` replaces: their second coordinates are those of their relief.

The light is that of the model's own lightmaps, or ambient obscurance (`light.occlusion`) with that
of lamps and the sky (`light.mixing`). Of ambient light, a ray that meets nothing within reach
counts whole. More of it comes from above than from below, so that forms show where nothing is near:
a white statue in a white room. Indoors, all surfaces have something within reach in many
directions; so that pictures keep about their colours, all light is brightened (`expose`).

A piece that shows both sides has the light of the side on which its cell lies. If that is either,
as of a screen within a room, the more open side counts.
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
from ptmtools.light.lightmap import SMOOTH, bake, vertex_light
from ptmtools.light.looks import SMALLEST, PaintedLight, RayLight, open_sides, planes
from ptmtools.light.mixing import LightMix, MixedLight
from ptmtools.light.model import CellSurfaces, light_codes
from ptmtools.light.occlusion import Occluders, normals
from ptmtools.scene.colors import encode_srgb

if TYPE_CHECKING:
    from ptmtools.light.options import LightOptions

#: Share of the light from straight above that comes from straight below is 1 less this.
ABOVE = 0.4
#: Share of the light that comes everywhere, by reflection, and the factor of all light, which is
#: then cut off at 1.
REFLECTED, EXPOSURE = 0.15, 1.05
#: The light that shows as white.
WHITE = (1 / EXPOSURE - REFLECTED) / (1 - REFLECTED)
#: Rays from a point of a face with light at vertices, of those from a texel. A vertex has the light
#: of many points: half of the rays add up to 1.1 of 255 to the error, for half of the time. (Half
#: of the points took as long; the error was 0.2 less in an apartment, 0.5 more in a cave.)
_AT_VERTICES = 0.5
#: Texels with less light are covered, as a wall by a picture, and take that of their neighbours: a
#: texel is wider than the gap that it would darken.
COVERED = 0.03
#: The side of a lightmap is a multiple of this, so that four of its levels halve exactly,
_MULTIPLE = 16
#: and at most this, texels.
_LARGEST = 2048
#: Texels between charts: coordinates are rounded by up to a tenth of a texel in GLBs, and would
#: read the edge of another chart, a thin dark line.
_PADDING = 1
#: By default, lightmaps are to have at most this share of the bytes of the model's images. Fewer
#: texels to the metre are tried before there is no light at all: an office with one image of 60 kB
#: would get lightmaps of 390 kB.
SHARE = 0.1
#: The least share of the texels to the metre.
LEAST = 0.5
#: Texels of the smallest lightmap: a building with fewer shows no light, but is of another scale.
_SMALLEST = 16**2
#: Bytes of a texel (0.24 in a hospital, 0.25 in an office, 0.38 in a museum).
_TEXEL_BYTES = 0.3


@dataclass(frozen=True)
class CellLight:
    """The light of one cell: see `Light`.

    Attributes
    ----------
    texels: (side, side) uint8 linear light, of 255; None without a lightmap.
    crowded: whether neighbours in the lightmap run into each other.
    density: texels to the metre, of those that were asked for; 1 without a lightmap.
    """

    mapped: Bools
    lit: Bools
    uv: NDArray[np.float32]
    vertex: NDArray[np.uint8]
    texels: NDArray[np.uint8] | None
    crowded: bool
    density: float = 1.0


@dataclass(frozen=True)
class LightBaking:
    """The shared input of all tasks.

    Attributes
    ----------
    around, options: what occludes, and the options.
    mix: lamps and the sky.
    painted: the light of the model's own lightmaps, for the faces of the scene, instead of rays.
    """

    around: Occluders
    options: LightOptions
    mix: LightMix = LightMix()  # noqa: RUF009 - a frozen value
    painted: PaintedLight | None = None

    def light(self, piece: CellSurfaces) -> CellLight:
        """The light of a cell. Raises MissingComponentError PTM-M100: xatlas is not installed."""
        count = int(piece.shape[-1]) + 1 if len(piece.shape) else 0
        dense, flat = piece.dense & ~piece.glass, ~piece.dense & ~piece.glass
        corner = piece.corner.astype(np.float64)
        mapped = np.zeros(count, np.bool_)
        mapped[piece.shape[flat]] = True
        shown = np.zeros(count, np.bool_)
        shown[piece.shape[~piece.glass]] = True
        uv = np.zeros((len(corner), 3, 2), np.float32)
        vertex = np.full((len(corner), 3, 3), 255, np.uint8)
        side = self.sides(corner, piece.side)
        for rows in _objects(piece.object, dense):
            look = self.look(corner[rows], side[rows], piece.face[rows], _AT_VERTICES)
            grey = self._encode(vertex_light(look, corner[rows], normals(corner[rows])))
            vertex[rows] = encode_srgb(grey / 255.0)[..., None]
        if not flat.any():
            return CellLight(mapped, shown, uv, vertex, None, False)
        rows = np.flatnonzero(flat)
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
        look = self.look(corner[rows], side[rows], piece.face[rows])
        size = atlas.side or sizes[-1]
        least = COVERED if self.painted is None else 0.0
        (lit,) = bake(look, corner[rows], atlas, look.grain, (size,), least=least)
        uv[rows] = atlas.uv
        texels_a_metre = size * math.sqrt(plane_areas(atlas.uv).sum() / max(area.sum(), SMALLEST))
        reached = texels_a_metre / max(density, SMALLEST)
        texels = np.repeat(light_codes(self._encode(lit.value) / 255.0, 1.0)[..., None], 3, axis=2)
        return CellLight(mapped, shown, uv, vertex, texels, atlas.side is None, min(reached, 1.0))

    def sides(self, corner: Floats, side: NDArray[np.int8]) -> Floats:
        """(n,) 1 where the front of (n, 3, 3) faces is lit, -1 the back; ``side``: see
        `CellSurfaces`."""
        either = side == 0
        result = np.where(side < 0, -1.0, 1.0)
        if either.any() and self.painted is None:
            reach = self.options.light_reach
            result[either] = open_sides(
                self.around, corner[either], either[either], reach, indoors=True
            )
        return result

    def look(
        self, corner: Floats, side: Floats, face: Ints, rays: float = 1.0
    ) -> RayLight | MixedLight | PaintedLight:
        """The light of (n, 3, 3) faces on their (n,) `sides`, by this share of the rays of the
        options; (n,) ``face``: see `CellSurfaces`."""
        if self.painted is not None:
            return replace(self.painted, source=self.painted.source[face])
        samples, reach = math.ceil(rays * self.options.light_samples), self.options.light_reach
        return self.mix.look(RayLight(self.around, corner, samples, reach, side=side, above=ABOVE))

    def _encode(self, light: Floats | Singles) -> NDArray[np.uint8]:
        """Light in 255ths: as exposed, or that of the model."""
        if self.painted is None:
            return encode(light)
        return np.asarray(np.rint(255 * np.clip(light, REFLECTED, 1.0)), np.uint8)


def expose(light: Floats | Singles) -> Floats:
    """Light with that by reflection, brightened, from 0 to 1."""
    return np.clip(EXPOSURE * (REFLECTED + (1 - REFLECTED) * light), 0.0, 1.0).astype(np.float64)


def encode(light: Floats | Singles) -> NDArray[np.uint8]:
    """Light as exposed, in 255ths."""
    return np.rint(255 * expose(light)).astype(np.uint8)


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


def round_bytes(images: int) -> int:
    """The bytes of images, or somewhat less: a power of two, so that light stays the same if they
    are repainted; 0 for none."""
    return 1 << images.bit_length() - 1 if images else 0


def expected_bytes(pieces: Sequence[CellSurfaces], density: float) -> float:
    """The bytes that lightmaps are expected to have; ``density``: texels to the metre."""
    flat = (surfaces.corner[~surfaces.dense & ~surfaces.glass] for surfaces in pieces)
    area = sum(float(areas(corner.astype(np.float64)).sum()) for corner in flat)
    return area / FILLED * density**2 * _TEXEL_BYTES


def affordable_density(pieces: Sequence[CellSurfaces], density: float, images: int) -> float:
    """The texels to the metre of lightmaps beside images of a number of bytes (`round_bytes`), at
    most ``density``; 0 if light would cost too much, or there is no surface for it."""
    cost = expected_bytes(pieces, density)
    if cost < _SMALLEST * _TEXEL_BYTES:
        return 0.0
    fitting = min(1.0, math.sqrt(SHARE * images / cost))
    return density * fitting if fitting >= LEAST else 0.0
