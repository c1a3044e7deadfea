"""Searches whose near ties are decided in double-double arithmetic.

A near tie is a sequence of portals that a search rejected by less than the rounding of its
arithmetic allows to be sure of (`clipping_kernels`). Another search that lets all near ties pass
tells what depends on them, mostly nothing. Those on which something depends are put to
`SequenceTest`. Where a line can pass one, the search is done again with that let through, as often
as this brings up new ones. Where there are too many, or a budget ends, all are let through: looser,
and conservative as ever.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ptmtools.arrays import Bits, Ints
from ptmtools.portal_flow.double_double import SequenceTest
from ptmtools.portal_flow.storage import Geometry, Scratch

#: Sequences tested in double-double for one directed portal, at most.
DECIDED = 64
#: No search is done again when this many budgets are spent.
COSTLIEST = 3


class Searched(NamedTuple):
    """What a search took, all repetitions together but for ``cut`` and ``ties``: see `Pvs`."""

    cut: bool
    work: int
    ties: int
    decided: int
    opened: int


def searched(
    g: Geometry, s: Scratch, test: SequenceTest, known: Bits, source: int, budget: int, seen: Bits
) -> Searched:
    """Fills the zeroed row ``seen`` (W,) with what a directed portal sees; the arguments are those
    of `flow_kernels.flow`."""
    from ptmtools.portal_flow import flow_kernels as kernels

    none = np.zeros(0, np.uint64)
    work, cut, ties, used = kernels.flow(g, s, known, source, budget, none, False, seen)
    rejected = set(noted := _sequences(s.near_tie[:used]))
    overflown = len(noted) < ties
    if not (overflown or _deciding(known, known[source] & ~seen, rejected)):
        return Searched(cut, work, ties, 0, 0)
    # With all of them let through, what more is seen? What is seen already need not be found again.
    most = seen.copy()
    more, loosely, _, _ = kernels.flow(g, s, known, source, budget, none, True, most)
    work += more
    passes: dict[tuple[int, ...], bool] = {}
    while not (cut or loosely or overflown) and work < COSTLIEST * budget:
        new = _deciding(known, most & ~seen, rejected - passes.keys())
        if len(passes) + len(new) > DECIDED:
            break
        for sequence in new:
            passes[sequence] = test.passes((source, *sequence))
        if not any(passes[sequence] for sequence in new):
            return Searched(False, work, ties, len(passes), sum(passes.values()))
        opened = np.sort(np.array([_mark(way) for way, open_ in passes.items() if open_]))
        more, cut, found, used = kernels.flow(g, s, known, source, budget, opened, False, seen)
        work, ties = work + more, max(ties, found)
        rejected = set(noted := _sequences(s.near_tie[:used]))
        overflown = len(noted) < found
    seen |= most
    return Searched(True, work, ties, len(passes), sum(passes.values()))


def _mark(sequence: tuple[int, ...]) -> np.uint64:
    from ptmtools.portal_flow import flow_kernels as kernels

    return np.uint64(kernels.mark(np.array(sequence, np.int64), 0, len(sequence)))


def _sequences(words: Ints) -> list[tuple[int, ...]]:
    """The sequences in `Scratch.near_tie`, each after its length."""
    row = words.tolist()
    found = []
    at = 0
    while at < len(row):
        following = at + 1 + row[at]
        found.append(tuple(row[at + 1 : following]))
        at = following
    return found


def _deciding(known: Bits, doubtful: Bits, rejected: set[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """The rejected sequences, in order, whose last portal, or what may lie behind it, is among the
    ``doubtful`` (W,)."""
    lasts = np.array(sorted({sequence[-1] for sequence in rejected}), np.int64)
    itself = doubtful[lasts >> 6] >> (lasts & 63).astype(np.uint64) & np.uint64(1)
    decides = itself.astype(bool) | np.any(known[lasts] & doubtful, axis=1)
    kept = set(lasts[decides].tolist())
    return sorted(sequence for sequence in rejected if sequence[-1] in kept)
