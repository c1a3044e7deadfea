"""The artifacts of the stages, from one process, two, and a cluster."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import AchOptions
from ptmtools.executor import Executor
from ptmtools.pipeline.build import build_scene
from ptmtools.store.archive import pack_arrays
from ptmtools.visibility import Pvs, PvsOptions, compute_pvs
from tests.conftest import files_below

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def grid():
    """Seven by seven rooms whose doors make several batches, with many ties among them."""
    place = ROOT / "tests/visibility/conftest.py"
    spec = importlib.util.spec_from_file_location("rooms_with_doors", place)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where its dataclass looks for itself
    spec.loader.exec_module(module)
    rng = np.random.default_rng(6)
    doors = {}
    for i, j, axis in np.ndindex(7, 7, 2):
        low = float(rng.integers(0, 3))
        at, wide = (i, j)[1 - axis] * 4.0, rng.integers(1, 3)
        span = (at + low, min(at + low + wide, at + 4))
        # The axes after x are y and z; after z, x and y.
        door = (0.0, 2.0, *span) if axis == 0 else (*span, 0.0, 2.0)
        doors[(i, 0, j, 2 * axis)] = [door]
    steps = np.arange(8) * 4.0
    return module.make_rooms(steps, [0.0, 3.0], steps, doors).cells


@pytest.mark.parametrize("options", [PvsOptions(), PvsOptions(budget=50)])
def test_pvs(grid, local: Executor, cluster: Executor, options):
    assert grid.portal_count == 84
    steps: list[tuple[int, int, str]] = []
    first = compute_pvs(grid, options)
    if options.budget > 50:
        assert first.decided.sum() > 0
    for executor in (local, cluster):
        actual = compute_pvs(grid, options, lambda *step: steps.append(step), executor)
        assert pack_arrays(actual.to_arrays()) == pack_arrays(first.to_arrays())
    assert [done for done, _, _ in steps] == [64, 128, 168] * 2


def test_sampled_pvs(grid, local: Executor, cluster: Executor):
    options = PvsOptions(method="sampled", lines=20)
    expected = compute_pvs(grid, options).to_matrix()
    assert not expected.all()
    for executor in (local, cluster):
        assert np.array_equal(compute_pvs(grid, options, executor=executor).to_matrix(), expected)


def test_ach(room_row, local: Executor, cluster: Executor, monkeypatch):
    monkeypatch.setattr("ptmtools.coverage.ach.WORTH_A_PROCESS", 0.0)
    given = *room_row(8), Pvs.from_matrix(np.ones((8, 8), dtype=np.bool_))
    options = AchOptions(backend="embree", samples=8, per_texture=True)
    expected = pack_arrays(compute_ach(*given, options).to_arrays())
    for executor in (local, cluster):
        actual = compute_ach(*given, options, executor=executor)
        assert pack_arrays(actual.to_arrays()) == expected


def test_whole_databases(tmp_path, scheduler: str, monkeypatch):
    monkeypatch.setattr("ptmtools.coverage.ach.WORTH_A_PROCESS", 0.0)
    model = ROOT / "sample_data/two_rooms/two_rooms.obj"
    ach = AchOptions(backend="embree")
    for folder, workers, address in (("one", 1, None), ("two", 2, None), ("many", 0, scheduler)):
        build_scene(model, tmp_path / folder, ach, workers=workers, scheduler=address)
    one, two, many = (files_below(tmp_path / name) for name in ("one", "two", "many"))
    assert one == two == many
