"""Frames of a run as pictures, and the paper's Figure 3: what arrives before one's eyes."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ptmtools.walkthrough.comparing import Played
from ptmtools.walkthrough.policies import POLICIES
from ptmtools.walkthrough.report import link_text
from ptmtools.walkthrough.simulation import Run, simulate
from ptmtools.walkthrough.view.render import Renderer, as_bytes
from ptmtools.walkthrough.world import World

#: Lines of a picture.
LINES = 540
#: The instants of Figure 3, s.
INSTANTS = (10.0, 35.0, 80.0)
#: Lines of a picture of the strip, of its labels, and of the gap between pictures.
_STRIP_LINES, _LABEL, _GAP = 360, 26, 6


def frames(world: World, run: Run, every: float) -> Iterator[tuple[str, bytes]]:
    """PNGs of the frames of a run, one each ``every`` seconds, by names that say when."""
    world = world.in_form(POLICIES[run.policy].form)
    renderer = Renderer(world, LINES)
    step = max(1, round(every * world.rate))
    for f in range(0, world.frames, step):
        sight = renderer.look(world.eye[f], world.direction[f])
        colors = renderer.colors(sight, run.there[f], run.column[f])
        yield f"{world.time[f]:07.1f}.png", png(as_bytes(colors))


def strip(world: World, played: Played) -> bytes:
    """A PNG: what the client of a run shows after `INSTANTS` to who stands where the walk begins,
    and the full picture."""
    of = played.run
    world = world.in_form(POLICIES[of.policy].form)
    stays = world.standing(INSTANTS[-1])
    run = simulate(stays, POLICIES[of.policy], of.conditions, of.budget)
    renderer = Renderer(world, _STRIP_LINES, samples=3)
    sight = renderer.look(stays.eye[0], stays.direction[0])
    found = []
    for instant in INSTANTS:
        f = int(np.searchsorted(stays.time, instant - 0.5 / stays.rate))
        colors = renderer.colors(sight, run.there[f], run.column[f])
        label = f"{instant:g} s, {run.fetched[f] / 1e6:.2f} MB, e {run.error[f]:.2f}"
        found.append((label, as_bytes(colors)))
    found.append(("full", as_bytes(renderer.full(sight))))
    title = f"{of.policy}, {link_text(of.conditions)}, texture memory {played.memory}"
    return png(_side_by_side(found, title))


def png(picture: NDArray[np.uint8]) -> bytes:
    """(height, width, 3) as a PNG."""
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG")
    return out.getvalue()


def _side_by_side(
    pictures: Sequence[tuple[str, NDArray[np.uint8]]], title: str
) -> NDArray[np.uint8]:
    """Labels above and pictures below, on white; the title above all."""
    from PIL import Image, ImageDraw, ImageFont

    height, width = pictures[0][1].shape[:2]
    wide = len(pictures) * (width + _GAP) + _GAP
    sheet = Image.new("RGB", (wide, 2 * _LABEL + height + _GAP), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(16)
    draw.text((_GAP, 3), title, "black", font)
    for k, (label, picture) in enumerate(pictures):
        left = _GAP + k * (width + _GAP)
        draw.text((left, _LABEL + 3), label, "black", font)
        sheet.paste(Image.fromarray(picture), (left, 2 * _LABEL))
    return np.asarray(sheet)
