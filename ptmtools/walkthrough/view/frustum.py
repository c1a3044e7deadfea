"""What a camera takes in: boxes and hulls that reach into its frustum."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.walkthrough.view.rays import axes

#: Nothing nearer than this is in front of the camera, metres.
NEAR = 0.05
_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)


class Frustum:
    """Of a camera at ``eye`` (3,) along ``direction`` (3,); ``angle`` is vertical, radians."""

    def __init__(self, eye: Floats, direction: Floats, angle: float, aspect: float) -> None:
        self.eye, self.direction = eye, direction
        self._tall, self._wide = np.tan(angle / 2), np.tan(angle / 2) * aspect

    @cached_property
    def _axes(self) -> tuple[Floats, Floats]:
        right, up = axes(self.direction[None])
        return right[0], up[0]

    @cached_property
    def _planes(self) -> Floats:
        """(5, 3) inward normals of the sides, and the view itself."""
        right, up = self._axes
        ahead = self.direction
        wide, tall = ahead * self._wide, ahead * self._tall
        return np.array([wide + right, wide - right, tall + up, tall - up, ahead])

    def meets_boxes(self, low: Floats, high: Floats) -> Bools:
        """(n,) which boxes reach into it; some that just pass by a corner count, too."""
        normal = self._planes
        # The corner of each box that is farthest along a normal.
        far = np.where(normal[:, None] > 0, high[None], low[None]) - self.eye
        inside: Bools = (np.einsum("pij,pj->pi", far, normal) > 0).all(axis=0)
        return inside

    def meets_hull(self, points: Floats) -> bool:
        """Whether the convex hull of (n, 3) points reaches into it, or passes by a corner."""
        return bool(((points - self.eye) @ self._planes.T).max(axis=0).min() > 0)

    def distance(self, low: Floats, high: Floats) -> Floats:
        """(n,) metres from the eye to the nearest point of each box."""
        beside = np.maximum(np.maximum(low - self.eye, self.eye - high), 0)
        return np.asarray(np.linalg.norm(beside, axis=1))

    def covered(self, low: Floats, high: Floats) -> Floats:
        """(n,) the share of the screen that the projected box around each box covers; all of it if
        the box reaches behind the camera."""
        right, up = self._axes
        corner = low[:, None] + (high - low)[:, None] * _CORNERS - self.eye
        depth = corner @ self.direction
        ahead = np.maximum(depth, NEAR)
        x = np.clip(corner @ right / ahead / self._wide, -1, 1)
        y = np.clip(corner @ up / ahead / self._tall, -1, 1)
        share = np.ptp(x, axis=1) * np.ptp(y, axis=1) / 4
        return np.where((depth > NEAR).all(axis=1), share, 1.0)
