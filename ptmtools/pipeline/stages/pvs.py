"""The stage of potentially visible sets (paper §3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ptmtools.diagnostics import Warned
from ptmtools.lazy import Lazy
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.visibility.options import PvsOptions

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells
    from ptmtools.visibility.model import Pvs

#: Mean share of the building's volume that stays resident above which culling does not pay.
CULLING_GAINS_LITTLE = 0.7


def _counts(pvs: Pvs) -> Mapping[str, Any]:
    mean, most = pvs.volume_at_hand
    return {
        "average_share": pvs.average_share,
        "mean_volume": mean,
        "most_volume": most,
        "fallbacks": pvs.fallbacks,
        "ties": int(pvs.ties.sum()),
        "decided": int(pvs.decided.sum()),
        "opened": int(pvs.opened.sum()),
        "leaks": len(pvs.leak),
        "conservative": pvs.conservative,
        "spared": pvs.spared,
    }


def _notes(pvs: Pvs, _: PvsOptions) -> Iterator[str]:
    share = pvs.volume_at_hand[0]
    # The cells stage warns about a single cell.
    if share > CULLING_GAINS_LITTLE and pvs.cell_count > 1:
        yield Warned(
            f"visibility culling saves little here: a client keeps {share:.0%} of the volume in "
            "memory on average, about as much as in a single hall"
        )
    if not pvs.conservative:
        yield Warned(
            "the visible sets are incomplete (--pvs sampled), so clients will show holes; build "
            "with `--pvs full` or `--pvs fast` before you publish"
        )
    if pvs.spared:
        yield (
            "no searches: they could reduce what a client keeps in memory by at most "
            f"{pvs.spared:.1%} (--pvs-gain)"
        )
    if pvs.fallbacks:
        yield (
            f"the search reached its budget at {pvs.fallbacks:,} portals; their sets are larger "
            "than necessary, never smaller (--pvs-budget)"
        )


def _fits_cells(pvs: Pvs, cells: Cells) -> str:
    return "" if pvs.cell_count == cells.cell_count else "the sets belong to other cells"


PVS: Stage[Pvs] = Stage(
    name="pvs",
    about="Compute which cells can see each other.",
    recipe=7,
    changed="searches that could save visitors next to nothing are left out (--pvs-gain)",
    options=PvsOptions,
    reads=(CELLS,),
    artifact=Lazy("ptmtools.visibility.model:Pvs"),
    compute=Lazy("ptmtools.visibility:compute_pvs"),
    counts=_counts,
    notes=_notes,
    summary=lambda n: (
        f"a client keeps {n['mean_volume']:.1%} of the volume in memory on average, "
        f"{n['most_volume']:.1%} at most"
    ),
    fits={CELLS: _fits_cells},
)
