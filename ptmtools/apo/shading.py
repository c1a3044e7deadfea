"""How pictures of octree textures are lit, and what a picture is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.apo.view import View
from ptmtools.arrays import Bools, Floats, Ints

#: Shares of white: everywhere, from the upper left, and from the lower right, which shows relief in
#: the shade.
AMBIENT, KEY, FILL = 0.2, 0.7, 0.2
#: Towards the lights: right, up, and towards the camera.
_KEY, _FILL = (-0.5, 0.65, 0.6), (0.8, -0.3, 0.5)


@dataclass(frozen=True)
class Look:
    """What is shown, and how.

    Attributes
    ----------
    levels: of the octree that are there; 0 shows the mesh's own normals.
    what: "shaded", or "normals" as the octree stores them.
    stone: share of red, green and blue that a surface without colour gives back.
    near: nothing nearer than this share of the farthest is drawn.
    """

    levels: int
    what: str = "shaded"
    stone: tuple[float, float, float] = (0.93, 0.9, 0.85)
    near: float = 2.0**-14

    @property
    def background(self) -> NDArray[np.uint8]:
        """(3,) of pixels that show nothing; no unit normal is stored as black."""
        return np.array([0, 0, 0] if self.what == "normals" else [58, 62, 70], dtype=np.uint8)

    def lights(self, view: View) -> tuple[Floats, Floats]:
        """Unit vectors towards both lights, which go with the camera."""
        axes = view.axes * [[1], [1], [-1]]
        key, fill = (np.array(light) @ axes for light in (_KEY, _FILL))
        return key / np.linalg.norm(key), fill / np.linalg.norm(fill)

    def shown(self, normals: Floats, colors: NDArray[np.uint8] | None, view: View) -> Floats:
        """(n, 3) shares of full light, of unit normals and the (n, 4) colours below them."""
        if self.what == "normals":
            return normals / 2 + 0.5
        key, fill = self.lights(view)
        light = AMBIENT + KEY * np.maximum(normals @ key, 0) + FILL * np.maximum(normals @ fill, 0)
        base = np.array(self.stone) if colors is None else colors[:, :3] / 255
        return np.asarray(np.minimum(base * light[:, None], 1.0))


@dataclass(frozen=True)
class Drawn:
    """A picture, and what its pixels are of.

    Attributes
    ----------
    picture: (h, w, 3) uint8.
    address: (h, w) of the texel; -1 where the mesh's own normal is shown, -2 where nothing is.
    place: (h, w, 3) in the cube; undefined where nothing is.
    stop: (h, w) the depth at which pixels stop; undefined where nothing is.
    """

    picture: NDArray[np.uint8]
    address: Ints
    place: Floats
    stop: Ints

    @property
    def covered(self) -> Bools:
        """(h, w) which pixels show the mesh."""
        return self.address > -2

    @property
    def deepest(self) -> int:
        """The depth beyond which nodes are smaller than the pixels of this view, so that a client
        may stop the transmission (section 4.2); -1 if it shows nothing."""
        return int(self.stop[self.covered].max(initial=-1))
