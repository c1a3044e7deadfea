"""`python -m benchmarks.web_rivals`: what pages show when, and that the rivals show the scene."""

from __future__ import annotations

import gzip
import io
import json
import math
import socket
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.request import Request, urlopen

import numpy as np
import pytest
from PIL import Image

from ptmtools.glb import BINARY, glb_chunks
from ptmtools.output.served import read_served
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.site.entry import SiteEntry, link_bytes
from ptmtools.site.throttle import LATE, Throttle

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from likeness import likeness, outline  # noqa: E402
from render import Look, View, load, render  # noqa: E402

from benchmarks.npm import (  # noqa: E402
    ESBUILD,
    GLTF_TRANSFORM,
    NEEDLE,
    THREE,
)
from benchmarks.web_rivals import (  # noqa: E402
    bytes as weights,
    images,
    memory,
    optimized,
    results,
    timeline,
)
from benchmarks.web_rivals.entrants import Entrant, Subject, rival, walk_page  # noqa: E402
from benchmarks.web_rivals.link import WINDOW, Traffic, shaped  # noqa: E402
from benchmarks.web_rivals.models import whole_glb  # noqa: E402
from benchmarks.web_rivals.nginx import (  # noqa: E402
    HTTP,
    Certificate,
    certificate,
    nginx,
    program_of,
)
from benchmarks.web_rivals.progressive import progressive  # noqa: E402
from benchmarks.web_rivals.results import Conditions, kept  # noqa: E402
from benchmarks.web_rivals.tables import (  # noqa: E402
    memory_table,
    round_trips_table,
    times_table,
)
from benchmarks.web_rivals.timeline import (  # noqa: E402
    HEIGHT,
    WIDTH,
    Timeline,
    difference,
    watch,
)

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


def page_of(entries: list[SiteEntry]) -> Entrant:
    return Entrant("page", {entry.name: entry for entry in entries})


@pytest.fixture(scope="module")
def own() -> Iterator[Certificate]:
    with certificate() as one:
        yield one


@pytest.fixture(scope="module")
def browser(own: Certificate) -> Iterator[Any]:
    with timeline.chromium(own) as one:
        yield one


@pytest.fixture(autouse=True)
def _nginx(require: Callable[[str, str], None]) -> None:
    if program_of("nginx") is None:
        require("nginx", "apt install nginx-light")


@pytest.mark.parametrize("http", HTTP)
def test_a_page_is_seen_as_it_comes(browser: Any, own: Certificate, http: str) -> None:
    html = SiteEntry("index.html", PAGE.encode(), "text/html")
    page = page_of([html, SiteEntry("file", bytes(BYTES), "text/plain")])
    link, slow = Throttle(800_000, 0.1), Throttle(100_000, 0.1)
    run = watch(browser, page, link, own, http=http)
    assert run.messages == ()
    assert run.requests == 2
    shown = [tuple(picture.reshape(-1, 3)[0]) for picture in run.pictures]
    assert shown[-2:] == [RED, GREEN]
    assert all(picture.shape == (HEIGHT, WIDTH, 3) for picture in run.pictures)
    # A second for the file, and round trips: TCP, TLS, page, file; how busy this machine is comes
    # on top.
    assert run.time[-1] > 1.3 + 0.1 * (http == "2")
    assert BYTES < run.sent[-1] <= run.everything < BYTES + 5000
    assert run.sent[-2] < BYTES
    assert run.until(0.01, run.full) == (run.time[-1], run.sent[-1])
    assert run.until(1.0, run.full) == (run.time[0], run.sent[0])
    assert run.until(0.01, run.pictures[-2]) is None

    computed = run.over(link, slow)
    assert computed.done == pytest.approx(run.done + run.everything * 7e-5)
    cut = watch(browser, page, slow, own, http=http, seconds=4)
    assert cut.done == math.inf
    assert cut.everything < BYTES
    assert tuple(cut.full[0, 0]) == RED
    whole = cut.continued(computed)
    assert tuple(whole.full[0, 0]) == GREEN
    assert (whole.done, whole.time[-1]) == (computed.done, computed.time[-1])


def test_files_arrive_compressed_and_in_ranges(own: Certificate) -> None:
    text = b"much the same " * 1000
    files = [
        SiteEntry("index.html", text, "text/html", compressed=True),
        SiteEntry("data/a.ptm", bytes(range(256)) * 40, "application/octet-stream"),
    ]
    with nginx({entry.name: entry for entry in files}, "1.1", own) as server:
        url = f"http://127.0.0.1:{server.port}/"
        asked = Request(url, headers={"Accept-Encoding": "gzip"})
        with urlopen(asked) as answer:
            assert answer.headers["Content-Encoding"] == "gzip"
            assert answer.headers["Content-Type"] == "text/html"
            assert gzip.decompress(answer.read()) == text
        with urlopen(Request(f"{url}data/a.ptm", headers={"Range": "bytes=300-309"})) as answer:
            assert answer.status == 206
            assert answer.read() == bytes(range(44, 54))
        end = time.monotonic() + 10  # the log follows the answer
        while len(server.requests()) < 2 and time.monotonic() < end:
            time.sleep(0.01)
        assert server.requests() == ["200 GET / HTTP/1.1", "206 GET /data/a.ptm HTTP/1.1"]


