"""`ptm pvs --report`: what a PVS looks like, line by line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stages import CELLS, PVS
from ptmtools.quantities import count
from ptmtools.visibility.report import PortalFacts, PvsReport, report

#: Leaks that are shown without ``-v``.
SHOWN_LEAKS = 5


def visibility_report(artifacts: Artifacts, verbose: bool) -> tuple[dict[str, Any], list[str]]:
    """What the sets of a database look like, as a document and as lines."""
    found = report(artifacts[CELLS], artifacts[PVS])
    return asdict(found), list(_lines(found, verbose))


def _lines(found: PvsReport, verbose: bool) -> Iterator[str]:
    yield (
        f"{count(found.cells, 'cell')}; {count(found.portals, 'portal')}, {found.doors:,} of them "
        f"between cells; a cell sees {found.average:.1f} cells on average, itself included"
    )
    if not found.conservative:
        yield "sampled: what no random line showed is missing"
    if found.cells > 1:
        yield "cells seen: " + ", ".join(_share(*size) for size in found.sizes)
    if found.costliest:
        cut = f"; {count(found.fallbacks, 'portal')} cut short" if found.fallbacks else ""
        yield f"{found.operations:,} operations{cut}"
        if found.ties:
            exactly = (
                f"{found.decided:,} that may matter decided in exact arithmetic: "
                f"{found.decided - found.opened:,} closed, {found.opened:,} open"
            )
            yield (
                f"{count(found.ties, 'near-tie')}, "
                + (exactly if found.decided else "none matters")
            )
        yield "the costliest portals:"
        for dear in found.costliest:
            cut = ", cut short" if dear.cut else ""
            yield f"  {dear.operations:10,}  {_place(dear)}{cut}"
    if not found.leaks:
        if found.cells > 1:
            yield "no leaks: no one opening shows a cell suspiciously much"
        return
    yield "cells that see more than three times the median, and the smallest opening that"
    yield "shows them half of it (a gap that nobody meant?):"
    shown = len(found.leaks) if verbose else SHOWN_LEAKS
    for leak in found.leaks[:shown]:
        yield (f"  cell {leak.cell} sees {leak.sees:,}; {leak.through:,} of them by {_place(leak)}")
    if len(found.leaks) > shown:
        yield f"  … and {len(found.leaks) - shown} more; -v shows them"


def _share(share: float, sees: int) -> str:
    """How many cells this share of the cells see at most."""
    match share:
        case 0.0:
            return f"least {sees:,}"
        case 0.5:
            return f"median {sees:,}"
        case 1.0:
            return f"most {sees:,}"
    return f"{share:.0%} ≤ {sees:,}"


def _place(one: PortalFacts) -> str:
    a, b = one.cells
    where = f"between cells {a} and {b}" if a != b else f"inside cell {a}"
    at = ",".join(f"{c:.2f}" for c in one.centre)
    return f"portal {one.portal} {where}, {one.area:.3g} m² at {at}"
