"""The page of a campus in a browser."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Visitor, hurried, new_page, visiting, visiting_in

from ptmtools.cli.main import main
from ptmtools.errors import InputError
from ptmtools.folder_kinds import folder_kinds
from ptmtools.site.forms import form_site
from ptmtools.site.throttle import Throttle
from ptmtools.walk import read_walk
from ptmtools_lab.campus.options import CampusWalkOptions
from ptmtools_lab.campus.simulation import simulate_campus
from ptmtools_lab.campus.stock import read_stock
from ptmtools_lab.campus.world import CampusFrames, prepare_campus
from ptmtools_systems.campus.model import PRESETS, distances

from .test_recording import AT_ONCE

Open = Callable[..., AbstractContextManager[Visitor]]
#: `near` of the client.
NEAREST = 8
#: Draws of five frames.
DRAWS = """
async () => {
  const { gl } = ptm.files, { drawElements } = gl;
  let count = 0;
  gl.drawElements = (...given) => (count++, drawElements.apply(gl, given));
  for (let k = 0; k < 5; k++) await new Promise(requestAnimationFrame);
  delete gl.drawElements;
  return count;
}
"""


@pytest.fixture(scope="module")
def pages(chromium: Any) -> Iterator[dict[Any, Any]]:
    """One for sound campuses, and one that gives up soon."""
    own = {how: new_page(chromium, 320, 240, how) for how in (None, hurried)}
    yield own
    for page in own.values():
        page.context.close()


@pytest.fixture
def opened(chromium: Any, pages: dict[Any, Any]) -> Open:
    def of(folder: Path, query: str = "", **options: Any) -> AbstractContextManager[Visitor]:
        entries = form_site(folder, folder_kinds()["campus.json"]).entries
        if options.keys() <= {"prepare"} and (how := options.get("prepare")) in pages:
            return visiting_in(pages[how], entries, query=query)
        sizes = {"width": 320, "height": 240, **options}
        return visiting(chromium, entries, query=query, **sizes)

    return of


def fetched(visitor: Visitor) -> list[str]:
    """The files of the campus that were requested, in order."""
    parts = [v.path.split("/", 2)[-1] for v in visitor.visits if "/data-" in v.path]
    return [part for part in parts if part.startswith(("meshes/", "textures/"))]


def test_files_come_as_for_the_simulated_client(opened: Open, campus: Path) -> None:
    """Low detail of all objects, then high detail of the nearest."""
    stock, medium = read_stock(campus), PRESETS[1]
    eye = np.array([-5.0, 1.6, 3.0])
    order = np.argsort(distances(eye, stock.boxes, stock.barycentres), kind="stable").tolist()
    low = [stock.names[f] for k in order for f in stock.low(k)]
    high = [stock.names[f] for k in order[:NEAREST] for f in stock.high(k, medium, True)]
    with opened(campus, "?preset=Medium#-5,1.6,3,0") as visitor:
        state = visitor.until("s.complete")
        assert state["order"] == order
        assert state["near"] == state["full"] == order[:NEAREST]
        assert (state["preset"], state["sorts"]) == ("Medium", 1)
        assert visitor.messages == []
        files = fetched(visitor)
    masks = {name for name in (*low, *high) if name.endswith("_m.jpg")}
    assert set(files) == {*low, *high} - masks
    assert len(files) == len(set(files))
    first = len({*low} - masks)
    # Threads that run out of low detail begin with high detail.
    assert set(files[: first - 4]) <= set(low)
    assert set(files[first + 4 :]) <= {*high} - {*low}


def test_a_walk_refines_what_is_near(opened: Open, campus: Path) -> None:
    with opened(campus, "#-5,1.6,3,0") as visitor:
        state = visitor.until("s.complete")
        memory, files = state["memory"], len(fetched(visitor))
        visitor.page.evaluate("window.ptm.place([1e4, 1.6, 0], 0)")
        away = visitor.until("s.sorts > 1 && s.complete")
        assert len(fetched(visitor)) >= files
        # Out of view and far: the nearest of all are others, or hidden for a while.
        visitor.until(f"s.memory < {memory}")
        assert away["order"] != state["order"]
        visitor.page.evaluate("window.ptm.place([-5, 1.6, 3], 0)")
        back = visitor.until("s.sorts > 2 && s.complete")
        assert back["near"] == state["near"]
        before = len(fetched(visitor))
        visitor.frames(20)
        assert len(fetched(visitor)) == before  # files are kept


def test_a_recording_replays(
    opened: Open, campus: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The simulator fetches the same files, and masks, which the page does not draw. The visitor
    stands until the page has all of a place: how fast it is depends on the machine."""
    link = Throttle(4e6, 0.02)
    prepared = {"prepare": lambda page: page.add_init_script(AT_ONCE), "throttle": link}
    with opened(campus, "?preset=Medium#-25,1.6,3,0", **prepared) as visitor:
        visitor.until("s.complete")
        for sorts, x in ((2, 0), (3, 25)):
            visitor.page.evaluate(f"window.ptm.place([{x}, 1.6, 3], 0)")
            visitor.until(f"s.sorts >= {sorts} && s.complete && !s.pending")
        recording = visitor.page.evaluate("window.ptm.recording")
        asked = [v for v in visitor.visits if "/data-" in v.path]
        assert visitor.messages == []
    file = tmp_path / "walk.json"
    file.write_text(json.dumps(recording))
    walk = read_walk(file)
    assert walk.aspect == pytest.approx(320 / 240)
    assert walk.eye[[0, -1], 0].tolist() == [-25, 25]
    place = prepare_campus(campus, walk, frames=CampusFrames(every=0))
    options = CampusWalkOptions(bandwidth="4M", latency="20ms")
    run = simulate_campus(place, PRESETS[1], options)
    assert run.begun
    drawn = (campus / "textures" / v.path.rpartition("/")[2] for v in asked)
    masks = [f for d in drawn if (f := Path(str(d).replace("_d.jpg", "_m.jpg"))) != d if f.exists()]
    assert run.requests == pytest.approx(len(asked) + len(masks), rel=0.1)
    total = sum(v.bytes for v in asked) + sum(file.stat().st_size for file in masks)
    assert run.body == pytest.approx(total, rel=0.1)
    words = ["walk-campus", campus, "--walk", file, "--every", "0", "--preset", "medium"]
    assert main([str(word) for word in words]) == 0
    assert "medium" in capsys.readouterr().out.lower()


