"""The experiments of the stages: their settings and errors.

Subdivision: no subdivision is the right one to compare with, but a good one needs little of the
building in a client's memory. The error of a setting is the share of the building's volume that is
potentially visible from a viewer's cell, on average over all positions of the viewer.

Coverage hints: the error of a setting is the total variation between its hints of a cell and those
of a reference: more points than any setting, of an independent scramble, with rays. Some cells
stand for all.

Textures: all profiles return the pixels within the requested error (the profile raw always
exactly), so the question is what a visitor has before the file is complete. The error of a setting
is that of the picture in the first eighth of the uncompressed bytes, beside the image itself.

Visibility: the reference is the full search with a budget that hardly any portal exhausts. The
error of a setting is its number of wrong pairs of cells over that of the right ones: extra pairs,
or with sampled lines also missing ones, which are worse: a client with such a set shows holes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells import subdivide
from ptmtools.cells.model import Cells
from ptmtools.coverage.ach import choose
from ptmtools.coverage.item_buffer import VIEWS
from ptmtools.coverage.options import MAX_SAMPLES, PRESETS, AchOptions
from ptmtools.coverage.sampling import CellHints, HintSampler
from ptmtools.errors import MissingComponentError
from ptmtools.output.served import read_served
from ptmtools.pipeline.stages import ACH, CELLS, PVS, SCENE, TEXTURES
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.texture import (
    EncodeOptions,
    decode,
    encode,
    read_header,
    read_image,
    whole_levels,
)
from ptmtools.texture.profiles import PROFILES
from ptmtools.visibility.model import Pvs
from ptmtools.visibility.options import PvsOptions
from ptmtools.visibility.pvs import compute_pvs
from ptmtools_lab.comparing import SimulateOptions, play, require_hints
from ptmtools_lab.path.making import path_through
from ptmtools_lab.path.options import PathOptions
from ptmtools_lab.policies.paper import PaperOptions
from ptmtools_lab.tradeoff.experiment import (
    Experiment,
    Measurement,
    Setting,
    Subject,
    decibels,
    time_work,
)
from ptmtools_lab.world import World, prepare

#: Leaves of a subdivision that only serves for compilation.
WARM = 4


def prepare_cells(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    scene, recorded = subject.artifacts[SCENE], subject.options(CELLS)
    few = subdivide(scene, replace(recorded, max_leaves=WARM))
    compute_pvs(few, PvsOptions(method="fast"))  # compiles both

    def measure(setting: Setting) -> Measurement:
        cells, seconds = time_work(lambda: subdivide(scene, replace(recorded, **setting.knobs)))
        mean, worst = compute_pvs(cells, PvsOptions(method="fast")).volume_at_hand
        return Measurement(
            seconds=seconds,
            work=float(cells.leaf_count),
            error=mean,
            worst=worst,
            more={"cells": float(cells.cell_count), "portals": float(cells.portal_count)},
        )

    areas = [recorded.wall_area * factor for factor in (4, 2, 1, 0.5)]
    settings = [
        Setting(f"--cells {kind} --wall-area {area:g}", {"cells": kind, "wall_area": area}, kind)
        for kind in ("room", "leaf")
        for area in areas
    ]
    error = "share of the building that a viewer may see"
    return Experiment("leaves", error, settings, measure)


#: Seed of the reference, unless the user takes the same.
REFERENCE_SEED = 2**31 - 1
#: Pixels a side of the reference: as good as more, since every point shifts them.
REFERENCE_FACE = 4
#: Placement, points and pixels a side of settings besides the presets.
GRID = (
    ("sobol", (32, 128, 512, 2048), 2),
    ("sobol", (8, 16, 64, 128, 256, 1024), 4),
    ("sobol", (8, 32, 128, 512), 8),
    ("sobol", (8, 32, 128), 16),
    ("sobol", (8, 32), 64),
    ("kd", (8, 16, 32), 8),
    ("uniform", (8, 32, 128, 512), 8),
)


def prepare_coverage(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`. The options that settings choose are left open."""
    options = replace(subject.options(ACH), samples=None, face=None, placement=None, tolerance=None)
    artifacts = subject.artifacts
    tried, points = subject.cells_tried, subject.reference_points
    return CoverageTrade(
        artifacts[SCENE], artifacts[CELLS], artifacts[PVS], options, tried, points
    ).experiment()


