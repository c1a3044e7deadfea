"""The storeys of a building, and horizontal sections of triangles, polygons and leaves.

A storey's floor is a cluster of the leaves' lowest heights, weighted by the area of the leaves:
heights within a storey gap of one another belong together, the lowest of a cluster first. Hanging
leaves (the space over a cupboard, a lintel's slab) begin between the storeys and form none; every
storey shows all the leaves that its section cuts. Floor that is in no cell counts too.

Plan coordinates are (x, z). A corner in the cutting plane counts as above it, so a section through
a floor's own height is that of the walls that stand on it, and no corner is met twice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.model import Cells


def triangle_section(corners: Floats, height: float) -> Floats:
    """(m, 2, 2) segments in which (n, 3, 3) triangles meet the plane; horizontal ones have none."""
    above = corners[:, :, 1] >= height
    lone = above.sum(axis=1)
    cut = np.flatnonzero((lone == 1) | (lone == 2))
    corners, above = corners[cut], above[cut]
    # The only corner on its side of the plane; both crossings lie on its edges.
    apex = np.where(lone[cut] == 1, above.argmax(axis=1), above.argmin(axis=1))
    row = np.arange(len(cut))
    tip = corners[row, apex]
    ends = [_crossing(tip, corners[row, (apex + k) % 3], height) for k in (1, 2)]
    return np.stack(ends, axis=1)


def polygon_section(polygon: Floats, height: float) -> Floats | None:
    """(2, 2) segment in which a convex (n, 3) polygon meets the plane, or None."""
    following = np.roll(polygon, -1, axis=0)
    change = (polygon[:, 1] >= height) != (following[:, 1] >= height)
    if change.sum() != 2:
        return None
    return _crossing(polygon[change], following[change], height)


def leaf_section(cells: Cells, leaf: int, height: float) -> Floats:
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


def area(polygon: Floats) -> float:
    """m² of a (n, 2) polygon, positive if counter-clockwise."""
    if len(polygon) < 3:
        return 0.0
    a, b = polygon - polygon[0], np.roll(polygon, -1, axis=0) - polygon[0]
    return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def _crossing(a: Floats, b: Floats, height: float) -> Floats:
    """(n, 2) where the segments from ``a`` to ``b``, with ends on both sides, meet the plane."""
    share = (height - a[:, 1]) / (b[:, 1] - a[:, 1])
    return (a + share[:, None] * (b - a))[:, [0, 2]]


#: A storey has at least this share of the area of the largest one.
_LEAST_SHARE = 0.15


def storeys(cells: Cells, height: float, gap: float) -> list[float]:
    """The floors' heights, ascending; at least one if there are leaves.

    Parameters
    ----------
    height: of the section above a floor, metres.
    gap: floors nearer than this to one another belong to one storey, metres.
    """
    floors: dict[float, float] = {}
    for leaf in range(cells.leaf_count):
        points = cells.leaf_points(leaf)
        low, high = float(points[:, 1].min()), float(points[:, 1].max())
        cut = min(low + height, (low + high) / 2)
        if high - low >= height:
            floors[low] = floors.get(low, 0.0) + area(leaf_section(cells, leaf, cut))
    plan = np.abs([area(triangle) for triangle in cells.left_out[:, :, [0, 2]]])
    for low, size in zip(cells.left_out[:, :, 1].min(axis=1).tolist(), plan.tolist(), strict=True):
        floors[low] = floors.get(low, 0.0) + size
    if not floors:
        return [float(cells.leaf_point[:, 1].min())] if cells.leaf_count else []
    clusters: list[list[float]] = []
    for low in sorted(floors):
        if clusters and low - clusters[-1][0] < gap:
            clusters[-1].append(low)
        else:
            clusters.append([low])
    areas = [sum(floors[low] for low in cluster) for cluster in clusters]
    # The floor of a storey is the height with the most area on it.
    heights = [max(cluster, key=lambda low: floors[low]) for cluster in clusters]
    largest = max(areas)
    return [h for h, a in zip(heights, areas, strict=True) if a >= _LEAST_SHARE * largest]


def storey_of(floors: Sequence[float], height: float) -> int:
    """The storey of a height, given all ``floors``: the nearest one below."""
    return max(0, int(np.searchsorted(floors, height, side="right")) - 1)


def cut_height(cells: Cells, floor: float, height: float) -> float:
    """The height of a storey's section: ``height`` above its floor, at most half way up."""
    top = float(np.max(cells.leaf_point[:, 1], initial=floor))
    return min(floor + height, (floor + top) / 2)
