"""The command, a small database to walk through, and what its runs share."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.output.served import read_served
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.walk import Walk, read_walk
from ptmtools_lab.forms import FORMS
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import World, prepare, read_forms
from tests.builds import once
from tests.e2e.conftest import Ptm, ptm

__all__ = ["Ptm", "ptm"]

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"


@pytest.fixture(scope="session")
def two_rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database of the two rooms, without light, whose lightmaps not all policies load; not to
    be changed."""

    def build(folder: Path) -> None:
        shutil.copytree(SAMPLES / "two_rooms", folder / "model")
        model = folder / "model" / "two_rooms.obj"
        words = ["-q", "build-scene", str(model), "-o", str(folder / "db"), "-j", "1"]
        assert main([*words, "--light", "none"]) == 0

    return once(tmp_path_factory, "unlit_rooms", build) / "db"


@pytest.fixture(scope="session")
def walk_file(tmp_path_factory: pytest.TempPathFactory, two_rooms: Path) -> Path:
    """A walk of 20 s through them."""

    def plan(folder: Path) -> None:
        words = ["-o", str(folder / "walk.json"), "--duration", "20"]
        assert main(["-q", "path", str(two_rooms), *words]) == 0

    return once(tmp_path_factory, "walk", plan) / "walk.json"


@pytest.fixture(scope="session")
def world(two_rooms: Path, walk_file: Path) -> World:
    """That walk's."""
    return prepare(read_served(two_rooms), read_walk(walk_file))


@pytest.fixture(scope="session")
def interlaced_rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database of the two rooms, with interlaced images, of which two have several files: one
    of 256 × 256 texels, and one of 300 × 200 that is scaled."""
    return once(tmp_path_factory, "interlaced_rooms", _build_interlaced) / "db"


def _build_interlaced(folder: Path) -> None:
    shutil.copytree(SAMPLES / "two_rooms", folder / "model")
    random = np.random.default_rng(7)
    for name, shape in {"room_a": (256, 256), "room_b": (200, 300)}.items():
        image = Image.open(folder / f"model/{name}.png").convert("RGB").resize(shape[::-1])
        noise = random.integers(-20, 21, (*shape, 3))
        texels = np.clip(np.asarray(image).astype(np.int64) + noise, 0, 255)
        Image.fromarray(texels.astype(np.uint8)).save(folder / f"model/{name}.png")
    model, formats = folder / "model" / "two_rooms.obj", "vrml,gltf,interlace"
    words = ["-q", "build-scene", str(model), "-o", str(folder / "db"), "-j", "1"]
    assert main([*words, "--format", formats, "--light", "none"]) == 0


@pytest.fixture(scope="session")
def interlaced_world(interlaced_rooms: Path, walk_file: Path) -> World:
    """The same walk through them, in all forms."""
    served = read_served(interlaced_rooms)
    pyramids = read_pyramids(served)
    forms = read_forms(served, pyramids, FORMS)
    return prepare(served, read_walk(walk_file), pyramids, drawing=Drawing(forms=forms))


@pytest.fixture(scope="session")
def elsewhere() -> Walk:
    """A walk that is nowhere near."""
    eye = np.array([[1e3, 1.6, 1e3], [1e3, 1.6, 1.01e3]])
    return Walk(np.array([0.0, 8.0]), eye, np.array([[0.0, 0, 1]] * 2), 1.0472, 1.7778)
