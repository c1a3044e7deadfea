"""The searches of the portal flow as tasks for an executor.

`Searching` is what they share; each borrows storage of its own from it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ptmtools.arrays import Bits, Ints
from ptmtools.portal_flow.double_double import SequenceTest
from ptmtools.portal_flow.near_ties import Searched, searched
from ptmtools.portal_flow.storage import Geometry, Scratch

#: A sequence longer than this is not followed further (its possible set counts as seen).
DEPTH = 1024
#: Vertices that clipping may add to a portal before it is left unclipped.
GROWTH = 24
#: Words that remember which sequences a search rejected by near ties.
NEAR_TIE_WORDS = 1 << 16

Tools = tuple[Scratch, SequenceTest]


class Searching:
    """The portals; what each may see by all that is known, (2K, W) bits; and the budget of each
    search, see `portal_flow`."""

    def __init__(self, geometry: Geometry, known: Bits, budget: int) -> None:
        self.geometry, self.known, self.budget = geometry, known, budget
        self._idle: list[Tools] = []

    @property
    def words(self) -> int:
        """Words in a row."""
        return (len(self.geometry.leaf) + 63) // 64

    @contextmanager
    def tools(self) -> Iterator[Tools]:
        """Storage that no other thread uses meanwhile."""
        try:
            lent = self._idle.pop()
        except IndexError:
            lent = scratch(self.geometry, self.words), SequenceTest(self.geometry)
        try:
            yield lent
        finally:
            self._idle.append(lent)

    def __getstate__(self) -> dict[str, object]:
        return vars(self) | {"_idle": []}


def flood_from(shared: Searching, span: tuple[int, int]) -> Bits:
    """As a task: (last - first, W) what floods reach from the directed portals ``span`` (first,
    last)."""
    from ptmtools.portal_flow.prepass_kernels import flood

    first, last = span
    rows = np.zeros((last - first, shared.words), np.uint64)
    with shared.tools() as (storage, _):
        flood(shared.geometry, storage, first, last, rows)
    return rows


def search_from(shared: Searching, source: int) -> tuple[Bits, Searched]:
    """As a task: a (W,) row of bits, what the directed portal ``source`` sees; and what it took."""
    seen = np.zeros(shared.words, np.uint64)
    with shared.tools() as (storage, test):
        given = shared.geometry, storage, test, shared.known, source, shared.budget
        return seen, searched(*given, seen)


def settle(shared: Searching, done: tuple[Ints, Bits]) -> None:
    """As a change: the (B, W) rows that a batch of (B,) directed portals has found."""
    from ptmtools.portal_flow.bit_kernels import drop_unreturned

    batch, seen = done
    dropped = shared.known[batch] & ~seen
    shared.known[batch] = seen
    for p, row in zip(batch, dropped, strict=True):
        drop_unreturned(shared.known, p, row)


def scratch(g: Geometry, words: int) -> Scratch:
    """Working storage for one worker."""

    depth = min(DEPTH, len(g.leaf) + 1)
    vertices = int(np.diff(g.start).max()) + GROWTH
    return Scratch(
        polygon=np.zeros((2 * depth + 3, vertices, 3)),
        size=np.zeros(2 * depth + 3, np.int64),
        plane=np.zeros((depth + 1, 2 * vertices, 4)),
        planes=np.zeros(depth + 1, np.int64),
        might=np.zeros((depth, words), np.uint64),
        via=np.zeros(depth + 1, np.int64),
        at=np.zeros(depth, np.int64),
        distance=np.zeros(vertices),
        line=np.zeros((2, 3)),
        near_tie=np.zeros(NEAR_TIE_WORDS, np.int64),
    )
