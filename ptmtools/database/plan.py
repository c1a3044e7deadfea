"""A floor plan per storey: cells, walls, portals, and one cell's visible set shaded by ACH.

Everything drawn is a true section at one height, so a plan shows what the stages computed and
nothing that an artist would add. Without matplotlib the plan cannot be drawn (extra `plot`).
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.database.model import PlotOptions, PlotReport
from ptmtools.database.section import area, leaf_section, polygon_section, triangle_section
from ptmtools.database.storeys import cut_height, storeys
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.files import write_bytes
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

_PAPER, _INK = "#ffffff", "#1c2733"
_CELL_FILL, _CELL_EDGE = "#eaf0f4", "#a9bac6"
_WALL, _SEE_THROUGH, _PORTAL, _CHOSEN = "#1c2733", "#6fb3d2", "#e4572e", "#0b7a75"
_SHADES = "YlOrRd"
#: The least share that has a shade of its own; smaller ones look like it.
_FAINTEST = 1e-4
#: Numbers are left out of cells narrower than this many points on paper.
_NARROWEST = 9.0


def plot_plan(
    scene: Scene,
    cells: Cells,
    pvs: Pvs | None,
    ach: Ach | None,
    out: str | os.PathLike[str],
    options: PlotOptions = PlotOptions(),  # noqa: B008 - a frozen value
    *,
    force: bool = False,
) -> PlotReport:
    """Draws the plan as a PNG; the same input gives the same bytes with the same matplotlib.

    Parameters
    ----------
    pvs, ach: may be None while those stages have not run; a chosen cell needs the PVS, and is
        shaded evenly without ACH.

    Raises
    ------
    InputError: PTM-I601 there is no such cell, or nothing visible is known yet.
    MissingComponentError: PTM-M600 matplotlib is not installed.
    OutputError: PTM-O001 to PTM-O003, see `ptmtools.files`.
    """
    if options.cell is not None and not 0 <= options.cell < cells.cell_count:
        raise InputError(
            "PTM-I601",
            f"there is no cell {options.cell}",
            remedy=f"cells are numbered 0 to {cells.cell_count - 1}",
        )
    if options.cell is not None and pvs is None:
        raise InputError(
            "PTM-I601", "what the cell sees is not known yet", remedy="run `ptm pvs` first"
        )
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
    except ImportError as fault:
        raise MissingComponentError(
            "PTM-M600", "a plan needs matplotlib", remedy="pip install 'ptmtools[plot]'"
        ) from fault
    floors = storeys(cells, options.height, options.storey_gap)
    figure = _Plan(scene, cells, pvs, ach, options, floors).draw()
    canvas = FigureCanvasAgg(figure)
    buffer = io.BytesIO()
    canvas.print_png(buffer, metadata={"Software": None})
    data = buffer.getvalue()
    write_bytes(out, data, force=force)
    return PlotReport(os.fspath(out), tuple(floors), len(data))


class _Plan:
    def __init__(
        self,
        scene: Scene,
        cells: Cells,
        pvs: Pvs | None,
        ach: Ach | None,
        options: PlotOptions,
        floors: Sequence[float],
    ) -> None:
        self._cells = cells
        self._pvs = pvs
        self._options = options
        self._floors = floors
        self._corners = cells.vertex[cells.triangle]
        self._opaque = scene.opaque[cells.triangle_source]
        self._shade: dict[int, float] | None = None
        if options.cell is not None and pvs is not None:
            row = pvs.row(options.cell)
            share = np.full(len(row), 1 / len(row)) if ach is None else ach.row(options.cell)
            self._shade = dict(zip(row.tolist(), share.tolist(), strict=True))

    def draw(self) -> Any:
        """The whole figure."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LogNorm
        from matplotlib.figure import Figure

        low, high = self._bounds()
        span = high - low
        rows, columns = self._grid(span)
        panel = self._options.width / columns
        tall = panel * span[1] / span[0] + 0.35
        head = 0.62
        size = (self._options.width, rows * tall + head)
        figure = Figure(figsize=size, dpi=self._options.dpi, facecolor=_PAPER)
        right = 0.93 if self._shade is not None else 0.99
        axes = figure.subplots(
            rows,
            columns,
            squeeze=False,
            gridspec_kw={
                "left": 0.01,
                "right": right,
                "bottom": 0.01,
                "top": 1 - head / size[1] - 0.25 / size[1],
                "wspace": 0.03,
                "hspace": 0.08,
            },
        ).ravel()
        norm = LogNorm(_FAINTEST, 1)
        shades = ScalarMappable(norm, _SHADES)
        for i, axis in enumerate(axes):
            axis.set_axis_off()
            if i < len(self._floors):
                axis.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]), aspect="equal")
                self._storey(axis, i, shades)
        if self._shade is not None:
            bar = figure.add_axes((0.945, 0.1, 0.013, 0.7))
            figure.colorbar(shades, cax=bar)
            bar.set_title("ACH", fontsize=9, color=_INK, pad=6)
            bar.tick_params(labelsize=8, colors=_INK, length=2)
            bar.minorticks_off()
            bar.spines["outline"].set_visible(False) if "outline" in bar.spines else None
        self._title(figure, size[1])
        return figure

    def _bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        plan = self._cells.leaf_point[:, [0, 2]]
        if len(plan) == 0:
            return np.zeros(2), np.ones(2)
        low, high = plan.min(axis=0), plan.max(axis=0)
        margin = 0.02 * float((high - low).max()) + 0.1
        return low - margin, high + margin

    def _grid(self, span: NDArray[np.float64]) -> tuple[int, int]:
        count = max(len(self._floors), 1)
        columns = min(count, 2) if span[0] < 1.6 * span[1] else 1
        return -(-count // columns), columns

    def _storey(self, axis: Any, index: int, shades: Any) -> None:
        from matplotlib.collections import LineCollection, PolyCollection

        floor = self._floors[index]
        height = cut_height(self._cells, floor, self._options.height)
        sections = list(self._sections(height))
        fills = [self._fill(cell, shades) for cell, _ in sections]
        polygons = [polygon for _, polygon in sections]
        axis.add_collection(
            PolyCollection(polygons, facecolors=fills, edgecolors=_CELL_EDGE, linewidths=0.5)
        )
        chosen = [p for cell, p in sections if cell == self._options.cell]
        walls = triangle_section(self._corners[self._opaque], height)
        panes = triangle_section(self._corners[~self._opaque], height)
        portals = self._portals(height)
        for segments, colour, width, layer in (
            (panes, _SEE_THROUGH, 1.2, 3),
            (walls, _WALL, 1.3, 4),
            (portals, _PORTAL, 2.0, 5),
        ):
            axis.add_collection(
                LineCollection(
                    list(segments),
                    colors=colour,
                    linewidths=width,
                    zorder=layer,
                    capstyle="butt" if colour == _PORTAL else "round",
                )
            )
        axis.add_collection(
            PolyCollection(chosen, facecolors="none", edgecolors=_CHOSEN, linewidths=2.4, zorder=6)
        )
        self._numbers(axis, sections)
        self._scale_bar(axis)
        numbers = len({cell for cell, _ in sections})
        title = f"floor at {floor:+.2f} m, cut at {height:+.2f} m: {numbers} cells"
        axis.set_title(title, fontsize=9, color=_INK, loc="left", pad=4)

    def _sections(self, height: float) -> Iterator[tuple[int, NDArray[np.float64]]]:
        for leaf in range(self._cells.leaf_count):
            polygon = leaf_section(self._cells, leaf, height)
            if len(polygon) >= 3:
                yield int(self._cells.leaf_cell[leaf]), polygon

    def _portals(self, height: float) -> list[NDArray[np.float64]]:
        cells = self._cells
        ends = cells.leaf_cell[cells.portal_leaf].reshape(-1, 2)
        doors = np.flatnonzero(ends[:, 0] != ends[:, 1]).tolist()
        cuts = (polygon_section(cells.portal(k), height) for k in doors)
        return [cut for cut in cuts if cut is not None]

    def _fill(self, cell: int, shades: Any) -> Any:
        if self._shade is None:
            return _CELL_FILL
        share = self._shade.get(cell)
        return "#f4f5f6" if share is None else shades.to_rgba(max(share, _FAINTEST))

    def _numbers(self, axis: Any, sections: list[tuple[int, NDArray[np.float64]]]) -> None:
        """Each cell's number once, in its largest section, if there is room."""
        from matplotlib.patheffects import withStroke

        largest: dict[int, NDArray[np.float64]] = {}
        for cell, polygon in sections:
            if cell not in largest or area(polygon) > area(largest[cell]):
                largest[cell] = polygon
        box = axis.get_position()
        inches = box.width * self._options.width
        points = 72 * inches / abs(np.diff(axis.get_xlim())[0])
        for cell, polygon in largest.items():
            text = str(cell)
            width, depth = np.ptp(polygon, axis=0) * points
            size = min(depth * 0.6, width / (0.65 * len(text)), 8.0)
            if min(width, depth) < _NARROWEST or size < 4.5:
                continue
            x, z = _middle(polygon)
            axis.text(
                x,
                z,
                text,
                fontsize=size,
                color=_INK,
                ha="center",
                va="center",
                zorder=7,
                path_effects=[withStroke(linewidth=1.4, foreground="#ffffffcc")],
            )

    def _scale_bar(self, axis: Any) -> None:
        left, right = axis.get_xlim()
        bottom = axis.get_ylim()[0]
        length = _round_length((right - left) / 5)
        x, z = left + 0.02 * (right - left), bottom - 0.012 * (right - left)
        axis.plot(
            [x, x + length], [z, z], color=_INK, linewidth=2.2, zorder=8, solid_capstyle="butt"
        )
        axis.text(x + length, z, f" {length:g} m", fontsize=8, color=_INK, va="center", zorder=8)

    def _title(self, figure: Any, tall: float) -> None:
        cells, chosen = self._cells, self._options.cell
        parts = [f"{cells.cell_count} cells", f"{cells.portal_count} portals"]
        if self._pvs is not None:
            parts.append(f"average PVS {100 * self._pvs.average_share:.1f} %")
        if len(self._floors) > 1:
            parts.append(f"{len(self._floors)} storeys")
        text = ", ".join(parts)
        figure.text(
            0.01,
            1 - 0.3 / tall,
            text,
            fontsize=13,
            color=_INK,
            ha="left",
            va="center",
            weight="bold",
        )
        legend = [(_WALL, "opaque"), (_SEE_THROUGH, "transparent"), (_PORTAL, "portal")]
        if chosen is not None and self._shade is not None:
            seen = f"cell {chosen} sees {len(self._shade)} of {cells.cell_count} cells"
            legend.append((_CHOSEN, seen))
        x = 0.99
        for colour, label in reversed(legend):
            figure.text(
                x,
                1 - 0.3 / tall,
                f"━ {label}",
                fontsize=9,
                color=colour,
                ha="right",
                va="center",
            )
            x -= (len(label) + 3) * 0.075 / self._options.width + 0.004


def _middle(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """The centroid of a polygon's area."""
    a, b = polygon - polygon[0], np.roll(polygon, -1, axis=0) - polygon[0]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    total = cross.sum()
    if total <= 0:
        return np.asarray(polygon.mean(axis=0))
    return np.asarray(polygon[0] + ((a + b) * cross[:, None]).sum(axis=0) / (3 * total))


def _round_length(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is at most ``length``."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(m for m in (1, 2, 5) if m * power <= length * 1.0001) * power)
