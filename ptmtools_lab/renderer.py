"""Renders frames of a walk with the levels that a client has, or with all.

As in the tables, the level of detail is that of the screen of the walk, of 1080 lines unless it was
recorded: a smaller picture is the same one scaled down. At 960 × 540 with two samples each way the
samples are the pixels of the screen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.light.model import PROBE_SIZE
from ptmtools.rendering.light import lamps
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.rendering.records import Shows, Sight, Triangles, image_of, own_levels
from ptmtools.rendering.tone import LitSurfaces, show_vertex_light, tone_at
from ptmtools_lab.lossy import pictures

if TYPE_CHECKING:
    from ptmtools_lab.world import World


class FrameRenderer:
    """Renders pictures of ``height`` lines with the aspect of the walk, with ``samples`` each way
    of every pixel."""

    def __init__(self, world: World, height: int, samples: int = 2) -> None:
        self.height, self.samples = height, samples
        self.width = max(1, round(height * world.camera.aspect))
        self._world, self._full = world, own_levels(world.pyramids)
        self._shows = pictures(world.pyramids, world.lossy) if world.shows is None else world.shows
        camera = world.camera
        self._camera = RayCamera(
            self.width * samples,
            height * samples,
            camera.field_of_view,
            camera.aspect,
            camera.lines,
        )
        #: Pictures with a lamp, or against another database, show no lightmaps.
        self._served = show_vertex_light(world.served) if world.relief else world.served
        self._light = LitSurfaces(self._served)
        self._triangles = self._light.triangles
        self._caster = Caster(world.served.surfaces)
        self._lamps = lamps(world.served.surfaces.corner) if world.relief else np.zeros(0)

    def look(self, eye: Floats, direction: Floats) -> Sight:
        """The surfaces seen from an eye (3,) in a direction (3,)."""
        return self._caster.look(self._camera, eye, direction)

    def colors(self, sight: Sight, loaded: Bools, state: Ints) -> Floats:
        """(height, width, 3) 0 to 255, with the loaded geometry of cells (C,) and a state (T,) of
        each texture."""
        return self._draw(sight, self._shows, loaded, state)

    def full(self, sight: Sight) -> Floats:
        """The full picture, whatever the form of the textures: all levels of the pyramids and of
        octrees, or the reference of the walk."""
        relief = self._world.relief
        if relief and relief.reference:
            return self._picture(relief.reference.full_picture(relief.reference.look(sight)))
        loaded = np.ones(self._world.catalogue.cell_count, dtype=np.bool_)
        last = self._full.last
        if relief:
            last = np.concatenate([last, relief.octrees.levels])
        return self._draw(sight, self._full, loaded, last)

    def _draw(self, sight: Sight, shows: Shows, loaded: Bools, column: Ints) -> Floats:
        from ptmtools.rendering.kernels import GREY, shade
        from ptmtools.rendering.normal_maps import show_bumps, show_relief

        surfaces, shown = self._world.served.surfaces, np.empty((len(sight.ray), 3))
        shade(sight, self._triangles, shows, loaded, column, shown)
        if self._world.relief:
            from ptmtools_systems.apo.lighting import relieve

            octrees, first = self._world.relief.octrees, len(self._world.pyramids.levels)
            resident = column[first : first + octrees.number]
            relieve(sight, self._triangles, self._lamps, octrees, loaded, resident, shown)
            show_relief(sight, surfaces, shows, loaded, column, self._lamps, shown)
        elif tone := tone_at(self._served, sight.eye):

            def codes(part: Sight, maps: Triangles) -> Floats:
                result = np.empty((len(part.ray), 3))
                shade(part, maps, shows, loaded, column, result)
                return result

            def images(texture: int) -> NDArray[np.uint8] | None:
                return image_of(shows, column, texture, PROBE_SIZE)

            missing = (sight.triangle >= 0) & ~loaded[self._triangles.cell[sight.triangle]]
            self._light.show(sight, tone, codes, images, shown)
            shown[missing] = GREY
        show_bumps(sight, surfaces, shows, loaded, column, shown)
        return self._picture(shown)

    def _picture(self, shown: Floats) -> Floats:
        """(height, width, 3) picture of (n, 3) samples."""
        shape = (self.height, self.samples, self.width, self.samples, 3)
        result: Floats = shown.reshape(shape).mean(axis=(1, 3))
        return result
