"""Horizontal sections: what a plane y = height cuts out of triangles, polygons and leaves.

Plan coordinates are (x, z). A corner that lies in the cutting plane counts as above it, so a
section through a floor's own height is that of the walls that stand on it, and no corner is met
twice.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells


def triangle_section(corners: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """(m, 2, 2) segments in which (n, 3, 3) triangles meet the plane; horizontal ones have none."""
    above = corners[:, :, 1] >= height
    lone = above.sum(axis=1)
    cut = np.flatnonzero((lone == 1) | (lone == 2))
    corners, above = corners[cut], above[cut]
    # The corner that is alone on its side; both crossings lie on the edges that meet there.
    apex = np.where(lone[cut] == 1, above.argmax(axis=1), above.argmin(axis=1))
    row = np.arange(len(cut))
    tip = corners[row, apex]
    ends = [_crossing(tip, corners[row, (apex + k) % 3], height) for k in (1, 2)]
    return np.stack(ends, axis=1)


def polygon_section(polygon: NDArray[np.float64], height: float) -> NDArray[np.float64] | None:
    """(2, 2) segment in which a convex (n, 3) polygon meets the plane, or None."""
    following = np.roll(polygon, -1, axis=0)
    change = (polygon[:, 1] >= height) != (following[:, 1] >= height)
    if change.sum() != 2:
        return None
    return _crossing(polygon[change], following[change], height)


def leaf_section(cells: Cells, leaf: int, height: float) -> NDArray[np.float64]:
    """(n, 2) convex polygon in which a leaf meets the plane, counter-clockwise in (x, z); (0, 2)
    if it does not."""
    points = cells.leaf_points(leaf)
    if not points[:, 1].min() <= height < points[:, 1].max():
        return np.zeros((0, 2))
    first, last = cells.leaf_face_start[leaf : leaf + 2].tolist()
    loop = cells.face_start[first : last + 1]
    index = cells.face_index[loop[0] : loop[-1]]
    following = np.roll(index, -1)
    following[loop[1:] - 1 - loop[0]] = index[loop[:-1] - loop[0]]
    start, end = cells.leaf_point[index], cells.leaf_point[following]
    # Each edge stands in two loops, upwards in one of them.
    upward = (start[:, 1] < height) & (end[:, 1] >= height)
    corners = _crossing(start[upward], end[upward], height)
    if len(corners) < 3:
        return np.zeros((0, 2))
    centre = corners.mean(axis=0)
    around = np.argsort(np.arctan2(*(corners - centre).T[::-1]), kind="stable")
    return corners[around]


def area(polygon: NDArray[np.float64]) -> float:
    """m² of a (n, 2) polygon, positive if counter-clockwise."""
    if len(polygon) < 3:
        return 0.0
    a, b = polygon - polygon[0], np.roll(polygon, -1, axis=0) - polygon[0]
    return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def _crossing(a: NDArray[np.float64], b: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """(n, 2) where the segments from ``a`` to ``b`` meet the plane; their ends lie on two sides."""
    share = (height - a[:, 1]) / (b[:, 1] - a[:, 1])
    return (a + share[:, None] * (b - a))[:, [0, 2]]
