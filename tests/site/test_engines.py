"""The pages in Firefox and WebKitGTK: what the other modules test in Chromium, in short."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import visiting
from engines import PACKAGES, WITHOUT_CARD, Engine, EngineVisitor, visiting_by
from numpy.typing import NDArray

from ptmtools.folder_kinds import folder_kinds
from ptmtools.link import Conditions
from ptmtools.site.content import Site
from ptmtools.site.entry import SiteEntry
from ptmtools.site.forms import form_site
from ptmtools.texture import open as open_ptm
from ptmtools.texture.detail import with_offset
from ptmtools_lab.world import World
from ptmtools_systems.interlace import deinterlace
from tests.lab.conftest import walk_file, world
from tests.site.watching import HERE, Witness, same, write

from .previews import brightened, with_previews
from .test_forms import OCTREE_FAULTS, SET_FAULTS, check_texels
from .test_page import LEVELS, as_held, read
from .test_previews import KINDS, shown_by
from .test_statues import LEVELS as OCTREE_LEVELS, address, pose
from .test_tour import tour_file, toured

__all__ = ["tour_file", "toured", "walk_file", "world"]

WIDTH, HEIGHT = 512, 384
#: What follows the address of each form's page.
PLACES = {"apo.json": "#40,20,0.55", "interlace.json": "?all", "campus.json": "#-5,1.6,3,0"}
#: dB between the pictures of two engines, which smooth edges differently.
LIKE = 34.0


@pytest.fixture(scope="module", params=PACKAGES)
def engine(request: pytest.FixtureRequest, engines: Callable[[str], Engine]) -> Engine:
    return engines(request.param)


@pytest.fixture(scope="module")
def forms(statue: Path, pictures: dict[str, Path], campus: Path) -> dict[str, Site]:
    """The sites of single objects, by the names of their indices."""
    folders = {"apo.json": statue, "interlace.json": pictures["rgb-png"], "campus.json": campus}
    return {name: form_site(folder, folder_kinds()[name]) for name, folder in folders.items()}


def decibels(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """PSNR of two pictures."""
    assert one.shape == other.shape
    error = float(((one.astype(float) - other) ** 2).mean())
    return 10 * float(np.log10(255**2 / error)) if error else np.inf


def shows(visitor: EngineVisitor, picture: NDArray[np.uint8], like: float = LIKE) -> bool:
    """Whether it comes to show a picture: a screenshot of WebKitGTK may be of some frames ago."""
    return (
        decibels(visitor.picture_of(lambda seen: decibels(seen, picture) >= like), picture) >= like
    )


@pytest.fixture(scope="module")
def walked(chromium: Any, museum: Site) -> dict[int, Any]:
    """Of viewpoints: what Chromium draws, and its picture."""
    places = range(0, len(museum.index["viewpoints"]), 3)
    sizes = {"width": WIDTH, "height": HEIGHT, "reduced_motion": "reduce"}
    with visiting(chromium, museum.entries, **sizes) as visitor:
        return {place: (drawn(visitor.go(place)), visitor.picture()) for place in places}


def drawn(state: Mapping[str, Any]) -> list[Any]:
    return [state[name] for name in ("cell", "visible", "drawnCells")]


def test_a_walk(engine: Engine, museum: Site, walked: dict[int, Any]) -> None:
    """The cells that are drawn, the pictures and the texels are those of Chromium."""
    sizes = {"width": WIDTH, "height": HEIGHT, "smooth": True}
    with visiting_by(engine, museum.entries, **sizes) as visitor:
        assert engine.evaluate("matchMedia('(prefers-reduced-motion: reduce)').matches")
        for place, (cells, picture) in walked.items():
            assert drawn(visitor.go(place)) == cells
            assert shows(visitor, picture), place
        held = visitor.state()["held"]
        for texture, row in enumerate(museum.index["textures"]):
            if held[texture] < 6:
                continue
            with open_ptm(read(museum, row["file"])) as ptm:
                levels = list(zip(ptm.levels(), row["offsets"], strict=True))[: held[texture]]
            own = [hashlib.sha256(as_held(with_offset(*level))).hexdigest() for level in levels]
            assert engine.evaluate(LEVELS, texture)[: held[texture]] == own
        assert sum(levels > 5 for levels in held) > 3
    assert visitor.messages == []


def test_keys(engine: Engine, museum: Site) -> None:
    """They walk; a link to the place leads back there; Tab leads to every control."""
    with visiting_by(engine, museum.entries) as visitor:
        begun = visitor.complete()["pose"]
        engine.hold("w")
        there = f"s.pose.eye[0] - {begun['eye'][0]}, s.pose.eye[2] - {begun['eye'][2]}"
        visitor.until(f"Math.hypot({there}) > 1")
        engine.release("w")
        visitor.complete()
        engine.hold("ArrowLeft")
        visitor.until(f"s.pose.yaw > {begun['yaw']} + 0.2")
        engine.release("ArrowLeft")
        pose = visitor.complete()["pose"]
        reported = "location.hash.slice(1).split(',').map(Number)"
        yaw = f"Math.abs({reported}[3] - {np.degrees(pose['yaw']) % 360}) < 0.1"
        visitor.until(f"{yaw} && Math.abs({reported}[0] - {pose['eye'][0]}) < 0.01")
        engine.goto(engine.evaluate("location.href"))
        again = visitor.complete()["pose"]
        assert np.abs(np.subtract(again["eye"], pose["eye"])).max() < 0.01
        engine.evaluate("document.querySelector('#view').focus()")
        engine.press("Tab", "Enter")
        visitor.until("document.querySelector('#places ol button')")
        names = ["canvas"]
        while (name := engine.evaluate(FOCUS)) not in names:
            names.append(name)
            engine.press("Tab")
    assert len(names) > 5
    assert visitor.messages == []


def test_a_tour_by_keyboard(engine: Engine, toured: Site) -> None:
    """To the next stop and back, whose label has the focus; a marker opens it again."""
    label = "document.querySelector('#label')"
    with visiting_by(engine, toured.entries, query="?lang=en") as visitor:
        visitor.until("window.ptm.tour")
        visitor.complete()
        engine.evaluate("document.querySelector('#view').focus()")
        for key, stop in (("n", 0), ("n", 1), ("p", 0)):
            engine.press(key)
            visitor.until(f"window.ptm.tour.stop === {stop}")
            visitor.complete()
        visitor.until("document.activeElement.textContent === 'Night'")
        engine.press("Escape")
        visitor.until(f"{label}.hidden && document.activeElement.id === 'view'")
        visitor.until("window.ptm.tour.markers.shown.includes(0)")
        engine.evaluate("document.querySelector('#markers button').focus()")
        engine.press("Enter")
        visitor.until(f"!{label}.hidden")
        assert engine.evaluate("window.broken === undefined")
    assert visitor.messages == []


FOCUS = """
(() => {
  const { localName, id, textContent } = document.activeElement;
  return id === "view" || localName === "body" ? "canvas" : textContent;
})
"""


def test_decisions_of_policies(engine: Engine, world: World, tmp_path: Path) -> None:
    """At each look and each arrival of a walk, those of the simulated client."""
    root = HERE.parents[1]
    files = [*(root / "web").rglob("*.js"), *HERE.glob("*.mjs")]
    names = {str(file.relative_to(root)): file for file in files}
    entries = {name: SiteEntry(name, file, "text/javascript") for name, file in names.items()}
    entries["index.html"] = SiteEntry("index.html", b"<head></head>", "text/html")
    answers = {}
    for policy in ("best", "paper"):
        witness = Witness(world, policy, world.catalogue.whole // 4)
        witness.walk(Conditions(512e3))
        write(tmp_path / policy, witness.document())
        entries[policy] = SiteEntry(policy, tmp_path / policy, "application/json")
        answers[policy] = witness.answers
        assert len(answers[policy]) > 50
    with visiting_by(engine, entries) as visitor:
        for policy, expected in answers.items():
            assert same(engine.evaluate(REPLAY, policy), expected)
    assert visitor.messages == []


REPLAY = """
async (policy) => {
  const { replay } = await import("/tests/site/replay.mjs");
  return replay(await (await fetch(policy)).json());
}
"""


def test_a_lost_context(engine: Engine, museum: Site) -> None:
    """All comes back, from bytes that are here: nothing is asked for again."""
    with visiting_by(engine, museum.entries, width=WIDTH, height=HEIGHT) as visitor:
        visitor.complete()
        visitor.until("s.pending === 0")
        before, requests = visitor.picture(), visitor.state()["requests"]
        visitor.lose_context()
        visitor.restore_context()
        visitor.complete()
        assert visitor.state()["requests"] == requests
        assert shows(visitor, before, np.inf)


#: The texels of a texture on the GPU, of its finest level.
TEXELS = """
(texture) => {
  const { gl, memory } = ptm.walk, storage = memory.of(texture);
  const { width, height } = storage.sizes.at(-1);
  const frame = gl.createFramebuffer(), rgba = new Uint8Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, storage.texture, 0);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(frame);
  return [...rgba];
}
"""


#: The largest errors of colours by rounding: of alpha, and of the conversion from YCbCr.
ROUNDED = {("firefox", "avif"): 4, ("webkit", "alpha"): 1, ("webkit", "grey and alpha"): 1}


def test_previews(engine: Engine, museum: Site) -> None:
    """Their texels are those of Pillow."""
    site = with_previews(museum, dict(enumerate(KINDS.values())))
    wanted = [len(row["differences"]) for row in site.index["textures"]][: len(KINDS)]
    with visiting_by(engine, site.entries, width=WIDTH, height=HEIGHT) as visitor:
        visitor.until(f"{wanted}.every((levels, t) => s.held?.[t] === levels)")
        for number, (name, texture) in enumerate(KINDS.items()):
            level = brightened(texture.texels, shown_by(texture))[-1]
            expected = np.frombuffer(as_held(level), np.uint8)
            actual = np.array(engine.evaluate(TEXELS, number), np.uint8)
            error = np.abs(actual.astype(int) - expected).reshape(*level.shape[:2], 4)
            if level.shape[2] % 2 == 0 and engine.name == "webkit":
                # It multiplies colours by alpha and divides them again.
                error = error * level[..., -1:] // 255
            assert error.max() <= ROUNDED.get((engine.name, name), 0), name
        assert engine.evaluate("ptm.errors") == []
    assert visitor.messages == []


def test_damaged_files(engine: Engine, museum: Site) -> None:
    """A walk goes on without a texture, and does not begin without its first room."""
    entries, row = dict(museum.entries), museum.index["textures"][0]
    name = f"data/{row['file']}"
    data = entries[name].read()
    entries[name] = replace(entries[name], source=data[:60] + bytes(9) + data[69:], state=None)
    with visiting_by(engine, entries) as visitor:
        visitor.until("ptm.errors.length > 0 && s.held.some((held) => held > 3)")
        assert engine.evaluate("ptm.errors[0].code") == "PTM-V105"
    first = museum.index["cells"][museum.index["viewpoints"][0]["cell"]]["geometry"]
    del entries[f"data/{first}"]
    with visiting_by(engine, entries) as visitor:
        assert failed(visitor) == "PTM-V103"


def failed(visitor: EngineVisitor) -> str:
    """The code on the page's message."""
    visitor.until("document.querySelector('#error:not([hidden])')")
    code: str = visitor.page.evaluate("document.querySelector('#error-code').textContent")
    return code


