"""Conservative portal-sequence flow: the portals that a straight line may cross after each (§3).

The method is Teller & Séquin's (SIGGRAPH 1991) in the depth-first form of Quake's ``vis``.
``docs/design/visibility.md`` explains its steps, the rounding, near ties and the budget.

Portals are done in ascending order of how much they might see, in batches of fixed length: a
batch reads only the results of the batches before it, hence the same answer for any number of
workers. The searches are tasks of an executor. They share `Searching`; each borrows its storage
from it.

Tried and dropped (e1m1: 9.6 s, 163.7 portals seen on average): a first round with a small budget
to tighten the start of the second (9.8 s); counting q as seen by p because q's way back was not
shown to miss p's (7.4 s, but 164.8 portals); shooting the lines first instead of late (12.9 s).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bits, Bools, Floats, Ints
from ptmtools.errors import InputError, LimitError
from ptmtools.executor import Executor
from ptmtools.portal_flow.double_double import SearchCost, SequenceTest, search
from ptmtools.portal_flow.storage import Polygons, PortalArrays, Scratch
from ptmtools.progress import Progress, silent
from ptmtools.tolerance import Tolerance

#: Portals of a batch, whose results appear to later ones together.
BATCH = 64
#: Operations that are worth a message to another machine, some 20 ms.
TASK = 80_000
#: Portals from which floods start in one task.
SPAN = 64
#: Rounds of the bitwise pre-pass; the third changes next to nothing.
ROUNDS = 3
#: With more portals the two bit matrices would take over 4 GiB.
MOST_PORTALS = 65_536
BITS_OF_BYTE = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1).sum(
    axis=1, dtype=np.uint8
)


@dataclass(frozen=True)
class Portals:
    """Convex openings between leaves; the input of `portal_flow`."""

    leaf_count: int
    leaf: NDArray[np.int32]  # (K, 2) the leaves that each portal joins
    normal: Floats  # (K, 3) pointing from ``leaf[:, 0]`` into ``leaf[:, 1]``
    point: Floats  # (Q, 3) polygons, either orientation
    start: Ints  # (K + 1,) CSR over portals into `point`
    tolerance: Tolerance | None = None  # that of the cells, or derived from the points


@dataclass(frozen=True)
class PortalFlow:
    """The result of `portal_flow`.

    Attributes
    ----------
    sees: (2K, W) uint64 rows of little-endian bits: directed portal p (2k crosses portal k along
        its normal, 2k + 1 against it) may be followed by directed portal q on one straight line.
    cut, work, ties, decided, opened: (K,) as in `Pvs`, both ways together.
    """

    sees: Bits
    cut: Bools
    work: Ints
    ties: Ints
    decided: Ints
    opened: Ints

    @property
    def operations(self) -> int:
        """Total of chain tests and clips."""
        return int(self.work.sum())

    def portals_in(self, row: Bits) -> Ints:
        """The directed portals whose bits are set in a (W,) row."""
        bits = np.unpackbits(row.view(np.uint8), count=len(self.sees), bitorder="little")
        return np.flatnonzero(bits)


def portal_flow(
    portals: Portals,
    budget: int,
    progress: Progress = silent,
    executor: Executor = Executor(),  # noqa: B008 - has no state
    open_question: OpenQuestion | None = None,
    bound: PortalFlow | None = None,
) -> PortalFlow:
    """Conservative visibility from portal to portal (Teller & Séquin; paper §3).

    Parameters
    ----------
    budget: operations for each search from a directed portal; see the module's head. Near ties may
        make a search be repeated until three budgets are spent.
    executor: does the searches; see `searching`. The result is the same for any.
    open_question: the pairs of leaves whose visibility matters, all by default. Of other pairs the
        result is the initial upper bound.
    bound: that of `upper_bound`, if it is known; it is changed.

    Raises InputError PTM-I400 (arrays that do not fit together, or a coordinate that is not
    finite); LimitError PTM-L400 (more portals than fit into memory).
    """
    bound = upper_bound(portals, executor) if bound is None else bound
    known, cut = bound.sees, bound.cut.repeat(2)
    count = len(known)
    counts = np.zeros((4, count), dtype=np.int64)
    if count == 0:
        return bound

    g = geometry(portals)
    together = BATCH // 8
    answered = open_question.answers(portals) if open_question else None
    searching = Searching(g, known, budget, answered)
    sizes = BITS_OF_BYTE[searching.known.view(np.uint8)].sum(axis=1)
    order = np.argsort(sizes, kind="stable")
    for first in range(0, count, BATCH):
        batch = order[first : first + BATCH]
        tasks = batch.tolist()
        results = list(
            executor.each(search_from, searching, tasks, releases_lock=True, chunk=together)
        )
        for p, (_, figures) in zip(batch, results, strict=True):
            cut[p], *counts[:, p] = figures
        work = max(1, int(counts[0, batch].mean()))
        together = max(1, min(BATCH // 2, TASK // work))  # the next ones take about as long
        settle(searching, batch, np.stack([seen for seen, _ in results]))
        progress(min(first + BATCH, count), count, "portals")
    return PortalFlow(searching.known, cut[0::2] | cut[1::2], *(counts[:, 0::2] + counts[:, 1::2]))


def upper_bound(
    portals: Portals,
    executor: Executor = Executor(),  # noqa: B008 - has no state
) -> PortalFlow:
    """The initial sets of `portal_flow`, before any search. Raises what it raises."""
    check(portals)
    count = 2 * len(portals.leaf)
    words = (count + 63) // 64
    if count > 2 * MOST_PORTALS:
        raise LimitError(
            "PTM-L400",
            f"{count // 2:,} portals are too many for the portal flow",
            remedy="subdivide less finely (a larger --wall-area, or --max-leaves)",
        )
    known = np.zeros((count, words), dtype=np.uint64)
    if count:
        known = _prepass(geometry(portals), executor)
    none = np.zeros(count // 2, dtype=np.int64)
    return PortalFlow(known, none.astype(np.bool_), none, none, none, none)


def leaf_matrix(portals: Portals, flow: PortalFlow) -> Bools:
    """(L, L) the leaves that each leaf may see: itself, its neighbours, and the leaves that its
    portals see."""
    enters, leaves = portals.leaf[:, ::-1].reshape(-1), portals.leaf.reshape(-1)
    matrix = np.eye(portals.leaf_count, dtype=np.bool_)
    matrix[leaves, enters] = True
    for leaf, row in zip(leaves, flow.sees, strict=True):
        matrix[leaf, enters[flow.portals_in(row)]] = True
    return matrix


def _prepass(g: PortalArrays, executor: Executor) -> Bits:
    """(2K, W) a first upper bound of what each directed portal sees, from planes and floods.

    The rounds of bits take a hundredth of the time of the floods: they are not distributed.
    """
    from ptmtools.portal_flow.flow_kernels import tighten
    from ptmtools.portal_flow.line_kernels import return_sight

    count = len(g.leaf)
    words = (count + 63) // 64
    known, tighter = np.zeros((2, count, words), dtype=np.uint64)
    floods = Searching(g, known[:0], budget=0)
    spans = [(first, min(first + SPAN, count)) for first in range(0, count, SPAN)]
    reached = executor.each(flood_from, floods, spans, releases_lock=True)
    for (first, last), rows in zip(spans, reached, strict=True):
        known[first:last] = rows
    return_sight(known, 0, words)
    for _ in range(ROUNDS):
        tighten(g, 0, count, known, tighter)
        known, tighter = tighter, known
        return_sight(known, 0, words)
    return known


def check(portals: Portals) -> None:
    """Raises PTM-I400 unless the arrays fit together and are finite."""
    k, start, leaf = len(portals.leaf), portals.start, portals.leaf
    wrong = ""
    if leaf.shape != (k, 2) or portals.normal.shape != (k, 3) or start.shape != (k + 1,):
        wrong = "the portals' arrays differ in length"
    elif start[0] != 0 or start[-1] != len(portals.point) or np.any(np.diff(start) < 1):
        wrong = "the portals' offsets do not cover their points"
    elif k and (leaf.min() < 0 or leaf.max() >= portals.leaf_count):
        wrong = "a portal names a leaf that does not exist"
    elif not portals.normal.any(axis=1).all():
        wrong = "a portal has no normal"
    if wrong:
        raise InputError("PTM-I400", wrong, remedy="build the cells again")
    if not (np.isfinite(portals.point).all() and np.isfinite(portals.normal).all()):
        raise InputError(
            "PTM-I400", "a portal has a coordinate that is not finite", remedy="repair the model"
        )


def geometry(portals: Portals) -> PortalArrays:
    """The portals in the form of the kernels: centred, counter-clockwise, with bounds."""
    start = portals.start.astype(np.int64)
    sizes = np.diff(start)
    middle = (portals.point.min(axis=0) + portals.point.max(axis=0)) / 2
    point = portals.point - middle
    owner = np.repeat(np.arange(len(sizes)), sizes)
    normal = portals.normal / np.linalg.norm(portals.normal, axis=1, keepdims=True)

    # Newell's area vector about the first vertex gives a polygon's orientation.
    within = np.arange(len(point)) - start[owner]
    following = np.where(within + 1 < sizes[owner], np.arange(len(point)) + 1, start[owner])
    arm = point - point[start[owner]]
    twice = np.add.reduceat(np.cross(arm, arm[following]), start[:-1], axis=0)
    turned = np.einsum("ij,ij->i", twice, normal) < 0
    mirrored = start[owner] + sizes[owner] - 1 - within
    point = point[np.where(turned[owner], mirrored, np.arange(len(point)))]

    along = np.einsum("ij,ij->i", point, normal[owner])
    centre = np.add.reduceat(point, start[:-1], axis=0) / sizes[:, None]
    reach = np.linalg.norm(point - centre[owner], axis=1)
    enters = portals.leaf[:, ::-1].reshape(-1).astype(np.int64)
    leaves = portals.leaf.reshape(-1)
    out = np.argsort(leaves, kind="stable")
    tolerance = portals.tolerance or Tolerance.for_points(point)
    radius = np.maximum.reduceat(reach, start[:-1]) + tolerance.rounding
    return PortalArrays(
        point=np.ascontiguousarray(point),
        start=start,
        normal=np.ascontiguousarray(normal),
        low=np.minimum.reduceat(along, start[:-1]),
        high=np.maximum.reduceat(along, start[:-1]),
        ball=np.column_stack([centre, radius]),
        leaf=enters,
        out_start=np.searchsorted(leaves[out], np.arange(portals.leaf_count + 1)).astype(np.int64),
        out=out.astype(np.int64),
        slack=tolerance.rounding,
    )


#: A sequence longer than this is not followed further (its possible set counts as seen).
DEPTH = 1024
#: Vertices that clipping may add to a portal before it is left unclipped.
GROWTH = 24
#: Words to record the sequences that a search rejected by near ties.
NEAR_TIE_WORDS = 1 << 16

Tools = tuple[Scratch, SequenceTest]
#: (G, W) for each group of leaves, the directed portals into leaves that it need not be tested
#: against, as bits; and (2K,) the group of the leaf behind each directed portal.
Answers = tuple[Bits, Ints]


@dataclass(frozen=True)
class OpenQuestion:
    """Which pairs of leaves a flow decides."""

    group: Ints  # (L,) the group of each leaf, from 0
    pairs: Bools  # (G, G) the pairs of groups that are not known to see each other

    def answers(self, portals: Portals) -> Answers:
        """See `Answers`."""
        enters, leaves = portals.leaf[:, ::-1].reshape(-1), portals.leaf.reshape(-1)
        rows = np.zeros((len(self.pairs), (len(enters) + 63) // 64), dtype=np.uint64)
        behind = self.group[enters]
        for row, pairs in zip(rows.view(np.uint8), self.pairs, strict=True):
            bits = np.packbits(~pairs[behind], bitorder="little")
            row[: len(bits)] = bits
        return rows, self.group[leaves]


class Searching:
    """The portals; the portals that each may see so far, (2K, W) bits; and the budget of each
    search, see `portal_flow`."""

    def __init__(
        self, geometry: PortalArrays, known: Bits, budget: int, answered: Answers | None = None
    ) -> None:
        self.geometry, self.known, self.budget = geometry, known, budget
        self._answered = answered
        self._idle: list[Tools] = []

    @property
    def words(self) -> int:
        """Words in a row."""
        return (len(self.geometry.leaf) + 63) // 64

    def row(self, source: int) -> Bits:
        """(W,) the portals that a search from a directed portal need not find."""
        if self._answered is None:
            return np.zeros(self.words, np.uint64)
        row, group = self._answered
        return np.asarray(self.known[source] & row[group[source]])

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
    """As a task: (last - first, W) the portals that floods reach from the directed portals ``span``
    (first, last)."""
    from ptmtools.portal_flow.flow_kernels import flood

    first, last = span
    rows = np.zeros((last - first, shared.words), np.uint64)
    with shared.tools() as (storage, _):
        flood(shared.geometry, storage, first, last, rows)
    return rows


def search_from(shared: Searching, source: int) -> tuple[Bits, SearchCost]:
    """As a task: a (W,) row of bits, the portals that the directed portal ``source`` sees; and the
    cost."""
    seen = shared.row(source)
    if (seen == shared.known[source]).all():
        return seen, SearchCost(False, 0, 0, 0, 0)
    with shared.tools() as (storage, test):
        given = shared.geometry, storage, test, shared.known, source, shared.budget
        return seen, search(*given, seen)


def settle(shared: Searching, batch: Ints, seen: Bits) -> None:
    """Enters the (B, W) rows ``seen`` that the searches from (B,) directed portals returned."""
    from ptmtools.portal_flow.line_kernels import drop_unreturned

    dropped = shared.known[batch] & ~seen
    shared.known[batch] = seen
    for p, row in zip(batch, dropped, strict=True):
        drop_unreturned(shared.known, p, row)


def scratch(g: PortalArrays, words: int) -> Scratch:
    """Working storage for one worker."""

    depth = min(DEPTH, len(g.leaf) + 1)
    vertices = int(np.diff(g.start).max()) + GROWTH
    return Scratch(
        polygons=Polygons(
            vertex=np.zeros((2 * depth + 3, vertices, 3)),
            size=np.zeros(2 * depth + 3, np.int64),
            plane=np.zeros((depth + 1, 2 * vertices, 4)),
            distance=np.zeros(vertices),
            slack=g.slack,
        ),
        planes=np.zeros(depth + 1, np.int64),
        might=np.zeros((depth, words), np.uint64),
        via=np.zeros(depth + 1, np.int64),
        at=np.zeros(depth, np.int64),
        line=np.zeros((2, 3)),
        near_tie=np.zeros(NEAR_TIE_WORDS, np.int64),
    )
