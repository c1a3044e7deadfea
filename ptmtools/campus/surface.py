"""Points spread over surfaces, the same every time."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints

#: Multiples of these modulo 1 are far apart in both directions (Roberts' R2 sequence).
SPREAD = 0.7548776662466927, 0.5698402909980532


def areas(corner: Floats) -> Floats:
    """(T,) of (T, 3, 3) triangles."""
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return np.asarray(np.linalg.norm(across, axis=1) / 2)


def points_on(corner: Floats, number: Ints) -> Floats:
    """(n, 3) a point in each of (n, 3, 3) triangles, the one that (n,) numbers say; points of
    different numbers are far apart in one and the same triangle."""
    along = np.sqrt(number * SPREAD[0] % 1.0)
    aside = number * SPREAD[1] % 1.0
    share = np.stack([1 - along, along * (1 - aside), along * aside], axis=1)
    return np.asarray(np.einsum("nk,nkx->nx", share, corner))


def spread_over(area: Floats, group: Ints, chosen: Ints, count: int) -> Ints:
    """(len(chosen), count) faces by area: of each chosen group of faces as many, each as often as
    its share of the group's area says.

    ``area`` and ``group`` are (T,); each group that is chosen has some area.
    """
    order = np.argsort(group, kind="stable")
    total = np.concatenate([[0.0], np.cumsum(area[order])])
    first = np.searchsorted(group[order], chosen)
    last = np.searchsorted(group[order], chosen, side="right")
    share = (np.arange(count) + 0.5) / count
    place = total[first, None] + share * (total[last] - total[first])[:, None]
    found = np.searchsorted(total, place, side="right") - 1
    return np.asarray(order[np.clip(found, first[:, None], last[:, None] - 1)])
