"""Leaves that grow together into groups: of two groups side by side, the best pair is joined first.

The cost of a pair is known by a heap. What joining changes for pairs of the new group is put in
anew; a cost that rises by itself is noticed when its turn comes.

Triangles by the distinct positions of their corners, and which of them lie side by side.

Model files repeat a vertex for each texture coordinate, object or face that has it; what touches is
told by position, to the last bit. Rows are compared by a hash of 64 bits and then by themselves:
`numpy.unique` over the rows of 15 million corners takes ten times as long, and sorts them by value,
which tears neighbours apart.
"""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bits, Bools, Floats, Ints


class Groups(ABC):
    """Groups of leaves, each called by one of its leaves, at first of one leaf each.

    Attributes
    ----------
    near: for each group those beside it, each with the portals between the two.
    """

    def __init__(self, count: int, pairs: NDArray[np.integer]) -> None:
        """``pairs``: (K, 2) the leaves on both sides of each portal."""
        self.near: list[dict[int, list[int]]] = [{} for _ in range(count)]
        self._parent = np.arange(count)
        for k, (a, b) in enumerate(pairs.tolist()):
            if a != b:
                self.near[a].setdefault(b, []).append(k)
                self.near[b][a] = self.near[a][b]

    @abstractmethod
    def cost(self, a: int, b: int) -> float:
        """What joining two groups side by side costs, the lower one first; rounded, so that last
        digits put nothing in order."""

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        """Adds b to a; returns the pairs that are new or may cost less than before."""
        self._parent[b] = a
        changed, self.near[b] = self.near[b], {}
        del changed[a], self.near[a][b]
        for c, portals in changed.items():
            del self.near[c][b]
            both = [*self.near[a].get(c, ()), *portals]
            self.near[a][c] = self.near[c][a] = both
        return [(a, c) for c in changed]

    def grown(self, joins: Callable[[float], bool]) -> Ints:
        """(L,) the group of each leaf, once all pairs are joined whose cost ``joins``; equally
        cheap ones in the order of their names."""
        waiting: list[tuple[float, int, int]] = []
        latest: dict[tuple[int, int], float] = {}

        def put(a: int, b: int) -> None:
            pair = (min(a, b), max(a, b))
            latest[pair] = self.cost(*pair)
            heapq.heappush(waiting, (latest[pair], *pair))

        for a, near in enumerate(self.near):
            for b in near:
                if a < b:
                    put(a, b)
        while waiting and joins(waiting[0][0]):
            cost, a, b = heapq.heappop(waiting)
            if b not in self.near[a] or cost != latest[a, b]:
                continue
            if cost != self.cost(a, b):  # one of them has grown meanwhile
                put(a, b)
                continue
            for pair in self.join(a, b):
                put(*pair)
        return self.ends()

    def ends(self) -> Ints:
        """(L,) the group of each leaf."""
        found = self._parent
        while not np.array_equal(found, found[found]):
            found = found[found]
        return found


def connected(count: int, one: Ints, other: Ints) -> Ints:
    """(count,) the least of those that each thing hangs together with through pairs of (n,) ``one``
    and ``other``, listed both ways."""
    group = np.arange(count)
    while np.any(group[one] != group[other]):
        least = group.copy()
        np.minimum.at(least, group[one], group[other])
        group = least[least[group]]  # pointer jumping: long strips need few rounds
    return group


#: Odd, with no pattern in its bits: 2⁶⁴ over the golden ratio.
_FACTOR = np.uint64(0x9E3779B97F4A7C15)
_HALF = np.uint64(32)
#: A direction in no simple relation to the axes of any building.
_ACROSS = np.array([0.683, 0.577, 0.448])


@dataclass(frozen=True)
class Welded:
    """The distinct triangles among some: neither repeated, whatever their winding, nor flat."""

    point: Floats  # (V, 3) distinct positions
    triangle: NDArray[np.int32]  # (n, 3) rows of them
    source: Ints  # (n,) the first of the triangles that each of them is, ascending

    @staticmethod
    def of(points: Floats, triangles: NDArray[np.integer]) -> Welded:
        """Of (T, 3) triangles over (V, 3) points."""
        first, row = distinct(points)
        renamed = row[triangles]
        low, middle, high = np.sort(renamed, axis=1).T
        whole = np.flatnonzero((low < middle) & (middle < high))
        once, _ = distinct(np.stack([low, middle, high], axis=1)[whole])
        source = whole[once]
        return Welded(points[first], renamed[source].astype(np.int32), source)

    @property
    def corners(self) -> Floats:
        """(n, 3, 3) metres."""
        return self.point[self.triangle]


