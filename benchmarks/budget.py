"""Cost and gain of the budget of the portal flow and of the decision of near ties.

    python benchmarks/budget.py MODEL... [--wall-area 2] [--budgets 0 2000 20000 200000 1000000]

Prints two Markdown tables with a row for each model. The first gives, for each budget, the mean
share of visible leaves per leaf, CPU seconds, and portals cut short. The second, for the default
budget, gives near ties, near ties decided in double-double, and near ties decided as open; then
leaf pairs, pairs of default cells and CPU seconds if near ties are decided, if all count as
visible, and if all count as hidden (which is not conservative).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from unittest.mock import patch

import numpy as np
from scenes import TWO_ROOMS, model_file

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.cells.rooms import group_cells, leaf_of_cell
from ptmtools.portal_flow.double_double import SearchCost
from ptmtools.scene import ingest
from ptmtools.visibility import Pvs, PvsOptions, compute_pvs

BUDGETS = (0, 2_000, 20_000, PvsOptions().budget, 1_000_000)


def all_count_as(visible: bool) -> Callable[..., SearchCost]:
    """A search that takes every near tie for visible, or for hidden."""

    def searched(g, s, test, known, source, budget, seen) -> SearchCost:  # type: ignore[no-untyped-def]
        from ptmtools.portal_flow.flow_kernels import flow

        none = np.zeros(0, np.uint64)
        work, cut, ties, _ = flow(g, s, known, source, budget, none, visible, seen)
        return SearchCost(cut, work, ties, 0, 0)

    return searched


def timed(cells: Cells, budget: int = PvsOptions().budget) -> tuple[Pvs, float]:
    """The visible sets, and processor seconds."""
    begun = time.process_time()
    pvs = compute_pvs(cells, PvsOptions(budget=budget))
    return pvs, time.process_time() - begun


def pairs(pvs: Pvs, room: np.ndarray) -> str:
    """Pairs of leaves that see each other, and pairs of the cells that they make up."""
    one, other = np.nonzero(np.triu(pvs.to_matrix(), 1))
    ends = np.sort(room[np.stack([one, other], axis=1)], axis=1)
    between = np.unique(ends[ends[:, 0] != ends[:, 1]], axis=0)
    return f"{len(one):,}, {len(between):,}"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("models", nargs="+", type=model_file)
    parser.add_argument("--wall-area", type=float, default=SubdivideOptions().wall_area)
    parser.add_argument("--budgets", nargs="*", type=int, default=BUDGETS)
    given = parser.parse_args(arguments)

    options = SubdivideOptions(cells="leaf", wall_area=given.wall_area)
    compute_pvs(subdivide(ingest(TWO_ROOMS)))
    ties = []
    head = f"walls ≥ {given.wall_area:g} m²"
    columns = "".join(f" {budget:,} |" for budget in given.budgets)
    print(f"| {head} | leaves / portals |{columns}\n|{'---|' * (2 + len(given.budgets))}")
    for model in given.models:
        scene = ingest(model)
        cells = subdivide(scene, options)
        shown = []
        for budget in given.budgets:
            pvs, seconds = timed(cells, budget)
            shown.append(f" {pvs.average_share:.1%}, {seconds:.1f} s, {pvs.fallbacks:,} cut |")
        size = f"{cells.leaf_count:,} / {cells.portal_count:,}"
        print(f"| {model.stem} | {size} |{''.join(shown)}", flush=True)
        rooms = group_cells(cells, SubdivideOptions(wall_area=given.wall_area))
        room = rooms.leaf_cell[leaf_of_cell(cells)]
        pvs, seconds = timed(cells)
        row = [f"{int(n.sum()):,}" for n in (pvs.ties, pvs.decided, pvs.opened)]
        row.append(f"{pairs(pvs, room)}, {seconds:.1f} s")
        for visible in (True, False):
            with patch("ptmtools.portal_flow.flow.search", all_count_as(visible)):
                pvs, seconds = timed(cells)
            row.append(f"{pairs(pvs, room)}, {seconds:.1f} s")
        ties.append(f"| {model.stem} | {' | '.join(row)} |")
    print(f"\n| {head} | near ties | decided | open | decided | all visible | all hidden |")
    print(f"|{'---|' * 7}")
    print("\n".join(ties))
    return 0


if __name__ == "__main__":
    sys.exit(main())
