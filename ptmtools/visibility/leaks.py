"""Openings that show more than they should: where visibility leaks.

A cell that sees several times as many cells as most do sees them through something: a window onto
a courtyard, which is as it should be, or a gap under a wall that somebody forgot to close. Among
the openings between cells through which it sees at least half of what it sees, the smallest is
named.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools
from ptmtools.cells.model import Cells
from ptmtools.portal_flow.flow import PortalFlow

#: A cell is looked at if it sees more than this times the median of all cells.
SUSPICIOUS = 3.0
#: So many of them, those that see most.
MOST = 20
#: Share of what the cell sees that must be seen through the opening.
SHARE = 0.5


def find_leaks(cells: Cells, flow: PortalFlow, matrix: Bools) -> NDArray[np.int32]:
    """(n, 4) the leaks of a PVS, those that show most first: see `Pvs.leak`.

    Parameters
    ----------
    flow: of the portals of ``cells``. matrix: (C, C) who sees whom.
    """
    found = []
    if cells.portal_count:
        sees = matrix.sum(axis=1)
        bound = SUSPICIOUS * float(np.median(sees))
        order = np.lexsort((np.arange(len(sees)), -sees))[:MOST]
        found = [_leak(cells, flow, int(c), int(sees[c])) for c in order if sees[c] > bound]
    return np.array([leak for leak in found if leak], np.int32).reshape(-1, 4)


def _leak(cells: Cells, flow: PortalFlow, cell: int, sees: int) -> tuple[int, ...]:
    enters, leaves = cells.portal_cell[:, ::-1].reshape(-1), cells.portal_cell.reshape(-1)
    standing = cells.leaf_standing[cells.portal_leaf].reshape(-1)
    out = np.flatnonzero((leaves == cell) & standing)
    if not len(out):
        return ()
    seen = np.bitwise_or.reduce(flow.sees[out], axis=0)
    reached = np.union1d(flow.portals_in(seen), out)
    found = []
    for q in reached[enters[reached] != leaves[reached]].tolist():
        behind = enters[flow.portals_in(flow.sees[q] & seen)]
        behind = np.append(behind, enters[q])
        through = len(np.unique(behind[behind >= 0]))
        if through >= SHARE * sees:
            found.append((float(cells.portal_area[q >> 1]), q >> 1, through))
    return (cell, sees, *min(found)[1:]) if found else ()
