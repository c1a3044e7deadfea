"""Cells become potentially visible sets (paper §3): the portal flow over leaves, lifted to cells.

A viewer anywhere in a cell sees at most the cells of its row. The flow, its argument and its
budget are in `flow`.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools
from ptmtools.cells.model import Cells
from ptmtools.cells.seen import from_places, portals_of
from ptmtools.executors.model import Executor
from ptmtools.executors.serial import Serial
from ptmtools.portal_flow.flow import leaf_matrix, portal_flow
from ptmtools.progress import Progress, silent
from ptmtools.visibility.leaks import find_leaks
from ptmtools.visibility.model import Pvs
from ptmtools.visibility.options import PvsOptions
from ptmtools.visibility.sampled import sampled_leaves


def compute_pvs(
    cells: Cells,
    options: PvsOptions = PvsOptions(),  # noqa: B008 - a frozen value
    progress: Progress = silent,
    executor: Executor = Serial(),  # noqa: B008 - has no state
) -> Pvs:
    """Cell-to-cell visibility, symmetric (paper §3; Teller & Séquin).

    Unless it is sampled, a pair of cells is left out only if no straight line, but for hairlines
    thinner than the rounding of the coordinates (`Tolerance.rounding`), leads through portals from
    a leaf of one in which somebody can stand to the other, or the other way round. Cells that share
    a portal always see each other, also such in which nobody can stand. Leaves of no cell are left
    out. `Pvs.fallbacks` counts the portals
    whose search was cut short. ``executor`` does the searches; the result is the same for any.

    Raises what `portal_flow` raises.
    """
    portals = portals_of(cells)
    volumes = {"volume": cells.cell_volumes(), "standing": cells.cell_volumes(standing=True)}
    if options.method == "sampled":
        leaves = sampled_leaves(portals, options.lines, executor)
        return Pvs.from_matrix(lifted(cells, leaves), **volumes, conservative=False)
    budget = options.budget if options.method == "full" else 0
    flow = portal_flow(portals, budget, progress, executor)
    matrix = lifted(cells, leaf_matrix(portals, flow))
    return Pvs.from_matrix(
        matrix,
        work=flow.work,
        cut=flow.cut & (options.method == "full"),
        ties=flow.ties,
        decided=flow.decided,
        opened=flow.opened,
        leak=find_leaks(cells, flow, matrix),
        **volumes,
    )


def lifted(cells: Cells, leaves: Bools) -> Bools:
    """(C, C) from (L, L): a cell sees what is seen from its leaves in which somebody can stand,
    and is seen in turn."""
    owned = cells.leaf_cell >= 0
    rows, columns = np.nonzero(from_places(leaves, cells.leaf_standing) & owned[:, None] & owned)
    matrix = np.zeros((cells.cell_count, cells.cell_count), dtype=np.bool_)
    matrix[cells.leaf_cell[rows], cells.leaf_cell[columns]] = True
    for cell, beside in enumerate(cells.adjacent()):
        matrix[cell, beside] = True
    return matrix
