"""Groups of leaves that grow along portals, the cheapest pair first."""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints

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
        result = self._parent
        while not np.array_equal(result, result[result]):
            result = result[result]
        return result
