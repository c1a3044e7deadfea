"""Which leaves see each other at most: the portal flow over the leaves of a subdivision."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools
from ptmtools.cells.model import Cells
from ptmtools.errors import LimitError
from ptmtools.executors.model import Executor
from ptmtools.portal_flow.flow import Portals, leaf_matrix, upper_bound


def portals_of(cells: Cells) -> Portals:
    """The portals between the leaves of a subdivision."""
    return Portals(
        leaf_count=cells.leaf_count,
        leaf=cells.portal_leaf.reshape(-1, 2),
        normal=cells.portal_plane.reshape(-1, 4)[:, :3],
        point=cells.portal_point.reshape(-1, 3),
        start=cells.portal_start,
        tolerance=cells.tolerance,
    )


def seen_from_places(cells: Cells, executor: Executor) -> Bools:
    """(L,) which leaves may be seen from a leaf in which somebody can stand, themselves included.

    The first bound of the flow decides, without its search: of the leaves of five real models the
    search would have dropped two more. Where there are too many portals for it nothing is
    dropped.
    """
    standing = cells.leaf_standing
    every = np.ones(cells.leaf_count, dtype=np.bool_)
    if standing.all():
        return every
    portals = portals_of(cells)
    try:
        bound = upper_bound(portals, executor)
    except LimitError:
        return every
    return np.asarray(leaf_matrix(portals, bound)[standing].any(axis=0))


def from_places(sees: Bools, standing: Bools) -> Bools:
    """(L, L) of (L, L) symmetric sight what somebody stands at one end of; ``standing``: (L,)."""
    return sees & (standing[:, None] | standing)