class CoverageTrade:
    """The experiment of the coverage hints.

    Attributes
    ----------
    tried: cells that stand for all, evenly spread.
    truth: their reference hints, by cell.
    reference_error: the standard error of these.
    """

    def __init__(
        self,
        scene: Scene,
        cells: Cells,
        pvs: Pvs,
        options: AchOptions = AchOptions(),  # noqa: B008 - a frozen value
        cells_tried: int = 16,
        reference_points: int = MAX_SAMPLES,
    ) -> None:
        """``options``: those that settings leave open, such as the backend and the weighting."""
        self._scene, self._cells, self._pvs, self._options = scene, cells, pvs, options
        self._most = reference_points
        every = cells.cell_count
        self.tried = np.unique(np.linspace(0, every - 1, min(cells_tried, every)).astype(int))
        reference = replace(
            options,
            backend="embree",
            samples=reference_points,
            face=REFERENCE_FACE,
            placement="sobol",
            seed=REFERENCE_SEED - (options.seed == REFERENCE_SEED),
            tolerance=None,
        )
        hints_of, _, _ = self.hints(reference)
        self.truth = {cell: hints.row.value for cell, hints in hints_of.items()}
        # Bounds of the reference's error; its standard error is about half. Cells with too few
        # usable points have none.
        bounds = np.array([hints.row.uncertain for hints in hints_of.values()], dtype=np.float64)
        bounds = bounds[np.isfinite(bounds)]
        self.reference_error = float(bounds.mean()) / 2 if len(bounds) else 0.0

    def experiment(self) -> Experiment:
        """The experiment with all `settings`."""
        error = "total variation of a cell's hints"
        return Experiment(
            "rays per cell", error, self.settings(), self.measure, self.reference_error
        )

    def settings(self) -> list[Setting]:
        """See `Experiment.settings`; only those with fewer points than the reference."""
        presets = [Setting(f"--preset {name}", {"preset": name}) for name in PRESETS]
        grid = [
            Setting(
                f"--samples {samples} --face {face} --placement {placement}",
                {"samples": samples, "face": face, "placement": placement},
                f"{placement}, {face}² pixels",
            )
            for placement, counts, face in GRID
            for samples in counts
        ]
        points = {s.name: replace(self._options, **s.knobs).points for s in (*presets, *grid)}
        return [s for s in (*presets, *grid) if points[s.name] < self._most]

    def measure(self, setting: Setting) -> Measurement:
        """See `Experiment.measure`."""
        options = replace(self._options, **setting.knobs)
        hints_of, seconds, backend = self.hints(options)
        errors = self.errors(hints_of)
        points = np.array([hints.samples for hints in hints_of.values()])
        missed = np.array([hints.missed for hints in hints_of.values()])
        many = max(len(hints_of), 1)
        return Measurement(
            seconds=seconds,
            work=float(points.sum()) * len(VIEWS) * options.side**2 / many,
            error=float(errors.sum()) / many,
            worst=float(errors.max(initial=0.0)),
            more={
                "p95": float(np.percentile(errors, 95)) if len(errors) else 0.0,
                "missed": float(missed.sum()) / many,
            },
            note=backend,
        )

    def errors(self, hints_of: Mapping[int, CellHints]) -> NDArray[np.float64]:
        """(n,) total variation between hints of n of the cells tried, by cell, and the reference.

        Raises KeyError for a cell that was not tried.
        """
        pairs = ((hints.row.value, self.truth[cell]) for cell, hints in hints_of.items())
        return np.array([np.abs(value - truth).sum() / 2 for value, truth in pairs])

    def hints(
        self, options: AchOptions, cells: Sequence[int] | None = None
    ) -> tuple[dict[int, CellHints], float, str]:
        """The hints of the given cells tried, or of all of them, by cell; processor seconds for all
        cells of the scene; and the backend."""
        asked = [int(cell) for cell in (self.tried if cells is None else cells)]
        backend = choose(self._cells, self._pvs, options)

        def ready() -> HintSampler:
            return HintSampler(self._scene, self._cells, self._pvs, options, backend)

        ready().renderer.close()  # loading once is no part of the cost
        sampler, before = time_work(ready)
        try:
            if asked:
                sampler.of_cell(asked[0])
            hints_of, seconds = time_work(lambda: {cell: sampler.of_cell(cell) for cell in asked})
            seconds *= self._cells.cell_count / max(len(asked), 1)
            return hints_of, before + seconds, backend.name
        finally:
            sampler.renderer.close()


