"""Accuracy and cost of coverage hints. ``make bench-ach``, or

    python benchmarks/ach.py [MODEL…] [--cells N] [--only presets rates tolerance agreement …]

Each model is cut with the default options; up to ``--cells`` cells represent all. CPU seconds are
those of all threads of this process, for the whole model; errors are total variations (half the sum
of absolute differences) between the hints of a cell and those of 16,384 other points.

presets     the presets with both backends and with ``auto``: error, missed mass, rays, CPU seconds,
            and both as a share of the paper's preset with ``auto``; shows whether ``auto`` picks
            the faster backend. Software OpenGL runs on three cells beyond the paper's preset, and
            not on `high`
rates       decrease of the error with the number of rays, by least squares over `CoverageTrade`'s
            grid of settings, also written to `ach.csv` and `ach.png`
tolerance   achieved errors under ``--tolerance``, and how often the truth lies within the error
            bars
agreement   pixels that differ between the backends
speed       rays and sample points per second of each backend, and the ratio of the total time to
            that of the bare loop of Embree or the draw calls
processes   two processes against one

The standard output has a Markdown table for each part, so one ``--only`` prints the section of
docs/design/tradeoffs.md. All other output goes to the standard error, and everything, under
headings, to ``build/bench/ach.md``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray
from scenes import MODELS, ROOT, model_file

from ptmtools.cells import subdivide
from ptmtools.cells.model import Cells
from ptmtools.coverage.ach import choose, compute_ach, triangles_of_a_pvs
from ptmtools.coverage.backends import BACKENDS
from ptmtools.coverage.backends.opengl import OpenGLRenderer, create_context, is_software
from ptmtools.coverage.item_buffer import VIEWS
from ptmtools.coverage.options import PRESETS, AchOptions
from ptmtools.coverage.sampling import CellHints, HintSampler
from ptmtools.errors import MissingComponentError
from ptmtools.parallel import open_executor
from ptmtools.scene import ingest
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs
from ptmtools.visibility.pvs import compute_pvs
from ptmtools_lab.tradeoff.experiment import run
from ptmtools_lab.tradeoff.report import as_csv, picture
from ptmtools_lab.tradeoff.stages import CoverageTrade

OUTPUT = ROOT / "build/bench"
PARTS = ("presets", "rates", "tolerance", "agreement", "speed", "processes")
REFERENCE = 16384
#: Student's t for seven degrees of freedom, two-sided 95 %.
T = 2.365
#: Cells whose speed is measured.
LARGEST = 6
#: Cells that a software OpenGL is tried on, for settings of many sample points.
FEW = 3
Subject = tuple[Scene, Cells, Pvs]


class Report:
    """Markdown: tables to the standard output, the rest to the standard error, as it comes."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def say(self, line: str, file: TextIO = sys.stderr) -> None:
        print(line, file=file, flush=True)
        self.lines.append(line)

    def head(self, title: str, columns: Sequence[str]) -> None:
        self.say(f"\n### {title}")
        self.say("", sys.stdout)
        self.row(columns)
        self.say("|---" * len(columns) + "|", sys.stdout)

    def row(self, values: Iterable[Any]) -> None:
        self.say("| " + " | ".join(map(str, values)) + " |", sys.stdout)


def cpu(work: Callable[[], Any]) -> tuple[Any, float]:
    """What ``work`` returns, and processor seconds."""
    start = time.process_time()
    actual = work()
    return actual, time.process_time() - start


def has_gl() -> str:
    """The name of the OpenGL renderer; empty without one."""
    try:
        context = create_context()
    except MissingComponentError as missing:
        print(missing)
        return ""
    name = str(context.info["GL_RENDERER"])
    context.release()
    return name


