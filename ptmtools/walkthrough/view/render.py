"""Pictures of frames, with exactly the levels that a client has, or with all.

As for the tables, levels are chosen as for a screen of 1080 lines: a smaller picture is that one
made smaller. At 960 × 540 with two samples each way its samples are the pixels of the screen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.scene.mapping import gradients
from ptmtools.walkthrough.view.rays import Camera, Caster
from ptmtools.walkthrough.view.tables import LINES

if TYPE_CHECKING:
    from ptmtools.walkthrough.world import World

#: Rays that are cast at a time.
_RAYS = 1 << 18


@dataclass(frozen=True)
class Sight:
    """What the samples of a picture show.

    Attributes
    ----------
    eye: (3,). axes: (2, 3) right and up. ray: (n, 3). triangle: (n,) -1 for none.
    """

    eye: Floats
    axes: Floats
    ray: Floats
    triangle: Ints


class Renderer:
    """Draws pictures of ``height`` lines, as wide as the walk's view is, with ``samples`` each way
    of every pixel."""

    def __init__(self, world: World, height: int, samples: int = 2) -> None:
        self.height, self.samples = height, samples
        self.width = max(1, round(height * world.camera.aspect))
        self._world = world
        camera = world.camera
        self._camera = Camera(
            self.width * samples, height * samples, camera.field_of_view, camera.aspect
        )
        corner = world.served.surfaces.corner
        self._normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        self._gradient = gradients(corner, world.served.surfaces.uv)
        self._caster = Caster(world.served.surfaces)

    def look(self, eye: Floats, direction: Floats) -> Sight:
        """What is seen from an eye (3,) in a direction (3,)."""
        rays, axes = self._camera.rays(direction[None])
        ray = rays.reshape(-1, 3)
        triangle = [
            self._caster.first(np.repeat(eye[None], len(part), axis=0), part)
            for part in np.array_split(ray, -(-len(ray) // _RAYS))
        ]
        return Sight(eye, axes[0], ray, np.concatenate(triangle))

    def colors(self, sight: Sight, there: Bools, column: Ints) -> Floats:
        """(height, width, 3) 0 to 255, with the geometry of cells (C,) that is there and so many
        levels (T,) of each texture."""
        from ptmtools.walkthrough.view.shading import shade

        surfaces, textures = self._world.served.surfaces, self._world.pyramids
        shown = np.empty((len(sight.ray), 3))
        pixel = 2 * np.tan(self._camera.field_of_view / 2) / LINES
        shade(
            sight.triangle, sight.ray, sight.axes, sight.eye, pixel, surfaces.corner, self._normal,
            self._gradient, surfaces.uv, surfaces.cell, surfaces.texture, surfaces.color,
            surfaces.clamped, textures.texel, textures.start, textures.size, textures.count,
            textures.mean, there, column, shown,
        )  # fmt: skip
        each = (self.height, self.samples, self.width, self.samples, 3)
        found: Floats = shown.reshape(each).mean(axis=(1, 3))
        return found

    def full(self, sight: Sight) -> Floats:
        """The same with everything there."""
        stock = self._world.catalogue
        return self.colors(sight, np.ones(stock.cell_count, dtype=np.bool_), stock.levels)


def as_bytes(colors: Floats) -> NDArray[np.uint8]:
    """Colours as 8 bits hold them."""
    return np.rint(np.clip(colors, 0, 255)).astype(np.uint8)