@pytest.fixture(scope="module")
def shown(chromium: Any, forms: dict[str, Site]) -> dict[str, NDArray[np.uint8]]:
    """Chromium's picture of each form, without smooth edges, as in the other engines."""
    pictures = {}
    for name, site in forms.items():
        sizes = {"width": WIDTH, "height": HEIGHT, "query": PLACES[name]}
        sizes["prepare"] = lambda page: page.add_init_script(WITHOUT_CARD)
        with visiting(chromium, site.entries, **sizes) as visitor:
            visitor.until("s.complete")
            visitor.complete()
            pictures[name] = visitor.picture()
    return pictures


#: Of each form: a key, and what it changes, of `before` and the state `s`.
EFFECTS = {
    "apo.json": ("ArrowRight", "Math.abs(s.camera.eye[0] - before.camera.eye[0]) > 0.05"),
    "campus.json": ("ArrowLeft", "s.pose.yaw - before.pose.yaw > 0.2"),
}


@pytest.mark.parametrize("form", PLACES)
def test_forms(
    engine: Engine, forms: dict[str, Site], shown: dict[str, NDArray[np.uint8]], form: str
) -> None:
    """The picture is Chromium's; keys move it; a lost context is reported."""
    sizes = {"width": WIDTH, "height": HEIGHT, "query": PLACES[form]}
    with visiting_by(engine, forms[form].entries, **sizes) as visitor:
        visitor.until("s.complete")
        visitor.complete()
        assert shows(visitor, shown[form])
        if form in EFFECTS:
            key, moved = EFFECTS[form]
            engine.evaluate("document.querySelector('#view').focus()")
            engine.evaluate("window.before = structuredClone(ptm.state())")
            engine.hold(key)
            visitor.until(moved)
            engine.release(key)
        gl = "document.querySelector('#view').getContext('webgl2')"
        engine.evaluate(f"{gl}.getExtension('WEBGL_lose_context').loseContext()")
        assert failed(visitor) == "PTM-V107"
    assert visitor.messages == []


