"""OpenGL against Embree on real models: the same sample points, the same pixels."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.subdivision import subdivide
from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import AchOptions
from ptmtools.scene.ingestion import ingest
from ptmtools.visibility.pvs import compute_pvs

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def museum(tmp_path_factory) -> Path:
    """The sample museum, with small pictures."""
    folder = tmp_path_factory.mktemp("museum")
    make = [sys.executable, "-m", "ptmtools", "sample", "museum", "-o", str(folder), "--force"]
    subprocess.run([*make, "--size", "16", "--textures", "2"], cwd=ROOT, check=True)
    return folder / "museum.obj"


def assert_backends_agree(model: Path, transparent: bool) -> None:
    scene = ingest(model)
    assert scene.opaque.all() != transparent
    cells = subdivide(scene, SubdivideOptions(max_leaves=30))
    pvs = compute_pvs(cells)
    options = AchOptions(samples=4, face=64)
    one, other = (
        compute_ach(scene, cells, pvs, replace(options, backend=backend))
        for backend in ("gl", "embree")
    )
    assert np.array_equal(one.samples, other.samples)
    covered = other.pixels.sum()
    assert covered > 20 * 64**2 * cells.cell_count / 2
    assert np.abs(one.pixels - other.pixels).sum() / 2 / covered <= 1e-4


def test_the_hospital(shared, gl):
    assert_backends_agree(shared / "scenes/hospital/hospital.obj", transparent=False)


def test_the_museum(museum, gl):
    """Its windows are of transparent glass."""
    assert_backends_agree(museum, transparent=True)
