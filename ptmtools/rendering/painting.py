"""Paints the surfaces of a view with the finest levels of their textures, by compiled kernels.

The pictures of sites have a painter of their own, without compiled code (`ptmtools.site.pictures`).
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.light.model import PROBE_SIZE
from ptmtools.output.representation import representations_in
from ptmtools.output.served import Served
from ptmtools.progress import Progress
from ptmtools.rendering.footprints import detail_of_pixels, footprints, show_colors
from ptmtools.rendering.kernels import shade
from ptmtools.rendering.light import lamps
from ptmtools.rendering.normal_maps import show_bumps, show_relief
from ptmtools.rendering.pyramids import Texels, alpha_of, read_levels, read_pyramids
from ptmtools.rendering.records import Shows, Sight, Triangles, image_of, own_levels
from ptmtools.rendering.tone import SKY, LitSurfaces, Tone


class ObjectPainter(Protocol):
    """Draws the objects of a database that have a representation, in views lit by a lamp."""

    def paint(
        self, sight: Sight, triangles: Triangles, lamps: Floats, loaded: Bools, shown: Floats
    ) -> None:
        """Lights the pixels ``shown`` (n, 3) of these objects instead of the ``lamps`` (m,) on
        their faces; ``loaded`` (C,): the cells that are drawn."""


class SurfacePainter:
    """The surfaces of a database. Each texture is decoded once: by `alpha`, or by `load`, which
    comes after that and before `colors`."""

    def __init__(
        self, served: Served, tone: Tone | None, *, max_side: int, lit: bool, progress: Progress
    ) -> None:
        """``tone``: of baked light, if there is any. ``max_side``: of the levels, 0 for all.
        ``lit``: by a lamp, instead of baked light."""
        self._served, self._surfaces, self._lit = served, served.surfaces, lit
        self._tone, self._light = tone, LitSurfaces(served)
        self._triangles = self._light.triangles
        self._max_side, self._progress = max_side, progress
        self._loaded = np.ones(served.cell_count, dtype=np.bool_)
        #: Textures that were decoded for their alpha, and that.
        self._decoded: dict[int, list[Texels]] = {}
        self._alpha: dict[int, Shows | None] = {}
        #: The triangles with one texture, in its own colours.
        self._alike = self._triangles._replace(
            texture=np.zeros_like(self._triangles.texture),
            color=np.ones_like(self._triangles.color),
        )

    def alpha(self, sight: Sight) -> tuple[Floats, Floats]:
        """See `ptmtools.rendering.layers.Alpha`, of pixels that show a texture."""
        texture = self._triangles.texture[sight.triangle]
        result, detail = np.ones(len(texture)), np.zeros(len(texture))
        for number in np.unique(texture).tolist():
            if number not in self._alpha:
                self._alpha[number] = self._read_alpha(number)
            shows = self._alpha[number]
            if shows is None:
                continue
            rows = np.flatnonzero(texture == number)
            part = sight._replace(triangle=sight.triangle[rows], ray=sight.ray[rows])
            value = np.empty((len(rows), 3))
            column = self._columns(shows)
            shade(part, self._alike, shows, self._loaded, column, value)
            result[rows] = value[:, 0] / 255
            _, moves = footprints(part, np.arange(len(rows)), self._triangles)
            levels = shows.pyramids.levels[0]
            size = shows.pyramids.size[0, levels - 1]
            detail[rows] = np.maximum(detail_of_pixels(moves, *size), levels - column[0])
        return result, detail

    def load(self, *triangles: NDArray[np.integer]) -> None:
        """Decodes the textures of all triangles, -1 for none, that `colors` will be asked for."""
        maps = self._light.textures.copy()
        if self._lit and self._surfaces.relief:
            maps.append(self._surfaces.relief.number)
        if self._surfaces.bumps:
            maps.append(self._surfaces.bumps.number)
        used: set[int] = set()
        for numbers in triangles:
            hit = np.unique(numbers[numbers >= 0])
            used.update(*(number[hit].tolist() for number in maps))
        pyramids = read_pyramids(self._served, self._progress, used, self._decoded)
        self._decoded.clear()
        self._alpha.clear()
        self._shows = own_levels(pyramids)
        self._column = self._columns(self._shows)
        if self._lit:
            self._lamps = lamps(self._surfaces.corner)
            kinds = representations_in(self._served.index)
            self._painters: list[ObjectPainter] = [
                kind.painter.load()(self._served) for kind in kinds
            ]

    def colors(self, sight: Sight) -> Floats:
        """(n, 3) colours of pixels, 0 to 255; of the background where they show nothing."""
        surfaces, triangles = self._surfaces, self._triangles
        shows, loaded, column = self._shows, self._loaded, self._column
        shown = np.empty((len(sight.ray), 3))
        shade(sight, triangles, shows, loaded, column, shown)
        if self._lit:
            for painter in self._painters:
                painter.paint(sight, triangles, self._lamps, loaded, shown)
            show_relief(sight, surfaces, shows, loaded, column, self._lamps, shown)
            show_colors(sight, triangles, surfaces.vertex_colors, shown)
            shown[sight.triangle < 0] = SKY
        else:
            self._light.show(sight, self._tone, self._codes, self._image, shown)
        show_bumps(sight, surfaces, shows, loaded, column, shown)
        return shown

    def layer(self, sight: Sight, share: Floats) -> tuple[Floats, Floats]:
        """See `ptmtools.rendering.layers.Paint`."""
        return self._light.layer(sight, self._tone, self._image, share, self.colors(sight))

    def _image(self, texture: int) -> Texels | None:
        return image_of(self._shows, self._column, texture, PROBE_SIZE)

    def _codes(self, sight: Sight, maps: Triangles) -> Floats:
        """(n, 3) of lightmaps, 0 to 255."""
        result = np.empty((len(sight.ray), 3))
        shade(sight, maps, self._shows, self._loaded, self._column, result)
        return result

    def _read_alpha(self, texture: int) -> Shows | None:
        rows = self._served.index["textures"]
        if rows[texture]["components"] not in (2, 4):
            return None
        self._progress(texture, len(rows), "decoding textures")
        levels = self._decoded[texture] = read_levels(self._served, texture)
        return own_levels(alpha_of(levels))

    def _columns(self, shows: Shows) -> Ints:
        """(T,) the columns of the finest levels of at most the allowed side."""
        size, column = shows.pyramids.size, shows.pyramids.levels
        if not self._max_side:
            return column
        within = (size.max(axis=2) <= self._max_side) & (size[:, :, 0] > 0)
        return np.asarray(np.minimum(np.maximum(within.sum(axis=1), 1), column))
