"""Trade-offs of cells and visibility. ``make bench-pvs``, or

    python benchmarks/pvs_trade.py [MODEL…] [--wall-areas 2 1 0.5] [--segments 1000000]
    python benchmarks/pvs_trade.py --only-plot build/bench/pvs.csv

The CSV has a row for every model, minimum wall area, kind of cell (leaves and rooms) and method of
visibility:

leaves, cells, portals     of the subdivision
pvs                        mean share of visible cells per cell
cut                        portals whose search the budget ended
walk_reached, walk_stops   rooms that the standard walk (`walk.py`) reaches, and its planned rooms
walk_files, walk_mb        cell files fetched along the walk, each once, and their megabytes
at_hand_mb                 megabytes of the walker's visible set, mean over the way
at_hand_volume, at_hand_texels
                           the same as a share of the building's volume, and of all texels in use
cells_cpu_s, cells_s       processor and wall seconds of the subdivision, grouping included
flow_cpu_s, flow_s         the same of the visibility, compilation excluded; that of leaves for any
                           kind of cell
flow_mb                    peak memory of the visibility, beyond the memory of its process before
missed_pairs, missed_segments, cracks
                           pairs, segments and cracks that `check_conservative` finds missing
                           (``--segments`` tested)
lacks                      pairs of cells of the full set that are missing here

The walk is planned on the default cells and is the same for all rows; placeholders of equal length
replace the hints in the files. Every measurement runs in a separate process. Cells of one wall area
have the same leaves and are tested with the same segments, so a superset of a complete set needs no
segments: the full set of leaves is tested, and others only if it fails or if they are sampled.

Prints the tables of the documentation and writes them to `pvs.md`, with `pvs.png` beside it.
"""

from __future__ import annotations

import argparse
import csv
import pickle
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from scenes import MODELS, ROOT, TWO_ROOMS, model_file

# Nothing large is imported here: a child starts with what its parent has of memory on its record.

OUTPUT = ROOT / "build/bench/pvs.csv"
#: Models, and the wall areas at which something changes in them.
AREAS = {
    MODELS["museum"]: (2.0, 1.0, 0.5),
    MODELS["hospital"]: (2.0, 0.5, 0.25),
    MODELS["willowgarage"]: (4.0, 2.0, 1.0),
    MODELS["gallery"]: (2.0, 0.5, 0.25),
    MODELS["office"]: (8.0, 4.0, 2.0),
}
OTHERS = (4.0, 2.0, 1.0)
KINDS, METHODS = ("leaf", "room"), ("full", "fast", "sampled")
#: Segments tried on sampled sets, at most.
SHOWING = 1_000_000
COLORS = {"full": "#1b6ca8", "fast": "#d1603d", "sampled": "#5a9367"}


@dataclass(frozen=True)
class Row:
    """A line of the CSV; the columns are those of the module's head."""

    model: str
    wall_area: float
    kind: str
    method: str
    leaves: int
    cells: int
    portals: int
    pvs: float
    cut: int
    walk_reached: int
    walk_stops: int
    walk_files: int
    walk_mb: float
    at_hand_mb: float
    at_hand_volume: float
    at_hand_texels: float
    cells_cpu_s: float
    cells_s: float
    flow_cpu_s: float
    flow_s: float
    flow_mb: float
    segments: int
    missed_pairs: int
    missed_segments: int
    cracks: int
    lacks: int


