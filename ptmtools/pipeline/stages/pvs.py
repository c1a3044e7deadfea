"""The stage of potentially visible sets (paper §3)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from ptmtools.diagnostics import Warned
from ptmtools.lazy import Lazy
from ptmtools.pipeline.stage import Counts, Stage
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.visibility.options import PvsOptions

if TYPE_CHECKING:
    from ptmtools.pipeline.artifacts import Artifacts
    from ptmtools.visibility.model import Pvs

#: Mean share of the building's volume that stays resident above which culling does not pay.
CULLING_GAINS_LITTLE = 0.7


class PvsStage(Stage["Pvs"]):
    """See `ptmtools.visibility.compute_pvs`."""

    name = "pvs"
    about = "Compute which cells can see each other."
    recipe = 7
    changed = "searches that could save visitors next to nothing are left out (--pvs-gain)"
    options = PvsOptions
    reads = (CELLS,)
    artifact = Lazy("ptmtools.visibility.model:Pvs")
    details_about = (
        "Print the sizes of the sets, the most expensive portals, and openings through which an "
        "unusually large part of the building is visible."
    )

    def compute(self, *args: Any) -> Pvs:
        from ptmtools.visibility import compute_pvs

        return compute_pvs(*args)

    def counts(self, pvs: Pvs) -> Counts:
        mean, largest = pvs.volume_at_hand
        return {
            "average_share": pvs.average_share,
            "mean_volume": mean,
            "most_volume": largest,
            "fallbacks": pvs.fallbacks,
            "ties": int(pvs.ties.sum()),
            "decided": int(pvs.decided.sum()),
            "opened": int(pvs.opened.sum()),
            "leaks": len(pvs.leak),
            "conservative": pvs.conservative,
            "spared": pvs.spared,
        }

    def notes(self, pvs: Pvs, options: PvsOptions) -> Iterator[str]:
        share = pvs.volume_at_hand[0]
        # The cells stage warns about a single cell.
        if share > CULLING_GAINS_LITTLE and pvs.cell_count > 1:
            yield Warned(
                f"visibility culling saves little here: a client keeps {share:.0%} of the volume "
                "in memory on average, about as much as in a single hall"
            )
        if not pvs.conservative:
            yield Warned(
                "the visible sets are incomplete (--pvs sampled), so clients will show holes; "
                "build with `--pvs full` or `--pvs fast` before you publish"
            )
        if pvs.spared:
            yield (
                "no searches: they could reduce what a client keeps in memory by at most "
                f"{pvs.spared:.1%} (--pvs-gain)"
            )
        if pvs.fallbacks:
            yield (
                f"the search reached its budget at {pvs.fallbacks:,} portals; their sets are "
                "larger than necessary, never smaller (--pvs-budget)"
            )

    def summary(self, n: Counts) -> str:
        return (
            f"a client keeps {n['mean_volume']:.1%} of the volume in memory on average, "
            f"{n['most_volume']:.1%} at most"
        )

    def misfit(self, pvs: Pvs, source: Stage[Any], contents: Any) -> str:
        foreign = source is CELLS and pvs.cell_count != contents.cell_count
        return "the sets belong to other cells" if foreign else ""

    def details(self, artifacts: Artifacts, *, verbose: bool) -> tuple[Any, Iterable[str]]:
        from ptmtools.visibility.report import report, report_lines

        details = report(artifacts[CELLS], artifacts[self])
        return details, report_lines(details, verbose=verbose)


PVS = PvsStage()
