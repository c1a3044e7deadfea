"""The page in a browser: what it draws, what it holds, and what it asks for."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
from likeness import likeness, outline
from render import Look, View, load, render

from ptmtools.output.gltf_reader import ReadGlb, read_glb
from ptmtools.rendering.rays import Frustum
from ptmtools.site.content import Site
from ptmtools.texture import open as open_ptm
from ptmtools.texture.detail import with_offset

SKY = (0.16, 0.17, 0.19)
#: Textured surfaces unlit; the others glow and are lit from the eye.
LOOK = Look("material", headlight=0.75, glow=0.25, sky=SKY, mipmaps=True, floored=True)
#: dB, outside edges.
LIKE = 40.0
MIB = 1 << 20


def read(site: Site, url: str) -> bytes:
    """A file that the index names."""
    return site.entries[f"data/{url}"].read()


def record_of(site: Site, cell: int) -> dict[str, Any]:
    actual: dict[str, Any] = json.loads(read(site, site.index["cells"][cell]["record"]))
    return actual


def geometry_of(site: Site, cell: int) -> ReadGlb:
    """The GLB of the database; that of the site has no names."""
    row = site.index["cells"][cell]
    record = site.entries[f"data/{row['record']}"].source
    assert isinstance(record, Path)
    return read_glb((record.parents[1] / f"gltf/{row['name']}.glb").read_bytes())


def tall(viewpoint: dict[str, Any], width: int, height: int) -> float:
    """The vertical field of view of a viewpoint on a wide screen."""
    assert width >= height
    return float(viewpoint["fieldOfView"])


@pytest.fixture(params=["museum", "hospital"])
def site(request: pytest.FixtureRequest) -> Site:
    actual: Site = request.getfixturevalue(request.param)
    return actual


def test_cells_that_are_drawn_are_those_in_sight(visit: Callable[..., Any], site: Site) -> None:
    """From each viewpoint: the cell, its visible set, and of that what reaches into the frustum."""
    places = site.index["viewpoints"]
    with visit(site) as visitor:
        for number in range(0, len(places), max(1, len(places) // 6)):
            state = visitor.go(number)
            place = places[number]
            assert state["cell"] == place["cell"]
            visible = record_of(site, place["cell"])["visible"]
            assert state["visible"] == visible
            eye, along = (np.array(place[key]) for key in ("position", "direction"))
            frustum = Frustum(eye, along, tall(place, 640, 480), 640 / 480)
            expected = []
            for cell in visible:
                points = [p.point.astype(np.float64) for p in geometry_of(site, cell).primitives]
                low = np.array([p.min(axis=0) for p in points]).reshape(-1, 3)
                high = np.array([p.max(axis=0) for p in points]).reshape(-1, 3)
                if frustum.meets_boxes(low, high).any():
                    expected.append(cell)
            # Shapes of one look are drawn as one, so a cell may come along by the box of two.
            assert set(expected) <= set(state["drawnCells"]) <= set(visible)
            assert len(state["drawnCells"]) <= len(expected) + 2
    assert visitor.messages == []


def test_pictures_are_what_rays_see(
    visit: Callable[..., Any], request: pytest.FixtureRequest, site: Site
) -> None:
    """From viewpoints, with everything there."""
    database: Path = request.getfixturevalue(f"{request.node.callspec.params['site']}_db")
    scene = load(database)
    places = site.index["viewpoints"]
    width, height = 480, 360
    with visit(site, width=width, height=height, reduced_motion="reduce") as visitor:
        for number in range(0, len(places), max(1, len(places) // 4)):
            visitor.go(number)
            shown = visitor.picture()
            view = View.of_hint(places[number], width, height)
            own, edges = render(scene, view, LOOK, samples=1), outline(scene, view)
            actual = likeness(shown, own, edges, LOOK)
            assert actual.psnr > LIKE, (number, actual)
            assert actual.stray < 0.001
    assert visitor.messages == []


def test_never_more_than_the_budget(visit: Callable[..., Any], site: Site) -> None:
    """Counted by the calls themselves, through several rooms, with little memory, then less."""
    budget = 2 * MIB
    with visit(site, query="?memory=2") as visitor:
        for number in range(min(5, len(site.index["viewpoints"]))):
            visitor.go(number)
            counted = visitor.page.evaluate(
                "({ ...window.counted, told: window.ptm.state().residentBytes })"
            )
            assert counted["told"] == counted["bytes"]
            assert 0 < counted["peak"] <= budget
            assert counted["stripe"] <= 256 << 10
            assert counted["others"] == []
        visitor.page.evaluate("window.ptm.setBudget(300000)")
        visitor.until("s.residentBytes <= 300000")
        visitor.page.evaluate("window.counted.peak = window.counted.bytes")
        visitor.go(0)
        assert 0 < visitor.page.evaluate("window.counted.peak") <= 300_000
    assert visitor.messages == []


#: The levels of a texture on the GPU, as SHA-256 of their bytes, coarsest first.
LEVELS = """
async (texture) => {
  const { gl, memory } = window.ptm.walk, storage = memory.of(texture), found = [];
  const format = { 1: gl.RED, 2: gl.RG, 4: gl.RGBA }[storage.channels];
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  for (const [level, { width, height }] of storage.sizes.entries()) {
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, storage.texture,
                            storage.levels - 1 - level);
    const rgba = new Uint8Array(4 * width * height);
    gl.pixelStorei(gl.PACK_ALIGNMENT, 1);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", rgba));
    found.push([...digest].map((byte) => byte.toString(16).padStart(2, "0")).join(""));
  }
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(frame);
  return found;
}
"""


def as_held(level: np.ndarray[Any, np.dtype[np.uint8]]) -> bytes:
    """A level as RGBA, in the way in which GPUs read grey textures: red, green, 0, 255."""
    height, width, components = level.shape
    rgba = np.zeros((height, width, 4), np.uint8)
    rgba[..., 3] = 255
    rgba[..., :components] = level
    return rgba.tobytes()


def test_levels_on_the_gpu_are_those_of_python(visit: Callable[..., Any], site: Site) -> None:
    checked = 0
    with visit(site) as visitor:
        visitor.complete()
        state = visitor.until("s.held.filter((held) => held > 5).length >= 4")
        for texture, held in enumerate(state["held"]):
            if held < 6 or checked == 6:
                continue
            actual = visitor.page.evaluate(LEVELS, texture)
            row = site.index["textures"][texture]
            assert any(row["offsets"])
            with open_ptm(read(site, row["file"])) as ptm:
                levels = zip(ptm.levels(), row["offsets"], strict=True)
                shown = [with_offset(level, offset) for level, offset in levels]
            own = [hashlib.sha256(as_held(level)).hexdigest() for level in shown]
            assert actual == own[: len(actual)]
            assert len(actual) >= held
            checked += 1
    assert checked >= 3
    assert visitor.messages == []


def test_requests_and_bytes_are_those_of_the_server(
    visit: Callable[..., Any], museum: Site
) -> None:
    """With an empty cache: nothing is asked for twice, no ranges of a file overlap."""
    with visit(museum) as visitor:
        visitor.complete()
        state = visitor.until("s.pending === 0")
        data = [v for v in visitor.visits if unquote(v.path).startswith("/data/")]
    index = next(v for v in data if "/index-" in v.path)
    assert all(v.status in (200, 206) for v in data)
    asked = [v for v in data if v is not index]
    assert state["requests"] == len(asked)
    whole = [v.path for v in asked if v.status == 200]
    assert len(whole) == len(set(whole))
    ranges: dict[str, list[tuple[int, int]]] = {}
    for v in asked:
        if v.range:
            begin, end = v.range.removeprefix("bytes=").split("-")
            ranges.setdefault(v.path, []).append((int(begin), int(end)))
    assert ranges
    for parts in ranges.values():
        assert parts[0][0] == 0
        assert all(b[0] == a[1] + 1 for a, b in itertools.pairwise(parts))
    assert sum(v.bytes for v in asked if v.range) == sum(
        end + 1 - begin for parts in ranges.values() for begin, end in parts
    )


def test_keys_walk(visit: Callable[..., Any], museum: Site) -> None:
    """As far as a wall, and not through it; a link to the place leads back there."""
    with visit(museum, width=320, height=240) as visitor:
        begun = visitor.complete()
        visitor.page.keyboard.down("KeyW")
        visitor.until(f"Math.hypot(s.pose.eye[0] - {begun['pose']['eye'][0]}, "
                      f"s.pose.eye[2] - {begun['pose']['eye'][2]}) > 1")  # fmt: skip
        visitor.walk_to_a_wall()
        visitor.page.keyboard.up("KeyW")
        state = visitor.complete()
        place = museum.index["cells"][state["cell"]]["box"]
        eye = state["pose"]["eye"]
        assert all(place[k] < eye[k] < place[k + 3] for k in range(3))
        reported = "(x) => Math.abs(Number(location.hash.slice(1).split(',')[0]) - x) < 0.01"
        visitor.page.wait_for_function(reported, arg=eye[0])
        link = visitor.page.url
        visitor.page.goto("about:blank")
        visitor.page.goto(link)
        again = visitor.complete()
    assert again["cell"] == state["cell"]
    assert np.abs(np.subtract(again["pose"]["eye"], eye)).max() < 0.01
    assert visitor.messages == []


def test_the_papers_client_walks(visit: Callable[..., Any], museum: Site) -> None:
    """By §6.1 and §6.2: within its budget, and textures arrive."""
    with visit(museum, query="?policy=paper&memory=2") as visitor:
        state = visitor.until(
            "s.policy === 'paper' && s.held.filter((held) => held > 4).length > 2"
        )
        assert 0 < visitor.page.evaluate("window.counted.peak") <= 2 * MIB
        assert state["residentBytes"] <= 2 * MIB
    assert visitor.messages == []


def test_both_halves(visit: Callable[..., Any], museum: Site) -> None:
    """With little memory the left half is coarse, and the right one what it is with enough."""
    with visit(museum, reduced_motion="reduce") as visitor:
        visitor.complete()
        full = visitor.picture()
        visitor.page.evaluate("window.ptm.setBudget(60000)")
        visitor.until("s.residentBytes <= 60000")
        visitor.complete()
        visitor.page.evaluate("window.ptm.compare(true)")
        visitor.page.wait_for_function("window.ptm.walk.comparison?.settle()", polling=200)
        half = full.shape[1] // 2
        right = full[:, half + 1 :]
        both = visitor.picture_of(lambda shown: bool((shown[:, half + 1 :] == right).all()))
    np.testing.assert_array_equal(both[:, half + 1 :], right)
    assert np.abs(both[:, :half].astype(int) - full[:, :half]).mean() > 0.5
    assert visitor.messages == []
