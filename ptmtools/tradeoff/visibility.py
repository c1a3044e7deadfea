"""What the knobs of the visibility buy.

The reference is the full search with a budget that hardly any portal exhausts. The error of a
setting is its number of wrong pairs of cells over that of the right ones: pairs too many, or with
sampled lines also missing ones, which is worse: a client that loads by such a set shows holes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.pipeline.stages import CELLS, PVS
from ptmtools.tradeoff.experiment import Measured, Setting, timed
from ptmtools.tradeoff.experiments import Subject
from ptmtools.visibility.options import PvsOptions
from ptmtools.visibility.pvs import compute_pvs

#: The budget of the reference, which hardly any portal exhausts.
AMPLE = 2_000_000
#: Those that are tried, beside the one that the database was built with.
BUDGETS = (200, 2_000, 20_000, 200_000)
#: What settings do not say: near-ties decided exactly.
_BASE = PvsOptions(exact=True)


def prepare(subject: Subject) -> VisibilityTrade:
    """See `EXPERIMENTS`."""
    return VisibilityTrade(subject.artifacts[CELLS], subject.options(PVS))


class VisibilityTrade:
    """The experiment of the visibility."""

    work = "operations"
    error = "wrong pairs of cells, as a share of the right ones"
    reference_error = 0.0

    def __init__(self, cells: Cells, options: PvsOptions) -> None:
        """``options``: of them only the budget counts; the rest is what settings say."""
        self._cells, self._own = cells, options.budget
        ample = replace(_BASE, method="full", budget=max(AMPLE, options.budget))
        self._truth = compute_pvs(cells, ample).to_matrix()
        compute_pvs(cells, replace(_BASE, method="sampled", lines=1))  # now it is compiled

    def settings(self) -> Sequence[Setting]:
        """See `Experiment.settings`."""
        usual = BUDGETS[-1]
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
                for n in sorted({*BUDGETS, self._own})
            ),
            Setting(
                f"--pvs full --pvs-budget {usual} --no-pvs-exact",
                {"method": "full", "budget": usual, "exact": False},
            ),
        ]

    def measure(self, setting: Setting) -> Measured:
        """See `Experiment.measure`."""
        options = replace(_BASE, **setting.knobs)
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
