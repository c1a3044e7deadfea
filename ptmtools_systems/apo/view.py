"""Camera and lights of a picture of an octree texture, and the rendered frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints

#: Vertical field of view, degrees.
FIELD_OF_VIEW = 35.0


#: A direction with a smaller horizontal part counts as straight up or down; that part is rounding.
_STRAIGHT = 2.0**-40


@dataclass(frozen=True)
class OctreeView:
    """A pinhole camera with Y up.

    Attributes
    ----------
    eye, target: (3,) its position, and the point in the middle of the picture.
    width, height: pixels.
    field_of_view: vertical, degrees.
    """

    eye: Floats
    target: Floats
    width: int
    height: int
    field_of_view: float = FIELD_OF_VIEW

    @property
    def axes(self) -> Floats:
        """(3, 3) unit vectors right, up and forward; x is right for a view straight up or down."""
        ahead = self.target - self.eye
        ahead = ahead / np.linalg.norm(ahead)
        right = np.array([-ahead[2], 0.0, ahead[0]])
        if np.linalg.norm(right) < _STRAIGHT:
            right = np.array([1.0, 0.0, 0.0])
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, ahead), ahead])

    @property
    def half(self) -> tuple[float, float]:
        """Half of the picture's width and height at distance 1."""
        tall = float(np.tan(np.radians(self.field_of_view) / 2))
        return tall * self.width / self.height, tall

    def rays(self, column: Ints, row: Ints) -> Floats:
        """(n, 3) rays with forward component 1 through the middles of pixels; (0, 0) is the upper
        left one."""
        wide, tall = self.half
        right, up, ahead = self.axes
        across = ((column + 0.5) / self.width * 2 - 1)[..., None] * wide
        upward = (1 - (row + 0.5) / self.height * 2)[..., None] * tall
        return np.asarray(ahead + across * right + upward * up)


def view_of(
    points: Floats,
    azimuth: float,
    elevation: float,
    distance: float = 0.0,
    *,
    width: int,
    height: int,
    field_of_view: float = FIELD_OF_VIEW,
) -> OctreeView:
    """A view of the middle of (P, 3) points.

    ``azimuth`` 0 looks from +Z, 90 from +X; ``elevation`` 90 from above, degrees. ``distance`` from
    the middle is in diameters (diagonals of the points' box); 0 takes the least that shows all of
    the ball around the box.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    diameter = float(np.linalg.norm(high - low))
    if not diameter > 0:
        raise ValueError("a single point has no view")
    turn, rise = np.radians(azimuth), np.radians(elevation)
    towards_eye = np.array([np.sin(turn) * np.cos(rise), np.sin(rise), np.cos(turn) * np.cos(rise)])
    if distance <= 0:
        angle = np.arctan(np.tan(np.radians(field_of_view) / 2) * min(1.0, width / height))
        distance = float(0.5 / np.sin(angle))
    middle = (low + high) / 2
    return OctreeView(
        middle + distance * diameter * towards_eye, middle, width, height, field_of_view
    )


#: Shares of white light: ambient, from the upper left, and from the lower right, which shows relief
#: in the shade.
AMBIENT, KEY, FILL = 0.2, 0.7, 0.2


#: Directions of the lights: right, up, and towards the camera.
_KEY, _FILL = (-0.5, 0.65, 0.6), (0.8, -0.3, 0.5)


#: Reflected shares of red, green and blue of a surface without colour.
STONE = (0.93, 0.9, 0.85)


@dataclass(frozen=True)
class Look:
    """The content and style of a picture.

    Attributes
    ----------
    levels: number of octree levels; 0 shows the mesh's own normals.
    what: "shaded", or "normals" as the octree stores them.
    """

    levels: int
    what: str = "shaded"

    @property
    def background(self) -> NDArray[np.uint8]:
        """(3,) colour of empty pixels; no unit normal is stored as black."""
        return np.array([0, 0, 0] if self.what == "normals" else [58, 62, 70], dtype=np.uint8)

    def lights(self, view: OctreeView) -> tuple[Floats, Floats]:
        """Unit vectors towards both lights, which move with the camera."""
        axes = view.axes * [[1], [1], [-1]]
        key, fill = (np.array(light) @ axes for light in (_KEY, _FILL))
        return key / np.linalg.norm(key), fill / np.linalg.norm(fill)

    def shade(self, normals: Floats, colors: NDArray[np.uint8] | None, view: OctreeView) -> Floats:
        """(n, 3) shares of full light, from unit normals and the (n, 4) colours below them."""
        if self.what == "normals":
            return normals / 2 + 0.5
        key, fill = self.lights(view)
        light = AMBIENT + KEY * np.maximum(normals @ key, 0) + FILL * np.maximum(normals @ fill, 0)
        base = np.array(STONE) if colors is None else colors[:, :3] / 255
        return np.asarray(np.minimum(base * light[:, None], 1.0))


@dataclass(frozen=True)
class OctreePicture:
    """A picture with data of its pixels.

    Attributes
    ----------
    picture: (h, w, 3) uint8.
    address: (h, w) of the texel; -1 for the mesh's own normal, -2 for an empty pixel.
    place: (h, w, 3) in the cube; undefined in empty pixels.
    stop: (h, w) the depth at which look-ups stop; undefined in empty pixels.
    renderer: name of the renderer.
    """

    picture: NDArray[np.uint8]
    address: Ints
    place: Floats
    stop: Ints
    renderer: str

    @property
    def covered(self) -> Bools:
        """(h, w) which pixels show the mesh."""
        return self.address > -2
