"""What the knobs of the subdivision buy.

There is no right subdivision to compare with: what is to be wished is that little of the building
has to be at hand. The error of a setting is the share of the volume that a viewer anywhere may see,
weighted by the volume of where he stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.scene.model import Scene
from ptmtools.tradeoff.experiment import Measured, Setting, timed
from ptmtools.visibility.options import PvsOptions
from ptmtools.visibility.pvs import compute_pvs

#: Leaves of a subdivision that is only there to have everything compiled.
WARM = 4


class CellsTrade:
    """The experiment of the stage ``cells``."""

    stage = "cells"
    work = "leaves"
    error = "volume at hand"
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
        seen = compute_pvs(cells, PvsOptions(method="fast")).to_matrix()
        volume = np.bincount(cells.leaf_cell, cells.leaf_volumes(), cells.cell_count)
        share = seen @ volume / max(float(volume.sum()), np.finfo(float).tiny)
        return Measured(
            seconds=seconds,
            work=float(cells.leaf_count),
            error=float(np.average(share, weights=volume)) if volume.sum() else 0.0,
            worst=float(share.max(initial=0.0)),
            more={"cells": float(cells.cell_count), "portals": float(cells.portal_count)},
        )