def in_child(work: Callable[..., Any], *given: Any) -> Any:
    """What ``work`` returns, done by a fresh process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(work, *given).result()


def timed(work: Callable[..., Any], *given: Any) -> tuple[Any, float, float]:
    """What ``work`` returns, processor seconds and wall seconds."""
    cpu, wall = time.process_time(), time.perf_counter()
    actual = work(*given)
    return actual, time.process_time() - cpu, time.perf_counter() - wall


def stored(folder: Path, name: str, content: Any = None) -> Any:
    """Keeps ``content`` in the folder of this run, or reads it again."""
    path = folder / f"{name}.pickle"
    if content is None:
        return pickle.loads(path.read_bytes())
    path.write_bytes(pickle.dumps(content))
    return content


def warm_up(folder: Path) -> None:
    """Compiles what is compiled, and keeps a small subdivision to load it with."""
    from ptmtools.cells import SubdivideOptions, subdivide
    from ptmtools.scene import ingest
    from ptmtools.visibility import PvsOptions, compute_pvs

    scene = ingest(TWO_ROOMS)
    subdivide(scene)
    cells = stored(folder, "small", subdivide(scene, SubdivideOptions(cells="leaf", max_leaves=4)))
    for method in METHODS:
        compute_pvs(cells, PvsOptions(method=method))


def walk_of(folder: Path, model: Path) -> None:
    """Keeps the standard walk through the default cells of a model."""
    from walk import standard_walk

    from ptmtools.cells import SubdivideOptions, subdivide
    from ptmtools.scene import ingest

    rooms = subdivide(ingest(model), SubdivideOptions(cells="room", gain=1.0))
    stored(folder, "walk", standard_walk(rooms))


def cut(folder: Path, model: Path, area: float) -> dict[str, tuple[float, float]]:
    """Keeps the cells of both kinds; processor and wall seconds of each."""
    from ptmtools.cells import SubdivideOptions, subdivide
    from ptmtools.cells.rooms import group_cells
    from ptmtools.scene import ingest

    subdivide(ingest(TWO_ROOMS))
    scene = ingest(model)
    options = SubdivideOptions(cells="leaf", wall_area=area)
    leaves, cpu, wall = timed(subdivide, scene, options)
    rooms, more_cpu, more_wall = timed(group_cells, leaves, SubdivideOptions(wall_area=area))
    stored(folder, "leaf", leaves)
    stored(folder, "room", rooms)
    return {"leaf": (cpu, wall), "room": (cpu + more_cpu, wall + more_wall)}


def flow(folder: Path, method: Any) -> dict[str, float]:
    """Keeps the visible sets of leaves, and those of rooms, which see what their leaves see; what
    the former took."""
    import numpy as np
    from memory import with_peak

    from ptmtools.cells.rooms import leaf_of_cell
    from ptmtools.visibility import Pvs, PvsOptions, compute_pvs

    compute_pvs(stored(folder, "small"), PvsOptions(method=method))
    leaves = stored(folder, "leaf")
    (pvs, cpu, wall), most = with_peak(
        lambda: timed(compute_pvs, leaves, PvsOptions(method=method))
    )
    stored(folder, f"leaf-{method}", pvs)
    rooms = stored(folder, "room")
    matrix = np.zeros((rooms.cell_count, rooms.cell_count), dtype=np.bool_)
    room = rooms.leaf_cell[leaf_of_cell(leaves)]
    one, other = (room[ends] for ends in np.nonzero(pvs.to_matrix()))
    matrix[one, other] = True
    lifted = Pvs.from_matrix(matrix, cut=pvs.cut, conservative=pvs.conservative)
    stored(folder, f"room-{method}", lifted)
    return {"flow_cpu_s": cpu, "flow_s": wall, "flow_mb": most / 1e6}


def weigh(folder: Path, model: Path, kind: str) -> dict[str, dict[str, Any]]:
    """For each method what the sets are and what they make a client fetch."""
    import numpy as np
    from walk import at_hand, cell_texts, load, passed, texels_at_hand

    from ptmtools.scene import ingest

    scene, cells = ingest(model), stored(folder, kind)
    walk = stored(folder, "walk")
    way = passed(cells, walk.corner)
    volume = cells.cell_volumes()
    full = stored(folder, f"{kind}-full").to_matrix()
    actual = {}
    for method in METHODS:
        pvs = stored(folder, f"{kind}-{method}")
        shares = [1 / np.arange(3, 3 + len(pvs.row(c))) for c in range(cells.cell_count)]
        texts = cell_texts(scene, cells, pvs, [s / s.sum() for s in shares])
        walked = load(cells, pvs, way, np.array([len(t.text.encode()) for t in texts]))
        actual[method] = {
            "leaves": cells.leaf_count,
            "cells": cells.cell_count,
            "portals": cells.portal_count,
            "pvs": pvs.average_share,
            "cut": pvs.fallbacks,
            "walk_reached": walk.reached,
            "walk_stops": walk.stops,
            "walk_files": walked.files,
            "walk_mb": walked.megabytes,
            "at_hand_mb": walked.at_hand,
            "at_hand_volume": at_hand(cells, pvs, way, volume / volume.sum()),
            "at_hand_texels": texels_at_hand(scene, cells, pvs, way, texts),
            "lacks": int(np.count_nonzero(full & ~pvs.to_matrix())) // 2,
        }
    return actual


def check(folder: Path, model: Path, kind: str, method: str, segments: int) -> dict[str, int]:
    """What random segments show to be missing from a set."""
    from ptmtools.cells import SubdivideOptions, structural_triangles
    from ptmtools.scene import ingest
    from ptmtools.visibility import check_conservative

    scene = ingest(model)
    corners = scene.corners[structural_triangles(scene, SubdivideOptions())]
    cells, pvs = stored(folder, kind), stored(folder, f"{kind}-{method}")
    report = check_conservative(corners, cells, pvs, segments)
    return {
        "segments": report.tried,
        "missed_pairs": len(report.missed),
        "missed_segments": report.missed_segments,
        "cracks": report.hairlines,
    }


def measure(folder: Path, model: Path, area: float, segments: int) -> list[Row]:
    """The rows of one model and one wall area."""
    seconds = in_child(cut, folder, model, area)
    took = {m: in_child(flow, folder, m) for m in METHODS}
    # From here on nothing is timed, and two at a time may work.
    with ProcessPoolExecutor(2, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:

        def shoot(kind: str, method: str) -> Any:
            few = method == "sampled"  # of interest is how many are shown, not whether all are
            count = min(segments, SHOWING) if few else segments
            return pool.submit(check, folder, model, kind, method, count)

        shots = {(k, m): shoot(k, m) for k, m in (("leaf", "full"), ("leaf", "sampled"))}
        shots["room", "sampled"] = shoot("room", "sampled")
        weighed = {k: pool.submit(weigh, folder, model, k) for k in KINDS}
        facts = {k: v.result() for k, v in weighed.items()}
        strictest = shots["leaf", "full"].result()
        for k in KINDS:
            for m in ("full", "fast"):
                if strictest["missed_pairs"] or facts[k][m]["lacks"]:
                    shots.setdefault((k, m), shoot(k, m))
        checked = {pair: shot.result() for pair, shot in shots.items()}
    return [
        Row(
            model=model.stem,
            wall_area=area,
            kind=k,
            method=m,
            cells_cpu_s=seconds[k][0],
            cells_s=seconds[k][1],
            **took[m],
            **facts[k][m],
            **checked.get((k, m), strictest),
        )
        for k in KINDS
        for m in METHODS
    ]


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """All rows, times and sizes to four digits."""
    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(f.name for f in fields(Row))
        for row in rows:
            values = (getattr(row, f.name) for f in fields(Row))
            out.writerow(f"{v:.4g}" if isinstance(v, float) else v for v in values)


def read_csv(path: Path) -> list[Row]:
    """What `write_csv` wrote."""
    as_type = {"str": str, "int": int, "float": float}
    with path.open(newline="") as file:
        return [
            Row(**{f.name: as_type[str(f.type)](line[f.name]) for f in fields(Row)})
            for line in csv.DictReader(file)
        ]


def tables(rows: Sequence[Row]) -> str:
    """Two Markdown tables: cells by full visibility, and rooms by all methods; and which walks
    leave rooms out."""
    by = {(r.model, r.wall_area, r.kind, r.method): r for r in rows}
    cells = [
        ["model", "wall m²", "cells are", "cells", "portals", "PVS", "walk: files", "MB"]
        + ["at hand: MB", "volume", "texels", "CPU s: cells", "flow", "flow s", "flow MB"]
    ]
    for r in rows:
        if r.method == "full":
            cells.append(
                [r.model, f"{r.wall_area:g}", r.kind, f"{r.cells:,}", f"{r.portals:,}"]
                + [f"{r.pvs:.1%}", f"{r.walk_files:,}", f"{r.walk_mb:.2f}", f"{r.at_hand_mb:.2f}"]
                + [f"{r.at_hand_volume:.0%}", f"{r.at_hand_texels:.0%}", f"{r.cells_cpu_s:.1f}"]
                + [f"{r.flow_cpu_s:.2f}", f"{r.flow_s:.2f}", f"{r.flow_mb:.0f}"]
            )
    methods = [
        ["model", "wall m²", "PVS: sampled", "full", "fast", "at hand MB: sampled", "full", "fast"]
        + ["CPU s: sampled", "full", "fast", "cut", "sampled lacks", "shown", "full / fast miss"]
    ]
    for r in rows:
        if (r.kind, r.method) == ("room", "full"):
            s, f = (by[r.model, r.wall_area, "room", m] for m in ("sampled", "fast"))
            three = (s, r, f)
            methods.append(
                [r.model, f"{r.wall_area:g}"]
                + [f"{x.pvs:.1%}" for x in three]
                + [f"{x.at_hand_mb:.2f}" for x in three]
                + [f"{x.flow_cpu_s:.2f}" for x in three]
                + [f"{r.cut:,}", f"{s.lacks:,}", f"{s.missed_pairs:,}"]
                + [f"{r.missed_pairs:,} / {f.missed_pairs:,}"]
            )
    short = {r.model: r for r in rows if r.walk_reached < r.walk_stops}
    left_out = "".join(
        f"\nThe walk through {model} reaches {r.walk_reached} of {r.walk_stops} rooms.\n"
        for model, r in short.items()
    )
    return f"{_markdown(cells)}\n{_markdown(methods)}{left_out}"


def _markdown(table: list[list[str]]) -> str:
    """Rows of a table, the first its head; what the first columns repeat is left out."""
    lines = [table[0]]
    for above, row in pairwise(table):
        same = [a == b for a, b in zip(above[:2], row[:2], strict=True)]
        model = "" if same[0] else row[0]
        lines.append([model, "" if all(same) else row[1], *row[2:]])
    text = [f"| {' | '.join(line)} |\n" for line in lines]
    return "".join([text[0], "|" + "---|" * len(table[0]) + "\n", *text[1:]])


def plot(rows: Sequence[Row], path: Path) -> None:
    """A column a model: the share of it that is held on the walk, and the megabytes fetched,
    against the seconds that the visibility took."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import withStroke
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, PercentFormatter

    models = list(dict.fromkeys(r.model for r in rows))
    what = (("at_hand_volume", "share of the building at hand"), ("walk_mb", "MB fetched"))
    figure, axes = plt.subplots(
        len(what), len(models), figsize=(3.1 * len(models) + 0.6, 6.4), squeeze=False
    )
    for column, model in enumerate(models):
        for line, (name, title) in enumerate(what):
            ax = axes[line][column]
            for kind in KINDS:
                for method in METHODS:
                    mine = [r for r in rows if (r.model, r.kind, r.method) == (model, kind, method)]
                    mine.sort(key=lambda r: -r.wall_area)
                    x = [max(r.flow_cpu_s, 1e-3) for r in mine]
                    y = [getattr(r, name) for r in mine]
                    ax.plot(
                        x,
                        y,
                        color=COLORS[method],
                        linestyle="-" if kind == "room" else ":",
                        marker="o" if kind == "room" else "s",
                        markerfacecolor=COLORS[method] if kind == "room" else "white",
                        markersize=5,
                        linewidth=1.3,
                    )
                    if (kind, method) == ("room", "full"):
                        for r, at, up in zip(mine, x, y, strict=True):
                            ax.annotate(
                                f"{r.wall_area:g}",
                                (at, up),
                                xytext=(0, -6 if line else 6),
                                textcoords="offset points",
                                ha="center",
                                va="top" if line else "bottom",
                                fontsize=8,
                                color="#222222",
                                path_effects=[withStroke(linewidth=2.5, foreground="white")],
                            )
            if line == 0:
                ax.set_yticks([0, 0.25, 0.5, 0.75, 1])
                ax.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
            ax.set_xscale("log")
            ax.margins(x=0.12)
            low, high = ax.get_xlim()
            ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 30 * low else (1,)))
            ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            ax.xaxis.set_minor_formatter(NullFormatter())
            top = max(getattr(r, name) for r in rows if r.model == model) if line else 1.0
            ax.set_ylim(-0.08 * top if line else 0, 1.12 * top)
            ax.grid(True, which="major", color="#e4e4e4", linewidth=0.7)
            ax.set_axisbelow(True)
            for side in ("top", "right"):
                ax.spines[side].set_visible(False)
            ax.tick_params(labelsize=8, which="both")
            if line == 0:
                ax.set_title(model, fontsize=11)
            else:
                ax.set_xlabel("CPU s of the visibility", fontsize=9)
            if column == 0:
                ax.set_ylabel(title, fontsize=9)
    handles = [Line2D([], [], color=COLORS[m], linewidth=2, label=m) for m in METHODS]
    handles += [
        Line2D([], [], color="#333333", marker="o", linestyle="-", label="rooms"),
        Line2D(
            [],
            [],
            color="#333333",
            marker="s",
            markerfacecolor="white",
            linestyle=":",
            label="leaves",
        ),
    ]
    figure.legend(
        handles=handles,
        ncols=len(handles),
        loc="lower center",
        frameon=False,
        fontsize=9,
        title="numbers: least wall area, m²; all other lines have the same in this order",
        title_fontsize=9,
    )
    figure.tight_layout(rect=(0, 0.09, 1, 1))
    figure.savefig(path, dpi=100)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("models", nargs="*", type=model_file, help="names or files")
    parser.add_argument("--wall-areas", nargs="+", type=float, metavar="M2")
    parser.add_argument("--segments", type=int, default=1_000_000)
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT, metavar="CSV")
    parser.add_argument("--only-plot", type=Path, metavar="CSV", help="measure nothing, draw again")
    given = parser.parse_args(arguments)
    if given.only_plot:
        rows, output = read_csv(given.only_plot), given.only_plot
    else:
        output = given.output
        output.parent.mkdir(parents=True, exist_ok=True)
        models = [m for m in given.models or AREAS if m.is_file()]
        if not models:
            parser.exit(message="none of the models exists\n")
        rows = []
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            in_child(warm_up, folder)
            for model in models:
                in_child(walk_of, folder, model)
                for area in given.wall_areas or AREAS.get(model, OTHERS):
                    begun = time.perf_counter()
                    rows += measure(folder, model, area, given.segments)
                    write_csv(rows, output)
                    spent = time.perf_counter() - begun
                    print(f"{model.stem}, walls of {area:g} m²: {spent:.0f} s", file=sys.stderr)
    text = tables(rows)
    print(text, end="")
    output.with_suffix(".md").write_text(text)
    plot(rows, output.with_suffix(".png"))
    return int(any(r.missed_pairs for r in rows if r.method != "sampled"))


if __name__ == "__main__":
    sys.exit(main())
