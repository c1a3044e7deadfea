"""Grouping of leaves into rooms, and of a room's leaves into cells.

**Rooms** are a watershed of free space on the graph of leaves. Leaves grow together through the
openings between them, widest first: an opening joins two *regions* if it is at least `OPEN` of the
cross-section of the narrower one, its volume over its length in plan, and never less than that of
anything that has joined it. Length is the area over the least width of the hull of its plan. The
opening between two regions is the largest group of touching portals, by true area. Regions without
standing leaves join the rooms around them leaf by leaf, through the largest opening first; the
inside of a door leaf, behind passages, comes last. Openings in the ceiling join no regions.

**Named rooms.** Where the model has volumes of rooms (`named_rooms`), leaves in one volume grow
together first, through openings of at least `OPEN_WITHIN` of the cross-section or larger than a
double door: the model says that a bay belongs to its room, and that a hall goes on behind a core of
lifts, but a door within a flat still divides. Regions in two volumes never join. Leaves in no
volume, such as doorways, join as above. A volume of which no region has more than two thirds
consists of several rooms, and does not count.

**Cells.** A room is one cell, unless dividing it gains enough (`sight`). Cells never reach through
a door.

**Order.** Leaves are ranked by the geometry of the model file that each holds (`rank_in_file`).
"""

from __future__ import annotations

import heapq
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.cells.model import Cells
from ptmtools.cells.named_rooms import Volumes, name_cells, unused_notes
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import Geometry
from ptmtools.cells.search import connect
from ptmtools.cells.sight import (
    DIGITS,
    Groups,
    from_places,
    gain_of,
    join_by_gain,
    portals_of,
    sampled_sight,
)
from ptmtools.diagnostics import Warned
from ptmtools.tolerance import TIE_SHARE

#: Shares of a triangle that differ by less are equal, in digits.
GAIN_DIGITS = 6


def leaf_of_cell(cells: Cells) -> Ints:
    """(C,) the leaves that are cells, of cells that are single leaves."""
    return np.flatnonzero(cells.leaf_cell >= 0)


