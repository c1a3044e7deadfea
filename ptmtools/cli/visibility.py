"""`ptm pvs --report`: a summary of the potentially visible sets, line by line."""

from __future__ import annotations

from ptmtools.cli.output import Voice, count
from ptmtools.visibility.report import PortalFacts, PvsReport

#: Leaks that are shown without ``-v``.
SHOWN_LEAKS = 5


def tell_pvs(voice: Voice, report: PvsReport) -> None:
    """The report as lines on stdout."""
    voice.say(
        f"{count(report.cells, 'cell')}, {count(report.portals, 'portal')} (openings), "
        f"{report.doors:,} of them between cells; a cell sees {report.average:.1f} cells on "
        "average, itself included"
    )
    if not report.conservative:
        voice.say("sampled: cells that no random line reached are missing")
    if report.cells > 1:
        voice.say("cells visible from a cell: " + ", ".join(_share(*size) for size in report.sizes))
    if report.costliest:
        cut = f"; budget spent at {count(report.fallbacks, 'portal')}" if report.fallbacks else ""
        voice.say(f"{report.operations:,} operations{cut}")
        if report.ties:
            voice.say(_near_ties(report))
        voice.say("portals that took most operations:")
        for portal in report.costliest:
            cut = ", budget spent" if portal.cut else ""
            voice.say(f"  {portal.operations:10,}  {_place(portal)}{cut}")
    if not report.leaks:
        if report.cells > 1:
            voice.say("no leaks: no cell sees suspiciously much through a single opening")
        return
    voice.say("cells that see more than three times the median, each with the smallest opening")
    voice.say("through which it sees at least half of that (an unintended gap?):")
    shown = len(report.leaks) if voice.verbose else SHOWN_LEAKS
    for leak in report.leaks[:shown]:
        voice.say(
            f"  cell {leak.cell} sees {leak.sees:,} cells, {leak.through:,} of them through "
            f"{_place(leak)}"
        )
    if len(report.leaks) > shown:
        voice.say(f"  … and {len(report.leaks) - shown} more; -v shows them")


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
