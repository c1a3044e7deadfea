"""The pages of single objects in a browser: octree textures and interlaced images."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Visitor, hurried, new_page, visiting, visiting_in
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.errors import InputError
from ptmtools.folder_kinds import folder_kind, folder_kinds
from ptmtools.site.content import SiteOptions
from ptmtools.site.entry import is_marked
from ptmtools.site.forms import form_site
from ptmtools.site.lookup import files_of
from ptmtools.site.throttle import Throttle
from ptmtools_systems.apo.files import read_mesh, read_octree
from ptmtools_systems.apo.picture import RenderOptions, render
from ptmtools_systems.interlace import deinterlace

from .test_page_faults import ATTACK

SIDE = 320
Open = Callable[..., AbstractContextManager[Visitor]]


@pytest.fixture(scope="module")
def pages(chromium: Any) -> Iterator[dict[Any, Any]]:
    """One for sound files, and one that gives up soon."""
    own = {how: new_page(chromium, SIDE, SIDE, how) for how in (None, hurried)}
    yield own
    for page in own.values():
        page.context.close()


@pytest.fixture
def opened(chromium: Any, pages: dict[Any, Any]) -> Open:
    def of(folder: Path, query: str = "", **options: Any) -> AbstractContextManager[Visitor]:
        form = folder_kind(folder)
        assert form
        entries = form_site(folder, form).entries
        if options.keys() <= {"prepare"}:
            return visiting_in(pages[options.get("prepare")], entries, query=query)
        sizes = {"width": SIDE, "height": SIDE, **options}
        return visiting(chromium, entries, query=query, **sizes)

    return of


def decibels(one: np.ndarray, other: np.ndarray, where: np.ndarray) -> float:
    error = float(((one[where].astype(float) - other[where]) ** 2).mean())
    return 10 * float(np.log10(255**2 / max(error, 1e-9)))


def inner(covered: np.ndarray) -> np.ndarray:
    """The pixels of which all neighbours within three are covered."""
    inside = covered.copy()
    for dy in range(-3, 4):
        for dx in range(-3, 4):
            inside &= np.roll(covered, (dy, dx), (0, 1))
    return inside


@pytest.mark.parametrize("levels", [0, 3, 7, 8, 9])
@pytest.mark.parametrize("what", ["shaded", "normals"])
def test_the_octree_is_drawn_as_by_render(
    opened: Open, statue: Path, levels: int, what: str
) -> None:
    octree, mesh = read_octree(statue), read_mesh(statue)
    options = RenderOptions(
        levels=levels, azimuth=40, elevation=20, width=SIDE, height=SIDE, what=what,
        backend="embree",
    )  # fmt: skip
    expected = render(octree, mesh.points, mesh.triangles, options, mesh.normals)
    query = f"?levels={levels}{'&normals' if what == 'normals' else ''}#40,20"
    with opened(statue, query) as visitor:
        visitor.until(f"s.levels >= {levels} || s.complete || s.paused")
        if levels > 7:
            visitor.page.evaluate("window.ptm.place(40, 20, 0.6)")  # near enough for all
            visitor.until(f"s.levels >= {min(levels, octree.levels)}")
            visitor.page.evaluate("window.ptm.place(40, 20)")
        picture = visitor.picture()
        assert visitor.messages == []
    where = inner(expected.covered)
    assert where.sum() > 0.2 * SIDE**2
    assert decibels(picture, expected.picture, where) >= 45
    assert (picture[0, 0] == expected.picture[0, 0]).all()


def test_levels_come_when_they_are_visible(opened: Open, statue: Path) -> None:
    index = json.loads((statue / "apo.json").read_text())
    ends = index["normals"]["ends"]
    with opened(statue, "#0,0,15") as visitor:
        state = visitor.until("s.paused && !s.pending")
        assert state["levels"] == 7  # the first request
        asked = [v.range for v in visitor.visits if v.path.endswith("apo.bin")]
        assert asked == [f"bytes=2-{ends[6] - 1}"]
        visitor.page.evaluate("window.ptm.place(0, 0, 0.55)")
        visitor.until("s.complete")
        asked = [v.range for v in visitor.visits if v.path.endswith("apo.bin")]
        assert len(asked) == 1 + len(ends) - 7
        visitor.until("!s.paused")
        assert f"{len(ends)} of {len(ends)} levels" in visitor.page.text_content("#status")


def test_parts_of_levels_are_shown_at_time_steps(opened: Open, statue: Path) -> None:
    """The paper's second update: texels of a level before all of it is there."""
    slow = Throttle(2e6, 0)
    with opened(statue, "?update=steps&step=0.1#0,0,0.55", throttle=slow) as visitor:
        visitor.until("s.partial")
        partial = visitor.picture()
        visitor.until("s.complete && !s.partial")
        state = visitor.complete()  # two frames later: it is on the screen
        whole = visitor.picture()
        levels = len(json.loads((statue / "apo.json").read_text())["levels"])
        assert state["updates"] > levels - 6
        assert (partial != whole).any()
        assert visitor.messages == []
    with opened(statue, "#0,0,0.55") as visitor:
        visitor.until("s.complete")
        visitor.complete()
        assert (visitor.picture() == whole).all()


