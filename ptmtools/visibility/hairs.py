"""Searches whose rejections by a hair are decided again in exact arithmetic.

A search tells which sequences of portals it rejected by less than the rounding of its arithmetic
allows to be sure of (`winding`). Another one that lets them all through tells what depends on
them, mostly nothing. Those on which something depends are put to `ExactPortals`. Where a line can
pass one, the search is done again with that let through, as often as this brings up new ones. Where
there are too many, all are let through: the result is looser, and conservative as ever.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.visibility.exact import ExactPortals

if TYPE_CHECKING:
    from ptmtools.visibility.kernels import Geometry, Scratch

#: Sequences decided exactly for one directed portal, and searches done again, at most.
DECIDED, AGAIN = 64, 8


class Searched(NamedTuple):
    """What one search took, summed up over its repetitions but for ``cut`` and ``ties``.

    Attributes
    ----------
    cut: whether it was given up for a looser result. work: operations. ties: sequences rejected by
        a hair. decided: how many of them were decided exactly. opened: how many of those let a
        line pass.
    """

    cut: bool
    work: int
    ties: int
    decided: int
    opened: int


def searched(
    g: Geometry,
    s: Scratch,
    arithmetic: ExactPortals | None,
    known: NDArray[np.uint64],
    source: int,
    budget: int,
    seen: NDArray[np.uint64],
) -> Searched:
    """Fills the zeroed row ``seen`` (W,) with what a directed portal sees; the arguments are those
    of `kernels.flow`. Without ``arithmetic`` rejections by a hair stand."""
    from ptmtools.visibility import kernels

    none = np.zeros(0, np.uint64)
    work, cut, ties, used = kernels.flow(g, s, known, source, budget, none, False, seen)
    if ties == 0 or arithmetic is None:
        return Searched(cut, work, ties, 0, 0)
    rejected = set(_sequences(s.hair[:used]))
    hidden = known[source] & ~seen
    if not any(_matters(known, hidden, sequence[-1]) for sequence in rejected):
        return Searched(cut, work, ties, 0, 0)
    # With all of them let through, what more is seen? What is seen already need not be found again.
    most = seen.copy()
    work += kernels.flow(g, s, known, source, budget, none, True, most)[0]
    passes: dict[tuple[int, ...], bool] = {}
    for _ in range(AGAIN):
        doubtful = most & ~seen
        new = sorted(
            sequence
            for sequence in rejected - passes.keys()
            if _matters(known, doubtful, sequence[-1])
        )
        if used > len(s.hair) // 2 or len(passes) + len(new) > DECIDED:
            break
        for sequence in new:
            passes[sequence] = arithmetic.passes((source, *sequence))
        if not any(passes[sequence] for sequence in new):
            return Searched(cut, work, ties, len(passes), sum(passes.values()))
        through = [sequence for sequence, open_ in passes.items() if open_]
        marks = [kernels.mark(np.array(way, np.int64), 0, len(way)) for way in through]
        opened = np.sort(np.array(marks, np.uint64))
        more, cut, found, used = kernels.flow(g, s, known, source, budget, opened, False, seen)
        work, ties = work + more, max(ties, found)
        rejected = set(_sequences(s.hair[:used]))
    seen[:] = most
    return Searched(True, work, ties, len(passes), sum(passes.values()))


def _sequences(words: NDArray[np.int64]) -> Iterator[tuple[int, ...]]:
    """The sequences in `Scratch.hair`, each after its length."""
    row = words.tolist()
    at = 0
    while at < len(row):
        following = at + 1 + row[at]
        yield tuple(row[at + 1 : following])
        at = following


def _matters(known: NDArray[np.uint64], doubtful: NDArray[np.uint64], last: int) -> bool:
    """Whether the last portal of a rejected sequence, or what may lie behind it, is doubtful."""
    itself = int(doubtful[last >> 6]) >> (last & 63) & 1
    return bool(itself or np.any(known[last] & doubtful))
