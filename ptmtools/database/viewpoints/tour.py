"""The order in which rooms are walked through.

A browser that knows nothing of cells leads from viewpoint to viewpoint in the order of the file:
the next one should be next door. The shortest ways from the first room make a tree (Dijkstra, over
leaves and portals); rooms follow each other as one meets them walking around it, the branch that
leads least far first, one storey after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heappop, heappush

import numpy as np

from ptmtools.cells.model import Cells

#: A way through an opening that is too low to walk through counts as so many times as long.
_CLIMB = 10.0
#: A portal with a normal this near to the vertical leads up or down, and has no height.
_LEVEL = np.cos(np.pi / 4)


def walk(cells: Cells, start: int, stops: Sequence[int], tall: float) -> list[int]:
    """The order in which a walk from the leaf ``start`` meets the leaves ``stops``: indices into
    it. Those to which nothing leads come last.

    Parameters
    ----------
    tall: openings of at least this height are walked through, metres.
    """
    length, before = _ways(cells, start, tall)
    reach: dict[int, float] = {}
    onwards: dict[int, set[int]] = {}
    here: dict[int, list[int]] = {}
    for i, stop in enumerate(stops):
        if stop != start and before[stop] < 0:
            continue
        here.setdefault(stop, []).append(i)
        leaf, far = stop, length[stop]
        while leaf >= 0:
            reach[leaf] = max(reach.get(leaf, 0.0), far)
            if before[leaf] >= 0:
                onwards.setdefault(before[leaf], set()).add(leaf)
            leaf = before[leaf]
    order: list[int] = []
    waiting = [start]
    while waiting:
        leaf = waiting.pop()
        order += here.get(leaf, [])
        waiting += sorted(onwards.get(leaf, ()), key=lambda leaf: (-reach[leaf], -leaf))
    return order + sorted(set(range(len(stops))) - set(order))


def storey_numbers(floors: Sequence[float], apart: float) -> list[int]:
    """The storey of each of these heights, from 0 for the lowest: a new one begins where a height
    is more than ``apart`` metres above the next lower one."""
    order = np.argsort(floors, kind="stable")
    rise = np.diff(np.array(floors)[order], prepend=floors[order[0]] if len(floors) else 0.0)
    found = np.empty(len(floors), dtype=np.int64)
    found[order] = np.cumsum(rise > apart)
    return [int(storey) for storey in found]


def _ways(cells: Cells, start: int, tall: float) -> tuple[list[float], list[int]]:
    """For each leaf how far it is from ``start``, and the leaf before it on the way, -1 if none."""
    edges: list[list[tuple[int, float]]] = [[] for _ in range(cells.leaf_count)]
    if cells.portal_count:
        middle, door = (
            np.add.reduceat(point, start[:-1]) / np.diff(start)[:, None]
            for point, start in (
                (cells.leaf_point, cells.leaf_point_start),
                (cells.portal_point, cells.portal_start),
            )
        )
        up, begin = cells.portal_point[:, 1], cells.portal_start[:-1]
        rise = np.maximum.reduceat(up, begin) - np.minimum.reduceat(up, begin)
        way = np.linalg.norm(middle[cells.portal_leaf] - door[:, None], axis=2).sum(axis=1)
        way[(abs(cells.portal_plane[:, 1]) < _LEVEL) & (rise < tall)] *= _CLIMB
        for (a, b), far in zip(cells.portal_leaf.tolist(), way.tolist(), strict=True):
            edges[a].append((b, far))
            edges[b].append((a, far))
    length, before = [np.inf] * cells.leaf_count, [-1] * cells.leaf_count
    length[start] = 0.0
    waiting = [(0.0, start)]
    while waiting:
        far, leaf = heappop(waiting)
        if far > length[leaf]:
            continue
        for neighbour, way in edges[leaf]:
            if far + way < length[neighbour]:
                length[neighbour], before[neighbour] = far + way, leaf
                heappush(waiting, (far + way, neighbour))
    return length, before
