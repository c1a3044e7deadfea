"""Error against cost, a panel for every stage; needs matplotlib (extra ``plot``)."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from ptmtools.lazy import component
from ptmtools.tradeoff.experiment import Trade

COLORS = ("#1b6ca8", "#d1603d", "#5a9367", "#8d6a9f", "#b08d2e", "#5b6770", "#c2437a", "#2f8f8b")


def require() -> None:
    """Raises `MissingComponentError` PTM-M600 without matplotlib."""
    component("matplotlib.figure", "PTM-M600", "matplotlib is missing", "plot")


def picture(trades: Sequence[Trade]) -> bytes:
    """A PNG: every trial, families joined, settings that no other beats named.

    Raises `MissingComponentError` PTM-M600 without matplotlib.
    """
    require()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5 * max(len(trades), 1)), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for i, trade in enumerate(trades):
        axes = figure.add_subplot(len(trades), 1, i + 1)
        _draw(axes, trade)
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()


def _draw(axes: Any, trade: Trade) -> None:
    families = list(dict.fromkeys(t.setting.family for t in trade.trials))
    least = min((t.measured.error for t in trade.trials if t.measured.error > 0), default=1.0)
    for number, family in enumerate(families):
        members = [t for t in trade.trials if t.setting.family == family]
        members.sort(key=lambda t: t.measured.work)
        x = [t.measured.seconds for t in members]
        y = [max(t.measured.error, least / 3) for t in members]
        rate = f", error ∝ work^{trade.rates[family]:.2f}" if family in trade.rates else ""
        style = {"color": COLORS[number % len(COLORS)], "label": (family or "others") + rate}
        axes.plot(x, y, "o-" if family else "D", markersize=4, linewidth=1, **style)
    for t in trade.trials:
        if t.best:
            at = (t.measured.seconds, max(t.measured.error, least / 3))
            name = t.setting.name.replace("--", "")
            axes.annotate(name, at, (4, 4), textcoords="offset points", fontsize=6)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="CPU seconds of one core, whole database",
        ylabel=trade.error,
        title=trade.stage,
    )
    if trade.reference_error:
        axes.axhline(trade.reference_error, color="#999", linestyle=":", linewidth=1)
    axes.grid(True, which="both", color="#eee")
    axes.legend(fontsize=7)
