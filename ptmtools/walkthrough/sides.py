"""Pieces in a boundary between two cells are in both: which copy is seen from where.

A pixel belongs to the copy of the cell on the viewer's side. That is there as soon as his cell is;
the other may be behind a wall, where nobody looks for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.vectors import normals
from ptmtools.walkthrough.locating import SLACK, Locator


def sides(corner: Floats, cell: NDArray[np.int32], two_sided: Bools, locator: Locator) -> Ints:
    """(n, 2) for each triangle the one that is seen in its place from the side that its normal
    points to, and from the other: itself, or its copy in the cell on that side.

    Parameters
    ----------
    corner, cell, two_sided: (n, 3, 3) metres, (n,), (n,) of the triangles.
    locator: of the cells.
    """
    found = np.repeat(np.arange(len(corner))[:, None], 2, axis=1)
    one, other = _pairs(corner, np.flatnonzero(two_sided))
    apart = cell[one] != cell[other]
    one = np.concatenate([one[apart], np.unique(one[apart])])
    other = np.concatenate([other[apart], np.unique(other[apart])])
    normal = normals(corner[one])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    step = SLACK * np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    for side, away in enumerate((step, -step)):
        point = corner[one].mean(axis=1) + away
        outside = np.empty(len(one))
        for c in np.unique(cell[other]).tolist():
            rows = np.flatnonzero(cell[other] == c)
            outside[rows] = locator.outside(c, point[rows])
        # The copy whose cell holds the point best comes last, and stays.
        order = np.lexsort((-outside, one))
        order = order[outside[order] < SLACK / 2]
        found[one[order], side] = other[order]
    return found


def _pairs(corner: Floats, among: Ints) -> tuple[Ints, Ints]:
    """All pairs of triangles with the same three corners, each both ways, itself left out."""
    x, y, z = np.moveaxis(corner[among], 2, 0)
    turned = np.take_along_axis(corner[among], np.lexsort((z, y, x))[..., None], axis=1)
    _, group = np.unique(turned.reshape(-1, 9), axis=0, return_inverse=True)
    order = np.argsort(group.reshape(-1), kind="stable")
    group = group.reshape(-1)[order]
    ones, others = [among[:0]], [among[:0]]
    step = 1
    while step < len(group) and (same := group[step:] == group[:-step]).any():
        first, second = among[order[:-step][same]], among[order[step:][same]]
        ones += [first, second]
        others += [second, first]
        step += 1
    return np.concatenate(ones), np.concatenate(others)
