"""Best picture of a view within a budget of texture memory, independent of the link.

Lossless texels take four bytes on a graphics card; blocks hold them in one byte (UASTC, as BC7 or
ASTC) or half a byte (ETC1S, as ETC1 or BC1), and so one level more, or one and a half. Which levels
of which textures are held is chosen by the same rule for all, and with full knowledge: by what each
level takes from the error of this very picture, per byte. Pictures are those of a screen of 1080
lines, made smaller. Blocks are decoded as KTX2 files hold them, so what a card's own format loses
besides is left out.

Each is held against all of its own levels before they were coded: those of a `.ptm` are means of
four that are rounded down, again and again, and so up to 2.5 of 255 darker than the encoder's. Held
against those, UASTC would never come below 0.034 in the museum, instead of 0.013.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.npm import KTX2
from benchmarks.web_rivals.images import in_form
from ptmtools.output.served import Served
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.records import Pyramids
from ptmtools.scene.model import Scene
from ptmtools.walk import Walk
from ptmtools_lab.allocation import allocate
from ptmtools_lab.measures import flip
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import World, prepare

WIDTH, HEIGHT, _SAMPLES = 320, 240, 3
#: Of 4 × 4 texels.
BLOCK_BYTES = {"etc1s": 8, "uastc": 16}
LOSSLESS = "lossless"

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Held:
    """FLIP against the picture with all levels uncoded, of a form in a budget, and what of it is
    ``used``, bytes."""

    form: str
    budget: int
    used: int
    flip: float


def measured(
    served: Served, scene: Scene, viewpoint: Mapping[str, Any], budgets: Sequence[int]
) -> list[Held]:
    """Of each form in each budget, bytes."""
    walk = _standing(viewpoint)
    full = read_pyramids(served)
    world = prepare(served, walk, full, pixels=(WIDTH, HEIGHT))
    sight = FrameRenderer(world, HEIGHT, _SAMPLES).look(walk.eye[0], walk.direction[0])
    rounded = _rounded(full)
    actual = []
    for form in (LOSSLESS, *BLOCK_BYTES):
        if form == LOSSLESS:
            own, cost, true = world, world.catalogue.memory, full
        else:
            coded = _decoded(full, served, scene, form)
            own = prepare(
                served, walk, coded, pixels=(WIDTH, HEIGHT), drawing=Drawing(full=rounded)
            )
            cost, true = _blocks(full, BLOCK_BYTES[form]), rounded
        drawn = FrameRenderer(own, HEIGHT, _SAMPLES)
        reference = FrameRenderer(replace(own, pyramids=true), HEIGHT, _SAMPLES).full(sight)
        worth = _worth(own)
        there = np.ones(served.cell_count, dtype=np.bool_)
        for budget in budgets:
            column = np.zeros(len(cost), np.int64)
            used = allocate(worth, cost, own.catalogue.levels, budget, column, True)
            shown = drawn.colors(sight, there, column)
            actual.append(Held(form, budget, int(used), flip(reference, shown)))
    return actual


def _standing(viewpoint: Mapping[str, Any]) -> Walk:
    eye, direction = (np.array([viewpoint[k]] * 2, float) for k in ("position", "direction"))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    time = np.array([0.0, 1.0])
    return Walk(time, eye, direction, viewpoint["fieldOfView"], WIDTH / HEIGHT)


def _worth(world: World) -> NDArray[np.float64]:
    """(T, K) by how much each column lowers the error of the first frame beside the one before."""
    rows = world.views.rows(0)
    textured = world.views.texture[rows] >= 0
    error = np.zeros(world.catalogue.memory.shape)
    # The first of a row is the error of nothing at all, grey.
    which = world.views.texture[rows][textured]
    # The states of levels come before those of previews.
    states = np.arange(1, error.shape[1] + 1)
    np.add.at(error, which, world.views.error[rows][textured][:, states])
    worth = np.zeros_like(error)
    worth[:, 1:] = error[:, :-1] - error[:, 1:]
    return worth


def _blocks(textures: Pyramids, bytes_each: int) -> Ints:
    """(T, K) bytes of each column in blocks of 4 × 4 texels."""
    size = textures.size
    each = -(-size[..., 0] // 4) * -(-size[..., 1] // 4) * bytes_each
    return np.concatenate([np.zeros((len(size), 1), np.int64), np.cumsum(each, axis=1)], axis=1)


def _decoded(full: Pyramids, served: Served, scene: Scene, form: str) -> Pyramids:
    """The same textures as KTX2 files hold them."""
    images = {Path(image.name).stem: image for image in scene.images}
    names = [Path(row["file"]).stem for row in served.index["textures"]]
    files = in_form([images[name] for name in names], form)
    texel = np.empty_like(full.texel)
    for t, file in enumerate(files):
        held = _texels(file)
        at = 0
        for n in reversed(range(int(full.levels[t]))):
            count = 4 * int(full.size[t, n].prod())
            texel[_level(full, t, n)] = held[at : at + count].reshape(-1, 4)[:, :3].ravel()
            at += count
    return full._replace(texel=texel)


def _rounded(full: Pyramids) -> Pyramids:
    """The same textures, each level the rounded means of the finest."""
    texel = full.texel.copy()
    for t, count in enumerate(full.levels.tolist()):
        width, height = full.size[t, count - 1].tolist()
        finest = texel[_level(full, t, count - 1)].reshape(height, width, 3)
        image = Image.fromarray(finest)
        for n in range(count - 1):
            smaller = image.resize(tuple(full.size[t, n].tolist()), Image.Resampling.BOX)
            texel[_level(full, t, n)] = np.asarray(smaller).ravel()
    return full._replace(texel=texel)


def _level(textures: Pyramids, t: int, n: int) -> slice:
    """Where the texels of a level are."""
    begin = int(textures.start[t, n])
    return slice(begin, begin + 3 * int(textures.size[t, n].prod()))


def _texels(file: bytes) -> NDArray[np.uint8]:
    script = Path(__file__).with_name("texels.mjs")
    with tempfile.TemporaryDirectory(prefix="ktx2-") as name:
        given, out = Path(name) / "given.ktx2", Path(name) / "out"
        given.write_bytes(file)
        command = ["node", str(script), str(KTX2.folder), str(given), str(out)]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        return np.frombuffer(out.read_bytes(), np.uint8)