#: Number of images that stand for all, and texels a side of the corner used of each.
TRIED, CORNER = 4, 512
#: The share of an image's uncompressed bytes after which its picture is compared, 1 / this.
PREFIX = 8


def prepare_textures(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    return textures_experiment(subject.artifacts.original(SCENE).images, subject.options(TEXTURES))


def textures_experiment(images: Sequence[SourceImage], recorded: EncodeOptions) -> Experiment:
    """The experiment of the texture profiles, on corners of a few images."""
    chosen = np.linspace(0, len(images) - 1, min(TRIED, len(images))).astype(int)
    whole = [read_image(images[i].load()) for i in np.unique(chosen)]
    corners = [pixels[:CORNER, :CORNER] for pixels in whole]
    tried = sum(pixels.size for pixels in corners)
    part = tried / max(sum(pixels.size for pixels in whole), 1)
    times = len(images) / max(len(whole), 1) / (part or 1)
    settings = []
    for name, profile in PROFILES.items():
        knobs = {"profile": name} if profile.lossy else {"profile": name, "max_error": 0}
        with suppress(MissingComponentError):
            if corners:  # compiles the kernels
                encode(corners[0][:8, :8], replace(recorded, **knobs))
            settings.append(Setting(f"--profile {name}", knobs))

    def measure(setting: Setting) -> Measurement:
        options = replace(recorded, **setting.knobs)
        files, seconds = time_work(lambda: [encode(pixels, options) for pixels in corners])
        pairs = list(zip(files, corners, strict=True))
        square = np.array([_square_error(_at_prefix(*pair), pair[1]) for pair in pairs])
        size = np.array([pixels.size for pixels in corners])
        error = math.sqrt((square * size).sum() / max(size.sum(), 1))
        inexact = sum(int((decode(data) != pixels).sum()) for data, pixels in pairs)
        raw = sum(pixels.nbytes for pixels in corners)
        return Measurement(
            seconds=seconds * times,
            work=float(sum(map(len, files))),
            error=error,
            worst=math.sqrt(square.max(initial=0.0)),
            more={
                "PSNR": decibels(error),
                "ratio": sum(map(len, files)) / max(raw, 1),
                "inexact": inexact / max(size.sum(), 1),
            },
        )

    error = f"RMS error of the picture in 1/{PREFIX} of the uncompressed bytes, of 255"
    units = {"work": "B", "PSNR": "dB"}
    return Experiment("bytes of all levels", error, settings, measure, units=units)


def _at_prefix(data: bytes, pixels: NDArray[Any]) -> NDArray[np.float64]:
    """The picture of the whole levels in the first bytes of a file, each texel as large as those
    that it stands for; the mean of the image's range before the first level."""
    levels = whole_levels(read_header(data), pixels.nbytes // PREFIX)
    if not levels:
        return np.full(pixels.shape, _top(pixels) / 2)
    shown = decode(data, levels - 1).astype(np.float64)
    rows, columns = (
        np.minimum(np.arange(side) * have // side, have - 1)
        for side, have in zip(pixels.shape[:2], shown.shape[:2], strict=True)
    )
    return np.asarray(shown[rows][:, columns].reshape(pixels.shape))


def _square_error(shown: NDArray[np.float64], pixels: NDArray[Any]) -> float:
    """The mean square of the differences, of 255."""
    off = (shown - pixels.astype(np.float64)) * (255 / _top(pixels))
    return float(np.square(np.nan_to_num(off, posinf=0.0, neginf=0.0)).mean())


def _top(pixels: NDArray[Any]) -> float:
    """White: the largest integer, or the largest sample of an image of floats."""
    if pixels.dtype.kind == "u":
        return float(np.iinfo(pixels.dtype).max)
    return float(np.abs(pixels).max(initial=0.0)) or 1.0


#: The budget of the reference, which hardly any portal exhausts.
AMPLE = 2_000_000
#: Budgets to try, besides the database's own.
BUDGETS = (200, 2_000, 20_000, 200_000)
#: Options that settings leave open.
_BASE = PvsOptions()


def prepare_visibility(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    return visibility_experiment(subject.artifacts[CELLS], subject.options(PVS).budget)


def visibility_experiment(cells: Cells, budget: int) -> Experiment:
    """The experiment of the visibility; the database's own ``budget`` is one of those tried."""
    ample = replace(_BASE, method="full", budget=max(AMPLE, budget))
    truth = compute_pvs(cells, ample).to_matrix()
    right = truth.sum(axis=1)
    compute_pvs(cells, replace(_BASE, method="sampled", lines=1))  # compiles it

    def measure(setting: Setting) -> Measurement:
        pvs, seconds = time_work(lambda: compute_pvs(cells, replace(_BASE, **setting.knobs)))
        seen = pvs.to_matrix()
        missing, wrong = truth & ~seen, truth != seen
        size = max(int(truth.sum()), 1)
        return Measurement(
            seconds=seconds,
            work=float(pvs.work.sum()),
            error=int(wrong.sum()) / size,
            worst=float((wrong.sum(axis=1) / np.maximum(right, 1)).max(initial=0.0)),
            more={"missing": int(missing.sum()) / size},
        )

    settings = [
        Setting(f"--pvs sampled --pvs-lines {n}", {"method": "sampled", "lines": n}, "sampled",
                sound=False)
        for n in (10, 100, 1000)
    ]  # fmt: skip
    settings.append(Setting("--pvs fast", {"method": "fast"}))
    settings += [
        Setting(f"--pvs full --pvs-budget {n}", {"method": "full", "budget": n}, "budget")
        for n in sorted({*BUDGETS, budget})
    ]
    error = "ratio of wrong to right pairs of cells"
    return Experiment("operations", error, settings, measure)


#: Duration of the walk, s; link, and texture memory while the visitor moves.
DURATION, BANDWIDTH, MEMORY = 60.0, "512k", "10%"


def prepare_client(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`.

    Raises as `read_served` and `require_hints`.
    """
    served = read_served(subject.artifacts.db.path)
    require_hints(served, SimulateOptions(policy="paper").policies)
    walk = path_through(subject.artifacts, PathOptions(duration=DURATION)).walk
    return client_experiment(prepare(served, walk))


def client_experiment(world: World) -> Experiment:
    """The experiment on a walk."""
    options = SimulateOptions(policy="paper", bandwidth=BANDWIDTH, memory=MEMORY)

    def measure(setting: Setting) -> Measurement:
        paper = PaperOptions(**setting.knobs)
        (played,), seconds = time_work(lambda: play({"": world}, options, paper=paper))
        measures = played.measures
        return Measurement(
            seconds=seconds,
            work=float(measures.bytes),
            error=measures.e.mean,
            worst=measures.e.p95,
            more={"memory": float(played.run.memory.max())},
        )

    play({"": world.standing(1.0)}, options)  # compiles it
    settings = [
        Setting(f"--{name.replace('_', '-')} {value}", {name: value})
        for name, values in (
            ("delta_t", (0.1, 0.25, 0.5, 1.0, 2.0, 5.0)),
            ("delta_t_static", (1.0, 5.0, 80.0)),
            ("static_memory", ("5%", "40%", "inf")),
        )
        for value in values
    ]
    error = (
        f"e, of 255, of a walk of {world.track.time[-1]:.0f} s at {BANDWIDTH}bit/s, memory {MEMORY}"
    )
    units = {"work": "B", "memory": "B"}
    return Experiment("bytes received", error, settings, measure, by_work=True, units=units)
