"""Decides near ties of the portal flow: whether a line can pass a sequence of portals, in
double-double arithmetic (``docs/design/visibility.md``, "Near ties").

Portals are first made exactly plane, by moving their vertices along one axis, and shrunk by
`Tolerance.noise`. A search is repeated with the sequences accepted that a line can pass, as long as
this produces new near ties. If there are too many, or a budget ends, all are accepted: looser, but
still conservative.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from ptmtools.arrays import Bits, Ints
from ptmtools.portal_flow.storage import DDPortals, DDScratch, PortalArrays, Scratch
from ptmtools.tolerance import Tolerance

#: Vertices that clipping may add to a portal before it is left unclipped.
GROWTH = 72


class SequenceTest:
    """Tests sequences of portals. Not to be shared between threads."""

    def __init__(self, geometry: PortalArrays) -> None:
        self._geometry = geometry
        self._portals = DDPortals(
            np.zeros(geometry.point.shape, complex), geometry.start, geometry.normal
        )
        self._loaded = np.zeros(len(geometry.start) - 1, dtype=np.bool_)
        _, self._exponent = math.frexp(float(np.abs(geometry.point).max(initial=0.0)))
        self._noise = Tolerance.for_points(geometry.point).noise
        vertices = int(np.diff(geometry.start).max(initial=0)) + GROWTH
        self._scratch = DDScratch(
            polygon=np.zeros((4, vertices, 3), complex),
            size=np.zeros(4, np.int64),
            cuts=np.zeros(4, np.int64),
            plane=np.zeros((2, 2 * vertices + 1, 4), complex),
            side=np.zeros(vertices, complex),
            vector=np.zeros((2, 3), complex),
        )

    def passes(self, sequence: tuple[int, ...]) -> bool:
        """Whether any part of a sequence of directed portals remains after clipping as in the flow;
        False proves that no line passes the interiors of all of them in turn."""
        from ptmtools.portal_flow.double_double_kernels import something_left

        for q in sequence:
            if not self._loaded[q >> 1]:
                self._load(q >> 1)
        return something_left(self._portals, self._scratch, np.array(sequence, np.int64))

    def _load(self, k: int) -> None:
        """Coordinates of portal k over a power of two, none above 1, rounded to double-double."""
        g = self._geometry
        span = slice(g.start[k], g.start[k + 1])
        inward = g.ball[k, :3] - g.point[span]
        length = np.linalg.norm(inward, axis=1, keepdims=True)
        share = np.divide(self._noise, length, out=np.ones_like(length), where=length > 0)
        drawn_in = g.point[span] + np.minimum(share, 1.0) * inward
        normal = [Fraction(n) for n in g.normal[k].tolist()]
        axis = max(range(3), key=lambda a: abs(normal[a]))
        points = [[Fraction(x) for x in row] for row in drawn_in.tolist()]
        first = points[0]
        for i, point in enumerate(points):
            above = sum(n * (x - o) for n, x, o in zip(normal, point, first, strict=True))
            for a, x in enumerate(point):
                exact = x - above / normal[axis] if a == axis else x
                high = float(exact)
                low = float(exact - Fraction(high))
                self._portals.point[span.start + i, a] = complex(
                    math.ldexp(high, -self._exponent),
                    math.ldexp(low, -self._exponent),
                )
        self._loaded[k] = True


#: Sequences tested in double-double for one directed portal, at most.
DECIDED = 64
#: No search is done again when this many budgets are spent.
COSTLIEST = 3


class SearchCost(NamedTuple):
    """The cost of a search, summed over all repetitions except ``cut`` and ``ties``: see `Pvs`."""

    cut: bool
    work: int
    ties: int
    decided: int
    opened: int


def search(
    g: PortalArrays,
    s: Scratch,
    test: SequenceTest,
    known: Bits,
    source: int,
    budget: int,
    seen: Bits,
) -> SearchCost:
    """Adds to the row ``seen`` (W,), zeroed or with what is seen already, what a directed portal
    sees; the arguments are those of `flow_kernels.flow`."""
    from ptmtools.portal_flow import flow_kernels as kernels

    none = np.zeros(0, np.uint64)
    work, cut, ties, used = kernels.flow(g, s, known, source, budget, none, False, seen)
    rejected = set(noted := _sequences(s.near_tie[:used]))
    overflown = len(noted) < ties
    if not (overflown or _deciding(known, known[source] & ~seen, rejected)):
        return SearchCost(cut, work, ties, 0, 0)
    # Searches again with all of them accepted, for the portals not seen yet.
    loose = seen.copy()
    more, loosely, _, _ = kernels.flow(g, s, known, source, budget, none, True, loose)
    work += more
    passes: dict[tuple[int, ...], bool] = {}
    while not (cut or loosely or overflown) and work < COSTLIEST * budget:
        new = _deciding(known, loose & ~seen, rejected - passes.keys())
        if len(passes) + len(new) > DECIDED:
            break
        for sequence in new:
            passes[sequence] = test.passes((source, *sequence))
        if not any(passes[sequence] for sequence in new):
            return SearchCost(False, work, ties, len(passes), sum(passes.values()))
        opened = np.sort(np.array([_mark(way) for way, open_ in passes.items() if open_]))
        more, cut, near, used = kernels.flow(g, s, known, source, budget, opened, False, seen)
        work, ties = work + more, max(ties, near)
        rejected = set(noted := _sequences(s.near_tie[:used]))
        overflown = len(noted) < near
    seen |= loose
    return SearchCost(True, work, ties, len(passes), sum(passes.values()))


def _mark(sequence: tuple[int, ...]) -> np.uint64:
    from ptmtools.portal_flow import flow_kernels as kernels

    return np.uint64(kernels.mark(np.array(sequence, np.int64), 0, len(sequence)))


def _sequences(words: Ints) -> list[tuple[int, ...]]:
    """The sequences in `Scratch.near_tie`, each after its length."""
    row = words.tolist()
    result = []
    at = 0
    while at < len(row):
        following = at + 1 + row[at]
        result.append(tuple(row[at + 1 : following]))
        at = following
    return result


def _deciding(known: Bits, doubtful: Bits, rejected: set[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """The rejected sequences, in order, whose last portal, or a portal that may lie behind it, is
    among the ``doubtful`` (W,)."""
    lasts = np.array(sorted({sequence[-1] for sequence in rejected}), np.int64)
    itself = doubtful[lasts >> 6] >> (lasts & 63).astype(np.uint64) & np.uint64(1)
    decides = itself.astype(bool) | np.any(known[lasts] & doubtful, axis=1)
    kept = set(lasts[decides].tolist())
    return sorted(sequence for sequence in rejected if sequence[-1] in kept)
