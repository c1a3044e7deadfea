"""What the knobs of the coverage hints buy (see `experiment`).

The error of a setting is the total variation between its hints of a cell and those of a reference:
many more points, of an independent scramble, with rays. Some cells stand for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.backend import open_renderer
from ptmtools.coverage.item_buffer import Surfaces
from ptmtools.coverage.options import PRESETS, AchOptions
from ptmtools.coverage.sampling import CellHints, Sampler
from ptmtools.scene.model import Scene
from ptmtools.tradeoff.experiment import Measured, Setting, timed
from ptmtools.visibility.model import Pvs

#: The seed of the reference, which no user is likely to choose.
REFERENCE_SEED = 2**31 - 1
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


class CoverageTrade:
    """The experiment of the stage ``ach``."""

    stage = "ach"
    work = "rays a cell"
    error = "total variation"

    def __init__(
        self,
        scene: Scene,
        cells: Cells,
        pvs: Pvs,
        options: AchOptions = AchOptions(),  # noqa: B008 - a frozen value
        cells_tried: int = 24,
        reference_points: int = 4096,
    ) -> None:
        """``options``: what settings leave open, such as the backend and the weighting. `tried` are
        the cells that stand for all, evenly spread; `truth` their hints by the reference."""
        self._scene, self._cells, self._pvs, self._options = scene, cells, pvs, options
        self._surfaces = Surfaces.of(scene, cells)
        every = cells.cell_count
        self.tried = np.unique(np.linspace(0, every - 1, min(cells_tried, every)).astype(int))
        reference = replace(
            options,
            backend="embree",
            samples=reference_points,
            face=8,
            placement="sobol",
            seed=REFERENCE_SEED,
            tolerance=None,
        )
        found, _, _ = self.hints(reference)
        self.truth = [hints.row.value for hints in found]
        # A bound of its error; its standard error is about half of that.
        self.reference_error = float(np.mean([hints.row.uncertain for hints in found])) / 2

    def settings(self) -> Sequence[Setting]:
        """See `Experiment.settings`."""
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
        return [*presets, *grid]

    def measure(self, setting: Setting) -> Measured:
        """See `Experiment.measure`."""
        found, seconds, backend = self.hints(replace(self._options, **setting.knobs))
        errors = self.errors(found)
        return Measured(
            seconds=seconds,
            work=float(np.mean([hints.row.pixels.sum() for hints in found])),
            error=float(errors.mean()),
            worst=float(errors.max()),
            more={
                "p95": float(np.percentile(errors, 95)),
                "missed": float(np.mean([hints.missed for hints in found])),
                "gl": float(backend == "gl"),
            },
        )

    def errors(self, found: Sequence[CellHints]) -> NDArray[np.float64]:
        """(n,) total variation between hints of the cells tried and the reference."""
        pairs = zip(found, self.truth, strict=False)
        return np.array([np.abs(hints.row.value - truth).sum() / 2 for hints, truth in pairs])

    def hints(self, options: AchOptions) -> tuple[list[CellHints], float, str]:
        """The hints of the cells tried, processor seconds for all cells, and the backend."""
        renderer = open_renderer(self._surfaces, self._cells, self._pvs, options)
        renderer.close()  # what is loaded but once is no part of the cost

        def ready() -> Sampler:
            nonlocal renderer
            renderer = open_renderer(self._surfaces, self._cells, self._pvs, options)
            given = (self._scene, self._cells, self._pvs, options, self._surfaces, renderer)
            return Sampler(*given)

        sampler, before = timed(ready)
        try:
            if len(self.tried):
                sampler.of_cell(int(self.tried[0]))
            found, seconds = timed(lambda: [sampler.of_cell(int(cell)) for cell in self.tried])
            seconds *= self._cells.cell_count / max(len(self.tried), 1)
            return found, before + seconds, renderer.backend
        finally:
            renderer.close()