def test_the_link_takes_round_trips_and_shares_its_bandwidth() -> None:
    """Two connections of 50 kB each over 100 kB/s, whose round trip is 0.2 s: the handshake, the
    request and the last byte take a round trip and a half before it flows, and more for the slow
    start."""
    body = bytes(50_000)
    with socket.create_server(("127.0.0.1", 0)) as origin:

        def answer(connection: socket.socket) -> None:
            connection.recv(100)
            connection.sendall(body)
            connection.close()

        def serve() -> None:
            for _ in range(2):
                Thread(target=answer, args=(origin.accept()[0],)).start()

        Thread(target=serve).start()
        traffic = Traffic()
        port = origin.getsockname()[1]
        with shaped(port, Throttle(800_000, 0.2), traffic) as shown:
            begun = time.monotonic()
            first: list[float] = []

            def ask() -> None:
                with socket.create_connection(("127.0.0.1", shown)) as client:
                    client.sendall(b"please")
                    got = client.recv(1)
                    first.append(time.monotonic() - begun)
                    while part := client.recv(1 << 16):
                        got += part
                    assert got == body

            both = [Thread(target=ask) for _ in range(2)]
            for one in both:
                one.start()
            for one in both:
                one.join()
            took = time.monotonic() - begun
    assert min(first) >= 0.4
    assert took >= 0.4 + 1.0 - LATE
    assert traffic.connections == 2
    assert traffic.rows[-1][1] == 2 * len(body)
    # At no moment more than the bandwidth allows since the first byte was possible.
    moments = np.array([when for when, _ in traffic.rows[1:]])
    sent = np.array([count for _, count in traffic.rows[1:]])
    assert (sent <= 100_000 * (moments - begun - 0.4 + LATE) + 2000).all()


def test_the_window_opens_slowly() -> None:
    """Over a fast link of a long way, four windows of 10, 20, 40 and 80 segments take four round
    trips."""
    body = bytes(150 * 1460)
    with socket.create_server(("127.0.0.1", 0)) as origin:

        def serve() -> None:
            connection, _ = origin.accept()
            connection.recv(100)
            connection.sendall(body)
            connection.close()

        Thread(target=serve).start()
        traffic = Traffic()
        with shaped(origin.getsockname()[1], Throttle(1e9, 0.3), traffic) as shown:
            begun = time.monotonic()
            with socket.create_connection(("127.0.0.1", shown)) as client:
                client.sendall(b"please")
                while client.recv(1 << 16):
                    pass
    sent = [float(traffic.at(np.array([begun + 0.6 + 0.3 * k - 0.01]))[0]) for k in range(1, 4)]
    for k, count in enumerate(sent):
        assert count <= (2 << k) * WINDOW - WINDOW, "late on a busy machine, never early"
    when, count = traffic.rows[-1]
    assert when >= begun + 1.49
    assert count == len(body)


def test_what_comes_and_goes_is_not_there_yet() -> None:
    black, white = (np.full((48, 64, 3), v, np.uint8) for v in (0, 255))
    run = Timeline(
        np.arange(4.0), 10 * np.arange(4.0), (black, white, black, white), 3.0, 30.0, 1, 1, ()
    )
    assert run.until(0.01, white) == (3.0, 30.0)
    never = replace(run, pictures=(black,) * 4)
    assert never.until(0.01, white) is None


def test_the_table_shows_medians_against_the_full_picture() -> None:
    black, white = (np.full((48, 64, 3), v, np.uint8) for v in (0, 255))
    run = Timeline(np.arange(2.0), np.arange(2.0), (black, white), 3.0, 30.0, 5, 2, ())
    slow = replace(run, time=4 * run.time)
    fast = replace(run, time=run.time / 2, done=1.0)
    full = {"ptm": white, "glb-png": white, "needle": black}
    table = times_table({"ptm": [fast] * 3, "glb-png": [run, slow, run], "needle": [run] * 3}, full)
    assert "| ptm | 0.5 s, 0.00 MB (1.0 ×) |" in table
    assert "| glb-png | 1.0 s, 0.00 MB (2.0 ×) | 1.0 s, 0.00 MB (2.0 ×) | 3.0 s" in table
    lines = table.splitlines()
    assert lines[-1].startswith("| needle | – | – | 3.0 s"), "its full picture is black"
    assert lines[-2].endswith("| 0.000 | 5 | 2 |")


def test_round_trips_are_those_that_a_longer_way_takes() -> None:
    white = np.full((48, 64, 3), 255, np.uint8)
    near = Timeline(np.array([1.0]), np.ones(1), (white,), 2.0, 30.0, 5, 2, ())
    far = replace(near, time=near.time + 0.9, done=2.0 + 1.5)
    table = round_trips_table({"ptm": [[near], [far]]}, {"ptm": white}, (0.05, 0.35))
    assert table.splitlines()[-1] == "| ptm | 3.0 | 3.0 | 5.0 |"
    table = round_trips_table({"ptm": [[near], [far]]}, {"ptm": 255 - white}, (0.05, 0.35))
    assert table.splitlines()[-1] == "| ptm | – | – | 5.0 |"


