"""Compiled test of points for being above floors (`eyes`)."""

from __future__ import annotations

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.compiled import plain_kernel


@plain_kernel
def above_floor(
    points: Floats, floor: Floats, first: Ints, end: Ints, reach: float, found: Bools
) -> None:
    """Sets ``found`` (n,) for those of the (n, 3) points that are over one of the (m, 3, 3)
    triangles and at most ``reach`` above it; each triangle is held against the points from its
    ``first`` to its ``end`` (m,)."""
    for t in range(len(floor)):
        a, b, c = floor[t, 0], floor[t, 1], floor[t, 2]
        low, high = min(a[1], b[1], c[1]), max(a[1], b[1], c[1]) + reach
        for i in range(first[t], end[t]):
            p = points[i]
            if found[i] or not low <= p[1] <= high:
                continue
            # Of an edge and the edge the other way round exactly opposite.
            u = (b[0] - p[0]) * (c[2] - p[2]) - (b[2] - p[2]) * (c[0] - p[0])
            v = (c[0] - p[0]) * (a[2] - p[2]) - (c[2] - p[2]) * (a[0] - p[0])
            w = (a[0] - p[0]) * (b[2] - p[2]) - (a[2] - p[2]) * (b[0] - p[0])
            if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
                whole = u + v + w
                if whole != 0:
                    over = p[1] - (u * a[1] + v * b[1] + w * c[1]) / whole
                    found[i] = 0 <= over <= reach
