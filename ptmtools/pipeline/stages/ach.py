"""The stage of average coverage hints (paper §5)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ptmtools.coverage.options import AchOptions
from ptmtools.lazy import Lazy
from ptmtools.pipeline.stage import Counts, Stage
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.quantities import count

if TYPE_CHECKING:
    from ptmtools.coverage.model import Ach


class AchStage(Stage["Ach"]):
    """See `ptmtools.coverage.compute_ach`."""

    name = "ach"
    about = "Measure how much of the view each visible cell covers."
    recipe = 4
    changed = "a building of one closed surface no longer counts as a solid"
    options = AchOptions
    reads = (SCENE, CELLS, PVS)
    artifact = Lazy("ptmtools.coverage.model:Ach")

    def compute(self, *args: Any) -> Ach:
        from ptmtools.coverage.ach import compute_ach

        return compute_ach(*args)

    def counts(self, ach: Ach) -> Counts:
        known = ach.uncertain[ach.uncertain == ach.uncertain]  # without NaN
        known = known[known < float("inf")]
        return {
            "backend": ach.backend,
            "renderer": ach.renderer,
            "samples": int(ach.samples.sum()),
            "rejected": int(ach.rejected.sum()),
            "most_missed": float(ach.missed.max(initial=0.0)),
            "mean_uncertain": float(known.mean()) if len(known) else None,
        }

    def notes(self, ach: Ach, options: AchOptions) -> Iterator[str]:
        if blind := int(((ach.samples == 0) & (ach.rejected > 0)).sum()):
            yield f"no sample point was found in {blind:,} cells"
        if options.tolerance is not None:
            short = int((~(ach.uncertain <= options.tolerance)).sum())
            if short:
                yield (
                    f"{short:,} cells did not reach the tolerance of {options.tolerance:g} "
                    f"with {options.points:,} sample points (`--samples`); their `uncertain` is "
                    "the remaining error"
                )

    def summary(self, n: Counts) -> str:
        return f"{count(n['samples'], 'sample point')}; backend {n['backend']} ({n['renderer']})"

    def misfit(self, ach: Ach, source: Stage[Any], contents: Any) -> str:
        if source is PVS:
            same = len(contents.start) == len(ach.start) and (contents.start == ach.start).all()
            return "" if same else "the hints belong to other sets"
        foreign = source is SCENE and (ach.texture >= len(contents.images)).any()
        return "a share refers to no image" if foreign else ""


ACH = AchStage()
