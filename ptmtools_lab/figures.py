"""Plots of a measure over time, pictures of the frames of a run, and the paper's Figure 3.

A plot has a panel for each link and memory, and needs matplotlib (extra ``plot``). Figure 3 shows
the picture of a standing viewer as data arrives.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.lazy import component
from ptmtools.rendering.light import as_bytes
from ptmtools_lab.comparing import RunResult
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.policies.paper import PaperOptions
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.report import link_text
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.world import World

#: Measures of a plot: label of the axis, and the values of a run.
MEASURES: dict[str, tuple[str, Callable[[WalkRun], Floats]]] = {
    "e": ("e, mean error of the pixels (0 to 255)", lambda run: run.error),
    "rmse": ("root mean square error (0 to 255)", lambda run: np.sqrt(run.square)),
    "missing": ("share of the wanted levels that is missing", lambda run: run.missing),
    "quality": ("quality: levels there over levels existing", lambda run: run.quality),
}
COLORS = ("#1b6ca8", "#d1603d", "#5a9367", "#8d6a9f", "#b08d2e", "#5b6770", "#c2437a", "#2f8f8b")


def require() -> None:
    """Raises `MissingComponentError` PTM-M100 without matplotlib."""
    component("matplotlib.figure", "PTM-M100", "matplotlib is missing", "plot")


def plot(
    size: tuple[float, float],
    drawings: Sequence[Callable[[Any], None]],
    form: Literal["png", "svg"] = "png",
) -> bytes:
    """A PNG or SVG of panels, one below the other, of this ``size`` in inches each; every drawing
    gets the axes of its panel.

    Raises `MissingComponentError` PTM-M100 without matplotlib.
    """
    require()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    many = len(drawings)
    figure = Figure(figsize=(size[0], size[1] * max(many, 1)), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for number, draw in enumerate(drawings):
        draw(figure.add_subplot(many, 1, number + 1))
    out = io.BytesIO()
    # The same figures give the same bytes.
    free = {"Software": None} if form == "png" else {"Date": None, "Creator": None}
    with matplotlib.rc_context({"svg.hashsalt": "ptmtools"}):
        figure.savefig(out, format=form, metadata=free)
    return out.getvalue()


def picture(played: Sequence[RunResult], measure: str = "e") -> bytes:
    """A PNG of one of `MEASURES`, on the first walk; times with a still viewpoint are shaded."""
    first_walk = [p for p in played if p.walk == played[0].walk]
    blocks = groupby(first_walk, lambda p: (p.run.conditions, p.memory))
    return plot((9, 3), [partial(_draw, list(some), measure) for _, some in blocks])


def _draw(block: list[RunResult], measure: str, axes: Any) -> None:
    label, values = MEASURES[measure]
    run = block[0].run
    axes.fill_between(
        run.time, 0, 1, where=run.still, step="mid", color="#f2f2f2", linewidth=0,
        transform=axes.get_xaxis_transform(),
    )  # fmt: skip
    for k, played in enumerate(block):
        style = {"color": COLORS[k % len(COLORS)], "label": played.run.policy}
        axes.plot(played.run.time, values(played.run), linewidth=1, **style)
    # Values before the first arrival would dwarf the rest.
    drawn = [values(played.run) for played in block]
    highest = max((float(np.percentile(v, 98)) for v in drawn if np.isfinite(v).all()), default=0.0)
    axes.set_ylim(0, 1.1 * highest if highest > 0 else 1)
    axes.set_xlim(0, run.time[-1] or 1)
    title = f"{link_text(run.conditions)}; texture memory {block[0].memory}"
    axes.set(title=title, xlabel="s", ylabel=label)
    axes.grid(True, color="#e5e5e5", linewidth=0.5)
    axes.legend(fontsize=7, loc="upper right")


#: Lines of a picture.
LINES = 540
#: The instants of Figure 3, s, and that with a local server.
INSTANTS, LOCAL = (10.0, 35.0, 80.0), 3.0
#: Lines of a picture of the strip, of its labels, and of the gap between pictures.
_STRIP_LINES, _LABEL, _GAP = 360, 26, 6


def frames(world: World, run: WalkRun, every: float) -> Iterator[tuple[str, bytes]]:
    """PNGs of the frames of a run, one each ``every`` seconds, named by their time."""
    world = POLICIES[run.policy].in_world(world)
    renderer = FrameRenderer(world, LINES)
    step = max(1, round(every * world.track.rate))
    for f in range(0, world.frames, step):
        sight = renderer.look(world.track.eye[f], world.track.direction[f])
        colors = renderer.colors(sight, run.loaded[f], run.state[f])
        yield f"{world.track.time[f]:07.1f}.png", png(as_bytes(colors))


def strip(world: World, played: RunResult, paper: PaperOptions | None = None) -> bytes:
    """A PNG of Figure 3: the picture of a run's client at `INSTANTS`, from the start of the walk
    without moving; at `LOCAL` on a link without limit or latency, the paper's local server; and the
    full picture."""
    finished = played.run
    policy = POLICIES[finished.policy].with_options(paper or PaperOptions())
    world = policy.in_world(world)
    renderer = FrameRenderer(world, _STRIP_LINES, samples=3)
    sight = renderer.look(world.track.eye[0], world.track.direction[0])
    link = finished.conditions
    local = replace(link, bandwidth=None, latency=0.0, trace=None)
    frames = []
    for conditions, instants, where in ((link, INSTANTS, ""), (local, (LOCAL,), ", local server")):
        standing = world.standing(instants[-1])
        run = simulate(standing, policy, conditions, finished.budget)
        for instant in instants:
            f = int(np.searchsorted(standing.track.time, instant - 0.5 / standing.track.rate))
            colors = renderer.colors(sight, run.loaded[f], run.state[f])
            label = f"{instant:g} s{where}, {run.fetched[f] / 1e6:.2f} MB, e {run.error[f]:.2f}"
            frames.append((label, as_bytes(colors)))
    frames.append(("full", as_bytes(renderer.full(sight))))
    title = f"{finished.policy}, {link_text(finished.conditions)}, texture memory {played.memory}"
    return png(_side_by_side(frames, title))


def png(picture: NDArray[np.uint8]) -> bytes:
    """(height, width, 3) as a PNG."""
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG")
    return out.getvalue()


def _side_by_side(
    pictures: Sequence[tuple[str, NDArray[np.uint8]]], title: str
) -> NDArray[np.uint8]:
    """Pictures side by side on white, with labels above; the title at the top."""
    from PIL import Image, ImageDraw, ImageFont

    height, width = pictures[0][1].shape[:2]
    wide = len(pictures) * (width + _GAP) + _GAP
    sheet = Image.new("RGB", (wide, 2 * _LABEL + height + _GAP), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(16)
    draw.text((_GAP, 3), title, "black", font)
    for k, (label, picture) in enumerate(pictures):
        offset = _GAP + k * (width + _GAP)
        draw.text((offset, _LABEL + 3), label, "black", font)
        sheet.paste(Image.fromarray(picture), (offset, 2 * _LABEL))
    return np.asarray(sheet)
