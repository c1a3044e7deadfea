"""Faults that damaged buildings revealed (`benchmarks/fuzz/geometry.py`), each in a small model."""

from __future__ import annotations

import tracemalloc

import numpy as np

from ptmtools.cells.structure import Surroundings
from ptmtools.tolerance import Tolerance
from tests.scene.buildings import box


def test_samples_of_a_floor_of_any_size_take_little_memory() -> None:
    """A box of 300 km, sampled as often as any floor is, took 1.4 GB."""
    side = 300_000.0
    corners = box((0, 0, 0), (side, side, side))
    around = Surroundings(corners, Tolerance.for_extent(side))
    count = 200_000
    points = np.random.default_rng(1).random((count, 3)) * [2 * side, side, side]
    tracemalloc.start()
    try:
        inside = around.inside(points)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert np.array_equal(inside, points[:, 0] < side)
    assert most < 100e6