def rank_in_file(cells: Cells) -> Ints:
    """(L,) the place of each leaf in an order that no transformation of the model changes: leaves
    are compared by the share that they hold of the model's first triangle of which one of them
    holds more, and go by number where they hold the same of all.

    Leaves themselves are numbered as planes split them, and which side of a plane is its front
    depends on how the model is turned.
    """
    leaf, piece, area = sides(cells)
    source = cells.triangle_source
    count = int(source.max(initial=-1)) + 1
    pair, row = np.unique(leaf * count + source[piece], return_inverse=True)
    held_area = np.bincount(row, area[piece])
    whole = np.bincount(source, area)[pair % max(count, 1)]
    share = np.round(
        np.divide(held_area, whole, out=np.zeros(len(held_area)), where=whole > 0), GAIN_DIGITS
    )
    holds = share > 0
    return _in_order(pair[holds] // count, pair[holds] % count, share[holds], cells.leaf_count)


def _in_order(leaf: Ints, source: Ints, share: Floats, leaves: int) -> Ints:
    """(leaves,) the places of leaves in order, given the share that each, ascending, holds of each
    source, ascending: the more of an earlier one, the earlier. A leaf that holds nothing more
    comes last, not first."""
    start = np.searchsorted(leaf, np.arange(leaves + 1))
    source, share = np.append(source, np.iinfo(np.int64).max), np.append(share, 0.0)
    before = np.zeros(leaves, dtype=np.int64)  # how many leaves come before each
    tied, k = np.arange(leaves), 0
    while len(tied):
        at = np.where(start[tied] + k < start[tied + 1], start[tied] + k, len(leaf))
        order = np.lexsort((-share[at], source[at], before[tied]))
        tied, at = tied[order], at[order]
        group = np.diff(before[tied], prepend=-1) > 0
        run = group | (np.diff(source[at], prepend=-1) != 0) | (np.diff(share[at], prepend=-1) != 0)
        row = np.arange(len(tied))
        first_of_run = np.maximum.accumulate(np.where(run, row, 0))
        before[tied] += first_of_run - np.maximum.accumulate(np.where(group, row, 0))
        alone = run & np.append(run[1:], True)
        tied, k = tied[~alone & (at < len(leaf))], k + 1
    rank = np.empty(leaves, dtype=np.int64)
    rank[np.lexsort((np.arange(leaves), before))] = np.arange(leaves)
    return rank


def sides(cells: Cells) -> tuple[Ints, Ints, Floats]:
    """(n,) leaves and (n,) their pieces of geometry, of cells that are single leaves; pieces in a
    boundary count on both sides. And (M,) the areas of the pieces, m²."""
    front, back = np.append(leaf_of_cell(cells), -1)[cells.triangle_cell].T
    behind = (back >= 0) & (back != front)
    leaf = np.concatenate([front[front >= 0], back[behind]])
    piece = np.concatenate([np.flatnonzero(front >= 0), np.flatnonzero(behind)])
    return leaf, piece, areas(cells.vertex[cells.triangle])


#: An opening joins two regions if it is at least this share of the narrower one's cross-section.
OPEN = 0.7
#: The same within one volume: a bay is part of its room, but a doorway of 1.9 m² divides unless it
#: leads into less than 5 m² of cross-section.
OPEN_WITHIN = 0.4
#: m²: an opening of this size joins regions in one volume; a double door has 1.8 × 2.1 m.
LARGE_OPENING = 4.0
#: A volume is one room if a region has more than this share of its standing leaves.
ONE_ROOM = 2 / 3


def room_of_leaf(cells: Cells, rank: Ints, volume: Ints) -> Ints:
    """(L,) the room of each leaf, named by the rank of one of its leaves.

    Of equally open pairs the one whose leaves come first by (L,) ``rank`` is joined first: a
    doorway between two equal rooms. ``volume``: (L,) the volume that each leaf is in, -1 for none.
    """
    regions = _Regions(cells, rank, volume)
    openings = regions.openings()
    regions.grow_within()
    room = regions.grow(lambda closed: -closed >= OPEN)
    standing = np.zeros(cells.leaf_count, dtype=np.bool_)
    standing[room[rank[cells.leaf_standing]]] = True
    return _with_space_above(cells, _adopt(room, standing[room], openings)[rank])


def volumes_of_one_room(cells: Cells, volume: Ints) -> Ints:
    """(L,) the volume that each leaf is in, -1 for none and for volumes of several rooms."""
    if volume.max(initial=-1) < 0:
        return volume
    rank = rank_in_file(cells)
    region = _Regions(cells, rank, volume).grow_within()[rank]
    size = cells.leaf_volumes() * cells.leaf_standing
    several = []
    for name in range(int(volume.max()) + 1):
        inside = volume == name
        parts = np.bincount(region[inside], size[inside]) if inside.any() else np.zeros(1)
        if parts.sum() and parts.max() <= (1 + TIE_SHARE) * ONE_ROOM * parts.sum():
            several.append(name)
    return np.where(np.isin(volume, several), -1, volume)


def _with_space_above(cells: Cells, room: Ints) -> Ints:
    """(L,) rooms with the space above the ceiling that leads down into one of them only."""
    ends = cells.portal_leaf[cells.in_ceiling]
    if cells.ceiling is None or not len(ends):
        return room
    start = cells.leaf_point_start[:-1]
    middle = np.add.reduceat(cells.leaf_point[:, 1], start) / np.diff(cells.leaf_point_start)
    above = middle > cells.ceiling
    joins = above[cells.portal_leaf].all(axis=1)
    space = connect(cells.leaf_count, cells.portal_leaf[joins])
    upper, lower = np.where(above[ends], ends, ends[:, ::-1]).T
    result = room.copy()
    for name in np.unique(space[upper]):
        below = np.unique(room[lower[space[upper] == name]])
        if len(below) == 1:
            result[above & (space == name)] = below[0]
    return result


def _adopt(room: Ints, known: Bools, openings: dict[tuple[int, int, bool], float]) -> Ints:
    """(L,) rooms, those that are not ``known``, (L,), divided among the rooms around them: from
    these on, the largest opening first, then passages."""
    adjacent: list[list[tuple[tuple[bool, float], int]]] = [[] for _ in room]
    for (a, b, passage), area in openings.items():
        order = passage, -float(f"{area:.{DIGITS}g}")
        adjacent[a].append((order, b))
        adjacent[b].append((order, a))
    waiting = [(order, b, int(room[a])) for a in np.flatnonzero(known) for order, b in adjacent[a]]
    heapq.heapify(waiting)
    result, waits = room.copy(), ~known
    while waiting:
        _, leaf, name = heapq.heappop(waiting)
        if waits[leaf]:
            result[leaf], waits[leaf] = name, False
            for order, b in adjacent[leaf]:
                heapq.heappush(waiting, (order, b, name))
    return result


class _Regions(Groups):
    """Groups of leaves, by rank, that cost little where the opening between them is large."""

    _only_within = False  # whether only regions in one volume are joined

    def __init__(self, cells: Cells, rank: Ints, volume: Ints) -> None:
        """``volume``: (L,) the volume that each leaf is in, -1 for none."""
        kept = (cells.leaf_cell[cells.portal_leaf] >= 0).all(axis=1, keepdims=True)
        passage, ends = cells.portal_passage, np.where(kept, rank[cells.portal_leaf], 0)
        joins = ~(passage | cells.in_ceiling)
        super().__init__(cells.leaf_count, np.where(joins[:, None], ends, 0))
        self._passages = np.sort(ends[passage], axis=1).tolist(), cells.portal_area[passage]
        order = np.argsort(rank)
        self._volume = cells.leaf_volumes()[order]
        plan = cells.leaf_point[:, [0, 2]]
        rows = np.repeat(np.arange(cells.leaf_count), np.diff(cells.leaf_point_start))
        hulls = shapely.convex_hull(shapely.multipoints(plan, indices=rows))
        self._plan: list[Geometry] = list(hulls[order].tolist())
        self._section = [_section(v, p) for v, p in zip(self._volume, self._plan, strict=True)]
        self._area = cells.portal_area.tolist()
        self._touching = _touching(cells, cells.tolerance.plane)
        self._opening: dict[tuple[int, int], float] = {}
        self._within = volume[order].tolist()

    def grow_within(self) -> Ints:
        """(L,) the groups, once those in one volume are joined."""
        if max(self._within, default=-1) < 0:
            return self._parent
        self._only_within = True
        result = self.grow(lambda closed: -closed >= OPEN_WITHIN)
        self._only_within = False
        return result

    def _keep_apart(self, a: int, b: int) -> bool:
        """Whether the volumes that two regions are in keep them apart."""
        first, second = self._within[a], self._within[b]
        return bool(first != second and (self._only_within or min(first, second) >= 0))

    def openings(self) -> dict[tuple[int, int, bool], float]:
        """m² between two regions, the lower one first, by portals of sight and by passages."""
        pairs = ((a, b) for a, near in enumerate(self.near) for b in near if a < b)
        result = {(a, b, False): self._largest_opening(self.near[a][b]) for a, b in pairs}
        for (a, b), area in zip(*self._passages, strict=True):
            result[a, b, True] = max(float(area), result.get((a, b, True), 0.0))
        return result

    def cost(self, a: int, b: int) -> float:
        """Less the opening between them, as a share of the narrower one's cross-section."""
        if self._keep_apart(a, b):
            return np.inf
        if (a, b) not in self._opening:
            self._opening[a, b] = self._largest_opening(self.near[a][b])
        share = self._opening[a, b] / min(self._section[a], self._section[b])
        if self._only_within and self._opening[a, b] >= LARGE_OPENING:
            share = max(share, OPEN_WITHIN)
        return -float(f"{share:.{DIGITS}g}")

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        """The group with more neighbours keeps its name."""
        if len(self.near[a]) < len(self.near[b]):
            a, b = b, a
        self._volume[a] += self._volume[b]
        self._within[a] = max(self._within[a], self._within[b])
        both = shapely.geometrycollections([self._plan[a], self._plan[b]])
        self._plan[a] = shapely.convex_hull(both)
        self._section[a] = max(
            self._section[a], self._section[b], _section(self._volume[a], self._plan[a])
        )
        changed = super().join(a, b)
        for a, c in changed:
            self._opening.pop((min(a, c), max(a, c)), None)
        return changed

    def _largest_opening(self, doors: list[int]) -> float:
        remaining, largest = set(doors), 0.0
        for door in sorted(doors):
            if door not in remaining:
                continue
            remaining.discard(door)
            group, area = [door], 0.0
            while group:
                k = group.pop()
                area += self._area[k]
                reached = [j for j in self._touching[k] if j in remaining]
                remaining.difference_update(reached)
                group += reached
            largest = max(largest, area)
        return largest


def _section(volume: float, plan: Geometry) -> float:
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
    from ptmtools.cells.kernels import outlines_meet

    result: list[list[int]] = [[] for _ in range(cells.portal_count)]
    if not result:
        return result
    start = cells.portal_start[:-1]
    low = np.minimum.reduceat(cells.portal_point, start) - near / 2
    high = np.maximum.reduceat(cells.portal_point, start) + near / 2
    boxes = shapely.box(low[:, 0], low[:, 2], high[:, 0], high[:, 2])
    i, j = shapely.STRtree(boxes).query(boxes, predicate="intersects")
    close = (i < j) & (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
    i, j = i[close], j[close]
    pairs = np.column_stack([i, j])[np.lexsort((j, i))]
    meets = np.zeros(len(pairs), dtype=np.bool_)
    outlines_meet(cells.portal_point, cells.portal_start, pairs, near, meets)
    for a, b in pairs[meets].tolist():
        result[a].append(b)
        result[b].append(a)
    return result


#: The warning on a model of one cell.
ONE_HALL = Warned("visibility culling saves nothing here: the model is a single hall")


def group_cells(cells: Cells, options: SubdivideOptions, volumes: Volumes | None = None) -> Cells:
    """Groups cells that are single leaves by the options, and names those in ``volumes``.

    Cells are numbered in the order of their first leaves; geometry in a boundary between two
    leaves of one cell lies inside that cell.
    """
    leaf, volumes = leaf_of_cell(cells), volumes or Volumes()
    volume = volumes.assign_leaves(cells)
    kept = volumes_of_one_room(cells, volume)
    cells = replace(cells, notes=(*cells.notes, *unused_notes(volumes, volume, kept)))
    room, group = kept, np.arange(cells.leaf_count)
    if options.cells == "room":
        rank = rank_in_file(cells)
        room = room_of_leaf(cells, rank, kept)
        group = _groups(cells, rank, room, options.gain, bool(volumes.rooms))
    name = np.append(renumber(group[leaf]), np.int32(-1))
    leaf_cell = np.full(cells.leaf_count, -1, dtype=np.int32)
    leaf_cell[leaf] = name[:-1]
    cells = replace(cells, leaf_cell=leaf_cell, triangle_cell=name[cells.triangle_cell])
    if volumes.rooms:
        cells = name_cells(cells, volumes, kept, room)
    if cells.cell_count == 1:
        cells = replace(cells, notes=(*cells.notes, ONE_HALL))
    return cells


def renumber(group: NDArray[np.integer]) -> NDArray[np.int32]:
    """(L,) groups renamed to 0, 1, … in the order in which they first occur."""
    _, first, row = np.unique(group, return_index=True, return_inverse=True)
    place = np.empty(len(first), dtype=np.int32)
    place[np.argsort(first)] = np.arange(len(first))
    return np.asarray(place[row.reshape(-1)])


def _groups(cells: Cells, rank: Ints, room: Ints, gain: float, named: bool) -> Ints:
    """(L,) the groups into which the (L,) rooms, maybe ``named`` ones, are divided; without a
    ceiling all are one hall if that costs little."""
    if gain >= 1 or len(np.unique(room)) == len(room):
        return room
    same = room[cells.portal_leaf[:, 0]] == room[cells.portal_leaf[:, 1]]
    kept = (cells.leaf_cell[cells.portal_leaf] >= 0).all(axis=1)
    inner, above = (rank[cells.portal_leaf[which & kept]] for which in (same, cells.in_ceiling))
    order = np.argsort(rank)
    sees = from_places(sampled_sight(portals_of(cells)), cells.leaf_standing)[np.ix_(order, order)]
    leaf, piece, area = sides(cells)
    surface = np.bincount(leaf, area[piece], cells.leaf_count).astype(np.float64)
    viewers = cells.leaf_volumes() * cells.leaf_standing
    group = join_by_gain(sees, viewers[order], surface[order], inner, gain, above)[rank]
    if cells.ceiling is not None and not named:
        every = np.stack([viewers, surface], axis=1)
        if gain_of(sees[np.ix_(rank, rank)], every, group) < gain:
            return np.zeros(cells.leaf_count, dtype=np.int64)
    return group
