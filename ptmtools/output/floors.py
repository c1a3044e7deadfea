"""The floor below a point: the nearest upward-facing surface. The squares of a grid in plan list
the floor triangles whose boxes they touch, so that a query looks at the triangles of one square."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.model import Scene

#: A surface is a floor if its normal is at most 45° off the vertical.
_FLOOR_SLOPE = np.cos(np.pi / 4)
#: Squares along each side of the grid, at most.
_SQUARES = 128


class FloorFinder:
    """The floors of a scene."""

    def __init__(self, scene: Scene) -> None:
        corners = scene.corners
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        up, length = normal[:, 1], np.linalg.norm(normal, axis=1)
        floor = np.where(scene.two_sided, abs(up), up) > _FLOOR_SLOPE * length
        self._corners = corners[floor & (length > 0)]
        plan = self._corners[:, :, [0, 2]]
        low, high = plan.min(axis=1, initial=np.inf), plan.max(axis=1, initial=-np.inf)
        self._side = int(np.clip(np.sqrt(len(plan)), 1, _SQUARES))
        self._least = low.min(axis=0, initial=np.inf)
        self._most = high.max(axis=0, initial=-np.inf)
        first, last = self._square(low), self._square(high)
        wide = last - first + 1
        count = wide.prod(axis=1)
        triangle = np.repeat(np.arange(len(plan)), count)
        place = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
        across = wide[triangle, 1]
        square = (first[triangle, 0] + place // across) * self._side
        square += first[triangle, 1] + place % across
        order = np.argsort(square, kind="stable")
        self._triangle = triangle[order]
        self._start = np.searchsorted(square[order], np.arange(self._side**2 + 1))

    def floor_below(self, points: Floats) -> Floats:
        """(n,) height of the nearest floor at or below each of (n, 3) points, or -inf."""
        heights = np.full(len(points), -np.inf)
        plan = points[:, [0, 2]]
        over = np.flatnonzero(((self._least <= plan) & (plan <= self._most)).all(axis=1))
        square = self._square(plan[over]) @ [self._side, 1]
        count = self._start[square + 1] - self._start[square]
        point = np.repeat(over, count)
        place = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
        near = self._triangle[np.repeat(self._start[square], count) + place]
        a, b, c = np.moveaxis(self._corners[near], 1, 0)
        ab, ac, ap = b - a, c - a, points[point] - a
        det = ab[:, 0] * ac[:, 2] - ab[:, 2] * ac[:, 0]
        u = (ap[:, 0] * ac[:, 2] - ap[:, 2] * ac[:, 0]) / det
        v = (ab[:, 0] * ap[:, 2] - ab[:, 2] * ap[:, 0]) / det
        height = a[:, 1] + u * ab[:, 1] + v * ac[:, 1]
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (height <= points[point, 1])
        np.maximum.at(heights, point[hit], height[hit])
        return heights

    def _square(self, plan: Floats) -> Ints:
        """(n, 2) row and column of the squares of (n, 2) points within the floors' box."""
        extent = np.maximum(self._most - self._least, np.finfo(np.float64).tiny)
        share = (plan - self._least) / extent
        square: Ints = (share * self._side).astype(np.int64)
        return np.minimum(np.maximum(square, 0), self._side - 1)