def distinct(rows: NDArray[np.float64] | NDArray[np.int64]) -> tuple[Ints, Ints]:
    """(k,) the first of each of the distinct (n, w) rows, ascending, and (n,) for each row the
    place of its like among these. Zeros are equal whatever their sign."""
    bits: Bits = np.ascontiguousarray(rows + rows.dtype.type(0)).view(np.uint64)
    code = np.zeros(len(bits), dtype=np.uint64)
    for column in bits.T:
        code = (code ^ column) * _FACTOR
        code ^= code >> _HALF
    order = np.argsort(code, kind="stable")
    alike = code[order[1:]] == code[order[:-1]]
    same = alike.copy()
    for column in bits.T:
        same &= column[order[1:]] == column[order[:-1]]
    if not np.array_equal(alike, same):  # two rows have one hash
        order = np.lexsort(bits.T)
        same = np.all(bits[order[1:]] == bits[order[:-1]], axis=1)
    begins = np.append(True, ~same)[: len(order)]
    first = order[begins]
    place = np.empty(len(first), dtype=np.int64)
    place[np.argsort(first)] = np.arange(len(first))
    row = np.empty(len(order), dtype=np.int64)
    row[order] = place[np.cumsum(begins) - 1]
    return np.sort(first), row


def across_edges(triangle: NDArray[np.integer], turned: Bools) -> NDArray[np.int32]:
    """(n, 3) which of (n, 3) triangles lies beyond the edge from corner k to corner k + 1, or -1
    where there is none, where there are several, and where it has the edge in the same direction.
    Those ``turned`` count as wound the other way."""
    count = len(triangle)
    one, other = triangle.astype(np.int64), np.roll(triangle, -1, axis=1).astype(np.int64)
    low, high = np.minimum(one, other).ravel(), np.maximum(one, other).ravel()
    upward = ((one < other) ^ turned[:, None]).ravel()
    key = low * (int(high.max(initial=0)) + 1) + high
    order = np.argsort(key, kind="stable")
    begin = np.flatnonzero(np.append(True, key[order[1:]] != key[order[:-1]])[: len(order)])
    pairs = begin[np.diff(np.append(begin, len(order))) == 2]
    a, b = order[pairs], order[pairs + 1]
    facing = upward[a] != upward[b]
    a, b = a[facing], b[facing]
    beyond = np.full(3 * count, -1, dtype=np.int32)
    beyond[a], beyond[b] = b // 3, a // 3
    return beyond.reshape(-1, 3)


def first_alike(rows: NDArray[np.float64] | NDArray[np.int64]) -> Ints:
    """(n,) the first of the (n, w) rows that each is equal to."""
    first, row = distinct(rows)
    return first[row]


def welded(points: Floats, reach: float) -> Ints:
    """(n,) the first of the (n, 3) points that each is no farther from than ``reach``, directly or
    by way of others."""
    first = first_alike(points)
    one_each = np.flatnonzero(first == np.arange(len(first)))
    # What is near in space is near along any direction.
    along = points[one_each] @ _ACROSS
    order = np.argsort(along, kind="stable")
    place, step = np.arange(len(order)), 1
    pairs = [np.zeros((2, 0), dtype=np.int64)]
    while len(place := place[place + step < len(order)]):
        pair = order[np.stack([place, place + step])]
        near = along[pair[1]] - along[pair[0]] <= reach
        place, pair = place[near], pair[:, near]
        apart = np.subtract(*points[one_each[pair]])
        pairs.append(pair[:, np.einsum("ij,ij->i", apart, apart) <= reach**2])
        step += 1
    one, other = np.concatenate(pairs, axis=1)
    group = connected(len(one_each), np.append(one, other), np.append(other, one))
    to = np.arange(len(points))
    to[one_each] = one_each[group]
    return to[first]
