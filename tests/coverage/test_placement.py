"""Sample points: uniform in the cell, in equal parts, the same everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import volumes
from ptmtools.coverage.placement import TRIES, CellVolume, filling, sobol, strata, uniform

FROZEN_SOBOL = [
    [
        0.5338823440251872,
        0.3491640571737662,
        0.4463457904057577,
        0.9333644023863599,
        0.2843871013028547,
        0.9142980616306886,
    ],
    [
        0.0838124529691413,
        0.5980626138625666,
        0.555975042632781,
        0.2412378416629508,
        0.6665158568648621,
        0.06793526175897568,
    ],
]
FROZEN_UNIFORM = [
    [
        0.9850879530339955,
        0.5385560528693345,
        0.3033006245106776,
        0.3013045197431566,
        0.5070881481906704,
        0.4126921922528289,
    ],
    [
        0.6544930547828547,
        0.3210898841451347,
        0.5448766598382266,
        0.9596783686178594,
        0.5994862233464502,
        0.9130070787496056,
    ],
]
#: Corner tetrahedron of the unit cube: a sixth of it.
CORNER = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]], dtype=np.float64)


def volume(cells, cell):
    return CellVolume.of_cells(cells)[cell]


def filled(tetra, unit):
    return filling(tetra, volumes(tetra), unit)


def test_tetrahedra_fill_the_cell(room_row):
    _, cells = room_row(2)
    assert volume(cells, 1).volume.sum() == pytest.approx(64)
    assert volume(cells, 1).tetrahedra[..., 0].min() == 4


def test_a_cell_of_several_leaves_is_filled_whole(room_row):
    _, cells = room_row(3)
    joined = replace(cells, leaf_cell=np.array([0, 1, 0], dtype=np.int32))
    points = np.concatenate(volume(joined, 0).parts(8, 0))
    in_first = np.mean(points[:, 0] < 4)
    assert in_first == pytest.approx(0.5, abs=0.05)
    assert not np.any((points[:, 0] > 4) & (points[:, 0] < 8))


def test_the_sequence_is_frozen():
    """Artifacts depend on it: this is how it begins, for ever."""
    assert sobol(0, 2, 0).tolist() == FROZEN_SOBOL
    assert uniform(0, 2, 0).tolist() == FROZEN_UNIFORM
    for draw in (sobol, uniform):
        assert np.array_equal(draw(24, 8, 3), draw(0, 32, 3)[24:])
        assert ((draw(0, 4, 2**32 - 1) > 0) & (draw(0, 4, 2**32 - 1) < 1)).all()


@pytest.mark.parametrize("seed", [0, 1, 77])
def test_every_stretch_is_a_net(seed):
    """Of 2^m points aligned to 2^m each dimension has one in every interval of 2^-m, and of the
    first two (a (0, m, 2) net) every elementary rectangle has one."""
    for first in (0, 64, 192):
        points = sobol(first, 64, seed)
        assert (np.sort((points * 64).astype(int), axis=0) == np.arange(64)[:, None]).all()
        for a in range(7):
            cell = (points[:, :2] * [2**a, 2 ** (6 - a)]).astype(int) @ [2 ** (6 - a), 1]
            assert sorted(cell) == list(range(64))


def test_scrambles_are_uniform_and_independent():
    """The first point of each of many scrambles, which the plain sequence has at 0."""
    first = np.array([sobol(0, 1, seed)[0] for seed in range(2000)])
    assert np.abs(first.mean(axis=0) - 0.5).max() < 4 * np.sqrt(1 / 12 / 2000)
    assert np.abs(np.corrcoef(first.T) - np.eye(6)).max() < 4 / np.sqrt(2000)


def test_a_filling_is_uniform_in_a_tetrahedron():
    points = filled(CORNER, sobol(0, 4096, 0))
    assert (points >= 0).all()
    assert (points.sum(axis=1) <= 1).all()
    assert points.mean(axis=0) == pytest.approx([0.25, 0.25, 0.25], abs=2e-3)
    # A plane at x = 1/2 cuts off an eighth.
    assert np.mean(points[:, 0] > 0.5) == pytest.approx(0.125, abs=4e-3)


def test_a_filling_goes_by_volume():
    points = filled(np.concatenate([CORNER, CORNER * 2 + 10]), sobol(0, 8192, 0))
    assert np.mean(points[:, 0] < 5) == pytest.approx(1 / 9, abs=2e-3)


@pytest.mark.parametrize("draw", ["sobol", "random"])
def test_points_fill_a_cell_of_two_leaves_evenly(room_row, draw):
    """Its bounding box holds another cell, where no point falls."""
    _, cells = room_row(3)
    joined = replace(cells, leaf_cell=np.array([0, 1, 0], dtype=np.int32))
    points = getattr(volume(joined, 0), draw)(0, 3000, 0)[:, :3]
    if draw == "sobol":
        assert len(points) == pytest.approx(2000, rel=0.01)
    assert not np.any((points[:, 0] > 4) & (points[:, 0] < 8))
    assert np.mean(points[:, 0] < 4) == pytest.approx(0.5, abs=0.03)
    for axis, (low, high) in enumerate([(0, 12), (0, 4), (-2, 2)]):
        assert low < points[:, axis].min()
        assert points[:, axis].max() < high


def test_a_slanting_sliver_is_filled_by_tetrahedra(room_row):
    """It fills so little of its box that few points of the box would meet it."""
    _, cells = room_row(1)
    wide = volume(cells, 0)
    slope = cells.leaf_point.copy()
    slope[:, 1] = slope[:, 1] / 100 + slope[:, 0]
    thin = volume(replace(cells, leaf_point=slope), 0)
    assert wide.boxed
    assert not thin.boxed
    points = thin.sobol(0, 512, 0)
    assert len(points) == 512
    height = points[:, 1] - points[:, 0]
    assert ((height >= 0) & (height <= 0.04)).all()
    assert height.mean() == pytest.approx(0.02, abs=1e-3)


@given(count=st.integers(1, 40), parts=st.integers(1, 40), seed=st.integers(0, 99))
def test_strata_are_a_partition_into_equal_parts(count, parts, seed):
    points = np.random.default_rng(seed).random((count * parts, 3))
    groups = strata(points, parts)
    assert len(groups) == parts
    assert sorted(np.concatenate(groups)) == list(range(count * parts))
    assert {len(g) for g in groups} == {count}


def test_eight_samples_of_a_cube_are_the_middles_of_its_octants(room_row):
    _, cells = room_row(1)
    first = np.array([part[0] for part in volume(cells, 0).parts(8, 0)])
    octants = (first > [2, 2, 0]).astype(int) @ [1, 2, 4]
    assert sorted(octants) == list(range(8))
    middle = np.where(first > [2, 2, 0], [3, 3, 1], [1, 1, -1])
    assert np.abs(first - middle).max() < 0.25


def test_seeds_give_other_points(room_row):
    _, cells = room_row(1)
    one, other = (volume(cells, 0).parts(8, seed)[0] for seed in (0, 1))
    assert one.shape == other.shape == (TRIES, 3)
    assert not np.any(np.all(one[:, None] == other[None], axis=2))


@pytest.mark.parametrize("power", [-20, 20])
def test_the_unit_does_not_matter(room_row, elsewhere, power):
    scene, cells = room_row(2)
    _, scaled = elsewhere(scene, cells, np.zeros(3), 2.0**power)
    here, there = volume(cells, 1), volume(scaled, 1)
    for part, scaled_part in zip(here.parts(5, 0), there.parts(5, 0), strict=True):
        assert np.array_equal(part * 2.0**power, scaled_part)
    assert np.array_equal(here.sobol(0, 64, 0)[:, :3] * 2.0**power, there.sobol(0, 64, 0)[:, :3])


def test_a_flat_cell_is_empty(room_row):
    _, cells = room_row(1)
    assert volume(replace(cells, leaf_point=cells.leaf_point * [1, 0, 1]), 0).empty
    assert not volume(cells, 0).empty
