"""Emitted databases in real VRML97 browsers: no complaint, and the pictures that rays give."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from tests.e2e.conftest import make_museum

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from browsers import view3dscene, x_ite  # noqa: E402
from likeness import Likeness, likeness, outline  # noqa: E402
from render import LOOKS  # noqa: E402
from screenshots import Album, Database, Picture, by_view3dscene, by_x_ite  # noqa: E402

Require = Callable[[str, str], None]
SIZE = (320, 240)
#: Few sample points: hints are not looked at here. Small fallback images: X_ITE loads one for each
#: shape. No light: VRML has none.
QUICK = ["--samples", "1", "--face", "8", "--pvs", "fast", "--fallback-size", "256"]
QUICK += ["--format", "vrml", "--light", "none"]
#: Rooms that are compared: the first in the order of the viewpoints.
ROOMS = 3


@pytest.fixture(scope="module")
def castle(require: Require) -> Any:
    if packages := view3dscene.missing():
        require("view3dscene under Xvfb", f"apt install {packages}")
    return view3dscene


@pytest.fixture(scope="module")
def web(require: Require) -> Any:
    if remedy := x_ite.missing():
        require("X_ITE in Chromium", remedy)
    return x_ite


@pytest.fixture(scope="module", params=["leaf", "room"])
def museum(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """The database of the smallest museum: a room, a corridor, windows, pictures."""
    folder = tmp_path_factory.mktemp("museum")
    database = folder / "db"
    built = ["-q", "build-scene", str(make_museum(folder / "model")), "-o", str(database)]
    assert main([*built, *QUICK, "--cells", request.param, "--gzip", "-j", "1"]) == 0
    return database


@pytest.fixture(scope="module")
def real(
    tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest, shared: Path
) -> Database:
    """A real scene, in few cells: X_ITE takes as long for a file as for a hundred triangles. Each
    is shown by one browser at least, and one by both."""
    name = request.param
    folder = tmp_path_factory.mktemp(name)
    model = shared / "scenes" / name / f"{name}.obj"
    built = ["-q", "build-scene", str(model), "-o", str(folder / "db"), "--max-leaves", "60"]
    assert main([*built, *QUICK, "--viewpoint-count", str(ROOMS), "-j", "1"]) == 0
    return Database.open(folder / "db")


def compared(database: Database, album: Album, browser: str, first: int = 0) -> list[Likeness]:
    """The pictures of viewpoints from ``first`` on, beside ours."""
    actual = []
    for viewpoint, picture in enumerate(album.pictures, first):
        what = outline(database.scene, database.view(viewpoint, SIZE))
        own = database.own(viewpoint, SIZE, browser)
        actual.append(likeness(picture, own, what, LOOKS[browser]))
    return actual


def alike(found: Likeness) -> bool:
    """Nothing is missing, nothing is elsewhere, and colours differ by less than one can see.

    Every picture so far had over 41 dB and under 0.1 % of its pixels off; the goal is 30 dB.
    """
    return found.psnr > 38 and found.off < 0.003 and found.stray < 0.001


def check(database: Database, album: Album, browser: str) -> None:
    assert album.complaints == ()
    actual = compared(database, album, browser)
    assert len(actual) == min(len(database.viewpoints), ROOMS)
    assert all(alike(each) for each in actual), actual
    # What is compared is most of the picture.
    assert all(each.masked < 0.25 for each in actual), actual


def first_rooms(database: Database) -> range:
    return range(min(len(database.viewpoints), ROOMS))


def broken(database: Path, folder: Path) -> tuple[Path, str, str]:
    """The served files without textures: the root's path, a cell with a wrong field, one missing.

    The largest cell, which has textures, is left as it is.
    """
    www = Path(shutil.copytree(database / "www", folder / "broken"))
    cells = sorted((www / "cells").glob("*.wrl"), key=lambda file: file.stat().st_size)
    cells[0].write_text(cells[0].read_text().replace("coordIndex", "cordIndex", 1))
    cells[1].unlink()
    for picture in (www / "textures").glob("*.png"):
        picture.unlink()
    assert len(cells) > 2
    return www / "root.wrl", cells[0].name, cells[1].name


def test_view3dscene_reads_every_file_without_a_warning(castle: Any, museum: Path) -> None:
    assert len(list((museum / "www").rglob("*.wrl"))) > 3
    assert castle.check_all(museum / "www") == {}


def test_view3dscene_reads_the_sample(castle: Any, shared: Path) -> None:
    assert castle.check_all(shared / "vrml-sample") == {}


def test_view3dscene_complains_about_broken_files(
    castle: Any, museum: Path, tmp_path: Path
) -> None:
    root, wrong, missing = broken(museum, tmp_path)
    actual = castle.check_all(root.parent)
    assert "cordIndex" in actual[f"cells/{wrong}"][0]
    assert missing in " ".join(actual["root.wrl"])
    # A picture of the root tells of all that it inlines.
    shown = " ".join(castle.screenshot(root, tmp_path / "broken.png", width=64, height=64))
    assert "Cannot load the texture" in shown
    assert "cordIndex" in shown
    (root.parent / "garbage.wrl").write_text("garbage")
    assert "exit status" in castle.check(root.parent / "garbage.wrl")[-1]


@pytest.mark.parametrize("museum", ["room"], indirect=True)
def test_x_ite_complains_about_broken_files(web: Any, museum: Path, tmp_path: Path) -> None:
    root, _, missing = broken(museum, tmp_path)
    printed = " ".join(web.show(root, width=64, height=64).messages)
    assert "cordIndex" in printed
    assert missing in printed
    assert ".png" in printed


def test_view3dscene_shows_what_rays_see(castle: Any, museum: Path) -> None:
    database = Database.open(museum)
    check(database, by_view3dscene(database, first_rooms(database), SIZE), "view3dscene")


@pytest.mark.parametrize("museum", ["room"], indirect=True)
def test_x_ite_walks_through_what_rays_see(web: Any, museum: Path) -> None:
    database = Database.open(museum)
    # What shows at first is the first viewpoint; one comes to the next by Page Down.
    steps = [None, *[x_ite.NEXT] * (len(first_rooms(database)) - 1)]
    width, height = SIZE
    shots = web.show(database.root, steps, width=width, height=height)
    check(database, Album.of(shots.pictures, shots.messages), "x_ite")
    assert shots.menu == tuple(v["description"] for v in database.viewpoints)


def without_originals(museum: Path, folder: Path) -> tuple[Path, Path]:
    """The root file, and the gzip copies of the others without any ``.wrl`` beside it.

    A server that supports gzip copies sends them under the plain name; a file manager does not.
    """
    www = Path(shutil.copytree(museum / "www", folder / "copies"))
    for file in www.rglob("*.wrl"):
        file.unlink()
    for copy in www.glob("cells/*.wrl.gz"):
        copy.rename(copy.with_suffix(""))
    return museum / "www" / "root.wrl", www / "root.wrl.gz"


@pytest.mark.parametrize("museum", ["room"], indirect=True)
def test_view3dscene_opens_gzip_copies(castle: Any, museum: Path, tmp_path: Path) -> None:
    pictures = []
    for file in without_originals(museum, tmp_path):
        picture = tmp_path / f"{file.name}.png"
        assert castle.screenshot(file, picture, width=160, height=120) == []
        pictures.append(picture.read_bytes())
    assert pictures[0] == pictures[1]


@pytest.mark.parametrize("museum", ["room"], indirect=True)
def test_x_ite_opens_gzip_copies(web: Any, museum: Path, tmp_path: Path) -> None:
    plain, copy = (web.show(f, width=160, height=120) for f in without_originals(museum, tmp_path))
    assert plain.messages == copy.messages == ()
    assert plain.pictures == copy.pictures
    assert Album.of(plain.pictures, ()).pictures[0].std() > 10


@pytest.mark.parametrize("real", ["gallery", "willowgarage"], indirect=True)
def test_view3dscene_shows_real_scenes(castle: Any, real: Database) -> None:
    check(real, by_view3dscene(real, first_rooms(real), SIZE), "view3dscene")


@pytest.mark.parametrize("real", ["gallery", "hospital"], indirect=True)
def test_x_ite_shows_real_scenes(web: Any, real: Database) -> None:
    check(real, by_x_ite(real, first_rooms(real), SIZE), "x_ite")


Bend = Callable[[Database], None]


def mirror_textures(database: Database) -> None:
    for file in (database.www / "textures").glob("*.png"):
        with Image.open(file) as image:
            flipped = image.transpose(Image.Transpose.FLIP_LEFT_RIGHT)
        flipped.save(file)


def exchange_textures(database: Database) -> None:
    files = sorted((database.www / "textures").glob("*.png"))
    contents = [file.read_bytes() for file in files]
    for file, content in zip(files, contents[1:] + contents[:1], strict=True):
        file.write_bytes(content)


def lose_a_texture(database: Database) -> None:
    """The largest file."""
    max((database.www / "textures").glob("*.png"), key=lambda file: file.stat().st_size).unlink()


def darken(database: Database) -> None:
    """By a tenth."""
    for file in (database.www / "textures").glob("*.png"):
        with Image.open(file) as image:
            image.convert("RGB").point([round(0.9 * k) for k in range(256)] * 3).save(file)


def rewrite(database: Database, old: str, new: str, folder: str = "cells") -> None:
    changed = 0
    for file in [*(database.www / folder).glob("*.wrl")]:
        text = file.read_text()
        file.write_text(text.replace(old, new))
        changed += old in text
    assert changed


@pytest.mark.parametrize(
    "bend",
    [
        mirror_textures,
        exchange_textures,
        lose_a_texture,
        darken,
        partial(rewrite, old="  solid FALSE", new="  solid TRUE ccw FALSE"),
        partial(rewrite, old="fieldOfView 1.1", new="fieldOfView 1.12", folder="."),
        partial(rewrite, old="headlight TRUE", new="headlight FALSE", folder="."),
    ],
    ids=[
        "mirrored",
        "exchanged",
        "one less",
        "darker",
        "inside out",
        "one degree wider",
        "without light",
    ],
)
@pytest.mark.parametrize("museum", ["room"], indirect=True)
def test_what_is_bent_is_not_alike(castle: Any, museum: Path, tmp_path: Path, bend: Bend) -> None:
    database = Database.open(museum)
    bent = replace(database, www=Path(shutil.copytree(database.www, tmp_path / "www")))
    bend(bent)
    albums = ((room, by_view3dscene(bent, [room], SIZE)) for room in first_rooms(database))
    # The first that differs suffices.
    assert any(
        not alike(each)
        for room, album in albums
        for each in compared(database, album, "view3dscene", room)
    )


@pytest.mark.parametrize("museum", ["room"], indirect=True)
def test_another_picture_is_not_alike(museum: Path) -> None:
    database = Database.open(museum)
    own = database.own(0, SIZE, "x_ite")
    what = outline(database.scene, database.view(0, SIZE))

    def found(picture: Picture) -> Likeness:
        return likeness(picture, own, what, LOOKS["x_ite"])

    assert alike(found(own))
    assert not alike(found(np.ascontiguousarray(own[:, ::-1])))
    assert not alike(found(np.roll(own, 2, axis=1)))
    assert not alike(found(database.own(1, SIZE, "x_ite")))
    patched = own.copy()
    patched[100:120, 100:120] = 255 - patched[100:120, 100:120]
    assert not alike(found(patched))
