"""Outlines of unions of adjacent polygons.

Polygons are given by the numbers of their corners, so that a union needs no geometry: an edge
between two of them runs once each way and cancels, and the remaining edges are loops. This requires
edges that meet in corners on both sides, which `split_at_corners` provides. (Unions by GEOS move
corners by rounding, so that unions side by side no longer meet.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, ranges
from ptmtools.cells.search import connect

#: Number of pairs of an edge and a corner that are compared at a time.
_CHUNK = 1 << 21


@dataclass(frozen=True)
class Edges:
    """Directed edges of polygons, which lie to their left."""

    start: Ints  # (n,) corner where each begins
    end: Ints  # (n,) corner where it ends
    polygon: Ints  # (n,) the polygon of each

    def take(self, rows: Ints | Bools) -> Edges:
        return Edges(self.start[rows], self.end[rows], self.polygon[rows])

    def number_ends(self) -> tuple[Ints, Ints]:
        """(n,) numbers, equal for edges with the same two ends, and (n,) 1 or -1 by direction."""
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        code = low * (int(high.max(initial=0)) + 1) + high
        _, number = np.unique(code, return_inverse=True)
        return number.reshape(-1), np.where(self.start < self.end, 1, -1)


def split_at_corners(
    points: Floats, edges: Edges, line: Ints, reach: float
) -> tuple[Edges, Ints, Floats]:
    """Edges split where a corner of another edge of the same ``line``, (n,), lies on them.

    ``line`` gathers edges that may overlap: those along one straight line, or more. A corner lies
    on an edge if it is within ``reach`` metres.

    Returns the parts, (m,) the edge of each, ascending and then along the edge, and (m,) the start
    of each on that edge, from 0 to 1.
    """
    edge, corner, place = _on_edges(points, edges, line, reach)
    count = len(edges.start)
    edge = np.concatenate([np.arange(count), edge])
    corner = np.concatenate([edges.start, corner])
    place = np.concatenate([np.zeros(count), place])
    order = np.lexsort((place, edge))
    edge, corner, place = edge[order], corner[order], place[order]
    last = np.ones(len(edge), dtype=np.bool_)
    last[:-1] = edge[1:] != edge[:-1]
    end = np.where(last, edges.end[edge], np.roll(corner, -1))
    return Edges(corner, end, edges.polygon[edge]), edge, place


def _on_edges(points: Floats, edges: Edges, line: Ints, reach: float) -> tuple[Ints, Ints, Floats]:
    """Pairs of an edge and a corner of its line on it, and the place on the edge, 0 to 1."""
    ends = np.stack([points[edges.start], points[edges.end]])
    low, high = ends.min(axis=0) - reach, ends.max(axis=0) + reach
    both = np.stack([np.tile(line, 2), np.append(edges.start, edges.end)], axis=1)
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    both = both[np.append(True, (np.diff(both, axis=0) != 0).any(axis=1))[: len(both)]]
    # Searched along the axis with the fewest candidates: nearly all edges run along one axis, and
    # have no extent on the others.
    corners, first, count = [], [], []
    for axis in range(3):
        at = both[:, 0] + 1j * points[both[:, 1], axis]  # complex numbers sort by line, then place
        order = np.argsort(at, kind="stable")
        corners.append(both[order, 1])
        first.append(np.searchsorted(at[order], line + 1j * low[:, axis]))
        end = np.searchsorted(at[order], line + 1j * high[:, axis], "right")
        count.append(end - first[axis])
    row = np.arange(len(line))
    axis = np.argmin(count, axis=0)
    from_, many = np.array(first)[axis, row], np.array(count)[axis, row]
    of_axis = np.array(corners)
    chunk = (np.cumsum(many) - many) // _CHUNK
    parts = []
    for part in np.split(row, np.flatnonzero(np.diff(chunk)) + 1):
        edge = np.repeat(part, many[part])
        corner = of_axis[axis[edge], ranges(from_[part], many[part])]
        inner = (corner != edges.start[edge]) & (corner != edges.end[edge])
        edge, corner = edge[inner], corner[inner]
        way, ahead = ends[1, edge] - ends[0, edge], points[corner] - ends[0, edge]
        place = np.einsum("ij,ij->i", ahead, way) / np.einsum("ij,ij->i", way, way)
        off = ahead - place[:, None] * way
        on = (place > 0) & (place < 1) & (np.einsum("ij,ij->i", off, off) <= reach**2)
        parts.append((edge[on], corner[on], place[on]))
    edge, corner, place = (np.concatenate(column) for column in zip(*parts, strict=True))
    return edge, corner, place


def unite_edges(edges: Edges, kind: Ints) -> tuple[Edges, Ints]:
    """The edges that remain when polygons of one ``kind``, (polygons,), that share edges are
    united; and (polygons,) the first polygon of the union of each, which names the union."""
    number, way = edges.number_ends()
    kind_of_edge = kind[edges.polygon]
    order = np.lexsort((number, kind_of_edge))
    change = np.ones(len(order), dtype=np.bool_)
    change[1:] = (np.diff(kind_of_edge[order]) != 0) | (np.diff(number[order]) != 0)
    first = np.flatnonzero(change)
    # Pairs of opposite edges cancel; overlapping polygons may have any number, which remain.
    first = first[np.diff(np.append(first, len(order))) == 2]
    i, j = order[first], order[first + 1]
    opposite = way[i] != way[j]
    i, j = i[opposite], j[opposite]
    stays = np.ones(len(order), dtype=np.bool_)
    stays[i] = stays[j] = False
    union = connect(len(kind), edges.polygon[np.stack([i, j], axis=1)])
    remaining = edges.take(stays)
    return Edges(remaining.start, remaining.end, union[remaining.polygon]), union


def straight_corners(points: Floats, edges: Edges, reach: float) -> Ints:
    """The corners, ascending, at which all edges continue along one straight line."""
    number, _ = edges.number_ends()
    _, representative = np.unique(number, return_index=True)
    start, end = edges.start[representative], edges.end[representative]
    ends, beyond = np.append(start, end), np.append(end, start)
    order = np.argsort(ends, kind="stable")
    corner, first, count = np.unique(ends[order], return_index=True, return_counts=True)
    first, corner = first[count == 2], corner[count == 2]
    before, after = points[beyond[order[first]]], points[beyond[order[first + 1]]]
    return np.asarray(corner[_lie_between(points[corner], before, after, reach)])


def bent_corners(point: Floats, start: Ints, gone: Bools, reach: float) -> Ints:
    """Of rings, (n, 3) corners and their CSR, the rows that are ``gone`` but farther than ``reach``
    from the edge in their place: many small bends make a large one."""
    row = np.arange(len(point))
    ring = np.repeat(np.arange(len(start) - 1), np.diff(start))
    kept = np.where(gone, -1, row)
    last = np.full(len(start) - 1, -1)
    np.maximum.at(last, ring, kept)
    first = np.full(len(start) - 1, len(point))
    np.minimum.at(first, ring[~gone], row[~gone])
    before = np.maximum.accumulate(kept)
    before = np.where(before < start[ring], last[ring], before)
    after = np.minimum.accumulate(np.where(gone, len(point), row)[::-1])[::-1]
    after = np.where(after >= start[ring + 1], first[ring], after)
    some = np.flatnonzero(gone)
    ends = before[some], np.minimum(after[some], len(point) - 1)
    return some[~_lie_between(point[some], point[ends[0]], point[ends[1]], reach) | (ends[0] < 0)]


def _lie_between(point: Floats, before: Floats, after: Floats, reach: float) -> Bools:
    """(n,) whether (n, 3) points lie, within ``reach``, on the lines between two others each."""
    way, ahead = after - before, point - before
    with np.errstate(invalid="ignore", divide="ignore"):  # both may be one
        place = np.einsum("ij,ij->i", ahead, way) / np.einsum("ij,ij->i", way, way)
    off = ahead - place[:, None] * way
    near = np.einsum("ij,ij->i", off, off) <= reach**2
    return np.asarray((place > 0) & (place < 1) & near)


def loops(flat: Floats, edges: Edges) -> tuple[Ints, Ints]:
    """Rows of edges in the order of the loops that they form, and the CSR of these; no loop visits
    a corner twice. ``flat``: (n, 2, 2) the ends of each edge in the plane of its polygon."""
    wide = int(max(edges.start.max(initial=0), edges.end.max(initial=0))) + 1
    leaving = edges.polygon * wide + edges.start
    order = np.argsort(leaving, kind="stable")
    first = np.searchsorted(leaving[order], edges.polygon * wide + edges.end)
    last = np.searchsorted(leaving[order], edges.polygon * wide + edges.end, "right")
    # Of several next edges, the one with the smallest part of the plane on its left.
    edge = np.repeat(np.arange(len(order)), last - first)
    after = order[ranges(first, last - first)]
    way = flat[:, 1] - flat[:, 0]
    back, on = -way[edge], way[after]
    turn = np.arctan2(on[:, 0] * back[:, 1] - on[:, 1] * back[:, 0], (on * back).sum(axis=1))
    ranked = np.lexsort((after, np.where(turn > 0, turn, turn + 2 * np.pi), edge))
    best = np.ones(len(ranked), dtype=np.bool_)
    best[1:] = np.diff(edge[ranked]) != 0
    follows = np.arange(len(order))
    follows[edge[ranked[best]]] = after[ranked[best]]
    return _cycles(follows, edges.start)


def _cycles(follows: Ints, start: Ints) -> tuple[Ints, Ints]:
    """The cycles of (n,) rows, each followed by another, and their CSR. A cycle that visits a
    corner twice is split in two: a hole that touches the outline there."""
    row, ends, seen = [], [0], bytearray(len(follows))
    after, corner = follows.tolist(), start.tolist()
    for at in range(len(after)):
        path: list[int] = []
        place: dict[int, int] = {}
        while not seen[at]:
            seen[at] = 1
            if corner[at] in place:
                back = place[corner[at]]
                row += path[back:]
                ends.append(len(row))
                for passed in path[back:]:
                    del place[corner[passed]]
                del path[back:]
            place[corner[at]] = len(path)
            path.append(at)
            at = after[at]
        if path:
            row += path
            ends.append(len(row))
    return np.array(row, dtype=np.int64), np.array(ends, dtype=np.int64)
