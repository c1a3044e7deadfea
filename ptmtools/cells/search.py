"""Searches in less than quadratic time: equal rows, connected indices, triangles near a plane or in
a box, spans of height, and similar planes.

Rows are compared by a hash of 64 bits and then by themselves: `numpy.unique` over the rows of 15
million corners takes ten times as long, and sorts them by value, which separates neighbours.
`Nearby` puts triangles into blocks of neighbours with bounding boxes; `ByHeight` does so for spans
of height. `Bins` holds planes of similar normal and offset in `_GRIDS` grids of bins; a plane is
looked up in the one in which it lies furthest from the edges of its bin, so its neighbours to a
tenth of the step are there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bits, Bools, Floats, Ints, sum_by_group
from ptmtools.tolerance import Tolerance

#: Odd, with no pattern in its bits: 2⁶⁴ over the golden ratio.
_FACTOR = np.uint64(0x9E3779B97F4A7C15)
_HALF = np.uint64(32)
#: A direction in no simple relation to the axes of any building.
_ACROSS = np.array([0.683, 0.577, 0.448])


def distinct(rows: NDArray[np.float64] | NDArray[np.int64]) -> tuple[Ints, Ints]:
    """(k,) the first of each of the distinct (n, w) rows, ascending, and (n,) for each row the
    index of its equal among these. Zeros are equal whatever their sign."""
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


def first_alike(rows: NDArray[np.float64] | NDArray[np.int64]) -> Ints:
    """(n,) the first of the (n, w) rows equal to each."""
    first, row = distinct(rows)
    return first[row]


def weld(points: Floats, reach: float) -> Ints:
    """(n,) the first of the (n, 3) points that chains of steps up to ``reach`` join to each."""
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
    group = connect(len(one_each), np.concatenate(pairs, axis=1).T)
    to = np.arange(len(points))
    to[one_each] = one_each[group]
    return to[first]


def connect(count: int, rows: NDArray[np.integer]) -> Ints:
    """(count,) the least index to which rows, (n, k), such as pairs of neighbours or the corners of
    triangles, connect each index below ``count``."""
    from ptmtools.cells.kernels import connect_rows

    group = np.arange(count)
    connect_rows(np.ascontiguousarray(rows, dtype=np.int64), group)
    return group


#: Triangles in a block.
_BLOCK = 64
#: Bits of each coordinate by which triangles are ordered.
_BITS = 15


class Nearby:
    """Blocks of the (n, 3, 3) triangles ``corners``; ``margin`` metres cover their rounding."""

    def __init__(self, corners: Floats, margin: float) -> None:
        self._margin = margin
        self._order = along_a_curve(corners.mean(axis=1)) if len(corners) else np.zeros(0, int)
        first = np.arange(0, len(corners), _BLOCK)
        points = corners[self._order]
        if len(first):
            low = np.minimum.reduceat(points.min(axis=1), first)
            high = np.maximum.reduceat(points.max(axis=1), first)
        else:
            low = high = np.zeros((0, 3))
        self._middle, self._half = (low + high) / 2, (high - low) / 2

    def find_between(self, plane: Floats, low: float, high: float) -> Ints:
        """Triangles, ascending, among which are all with a point whose distance from the (4,)
        plane, along its normal, is in [low, high]."""
        distance = self._middle @ plane[:3] + plane[3]
        reach = self._half @ np.abs(plane[:3]) + self._margin
        return self._members(np.flatnonzero((distance + reach >= low) & (distance - reach <= high)))

    def meeting(self, low: Floats, high: Floats) -> Ints:
        """Triangles, ascending, among which are all that meet the box between two corners."""
        apart = np.maximum(low - self._middle, self._middle - high) - self._half
        return self._members(np.flatnonzero(np.all(apart <= self._margin, axis=1)))

    def _members(self, block: Ints) -> Ints:
        row = (block[:, None] * _BLOCK + np.arange(_BLOCK)).ravel()
        return np.sort(self._order[row[row < len(self._order)]])


def along_a_curve(points: Floats) -> Ints:
    """An order of (n, k) points in which neighbours mostly follow one another (Morton's)."""
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    share = np.divide(points - low, size, out=np.zeros(points.shape), where=size > 0)
    at = np.minimum(share * 2**_BITS, 2**_BITS - 1).astype(np.int64)
    axes = range(points.shape[1])
    places = ((bit, axis, bit * len(axes) + axis) for bit in range(_BITS) for axis in axes)
    code = sum((at[:, axis] >> bit & 1) << place for bit, axis, place in places)
    return np.argsort(code, kind="stable")


class ByHeight:
    """Spans from (n,) ``low`` to (n,) ``high``, metres, sorted by their lower ends among those of
    similar length."""

    def __init__(self, low: Floats, high: Floats) -> None:
        self._low, self._high = low, high
        size = np.frexp(high - low)[1]
        order = np.lexsort((low, size))
        self._sizes, start = np.unique(size[order], return_index=True)
        self._groups = np.split(order, start[1:]) if len(start) else []

    def find_between(self, lowest: float, highest: float) -> Ints:
        """The spans, ascending, that meet the range between two heights, metres."""
        rows = [np.zeros(0, dtype=np.int64)]
        for size, group in zip(self._sizes.tolist(), self._groups, strict=True):
            reach = np.searchsorted(self._low[group], [lowest - 2.0**size, highest], "right")
            rows.append(group[slice(*reach)])
        about = np.sort(np.concatenate(rows))
        meets = (self._high[about] >= lowest) & (self._low[about] <= highest)
        return np.asarray(about[meets])


#: The step of a grid, in the parts of a unit normal, and in shares of the extent.
_STEP = 0.02
#: Number of grids, each shifted by this fraction of the step: one more than a plane has numbers, so
#: that in one of them none of its numbers is nearer to an edge than half that fraction.
_GRIDS = 5
#: Number of failures in a bin before only some of its other planes are tried.
_TRIES = 64
#: Number of these per sufficient area: one in 3,000 layers of just that area is missed.
_DRAWS = 8


class Bins:
    """Bins of (n, 4) planes."""

    def __init__(self, planes: Floats, tolerance: Tolerance) -> None:
        step = np.array([_STEP] * 3 + [_STEP * tolerance.extent])
        self.count = 0
        self._label = np.empty((len(planes), _GRIDS), dtype=np.int32)
        home, widest = np.zeros(len(planes), dtype=np.int32), np.full(len(planes), -1.0)
        for grid in range(_GRIDS):
            at = planes / step + grid / _GRIDS
            key = np.floor(at)
            first, label = distinct(key.astype(np.int64))
            self._label[:, grid] = label + self.count
            self.count += len(first)
            inner = np.minimum(at - key, 1 - (at - key)).min(axis=1)
            home[inner > widest] = self._label[inner > widest, grid]
            widest = np.maximum(widest, inner)
        self.own: NDArray[np.int32] = home  # (n,) the bin in which each plane is looked up

    def weights(self, weights: Floats) -> Floats:
        """(b,) the sum in each bin of (n,) weights."""
        every = np.repeat(weights, _GRIDS)
        return sum_by_group(self._label.ravel(), every, self.count)

    def drop(self, weights: Floats, planes: Ints, weight: Floats) -> None:
        """Subtracts (k,) ``weight`` of these planes from the ``weights`` of the bins."""
        np.subtract.at(weights, self._label[planes].ravel(), np.repeat(weight, _GRIDS))

    def members(self) -> tuple[Ints, Ints]:
        """(b + 1,) and (n * grids,): the planes in each bin, ascending, as a CSR."""
        every = self._label.ravel()
        order = np.argsort(every, kind="stable") // _GRIDS
        return np.append(0, np.cumsum(np.bincount(every, minlength=self.count))), order

    def own_sums(self, planes: Ints, weights: Floats) -> Floats:
        """(k,) the sum of (k,) ``weights``, of these planes, in the bin of each."""
        names, place = np.unique(self._label[planes], return_inverse=True)
        sums = sum_by_group(place.ravel(), np.repeat(weights, _GRIDS), len(names))
        result: Floats = sums[np.searchsorted(names, self.own[planes])]
        return result

    def holds(self, name: int, planes: Ints) -> Bools:
        """(k,) whether these planes are in a bin."""
        result: Bools = (self._label[planes] == name).any(axis=1)
        return result


class Tries:
    """Planes worth trying, where most tries fail.

    A scanned wall has a hundred thousand triangles, each with a plane of its own that is near all
    the others. Comparing each with all takes the square of their number. Planes drawn in proportion
    to their areas hit one that holds enough area as well, so the number of tries is proportional to
    the total area over the area needed.
    """

    def __init__(self, bin_of: NDArray[np.integer], areas: Floats) -> None:
        """``bin_of``, ``areas``: (n,) of each plane."""
        self._bin, self._areas = bin_of, areas
        self._failed = np.zeros(int(bin_of.max(initial=-1)) + 1, dtype=np.int64)
        self.worth: Bools = np.ones(len(areas), dtype=bool)  # (n,)

    def fail(self, plane: int, others: Ints, needed: float) -> None:
        """Records that a plane held less than the area ``needed``; ``others``: untried planes
        around it."""
        name = self._bin[plane]
        self._failed[name] += 1
        if self._failed[name] == _TRIES:
            others = others[self._bin[others] == name]
            along = np.floor(np.cumsum(self._areas[others]) * (_DRAWS / needed))
            self.worth[others] = np.diff(along, prepend=0.0) > 0
