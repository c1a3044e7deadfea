"""Which leaves make up which room: a watershed of free space on the graph of leaves.

Walls cut a building into more leaves than it has rooms: every plane goes on behind the wall that
proposed it. Leaves grow together through the openings between them, widest first, as basins do in
a watershed of the distance from the walls: an opening joins two *regions* if it is at least
`OPEN` of the cross-section of the narrower one. What is left of the openings then are doors.

The cross-section of a region is its volume over its length in plan, and never less than that of
anything that has joined it; length is the area over the width (least breadth in any direction) of
the hull of its plan. So a corridor's is its width times its height, that of a room is its narrower
side times its height, and a doorway, a sliver or a bay is narrow and joins whatever it opens into
most: one room, since as part of that room it is narrow no more.

The opening between two regions is the largest group of touching portals, by true area: two doors
into one corridor are two openings, a wide arch that planes have cut up is one.

A region in which nobody can stand, such as the space above a ceiling with holes, is no room. Leaf
by leaf it joins the rooms around it, through the largest opening first.

Tried and rejected: the share of the common boundary that is open (two rooms joined by a doorway as
deep as its wall share nothing but the doorway); the volume of the convex hull that two regions
fill together (splits every room with a pillar, and joins small rooms through their doors); the
largest sphere in each leaf instead of its cross-section (under a ceiling of 2.6 m all halls have
the same).
"""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.merging import Groups
from ptmtools.cells.model import Cells

if TYPE_CHECKING:
    Plan = Any

#: An opening joins two regions if it is at least this share of the narrower one's cross-section.
OPEN = 0.7
#: Shares that agree in so many significant digits are equal: symmetrical buildings have many, which
#: rounding must not put in order, not even that of a file far from its origin on a sliver.
DIGITS = 4
#: Pairs of portals that are compared at a time.
AT_ONCE = 2048


def room_of_leaf(cells: Cells, rank: Ints) -> Ints:
    """(L,) the room of each leaf, called by the rank of one of its leaves.

    Of equally open pairs the one whose leaves come first by (L,) ``rank`` is joined first: a
    doorway between two equal rooms.
    """
    regions = _Regions(cells, rank)
    openings = regions.openings()
    room = regions.grown(lambda closed: -closed >= OPEN)
    standing = np.zeros(cells.leaf_count, dtype=np.bool_)
    standing[room[rank[cells.leaf_standing]]] = True
    return _adopted(room, standing[room], openings)[rank]


def _adopted(room: Ints, held: Bools, openings: dict[tuple[int, int], float]) -> Ints:
    """(L,) rooms, those that are not ``held``, (L,), divided among the rooms around them: from
    these on, the largest opening first."""
    beside: list[list[tuple[float, int]]] = [[] for _ in room]
    for (a, b), area in openings.items():
        beside[a].append((-float(f"{area:.{DIGITS}g}"), b))
        beside[b].append((-float(f"{area:.{DIGITS}g}"), a))
    waiting = [(area, b, int(room[a])) for a in np.flatnonzero(held) for area, b in beside[a]]
    heapq.heapify(waiting)
    found, left = room.copy(), ~held
    while waiting:
        _, leaf, name = heapq.heappop(waiting)
        if left[leaf]:
            found[leaf], left[leaf] = name, False
            for area, b in beside[leaf]:
                heapq.heappush(waiting, (area, b, name))
    return found


