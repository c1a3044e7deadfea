"""Where a picture of a mesh is taken from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints

#: Vertical, degrees.
FIELD_OF_VIEW = 35.0
#: Who looks up or down with less than this of his view level, looks straight up or down: what is
#: level then is rounding.
_STRAIGHT = 2.0**-40


@dataclass(frozen=True)
class View:
    """A pinhole camera with Y up.

    Attributes
    ----------
    eye, target: (3,) where it is, and what is in the middle of the picture.
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
        """(3, 3) unit vectors right, up and forward; who looks straight up or down has x to the
        right."""
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
        """(n, 3) rays, of which the component forward is 1, through middles of pixels; (0, 0) is
        the upper left one."""
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
) -> View:
    """A view of the middle of (P, 3) points.

    ``azimuth`` 0 looks from +Z, 90 from +X; ``elevation`` 90 from above, degrees. ``distance`` from
    the middle is in diameters (diagonals of the points' box); 0 takes the least that shows all of
    the ball around the box.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    diameter = float(np.linalg.norm(high - low))
    if not diameter > 0:
        raise ValueError("the points are one, of which there is no view")
    turn, rise = np.radians(azimuth), np.radians(elevation)
    from_there = np.array([np.sin(turn) * np.cos(rise), np.sin(rise), np.cos(turn) * np.cos(rise)])
    if distance <= 0:
        angle = np.arctan(np.tan(np.radians(field_of_view) / 2) * min(1.0, width / height))
        distance = float(0.5 / np.sin(angle))
    middle = (low + high) / 2
    return View(middle + distance * diameter * from_there, middle, width, height, field_of_view)