def test_nothing_was_recorded(opened: Open, campus: Path) -> None:
    with opened(campus) as visitor:
        visitor.until("s.begun")
        assert visitor.page.evaluate("window.ptm.recording") is None


#: Of the texture that was drawn last.
ANISOTROPY = """
() => {
  const gl = document.querySelector("#view").getContext("webgl2");
  const { TEXTURE_MAX_ANISOTROPY_EXT } = gl.getExtension("EXT_texture_filter_anisotropic");
  gl.activeTexture(gl.TEXTURE0);
  return gl.getSamplerParameter(gl.getParameter(gl.SAMPLER_BINDING), TEXTURE_MAX_ANISOTROPY_EXT);
}
"""


def test_it_is_drawn_and_walked_on(opened: Open, campus: Path) -> None:
    with opened(campus) as visitor:
        visitor.until("s.complete")
        picture = visitor.picture()
        sky = picture[2, 2]
        assert (np.abs(picture.astype(int) - sky).sum(axis=2) > 30).mean() > 0.2
        visitor.frames(30)
        assert visitor.page.evaluate(DRAWS) == 0  # nothing changes any more
        assert visitor.page.evaluate(ANISOTROPY) == 1  # no card draws
        eye = visitor.state()["pose"]["eye"]
        visitor.page.focus("canvas")
        visitor.page.keyboard.down("w")
        visitor.until(f"Math.hypot(s.pose.eye[0] - {eye[0]}, s.pose.eye[2] - {eye[2]}) > 1")
        assert visitor.page.evaluate(DRAWS) > 0
        visitor.page.keyboard.up("w")
        assert abs(visitor.state()["pose"]["eye"][1] - eye[1]) < 2


def test_places_and_presets(opened: Open, campus: Path) -> None:
    index = json.loads((campus / "campus.json").read_text())
    with opened(campus, width=480, height=360) as visitor:
        visitor.until("s.begun")
        page = visitor.page
        page.click("nav button")
        name = page.text_content("#places li button >> nth=0")
        label = name.replace(" ", "_").lower()
        (target,) = (o for o in index["objects"] if o["label"].lower() == label)
        page.click("#places li button >> nth=0")
        assert page.is_hidden("#places")
        expected = target["viewpoint"]["position"]
        visitor.until(f"Math.abs(s.pose.eye[0] - {expected[0]}) < 0.01")
        assert page.locator("#labels button:visible").count() > 0
        page.select_option("select", "Ultra")
        visitor.until("s.preset === 'Ultra' && s.complete")
        assert any(file.endswith("_512_d.jpg") for file in fetched(visitor))
        assert "preset=Ultra" in page.url


