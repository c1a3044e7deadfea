"""Potentially visible sets of cells (paper §3): the portal flow over leaves, lifted to cells.

A viewer anywhere in a cell sees at most the cells of its row. The flow and its budget are in
`flow`. Sampled sets come from random lines alone and are a lower bound, not conservative; lines are
walked as in `cells.sight`, which spreads them evenly.

Leaks are openings that show more than they should. Of a cell that sees several times as many cells
as most do, the smallest opening between cells is named through which it sees at least half of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.cells.sight import LONGEST, from_places, portals_of
from ptmtools.executor import Executor
from ptmtools.portal_flow.flow import (
    MOST_PORTALS,
    OpenQuestion,
    PortalFlow,
    Portals,
    check,
    geometry,
    leaf_matrix,
    portal_flow,
    upper_bound,
)
from ptmtools.portal_flow.storage import PortalArrays
from ptmtools.progress import Progress, silent
from ptmtools.visibility.model import Pvs
from ptmtools.visibility.options import PvsOptions

#: Number of portals from which lines precede the flow, and of lines through each.
MANY_PORTALS, FIRST_LINES = 512, 512
#: Tasks that the lines are distributed to.
SPANS = 64


#: Shared data of the tasks: portals, number of leaves, lines through each portal, and the seed.
Shooting = tuple[PortalArrays, int, int, int]


def sampled_leaves(
    portals: Portals,
    lines: int,
    executor: Executor = Executor(),  # noqa: B008 - has no state
    seed: int = 0,
) -> Bools:
    """(L, L) the leaves that each leaf sees on one of ``lines`` random lines through each portal.

    Half of the lines aim at a random point of a random portal, half anywhere. Symmetric; each leaf
    sees itself and its neighbours. The same for any ``executor``.

    Raises what `flow.check` raises.
    """
    check(portals)
    count, leaves = len(portals.leaf), portals.leaf_count
    matrix = np.eye(leaves, dtype=np.bool_)
    if count == 0:
        return matrix
    shooting = (geometry(portals), leaves, lines, seed)
    step = -(-count // SPANS)
    spans = [(first, min(first + step, count)) for first in range(0, count, step)]
    for bits in executor.each(_shoot, shooting, spans, releases_lock=True):
        matrix |= np.unpackbits(bits, axis=1, count=leaves).astype(np.bool_)
    a, b = portals.leaf.T
    matrix[a, b] = matrix[b, a] = True
    return matrix


def _shoot(shared: Shooting, span: tuple[int, int]) -> NDArray[np.uint8]:
    """As a task: (L, ⌈L / 8⌉) bits, visibility between leaves by lines through the portals
    ``span``."""
    from ptmtools.portal_flow.line_kernels import Openings, sight_lines

    g, leaves, lines, seed = shared
    openings = Openings(g.point, g.start, g.leaf, g.out_start, g.out)
    path = np.empty(2 * LONGEST, np.int64)
    seen = np.zeros((leaves, leaves), np.bool_)
    for k in range(*span):
        rng = np.random.default_rng([seed, k])
        portal = np.full(lines, k)
        origin = _points(rng, g, portal)
        aimed = _points(rng, g, rng.integers(len(g.normal), size=lines)) - origin
        anywhere = rng.normal(size=origin.shape)
        along = np.where(rng.random((lines, 1)) < 0.5, aimed, anywhere)
        speed = along @ g.normal[k]
        across = np.abs(speed) > g.slack
        along *= np.sign(speed)[:, None]
        sight_lines(openings, origin[across], along[across], portal[across], path, seen)
    return np.packbits(seen, axis=1)


def _points(rng: np.random.Generator, g: PortalArrays, portal: Ints) -> Floats:
    """(n, 3) a random point of each of (n,) portals, in a random triangle of its fan."""
    first, size = g.start[portal], np.diff(g.start)[portal]
    corner = 1 + rng.integers(np.maximum(size - 2, 1))
    fan = [np.zeros_like(corner), corner, corner + 1]
    a, b, c = (g.point[first + np.minimum(i, size - 1)] for i in fan)
    u, v = np.sqrt(rng.random((len(portal), 1))), rng.random((len(portal), 1))
    points: Floats = a + u * (b - a + v * (c - b))
    return points


#: A cell is examined if it sees more than this multiple of the median of all cells.
SUSPICIOUS = 3.0
#: Most cells examined, those that see most.
MOST = 20
#: Share of what the cell sees that must be seen through the opening.
SHARE = 0.5


def find_leaks(cells: Cells, flow: PortalFlow, matrix: Bools) -> NDArray[np.int32]:
    """(n, 4) the leaks of a PVS, largest first: see `Pvs.leak`.

    Parameters
    ----------
    flow: of the portals of ``cells``. matrix: (C, C) the PVS.
    """
    leaks = []
    if cells.sight_count:
        sees = matrix.sum(axis=1)
        bound = SUSPICIOUS * float(np.median(sees))
        order = np.lexsort((np.arange(len(sees)), -sees))[:MOST]
        leaks = [_leak(cells, flow, int(c), int(sees[c])) for c in order if sees[c] > bound]
    return np.array([leak for leak in leaks if leak], np.int32).reshape(-1, 4)


def _leak(cells: Cells, flow: PortalFlow, cell: int, sees: int) -> tuple[int, ...]:
    count = cells.sight_count
    ends = cells.portal_cell[:count]
    enters, leaves = ends[:, ::-1].reshape(-1), ends.reshape(-1)
    standing = cells.leaf_standing[cells.portal_leaf[:count]].reshape(-1)
    out = np.flatnonzero((leaves == cell) & standing)
    if not len(out):
        return ()
    seen = np.bitwise_or.reduce(flow.sees[out], axis=0)
    reached = np.union1d(flow.portals_in(seen), out)
    candidates = []
    for q in reached[enters[reached] != leaves[reached]].tolist():
        behind = enters[flow.portals_in(flow.sees[q] & seen)]
        behind = np.append(behind, enters[q])
        through = len(np.unique(behind[behind >= 0]))
        if through >= SHARE * sees:
            candidates.append((float(cells.portal_area[q >> 1]), q >> 1, through))
    return (cell, sees, *min(candidates)[1:]) if candidates else ()


def compute_pvs(
    cells: Cells,
    options: PvsOptions = PvsOptions(),  # noqa: B008 - a frozen value
    progress: Progress = silent,
    executor: Executor = Executor(),  # noqa: B008 - has no state
) -> Pvs:
    """Cell-to-cell visibility, symmetric (paper §3; Teller & Séquin).

    Unless it is sampled, a pair of cells is left out only if no straight line, but for hairlines
    thinner than the rounding of the coordinates (`Tolerance.rounding`), leads through portals from
    a standing leaf of one to the other, or vice versa. Cells that share a portal always see each
    other, even without standing room, unless it is a passage. Leaves of no cell are left out.
    `Pvs.fallbacks` counts the portals whose search was cut short. With many portals the searches
    are left out where random lines show that they could reduce what visitors hold by at most
    ``options.gain`` (`Pvs.spared`). ``executor`` runs the searches; the result is the same for any.

    Raises what `portal_flow` raises.
    """
    portals = portals_of(cells)
    volumes = {"volume": cells.cell_volumes(), "standing": cells.cell_volumes(standing=True)}
    if options.method == "sampled":
        leaves = sampled_leaves(portals, options.lines, executor)
        return Pvs.from_matrix(lift_to_cells(cells, leaves), **volumes, conservative=False)
    budget = options.budget if options.method == "full" else 0
    question, bound, spared = None, None, 0.0
    reports_cut = options.method == "full"
    if budget and MANY_PORTALS <= len(portals.leaf) <= MOST_PORTALS:
        lines = lift_to_cells(cells, sampled_leaves(portals, FIRST_LINES, executor))
        least = Pvs.from_matrix(lines, **volumes).volume_at_hand[0]
        if 1 - least <= options.gain > 0:  # all cells are bound enough
            return Pvs.from_matrix(np.ones_like(lines), spared=max(1 - least, 0.0), **volumes)
        bound = upper_bound(portals, executor)
        bound_matrix = lift_to_cells(cells, leaf_matrix(portals, bound))
        spared = 1 - least / Pvs.from_matrix(bound_matrix, **volumes).volume_at_hand[0]
        if spared <= options.gain:
            budget, reports_cut = 0, False
        else:
            question, spared = _open_question(cells, lines), 0.0
    flow = portal_flow(portals, budget, progress, executor, question, bound)
    matrix = lift_to_cells(cells, leaf_matrix(portals, flow))
    return Pvs.from_matrix(
        matrix,
        spared=spared,
        work=flow.work,
        cut=flow.cut & reports_cut,
        ties=flow.ties,
        decided=flow.decided,
        opened=flow.opened,
        leak=find_leaks(cells, flow, matrix),
        **volumes,
    )


def _open_question(cells: Cells, lines: Bools) -> OpenQuestion:
    """The pairs of cells that random lines, (C, C), have not shown to see each other: a search
    costs far more than lines, and in an open building most pairs do."""
    pairs = np.zeros((cells.cell_count + 1,) * 2, dtype=np.bool_)  # the last one: of no cell
    pairs[:-1, :-1] = ~lines
    group = np.where(cells.leaf_cell < 0, cells.cell_count, cells.leaf_cell).astype(np.int64)
    return OpenQuestion(group, pairs)


def lift_to_cells(cells: Cells, leaves: Bools) -> Bools:
    """(C, C) from (L, L): a cell sees the cells seen from its standing leaves, symmetrically."""
    order = np.argsort(cells.leaf_cell, kind="stable")
    order = order[cells.leaf_cell[order] >= 0]
    first = np.searchsorted(cells.leaf_cell[order], np.arange(cells.cell_count))
    sees = from_places(leaves, cells.leaf_standing)[order]
    matrix = np.zeros((cells.cell_count, cells.cell_count), dtype=np.bool_)
    if cells.cell_count:
        by_row = np.logical_or.reduceat(sees, first, axis=0)
        matrix = np.logical_or.reduceat(by_row[:, order], first, axis=1)
    a, b = cells.portal_cell[: cells.sight_count].T
    kept = (a >= 0) & (b >= 0)
    matrix[a[kept], b[kept]] = matrix[b[kept], a[kept]] = True
    return matrix
