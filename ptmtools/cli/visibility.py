"""`ptm pvs --report`: what a PVS looks like, line by line."""

from __future__ import annotations

from ptmtools.cli.output import Voice, count
from ptmtools.visibility.report import PortalFacts, PvsReport

#: Leaks that are shown without ``-v``.
SHOWN_LEAKS = 5


def tell_pvs(voice: Voice, told: PvsReport) -> None:
    """The report as lines on stdout."""
    voice.say(
        f"{count(told.cells, 'cell')}, {count(told.portals, 'portal')}; a cell sees "
        f"{told.average:.1f} cells on average, itself included"
    )
    if not told.conservative:
        voice.say("sampled: what no random line showed is missing")
    voice.say(
        "cells seen, by share of the cells that see no more: "
        + ", ".join(f"{share:.0%} {sees:,}" for share, sees in told.sizes)
    )
    if told.costliest:
        voice.say(
            f"{told.operations:,} operations; {count(told.fallbacks, 'portal')} cut short by the "
            "budget"
        )
        voice.say(
            f"{count(told.ties, 'sequence')} of portals rejected by a hair (16 roundings); "
            f"{told.decided:,} mattered and were decided in exact arithmetic: {told.opened:,} open"
        )
        voice.say("the costliest portals:")
        for dear in told.costliest:
            cut = ", cut short" if dear.cut else ""
            voice.say(f"  {dear.operations:10,}  {_place(dear)}{cut}")
    if not told.leaks:
        voice.say("no leaks: no cell sees more than three times what most do")
        return
    voice.say("cells that see more than three times the median, and the smallest opening that")
    voice.say("shows them half of it (a gap that nobody meant?):")
    shown = len(told.leaks) if voice.verbose else SHOWN_LEAKS
    for leak in told.leaks[:shown]:
        voice.say(
            f"  cell {leak.cell} sees {leak.sees:,}; {leak.through:,} of them by {_place(leak)}"
        )
    if len(told.leaks) > shown:
        voice.say(f"  … and {len(told.leaks) - shown} more; -v shows them")


def _place(one: PortalFacts) -> str:
    between = " and ".join(str(cell) for cell in one.cells)
    at = ",".join(f"{c:.2f}" for c in one.centre)
    return f"portal {one.portal} between cells {between}, {one.area:.3g} m² at {at}"
