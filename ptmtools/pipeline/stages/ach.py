"""The stage of average coverage hints (paper §5)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ptmtools.coverage.options import AchOptions
from ptmtools.lazy import Lazy
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.quantities import count

if TYPE_CHECKING:
    from ptmtools.coverage.model import Ach
    from ptmtools.scene.model import Scene
    from ptmtools.visibility.model import Pvs


def _counts(ach: Ach) -> Mapping[str, Any]:
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


def _notes(ach: Ach, options: AchOptions) -> Iterator[str]:
    if blind := int(((ach.samples == 0) & (ach.rejected > 0)).sum()):
        yield f"no sample point was found in {blind:,} cells"
    if options.tolerance is not None:
        short = int((~(ach.uncertain <= options.tolerance)).sum())
        if short:
            yield (
                f"{short:,} cells did not reach the tolerance of {options.tolerance:g} "
                f"with {options.points:,} sample points (`--samples`); their `uncertain` is the "
                "remaining error"
            )


def _fits_pvs(ach: Ach, pvs: Pvs) -> str:
    same = len(pvs.start) == len(ach.start) and (pvs.start == ach.start).all()
    return "" if same else "the hints belong to other sets"


def _fits_scene(ach: Ach, scene: Scene) -> str:
    return "a share refers to no image" if (ach.texture >= len(scene.images)).any() else ""


ACH: Stage[Ach] = Stage(
    name="ach",
    about="Measure how much of the view each visible cell covers.",
    recipe=3,
    options=AchOptions,
    reads=(SCENE, CELLS, PVS),
    artifact=Lazy("ptmtools.coverage.model:Ach"),
    compute=Lazy("ptmtools.coverage.ach:compute_ach"),
    counts=_counts,
    notes=_notes,
    summary=lambda n: (
        f"{count(n['samples'], 'sample point')}; backend {n['backend']} ({n['renderer']})"
    ),
    fits={PVS: _fits_pvs, SCENE: _fits_scene},
)
