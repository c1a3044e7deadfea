"""A way along a grid becomes one that somebody would walk.

Every point moves to the middle between two others of the way, far ones first, again and again, as
long as the eye stays where eyes can be, nothing comes between neighbours, and the shoulders touch
nothing that they did not touch before. What cannot move stays, so the way is at any moment one that
can be walked. Fixed are the ends of legs and where a room is visited in passing.

Tried and rejected: pulling the way tight like a string. It is shorter, and grazes each corner.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.eyes import EyeRegion
from ptmtools.walkthrough.path.footing import BODY
from ptmtools.walkthrough.path.obstacles import Obstacles

#: How far apart the points are, along the way, to the middle between which one moves.
_REACHES = (4, 2, 4, 2, 3, 1, 2, 1)


class Smoother:
    """Smooths ways of eyes at one height above the floor, metres, with a body of one radius."""

    def __init__(
        self, eyes: EyeRegion, obstacles: Obstacles, eye_height: float, radius: float
    ) -> None:
        self._eyes, self._obstacles, self._radius = eyes, obstacles, radius
        self._below = [np.array([0, (1 - height) * eye_height, 0]) for height in BODY]

    def smooth(self, point: Floats, fixed: Bools, leg: Ints) -> Floats:
        """(n, 3) points, of which those that (n,) ``fixed`` marks stay; none looks beyond the end
        of its (n,) ``leg``, ascending."""
        begin, end = np.searchsorted(leg, leg), np.searchsorted(leg, leg, "right") - 1
        row = np.arange(len(point))
        hits, parted = self._body_hits(point), self._parted(point)
        for reach in _REACHES:
            step = np.minimum(reach, np.minimum(row - begin, end - row))
            wanted = (point[row - step] + point[row + step]) / 2
            moves = ~fixed & (step > 0)
            while moves.any():
                tried = np.where(moves[:, None], wanted, point)
                hit, apart = self._body_hits(tried), self._parted(tried)
                bad = (moves & ~self._eyes.contains(tried)) | (apart & ~parted)
                bad |= (hit & ~hits).any(axis=1)
                if not bad.any():
                    point, hits, parted = tried, hit, apart
                    break
                # A point that stays never worsens, so one that moves is near.
                moves &= np.convolve(bad, np.ones(2 * reach + 1))[reach:-reach] == 0
        return point

    def _parted(self, point: Floats) -> Bools:
        """(n,) whether an eye cannot go from a point to the next one."""
        following = np.append(point[1:], point[-1:], axis=0)
        outside = ~self._eyes.contains((point + following) / 2)
        return outside | self._obstacles.crossed(point, following)

    def _body_hits(self, point: Floats) -> Bools:
        """(n, 2·heights) what of the body touches something at each point: by height from shoulder
        to shoulder, and from there to the next point."""
        ahead = np.diff(point, axis=0, append=point[-1:])
        length = np.hypot(ahead[:, 0], ahead[:, 2])
        side = np.zeros_like(point)
        side[:, 0], side[:, 2] = -ahead[:, 2], ahead[:, 0]
        side *= np.divide(self._radius, length, out=np.zeros(len(point)), where=length > 0)[:, None]
        found = []
        for below in self._below:
            found.append(self._obstacles.crossed(point - below - side, point - below + side))
            found.append(self._obstacles.crossed(point - below, point - below + ahead))
        return np.stack(found, axis=1)