def test_icons_and_ranks(opened: Open, campus: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(campus, tmp_path / "campus"))
    file = folder / "campus.json"
    index = json.loads(file.read_text())
    small = next(o for o in index["objects"] if len(o["parts"]) > 1)
    small["rank"] = 1
    house = next(o for o in index["objects"] if o["label"] == "building_01_rectorate")
    house |= {"rank": 0, "icon": "books"}
    file.write_text(json.dumps(index))
    with opened(folder, width=480, height=360) as visitor:
        visitor.until("s.begun")
        page = visitor.page
        page.click("nav button")
        menu = page.locator("#places > li > button")
        assert menu.nth(0).text_content() == "Building 01 rectorate"
        assert menu.nth(1).text_content().casefold() == small["label"].replace("_", " ").casefold()
        assert menu.nth(0).locator("svg.icon path").count() == 1
        assert page.locator("#places svg").count() == 1
        menu.nth(0).locator("svg").click()
        page.wait_for_selector("#record iframe")


def test_a_record_is_beside_its_object(opened: Open, campus: Path) -> None:
    with opened(campus, width=800, height=600) as visitor:
        visitor.until("s.begun")
        page = visitor.page
        page.click("nav button")
        page.click("#places button:text('Building 01 rectorate')")
        frame = page.frame_locator("#record iframe")
        assert frame.locator("p").text_content() == "Built in 1903"
        assert page.text_content("#record h2") == "Building 01 rectorate"
        page.click("nav button")
        page.click("#places summary >> nth=0")
        page.click("#places details button >> nth=0")  # a tree, without a record
        assert page.is_hidden("#record")
        page.click("nav button")
        page.click("#places button:text('Building 01 rectorate')")
        page.wait_for_selector("#record iframe")
        page.keyboard.press("Escape")
        assert page.locator("#record iframe").count() == 0


def without_policy(page: Any) -> None:
    """Serves the page without its policy; to bypass it would bypass that of records, too, if the
    browser came to it in time."""

    def serve(route: Any) -> None:
        response = route.fetch()
        text = re.sub("<meta http-equiv[^>]*>", "", response.text())
        assert text != response.text()
        route.fulfill(response=response, body=text)

    page.route(re.compile(r"^http://[^/]*/(\?.*)?$"), serve)


@pytest.mark.parametrize("prepare", [without_policy, None])
def test_a_hostile_record_does_nothing(opened: Open, campus: Path, prepare: Any) -> None:
    """Without and with the policy of the page, which leaves the record its styles."""
    options = {"bypass_csp": False, "prepare": prepare or (lambda _: None)}
    with opened(campus, width=480, height=360, **options) as visitor:
        visitor.until("s.complete")
        page = visitor.page
        assert page.locator("head meta[http-equiv]").count() == (0 if prepare else 1)
        before, seen = page.url.partition("#")[0], len(visitor.visits)
        pages, dialogs = [], []
        page.context.on("page", lambda other: pages.append(other))
        page.on("dialog", lambda dialog: dialogs.append(dialog))
        page.click("nav button")
        page.click("#places button:text('Building 02 medicine')")
        frame = page.frame_locator("#record iframe")
        assert frame.locator("#kept").text_content() == "12 laboratories"
        assert (
            frame.locator("#kept").evaluate("(e) => getComputedStyle(e).color") == "rgb(255, 0, 0)"
        )
        assert frame.locator("#inline").evaluate("(e) => e.naturalWidth") == 1
        for target in ("#kept", "#send", "#script", "#leave", "#open"):
            frame.locator(target).click()
        visitor.frames(30)
        assert page.evaluate("window.broken") is None
        assert page.url.partition("#")[0] == before
        assert (pages, dialogs) == ([], [])
        paths = [visit.path for visit in list(visitor.visits)[seen:]]
        assert [path for path in paths if not path.startswith("/data-")] == []
        assert page.is_visible("#record")
        visitor.until("s.complete")


