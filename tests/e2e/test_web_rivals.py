"""`python -m benchmarks.web_rivals`: what pages show when, and that the rivals show the scene."""

from __future__ import annotations

import io
import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.glb import BINARY, glb_chunks
from ptmtools.output.served import read_served
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.site.content import Entry
from ptmtools.site.throttle import Throttle

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from likeness import likeness, outline  # noqa: E402
from render import Look, View, load, render  # noqa: E402

from benchmarks.web_rivals import images, memory  # noqa: E402
from benchmarks.web_rivals.entrants import Entrant, rival  # noqa: E402
from benchmarks.web_rivals.models import whole_glb  # noqa: E402
from benchmarks.web_rivals.packages import ESBUILD, THREE  # noqa: E402
from benchmarks.web_rivals.tables import memory_table, times_table  # noqa: E402
from benchmarks.web_rivals.timeline import HEIGHT, WIDTH, Timeline, watch  # noqa: E402

#: dB, outside edges.
LIKE = 30.0
RED, GREEN = (255, 0, 0), (0, 255, 0)
#: Red at once; green when a file is there.
PAGE = """<!DOCTYPE html><link rel="icon" href="data:,">
<style>body { margin: 0 } canvas { display: block }</style>
<canvas width="320" height="240"></canvas>
<script type="module">
const gl = document.querySelector("canvas").getContext("webgl2");
const fill = (red, green) => { gl.clearColor(red, green, 0, 1); gl.clear(gl.COLOR_BUFFER_BIT); };
fill(1, 0);
await (await fetch("file")).arrayBuffer();
fill(0, 1);
window.rival = { complete: true };
</script>"""
BYTES = 100_000


def page_of(entries: list[Entry]) -> Entrant:
    return Entrant("page", {entry.name: entry for entry in entries})


def test_a_page_is_seen_as_it_comes(chromium: Any) -> None:
    html = Entry("index.html", PAGE.encode(), "text/html")
    page = page_of([html, Entry("file", bytes(BYTES), "text/plain")])
    link, slow = Throttle(800_000, 0.1), Throttle(100_000, 0.1)
    run = watch(chromium, page, link)
    assert run.messages == ()
    assert run.requests == 2
    shown = [tuple(picture.reshape(-1, 3)[0]) for picture in run.pictures]
    assert shown[-2:] == [RED, GREEN]
    assert all(picture.shape == (HEIGHT, WIDTH, 3) for picture in run.pictures)
    # A second for the file, and two latencies; how busy this machine is comes on top.
    assert run.time[-1] > 1.2
    assert BYTES < run.sent[-1] <= run.everything < BYTES + 3000
    assert run.sent[-2] < BYTES
    assert run.until(0.01, run.full) == (run.time[-1], run.sent[-1])
    assert run.until(1.0, run.full) == (run.time[0], run.sent[0])
    assert run.until(0.01, run.pictures[-2]) is None

    computed = run.over(link, slow)
    assert computed.done == pytest.approx(run.done + run.everything * 7e-5)
    cut = watch(chromium, page, slow, seconds=4)
    assert cut.done == math.inf
    assert cut.everything < BYTES
    assert tuple(cut.full[0, 0]) == RED
    whole = cut.continued(computed)
    assert tuple(whole.full[0, 0]) == GREEN
    assert (whole.done, whole.time[-1]) == (computed.done, computed.time[-1])


def test_what_comes_and_goes_is_not_there_yet() -> None:
    black, white = (np.full((48, 64, 3), v, np.uint8) for v in (0, 255))
    run = Timeline(
        np.arange(4.0), 10 * np.arange(4.0), (black, white, black, white), 3.0, 30.0, 1, ()
    )
    assert run.until(0.01, white) == (3.0, 30.0)
    never = replace(run, pictures=(black,) * 4)
    table = times_table({"glb-png": run, "ptm": replace(run, time=run.time / 2, done=1.0)})
    assert (
        "| glb-png | 3.0 s, 0.00 MB (2.0 ×) | 3.0 s, 0.00 MB (2.0 ×) | 3.0 s, 0.00 MB (3.0 ×)"
        in table
    )
    assert never.until(0.01, white) is None


