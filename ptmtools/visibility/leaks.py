"""Openings that show more than they should: where visibility leaks.

A cell that sees several times as many cells as most do sees them through something: a window onto
a courtyard, which is as it should be, or a gap under a wall that somebody forgot to close. Among
the openings between cells through which it sees at least half of what it sees, the smallest is
named.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools
from ptmtools.cells.model import Cells
from ptmtools.visibility.flow import PortalFlow

#: A cell is looked at if it sees more than this times the median of all cells.
SUSPICIOUS = 3.0
#: So many of them, those that see most.
MOST = 20
#: Share of what the cell sees that must be seen through the opening.
SHARE = 0.5


@dataclass(frozen=True)
class Leak:
    """A cell that sees suspiciously much, and the smallest opening that shows half of it.

    Attributes
    ----------
    cell: the cell. sees: how many cells it sees, itself included.
    portal: the opening. through: how many cells are seen through it.
    """

    cell: int
    sees: int
    portal: int
    through: int


def find_leaks(cells: Cells, flow: PortalFlow, matrix: Bools) -> tuple[Leak, ...]:
    """The leaks of a PVS, those that show most first.

    Parameters
    ----------
    flow: of the portals of ``cells``. matrix: (C, C) who sees whom.
    """
    if cells.portal_count == 0:
        return ()
    sees = matrix.sum(axis=1)
    bound = SUSPICIOUS * float(np.median(sees))
    order = np.lexsort((np.arange(len(sees)), -sees))[:MOST]
    found = (_leak(cells, flow, int(c), int(sees[c])) for c in order if sees[c] > bound)
    return tuple(leak for leak in found if leak is not None)


def _leak(cells: Cells, flow: PortalFlow, cell: int, sees: int) -> Leak | None:
    enters = cells.leaf_cell[cells.portal_leaf[:, ::-1]].reshape(-1)
    leaves = cells.leaf_cell[cells.portal_leaf].reshape(-1)
    out = np.flatnonzero(leaves == cell)
    seen = np.bitwise_or.reduce(flow.sees[out], axis=0)
    reached = np.unpackbits(seen.view(np.uint8), count=len(enters), bitorder="little")
    reached[out] = 1
    best: tuple[float, int, int] | None = None
    for q in np.flatnonzero(reached & (enters != leaves)):
        onward = (flow.sees[q] & seen).view(np.uint8)
        behind = enters[np.unpackbits(onward, count=len(enters), bitorder="little").astype(bool)]
        through = len(np.unique(np.append(behind, enters[q])))
        candidate = (float(cells.portal_area[q >> 1]), int(q) >> 1, through)
        if through >= SHARE * sees and (best is None or candidate < best):
            best = candidate
    return None if best is None else Leak(cell, sees, best[1], best[2])
