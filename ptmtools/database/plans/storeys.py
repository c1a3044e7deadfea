"""Which leaves make up which storey of a building.

A storey's floor is a cluster of the leaves' lowest heights, weighted by the area that lies on
them: heights within a storey gap of one another belong together, the lowest of a cluster first.
Leaves that hang above (the space over a cupboard, a lintel's slab) begin between the storeys and
found none; every storey shows all the leaves that its section cuts. What was left out counts too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.database.section import area, leaf_section

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
    most = max(areas)
    return [h for h, a in zip(heights, areas, strict=True) if a >= _LEAST_SHARE * most]


def storey_of(floors: Sequence[float], height: float) -> int:
    """The storey, of those with these ``floors``, that something is in: the nearest below."""
    return max(0, int(np.searchsorted(floors, height, side="right")) - 1)


def cut_height(cells: Cells, floor: float, height: float) -> float:
    """Where a storey is cut: ``height`` above its floor, or half way up if it is lower."""
    top = float(np.max(cells.leaf_point[:, 1], initial=floor))
    return min(floor + height, (floor + top) / 2)
