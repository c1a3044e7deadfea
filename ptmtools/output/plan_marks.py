"""What a floor plan hatches: cells where nobody stands, and floor that is in no cell.

Leaks on a floor plan: a ring around each opening, and the cells that see too much through it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.output.storeys import storey_of
from ptmtools.visibility.model import Pvs

#: Colour, and pattern as matplotlib names it.
VIEW_ONLY, LEFT_OUT = ("#8fa3b1", "...."), ("#b5452c", "////")
#: A floor may be as far below that of its storey, m: floors are not quite level.
_SLACK = 0.5

Shown = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def draw_view_only(
    axis: Any, cells: Cells, sections: Sequence[tuple[int, NDArray[np.float64]]], shown: Shown
) -> None:
    """Dots the view-only cells among ``sections``: numbers, and (n, 2) polygons, x and z.

    Parameters
    ----------
    shown: (…, 2) x and z to places on paper.
    """
    standing = cells.standing
    polygons = [shown(polygon) for cell, polygon in sections if not standing[cell]]
    _hatch(axis, polygons, VIEW_ONLY, zorder=1.5)


def draw_left_out(
    axis: Any, cells: Cells, floors: Sequence[float], storey: int, shown: Shown
) -> None:
    """Hatches what of `Cells.left_out` is in one storey, of those with these ``floors``; ``shown``
    as above."""
    height = cells.left_out[:, :, 1].mean(axis=1) + _SLACK
    here = np.array([storey_of(floors, y) == storey for y in height], dtype=bool)
    _hatch(axis, list(shown(cells.left_out[here][:, :, [0, 2]])), LEFT_OUT, zorder=6)


def _hatch(
    axis: Any, polygons: Sequence[NDArray[np.float64]], style: tuple[str, str], zorder: float
) -> None:
    from matplotlib.collections import PolyCollection

    colour, pattern = style
    drawn = PolyCollection(polygons, facecolors="none", edgecolors=colour, linewidths=0)
    drawn.set(hatch=pattern, zorder=zorder)
    axis.add_collection(drawn)


def hatches(cells: Cells) -> list[Any]:
    """The entries of the legend for what is drawn so."""
    from matplotlib.patches import Patch

    there = (
        (VIEW_ONLY, "view-only", not cells.standing.all()),
        (LEFT_OUT, "left out", len(cells.left_out)),
    )
    return [
        Patch(facecolor="none", edgecolor=colour, hatch=pattern, linewidth=0, label=label)
        for (colour, pattern), label, drawn in there
        if drawn
    ]


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
