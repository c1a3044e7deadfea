"""The command, a small database to walk through, and what its runs share."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.walk import Walk, read_walk
from ptmtools.walkthrough.world import World, prepare
from tests.e2e.conftest import Ptm, ptm

__all__ = ["Ptm", "ptm"]

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"


@pytest.fixture(scope="session")
def two_rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database of the two rooms; not to be changed."""
    folder = tmp_path_factory.mktemp("two_rooms")
    shutil.copytree(SAMPLES / "two_rooms", folder / "model")
    model = folder / "model" / "two_rooms.obj"
    assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), "-j", "1"]) == 0
    return folder / "db"


@pytest.fixture(scope="session")
def walk_file(two_rooms: Path) -> Path:
    """A walk of 20 s through them."""
    file = two_rooms.parent / "walk.json"
    assert main(["-q", "path", str(two_rooms), "-o", str(file), "--duration", "20"]) == 0
    return file


@pytest.fixture(scope="session")
def world(two_rooms: Path, walk_file: Path) -> World:
    """That walk's."""
    return prepare(read_served(two_rooms), read_walk(walk_file))


@pytest.fixture(scope="session")
def elsewhere() -> Walk:
    """A walk that is nowhere near."""
    eye = np.array([[1e3, 1.6, 1e3], [1e3, 1.6, 1.01e3]])
    return Walk(np.array([0.0, 8.0]), eye, np.array([[0.0, 0, 1]] * 2), 1.0472, 1.7778)
