"""What the knobs of the visibility buy.

The reference is the full search with a budget that hardly any portal exhausts. The error of a
setting is the share of its pairs of cells that are too many, or for sampled lines of those that are
missing, which is worse: a client that loads by such a set shows holes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.tradeoff.experiment import Measured, Setting, timed
from ptmtools.visibility.pvs import PvsOptions, compute_pvs

#: The budget of the reference, as many times that of the options.
AMPLE = 10


class VisibilityTrade:
    """The experiment of the stage ``pvs``."""

    stage = "pvs"
    work = "operations"
    error = "pairs too many, or missing"
    reference_error = 0.0

    def __init__(self, cells: Cells, options: PvsOptions) -> None:
        self._cells, self._options = cells, replace(options, workers=1)
        ample = replace(self._options, method="full", budget=AMPLE * max(options.budget, 1))
        self._truth = compute_pvs(cells, ample).to_matrix()
        compute_pvs(cells, replace(self._options, method="sampled", lines=1))  # now it is compiled

    def settings(self) -> Sequence[Setting]:
        """See `Experiment.settings`."""
        budget = self._options.budget
        return [
            *(
                Setting(
                    f"--pvs sampled --pvs-lines {n}",
                    {"method": "sampled", "lines": n},
                    "sampled",
                    sound=False,
                )
                for n in (10, 100, 1000)
            ),
            Setting("--pvs fast", {"method": "fast"}),
            *(
                Setting(f"--pvs full --pvs-budget {n}", {"method": "full", "budget": n}, "budget")
                for n in (budget // 1000, budget // 100, budget // 10, budget)
            ),
            Setting(
                f"--pvs full --pvs-budget {budget} --no-pvs-exact",
                {"method": "full", "exact": False},
            ),
        ]

    def measure(self, setting: Setting) -> Measured:
        """See `Experiment.measure`."""
        options = replace(self._options, **setting.knobs)
        pvs, seconds = timed(lambda: compute_pvs(self._cells, options))
        found = pvs.to_matrix()
        extra, missing = found & ~self._truth, self._truth & ~found
        size = max(int(self._truth.sum()), 1)
        each = (extra | missing).sum(axis=1) / np.maximum(self._truth.sum(axis=1), 1)
        return Measured(
            seconds=seconds,
            work=float(pvs.work.sum()),
            error=int((extra | missing).sum()) / size,
            worst=float(each.max(initial=0.0)),
            more={"missing": int(missing.sum()) / size},
        )