#: Of each form: what two fingers that part, and one that goes right, change.
ZOOMED = {
    "apo.json": "s.camera.away < 0.8 * before.camera.away",
    "interlace.json": "s.pixels > 1.3 * before.pixels",
}
DRAGGED = {
    "apo.json": "Math.abs(s.camera.eye[0] - before.camera.eye[0]) > 0.05",
    "interlace.json": "s.shift[0] > before.shift[0] + 40",
}


@pytest.mark.parametrize("form", ZOOMED)
def test_fingers(engine: Engine, forms: dict[str, Site], form: str) -> None:
    with visiting_by(engine, forms[form].entries, width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete || s.needed === false || s.paused")
        steps = [(x, 200) for x in range(200, 320, 20)]
        pinch = [(x, 200) for x in range(200, 80, -20)], steps
        for fingers, changed in (([steps], DRAGGED[form]), (pinch, ZOOMED[form])):
            engine.evaluate("window.before = structuredClone(ptm.state())")
            engine.touch(*fingers)
            visitor.until(changed, 20)
    assert visitor.messages == []


def test_fingers_walk(engine: Engine, museum: Site) -> None:
    """A thumb that goes up walks ahead; two fingers look and do not walk."""
    with visiting_by(engine, museum.entries, width=WIDTH, height=HEIGHT) as visitor:
        before = visitor.complete()["pose"]
        engine.touch([(256, 300), *((256, 220) for _ in range(20))])
        x, _, z = before["eye"]
        visitor.until(f"Math.hypot(s.pose.eye[0] - {x}, s.pose.eye[2] - {z}) > 0.1", 20)
        before = visitor.complete()["pose"]
        down = [(200, y) for y in range(200, 280, 20)]
        engine.touch(down, [(x + 100, y) for x, y in down])
        after = visitor.until(f"s.pose.pitch > {before['pitch']} + 0.05", 20)["pose"]
        assert np.abs(np.subtract(after["eye"], before["eye"])).max() < 0.05
    assert visitor.messages == []


@pytest.fixture(scope="module")
def statue_view(chromium: Any, statues: Site, statues_db: Path) -> tuple[str, NDArray[np.uint8]]:
    """The address of a view of a statue, and Chromium's picture of it."""
    where = address(*pose(statues_db, 1, 0.9))
    sizes = {"width": WIDTH, "height": HEIGHT, "query": where, "reduced_motion": "reduce"}
    with visiting(chromium, statues.entries, **sizes) as visitor:
        visitor.complete()
        return where, visitor.picture()


def test_statues_of_a_walk(
    engine: Engine, statues: Site, statue_view: tuple[str, NDArray[np.uint8]]
) -> None:
    """They are drawn as by Chromium; without a damaged octree the walk goes on."""
    where, picture = statue_view
    sizes = {"width": WIDTH, "height": HEIGHT, "query": where}
    with visiting_by(engine, statues.entries, **sizes) as visitor:
        visitor.complete()
        assert engine.evaluate(OCTREE_LEVELS)[1] >= 6
        assert shows(visitor, picture)
    assert visitor.messages == []
    (name,) = (name for name in statues.entries if "statue_02" in name)
    data = statues.entries[name].read()
    spoilt = replace(statues.entries[name], source=data[:50] + bytes(99) + data[149:], state=None)
    with visiting_by(engine, {**statues.entries, name: spoilt}, **sizes) as visitor:
        visitor.until("ptm.errors.length > 0 && s.complete")
        assert engine.evaluate("ptm.errors[0].code") == "PTM-V105"
        assert engine.evaluate("document.querySelector('#error').hidden")


@pytest.mark.parametrize("kind", ["rgb-png", "rgba-png", "grey-webp", "rgba-webp"])
def test_interlaced_texels(engine: Engine, pictures: dict[str, Path], kind: str) -> None:
    expected = deinterlace(pictures[kind])
    site = form_site(pictures[kind], folder_kinds()["interlace.json"])
    with visiting_by(engine, site.entries, query="?all", width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        actual = np.array(engine.evaluate("[...ptm.texels()]"), np.uint8)
    assert visitor.messages == []
    check_texels(actual, expected)


@pytest.mark.parametrize("form", PLACES)
def test_damaged_forms(
    engine: Engine, tmp_path: Path, form: str, statue: Path, pictures: dict[str, Path], campus: Path
) -> None:
    sources = {"apo.json": statue, "interlace.json": pictures["rgb-png"], "campus.json": campus}
    folder = Path(shutil.copytree(sources[form], tmp_path / "folder"))
    if form == "campus.json":
        for file in folder.glob("textures/*_128_d.jpg"):
            file.write_bytes(b"GIF89a" + file.read_bytes()[6:])
    else:
        (OCTREE_FAULTS if form == "apo.json" else SET_FAULTS)["other"](folder)
    entries = form_site(folder, folder_kinds()[form]).entries
    with visiting_by(engine, entries, query=PLACES[form]) as visitor:
        assert failed(visitor) == "PTM-V105"