@pytest.mark.parametrize("form", ["png", "webp"])
def test_a_glb_has_the_triangles_and_the_images(
    room_row: Callable[[int], tuple[Scene, Any]], form: str
) -> None:
    scene, _ = room_row(2)
    textured = replace(scene.materials[0], image=1)
    files = [b"one", b"the other"]
    scene = replace(scene, materials=(textured,), images=tuple(map(source, files)))
    (_, _, text), (kind, _, binary) = glb_chunks(whole_glb(scene, files, f"image/{form}"))
    document = json.loads(text)
    assert kind == BINARY
    views = document["bufferViews"]
    actual = [views[image["bufferView"]] for image in document["images"]]
    assert [binary[v["byteOffset"] :][: v["byteLength"]] for v in actual] == files
    (texture,) = document["textures"]
    named = texture if form == "png" else texture["extensions"]["EXT_texture_webp"]
    assert named["source"] == 1
    assert document.get("extensionsRequired", []) == ([] if form == "png" else ["EXT_texture_webp"])
    (primitive,) = document["meshes"][0]["primitives"]
    index = document["accessors"][primitive["indices"]]
    assert index["count"] == 3 * len(scene.triangles)


def source(data: bytes) -> SourceImage:
    return SourceImage("image.png", data.hex(), lambda: data)


def test_rivals_show_what_rays_see(
    require: Callable[[str, str], None],
    chromium: Any,
    gltf_museum: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for package in (THREE, ESBUILD):
        if remedy := package.remedy():
            require(package.name, remedy)
    monkeypatch.setattr(images, "KEPT", tmp_path)
    scene = load(gltf_museum)
    viewpoint = json.loads((gltf_museum / "www/hints.json").read_text())["viewpoints"][0]
    view = View.of_hint(viewpoint, WIDTH, HEIGHT)
    look = Look("none", sky=(0, 0, 0), mipmaps=True)
    own, edges = render(scene, view, look, samples=2), outline(scene, view)
    link = Throttle(20_000_000, 0.02)
    full = []
    for name in ("glb-png", "glb-webp", "coarse-first"):
        entrant = rival(name, scene, viewpoint)
        run = watch(chromium, entrant, link)
        assert run.messages == ()
        assert run.requests == len(entrant.files), "each file once"
        assert likeness(run.full, own, edges, look).psnr > LIKE
        full.append(run.full)
    assert all(np.array_equal(full[0], other) for other in full[1:])


def test_lossless_images_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "KEPT", tmp_path)
    texels = np.random.default_rng(1).integers(256, size=(300, 400, 3), dtype=np.uint8)
    out = io.BytesIO()
    Image.fromarray(texels).save(out, "PNG")
    image = source(out.getvalue())
    for form in ("png", "webp"):
        (data,) = images.in_form([image], form)
        with Image.open(io.BytesIO(data)) as opened:
            assert np.array_equal(np.asarray(opened), texels)
    (small,) = images.in_form([image], "jpeg-256")
    with Image.open(io.BytesIO(small)) as opened:
        assert opened.size == (256, 192)
    assert len(list(tmp_path.iterdir())) == 3
    assert images.in_form([image], "jpeg-256") == [small]


def test_more_memory_shows_more(gltf_museum: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "BLOCK_BYTES", {})
    served = read_served(gltf_museum)
    budgets = (0, 20_000, 1 << 30)
    rows = memory.measured(served, load(gltf_museum), served.index["viewpoints"][0], budgets)
    nothing, some, everything = rows
    assert nothing.flip > some.flip > everything.flip == 0.0
    assert 0 == nothing.used < some.used <= 20_000 < everything.used
    assert memory_table(rows).splitlines()[-1].startswith("| all | 0.0000 (")


def test_blocks_and_levels_as_cards_make_them(gltf_museum: Path) -> None:
    full = memory.read_pyramids(read_served(gltf_museum))
    finest = int(full.levels[0]) - 1
    texels = [full.texel[memory._level(full, 0, n)].reshape(-1, 3) for n in (0, finest)]
    rounded = memory._rounded(full)
    assert np.array_equal(rounded.texel[memory._level(full, 0, finest)], texels[1].ravel())
    coarsest = rounded.texel[memory._level(full, 0, 0)].reshape(-1, 3)
    assert np.abs(coarsest.mean(axis=0) - texels[1].mean(axis=0)).max() < 1
    blocks = memory._blocks(full, 8)
    width, height = full.size[0, finest]
    assert blocks[0, 1] == 8
    assert blocks[0, finest + 1] - blocks[0, finest] == width * height // 2
