"""The sample models, whose air is known: cells hold all of it and nothing of the walls."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells import subdivide
from ptmtools.scene import ingest

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"


def test_two_rooms() -> None:
    """96.4 m³: two rooms of 48 and a doorway of 0.4, as the comments of the model reckon."""
    cells = subdivide(ingest(SAMPLES / "two_rooms/two_rooms.obj"))
    assert cells.closed
    assert (cells.cell_count, cells.leaf_count) == (2, 3), "the doorway belongs to a room"
    assert cells.leaf_volumes().sum() == pytest.approx(96.4)


def test_a_museum_without_windows_is_closed_and_its_walls_are_nobodys(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "ptmtools", "sample", "museum", "-o", tmp_path / "m"]
    subprocess.run([*command, "--size", "16", "--no-windows"], check=True)
    scene = ingest(tmp_path / "m/museum.obj")
    cells = subdivide(scene)
    assert cells.closed
    # Every wall between two rooms has faces on both sides; halfway through it is solid.
    names = np.array(scene.objects)[scene.triangle_object]
    walls = np.array(["_wall_" in name for name in names])
    corners = scene.corners[walls]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    middle = corners.mean(axis=1)
    front = cells.locate(middle + 0.05 * normal)
    back = cells.locate(middle - 0.05 * normal)
    assert np.mean((front >= 0) & (back == -1)) > 0.99
