"""The triangles near a plane or in a box, found without looking at all of them.

A building has as many wall planes as rooms and each holds a few of its triangles: asking every
triangle of every plane is quadratic (800 rooms: 24,000 planes and a million triangles). Triangles
are therefore put into blocks of neighbours with bounding boxes, and only blocks that come near the
plane are looked into.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints

#: Triangles in a block.
_BLOCK = 64
#: Bits of each coordinate by which triangles are ordered.
_BITS = 15


class Nearby:
    """Blocks of the (n, 3, 3) triangles ``corners``; ``margin`` metres cover their rounding."""

    def __init__(self, corners: Floats, margin: float) -> None:
        self._margin = margin
        self._order = along_a_curve(corners.mean(axis=1)) if len(corners) else np.zeros(0, int)
        first = np.arange(0, len(corners), _BLOCK)
        points = corners[self._order]
        if len(first):
            low = np.minimum.reduceat(points.min(axis=1), first)
            high = np.maximum.reduceat(points.max(axis=1), first)
        else:
            low = high = np.zeros((0, 3))
        self._middle, self._half = (low + high) / 2, (high - low) / 2

    def between(self, plane: Floats, low: float, high: float) -> Ints:
        """Triangles, ascending, among which are all with a point whose distance from the (4,)
        plane, along its normal, is in [low, high]."""
        distance = self._middle @ plane[:3] + plane[3]
        reach = self._half @ np.abs(plane[:3]) + self._margin
        return self._members(np.flatnonzero((distance + reach >= low) & (distance - reach <= high)))

    def meeting(self, low: Floats, high: Floats) -> Ints:
        """Triangles, ascending, among which are all that meet the box between two corners."""
        apart = np.maximum(low - self._middle, self._middle - high) - self._half
        return self._members(np.flatnonzero(np.all(apart <= self._margin, axis=1)))

    def _members(self, block: Ints) -> Ints:
        row = (block[:, None] * _BLOCK + np.arange(_BLOCK)).ravel()
        return np.sort(self._order[row[row < len(self._order)]])


def along_a_curve(points: Floats) -> Ints:
    """An order of (n, k) points in which neighbours mostly follow one another (Morton's)."""
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    share = np.divide(points - low, size, out=np.zeros(points.shape), where=size > 0)
    at = np.minimum(share * 2**_BITS, 2**_BITS - 1).astype(np.int64)
    axes = range(points.shape[1])
    places = ((bit, axis, bit * len(axes) + axis) for bit in range(_BITS) for axis in axes)
    code = sum((at[:, axis] >> bit & 1) << place for bit, axis, place in places)
    return np.argsort(code, kind="stable")