def test_a_damaged_record_is_a_notice(opened: Open, campus: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(campus, tmp_path / "folder"))
    (folder / "records/building_01_rectorate.txt").write_text("<p>Built in 1904</p>")
    with opened(folder, width=480, height=360) as visitor:
        visitor.until("s.begun")
        page = visitor.page
        page.click("nav button")
        page.click("#places button:text('Building 01 rectorate')")
        page.wait_for_selector("#notices p:has-text('building_01_rectorate.txt is damaged')")
        assert page.is_hidden("#record")
        assert page.is_hidden("#error")


def test_a_name_is_pressed_or_dragged(opened: Open, campus: Path) -> None:
    """A drag that begins on a name turns the visitor; a click leads to the object."""
    with opened(campus, width=480, height=360) as visitor:
        visitor.until("s.begun")
        page = visitor.page
        label = page.locator("#labels button:visible").first
        box = label.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        pose = visitor.state()["pose"]
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 60, y, steps=4)
        turned = visitor.until(f"Math.abs(s.pose.yaw - {pose['yaw']}) > 0.05")
        page.mouse.up()
        assert turned["pose"]["eye"] == pose["eye"]
        assert page.locator("#record iframe").count() == 0
        visitor.frames(10)
        label = page.locator("#labels button:has-text('Building'):visible").first
        name = label.text_content()
        index = json.loads((campus / "campus.json").read_text())
        (target,) = (o for o in index["objects"] if o["label"] == name.replace(" ", "_").lower())
        visitor.page.evaluate("window.ptm.place([-5, 1.6, 3], 0)")
        visitor.frames(10)
        label = page.locator(f"#labels button:text('{name}')")
        label.dispatch_event("click")  # of a screen reader
        place = target["viewpoint"]["position"]
        visitor.until(f"Math.abs(s.pose.eye[0] - {place[0]}) < 0.01")
        box = label.bounding_box()
        page.keyboard.press("Escape")
        visitor.page.evaluate(
            "([x, y, z, a]) => window.ptm.place([x, y, z + 0.5], a)",
            [*place, visitor.state()["pose"]["yaw"]],
        )
        visitor.until(f"Math.abs(s.pose.eye[2] - {place[2]}) > 0.3")
        page.locator(f"#labels button:text('{name}')").click()
        visitor.until(f"Math.abs(s.pose.eye[2] - {place[2]}) < 0.01")
        page.wait_for_selector("#record iframe")


def edited(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        document = json.loads((folder / "campus.json").read_text())
        change(document)
        (folder / "campus.json").write_text(json.dumps(document))

    return edit


def spoilt(pattern: str, change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        for file in folder.glob(pattern):
            file.write_bytes(change(file.read_bytes()))

    return spoil


#: Whether `ptm serve` refuses them.
FAULTS: dict[str, tuple[bool, Callable[[Path], None]]] = {
    "mesh cut": (False, spoilt("meshes/*_0.glb", lambda d: d[:99])),
    "mesh other": (False, spoilt("meshes/*_0.glb", lambda d: d[:200] + bytes(40) + d[240:])),
    "image cut": (False, spoilt("textures/*_128_d.jpg", lambda d: d[:50])),
    "image other": (False, spoilt("textures/*_128_d.jpg", lambda d: b"GIF89a" + d[6:])),
    "checksum": (False, edited(lambda d: d["textures"][0].update(crc32=7))),
    "no texture": (False, edited(lambda d: d["textures"].clear())),
    "material": (False, edited(lambda d: d["objects"][0].update(materials=[999]))),
    "no presets": (True, edited(lambda d: d["presets"].clear())),
    "leading out": (True, edited(lambda d: d["objects"][0]["meshes"][0].update(file="../x.glb"))),
    "record": (True, edited(lambda d: d["objects"][6]["record"].update(bytes=2**21))),
    "box": (True, edited(lambda d: d["objects"][0].update(box=[0, 0]))),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_damaged_files_give_a_message(
    opened: Open, campus: Path, tmp_path: Path, fault: str
) -> None:
    folder = Path(shutil.copytree(campus, tmp_path / "folder"))
    refused, damage = FAULTS[fault]
    damage(folder)
    if refused:
        with pytest.raises(InputError, match="PTM-I122"):
            opened(folder)
        return
    with opened(folder, prepare=hurried) as visitor:
        visitor.page.wait_for_selector("#error:not([hidden])", timeout=60_000)
        assert visitor.page.text_content("#error-code") == "PTM-V105"
