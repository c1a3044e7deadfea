"""Groups of leaves that grow along portals, the cheapest pair first, and what dividing a room into
cells saves.

A room is one cell, unless dividing it saves its viewers more than `SubdivideOptions.gain` of their
download. With v the volume of a leaf (the frequency of viewers in it), w the area of the surfaces
in it (their cost) and S the leaves that it sees (`sight`), a group G of leaves costs

    apart     Σ v·w(S) + w·v(S)  over the leaves of G
    together  v(G)·w(∪S) + w(G)·v(∪S)

and the **gain** of dividing it is 1 - apart / together. Groups are joined in the order of the gain
of dividing the two, as long as it is less than the threshold. Leaves without standing room come
last: the pair that adds least to the cost of all groups is joined first, until half of the
threshold has been added.
"""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints

#: Shares, and gains, are compared in this many significant digits: symmetrical buildings have many
#: equal ones, which rounding must not order, not even that of a sliver far from the origin.
DIGITS = 4


class Groups(ABC):
    """Groups of leaves, each named by one of its leaves, initially of one leaf each.

    Attributes
    ----------
    near: for each group its neighbours, each with the portals between the two.
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
        """The cost of joining two adjacent groups, the lower one first; rounded, so that last
        digits do not decide the order."""

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

    def grow(self, joins: Callable[[float], bool]) -> Ints:
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
        result = self._parent
        while not np.array_equal(result, result[result]):
            result = result[result]
        return result


#: Joining leaves without viewers may add this share of the threshold to the whole download.
ATTACHED = 0.5


def join_by_gain(
    sees: Bools,
    volume: Floats,
    area: Floats,
    pairs: NDArray[np.integer],
    gain: float,
    above: NDArray[np.integer] | None = None,
) -> Ints:
    """(L,) for each leaf the leaf that stands for its group.

    Parameters
    ----------
    sees: (L, L) symmetric, visibility between leaves.
    volume, area: (L,) of a leaf, m³ in which viewers are, and of the surfaces in it, m².
    pairs: (n, 2) leaves through whose portals groups may grow.
    gain: threshold, 0 to 1, of the gain of dividing a group.
    above: (m, 2) leaves through whose portals only groups with viewers may grow.
    """
    every = np.stack([volume, area], axis=1)
    more = pairs if above is None else np.concatenate([pairs, above])
    parted = _Parted(sees.copy(), every.copy(), every, more)
    group = parted.grow(lambda gained: gained < gain)
    attached = _Attached(parted.sees, parted.own, every, group[pairs])
    return attached.grow_by(ATTACHED * gain)[group]


class _Costs(Groups):
    """Groups and their costs."""

    def __init__(
        self, sees: Bools, sums: Floats, every: Floats, pairs: NDArray[np.integer]
    ) -> None:
        """``sees``: (L, L) which leaves a group sees; ``sums``: (L, 2) its volume and area,
        ``every``: those of the leaves. The first two change as groups grow, and a group that
        has joined another has nothing."""
        super().__init__(len(sees), pairs)
        self.sees, self.own, self.every = sees, sums, every
        self.before = [
            cost(row, sum_of_group, every) for row, sum_of_group in zip(sees, sums, strict=True)
        ]

    def joint_cost(self, a: int, b: int) -> float:
        """The cost of two groups joined."""
        return cost(self.sees[a] | self.sees[b], self.own[a] + self.own[b], self.every)

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self.sees[a] |= self.sees[b]
        self.own[a] += self.own[b]
        self.own[b] = 0.0
        super().join(a, b)
        return [(a, c) for c in self.near[a]]


class _Parted(_Costs):
    """Groups with viewers; the cost of a pair is the gain of dividing it."""

    def cost(self, a: int, b: int) -> float:
        if not (self.own[a][0] and self.own[b][0]):
            return np.inf
        together = self.joint_cost(a, b)
        gain = 1 - (self.before[a] + self.before[b]) / together if together > 0 else 0.0
        return round(gain, DIGITS)

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self.before[a] += self.before[b]  # of all its leaves apart
        return super().join(a, b)


class _Attached(_Costs):
    """Pairs of groups, one without viewers; the cost is the share that joining adds to all
    costs."""

    def __init__(
        self, sees: Bools, sums: Floats, every: Floats, pairs: NDArray[np.integer]
    ) -> None:
        super().__init__(sees, sums, every, pairs)
        self._all = sum(self.before)
        self._added = 0.0

    def grow_by(self, share: float) -> Ints:
        """(L,) the groups, before joining has added ``share``; none is joined for 0."""
        return self.grow(lambda added: self._added + added < share)

    def cost(self, a: int, b: int) -> float:
        if self.own[a][0] and self.own[b][0]:
            return np.inf
        added = self.joint_cost(a, b) - self.before[a] - self.before[b]
        return round(added / self._all, 2 * DIGITS) if self._all else 0.0

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self._added += self.cost(a, b)
        self.before[a] = self.joint_cost(a, b)
        return super().join(a, b)


def cost(seen: Bools, sums: Floats, every: Floats) -> float:
    """The cost of a group that sees leaves, (L,), and has a volume and an area, (2,); ``every``:
    (L, 2) those of the leaves."""
    volume, area = every[seen].sum(axis=0)
    return float(sums[0] * area + sums[1] * volume)


def gain_of(sees: Bools, every: Floats, group: Ints) -> float:
    """The gain of dividing everything into groups, (L,), of leaves that see, (L, L), one another;
    ``every``: (L, 2) their volumes and areas."""

    def cost_of(members: Bools) -> float:
        seen = np.asarray(sees[members].any(axis=0))
        return cost(seen, every[members].sum(axis=0), every)

    together = cost_of(np.ones(len(group), dtype=np.bool_))
    apart = sum(cost_of(group == name) for name in np.unique(group))
    return 1 - apart / together if together > 0 else 0.0
