"""Emitted databases in real VRML97 browsers: no complaint, and the picture that rays give."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from ptmtools.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from browsers import view3dscene, x_ite  # noqa: E402
from render import load, render  # noqa: E402

Require = Callable[[str, str], None]
SIZE = (320, 240)
#: A texel's edge may fall a pixel further; more than this share of pixels may not differ.
DIFFERING = 0.02


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
    script, options = ROOT / "sample_data" / "make_museum.py", ["--rooms", "1", "--textures", "9"]
    model = [sys.executable, str(script), "-o", str(folder / "model"), *options, "--size", "64"]
    subprocess.run(model, check=True, capture_output=True)
    database = folder / "db"
    built = ["-q", "build-scene", str(folder / "model" / "museum.obj"), "-o", str(database)]
    assert main([*built, "--cells", request.param, "-j", "1"]) == 0
    return database


def expected(database: Path) -> NDArray[np.uint8]:
    """The first viewpoint by our own rays."""
    view = json.loads((database / "www" / "hints.json").read_text())["viewpoints"][0]
    where = {"eye": view["position"], "direction": view["direction"], "fov": view["fieldOfView"]}
    width, height = SIZE
    return render(load(database), **where, width=width, height=height, samples=2, shading="browser")


def differing(png: bytes, picture: NDArray[np.uint8]) -> float:
    """The share of pixels that differ by more than a quarter of the range."""
    with Image.open(io.BytesIO(png)) as image:
        shown = np.asarray(image.convert("RGB"), dtype=np.int64)
    assert shown.shape == picture.shape
    return float((np.abs(shown - picture).max(axis=2) > 64).mean())


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
    found = castle.check_all(root.parent)
    assert "cordIndex" in found[f"cells/{wrong}"][0]
    assert missing in " ".join(found["root.wrl"])
    shown = castle.screenshot(root, tmp_path / "broken.png", width=64, height=64)
    assert "Cannot load the texture" in " ".join(shown)
    (root.parent / "garbage.wrl").write_text("garbage")
    assert "exit status" in castle.check(root.parent / "garbage.wrl")[-1]


def test_view3dscene_shows_what_rays_see(castle: Any, museum: Path, tmp_path: Path) -> None:
    picture, (width, height) = tmp_path / "shown.png", SIZE
    root = museum / "www" / "root.wrl"
    assert castle.screenshot(root, picture, width=width, height=height) == []
    assert differing(picture.read_bytes(), expected(museum)) < DIFFERING
    assert differing(picture.read_bytes(), expected(museum)[:, ::-1]) > 4 * DIFFERING


def test_x_ite_shows_what_rays_see(web: Any, museum: Path) -> None:
    width, height = SIZE
    shot = web.screenshot(museum / "www" / "root.wrl", width=width, height=height)
    assert shot.messages == []
    assert differing(shot.png, expected(museum)) < DIFFERING
    assert differing(shot.png, expected(museum)[:, ::-1]) > 4 * DIFFERING


def test_x_ite_complains_about_broken_files(web: Any, museum: Path, tmp_path: Path) -> None:
    root, _, missing = broken(museum, tmp_path)
    shot = web.screenshot(root, width=64, height=64)
    said = " ".join(shot.messages)
    assert "cordIndex" in said
    assert missing in said
    assert ".png" in said
