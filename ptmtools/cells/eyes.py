"""Where the eyes of somebody who walks can be.

The **eye region** is reached space over a place (`places`), within the body of whoever stands there
and up to `Walker.reach` above the floor. What is seen, and how much of the view it covers, is asked
from there only: from a wall's hollow or above a ceiling nobody looks.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.nearby import Nearby
from ptmtools.cells.options import Walker


class EyeRegion:
    """An eye region as a set of points: above (n, 3, 3) triangles, metres, as far as a walker's
    eyes reach; everywhere if there are none."""

    def __init__(self, floor: Floats, walker: Walker) -> None:
        self._floor, self._reach = floor, walker.reach
        self._nearby = Nearby(floor, 0.0)

    @property
    def everywhere(self) -> bool:
        """Whether eyes may be anywhere."""
        return not len(self._floor)

    def about(self, low: Floats, high: Floats) -> bool:
        """Whether any floor of it is near the box between two corners."""
        return len(self._nearby.meeting(low - [0, self._reach, 0], high)) > 0

    def clipped(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """What of the box between two corners eyes can be in, as a box; as it is if it is flat or
        they can be nowhere in it."""
        corners = self._floor[self._nearby.meeting(low - [0, self._reach, 0], high)].reshape(-1, 3)
        if not len(corners):
            return low, high
        bottom = np.maximum(low, corners.min(axis=0))
        top = np.minimum(high, corners.max(axis=0) + [0, self._reach, 0])
        return (bottom, top) if (bottom < top).all() else (low, high)

    def contains(self, points: Floats) -> Bools:
        """(n,) whether it contains each of the (n, 3) points."""
        from ptmtools.cells.eye_kernels import above_floor

        inside = np.full(len(points), self.everywhere)
        if len(points) and not self.everywhere:
            low, high = points.min(axis=0), points.max(axis=0)
            floor = self._floor[self._nearby.meeting(low - [0, self._reach, 0], high)]
            order = np.argsort(points[:, 0], kind="stable")
            x, along = points[order, 0], floor[:, :, 0]
            first = np.searchsorted(x, along.min(axis=1))
            end = np.searchsorted(x, along.max(axis=1), side="right")
            ascending = np.zeros(len(points), dtype=np.bool_)
            above_floor(points[order], floor, first, end, self._reach, ascending)
            inside[order] = ascending
        return inside
