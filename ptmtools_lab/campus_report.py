"""Runs through a campus as Markdown: cost and quality of each preset, received bytes over time; and
as charts 1 to 5 of the campus paper (its IV): bytes of the beginning, bytes over the walk, graphics
memory, the work of drawing, and textures that objects share.

Chart 4 of the paper has frame rates, which a simulation does not have. Here it has what they follow
from, the triangles of the objects in view. In chart 5 an object reuses the textures that were
loaded when it first became one of the nearest. Charts need matplotlib (extra ``plot``).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools_lab.campus.simulation import PAUSE, CampusRun
from ptmtools_lab.figures import COLORS, plot

FORMAT, SCHEMA = "ptmtools campus walk", 1
#: Seconds from one row of the table of bytes to the next.
EVERY = 30.0


def table(runs: Sequence[CampusRun]) -> list[str]:
    """Rows of measures, a column for each preset."""
    rows: list[tuple[str, Callable[[CampusRun], str]]] = [
        ("textures / lightmaps", lambda r: f"{r.quality.diffuse} / {r.quality.light}"),
        ("time until all coarsest meshes are loaded, s", lambda r: _or(r.begun, "{:.1f}")),
        ("graphics memory of these meshes, MB", lambda r: _mega(r.floor)),
        ("maximum graphics memory, MB", lambda r: _mega(int(r.memory.max()))),
        ("received with headers, MB", lambda r: _mega(r.body + r.overhead)),
        ("requests", lambda r: f"{r.requests:,}"),
        ("link idle", lambda r: f"{r.idle_share:.0%}"),
        (f"pauses of {PAUSE:g} s or more", lambda r: f"{r.pauses}"),
        ("time with an incomplete nearest object", lambda r: f"{r.late:.0%}"),
        ("mean time from near to complete, s", lambda r: _or(r.delay, "{:.1f}")),
        ("objects completed too late, of all that came near", lambda r: f"{r.never} of {_all(r)}"),
        ("textures already loaded when first needed", lambda r: f"{r.reused:.0%}"),
        ("e", lambda r: _or(r.e, "{:.2f}")),
    ]
    return [*_head("", runs), *(_row(name, [figure(run) for run in runs]) for name, figure in rows)]


def received_table(runs: Sequence[CampusRun]) -> list[str]:
    """MB of files received by time, a column for each preset; in brackets the increase since the
    row before."""
    time = runs[0].time
    instants = [*np.arange(EVERY, time[-1], EVERY).tolist(), float(time[-1])]
    lines, before = _head("MB of files after, s", runs), [0.0] * len(runs)
    for instant in instants:
        at = int(np.searchsorted(time, instant, "right")) - 1
        now = [float(run.fetched[at]) for run in runs]
        cells = [f"{_mega(n)} (+{_mega(n - b)})" for n, b in zip(now, before, strict=True)]
        lines.append(_row(f"{instant:.0f}", cells))
        before = now
    return lines


def document(campus: str, runs: Sequence[CampusRun]) -> dict[str, Any]:
    """All runs as a JSON document of its schema."""
    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "campus": campus,
        "seconds": float(runs[0].time[-1]),
        "runs": [
            {
                "preset": run.quality.name,
                "bandwidth": run.conditions.bandwidth,
                "begun": run.begun,
                "memory": {"start": run.floor, "most": int(run.memory.max())},
                "bytes": round(run.body),
                "overheadBytes": round(run.overhead),
                "requests": run.requests,
                "idle": run.idle_share,
                "pauses": run.pauses,
                "late": run.late,
                "delay": _none_if_nan(run.delay),
                "shown": len(run.delays),
                "never": run.never,
                "reused": run.reused,
                "e": _none_if_nan(run.e),
            }
            for run in runs
        ],
    }


def _none_if_nan(value: float) -> float | None:
    return None if np.isnan(value) else value


def _head(first: str, runs: Sequence[CampusRun]) -> list[str]:
    return [_row(first, [run.quality.name for run in runs]), "|---|" + "--:|" * len(runs)]


def _row(name: str, cells: Sequence[str]) -> str:
    return f"| {name} | {' | '.join(cells)} |"


def _all(run: CampusRun) -> int:
    return len(run.delays) + run.never


def _mega(count: float) -> str:
    return f"{count / 1e6:.1f}"


def _or(value: float | None, form: str) -> str:
    return "–" if value is None or np.isnan(value) else form.format(value)


#: Inches of a chart.
SIZE = 9.0, 3.0
#: Seconds over which received bytes are averaged.
WINDOW = 2.0
#: Most labels under the bars of chart 5.
LABELS = 40


def form_of(file: str | os.PathLike[str]) -> Literal["png", "svg"]:
    """The format of a picture, by its suffix.

    Raises InputError PTM-I111 for another suffix.
    """
    match Path(file).suffix.lower():
        case ".png":
            return "png"
        case ".svg":
            return "svg"
    raise InputError(
        "PTM-I111", f"--plot {file} is neither .png nor .svg", remedy="use one of them"
    )


def picture(runs: Sequence[CampusRun], form: Literal["png", "svg"] = "png") -> bytes:
    """The five charts, one below the other.

    Raises `MissingComponentError` PTM-M100 without matplotlib.
    """
    fresh = [run for run in runs if not run.quality.cached] or runs
    # Least textures are all there from the beginning; others are shared as they come.
    largest = max(fresh, key=lambda run: run.quality.diffuse)
    drawings = (
        partial(_beginning, fresh[0]),
        partial(_network, runs),
        partial(_over_time, runs, "Chart 3. Graphics memory", "MB", lambda run: run.memory / 1e6),
        partial(
            _over_time,
            runs,
            "Chart 4. Triangles of the objects in view, in place of the frame rate",
            "thousands",
            lambda run: run.triangles / 1e3,
        ),
        partial(_sharing, largest),
    )
    return plot(SIZE, drawings, form)


def network(run: CampusRun) -> tuple[Floats, Floats]:
    """(n,) the middles of windows of `WINDOW` s, the last one shorter, and (n,) the mean bit/s
    received in each."""
    end = float(run.time[-1])
    edges = np.unique(np.append(np.arange(0.0, end, WINDOW), end))
    received = np.interp(edges, run.time, run.fetched)
    wide = np.diff(edges)
    return edges[:-1] + wide / 2, 8 * np.diff(received) / wide


def _beginning(run: CampusRun, axes: Any) -> None:
    """Chart 1: until all coarsest meshes and least textures are there."""
    end = float(run.time[-1] if run.begun is None else run.begun)
    until = int(np.searchsorted(run.time, end, "right")) + 1
    axes.plot(run.time[:until], run.fetched[:until] / 1e6, color=COLORS[0], linewidth=1)
    if run.begun is not None:
        axes.axvline(run.begun, color="#999", linestyle=":", linewidth=1)
    _finish(axes, "Chart 1. Received until all coarsest meshes are loaded", "MB", run)
    axes.set_xlim(0, run.time[min(until, len(run.time)) - 1] or 1)


def _network(runs: Sequence[CampusRun], axes: Any) -> None:
    for color, run in zip(_colors(runs), runs, strict=True):
        at, rate = network(run)
        axes.plot(at, rate / 1e6, color=color, label=run.quality.name, linewidth=1)
    if (limit := runs[0].conditions.bandwidth) is not None:
        axes.axhline(limit / 1e6, color="#999", linestyle=":", linewidth=1)
    _finish(axes, "Chart 2. Received during the walk", "Mbit/s", runs[0])
    axes.legend(fontsize=7, loc="upper right")


def _over_time(runs: Sequence[CampusRun], title: str, unit: str, values: Any, axes: Any) -> None:
    for color, run in zip(_colors(runs), runs, strict=True):
        axes.plot(run.time, values(run), color=color, label=run.quality.name, linewidth=1)
    _finish(axes, title, unit, runs[0])
    axes.legend(fontsize=7, loc="upper right")


def _sharing(run: CampusRun, axes: Any) -> None:
    """Chart 5: a bar for each object with textures, in the order of the walk."""
    met = [meeting for meeting in run.meetings if meeting.textures]
    place = np.arange(len(met))
    axes.bar(place, [100 * m.reused / m.textures for m in met], color=COLORS[0])
    if len(met) <= LABELS:
        axes.set_xticks(place, [m.label for m in met], rotation=90, fontsize=6)
    title = f"Chart 5. Textures reused by objects as they become near, {run.quality.name}"
    axes.set(title=title, ylabel="%", ylim=(0, 105))
    axes.grid(True, axis="y", color="#e5e5e5", linewidth=0.5)


def _colors(runs: Sequence[CampusRun]) -> list[str]:
    return [COLORS[k % len(COLORS)] for k in range(len(runs))]


def _finish(axes: Any, title: str, unit: str, run: CampusRun) -> None:
    axes.set(title=title, xlabel="s", ylabel=unit, xlim=(0, run.time[-1] or 1))
    axes.set_ylim(bottom=0)
    axes.grid(True, color="#e5e5e5", linewidth=0.5)
