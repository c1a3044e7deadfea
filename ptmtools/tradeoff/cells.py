"""What the knobs of the subdivision buy.

There is no right subdivision to compare with; what matters is that a client needs little of the
building in memory. The error of a setting is the share of the building's volume that is potentially
visible from a viewer's cell, on average over all places where the viewer may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.pipeline.stages import APO, CELLS
from ptmtools.scene.model import Scene
from ptmtools.tradeoff.experiment import Measured, Setting, timed
from ptmtools.tradeoff.experiments import Subject
from ptmtools.visibility.options import PvsOptions
from ptmtools.visibility.pvs import compute_pvs

#: Leaves of a subdivision that is only there to have everything compiled.
WARM = 4


def prepare(subject: Subject) -> CellsTrade:
    """See `EXPERIMENTS`."""
    return CellsTrade(subject.artifacts[APO], subject.options(CELLS))


class CellsTrade:
    """The experiment of the subdivision."""

    work = "leaves"
    error = "share of the building that a viewer may see"
    reference_error = 0.0

    def __init__(self, scene: Scene, options: SubdivideOptions) -> None:
        self._scene, self._options = scene, options
        few = subdivide(scene, replace(options, max_leaves=WARM))
        compute_pvs(few, PvsOptions(method="fast"))  # now both are compiled

    def settings(self) -> Sequence[Setting]:
        """See `Experiment.settings`."""
        area = self._options.wall_area
        return [
            Setting(
                f"--cells {kind} --wall-area {area * factor:g}",
                {"cells": kind, "wall_area": area * factor},
                kind,
            )
            for kind in ("room", "leaf")
            for factor in (4, 2, 1, 0.5)
        ]

    def measure(self, setting: Setting) -> Measured:
        """See `Experiment.measure`."""
        options = replace(self._options, **setting.knobs)
        cells, seconds = timed(lambda: subdivide(self._scene, options))
        mean, worst = compute_pvs(cells, PvsOptions(method="fast")).volume_at_hand
        return Measured(
            seconds=seconds,
            work=float(cells.leaf_count),
            error=mean,
            worst=worst,
            more={"cells": float(cells.cell_count), "portals": float(cells.portal_count)},
        )