LOSE = """(() => {
  const gl = document.querySelector("canvas").getContext("webgl2");
  const card = (window.card = gl.getExtension("WEBGL_lose_context"));
  window.before = true;
  card.loseContext();
  setTimeout(() => card.restoreContext(), 300);
})()"""


def test_a_lost_context_comes_back(opened: Open, statue: Path) -> None:
    with opened(statue, "#40,10,2") as visitor:
        visitor.until("s.levels > 3")
        # An early loss is an error, see the next test.
        visitor.page.wait_for_function("performance.now() > 5500")
        visitor.page.evaluate("window.ptm.place(80, 20, 1.5)")
        with visitor.page.expect_navigation():
            visitor.page.evaluate(LOSE)
        visitor.page.wait_for_function("window.ptm?.state()")
        visitor.until("s.levels > 3 && !window.before")
        assert visitor.page.url.endswith("#80,20,1.5")
        assert visitor.page.is_hidden("#error")
        assert visitor.picture().std() > 5


def test_a_context_that_is_lost_at_once_is_an_error(opened: Open, statue: Path) -> None:
    with opened(statue) as visitor:
        visitor.until("s.levels !== undefined")
        visitor.page.evaluate(LOSE)
        visitor.page.wait_for_selector("#error:not([hidden])")
        assert visitor.page.text_content("#error-code") == "PTM-V107"
        visitor.frames(40)
        assert visitor.page.evaluate("window.before")  # it was not loaded again


def test_keys_and_the_wheel(opened: Open, statue: Path) -> None:
    with opened(statue) as visitor:
        before = visitor.until("s.camera")["camera"]
        visitor.page.focus("canvas")
        visitor.page.keyboard.down("ArrowRight")
        visitor.until(f"Math.abs(s.camera.eye[0] - {before['eye'][0]}) > 0.05")
        visitor.page.keyboard.up("ArrowRight")
        visitor.page.mouse.move(100, 100)
        visitor.page.mouse.wheel(0, -300)
        visitor.until(f"s.camera.away < 0.8 * {before['away']}")


OUTLINE = "getComputedStyle(document.querySelector('canvas')).outlineStyle"


def test_the_focus_is_seen_with_keys(opened: Open, statue: Path, pictures: dict[str, Path]) -> None:
    for folder in (statue, pictures["rgb-png"]):
        with opened(folder) as visitor:
            visitor.until("s.pending === 0")
            visitor.page.wait_for_function("document.activeElement.tagName === 'CANVAS'")
            assert visitor.page.evaluate(OUTLINE) == "none"
            visitor.page.keyboard.press("ArrowRight")
            assert visitor.page.evaluate(OUTLINE) == "solid"


