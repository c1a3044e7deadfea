"""Triangles by the distinct positions of their corners, and which of them lie side by side.

Model files repeat a vertex for each texture coordinate, object or face that has it; what touches is
told by position, to the last bit. Rows are compared by a hash of 64 bits and then by themselves:
`numpy.unique` over the rows of 15 million corners takes ten times as long, and sorts them by value,
which tears neighbours apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bits, Bools, Floats, Ints
from ptmtools.cells.merging import connected

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