class _Regions(Groups):
    """Groups of leaves, by rank, that cost little where the opening between them is large."""

    def __init__(self, cells: Cells, rank: Ints) -> None:
        kept = (cells.leaf_cell[cells.portal_leaf] >= 0).all(axis=1, keepdims=True)
        super().__init__(cells.leaf_count, np.where(kept, rank[cells.portal_leaf], 0))
        order = np.argsort(rank)
        self._volume = cells.leaf_volumes()[order]
        plan = cells.leaf_point[:, [0, 2]]
        rows = np.repeat(np.arange(cells.leaf_count), np.diff(cells.leaf_point_start))
        hulls = shapely.convex_hull(shapely.multipoints(plan, indices=rows))
        self._plan: list[Plan] = list(hulls[order].tolist())
        self._section = [_section(v, p) for v, p in zip(self._volume, self._plan, strict=True)]
        self._area = cells.portal_area.tolist()
        self._touching = _touching(cells, cells.tolerance.plane)
        self._opening: dict[tuple[int, int], float] = {}

    def openings(self) -> dict[tuple[int, int], float]:
        """m² between two regions, the lower one first."""
        pairs = ((a, b) for a, near in enumerate(self.near) for b in near if a < b)
        return {(a, b): self._largest_opening(self.near[a][b]) for a, b in pairs}

    def cost(self, a: int, b: int) -> float:
        """Less the opening between them, as a share of the narrower one's cross-section."""
        if (a, b) not in self._opening:
            self._opening[a, b] = self._largest_opening(self.near[a][b])
        share = self._opening[a, b] / min(self._section[a], self._section[b])
        return -float(f"{share:.{DIGITS}g}")

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        """Called by the one with more neighbours."""
        if len(self.near[a]) < len(self.near[b]):
            a, b = b, a
        self._volume[a] += self._volume[b]
        self._plan[a] = self._plan[a].union(self._plan[b]).convex_hull
        self._section[a] = max(
            self._section[a], self._section[b], _section(self._volume[a], self._plan[a])
        )
        changed = super().join(a, b)
        for a, c in changed:
            self._opening.pop((min(a, c), max(a, c)), None)
        return changed

    def _largest_opening(self, doors: list[int]) -> float:
        left, largest = set(doors), 0.0
        for door in sorted(doors):
            if door not in left:
                continue
            left.discard(door)
            group, area = [door], 0.0
            while group:
                k = group.pop()
                area += self._area[k]
                reached = [j for j in self._touching[k] if j in left]
                left.difference_update(reached)
                group += reached
            largest = max(largest, area)
        return largest


def _section(volume: float, plan: Plan) -> float:
    """m²: the mean cross-section along a region, volume over length."""
    corners = shapely.get_coordinates(plan)
    edge = np.diff(corners, axis=0)
    length = np.linalg.norm(edge, axis=1)
    edge = edge[length > 0] / length[length > 0, None]
    across = np.outer(edge[:, 0], corners[:, 1]) - np.outer(edge[:, 1], corners[:, 0])
    width = float(np.ptp(across, axis=1).min())
    return volume * width / float(plan.area)


def _touching(cells: Cells, near: float) -> list[list[int]]:
    """For every portal those that it meets, within ``near`` metres, ascending."""
    found: list[list[int]] = [[] for _ in range(cells.portal_count)]
    if not found:
        return found
    start = cells.portal_start[:-1]
    last = np.diff(cells.portal_start) - 1
    low = np.minimum.reduceat(cells.portal_point, start) - near / 2
    high = np.maximum.reduceat(cells.portal_point, start) + near / 2
    boxes = shapely.box(low[:, 0], low[:, 2], high[:, 0], high[:, 2])
    i, j = shapely.STRtree(boxes).query(boxes, predicate="intersects")
    close = (i < j) & (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
    i, j = i[close], j[close]
    order = np.lexsort((j, i))
    i, j = i[order], j[order]
    corner = np.minimum(np.arange(int(last.max()) + 1), last[:, None])
    polygon = cells.portal_point[start[:, None] + corner]  # shorter ones repeat their last point
    for part in range(0, len(i), AT_ONCE):
        rows = slice(part, part + AT_ONCE)
        p, q = polygon[i[rows]], polygon[j[rows]]
        meet = np.minimum(_distance(p, q), _distance(q, p)) <= near
        for a, b in zip(i[rows][meet].tolist(), j[rows][meet].tolist(), strict=True):
            found[a].append(b)
            found[b].append(a)
    return found


def _distance(points: Floats, polygon: Floats) -> Floats:
    """(n,) metres between the nearest of (n, m, 3) points and the outline of (n, m, 3) polygons."""
    along = np.roll(polygon, -1, axis=1) - polygon
    square = np.maximum(np.einsum("nek,nek->ne", along, along), np.finfo(np.float64).tiny)
    to = points[:, :, None] - polygon[:, None]
    share = np.clip(np.einsum("npek,nek->npe", to, along) / square[:, None], 0.0, 1.0)
    nearest = np.linalg.norm(to - share[..., None] * along[:, None], axis=3)
    return np.asarray(nearest.min(axis=(1, 2)))
