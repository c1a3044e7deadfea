"""Names of files as models write them, and the ones that are refused."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Callable
from pathlib import Path

import pytest

from ptmtools.scene.reference import ModelFolder


@pytest.fixture
def model(put: Callable[..., Path], tmp_path: Path) -> Path:
    """A model's folder with textures, beside a file that is not the model's."""
    put("house/textures/Wall 1.png", b"wall")
    put("house/Tür.png", b"door")
    put("house/mtl/near.png", b"near")
    put("secret.png", b"secret")
    return tmp_path / "house"


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("textures/Wall 1.png", "textures/Wall 1.png"),
        ("textures\\Wall 1.png", "textures/Wall 1.png"),
        ("TEXTURES/wall 1.PNG", "textures/Wall 1.png"),
        ("./textures//Wall 1.png", "textures/Wall 1.png"),
        ("textures/../Tür.png", "Tür.png"),
        ('"Tür.png"', "Tür.png"),
        ("  Tür.png\t", "Tür.png"),
        (unicodedata.normalize("NFD", "TÜR.png"), "Tür.png"),
    ],
)
def test_found_where_the_model_says(model: Path, name: str, file: str) -> None:
    actual = ModelFolder(model).find(name)
    assert actual.outcome == "found"
    assert actual.path is not None
    assert actual.path.resolve() == model / file


@pytest.mark.parametrize(
    "name",
    [
        "/textures/Wall 1.png",
        "/home/me/house/textures/Wall 1.png",
        "C:\\Users\\me\\textures\\wall 1.png",
        "\\\\server\\share\\Wall 1.png",
        "file:///srv/textures/Wall%201.png".replace("%20", " "),
        "elsewhere/textures/Wall 1.png",
        "../textures/Wall 1.png",
    ],
)
def test_found_by_the_end_of_the_name(model: Path, name: str) -> None:
    (model / "Wall 1.png").write_bytes(b"at the top")
    actual = ModelFolder(model).find(name)
    assert actual.outcome == "elsewhere"
    expected = "Wall 1.png" if "share" in name else "textures/Wall 1.png"
    assert actual.path is not None
    assert actual.path.resolve() == model / expected


def test_beside_the_library_before_the_root(model: Path) -> None:
    (model / "near.png").write_bytes(b"far")
    actual = ModelFolder(model).find("near.png", model / "mtl")
    assert actual.path == model / "mtl" / "near.png"
    assert ModelFolder(model).find("Tür.png", model / "mtl").path == model / "Tür.png"


def test_a_backslash_may_be_a_letter(model: Path) -> None:
    (model / "textures\\odd.png").write_bytes(b"unpacked badly")
    assert ModelFolder(model).find("textures\\odd.png").path == model / "textures\\odd.png"


@pytest.mark.parametrize("name", ["../secret.png", "textures/../../secret.png", "link.png", "{}"])
def test_outside_is_refused_unless_asked_for(model: Path, tmp_path: Path, name: str) -> None:
    os.symlink(tmp_path / "secret.png", model / "link.png")
    name = name.format(tmp_path / "secret.png")
    folder = ModelFolder(model)
    refused = folder.find(name)
    assert (refused.outcome, refused.path) == ("outside", None)
    assert not folder.sought
    allowed = ModelFolder(model, allow_outside=True).find(name)
    assert allowed.path is not None
    assert allowed.path.read_bytes() == b"secret"


@pytest.mark.parametrize(
    "name", ["no.png", "", "/", "textures", "a\0b.png", "x" * 5000, "http://a/b"]
)
def test_missing(model: Path, name: str) -> None:
    assert ModelFolder(model).find(name).outcome == "missing"


def test_what_was_sought_is_listed_in_order(model: Path) -> None:
    folder = ModelFolder(model)
    for name in ("TEXTURES\\Wall 1.png", "no.png", "../no.png", "Tür.png", "no.png"):
        folder.find(name)
    assert list(folder.sought) == ["textures/Wall 1.png", "no.png", "Tür.png"]
