"""Sample points: uniform in the cell, in equal parts, the same everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ptmtools.coverage.sampling import (
    TRIES,
    candidates,
    cloud,
    kronecker,
    strata,
    tetrahedra,
    volumes,
)

#: Corner tetrahedron of the unit cube: a sixth of it.
CORNER = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]], dtype=np.float64)


def test_tetrahedra_fill_the_cell(room_row):
    _, cells = room_row(2)
    assert volumes(tetrahedra(cells, 1)).sum() == pytest.approx(64)
    assert tetrahedra(cells, 1)[..., 0].min() == 4


def test_a_cell_of_several_leaves_is_filled_whole(room_row):
    _, cells = room_row(3)
    joined = replace(cells, leaf_cell=np.array([0, 1, 0], dtype=np.int32))
    points = np.concatenate(candidates(joined, 0, 8, 0))
    in_first = np.mean(points[:, 0] < 4)
    assert in_first == pytest.approx(0.5, abs=0.05)
    assert not np.any((points[:, 0] > 4) & (points[:, 0] < 8))


def test_the_sequence_is_frozen():
    """Artifacts depend on it: these are the first two points for ever."""
    assert kronecker(2, 0)[:, 0].tolist() == pytest.approx([0.8566748838545029, 0.7133497677])
    assert np.array_equal(kronecker(8, 3), kronecker(32, 0)[24:])
    assert np.array_equal(kronecker(4, 2**32 - 1) < 1, np.ones((4, 4), bool))


def test_the_cloud_is_uniform_in_a_tetrahedron():
    points = cloud(CORNER, 4096, 0)
    assert (points >= 0).all()
    assert (points.sum(axis=1) <= 1).all()
    assert points.mean(axis=0) == pytest.approx([0.25, 0.25, 0.25], abs=2e-3)
    # A plane at x = 1/2 cuts off an eighth.
    assert np.mean(points[:, 0] > 0.5) == pytest.approx(0.125, abs=2e-3)


def test_the_cloud_goes_by_volume():
    big = CORNER * 2 + 10
    points = cloud(np.concatenate([CORNER, big]), 9000, 0)
    assert np.mean(points[:, 0] < 5) == pytest.approx(1 / 9, abs=2e-3)


@given(count=st.integers(1, 40), parts=st.integers(1, 40), seed=st.integers(0, 99))
def test_strata_are_a_partition_into_equal_parts(count, parts, seed):
    points = np.random.default_rng(seed).random((count * parts, 3))
    groups = strata(points, parts)
    assert len(groups) == parts
    assert sorted(np.concatenate(groups)) == list(range(count * parts))
    assert {len(g) for g in groups} == {count}


def test_eight_samples_of_a_cube_are_the_middles_of_its_octants(room_row):
    _, cells = room_row(1)
    first = np.array([part[0] for part in candidates(cells, 0, 8, 0)])
    octants = (first > [2, 2, 0]).astype(int) @ [1, 2, 4]
    assert sorted(octants) == list(range(8))
    middle = np.where(first > [2, 2, 0], [3, 3, 1], [1, 1, -1])
    assert np.abs(first - middle).max() < 0.25


def test_seeds_give_other_points(room_row):
    _, cells = room_row(1)
    one, other = (candidates(cells, 0, 8, seed)[0] for seed in (0, 1))
    assert one.shape == other.shape == (TRIES, 3)
    assert not np.any(np.all(one[:, None] == other[None], axis=2))


@pytest.mark.parametrize("power", [-20, 20])
def test_the_unit_does_not_matter(room_row, elsewhere, power):
    scene, cells = room_row(2)
    _, scaled = elsewhere(scene, cells, np.zeros(3), 2.0**power)
    for part, there in zip(candidates(cells, 1, 5, 0), candidates(scaled, 1, 5, 0), strict=True):
        assert np.array_equal(part * 2.0**power, there)


def test_a_flat_cell_has_no_points(room_row):
    _, cells = room_row(1)
    flat = replace(cells, leaf_point=cells.leaf_point * [1, 0, 1])
    assert candidates(flat, 0, 8, 0) == []
