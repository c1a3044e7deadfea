"""The experiments, as a table under the names of their stages.

To add one: a module with an `Experiment` and a function that prepares it, and a line here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ptmtools.lazy import Lazy
from ptmtools.pipeline.stages import ACH, CELLS, PVS, TEXTURES

if TYPE_CHECKING:
    from ptmtools.pipeline.run import Artifacts
    from ptmtools.pipeline.stage import Stage
    from ptmtools.tradeoff.experiment import Experiment


@dataclass(frozen=True)
class Subject:
    """What experiments are made on: a database, and how much effort to spend.

    Attributes
    ----------
    artifacts: those of the database.
    cells_tried, reference_points: as in `CoverageTrade`.
    """

    artifacts: Artifacts
    cells_tried: int
    reference_points: int

    def options(self, stage: Stage[Any]) -> Any:
        """The options of a stage's last run, or its defaults."""
        run = self.artifacts.before(stage)
        return self.artifacts.recorded(stage) if run else stage.options()


#: Stage → the function that prepares its experiment, in the order of the stages.
EXPERIMENTS: dict[str, Lazy[Callable[[Subject], Experiment]]] = {
    CELLS.name: Lazy("ptmtools.tradeoff.cells:prepare"),
    PVS.name: Lazy("ptmtools.tradeoff.visibility:prepare"),
    ACH.name: Lazy("ptmtools.tradeoff.coverage:prepare"),
    TEXTURES.name: Lazy("ptmtools.tradeoff.textures:prepare"),
}
