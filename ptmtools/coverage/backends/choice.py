"""Which backend draws the item buffers."""

from __future__ import annotations

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.coverage.backends import AUTO, BACKENDS, Backend
from ptmtools.coverage.item_buffer import VIEWS
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import MissingComponentError
from ptmtools.visibility.model import Pvs


def choose(cells: Cells, pvs: Pvs, options: AchOptions) -> Backend:
    """The backend that the options name; for "auto" the one that is expected to take the least
    processor time, of those that can run here.

    Raises `MissingComponentError` PTM-M500 if one cannot run though a graphics device is named.
    """
    if options.backend != AUTO:
        return BACKENDS[options.backend]
    triangles, pixels = triangles_of_a_pvs(cells, pvs), len(VIEWS) * options.side**2
    costs = {}
    for name, backend in BACKENDS.items():
        try:
            costs[name] = backend.cost(triangles, pixels, options.gpu)
        except MissingComponentError:
            if options.gpu is not None:  # who names a device wants that one
                raise
    return BACKENDS[min(costs, key=costs.__getitem__)]


def triangles_of_a_pvs(cells: Cells, pvs: Pvs) -> float:
    """How many pieces of triangles the cells of a PVS have, on average over the cells."""
    if not cells.cell_count:
        return 0.0
    front, back = cells.triangle_cell.T
    each = np.bincount(front[front >= 0], minlength=cells.cell_count)
    each += np.bincount(back[(back >= 0) & (back != front)], minlength=cells.cell_count)
    return float(each[pvs.cell].sum()) / cells.cell_count
