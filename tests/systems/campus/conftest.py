"""Campuses that several tests look at."""

from __future__ import annotations

from pathlib import Path

import pytest

from ptmtools.scene import IngestOptions
from ptmtools_systems.campus import Campus, CampusOptions, make_campus, read_campus
from tests.systems.campus.models import write_campus

METRES = IngestOptions(unit="m", up="y")


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The OBJ of `write_campus`."""
    return write_campus(tmp_path_factory.mktemp("model"))


@pytest.fixture(scope="session")
def made(model: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its campus with baked lightmaps; not to be changed."""
    pytest.importorskip("xatlas", reason="pip install 'ptmtools[campus]'")
    folder = tmp_path_factory.mktemp("campus") / "made"
    make_campus(model, folder, CampusOptions(samples=16, faces=20), METRES)
    return folder


@pytest.fixture(scope="session")
def plain(model: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its campus without lightmaps; not to be changed."""
    folder = tmp_path_factory.mktemp("campus") / "plain"
    make_campus(model, folder, CampusOptions(lightmaps="none", faces=20), METRES)
    return folder


@pytest.fixture(scope="session")
def index(made: Path) -> Campus:
    """What campus.json says."""
    return read_campus(made)
