"""Which leaves see each other at most: the portal flow over the leaves of a subdivision."""

from __future__ import annotations

from ptmtools.cells.model import Cells
from ptmtools.portal_flow.flow import Portals


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
