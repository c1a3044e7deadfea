"""Previews in a browser: what they show, what they give way to, and what happens without them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.site.content import Site, site_of
from tests.scene.conftest import GltfModel, noise, png

from .conftest import PLAIN, build
from .previews import (
    Preview,
    Texels,
    Texture,
    brightened,
    decoded,
    halved,
    levels_of,
    saved,
    with_previews,
)
from .test_page import LEVELS, as_held

#: Walls of a room seen from within, and a panel in it; metres.
SIZE = np.array([6.0, 3.0, 5.0])
QUADS = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
EYE, FIELD = [3.0, 1.6, 4.5], 1.1
COUNT = 9
#: Every answer counts as one of HTTP/2.
SECOND_PROTOCOL = """
Object.defineProperty(PerformanceResourceTiming.prototype, "nextHopProtocol", { get: () => "h2" });
"""


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Site:
    """A room with nine textures: on each wall one, and three panels across."""
    doc = GltfModel()
    doc.tree["images"] = [
        {"bufferView": doc.view(png(noise(k))), "mimeType": "image/png"} for k in range(COUNT)
    ]
    doc.tree["textures"] = [{"source": k} for k in range(COUNT)]
    doc.tree["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}, "doubleSided": k > 5}
        for k in range(COUNT)
    ]
    x, y, z = SIZE
    corners = np.array([(i * x, j * y, k * z) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [corners[quad] for quad in QUADS]
    for k in range(COUNT - 6):
        left = 0.6 + 1.8 * k
        across = [[left, 0.9], [left + 1.2, 0.9], [left + 1.2, 2.1], [left, 2.1]]
        quads.append(np.array([[*place, 2.0] for place in across]))
    doc.place(*(_primitive(doc, quad, k) for k, quad in enumerate(quads)))
    doc.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": FIELD, "znear": 0.1}}]
    doc.tree["nodes"].append({"camera": 0, "translation": EYE, "name": "door"})
    doc.tree["scenes"] = [{"nodes": [0, 1]}]
    folder = tmp_path_factory.mktemp("previews")
    (folder / "room.glb").write_bytes(doc.glb())
    # Cells that need no decoder.
    database = build(folder / "room.glb", folder / "room.db", "--plain-gltf")
    site = site_of(database, PLAIN)
    assert len(site.index["textures"]) == COUNT
    return site


def _primitive(doc: GltfModel, corners: Any, material: int) -> dict[str, Any]:
    coords = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    return {
        "attributes": {
            "POSITION": doc.add(corners.astype(np.float32)),
            "TEXCOORD_0": doc.add(coords),
        },
        "indices": doc.add(np.array([0, 1, 2, 0, 2, 3], np.uint16)),
        "material": material,
    }


def corners_of(width: int, height: int, components: int = 3) -> Texels:
    """An image with a colour of its own in each corner, shades and some noise between; with alpha
    a hole whose colours stay."""
    y, x = np.mgrid[0:height, 0:width] / np.array([height, width])[:, None, None]
    red, green, blue = 255 * x, 255 * y, 255 * (1 - x) * (1 - y)
    grain = np.random.default_rng(width).integers(0, 20, (height, width, 1))
    rgb = np.clip(np.stack([red, green, blue], axis=2) + grain, 0, 255).astype(np.uint8)
    alpha = np.where(np.hypot(x - 0.5, y - 0.5) < 0.3, 0, np.where(x < 0.1, 90, 255))
    parts = {1: [rgb[..., 0]], 2: [rgb[..., 0], alpha], 3: [*np.moveaxis(rgb, 2, 0)]}
    parts[4] = [*parts[3], alpha]
    return np.stack(parts[components], axis=2).astype(np.uint8)


WEBP = Preview(7)
STRAIGHT = {"quality": 75, "exact": True}
#: Textures whose finest levels are images alone.
KINDS = {
    "webp": Texture(corners_of(128, 128), [WEBP], 5),
    "jpeg": Texture(corners_of(128, 128), [Preview(7, "jpg", {"quality": 85})], 5),
    "avif": Texture(corners_of(128, 128), [Preview(7, "avif", {"quality": 60})], 5),
    "grey": Texture(corners_of(128, 128, 1), [Preview(7, "jpg", {"quality": 85})], 5),
    "grey and alpha": Texture(corners_of(128, 128, 2), [Preview(7, options=STRAIGHT)], 5),
    "alpha": Texture(corners_of(128, 128, 4), [Preview(7, options=STRAIGHT)], 5),
    "odd sides": Texture(corners_of(101, 75), [Preview(6)], 3),
    "wide": Texture(corners_of(300, 50), [Preview(4), Preview(5)], 2),
    "exact": Texture(corners_of(64, 64), [Preview(6, "jpg", {"quality": 90}, exact=True)], 3),
}


def digests(texture: Texture, levels: Sequence[Texels]) -> list[str]:
    """Of levels of a texture as they are shown."""
    shown = brightened(texture.texels, levels)
    return [hashlib.sha256(as_held(level)).hexdigest() for level in shown]


def shown_by(texture: Texture) -> list[Texels]:
    """The levels that its last preview gives, coarsest first."""
    preview, level = texture.previews[-1], levels_of(texture.texels)[texture.previews[-1].level]
    levels = [decoded(saved(level, preview), level.shape[2])]
    while len(levels) <= preview.level:
        levels.insert(0, halved(levels[0]))
    return levels


def whole(site: Site) -> str:
    """Whether all textures have all levels, as a condition."""
    wanted = [len(row["differences"]) for row in site.index["textures"]]
    return f"s.held?.every((held, t) => held === {wanted}[t])"


@pytest.fixture(scope="module")
def kinds(room: Site) -> Site:
    return with_previews(room, dict(enumerate(KINDS.values())))


def check_kinds(visitor: Any) -> None:
    for number, (name, texture) in enumerate(KINDS.items()):
        expected = digests(texture, shown_by(texture))
        assert visitor.page.evaluate(LEVELS, number) == expected, name


def test_texels_are_those_of_pillow(visit: Callable[..., Any], kinds: Site) -> None:
    """In every size and form: at their place, the right way up, colours under alpha 0 kept."""
    with visit(kinds) as visitor:
        visitor.until(whole(kinds))
        state = visitor.complete()
        check_kinds(visitor)
        assert visitor.page.evaluate("ptm.errors") == []
    assert (state["exact"], state["previews"]) == (False, len(KINDS) - 1)
    assert visitor.messages == []


def test_a_lossless_image_replaces_the_preview_of_its_level(
    visit: Callable[..., Any], room: Site
) -> None:
    texels = corners_of(64, 64, 4)
    lossless = Preview(6, options={"lossless": True, "exact": True}, exact=True)
    texture = Texture(texels, [Preview(6), lossless], 3)
    site = with_previews(room, {0: texture})
    files = [preview["file"] for preview in site.index["textures"][0]["previews"]]
    with visit(site) as visitor:
        visitor.until(f"{whole(site)} && s.exact")
        assert visitor.page.evaluate(LEVELS, 0) == digests(texture, levels_of(texels))
        assert files[1] in " ".join(exchange.path for exchange in visitor.visits)
    assert visitor.messages == []


def test_corners_are_in_their_corners(visit: Callable[..., Any], room: Site) -> None:
    """The pictures by previews and by exact levels are alike, seen from the door."""
    exact = {n: Texture(t.texels, []) for n, t in enumerate(KINDS.values())}
    pictures = []
    for site in (with_previews(room, dict(enumerate(KINDS.values()))), with_previews(room, exact)):
        with visit(site, reduced_motion="reduce") as visitor:
            visitor.until(whole(site))
            visitor.complete()
            pictures.append(visitor.picture().astype(int))
    assert np.abs(pictures[0] - pictures[1]).mean() < 3
    assert pictures[1].std(axis=(0, 1)).min() > 40


def test_without_a_canvas_for_workers(visit: Callable[..., Any], kinds: Site) -> None:
    def old(page: Any) -> None:
        page.add_init_script("delete globalThis.OffscreenCanvas")

    with visit(kinds, prepare=old) as visitor:
        visitor.until(whole(kinds))
        check_kinds(visitor)
    assert visitor.messages == []


def test_without_a_decoder_of_files(visit: Callable[..., Any], room: Site) -> None:
    """Previews are shown, and it is said that nothing else is."""
    site = refined(room, corners_of(128, 128), [WEBP])
    entries = {name: e for name, e in site.entries.items() if not name.endswith(".wasm")}
    with visit(Site(entries, site.index)) as visitor:
        state = visitor.until("window.ptm?.walk.begun && s.complete && ptm.errors.length > 0")
        assert visitor.page.evaluate("ptm.errors.map(({ code }) => code)") == ["PTM-V106"]
        assert not visitor.page.locator("#error").is_visible()
    assert state["previews"] > 3
    assert not state["exact"]


def refined(room: Site, texels: Texels, previews: Sequence[Preview], **more: Any) -> Site:
    """The room with one such texture on all walls and panels."""
    return with_previews(room, dict.fromkeys(range(COUNT), Texture(texels, previews, **more)))


class Held:
    """Requests for files that wait until `release`: ``with visit(…, prepare=held.hold)``."""

    def __init__(self, name: str) -> None:
        self._name, self._waiting, self._open = name, list[Any](), False

    def hold(self, page: Any) -> None:
        page.route(f"**/{self._name}", self._take)

    def _take(self, route: Any) -> None:
        if self._open:
            route.continue_()
        else:
            self._waiting.append(route)

    def release(self) -> None:
        self._open = True
        for route in self._waiting:
            route.continue_()


def test_exact_levels_replace_previews_in_place(visit: Callable[..., Any], room: Site) -> None:
    """Those of a file with tiles; without another storage, and without fading.

    Requests that are held must leave room for those of all previews, also at few frames a second:
    the page takes the connection for one of HTTP/2, where it has more requests open.
    """
    previews = [Preview(6), Preview(8, options={"quality": 95})]
    texture = Texture(corners_of(256, 256), previews, tile=128)
    site = with_previews(room, dict.fromkeys(range(COUNT), texture))
    held = Held("*.ptm")

    def prepare(page: Any) -> None:
        page.add_init_script(SECOND_PROTOCOL)
        held.hold(page)

    with visit(site, prepare=prepare) as visitor:
        visitor.until("s.held?.every((held) => held === 9)")
        state = visitor.state()
        assert (state["previews"], state["exact"], state["complete"]) == (COUNT, False, False)
        storages = "window.before = ptm.walk.rows.map((_, t) => ptm.walk.memory.of(t))"
        visitor.page.evaluate(f"{storages}")
        before = visitor.picture().astype(int)
        held.release()
        state = visitor.until("s.exact && s.previews === 0")
        assert state["complete"]
        # Coarser ones suffice for a while where the view does not resolve the finest.
        kept = "before.filter((one, t) => one === ptm.walk.memory.of(t)).length"
        resolved = "before.filter((_, t) => ptm.walk.needs.present[9 * t + 9 + t] > 0).length"
        assert visitor.page.evaluate(kept) >= visitor.page.evaluate(resolved) > 3
        assert visitor.page.evaluate(LEVELS, 0) == digests(texture, levels_of(texture.texels))
        assert 0 < np.abs(visitor.picture() - before).mean() < 3
    assert visitor.messages == []


@pytest.mark.parametrize(
    "spoil",
    [lambda data: data[: len(data) // 3], lambda data: b"\0" * len(data), lambda data: WRONG_SIZE],
    ids=["cut", "zeros", "size"],
)
def test_a_damaged_preview_is_left_out(
    visit: Callable[..., Any], room: Site, spoil: Callable[[bytes], bytes]
) -> None:
    """It is reported once, and requested once more; the exact levels are shown."""
    texture = Texture(corners_of(128, 128), [Preview(7, spoil=spoil)])
    alone = Texture(corners_of(128, 128), [Preview(5), Preview(7, spoil=spoil)], 3)
    site = with_previews(room, {0: texture, 4: alone})
    held = Held("t0.ptm")
    with visit(site, prepare=held.hold) as visitor:
        visitor.until("s.held?.[4] === 6 && ptm.errors.length === 2")
        held.release()
        visitor.until("s.held[0] === 8")
        state = visitor.complete()
        visitor.frames(60)
        assert visitor.page.evaluate(LEVELS, 0) == digests(texture, levels_of(texture.texels))
        errors = visitor.page.evaluate("ptm.errors.map(({ code }) => code)")
        asked = [v.path for v in visitor.visits]
    assert not state["exact"]
    assert errors == ["PTM-V105"] * 2
    assert [asked.count(f"/data/t{number}-7.webp") for number in (0, 4)] == [2, 2]
    assert visitor.messages == []


WRONG_SIZE = saved(corners_of(64, 128), WEBP)


def test_a_missing_preview(visit: Callable[..., Any], room: Site) -> None:
    site = refined(room, corners_of(128, 128), [WEBP])
    entries = {n: e for n, e in site.entries.items() if not n.endswith("t0-7.webp")}
    held = Held("t0.ptm")
    with visit(Site(entries, site.index), prepare=held.hold) as visitor:
        visitor.until("window.ptm?.errors.length > 0")
        held.release()
        visitor.until("s.exact")
        errors = visitor.page.evaluate("ptm.errors.map(({ code }) => code)")
    assert errors == ["PTM-V103"]


def test_a_lost_context(visit: Callable[..., Any], kinds: Site) -> None:
    with visit(kinds) as visitor:
        visitor.until(whole(kinds))
        visitor.lose_context()
        visitor.restore_context()
        visitor.until(whole(kinds))
        check_kinds(visitor)


def test_a_small_budget(visit: Callable[..., Any], room: Site) -> None:
    """It is never exceeded, and what is shown is exact in the end, though less of it."""
    site = refined(room, corners_of(256, 256), [Preview(6), Preview(7), Preview(8)])
    with visit(site, query="?memory=1") as visitor:
        visitor.until("s.exact")
        assert 0 < visitor.page.evaluate("counted.peak") <= 1 << 20
        visitor.page.evaluate("ptm.setBudget(200000)")
        visitor.until("s.residentBytes <= 200000")
        visitor.page.evaluate("counted.peak = counted.bytes")
        visitor.complete()
        visitor.until("s.exact")
        assert visitor.page.evaluate("counted.peak") <= 200_000
    assert visitor.messages == []


def test_the_data_saver(visit: Callable[..., Any], room: Site) -> None:
    """Textures in view become exact, and the others are not fetched for it."""
    site = refined(room, corners_of(256, 256), [Preview(6), Preview(8)])
    saver = "Object.defineProperty(navigator, 'connection', { value: { saveData: true } })"
    with visit(site, prepare=lambda page: page.add_init_script(saver)) as visitor:
        state = visitor.until("s.exact")
        assert state["dataSaver"]
        asked = state["requests"]
        visitor.frames(60)
        assert visitor.state()["requests"] == asked


def test_a_graphics_card_that_holds_small_textures_alone(
    visit: Callable[..., Any], room: Site
) -> None:
    """Levels beyond are left out with their previews, also where no others have them."""
    texels = corners_of(256, 256)
    previews = [Preview(5), Preview(8)]
    site = with_previews(room, {0: Texture(texels, previews), 1: Texture(texels, previews, 4)})

    def small(page: Any) -> None:
        page.add_init_script(
            "const { getParameter } = WebGL2RenderingContext.prototype;"
            "WebGL2RenderingContext.prototype.getParameter = function (name) {"
            "  return name === this.MAX_TEXTURE_SIZE ? 64 : getParameter.call(this, name);"
            "};"
        )

    with visit(site, prepare=small) as visitor:
        state = visitor.until("s.held?.[0] === 7 && s.held[1] === 6")
        visitor.until("s.complete")
        assert max(state["held"]) == 7
        assert visitor.page.evaluate("ptm.errors") == []
    assert visitor.messages == []


def test_comparing_with_levels_that_are_images(visit: Callable[..., Any], kinds: Site) -> None:
    with visit(kinds, reduced_motion="reduce") as visitor:
        visitor.until(whole(kinds))
        visitor.complete()
        full = visitor.picture()
        visitor.page.evaluate("ptm.setBudget(20000)")
        visitor.until("s.residentBytes <= 20000")
        visitor.page.evaluate("ptm.compare(true)")
        visitor.page.wait_for_function("ptm.walk.comparison?.settle()", polling=200)
        half = full.shape[1] // 2
        right = full[:, half + 1 :]
        both = visitor.picture_of(lambda shown: bool((shown[:, half + 1 :] == right).all()))
    np.testing.assert_array_equal(both[:, half + 1 :], right)


def test_the_papers_client(visit: Callable[..., Any], kinds: Site) -> None:
    """It has previews for the levels that the `.ptm` lacks, and no others."""
    site = with_previews(kinds, {0: Texture(corners_of(128, 128), [Preview(6), WEBP])})
    with visit(site, query="?policy=paper") as visitor:
        visitor.until("s.held?.[0] === 8 && s.held.filter((held) => held > 5).length > 5")
        asked = {v.path for v in visitor.visits}
    assert not any(path.startswith("/data/t0-") for path in asked)
    assert any(path.startswith("/data/t1-") for path in asked)


def test_long_names_of_previews_differ(tmp_path: Path) -> None:
    """All previews of a texture have one hash, so their names must differ in their ends."""
    # Grey shades, of which even small previews are worth while.
    shades = np.add.outer(np.arange(256), np.arange(256)) // 2
    image = np.repeat(shades[..., None], 3, axis=2).astype(np.uint8) + noise(3, 256) // 16
    name = "painting" * 8
    doc = GltfModel()
    doc.tree["images"] = [
        {"bufferView": doc.view(png(image)), "mimeType": "image/png", "name": name}
    ]
    doc.tree["textures"] = [{"source": 0}]
    doc.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    corners = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * SIZE
    doc.place(*(_primitive(doc, corners[quad], 0) for quad in QUADS))
    doc.tree["scenes"] = [{"nodes": [0]}]
    (tmp_path / "room.glb").write_bytes(doc.glb())
    database = build(tmp_path / "room.glb", tmp_path / "room.db", "--preview", "60")
    site = site_of(database, PLAIN)
    rows = site.index["textures"][0]["previews"]
    files = [row["file"] for row in rows]
    assert len({*files}) == len(files) > 1
    assert [len(site.entries[f"data/{file}"].read()) for file in files] == [
        row["bytes"] for row in rows
    ]
