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

Leaves in which nobody can stand have no viewers, and nothing is gained by parting them from one
another. They come last: what adds least to the cost of all groups is joined first, until half of
the threshold has been added. So slivers and what few can see join whatever they are part of, and
the top of a hall that the whole building sees stays by itself.

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
#: Joining what has no viewers may add this share of the threshold to all that is fetched.
ATTACHED = 0.5


def join_by_gain(
    sees: Bools, volume: Floats, area: Floats, pairs: NDArray[np.int32], gain: float
) -> Ints:
    """(L,) for each leaf the leaf that stands for its group.

    Parameters
    ----------
    sees: (L, L) symmetric, which leaf sees which.
    volume, area: (L,) of a leaf, m³ in which viewers are, and of the surfaces in it, m².
    pairs: (n, 2) leaves through whose portals groups may grow.
    gain: no group of which parting gains as much is made; 0 to 1.
    """
    every = np.stack([volume, area], axis=1)
    parted = _Parted(sees.copy(), every.copy(), every, pairs)
    group = parted.grown(lambda gained: gained < gain)
    attached = _Attached(parted.sees, parted.own, every, group[pairs])
    return attached.grown_by(ATTACHED * gain)[group]


class _Costs(Groups):
    """Groups, and what they cost."""

    def __init__(self, sees: Bools, own: Floats, every: Floats, pairs: NDArray[np.integer]) -> None:
        """``sees``: (L, L) which leaves a group sees; ``own``: (L, 2) its volume and area,
        ``every``: those of the leaves. The first two change as groups grow, and a group that
        has joined another has nothing."""
        super().__init__(len(sees), pairs)
        self.sees, self.own, self.every = sees, own, every
        self.before = [self.of(row, each) for row, each in zip(sees, own, strict=True)]

    def together(self, a: int, b: int) -> float:
        """Of two groups as one."""
        return self.of(self.sees[a] | self.sees[b], self.own[a] + self.own[b])

    def of(self, seen: Bools, own: Floats) -> float:
        """Of a group that sees leaves, (L,), and has a volume and an area."""
        volume, area = self.every[seen].sum(axis=0)
        return float(own[0] * area + own[1] * volume)

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self.sees[a] |= self.sees[b]
        self.own[a] += self.own[b]
        self.own[b] = 0.0
        super().join(a, b)
        return [(a, c) for c in self.near[a]]


class _Parted(_Costs):
    """Groups with viewers, that cost what parting them gains."""

    def cost(self, a: int, b: int) -> float:
        if not (self.own[a][0] and self.own[b][0]):
            return np.inf
        together = self.together(a, b)
        gain = 1 - (self.before[a] + self.before[b]) / together if together > 0 else 0.0
        return round(gain, DIGITS)

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self.before[a] += self.before[b]  # of all its leaves apart
        return super().join(a, b)


class _Attached(_Costs):
    """Groups one of which has no viewers, that cost what joining them adds to all costs, as a
    share."""

    def __init__(self, sees: Bools, own: Floats, every: Floats, pairs: NDArray[np.integer]) -> None:
        super().__init__(sees, own, every, pairs)
        self._all = sum(self.before)
        self._added = 0.0

    def grown_by(self, share: float) -> Ints:
        """(L,) the groups, before joining them has added so much; none is joined for 0."""
        return self.grown(lambda added: self._added + added < share)

    def cost(self, a: int, b: int) -> float:
        if self.own[a][0] and self.own[b][0]:
            return np.inf
        added = self.together(a, b) - self.before[a] - self.before[b]
        return round(added / self._all, 2 * DIGITS) if self._all else 0.0

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self._added += self.cost(a, b)
        self.before[a] = self.together(a, b)
        return super().join(a, b)
