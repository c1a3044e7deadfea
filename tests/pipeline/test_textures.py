"""Names of textures, and fallback images."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from ptmtools import parallel
from ptmtools.executor import Executor
from ptmtools.light.options import LightOptions
from ptmtools.parallel import Workers
from ptmtools.pipeline.artifacts import Run
from ptmtools.pipeline.build import build_scene, run_stage
from ptmtools.pipeline.encoding import TextureOptions, encode_image, fallback_image, read_steps
from ptmtools.pipeline.stages import CELLS, TEXTURES
from ptmtools.store.writer import DatabaseWriter
from ptmtools.texture import read_header, read_image
from ptmtools.texture.images.bare import bare

DARK = LightOptions("none")
TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj"


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA"])
@pytest.mark.parametrize("transparent", [False, True])
def test_a_bare_png_has_the_same_texels_and_nothing_else(mode: str, transparent: bool) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (9, 7, 4), np.uint8)
    image = Image.fromarray(noise).convert(mode)
    info = PngImagePlugin.PngInfo()
    info.add_text("Comment", "made on a Monday")
    info.add(b"gAMA", (45455).to_bytes(4, "big"))
    key = {"L": 3, "P": 3, "RGB": (1, 2, 3)}.get(mode) if transparent else None
    out = io.BytesIO()
    image.save(
        out, "PNG", pnginfo=info, dpi=(72, 72), **({} if key is None else {"transparency": key})
    )
    stripped = bare(out.getvalue(), "PNG")
    assert np.array_equal(read_image(stripped), read_image(out.getvalue()))
    assert len(stripped) < len(out.getvalue())
    assert not any(kind in stripped for kind in (b"tEXt", b"gAMA", b"pHYs"))
    assert bare(stripped + b"behind the end", "PNG") == stripped


def test_what_is_left_when_it_is_stopped_is_done_later(tmp_path: Path) -> None:
    build_scene(TWO_ROOMS, tmp_path / "db", until=CELLS)
    with DatabaseWriter.open_for_stage(tmp_path / "db") as writer, Workers(1, None) as workers:
        run = Run(writer, workers, lambda done, *_: stop.set() if done == 1 else None)
        stop = Event()
        turn = TEXTURES.turn(run, TextureOptions())
        turn.begin()
        images = turn.left
        turn.encode(Executor(), stop)
        assert 0 < turn.left < images
        turn.take()
        assert turn.left == 0
        assert run.reports[0].tasks == (images, 0, 0)
        assert run.record(TEXTURES).counts["textures"] == images


def test_many_textures_are_encoded_beside_the_cells(tmp_path, monkeypatch) -> None:
    """The same bytes from one worker, from workers beside, and where some are left for later."""
    actual = {}
    for count, least in ((1, 8), (2, 1), (2, 10**9)):
        monkeypatch.setattr(parallel, "WORTH_A_PROCESS", least)
        db = tmp_path / f"{count} {least}"
        build_scene(TWO_ROOMS, db, DARK, workers=count)
        actual[db] = {f.relative_to(db): f.read_bytes() for f in db.rglob("*") if f.is_file()}
    one, *others = actual.values()
    assert all(other == one for other in others)


def test_a_note_says_what_max_side_leaves_and_what_more_would_cost(tmp_path: Path) -> None:
    build_scene(TWO_ROOMS, tmp_path / "db", until=CELLS)
    for most, wanted in ((50, "4 textures"), (32, None), (0, None)):
        report = run_stage(tmp_path / "db", TextureOptions(max_side=most))
        notes = [note for note in report.notes if "--max-side" in note]
        assert len(notes) == (wanted is not None)
        if wanted:
            assert wanted in notes[0]
            assert "32 x 32; 64 x 64 would add" in notes[0]


def tasks(db: Path) -> tuple[int, int, int] | None:
    """How many textures a build has, keeps and takes over."""
    (report,) = (s for s in build_scene(TWO_ROOMS, db, DARK).stages if s.stage == "textures")
    return report.tasks


def test_what_levels_show_outlasts_a_resumed_and_an_updated_build(tmp_path: Path) -> None:
    """It is kept with the texture: one that is not encoded again still has it."""
    build_scene(TWO_ROOMS, tmp_path / "whole", DARK)
    wanted = json.loads((tmp_path / "whole/www/hints.json").read_text())["textures"]
    assert all(len(row["differences"]) == len(row["ends"]) > 1 for row in wanted)
    assert all(row["differences"][0] == 0 < max(row["differences"]) for row in wanted)
    db = tmp_path / "db"
    build_scene(TWO_ROOMS, db, until=CELLS)

    def stopped(done: int, *_: object) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_stage(db, TextureOptions(), workers=1, progress=stopped)
    assert tasks(db) == (len(wanted), 0, 2)
    assert json.loads((db / "www/hints.json").read_text())["textures"] == wanted
    next((db / "stages/textures").iterdir()).unlink()
    assert tasks(db) == (len(wanted), len(wanted) - 1, 0)
    assert json.loads((db / "www/hints.json").read_text())["textures"] == wanted


@pytest.mark.parametrize(("most", "level", "side"), [(0, 8, 256), (64, 5, 32)])
def test_the_fallback_of_a_lossless_image_is_a_png(most: int, level: int, side: int) -> None:
    """VRML browsers do not read WebP."""
    texels = np.random.default_rng(3).integers(0, 40, (256, 256, 1), np.uint8) * [6, 5, 4]
    image = Image.fromarray(texels.astype(np.uint8))
    out = io.BytesIO()
    image.quantize(64).save(out, "PNG", optimize=True)
    options = TextureOptions(fallback_size=most)
    files = dict(encode_image(options, "noise.png", out.getvalue()))
    lossless = files["www/textures/noise.webp"]
    assert np.array_equal(read_image(lossless), texels)
    steps = read_steps(files["stages/textures/noise.json"])
    header = read_header(files["www/textures/noise.ptm"])
    assert fallback_image(steps, header, most) == (level, None)
    fallback = read_image(files["www/textures/noise.png"])
    assert fallback.shape == (side, side, 3)
    assert most or np.array_equal(fallback, texels)
    plain = encode_image(replace(options, fallback=False), "noise.png", out.getvalue())
    assert {name: data for name, data in files.items() if not name.endswith("noise.png")} == {
        **dict(plain)
    }
