"""Hints that are known: a window into another cell, and rooms with doors, by quadrature over the
room of closed forms for each point of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import AchOptions
from ptmtools.visibility.model import Pvs

WEIGHTINGS = ["pixel", "solid-angle"]
WINDOW_Y, WINDOW_Z = (1.0, 2.5), (-1.0, 0.5)


def all_visible(n):
    return Pvs.from_matrix(np.ones((n, n), dtype=bool))


def with_a_window(room_row, furnish):
    """Two rooms, the door between them bricked up but for a window."""
    scene, cells = room_row(2)
    y, z = (0.0, *WINDOW_Y, 3.0), (-1.0, *WINDOW_Z, 1.0)
    bricks = [
        [[4, y[i], z[j]], [4, y[i + 1], z[j]], [4, y[i + 1], z[j + 1]], [4, y[i], z[j + 1]]]
        for i in range(3)
        for j in range(3)
        if (i, j) != (1, 1)
    ]
    return furnish(scene, cells, bricks, [(1, 0)] * len(bricks))


def assert_near(ach, expected, tightest):
    """Within three standard errors, which are below a share ``tightest`` of what is expected."""
    assert (ach.error < tightest * expected).all()
    assert (ach.error > 0).all()
    assert (np.abs(ach.value - expected) <= 3 * ach.error).all()


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_the_quadrature_itself(through_doors, weighting):
    """Against random lines of sight, weighted as the pixels of a view."""
    rng = np.random.default_rng(0)
    count = 400_000
    eye = rng.uniform([0, 0, -2], [4, 4, 2], (count, 3))
    along = rng.uniform(-1, 1, (count, 3))
    axis = rng.integers(0, 3, count)
    along[np.arange(count), axis] = rng.choice([-1, 1], count)
    weight = np.linalg.norm(along, axis=1) ** (-3 if weighting == "solid-angle" else 0)
    passes = along[:, 0] > 0
    for door in (1, 2):
        t = (4 * door - eye[:, 0]) / along[:, 0]
        y, z = (eye + t[:, None] * along)[:, 1:].T
        passes &= (y > 0) & (y < 3) & (np.abs(z) < 1)
        actual = np.average(passes, weights=weight)
        assert through_doors(door, weighting) == pytest.approx(
            actual, rel=0.02 if door == 1 else 0.1
        )


def test_all_of_a_wall_is_a_sixth(through_doors):
    """By symmetry, averaged over a cube."""
    for weighting in WEIGHTINGS:
        share = through_doors(1, weighting, (0.0, 4.0), (-2.0, 2.0))
        assert share == pytest.approx(1 / 6, abs=1e-5)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_one_window(room_row, furnish, backend, through_doors, weighting):
    scene, cells = with_a_window(room_row, furnish)
    options = AchOptions(samples=1024, face=4, backend=backend, weighting=weighting)
    ach = compute_ach(scene, cells, all_visible(2), options)
    share = through_doors(1, weighting, WINDOW_Y, WINDOW_Z)
    assert share == pytest.approx(0.025, abs=0.005)
    assert_near(ach, np.array([1 - share, share] * 2), tightest=0.06)
    assert ach.missed.tolist() == [0, 0]


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_two_rooms_and_a_door(room_row, backend, through_doors, weighting):
    options = AchOptions(samples=1024, face=4, backend=backend, weighting=weighting)
    ach = compute_ach(*room_row(2), all_visible(2), options)
    share = through_doors(1, weighting)
    assert_near(ach, np.array([1 - share, share] * 2), tightest=0.02)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_three_rooms_seen_through_two_doors(room_row, backend, exact_row, weighting):
    """The second door is partly hidden by the edges of the first."""
    options = AchOptions(samples=1024, face=8, backend=backend, weighting=weighting)
    pvs = all_visible(3)
    ach = compute_ach(*room_row(3), pvs, options)
    truth = exact_row(3, weighting)
    expected = np.concatenate([truth[i, pvs.row(i)] for i in range(3)])
    assert expected.min() < 0.01
    assert_near(ach, expected, tightest=0.1)


def test_the_weightings_differ_by_more_than_their_errors(room_row, exact_row):
    """Of what lies far ahead, which is small and in the middle of a view, pixels show less than
    the solid angle says."""
    pixel, angle = (exact_row(3, weighting) for weighting in WEIGHTINGS)
    assert angle[0, 2] > 1.5 * pixel[0, 2]
    for weighting, own, other in (("pixel", pixel, angle), ("solid-angle", angle, pixel)):
        options = AchOptions(samples=1024, face=8, backend="embree", weighting=weighting)
        row = compute_ach(*room_row(3), all_visible(3), options)
        far = int(row.start[0]) + 2
        assert abs(row.value[far] - own[0, 2]) <= 3 * row.error[far]
        assert abs(row.value[far] - other[0, 2]) > 6 * row.error[far]


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_large_views_of_a_few_points_estimate_the_same(room_row, through_doors, weighting):
    """As the paper does it: the same limit, from another end. Many seeds of 8 points."""
    share = through_doors(1, weighting)
    options = AchOptions(preset="paper", face=16, backend="embree", weighting=weighting)
    actual = [
        compute_ach(*room_row(2), all_visible(2), replace(options, seed=seed)).value[1::2].mean()
        for seed in range(60)
    ]
    error = np.std(actual, ddof=1) / np.sqrt(len(actual))
    assert error < 0.06 * share
    assert abs(np.mean(actual) - share) <= 3 * error
