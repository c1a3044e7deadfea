"""Faults that damaged buildings revealed (`benchmarks/fuzz/geometry.py`), each in a small model."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.structure import Surroundings
from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.validation import shoot_segments, validate
from ptmtools.scene import IngestOptions
from ptmtools.tolerance import Tolerance
from tests.cells.buildings import carved, room, write
from tests.scene.buildings import box, sheet


def assert_builds(folder: Path, parts: dict[str, Floats]) -> None:
    """The database of a model in metres, Z up, is valid, and its visible sets are conservative."""
    model = write(folder / "model.obj", parts.items())
    options = IngestOptions(up="z", unit="m"), AchOptions(samples=4, backend="embree")
    build_scene(model, folder / "database", *options, LightOptions(light_samples=4), workers=1)
    report = validate(folder / "database", workers=1)
    assert [issue for issue in report.issues if issue.severity == "error"] == []
    assert shoot_segments(folder / "database", 2000).missed == ()


def test_samples_of_a_floor_of_any_size_take_little_memory() -> None:
    """A box of 300 km, sampled as often as any floor is, took 1.4 GB."""
    side = 300_000.0
    corners = box((0, 0, 0), (side, side, side))
    around = Surroundings(corners, Tolerance.for_extent(side))
    count = 200_000
    points = np.random.default_rng(1).random((count, 3)) * [2 * side, side, side]
    tracemalloc.start()
    try:
        inside = around.enclose(points)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert np.array_equal(inside, points[:, 0] < side)
    assert most < 100e6


def test_a_room_in_a_model_much_larger_than_its_cells(tmp_path: Path) -> None:
    """A triangle far away, as of a stray point, coarsens the planes: both sheets are the wall."""
    behind = sheet((5.04, 0, 0), (5.04, 1, 0), (5.04, 1, 2.8), (5.04, 0, 2.8))
    far = np.array([[[9000, 9000, 0], [9001, 9000, 0], [9000, 9001, 0]]], np.float64)
    rooms = carved([room(0, 0, 5, 5), room(5.2, 0, 10.2, 5)], [((5, 2, 0), (5.2, 2.9, 2.1))])
    assert_builds(tmp_path, {"rooms": rooms, "sheet": behind, "stray": far})