@pytest.mark.parametrize(
    "name", ["grey-png", "rgb-png", "rgba-png", "grey-webp", "rgb-webp", "rgba-webp"]
)
def test_interlaced_files_are_joined_exactly(
    opened: Open, pictures: dict[str, Path], name: str
) -> None:
    expected = deinterlace(pictures[name])
    with opened(pictures[name], "?all") as visitor:
        visitor.until("s.complete")
        texels = np.array(visitor.page.evaluate("[...window.ptm.texels()]"), np.uint8)
        assert visitor.messages == []
    check_texels(texels, expected)


def check_texels(texels: np.ndarray, expected: np.ndarray) -> None:
    """That texels (4hw) of the page are those of an image (h, w[, c])."""
    shape = (*expected.shape[:2], 4)
    actual = texels.reshape(shape)
    full = np.full(shape, 255, np.uint8)
    if expected.ndim == 2 or expected.shape[2] == 1:
        full[..., :3] = expected.reshape(*shape[:2], 1)
    else:
        full[..., : expected.shape[2]] = expected
    # A browser may drop the colour of texels that are not seen at all.
    seen = full[..., 3] > 0
    assert (actual[..., 3] == full[..., 3]).all()
    assert (actual[seen] == full[seen]).all()


def test_the_pages_need_nothing_that_their_policies_refuse(
    opened: Open, pictures: dict[str, Path], statue: Path, campus: Path
) -> None:
    for folder, query in ((pictures["rgba-webp"], "?all"), (statue, ""), (campus, "")):
        with opened(folder, query, bypass_csp=False) as visitor:
            visitor.until("s.complete")
            assert visitor.messages == []
            visitor.page.evaluate(ATTACK)
            visitor.frames(5)
            assert visitor.page.evaluate("window.broken") is None
        assert any("Content Security Policy" in message for message in visitor.messages)


def test_files_come_as_far_as_they_are_needed(opened: Open, pictures: dict[str, Path]) -> None:
    with opened(pictures["rgb-png"], width=40, height=40) as visitor:
        state = visitor.until("s.steps && !s.needed && !s.pending")
        assert (state["size"], state["steps"]) == ({"width": 64, "height": 64}, 3)
        asked = [v.path.rpartition("/")[2] for v in visitor.visits]
        assert [name for name in asked if name.endswith(".png")] == ["1.png", "2.png", "3.png"]
        visitor.page.evaluate("window.ptm.place(1)")
        visitor.until("s.complete")


def test_sixteen_bits_are_shown_in_eight(opened: Open, pictures: dict[str, Path]) -> None:
    with opened(pictures["deep-png"], "?all") as visitor:
        visitor.until("s.complete")
        visitor.page.wait_for_function(
            "document.querySelector('#status').textContent.includes('shown in 8 bits')"
        )


def changed(folder: Path, name: str, change: Callable[[bytes], bytes]) -> None:
    (folder / name).write_bytes(change((folder / name).read_bytes()))


def edited(folder: Path, name: str, change: Callable[[dict[str, Any]], object]) -> None:
    document = json.loads((folder / name).read_text())
    change(document)
    (folder / name).write_text(json.dumps(document))


