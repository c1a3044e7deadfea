"""`ptm pvs --report`: what a PVS looks like, line by line."""

from __future__ import annotations

from ptmtools.cli.output import Voice, count
from ptmtools.visibility.report import PortalFacts, PvsReport

#: Leaks that are shown without ``-v``.
SHOWN_LEAKS = 5


def tell_pvs(voice: Voice, told: PvsReport) -> None:
    """The report as lines on stdout."""
    voice.say(
        f"{count(told.cells, 'cell')}; {count(told.portals, 'portal')}, {told.doors:,} of them "
        f"between cells; a cell sees {told.average:.1f} cells on average, itself included"
    )
    if not told.conservative:
        voice.say("sampled: what no random line showed is missing")
    if told.cells > 1:
        voice.say("cells seen: " + ", ".join(_share(*size) for size in told.sizes))
    if told.costliest:
        cut = f"; {count(told.fallbacks, 'portal')} cut short" if told.fallbacks else ""
        voice.say(f"{told.operations:,} operations{cut}")
        if told.ties:
            exactly = (
                f"{told.decided:,} that may matter decided in exact arithmetic: "
                f"{told.decided - told.opened:,} closed, {told.opened:,} open"
            )
            voice.say(
                f"{count(told.ties, 'near-tie')}, " + (exactly if told.decided else "none matters")
            )
        voice.say("the costliest portals:")
        for dear in told.costliest:
            cut = ", cut short" if dear.cut else ""
            voice.say(f"  {dear.operations:10,}  {_place(dear)}{cut}")
    if not told.leaks:
        if told.cells > 1:
            voice.say("no leaks: no one opening shows a cell suspiciously much")
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
