"""A floor plan for each storey: cells, walls, portals, leaks, floor in no cell, the way of a walk,
and the share of the view that each cell covers.

All lines are true sections at one height, so a plan shows exactly the results of the stages.
Drawing a plan needs matplotlib (extra `plot`).
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.errors import DatabaseError, InputError
from ptmtools.files import write_bytes
from ptmtools.lazy import component
from ptmtools.output.model import PlotOptions, PlotReport
from ptmtools.output.plan_marks import (
    LEAK,
    draw_leaks,
    draw_left_out,
    draw_view_only,
    hatches,
    leaks_by_portal,
)
from ptmtools.output.storeys import (
    area,
    cut_height,
    leaf_section,
    polygon_section,
    storey_names,
    storey_of,
    storeys,
    triangle_section,
)
from ptmtools.quantities import count
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: (n, 3) eyes, metres, and (n, 3) unit vectors in which they look, at equal or similar steps.
Way = tuple[Floats, Floats]
#: Colour of the line and of the arrows.
WAY = "#1a7f4b"
#: An eye rests if it moves and turns by less than this in one step: metres, radians.
_STILL = 2e-3
#: The length of an arrow, metres.
_ARROW = 0.8


def draw_way(
    axis: Any, way: Way, floors: Sequence[float], storey: int, shown: Callable[[Floats], Floats]
) -> None:
    """Draws the part of a way in one storey of the ``floors``, with an arrow for each direction of
    a resting eye; ``shown`` maps (…, 2) plan coordinates to paper."""
    eye, direction = way
    inside: Bools = np.array([storey_of(floors, y) == storey for y in eye[:, 1]], dtype=np.bool_)
    line = np.where(inside[:, None], shown(eye[:, [0, 2]]), np.nan)
    axis.plot(line[:, 0], line[:, 1], color=WAY, linewidth=0.9, zorder=6)
    change = np.abs(np.diff(eye, axis=0)).max(axis=1) + np.abs(np.diff(direction, axis=0)).max(
        axis=1
    )
    still = np.append(change < _STILL, False)
    begins = np.flatnonzero(still & ~np.append(False, still[:-1]) & inside)
    start = shown(eye[begins][:, [0, 2]])
    end = shown((eye[begins] + _ARROW * direction[begins])[:, [0, 2]])
    for tail, head in zip(start, end, strict=True):
        arrow = {"arrowstyle": "->", "color": WAY, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
        axis.annotate("", head, tail, arrowprops=arrow, zorder=6)


_PAPER, _INK = "#ffffff", "#1c2733"
_CELL_FILL, _CELL_EDGE = "#eaf0f4", "#a9bac6"
_UNSEEN = "#f6f7f8"
_WALL, _SEE_THROUGH, _PORTAL, _CHOSEN = "#1c2733", "#7d8fd8", "#f0562d", "#b0125b"
_SHADES = "YlGnBu"
#: The smallest share with a shade of its own; smaller ones look the same.
_FAINTEST = 1e-4
#: The shade of all visible cells without ACH.
_EVEN = 0.005
#: Cells with a larger share have so dark a shade that their number is white.
_DARK = 0.02
#: Numbers are left out of cells narrower than this many points on paper.
_NARROWEST = 9.0
#: And where letters would be smaller than this, points.
_SMALLEST = 4.5
#: Inches: around everything, above each panel, below it for the scale bar, between panels, and for
#: the colour bar.
_MARGIN, _CAPTION, _FOOT, _GAP, _BAR = 0.15, 0.26, 0.3, 0.25, 0.75
#: Inches: from the top to the middle of the first line of the heading, from the middle of the last
#: line to the panels, between lines, and at least between the heading and a legend beside it.
_FIRST_LINE, _BELOW_LINES, _LINE, _APART = 0.27, 0.23, 0.2, 0.3
#: Paper around the cells, as a share of the larger side: lines lie half outside of them.
_RIM = 0.004
#: A building deeper than this many times its width is turned by 90°.
_DEEP = 1.15


def plot_plan(
    scene: Scene,
    cells: Cells,
    pvs: Pvs | None,
    ach: Ach | None,
    out: str | os.PathLike[str],
    options: PlotOptions = PlotOptions(),  # noqa: B008 - a frozen value
    *,
    way: Way | None = None,
    force: bool = False,
) -> PlotReport:
    """Draws the plan as a PNG; the same input gives the same bytes with the same matplotlib.

    Parameters
    ----------
    pvs, ach: may be None while those stages have not run; a chosen cell needs the PVS, and is
        shaded evenly without ACH.
    way: of a walk.

    Raises
    ------
    DatabaseError: PTM-D600 there are no cells.
    InputError: PTM-I111 the cell does not exist, or the PVS has not been computed.
    MissingComponentError: PTM-M100 matplotlib is not installed.
    OutputError: PTM-O001 to PTM-O003, see `ptmtools.files`.
    """
    if options.cell is not None and not 0 <= options.cell < cells.cell_count:
        raise InputError(
            "PTM-I111",
            f"there is no cell {options.cell}",
            remedy=f"cells are numbered 0 to {cells.cell_count - 1}",
        )
    if options.cell is not None and pvs is None:
        raise InputError(
            "PTM-I111",
            "the cells visible from it have not been computed yet",
            remedy="run `ptm pvs` first",
        )
    agg = component(
        "matplotlib.backends.backend_agg", "PTM-M100", "a plan needs matplotlib", "plot"
    )
    if cells.cell_count == 0:
        raise DatabaseError(
            "PTM-D600", "there are no cells", remedy="subdivide a model that has rooms"
        )
    floors = storeys(scene, cells, options.height)
    figure = _Plan(scene, cells, pvs, ach, options, floors, way).draw(agg.FigureCanvasAgg)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None}, facecolor=_PAPER)
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
        way: Way | None,
    ) -> None:
        self._scene = scene
        self._cells = cells
        self._pvs = pvs
        self._options = options
        self._floors = floors
        self._way = way
        self._corners = cells.vertex[cells.triangle]
        self._opaque = scene.opaque[cells.triangle_source]
        self._leaks = leaks_by_portal(pvs)
        self._shade: dict[int, float] | None = None
        self._shares_known = ach is not None
        if options.cell is not None and pvs is not None:
            row = pvs.row(options.cell)
            share = np.full(len(row), _EVEN) if ach is None else ach.row(options.cell)
            self._shade = dict(zip(row.tolist(), share.tolist(), strict=True))
        # Seen from above with X to the right and Z down, or Z to the right and X up.
        plan = np.concatenate([cells.leaf_point, *cells.left_out])[:, [0, 2]]
        width, depth = np.ptp(plan, axis=0)
        self._turned = bool(depth > _DEEP * width)
        shown = self._to_paper(plan)
        low, high = shown.min(axis=0), shown.max(axis=0)
        rim = _RIM * float((high - low).max())
        self._low, self._high = low - rim, high + rim

    def draw(self, canvas: Callable[[Any], Any]) -> Any:
        """The whole figure; ``canvas`` attaches a renderer, which measures text."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LogNorm
        from matplotlib.figure import Figure

        span = self._high - self._low
        width = self._options.width
        barred = self._shade is not None and self._shares_known
        bar = _BAR if barred else 0.0
        columns = 2 if len(self._floors) > 1 and span[0] < 1.6 * span[1] else 1
        rows = -(-len(self._floors) // columns)
        panel = (width - 2 * _MARGIN - bar - (columns - 1) * _GAP) / columns
        tall = panel * float(span[1] / span[0])
        figure = Figure(figsize=(width, 1), dpi=self._options.dpi, facecolor=_PAPER)
        canvas(figure)
        head = self._head(figure)
        height = head + rows * (_CAPTION + tall + _FOOT) + _MARGIN
        figure.set_size_inches(width, height)
        shades = ScalarMappable(LogNorm(_FAINTEST, 1), _SHADES)
        for i, name in enumerate(storey_names(self._scene, self._floors)):
            row, column = divmod(i, columns)
            edge = _MARGIN + column * (panel + _GAP)
            bottom = height - head - (row + 1) * (_CAPTION + tall + _FOOT) + _FOOT
            axis = figure.add_axes((edge / width, bottom / height, panel / width, tall / height))
            axis.set_axis_off()
            axis.set(xlim=(self._low[0], self._high[0]), ylim=(self._high[1], self._low[1]))
            self._storey(axis, name, self._floors[i], shades, panel)
            draw_left_out(axis, self._cells, self._floors, i, self._to_paper)
            draw_leaks(axis, self._cells, self._leaks, self._floors, i, self._to_paper)
            if self._way is not None:
                draw_way(axis, self._way, self._floors, i, self._to_paper)
        if barred:
            long = min(0.8 * (height - head), 4.0)
            low = height - head - _CAPTION - long
            place = (1 - (_MARGIN + 0.58) / width, low / height, 0.14 / width, long / height)
            self._colour_bar(figure, place, shades)
        return figure

    def _to_paper(self, plan: Floats) -> Floats:
        """(…, 2) plan coordinates (x, z) as (right, down) on paper."""
        return np.stack([plan[..., 1], -plan[..., 0]], axis=-1) if self._turned else plan

    def _storey(self, axis: Any, name: str, floor: float, shades: Any, panel: float) -> None:
        from matplotlib.collections import LineCollection, PolyCollection

        height = cut_height(self._cells, floor, self._options.height)
        sections = list(self._sections(height))
        polygons = [self._to_paper(polygon) for _, polygon in sections]
        fills = [self._fill(cell, shades) for cell, _ in sections]
        # Edges in their own fill close the seams between the leaves of a cell.
        axis.add_collection(
            PolyCollection(polygons, facecolors=fills, edgecolors=fills, linewidths=0.5)
        )
        draw_view_only(axis, self._cells, sections, self._to_paper)
        edges = _outlines(sections, self._cells.tolerance.grid)
        for zorder, colour, width, segments in (
            (2, _CELL_EDGE, 0.5, [e for outline in edges.values() for e in outline]),
            (2, _CHOSEN, 5, edges.get(self._options.cell, [])),
            (3, _PORTAL, 2.2, self._portals(height)),
            (4, _SEE_THROUGH, 1.4, triangle_section(self._corners[~self._opaque], height)),
            (5, _WALL, 1.2, triangle_section(self._corners[self._opaque], height)),
        ):
            lines = [self._to_paper(segment) for segment in segments]
            settings = {"capstyle": "butt"} if zorder > 2 else {}
            axis.add_collection(
                LineCollection(lines, colors=colour, linewidths=width, zorder=zorder, **settings)
            )
        self._numbers(axis, sections, 72 * panel / float(self._high[0] - self._low[0]))
        self._scale_bar(axis)
        numbers = len({cell for cell, _ in sections})
        axis.set_title(
            f"{name}{': ' if name else ''}floor {floor:+.2f} m, cut at {height:+.2f} m: "
            f"{count(numbers, 'cell')}",
            fontsize=9,
            color=_INK,
            loc="left",
            pad=6,
            parse_math=False,  # a name may have dollar signs
        )

    def _sections(self, height: float) -> Iterator[tuple[int, Floats]]:
        for leaf in range(self._cells.leaf_count):
            cell = int(self._cells.leaf_cell[leaf])
            polygon = leaf_section(self._cells, leaf, height)
            if len(polygon) >= 3 and cell >= 0:
                yield cell, polygon

    def _doors(self) -> list[int]:
        """Portals between cells; those between the leaves of one cell are not drawn."""
        ends = self._cells.portal_cell
        return np.flatnonzero((ends[:, 0] != ends[:, 1]) & (ends >= 0).all(axis=1)).tolist()

    def _portals(self, height: float) -> list[Floats]:
        cuts = (polygon_section(self._cells.portal(k), height) for k in self._doors())
        return [cut for cut in cuts if cut is not None]

    def _fill(self, cell: int, shades: Any) -> Any:
        if self._shade is None:
            return _CELL_FILL
        share = self._shade.get(cell)
        return _UNSEEN if share is None else shades.to_rgba(max(share, _FAINTEST))

    def _numbers(self, axis: Any, sections: list[tuple[int, Floats]], points: float) -> None:
        """Writes each cell's number once, in its largest section, if there is room, and below it,
        in the largest section of a named room, the name; ``points`` of paper are a metre."""
        import shapely
        from matplotlib.patheffects import withStroke

        largest: dict[int, Floats] = {}
        for cell, polygon in sections:
            if cell not in largest or area(polygon) > area(largest[cell]):
                largest[cell] = polygon
        numbers, home = self._cells.room_numbers.tolist(), dict[int, int]()
        for cell in sorted(largest, key=lambda cell: -area(largest[cell])):
            home.setdefault(numbers[cell], cell)
        for cell, polygon in largest.items():
            name = self._cells.room_name(cell) if home[numbers[cell]] == cell else ""
            width, depth = np.ptp(self._to_paper(polygon), axis=0) * points
            text = f"{cell}\n{name}" if name else str(cell)
            if _letters(text, width, depth) < _SMALLEST:
                text = str(cell)
            size = _letters(text, width, depth)
            if min(width, depth) < _NARROWEST or size < _SMALLEST:
                continue
            (middle,) = shapely.get_coordinates(shapely.centroid(shapely.Polygon(polygon)))
            x, y = self._to_paper(middle)
            dark = self._shade is not None and self._shade.get(cell, 0.0) > _DARK
            ink, paper = (_PAPER, _INK) if dark else (_INK, _PAPER)
            axis.text(
                x,
                y,
                text,
                fontsize=size,
                color=ink,
                ha="center",
                va="center",
                zorder=7,
                parse_math=False,
                path_effects=[withStroke(linewidth=1.6, foreground=paper, alpha=0.6)],
            )

    def _scale_bar(self, axis: Any) -> None:
        length = _round_length(float(self._high[0] - self._low[0]) / 5)
        share = length / float(self._high[0] - self._low[0])
        tall = axis.get_position().height * axis.figure.get_figheight()
        y = -0.16 / tall
        where = {"transform": axis.transAxes, "clip_on": False, "color": _INK}
        axis.plot([0, share], [y, y], linewidth=2.2, solid_capstyle="butt", **where)
        for end in (0, share):
            axis.plot([end, end], [y - 0.04 / tall, y + 0.04 / tall], linewidth=1, **where)
        where.pop("clip_on")
        axis.text(share, y, f"  {length:g} m", fontsize=8, va="center", **where)

    def _colour_bar(self, figure: Any, place: tuple[float, ...], shades: Any) -> None:
        bar = figure.add_axes(place)
        drawn = figure.colorbar(shades, cax=bar)
        drawn.set_ticks([1, 0.1, 0.01, 0.001, _FAINTEST])
        drawn.set_ticklabels(["100 %", "10 %", "1 %", "0.1 %", "≤ 0.01 %"])
        drawn.outline.set_visible(False)
        bar.set_title("share of view", fontsize=9, color=_INK, pad=6)
        bar.tick_params(labelsize=7, colors=_INK, length=2)
        bar.minorticks_off()

    def _head(self, figure: Any) -> float:
        """Writes the heading and the legend, below each other unless one line has room for both;
        returns their height, inches. The height of ``figure`` may change afterwards."""
        from matplotlib.transforms import ScaledTranslation

        width, renderer = self._options.width, figure.canvas.get_renderer()
        room = width - 2 * _MARGIN
        top = figure.dpi_scale_trans + ScaledTranslation(0, 1, figure.transFigure)

        def size(artist: Any) -> tuple[float, float]:
            box = artist.get_window_extent(renderer)
            artist.remove()
            return box.width / figure.dpi, box.height / figure.dpi

        def line(text: str, number: int) -> Any:
            style = {"fontsize": 11, "weight": "bold", "color": _INK, "transform": top}
            y = -_FIRST_LINE - number * _LINE
            return figure.text(_MARGIN, y, text, ha="left", va="center", **style)

        def legend(columns: int, loc: str, x: float, y: float) -> Any:
            return figure.legend(
                handles=handles,
                loc=loc,
                bbox_to_anchor=(x, y),
                bbox_transform=top,
                ncols=columns,
                frameon=False,
                fontsize=9,
                labelcolor=_INK,
                handlelength=1.3,
                columnspacing=1.4,
                borderpad=0,
                borderaxespad=0,
            )

        lines: list[str] = []
        for part in self._facts():
            longer = f"{lines[-1]}  ·  {part}" if lines else part
            if lines and size(line(longer, 0))[0] <= room:
                lines[-1] = longer
            else:
                lines.append(part)
        for number, text in enumerate(lines):
            line(text, number)
        handles = self._handles()
        columns = len(handles)
        while columns > 1 and size(legend(columns, "upper left", 0, 0))[0] > room:
            columns -= 1
        wide, high = size(legend(columns, "upper left", 0, 0))
        beside = len(lines) == 1 and columns == len(handles)
        if beside and size(line(lines[0], 0))[0] + _APART + wide <= room:
            legend(columns, "center right", width - _MARGIN, -_FIRST_LINE)
            return _FIRST_LINE + _BELOW_LINES
        y = _FIRST_LINE + (len(lines) - 0.3) * _LINE
        legend(columns, "upper left", _MARGIN, -y)
        return y + high + _BELOW_LINES - 0.1

    def _facts(self) -> list[str]:
        """The parts of the heading."""
        facts = [
            count(self._cells.cell_count, "cell"),
            f"{count(len(self._doors()), 'portal')} between them",
        ]
        if self._pvs is not None:
            share = 100 * self._pvs.volume_at_hand[0]
            facts.append(f"a client keeps {share:.1f} % of the volume in memory")
        if len(self._floors) > 1:
            facts.append(f"{len(self._floors)} storeys")
        return facts

    def _handles(self) -> list[Any]:
        """The entries of the legend."""
        from matplotlib.lines import Line2D

        chosen = self._options.cell
        lines = [(_WALL, "opaque"), (_PORTAL, "portal")]
        if not self._opaque.all():
            lines.insert(1, (_SEE_THROUGH, "transparent"))
        if self._leaks:
            lines.append((LEAK, "leak, and cells that see too much through it"))
        if self._way is not None:
            lines.append((WAY, "walk"))
        if chosen is not None and self._shade is not None:
            lines.append((_CHOSEN, f"cell {chosen}, sees {len(self._shade)} cells"))
        handles: list[Any] = [
            Line2D([], [], color=colour, linewidth=2.5, label=label) for colour, label in lines
        ]
        return handles + hatches(self._cells)


def _letters(text: str, width: float, depth: float) -> float:
    """The size of letters, in points, at which lines of text fit into a section, in points."""
    lines = text.split("\n")
    return min(depth * 0.6 / len(lines), width / (0.65 * max(map(len, lines))), 8.0)


def _outlines(
    sections: Sequence[tuple[int, Floats]], grid: float
) -> dict[int | None, list[Floats]]:
    """Cell → closed lines around the union of the sections of its leaves."""
    import shapely

    from ptmtools.cells.planar import union

    outlines: dict[int | None, list[Floats]] = {}
    for cell in sorted({cell for cell, _ in sections}):
        leaves = [shapely.Polygon(polygon) for number, polygon in sections if number == cell]
        rim = shapely.boundary(union(np.array(leaves), grid) if len(leaves) > 1 else leaves[0])
        outlines[cell] = [shapely.get_coordinates(line) for line in shapely.get_parts(rim)]
    return outlines


def _round_length(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is at most ``length``."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(m for m in (1, 2, 5) if m * power <= length * 1.0001) * power)
