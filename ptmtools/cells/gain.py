"""What it gains to part a room, and the leaves that are one cell because it gains too little.

Whoever is in a cell has to fetch all that the cell may see, and whoever may see a cell has to
fetch all of it. With v the volume of a leaf (how often somebody is in it), w the area of the
surfaces in it (what it takes to fetch it) and S the leaves that it sees, a group G of leaves costs

    apart     Σ v·w(S) + w·v(S)  over the leaves of G
    together  v(G)·w(∪S) + w(G)·v(∪S)

and the **gain** of parting it is 1 - apart / together, the share of the fetching that this saves.
It is 0 in a hall, whatever the size of the rest of the building, and says the same in any unit.
Groups are joined in the order of what parting the two together would gain, the lower numbered
leaves first where it is the same, as long as that is less than the threshold.

Who sees whom is estimated (`sight`), not computed: the subdivision comes before visibility, and
the estimate decides only where cells end, never what they see.

Tried and rejected: what parting the two groups gains, each taken as the whole that it has become.
Once a cell sees nearly everything, anything may join it, and little by little it is the building.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.merging import Groups

#: Gains that differ by less are equal, in digits: symmetrical buildings have many, which rounding
#: must not put in order.
DIGITS = 4


def join_by_gain(
    sees: Bools, volume: Floats, area: Floats, pairs: NDArray[np.int32], gain: float
) -> Ints:
    """(L,) for each leaf the leaf that stands for its group.

    Parameters
    ----------
    sees: (L, L) symmetric, which leaf sees which.
    volume, area: (L,) of a leaf, m³, and of the surfaces in it, m².
    pairs: (n, 2) leaves through whose portals groups may grow.
    gain: no group of which parting gains as much is made; 0 to 1.
    """
    return _Parted(sees, volume, area, pairs).grown(lambda gained: gained < gain)


class _Parted(Groups):
    """Groups that cost what parting them gains."""

    def __init__(self, sees: Bools, volume: Floats, area: Floats, pairs: NDArray[np.int32]) -> None:
        super().__init__(len(sees), pairs)
        self._all = np.stack([volume, area], axis=1)
        self._sees = sees.copy()
        self._own = self._all.copy()
        self._apart = [self._cost(row, own) for row, own in zip(sees, self._own, strict=True)]

    def cost(self, a: int, b: int) -> float:
        together = self._cost(self._sees[a] | self._sees[b], self._own[a] + self._own[b])
        gain = 1 - (self._apart[a] + self._apart[b]) / together if together > 0 else 0.0
        return round(gain, DIGITS)

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self._sees[a] |= self._sees[b]
        self._own[a] += self._own[b]
        self._apart[a] += self._apart[b]
        super().join(a, b)
        return [(a, c) for c in self.near[a]]

    def _cost(self, seen: Bools, own: Floats) -> float:
        volume, area = self._all[seen].sum(axis=0)
        return float(own[0] * area + own[1] * volume)
