"""A measure over time, a panel for each link and memory; needs matplotlib (extra ``plot``)."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.lazy import component
from ptmtools.walkthrough.comparing import Played
from ptmtools.walkthrough.report import link_text
from ptmtools.walkthrough.simulation import Run

#: What may be drawn: how the axis is called, and the values of a run.
MEASURES: dict[str, tuple[str, Callable[[Run], Floats]]] = {
    "e": ("e, mean error of the pixels (0 to 255)", lambda run: run.error),
    "rmse": ("root mean square error (0 to 255)", lambda run: np.sqrt(run.square)),
    "missing": ("share of the wanted levels that is missing", lambda run: run.missing),
    "quality": ("quality: levels there over levels existing", lambda run: run.quality),
}
COLORS = ("#1b6ca8", "#d1603d", "#5a9367", "#8d6a9f", "#b08d2e", "#5b6770", "#c2437a", "#2f8f8b")


def require() -> None:
    """Raises `MissingComponentError` PTM-M701 without matplotlib."""
    component("matplotlib.figure", "PTM-M701", "matplotlib is missing", "plot")


def picture(played: Sequence[Played], measure: str = "e") -> bytes:
    """A PNG of one of `MEASURES`, on the first walk; what the viewpoint stands through is shaded.

    Raises `MissingComponentError` PTM-M701 without matplotlib.
    """
    require()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    label, values = MEASURES[measure]
    first = [p for p in played if p.walk == played[0].walk]
    blocks = [list(some) for _, some in groupby(first, lambda p: (p.run.conditions, p.memory))]
    figure = Figure(figsize=(9, 3 * len(blocks)), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for number, block in enumerate(blocks):
        axes = figure.add_subplot(len(blocks), 1, number + 1)
        _draw(axes, block, values)
        title = f"{link_text(block[0].run.conditions)}; texture memory {block[0].memory}"
        axes.set(title=title, xlabel="s", ylabel=label)
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()


def _draw(axes: Any, block: list[Played], values: Callable[[Run], Floats]) -> None:
    run = block[0].run
    axes.fill_between(
        run.time, 0, 1, where=run.still, step="mid", color="#f2f2f2", linewidth=0,
        transform=axes.get_xaxis_transform(),
    )  # fmt: skip
    for k, one in enumerate(block):
        style = {"color": COLORS[k % len(COLORS)], "label": one.run.policy}
        axes.plot(one.run.time, values(one.run), linewidth=1, **style)
    # What comes before anything is there would dwarf the rest.
    drawn = [values(one.run) for one in block]
    most = max((float(np.percentile(v, 98)) for v in drawn if np.isfinite(v).all()), default=0.0)
    axes.set_ylim(0, 1.1 * most if most > 0 else 1)
    axes.set_xlim(0, run.time[-1] or 1)
    axes.grid(True, color="#e5e5e5", linewidth=0.5)
    axes.legend(fontsize=7, loc="upper right")
