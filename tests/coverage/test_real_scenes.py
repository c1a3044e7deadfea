"""OpenGL against Embree on real models: the same sample points, the same pixels."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.subdivide import subdivide
from ptmtools.coverage.ach import choose_eyes
from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import Surfaces, sample_coverage
from ptmtools.coverage.matter import Surroundings
from ptmtools.coverage.opengl import APT, OpenGLRenderer, create_context
from ptmtools.coverage.options import AchOptions
from ptmtools.scene.ingestion import ingest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def museum(tmp_path_factory) -> Path:
    """The sample museum, with small pictures."""
    folder = tmp_path_factory.mktemp("museum")
    make = [sys.executable, "sample_data/make_museum.py", "-o", str(folder), "--force"]
    subprocess.run([*make, "--size", "16", "--textures", "2"], cwd=ROOT, check=True)
    return folder / "museum.obj"


def assert_backends_agree(model: Path, transparent: bool) -> None:
    scene = ingest(model)
    assert scene.opaque.all() != transparent
    cells = subdivide(scene, SubdivideOptions(max_cells=30))
    surfaces, around = Surfaces.of(scene, cells), Surroundings.of(scene, cells)
    options = AchOptions(samples=2)
    gl = OpenGLRenderer(create_context(), surfaces, 64)
    rays = EmbreeRenderer(surfaces, 64)
    covered, differ = 0, 0.0
    for cell in range(cells.cell_count):
        for eye in choose_eyes(cells, around, cell, options, 1e-3)[0]:
            one = sample_coverage(gl, surfaces, eye.point, eye.near)
            other = sample_coverage(rays, surfaces, eye.point, eye.near)
            covered += int(other.sum())
            differ += float(np.abs(one - other).sum()) / 2
    gl.close()
    assert covered > 20 * 64**2 * cells.cell_count / 4
    assert differ / covered <= 1e-4


def test_the_hospital(shared, has_gl, require):
    if not has_gl:
        require("OpenGL", APT)
    assert_backends_agree(shared / "scenes/hospital/hospital.obj", transparent=False)


def test_the_museum(museum, has_gl, require):
    """Its windows are of transparent glass."""
    if not has_gl:
        require("OpenGL", APT)
    assert_backends_agree(museum, transparent=True)
