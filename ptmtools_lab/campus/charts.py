"""Charts 1 to 5 of the campus paper (its IV), of simulated walks: bytes of the beginning, bytes
over the walk, graphics memory, the work of drawing, and textures that objects share.

Chart 4 of the paper has frame rates, which a simulation does not have. Here it has what they follow
from, the triangles of the objects in view. In chart 5 an object reuses the textures that were
loaded when it first became one of the nearest.

Needs matplotlib (extra ``plot``).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools_lab.campus.simulation import CampusRun
from ptmtools_lab.figures import COLORS, plot

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
    met = [each for each in run.meetings if each.textures]
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
