"""The command as a user runs it, and a small database to run it on."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from ptmtools.cli.main import main
from tests.builds import once

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"


@dataclass(frozen=True)
class Outcome:
    """Exit status and what was printed."""

    status: int
    out: str
    err: str


Ptm = Callable[..., Outcome]


@pytest.fixture
def ptm(capfd: pytest.CaptureFixture[str]) -> Ptm:
    """``ptm("info", path)``: the command, in this process."""

    def run(*arguments: object) -> Outcome:
        capfd.readouterr()
        status = main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        return Outcome(status, out, err)

    return run


def built_rooms(factory: pytest.TempPathFactory) -> Path:
    """A folder with the model of the two rooms and its database."""

    def build(folder: Path) -> None:
        shutil.copytree(TWO_ROOMS, folder / "model")
        model = folder / "model" / "two_rooms.obj"
        assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), "-j", "1"]) == 0

    return once(factory, "two_rooms", build)


@pytest.fixture(scope="session")
def _built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built_rooms(tmp_path_factory)


@pytest.fixture
def two_rooms(_built: Path, tmp_path: Path) -> Path:
    """A copy of the model's folder."""
    return Path(shutil.copytree(_built / "model", tmp_path / "model"))


@pytest.fixture
def database(_built: Path, tmp_path: Path) -> Path:
    """A copy of its database."""
    return Path(shutil.copytree(_built / "db", tmp_path / "db"))


def make_museum(folder: Path, rooms: int = 1, textures: int = 9, size: int = 64) -> Path:
    """The model of a made-up museum, the smallest unless more is asked for."""
    sizes = {"--rooms": rooms, "--textures": textures, "--size": size}
    words = [str(word) for option in sizes.items() for word in option]
    assert main(["-q", "sample", "museum", "-o", str(folder), *words]) == 0
    return folder / "museum.obj"


@pytest.fixture(scope="session")
def gltf_museum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database of the smallest museum, without light; not to be changed."""

    def build(folder: Path) -> None:
        words = ["build-scene", str(make_museum(folder / "model")), "-o", str(folder / "db")]
        assert main(["-q", *words, "-j", "1", "--light", "none"]) == 0

    return once(tmp_path_factory, "gltf_museum", build) / "db"


@pytest.fixture(scope="session")
def three(require: Callable[[str, str], None]) -> Any:
    """What runs scripts with three.js in Chromium."""
    from tests.e2e.browsers import three_js

    if remedy := three_js.missing():
        require("three.js in Chromium", remedy)
    return three_js


def listing(folder: Path) -> dict[str, bytes | None]:
    """Everything below a folder: the bytes of files, None for folders."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
        if not path.is_symlink()
    }
