"""Planes in bins of similar normal and offset, so that each finds all that are near it.

There are `_GRIDS` grids of bins, and a plane is looked up in the one in which it lies furthest from
the edges of its bin: its neighbours to a tenth of the step are there, wherever it lies.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.vectors import summed
from ptmtools.cells.welding import distinct
from ptmtools.tolerance import Tolerance

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