def presets(report: Report, trials: dict[str, CoverageTrade], subjects: dict[str, Subject]) -> None:
    columns = ("model", "preset", "backend", "mean", "p95", "max", "missed", "rays a cell", "CPU s",
               "error / paper", "time / paper")  # fmt: skip
    report.head("Presets", columns)
    right = []
    gl = has_gl()
    slow = is_software(gl)
    for name, trade in trials.items():
        base: tuple[float, float] | None = None
        for preset in PRESETS:
            seconds = {}
            options = AchOptions(preset=preset)
            backends = ("embree", "gl") if gl and (preset != "high" or not slow) else ("embree",)
            for backend in backends:
                few = backend == "gl" and options.points > PRESETS["paper"][0]
                tried = trade.tried[:FEW] if few else trade.tried
                actual, seconds[backend], _ = trade.hints(replace(options, backend=backend), tried)
                errors = trade.errors(actual)
                auto = choose(*subjects[name][1:], options).name
                mean = float(errors.mean())
                if preset == "paper" and backend == auto:
                    base = mean, seconds[backend]
                ratios = ("–", "–")
                if base and backend == auto:
                    ratios = (f"{mean / max(base[0], 1e-12):.3f}" if base[0] else "0 / 0",
                              f"{seconds[backend] / base[1]:.4f}")  # fmt: skip
                missed = np.mean([hints.missed for hints in actual.values()])
                points = np.mean([hints.samples for hints in actual.values()])
                rays = points * len(VIEWS) * options.side**2
                report.row((
                    name, preset, backend + (" (auto)" if backend == auto else ""), f"{mean:.4f}",
                    f"{np.percentile(errors, 95):.4f}", f"{errors.max():.4f}", f"{missed:.1e}",
                    f"{rays:,.0f}", f"{seconds[backend]:.2f}", *ratios,
                ))  # fmt: skip
            if len(seconds) == 2:
                right.append(seconds[auto] <= 1.1 * min(seconds.values()))
    if right:
        report.say(f"\n`auto` took the faster backend, or one at most a tenth slower, in "
                   f"{sum(right)} of {len(right)} cases.")  # fmt: skip
    for name, trade in trials.items():
        report.say(f"The reference of {name} has a standard error of {trade.reference_error:.5f}.")


def rates(report: Report, trials: dict[str, CoverageTrade]) -> None:
    actual = [run(name, trade.experiment()) for name, trade in trials.items()]
    report.head(
        "Rates: error ∝ rays^b", ("family", *(trade.stage for trade in actual if trade.rates))
    )
    for family in dict.fromkeys(family for trade in actual for family in trade.rates):
        rate = [trade.rates.get(family) for trade in actual if trade.rates]
        report.row((family, *("–" if b is None else f"{b:.2f}" for b in rate)))
    OUTPUT.mkdir(parents=True, exist_ok=True)
    (OUTPUT / "ach.csv").write_text(as_csv(actual))
    (OUTPUT / "ach.png").write_bytes(picture(actual))


def tolerance(report: Report, trials: dict[str, CoverageTrade]) -> None:
    columns = ("model", "tolerance", "cells", "within", "mean error", "max", "points: median",
               "most", "not reached", "bars hold", "CPU s")  # fmt: skip
    report.head("Tolerance", columns)
    for name, trade in trials.items():
        for wanted in (0.02, 0.01):
            actual, seconds, _ = trade.hints(AchOptions(backend="embree", tolerance=wanted, face=4))
            errors = trade.errors(actual)
            points = [hints.samples for hints in actual.values()]
            short = sum(not hints.row.uncertain <= wanted for hints in actual.values())
            bars = bar_coverage(trade, actual)
            report.row((
                name, wanted, len(actual), f"{np.mean(errors <= wanted):.1%}",
                f"{errors.mean():.4f}", f"{errors.max():.4f}", int(np.median(points)), max(points),
                short,
                "–" if bars is None else f"{bars[0]:.1%} of {bars[1]}", f"{seconds:.2f}",
            ))  # fmt: skip


def bar_coverage(trade: CoverageTrade, found: Mapping[int, CellHints]) -> tuple[float, int] | None:
    """How often the reference is within t · error of entries above 0.05, and of how many."""
    held: list[NDArray[np.bool_]] = []
    for cell, hints in found.items():
        row, truth = hints.row, trade.truth[cell]
        large = (truth > 0.05) & (truth < 1) & np.isfinite(row.error)
        held.append(np.abs(row.value - truth)[large] <= T * row.error[large] + 1e-12)
    every = np.concatenate(held)
    return (float(every.mean()), len(every)) if len(every) else None


def agreement(report: Report, subjects: dict[str, Subject], cells_tried: int) -> None:
    if not has_gl():
        return
    report.head("GL against Embree", ("model", "face", "points", "pixels", "differ"))
    for name, (scene, cells, pvs) in subjects.items():
        for face, points in ((4, 64), (16, 16), (64, 8)):
            trade = CoverageTrade(scene, cells, pvs, AchOptions(), cells_tried, 8)
            options = AchOptions(samples=points, face=face)
            one, other = (trade.hints(replace(options, backend=b))[0] for b in ("gl", "embree"))
            pairs = list(zip(one.values(), other.values(), strict=True))
            differ = sum(float(np.abs(a.row.pixels - b.row.pixels).sum()) / 2 for a, b in pairs)
            size = sum(float(b.row.pixels.sum()) for _, b in pairs)
            report.row((name, face, points, f"{size:,.0f}", f"{differ / max(size, 1):.1e}"))


