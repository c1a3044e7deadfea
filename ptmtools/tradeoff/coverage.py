"""What the knobs of the coverage hints buy (see `experiment`).

The error of a setting is the total variation between its hints of a cell and those of a reference:
more points than any setting, of an independent scramble, with rays. Some cells stand for all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.backends.choice import choose
from ptmtools.coverage.item_buffer import VIEWS
from ptmtools.coverage.options import MAX_SAMPLES, PRESETS, AchOptions
from ptmtools.coverage.sampling import CellHints, Sampler
from ptmtools.pipeline.stages import ACH, APO, CELLS, PVS
from ptmtools.scene.model import Scene
from ptmtools.tradeoff.experiment import Measured, Setting, timed
from ptmtools.tradeoff.experiments import Subject
from ptmtools.visibility.model import Pvs

#: The seed of the reference, but for a user who takes the same.
REFERENCE_SEED = 2**31 - 1
#: Its pixels a side: as good as more, since every point shifts them.
REFERENCE_FACE = 4
#: Points and pixels a side of other settings than the presets.
GRID = (
    ("sobol", (32, 128, 512, 2048), 2),
    ("sobol", (8, 16, 64, 128, 256, 1024), 4),
    ("sobol", (8, 32, 128, 512), 8),
    ("sobol", (8, 32, 128), 16),
    ("sobol", (8, 32), 64),
    ("kd", (8, 16, 32), 8),
    ("uniform", (8, 32, 128, 512), 8),
)


def prepare(subject: Subject) -> CoverageTrade:
    """See `EXPERIMENTS`. Of the options what settings choose is left open."""
    options = replace(subject.options(ACH), samples=None, face=None, placement=None, tolerance=None)
    made = subject.artifacts
    tried, points = subject.cells_tried, subject.reference_points
    return CoverageTrade(made[APO], made[CELLS], made[PVS], options, tried, points)


class CoverageTrade:
    """The experiment of the coverage hints."""

    work = "rays per cell"
    error = "total variation of a cell's hints"

    def __init__(
        self,
        scene: Scene,
        cells: Cells,
        pvs: Pvs,
        options: AchOptions = AchOptions(),  # noqa: B008 - a frozen value
        cells_tried: int = 16,
        reference_points: int = MAX_SAMPLES,
    ) -> None:
        """``options``: what settings leave open, such as the backend and the weighting. `tried` are
        the cells that stand for all, evenly spread; `truth` their hints by the reference, by cell.
        """
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
        found, _, _ = self.hints(reference)
        self.truth = {cell: hints.row.value for cell, hints in found.items()}
        # Bounds of its error; its standard error is about half of that. Cells with too few usable
        # points have none.
        bounds = np.array([hints.row.uncertain for hints in found.values()], dtype=np.float64)
        bounds = bounds[np.isfinite(bounds)]
        self.reference_error = float(bounds.mean()) / 2 if len(bounds) else 0.0

    def settings(self) -> Sequence[Setting]:
        """See `Experiment.settings`; those of fewer points than the reference."""
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

    def measure(self, setting: Setting) -> Measured:
        """See `Experiment.measure`."""
        options = replace(self._options, **setting.knobs)
        found, seconds, backend = self.hints(options)
        errors = self.errors(found)
        points = np.array([hints.samples for hints in found.values()])
        missed = np.array([hints.missed for hints in found.values()])
        many = max(len(found), 1)
        return Measured(
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

    def errors(self, found: Mapping[int, CellHints]) -> NDArray[np.float64]:
        """(n,) total variation between hints of n of the cells tried, by cell, and the reference.

        Raises KeyError for a cell that was not tried.
        """
        pairs = ((hints.row.value, self.truth[cell]) for cell, hints in found.items())
        return np.array([np.abs(value - truth).sum() / 2 for value, truth in pairs])

    def hints(
        self, options: AchOptions, cells: Sequence[int] | None = None
    ) -> tuple[dict[int, CellHints], float, str]:
        """The hints of some of the cells tried, by cell, or of all of them; processor seconds for
        all cells of the scene; and the backend."""
        asked = [int(cell) for cell in (self.tried if cells is None else cells)]
        backend = choose(self._cells, self._pvs, options)

        def ready() -> Sampler:
            return Sampler(self._scene, self._cells, self._pvs, options, backend)

        ready().renderer.close()  # what is loaded but once is no part of the cost
        sampler, before = timed(ready)
        try:
            if asked:
                sampler.of_cell(asked[0])
            found, seconds = timed(lambda: {cell: sampler.of_cell(cell) for cell in asked})
            seconds *= self._cells.cell_count / max(len(asked), 1)
            return found, before + seconds, backend.name
        finally:
            sampler.renderer.close()