def test_runs_are_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "RESULTS", tmp_path)
    picture = np.random.default_rng(1).integers(256, size=(6, 8, 3), dtype=np.uint8)
    run = Timeline(np.arange(2.0), np.arange(2.0), (picture[:3], picture), 1.0, 2.0, 3, 4, ("a",))
    page = page_of([SiteEntry("index.html", b"one", "text/html")])
    other = page_of([SiteEntry("index.html", b"two", "text/html")])
    conditions = Conditions(Throttle(1e6, 0.1), "2", 0, 60)
    measured: list[str] = []

    def measure() -> Timeline:
        measured.append("")
        return run

    for _ in range(2):
        again = kept(page, conditions, measure)
    assert len(measured) == 1
    assert all(map(np.array_equal, again.pictures, run.pictures))
    assert (again.done, again.everything, again.requests, again.connections) == (1, 2, 3, 4)
    assert again.messages == ("a",)
    for changed in (
        (other, conditions),
        (page, replace(conditions, repetition=1)),
        (page, replace(conditions, http="1.1")),
        (page, replace(conditions, link=Throttle(1e6, 0.2))),
    ):
        kept(*changed, measure)
    assert len(measured) == 5


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
    browser: Any,
    own: Certificate,
    gltf_museum: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for package in (THREE, ESBUILD, GLTF_TRANSFORM, NEEDLE):
        if remedy := package.remedy():
            require(package.name, remedy)
    monkeypatch.setattr(images, "KEPT", tmp_path)
    monkeypatch.setattr(optimized, "KEPT", tmp_path)
    subject = Subject(load(gltf_museum), read_served(gltf_museum).index)
    view = View.of_hint(subject.viewpoint, WIDTH, HEIGHT)
    look = Look("none", sky=(0, 0, 0), mipmaps=True)
    picture, edges = render(subject.scene, view, look, samples=2), outline(subject.scene, view)
    link = Throttle(20_000_000, 0.02)
    full = []
    for name in ("glb-png", "glb-webp", "coarse-first"):
        entrant = rival(name, subject)
        run = watch(browser, entrant, link, own)
        assert run.messages == ()
        assert run.requests == len(entrant.files), "each file once"
        assert likeness(run.full, picture, edges, look).psnr > LIKE
        full.append(run.full)
    assert all(np.array_equal(full[0], other) for other in full[1:])
    for name in ("gltf-transform", "needle"):
        run = watch(browser, rival(name, subject), link, own, http="2")
        assert run.done < math.inf
        assert difference(full[0], run.full) < 0.1, "lossy, but the same view"


def test_level_files_are_those_that_the_model_names(
    require: Callable[[str, str], None],
    room_row: Callable[[int], tuple[Scene, Any]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if remedy := GLTF_TRANSFORM.remedy():
        require(GLTF_TRANSFORM.name, remedy)
    monkeypatch.setattr(images, "KEPT", tmp_path)
    monkeypatch.setattr(optimized, "KEPT", tmp_path)
    scene, _ = room_row(2)
    texels = np.random.default_rng(1).integers(256, size=(640, 320, 3), dtype=np.uint8)
    out = io.BytesIO()
    Image.fromarray(texels).save(out, "PNG")
    textured = replace(scene.materials[0], image=0)
    scene = replace(scene, materials=(textured,), images=(source(out.getvalue()),))
    model, files = progressive(scene)
    (_, _, text), _ = glb_chunks(model)
    (texture,) = json.loads(text)["textures"]
    levels = texture["extensions"]["NEEDLE_progressive"]["lods"]
    assert [(level["width"], level["height"]) for level in levels] == [
        (320, 640),
        (256, 512),
        (128, 256),
    ]
    assert [level["path"] for level in levels] == list(files)
    for level in levels:
        (_, _, text), (_, _, binary) = glb_chunks(files[level["path"]])
        (own,) = json.loads(text)["textures"]
        guid = texture["extensions"]["NEEDLE_progressive"]["guid"]
        assert own["extensions"]["NEEDLE_progressive"]["guid"] == guid
        with Image.open(io.BytesIO(binary)) as opened:
            assert opened.size == (level["width"], level["height"])


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


def test_bytes_of_a_site_and_of_its_model(gltf_museum: Path) -> None:
    subject = Subject(load(gltf_museum), read_served(gltf_museum).index)
    row = weights.row_of(gltf_museum)
    assert row.site.total == sum(map(link_bytes, walk_page(gltf_museum).files.values()))
    served = gltf_museum / "www"
    files = [*served.glob("textures/*.ptm"), *served.glob("previews/*")]
    assert row.site.images == sum(file.stat().st_size for file in files)
    assert row.model.images == sum(len(image.load()) for image in subject.scene.images)
    table = weights.bytes_table([replace(row, scene="x", model=row.site)])
    assert table.splitlines()[-1].startswith(f"| x | {row.triangles:,} |")
    assert "| 1.00 |" in table
