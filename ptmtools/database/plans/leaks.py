"""Leaks on a floor plan: a ring around each opening, and the cells that see too much through it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.database.plans.storeys import storey_of
from ptmtools.visibility.model import Pvs

LEAK = "#e09400"
#: Points: diameter of the ring, and from its middle to the text.
_RING, _BESIDE = 15.0, 10.0
#: So many cells are named at a ring.
_NAMED = 3


def leaks_by_portal(pvs: Pvs | None) -> dict[int, list[int]]:
    """Portal → the cells for which it is the leak, those that see most first (see `Pvs.leak`)."""
    found: dict[int, list[int]] = {}
    if pvs is not None:
        for cell, _, portal, _ in pvs.leak.tolist():
            found.setdefault(portal, []).append(cell)
    return found


def draw_leaks(
    axis: Any,
    cells: Cells,
    leaks: dict[int, list[int]],
    floors: Sequence[float],
    storey: int,
    shown: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> None:
    """Draws the leaks of one storey, those nearer above its floor than above any other.

    Parameters
    ----------
    floors: heights of all storeys, ascending. shown: (…, 2) x and z to places on paper.
    """
    from matplotlib.patheffects import withStroke

    for portal, seeing in sorted(leaks.items()):
        polygon = cells.portal(portal)
        x, y, z = polygon.mean(axis=0)
        if storey_of(floors, y) != storey:
            continue
        outline = shown(polygon[:, [0, 2]])
        axis.plot(*outline[[*range(len(outline)), 0]].T, color=LEAK, linewidth=3, zorder=6)
        place = shown(np.array([x, z]))
        ring = {"marker": "o", "markerfacecolor": "none", "markeredgewidth": 1.8}
        axis.plot(*place, markersize=_RING, markeredgecolor=LEAK, zorder=8, **ring)
        rest = ", …" if len(seeing) > _NAMED else ""
        axis.annotate(
            ", ".join(map(str, seeing[:_NAMED])) + rest,
            place,
            (_BESIDE, 0),
            textcoords="offset points",
            fontsize=8,
            weight="bold",
            color=LEAK,
            va="center",
            zorder=9,
            path_effects=[withStroke(linewidth=2, foreground="#ffffff")],
        )
