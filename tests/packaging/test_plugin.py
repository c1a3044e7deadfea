"""A package of a stranger adds a command, an input format and a texture profile by entry points."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = """
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"

[project]
name = "ptm-boxes"
version = "1.2"

[project.entry-points."ptmtools.commands"]
largest = "boxes:LARGEST"

[project.entry-points."ptmtools.formats"]
boxes = "boxes:BOXES"

[project.entry-points."ptmtools.profiles"]
plain = "boxes:PLAIN"

[tool.setuptools]
py-modules = ["boxes"]
"""
MODULE = '''
"""Boxes as text, six numbers a line; a profile without compression; the largest file."""
from pathlib import Path

import click
import numpy as np
from ptmtools.cli.entry import Entry
from ptmtools.lazy import Lazy
from ptmtools.scene.formats import ModelFormat
from ptmtools.texture.coder import Tile
from ptmtools.texture.profiles import Profile

LARGEST = Entry("Strangers", "Print the largest file of a folder.", "boxes:largest")
BOXES = ModelFormat("boxes", "boxes", (".boxes",), Lazy("boxes:read_boxes"), metres=1.0, up="y")
PLAIN = Profile("plain", 200, "no compression", module="boxes")


@click.command()
@click.argument("folder")
def largest(folder):
    """Print the largest file of FOLDER."""
    print(max((f for f in Path(folder).rglob("*") if f.is_file()), key=lambda f: f.stat().st_size))


def read_boxes(model, notes, options, progress):
    from ptmtools.scene.source import MeshArrays

    arrays = MeshArrays()
    for low, high in np.loadtxt(model, ndmin=2).reshape(-1, 2, 3):
        corner = np.indices((2, 2, 2)).reshape(3, 8).T
        faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
        points = np.where(corner, high, low)
        arrays.add(arrays.add_objects("box"), points, triangles[:, ::-1])  # seen from inside
    return arrays.source()


def encode_base(level):
    return level.tobytes()


def decode_base(data, shape, dtype):
    return np.frombuffer(data, dtype).reshape(shape).copy()


def encode_tile(level, below, *rest):
    return Tile(encode_base(level), level)


def decode_tile(data, below, shape, *rest):
    return Tile(b"", decode_base(data, shape, below.dtype))
'''


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that pip installed the package into."""
    folder = tmp_path_factory.mktemp("plugin")
    source, target = folder / "source", folder / "site"
    source.mkdir()
    (source / "pyproject.toml").write_text(PROJECT)
    (source / "boxes.py").write_text(MODULE)
    options = ("--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--no-compile")
    pip = (sys.executable, "-m", "pip", "install", *options, "--target", target, source)
    subprocess.run(pip, check=True)
    return target


def ptm(site: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ptmtools", *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(site)},
    )


def test_commands_formats_and_profiles(installed: Path, tmp_path: Path) -> None:
    from PIL import Image

    shown = ptm(installed, "--help").stdout
    assert "Strangers:\n  largest " in shown
    assert "boxes" in ptm(installed, "build-scene", "--help").stdout
    (tmp_path / "two.boxes").write_text("0 0 0 4 3 5\n4 0 0 7 3 5\n")
    done = ptm(installed, "info", tmp_path / "two.boxes")
    assert (done.returncode, done.stderr) == (0, "")
    assert "boxes, 24 B\ntriangles   24 in 2 objects" in done.stdout
    image, encoded, back = (tmp_path / name for name in ("a.png", "a.ptm", "b.png"))
    Image.linear_gradient("L").resize((64, 32)).save(image)
    done = ptm(installed, "encode", "--profile", "plain", image, "-o", encoded)
    assert done.returncode == 0, done.stderr
    assert ptm(installed, "validate", encoded).returncode == 0
    assert ptm(installed, "decode", encoded, "-o", back).returncode == 0
    assert Image.open(back).tobytes() == Image.open(image).tobytes()
    assert "plain" in ptm(installed, "info", encoded).stdout
    assert ptm(installed, "largest", tmp_path).stdout.strip().startswith(str(tmp_path))


def test_without_the_package(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "two.boxes").write_text("0 0 0 4 3 5\n")
    done = ptm(tmp_path, "info", tmp_path / "two.boxes")
    assert done.returncode != 0
    assert "[PTM-" in done.stderr


def test_a_package_that_is_broken(installed: Path) -> None:
    """It is named, and only what needs it fails."""
    site = installed.with_name("broken")
    subprocess.run(["cp", "-r", installed, site], check=True)
    (site / "boxes.py").write_text("import a_module_that_is_nowhere\n")
    assert ptm(site, "validate", "--help").returncode == 0
    done = ptm(site, "largest", "--help")
    assert done.returncode == 6
    assert "ptm-boxes 1.2" in done.stderr
    assert "[PTM-M110]" in done.stderr
    assert "Traceback" not in done.stderr
