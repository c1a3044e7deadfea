"""`ptm pvs --report`: a summary of the potentially visible sets, line by line."""

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
    """A summary of the sets of a database, as a document and as lines."""
    found = report(artifacts[CELLS], artifacts[PVS])
    return asdict(found), list(_lines(found, verbose))


def _lines(report: PvsReport, verbose: bool) -> Iterator[str]:
    yield (
        f"{count(report.cells, 'cell')}, {count(report.portals, 'portal')} (openings), "
        f"{report.doors:,} of them between cells; a cell sees {report.average:.1f} cells on "
        "average, itself included"
    )
    if not report.conservative:
        yield "sampled: cells that no random line reached are missing"
    if report.cells > 1:
        yield "cells visible from a cell: " + ", ".join(_share(*size) for size in report.sizes)
    if report.costliest:
        cut = f"; budget spent at {count(report.fallbacks, 'portal')}" if report.fallbacks else ""
        yield f"{report.operations:,} operations{cut}"
        if report.ties:
            yield _near_ties(report)
        yield "portals that took most operations:"
        for portal in report.costliest:
            cut = ", budget spent" if portal.cut else ""
            yield f"  {portal.operations:10,}  {_place(portal)}{cut}"
    if not report.leaks:
        if report.cells > 1:
            yield "no leaks: no cell sees suspiciously much through a single opening"
        return
    yield "cells that see more than three times the median, each with the smallest opening"
    yield "through which it sees at least half of that (an unintended gap?):"
    shown = len(report.leaks) if verbose else SHOWN_LEAKS
    for leak in report.leaks[:shown]:
        yield (
            f"  cell {leak.cell} sees {leak.sees:,} cells, {leak.through:,} of them through "
            f"{_place(leak)}"
        )
    if len(report.leaks) > shown:
        yield f"  … and {len(report.leaks) - shown} more; -v shows them"


def _near_ties(report: PvsReport) -> str:
    """What became of the lines of sight that doubles cannot decide."""
    ties = count(report.ties, "near tie") + " (lines of sight that graze an edge)"
    if not report.decided:
        return f"{ties}; the result does not depend on any"
    return (
        f"{ties}; {report.decided:,} could change the result and were checked in higher precision: "
        f"{report.decided - report.opened:,} blocked, {report.opened:,} visible"
    )


def _share(share: float, sees: int) -> str:
    """How many cells this share of the cells see at most."""
    match share:
        case 0.0:
            return f"least {sees:,}"
        case 0.5:
            return f"median {sees:,}"
        case 1.0:
            return f"most {sees:,}"
    return f"{share:.0%} of cells ≤ {sees:,}"


def _place(one: PortalFacts) -> str:
    a, b = one.cells
    where = f"between cells {a} and {b}" if a != b else f"inside cell {a}"
    at = ",".join(f"{c:.2f}" for c in one.centre)
    return f"portal {one.portal} {where}, {one.area:.3g} m² at {at}"
