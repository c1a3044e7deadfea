"""The command as a user runs it, and a small database to run it on."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from ptmtools.cli.main import main

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


@pytest.fixture(scope="session")
def _built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("built")
    shutil.copytree(TWO_ROOMS, folder / "model")
    model = folder / "model" / "two_rooms.obj"
    assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), "-j", "1"]) == 0
    return folder


@pytest.fixture
def two_rooms(_built: Path, tmp_path: Path) -> Path:
    """A copy of the model's folder."""
    return Path(shutil.copytree(_built / "model", tmp_path / "model"))


@pytest.fixture
def database(_built: Path, tmp_path: Path) -> Path:
    """A copy of its database."""
    return Path(shutil.copytree(_built / "db", tmp_path / "db"))


@pytest.fixture(scope="session")
def gltf_museum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database of the smallest museum, with glTF files; not to be changed."""
    folder = tmp_path_factory.mktemp("museum")
    script, options = TWO_ROOMS.parent / "make_museum.py", ["--rooms", "1", "--textures", "9"]
    model = [sys.executable, str(script), "-o", str(folder / "model"), *options, "--size", "64"]
    subprocess.run(model, check=True, capture_output=True)
    built = ["-q", "build-scene", str(folder / "model/museum.obj"), "-o", str(folder / "db")]
    assert main([*built, "-j", "1", "--format", "gltf"]) == 0
    return folder / "db"


def listing(folder: Path) -> dict[str, bytes | None]:
    """Everything below a folder: the bytes of files, None for folders."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
        if not path.is_symlink()
    }