OCTREE_FAULTS: dict[str, Callable[[Path], object]] = {
    "cut": lambda f: changed(f, "apo.bin", lambda d: d[: len(d) // 3]),
    "other": lambda f: changed(f, "apo.bin", lambda d: d[:40] + bytes(64) + d[104:]),
    "empty": lambda f: changed(f, "apo.bin", lambda d: b""),
    "mesh": lambda f: changed(f, "mesh.glb", lambda d: d[:-8] + bytes(8)),
    "no glb": lambda f: changed(f, "mesh.glb", lambda d: b"x" * 40),
    "checksum": lambda f: edited(f, "apo.json", lambda d: d["normals"]["crc32"].reverse()),
    "levels": lambda f: edited(f, "apo.json", lambda d: d["levels"].reverse()),
    "huge": lambda f: edited(f, "apo.json", lambda d: d["levels"].append(2**31)),
    "ends": lambda f: edited(f, "apo.json", lambda d: d["normals"]["ends"].reverse()),
    "cube": lambda f: edited(f, "apo.json", lambda d: d["cube"].update(low=[0, 0, 1e300])),
}


SET_FAULTS: dict[str, Callable[[Path], object]] = {
    "too many bytes": lambda f: edited(
        f, "interlace.json", lambda d: d["files"][-1].update(bytes=2**30)
    ),
    "cut": lambda f: changed(f, "1.png", lambda d: d[: len(d) // 2]),
    "other": lambda f: changed(f, "1.png", lambda d: b"GIF89a" + d[6:]),
    "swapped": lambda f: shutil.copyfile(f / "2.png", f / "1.png"),
    "axis": lambda f: edited(f, "interlace.json", lambda d: d["files"][1].update(axis="rows")),
    "size": lambda f: edited(f, "interlace.json", lambda d: d.update(width=512)),
    "wide": lambda f: edited(f, "interlace.json", lambda d: d["files"][0].update(width=65536)),
    "bytes": lambda f: edited(f, "interlace.json", lambda d: d["files"][0].update(bytes=7)),
    "crc": lambda f: edited(f, "interlace.json", lambda d: d["files"][0].update(crc32=7)),
    "none": lambda f: edited(f, "interlace.json", lambda d: d["files"].clear()),
    "leading out": lambda f: edited(
        f, "interlace.json", lambda d: d["files"][0].update(name="../../1.png")
    ),
}


#: Those that `ptm serve` and `ptm publish` find.
REFUSED = {"cube", "none", "leading out"}
SHORT = {"cut", "empty"}


@pytest.mark.parametrize(
    ("kind", "fault"),
    [("octree", fault) for fault in OCTREE_FAULTS] + [("set", fault) for fault in SET_FAULTS],
)
def test_damaged_files_give_a_message(
    opened: Open, statue: Path, pictures: dict[str, Path], tmp_path: Path, kind: str, fault: str
) -> None:
    """By `ptm serve`, or else by the page."""
    source = statue if kind == "octree" else pictures["rgb-png"]
    folder = Path(shutil.copytree(source, tmp_path / "folder"))
    (OCTREE_FAULTS if kind == "octree" else SET_FAULTS)[fault](folder)
    if fault in REFUSED:
        with pytest.raises(InputError, match="PTM-I122"):
            opened(folder)
        return
    with opened(folder, "#0,0,0.55", prepare=hurried) as visitor:
        visitor.page.wait_for_selector("#error:not([hidden])", timeout=60_000)
        # A file that is too short is refused by the server, or cannot be downloaded.
        codes = {"PTM-V103", "PTM-V104", "PTM-V105"} if fault in SHORT else {"PTM-V105"}
        assert visitor.page.text_content("#error-code") in codes
        assert not any("error: " in m and "Uncaught" in m for m in visitor.messages)


def test_every_form_has_a_page(statue: Path, pictures: dict[str, Path]) -> None:
    folders = {"apo.json": statue, "interlace.json": pictures["rgb-png"]}
    for name, folder in folders.items():
        form = folder_kinds()[name]
        site = form_site(folder, form, SiteOptions("A <title>", address="https://example.org/x"))
        page = site.entries["index.html"].read().decode()
        assert "<title>A &lt;title&gt;</title>" in page
        assert form.script.name in page
        assert '<link rel="canonical" href="https://example.org/x/">' in page
        assert "manifest.webmanifest" in site.entries
        (index,) = (e for n, e in site.entries.items() if n.endswith(name))
        assert index.forever
        assert all(is_marked(name) == entry.forever for name, entry in site.entries.items())


def test_a_kind_brings_its_script(statue: Path, tmp_path: Path) -> None:
    """From a file of its own package."""
    script = tmp_path / "own.js"
    kind = replace(folder_kinds()["apo.json"], script=script)
    with pytest.raises(InputError, match="or the plug-in") as raised:
        form_site(statue, kind)
    assert (raised.value.code, raised.value.file) == ("PTM-I122", str(script))
    script.write_text("export {};")
    entries = form_site(statue, kind).entries
    (name,) = (name for name in entries if name.endswith("/own.js"))
    assert entries[name].read() == b"export {};"
    assert f'src="{name}"' in entries["index.html"].read().decode()


def test_a_published_folder(
    chromium: Any, statue: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["publish", str(statue), "-o", str(tmp_path / "site"), "--title", "Ball"]) == 0
    assert "download: page" in capsys.readouterr().out
    files = files_of(tmp_path / "site")
    with visiting(chromium, files, query="#0,0,0.55", width=SIDE, height=SIDE) as visitor:
        visitor.until("s.complete")
        assert visitor.page.title() == "Ball"
        assert visitor.messages == []
    assert (
        main(["-q", "publish", str(statue), "-o", str(tmp_path / "site"), "--title", "Ball"]) == 0
    )
    damaged = Path(shutil.copytree(statue, tmp_path / "damaged.apo"))
    OCTREE_FAULTS["other"](damaged)
    assert main(["publish", str(damaged), "-o", str(tmp_path / "other")]) == 5
    assert "PTM-D006" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


def test_links_are_refused(statue: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(statue, tmp_path / "folder"))
    (tmp_path / "secret").write_bytes((folder / "apo.bin").read_bytes())
    (folder / "apo.bin").unlink()
    (folder / "apo.bin").symlink_to(tmp_path / "secret")
    with pytest.raises(InputError, match="PTM-I122"):
        form_site(folder, folder_kinds()["apo.json"])


def test_publishing_checks_the_form_that_it_writes(
    statue: Path, pictures: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also in a folder of two."""
    folder = Path(shutil.copytree(statue, tmp_path / "both"))
    shutil.copytree(pictures["rgb-png"], folder, dirs_exist_ok=True)
    OCTREE_FAULTS["other"](folder)
    assert main(["publish", str(folder), "-o", str(tmp_path / "site")]) == 5
    assert main(["publish", str(statue), "-o", str(tmp_path / "site"), "--poster", "x.png"]) == 2
    assert "--title" in capsys.readouterr().err


def test_pictures_have_the_ratio_of_their_source(opened: Open, tmp_path: Path) -> None:
    """Whose sides were scaled to powers of two."""
    Image.fromarray(np.full((96, 128, 3), 255, np.uint8)).save(tmp_path / "b.png")
    assert main(["-q", "interlace", str(tmp_path / "b.png"), "-o", str(tmp_path / "b")]) == 0
    with opened(tmp_path / "b", "?all", width=400, height=400) as visitor:
        visitor.until("s.complete")
        white = (visitor.picture() > 250).all(axis=2)
    rows, columns = np.flatnonzero(white.any(axis=1)), np.flatnonzero(white.any(axis=0))
    assert len(columns) > 390  # but for the outline of the focus
    assert 290 <= len(rows) <= 310  # 4 : 3


def test_a_host_without_ranges(chromium: Any, statue: Path) -> None:
    """Which sends the whole file: once."""
    site = form_site(statue, folder_kinds()["apo.json"])

    def whole(route: Any) -> None:
        headers = {k: v for k, v in route.request.headers.items() if k.lower() != "range"}
        route.continue_(headers=headers)

    def prepare(page: Any) -> None:
        page.route("**/apo.bin", whole)

    with visiting(
        chromium, site.entries, query="#0,0,0.55", width=SIDE, height=SIDE, prepare=prepare
    ) as visitor:
        visitor.until("s.complete")
        assert len([v for v in visitor.visits if v.path.endswith("apo.bin")]) == 1


def test_a_missing_file(statue: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(statue, tmp_path / "folder"))
    (folder / "apo.bin").unlink()
    with pytest.raises(InputError, match="PTM-I122"):
        form_site(folder, folder_kinds()["apo.json"])
