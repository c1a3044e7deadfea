"""What the budget and the exact arithmetic of the portal flow cost and bring.

    python benchmarks/budget.py MODEL... [--wall-area 2] [--budgets 0 2000 20000 200000 1000000]

For every model, by leaves: the average share of all leaves that a leaf may see, CPU seconds, and
portals cut short, for each budget without exact arithmetic; then for the default budget with it:
sequences of portals rejected by a hair, those decided exactly, those found open, portals cut short,
the pairs of leaves that are seen because of them, CPU seconds. Two Markdown tables.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.scene import ingest
from ptmtools.visibility import Pvs, PvsOptions, compute_pvs

WARM_UP = Path(__file__).resolve().parent.parent / "sample_data/two_rooms/two_rooms.obj"
BUDGETS = (0, 2_000, 20_000, PvsOptions().budget, 1_000_000)


def timed(cells: Cells, budget: int, exact: bool) -> tuple[Pvs, float]:
    """The visible sets, and processor seconds."""
    begun = time.process_time()
    pvs = compute_pvs(cells, PvsOptions(budget=budget, exact=exact))
    return pvs, time.process_time() - begun


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--wall-area", type=float, default=SubdivideOptions().wall_area)
    parser.add_argument("--budgets", nargs="+", type=int, default=BUDGETS)
    given = parser.parse_args(arguments)

    options = SubdivideOptions(cells="leaf", wall_area=given.wall_area)
    compute_pvs(subdivide(ingest(WARM_UP)))
    heads = " | ".join(f"{budget:,}" for budget in given.budgets)
    print(f"| walls ≥ {given.wall_area:g} m² | leaves / portals | {heads} |")
    print("|" + "---|" * (2 + len(given.budgets)))
    exactly = []
    for model in given.models:
        cells = subdivide(ingest(model), options)
        shown = []
        for budget in given.budgets:
            pvs, seconds = timed(cells, budget, exact=False)
            shown.append(f"{pvs.average_share:.1%}, {seconds:.1f} s, {pvs.fallbacks:,} cut")
        size = f"{cells.leaf_count:,} / {cells.portal_count:,}"
        print(f"| {model.stem} | {size} | {' | '.join(shown)} |", flush=True)
        rounded, before = timed(cells, PvsOptions().budget, exact=False)
        pvs, seconds = timed(cells, PvsOptions().budget, exact=True)
        more = int(np.count_nonzero(pvs.to_matrix() & ~rounded.to_matrix())) // 2
        exactly.append(
            f"| {model.stem} | {int(pvs.ties.sum()):,} | {int(pvs.decided.sum()):,} "
            f"| {int(pvs.opened.sum()):,} | {rounded.fallbacks:,} → {pvs.fallbacks:,} "
            f"| {more:,} of {(len(pvs.cell) - cells.leaf_count) // 2:,} "
            f"| {before:.1f} → {seconds:.1f} |"
        )
    print(
        f"\n| walls ≥ {given.wall_area:g} m² | rejected by a hair | decided exactly | open ", end=""
    )
    print("| cut short | pairs seen by it | CPU s |\n|" + "---|" * 7)
    print("\n".join(exactly))
    return 0


if __name__ == "__main__":
    sys.exit(main())
