"""Marks on a floor plan: hatched view-only cells, hatched floor that is in no cell, and leaks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.model import Cells
from ptmtools.output.storeys import storey_of
from ptmtools.visibility.model import Pvs

#: Colour, and pattern as matplotlib names it.
VIEW_ONLY, LEFT_OUT = ("#8fa3b1", "...."), ("#b5452c", "////")
#: A floor may be this far below that of its storey, metres, as floors are not quite level.
_SLACK = 0.5

Shown = Callable[[Floats], Floats]


def draw_view_only(
    axis: Any, cells: Cells, sections: Sequence[tuple[int, Floats]], shown: Shown
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
    """Hatches the triangles of `Cells.left_out` in one storey of the ``floors``; ``shown`` as in
    `draw_view_only`."""
    height = cells.left_out[:, :, 1].mean(axis=1) + _SLACK
    inside = np.array([storey_of(floors, y) == storey for y in height], dtype=bool)
    _hatch(axis, list(shown(cells.left_out[inside][:, :, [0, 2]])), LEFT_OUT, zorder=6)


def _hatch(axis: Any, polygons: Sequence[Floats], style: tuple[str, str], zorder: float) -> None:
    from matplotlib.collections import PolyCollection

    colour, pattern = style
    drawn = PolyCollection(polygons, facecolors="none", edgecolors=colour, linewidths=0)
    drawn.set(hatch=pattern, zorder=zorder)
    axis.add_collection(drawn)


def hatches(cells: Cells) -> list[Any]:
    """The entries of the legend for hatched areas."""
    from matplotlib.patches import Patch

    entries = (
        (VIEW_ONLY, "view-only", not cells.standing.all()),
        (LEFT_OUT, "left out", len(cells.left_out)),
    )
    return [
        Patch(facecolor="none", edgecolor=colour, hatch=pattern, linewidth=0, label=label)
        for (colour, pattern), label, drawn in entries
        if drawn
    ]


LEAK = "#e09400"
#: Points: diameter of the ring, and from its middle to the text.
_RING, _TEXT_OFFSET = 15.0, 10.0
#: Number of cells listed at a ring.
_LISTED = 3


def leaks_by_portal(pvs: Pvs | None) -> dict[int, list[int]]:
    """Portal → the cells for which it is the leak (`Pvs.leak`), the largest PVS first."""
    leaks: dict[int, list[int]] = {}
    if pvs is not None:
        for cell, _, portal, _ in pvs.leak.tolist():
            leaks.setdefault(portal, []).append(cell)
    return leaks


def draw_leaks(
    axis: Any,
    cells: Cells,
    leaks: dict[int, list[int]],
    floors: Sequence[float],
    storey: int,
    shown: Callable[[Floats], Floats],
) -> None:
    """Draws a ring around each leak of one storey, with the cells that see too much through it. A
    leak belongs to the nearest floor below.

    Parameters
    ----------
    floors: heights of all storeys, ascending. shown: (…, 2) x and z to places on paper.
    """
    from matplotlib.patheffects import withStroke

    for portal, viewers in sorted(leaks.items()):
        polygon = cells.portal(portal)
        x, y, z = polygon.mean(axis=0)
        if storey_of(floors, y) != storey:
            continue
        outline = shown(polygon[:, [0, 2]])
        axis.plot(*outline[[*range(len(outline)), 0]].T, color=LEAK, linewidth=3, zorder=6)
        place = shown(np.array([x, z]))
        ring = {"marker": "o", "markerfacecolor": "none", "markeredgewidth": 1.8}
        axis.plot(*place, markersize=_RING, markeredgecolor=LEAK, zorder=8, **ring)
        rest = ", …" if len(viewers) > _LISTED else ""
        axis.annotate(
            ", ".join(map(str, viewers[:_LISTED])) + rest,
            place,
            (_TEXT_OFFSET, 0),
            textcoords="offset points",
            fontsize=8,
            weight="bold",
            color=LEAK,
            va="center",
            zorder=9,
            path_effects=[withStroke(linewidth=2, foreground="#ffffff")],
        )