class Stopwatch:
    """Counts the wall seconds within calls of functions."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def timed(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Any:
            start = time.perf_counter()
            try:
                return work(*given, **named)
            finally:
                self.seconds += time.perf_counter() - start

        return call


class TimedTree:
    """An Embree scene whose rays are timed."""

    def __init__(self, tree: Any, watch: Stopwatch) -> None:
        self.run = watch.timed(tree.run)


def watched(renderer: Any) -> Stopwatch:
    """What a renderer spends in Embree, or in draws and reading their pixels."""
    watch = Stopwatch()
    if isinstance(renderer, OpenGLRenderer):
        renderer._draw = watch.timed(renderer._draw)  # type: ignore[method-assign]
    else:
        for tree in renderer._trees:
            if tree._tree is not None:
                tree._tree = TimedTree(tree._tree, watch)
    return watch


def speed(report: Report, subjects: dict[str, Subject]) -> None:
    columns = ("model", "backend", "face", "points", "points / s", "Mrays / s", "whole / bare")
    report.head(
        "Speed, one process: wall seconds of the whole over those of the bare loop", columns
    )
    for name, (scene, cells, pvs) in subjects.items():
        volumes = cells.cell_volumes(standing=True)
        largest = np.argsort(-volumes, kind="stable")[:LARGEST].tolist()
        for face, count in ((4, 512), (8, 256), (64, 8), (256, 2)):
            for backend in ("embree", "gl") if has_gl() else ("embree",):
                points = min(count, 32) if backend == "gl" else count
                options = AchOptions(backend=backend, samples=points, face=face)
                sampler = HintSampler(scene, cells, pvs, options, BACKENDS[backend])
                sampler.of_cell(largest[0])
                watch = watched(sampler.renderer)
                start = time.perf_counter()
                used = sum(sampler.of_cell(cell).samples for cell in largest)
                whole = time.perf_counter() - start
                sampler.renderer.close()
                rays = used * len(VIEWS) * face**2
                report.row((
                    name, backend, face, points, f"{used / whole:,.0f}",
                    f"{rays / whole / 1e6:.2f}", f"{whole / watch.seconds:.2f}",
                ))  # fmt: skip


def processes(report: Report, subjects: dict[str, Subject]) -> None:
    title = "Two processes against one (--samples 16384 --backend embree, wall seconds)"
    report.head(title, ("model", "one", "two", "times"))
    for name in (n for n in subjects if n in ("museum", "hospital")):
        took = []
        for workers in (1, 2):
            options = AchOptions(samples=16384, backend="embree")
            start = time.perf_counter()
            with open_executor(workers) as executor:
                compute_ach(*subjects[name], options, executor=executor)
            took.append(time.perf_counter() - start)
        report.row((name, *(f"{t:.1f}" for t in took), f"{took[0] / took[1]:.2f}"))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("models", nargs="*", type=model_file, help="names or files")
    parser.add_argument("--cells", type=int, default=24, help="cells that stand for all")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    given = parser.parse_args()
    report = Report()
    report.say(f"OpenGL: {has_gl() or 'none'}")
    subjects: dict[str, Subject] = {}
    trials: dict[str, CoverageTrade] = {}
    for model in [m for m in given.models or MODELS.values() if m.exists()]:
        scene = ingest(model)
        cells = subdivide(scene)
        pvs = compute_pvs(cells)
        subjects[model.stem] = scene, cells, pvs
        few = set(given.only) <= {"agreement", "speed", "processes"}
        trade = CoverageTrade(scene, cells, pvs, AchOptions(), given.cells, 8 if few else REFERENCE)
        trials[model.stem] = trade
        mean = triangles_of_a_pvs(cells, pvs)
        report.say(
            f"{model.stem}: {cells.cell_count} cells, {len(trade.tried)} of them tried, "
            f"{len(cells.triangle):,} triangles, {mean:,.0f} in a PVS"
        )
    parts: dict[str, Callable[[], Any]] = {
        "presets": lambda: presets(report, trials, subjects),
        "rates": lambda: rates(report, trials),
        "tolerance": lambda: tolerance(report, trials),
        "agreement": lambda: agreement(report, subjects, given.cells),
        "speed": lambda: speed(report, subjects),
        "processes": lambda: processes(report, subjects),
    }
    for part in PARTS:
        if part in given.only:
            parts[part]()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    (OUTPUT / "ach.md").write_text("\n".join(report.lines) + "\n")


if __name__ == "__main__":
    sys.exit(main())
