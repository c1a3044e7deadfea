"""Bakes the light of the cells: one task for each cell.

The surfaces of a cell share one lightmap of linear light. Objects of thousands of small
triangles have their light at vertices, as colours: an atlas would have a chart for each few of
them, and their coarser meshes take over colours, but no charts. So have objects that
``--apo`` replaces: their second coordinates are those of their relief.

The light is that of the model's own lightmaps, or ambient obscurance (`light.occlusion`) with that
of lamps and the sky (`light.mixing`). Of ambient light, a ray that meets nothing within reach
counts whole. More of it comes from above than from below, so that forms show where nothing is near:
a white statue in a white room. Indoors, all surfaces have something within reach in many
directions; so that pictures keep about their colours, all light is brightened (`exposed`).

A piece that shows both sides has the light of the side on which its cell lies. If that is either,
as of a screen within a room, the more open side counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas, plane_areas
from ptmtools.light.atlas import FILLED, unwrap
from ptmtools.light.lightmap import SMOOTH, bake, vertex_light
from ptmtools.light.looks import Painted, Rays, open_sides, planes
from ptmtools.light.mixing import Mix, Mixed
from ptmtools.light.occlusion import Surroundings, normals

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


@dataclass(frozen=True)
class Piece:
    """The surfaces of one cell.

    Attributes
    ----------
    corner: (n, 3, 3) float32 metres.
    object, shape: (n,) of the scene; of the cell, ascending.
    glass: (n,) whether the surface has no light of its own: it is seen through, or glows.
    dense: (n,) whether its light is at vertices.
    side: (n,) 1 where the front of a face counts, -1 the back, 0 the more open of the two.
    face: (n,) the triangle of the scene that it is a piece of.
    """

    corner: NDArray[np.float32]
    object: Ints
    shape: Ints
    glass: Bools
    dense: Bools
    side: NDArray[np.int8]
    face: Ints


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
    uv: NDArray[np.float32]
    vertex: NDArray[np.uint8]
    texels: NDArray[np.uint8] | None
    crowded: bool
    density: float = 1.0


@dataclass(frozen=True)
class Baking:
    """The shared input of all tasks.

    Attributes
    ----------
    around, options: what occludes, and the options.
    mix: lamps and the sky.
    painted: the light of the model's own lightmaps, for the faces of the scene, instead of rays.
    """

    around: Surroundings
    options: LightOptions
    mix: Mix = Mix()  # noqa: RUF009 - a frozen value
    painted: Painted | None = None

    def light(self, piece: Piece) -> CellLight:
        """The light of a cell. Raises MissingComponentError PTM-M100: xatlas is not installed."""
        count = int(piece.shape[-1]) + 1 if len(piece.shape) else 0
        dense, flat = piece.dense & ~piece.glass, ~piece.dense & ~piece.glass
        corner = piece.corner.astype(np.float64)
        mapped = np.zeros(count, np.bool_)
        mapped[piece.shape[flat]] = True
        uv = np.zeros((len(corner), 3, 2), np.float32)
        vertex = np.full((len(corner), 3), 255, np.uint8)
        side = self.sides(corner, piece.side)
        for own in _objects(piece.object, dense):
            look = self.look(corner[own], side[own], piece.face[own], _AT_VERTICES)
            vertex[own] = self._encoded(vertex_light(look, corner[own], normals(corner[own])))
        if not flat.any():
            return CellLight(mapped, uv, vertex, None, False)
        own = np.flatnonzero(flat)
        points, triangles = np.unique(piece.corner[own].reshape(-1, 3), axis=0, return_inverse=True)
        area, density = areas(corner[own]), self.options.light_density
        if self.painted is not None:
            density = min(density, self.painted.density(piece.face[own], area))
        sizes = _sizes(float(area.sum()), density)
        atlas = unwrap(
            points.astype(np.float64),
            triangles.reshape(-1, 3).astype(np.int32),
            sizes,
            padding=_PADDING,
            group=_groups(corner[own], side[own]),
        )
        look = self.look(corner[own], side[own], piece.face[own])
        size = atlas.side or sizes[-1]
        least = COVERED if self.painted is None else 0.0
        (lit,) = bake(look, corner[own], atlas, look.grain, (size,), least=least)
        uv[own] = atlas.uv
        texels_a_metre = size * math.sqrt(plane_areas(atlas.uv).sum() / max(area.sum(), 1e-9))
        reached = texels_a_metre / max(density, 1e-9)
        texels = self._encoded(lit.value)
        return CellLight(mapped, uv, vertex, texels, atlas.side is None, min(reached, 1.0))

    def sides(self, corner: Floats, side: NDArray[np.int8]) -> Floats:
        """(n,) 1 where the front of (n, 3, 3) faces is lit, -1 the back; ``side``: see `Piece`."""
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
    ) -> Rays | Mixed | Painted:
        """The light of (n, 3, 3) faces on their (n,) `sides`, by this share of the rays of the
        options; (n,) ``face``: see `Piece`."""
        if self.painted is not None:
            return replace(self.painted, source=self.painted.source[face])
        samples, reach = math.ceil(rays * self.options.light_samples), self.options.light_reach
        return self.mix.look(Rays(self.around, corner, samples, reach, side=side, above=ABOVE))

    def _encoded(self, light: Floats | Singles) -> NDArray[np.uint8]:
        """Light in 255ths: as exposed, or that of the model."""
        if self.painted is None:
            return encoded(light)
        return np.asarray(np.rint(255 * np.clip(light, REFLECTED, 1.0)), np.uint8)


def exposed(light: Floats | Singles) -> Floats:
    """Light with that by reflection, brightened, from 0 to 1."""
    return np.clip(EXPOSURE * (REFLECTED + (1 - REFLECTED) * light), 0.0, 1.0).astype(np.float64)


def encoded(light: Floats | Singles) -> NDArray[np.uint8]:
    """Light as exposed, in 255ths."""
    return np.rint(255 * exposed(light)).astype(np.uint8)


def _objects(number: Ints, chosen: Bools) -> list[Ints]:
    """The chosen pieces of each object."""
    return [np.flatnonzero(chosen & (number == one)) for one in np.unique(number[chosen]).tolist()]


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
