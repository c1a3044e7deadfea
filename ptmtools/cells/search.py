"""The triangles near a plane or in a box, found without looking at all of them.

A building has as many wall planes as rooms and each holds a few of its triangles: asking every
triangle of every plane is quadratic (800 rooms: 24,000 planes and a million triangles). Triangles
are therefore put into blocks of neighbours with bounding boxes, and only blocks that come near the
plane are looked into.

What is as high as something else, found without looking at all of it: a tower has many storeys,
and what is in one has nothing to do with the others.

Planes in bins of similar normal and offset, so that each finds all that are near it.

There are `_GRIDS` grids of bins, and a plane is looked up in the one in which it lies furthest from
the edges of its bin: its neighbours to a tenth of the step are there, wherever it lies.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, summed
from ptmtools.cells.connectivity import distinct
from ptmtools.tolerance import Tolerance

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

    def between(self, plane: Floats, low: float, high: float) -> Ints:
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
    """Things that reach from (n,) ``low`` to (n,) ``high``, metres: sorted by their lowest points
    among those that are about as high."""

    def __init__(self, low: Floats, high: Floats) -> None:
        self._low, self._high = low, high
        size = np.frexp(high - low)[1]
        order = np.lexsort((low, size))
        self._sizes, start = np.unique(size[order], return_index=True)
        self._groups = np.split(order, start[1:]) if len(start) else []

    def between(self, lowest: float, highest: float) -> Ints:
        """Those, ascending, of which something is between two heights, metres."""
        found = [np.zeros(0, dtype=np.int64)]
        for size, group in zip(self._sizes.tolist(), self._groups, strict=True):
            reach = np.searchsorted(self._low[group], [lowest - 2.0**size, highest], "right")
            found.append(group[slice(*reach)])
        about = np.sort(np.concatenate(found))
        meets = (self._high[about] >= lowest) & (self._low[about] <= highest)
        return np.asarray(about[meets])


#: The step of a grid, in the parts of a unit normal, and in shares of the extent.
_STEP = 0.02
#: So many grids, each moved on by as large a share of the step: one more than a plane has numbers,
#: so that in one of them none of its numbers is nearer to an edge than half that share.
_GRIDS = 5
#: So many planes of a bin are tried in vain before only some of the others are.
_TRIES = 64
#: Of these, so many for each area that would do: one in 3,000 layers of just that area is missed.
_DRAWS = 8


class Bins:
    """Bins of (n, 4) planes."""

    def __init__(self, planes: Floats, tolerance: Tolerance) -> None:
        step = np.array([_STEP] * 3 + [_STEP * tolerance.extent])
        self.count = 0
        self._label = np.empty((len(planes), _GRIDS), dtype=np.int32)
        own, widest = np.zeros(len(planes), dtype=np.int32), np.full(len(planes), -1.0)
        for grid in range(_GRIDS):
            at = planes / step + grid / _GRIDS
            key = np.floor(at)
            first, label = distinct(key.astype(np.int64))
            self._label[:, grid] = label + self.count
            self.count += len(first)
            inner = np.minimum(at - key, 1 - (at - key)).min(axis=1)
            own[inner > widest] = self._label[inner > widest, grid]
            widest = np.maximum(widest, inner)
        self.own: NDArray[np.int32] = own  # (n,) the bin in which each plane is looked up

    def weights(self, weights: Floats) -> Floats:
        """(b,) the sum in each bin of (n,) weights."""
        every = np.repeat(weights, _GRIDS)
        return summed(self._label.ravel(), every, self.count)

    def drop(self, weights: Floats, planes: Ints, weight: Floats) -> None:
        """Takes these planes, which weigh (k,) ``weight``, out of the ``weights`` of the bins."""
        np.subtract.at(weights, self._label[planes].ravel(), np.repeat(weight, _GRIDS))

    def members(self) -> tuple[Ints, Ints]:
        """(b + 1,) and (n * grids,): the planes in each bin, ascending, as a CSR."""
        every = self._label.ravel()
        order = np.argsort(every, kind="stable") // _GRIDS
        return np.append(0, np.cumsum(np.bincount(every, minlength=self.count))), order

    def beside(self, planes: Ints, weights: Floats) -> Floats:
        """(k,) how much of (k,) ``weights``, of these planes, is in the bin of each of them."""
        names, place = np.unique(self._label[planes], return_inverse=True)
        sums = summed(place.ravel(), np.repeat(weights, _GRIDS), len(names))
        found: Floats = sums[np.searchsorted(names, self.own[planes])]
        return found

    def holds(self, name: int, planes: Ints) -> Bools:
        """(k,) which of these planes are in a bin."""
        found: Bools = (self._label[planes] == name).any(axis=1)
        return found


class Tries:
    """Which planes are worth trying, where most are tried in vain.

    A scanned wall has a hundred thousand triangles, and each has a plane of its own, near which lie
    all the others. To hold each against all takes the square of their number. A plane that holds
    enough area is found as well by trying planes drawn in proportion to their areas, of which it
    has its share, so the tries are as many as the area is times what is needed.
    """

    def __init__(self, bin_of: NDArray[np.integer], areas: Floats) -> None:
        """``bin_of``, ``areas``: (n,) of each plane."""
        self._bin, self._areas = bin_of, areas
        self._failed = np.zeros(int(bin_of.max(initial=-1)) + 1, dtype=np.int64)
        self.worth: Bools = np.ones(len(areas), dtype=bool)  # (n,)

    def fail(self, plane: int, others: Ints, needed: float) -> None:
        """A plane held less than the area ``needed``; ``others`` are those around it that have not
        been tried."""
        name = self._bin[plane]
        self._failed[name] += 1
        if self._failed[name] == _TRIES:
            others = others[self._bin[others] == name]
            along = np.floor(np.cumsum(self._areas[others]) * (_DRAWS / needed))
            self.worth[others] = np.diff(along, prepend=0.0) > 0
