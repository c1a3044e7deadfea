"""From counts to hints: sums, order statistics, and error bars against simulated truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import GROUPS, AchOptions
from ptmtools.coverage.sampling import estimate, group_numbers, ninety_fifth, shares, spread
from ptmtools.visibility.model import Pvs

COUNTS = st.integers(1, 6).flatmap(
    lambda n: st.lists(
        st.lists(st.one_of(st.just(0), st.integers(0, 2**20)), min_size=n, max_size=n),
        min_size=1,
        max_size=45,
    )
)


def in_all_views(at_points):
    """(K, n) counts as those of (K, 6, n): all of them in the first view."""
    counts = np.zeros((len(at_points), 6, at_points.shape[1]), dtype=np.int64)
    counts[:, 0] = at_points
    return counts


@given(st.lists(st.integers(0, 2**40), min_size=1, max_size=50))
def test_shares_sum_to_1_for_any_counts(counts):
    actual = shares(np.array(counts))
    assert abs(math.fsum(actual) - 1) <= 2.0**-52
    assert ((actual >= 0) & (actual <= 1)).all()
    if not any(counts):
        assert actual[0] == 1


def test_shares_of_many_rows_and_of_none():
    assert shares(np.array([[1, 3], [0, 0]])).tolist() == [[0.25, 0.75], [1.0, 0.0]]
    assert shares(np.zeros((3, 0), dtype=np.int64)).shape == (3, 0)


@given(COUNTS)
def test_ninety_five_percent_of_the_points_do_not_exceed_p95(rows):
    counts = np.array(rows, dtype=np.int64)
    actual = ninety_fifth(counts)
    at_points = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    for share, column in zip(actual, at_points.T, strict=True):
        enough = [x for x in column if 20 * np.count_nonzero(column <= x) >= 19 * len(column)]
        assert share == min(enough)


def estimated(counts, group, unit):
    """Of (K, 6, n) pixels at each point in each view."""
    return estimate(counts.sum(axis=1), counts.sum(axis=0), group, unit)


def test_the_ninety_fifth_of_twenty_is_the_last_but_one():
    counts = np.column_stack([np.arange(20), 100 - np.arange(20)])
    assert ninety_fifth(counts).tolist() == [0.18, 0.99]
    assert ninety_fifth(counts[:19]).tolist() == [0.18, 1.0]


@given(st.integers(0, 300))
def test_groups_are_stretches_of_equal_length(count):
    group = group_numbers(count)
    assert np.array_equal(group, np.sort(group))
    size = np.bincount(group)
    assert len(size) == min(count, GROUPS)
    if count:
        assert size.max() - size.min() <= 1


def test_of_parts_in_order_every_eighth_is_a_group():
    group = group_numbers(20, in_stretches=False)
    assert group.tolist() == [*range(8), *range(8), *range(4)]
    assert group_numbers(3, in_stretches=False).tolist() == [0, 1, 2]
    assert group_numbers(0, in_stretches=False).tolist() == []


def test_views_weighted_by_what_they_show_are_the_whole():
    counts = np.random.default_rng(0).integers(0, 50, (40, 6, 5)) * [9, 3, 1, 1, 0]
    row = estimated(counts, group_numbers(40), 1)
    assert row.views.shape == (5, 6)
    assert row.views.sum(axis=0) == pytest.approx(np.ones(6), abs=1e-15)
    weight = counts.sum(axis=(0, 2))
    assert row.views @ weight / weight.sum() == pytest.approx(row.value)
    assert row.views[:, 2] == pytest.approx(counts[:, 2].sum(axis=0) / counts[:, 2].sum())


def test_an_empty_view_has_1_for_the_cell_itself():
    row = estimated(in_all_views(np.array([[3, 1], [5, 1]])), group_numbers(2), 1)
    assert row.views[:, 0].tolist() == [0.8, 0.2]
    assert row.views[:, 1:].tolist() == [[1.0] * 5, [0.0] * 5]


def test_points_that_see_nothing_count_as_points():
    at_points = np.array([[4, 4], [0, 0], [0, 0], [8, 0]])
    row = estimated(in_all_views(at_points), group_numbers(4), 4)
    assert row.value.tolist() == [0.75, 0.25]
    assert row.pixels.tolist() == [3, 1]
    assert row.seen.tolist() == [0.5, 0.25]
    assert row.p95.tolist() == [1.0, 0.5]


@pytest.mark.parametrize(
    ("at_points", "value", "seen"),
    [
        (np.zeros((9, 3), int), [1, 0, 0], [0, 0, 0]),
        (np.zeros((0, 2), int), [1, 0], [0, 0]),
        (np.array([[7, 1]]), [0.875, 0.125], [1, 1]),
    ],
)
def test_nothing_seen_no_points_and_one_say_nothing_of_errors(at_points, value, seen):
    row = estimated(in_all_views(at_points), group_numbers(len(at_points)), 1)
    assert row.value.tolist() == value
    assert row.seen.tolist() == seen
    assert row.p95.tolist() == [v * s for v, s in zip(value, seen, strict=True)]
    assert row.pixels.tolist() == at_points.sum(axis=0).tolist()
    assert np.isnan(row.error).all()
    assert math.isnan(row.uncertain) == (len(at_points) < GROUPS)


def test_what_was_never_met_has_no_error_of_0():
    at_points = np.random.default_rng(1).integers(1, 9, (16, 3)) * [1, 1, 0]
    row = estimated(in_all_views(at_points), group_numbers(16), 1)
    assert np.isnan(row.error).tolist() == [False, False, True]
    assert row.error[0] > 0
    assert row.value[2] == row.seen[2] == row.p95[2] == 0


def simulated(mixture, sizes, runs, seed):
    """Cells as seen from points in one of several parts of a cell: in part p, of weight
    ``mixture[p]``, what is seen is spread as ``sizes[p]`` says. (runs, GROUPS, n) counts of groups
    of 16 points, and the true shares."""
    rng = np.random.default_rng(seed)
    part = rng.choice(len(mixture), (runs, GROUPS * 16), p=mixture)
    counts = rng.poisson(np.array(sizes, dtype=float)[part])
    truth = np.array(mixture) @ np.array(sizes)
    return counts, truth / truth.sum()


MIXTURES = {
    "two parts": ([0.5, 0.5], [[90, 6], [60, 36]]),
    "a rare sight": ([0.9, 0.1], [[96, 0, 0], [56, 30, 10]]),
    "many cells": ([0.25] * 4, (10 * np.random.default_rng(5).dirichlet([0.3] * 20, 4)).tolist()),
    "half the views empty": ([0.5, 0.5], [[90, 6], [20, 4]]),
}


@pytest.mark.parametrize("name", MIXTURES)
def test_error_bars_are_as_wide_as_the_truth_is_far(name):
    """The root mean square of the standard errors against that of the errors; the bound of the
    total variation against how often it holds."""
    counts, truth = simulated(*MIXTURES[name], runs=1500, seed=2)
    group = group_numbers(counts.shape[1])
    actual = [spread(run, group) for run in counts]
    away = np.array([shares(run.sum(axis=0)) for run in counts]) - truth
    claimed = np.sqrt(np.mean([error**2 for error, _ in actual], axis=0))
    assert claimed == pytest.approx(np.sqrt((away**2).mean(axis=0)), rel=0.08)
    holds = np.mean(np.abs(away).sum(axis=1) / 2 <= [bound for _, bound in actual])
    assert 0.93 <= holds <= 0.99


@pytest.mark.parametrize("groups", range(2, GROUPS))
def test_of_fewer_groups_there_is_no_bound(groups):
    """Two groups are always equally far from their mean, so their distances tell nothing of how
    far that is from the truth."""
    counts, truth = simulated(*MIXTURES["two parts"], runs=1000, seed=groups)
    actual = [spread(run, np.arange(128) * groups // 128) for run in counts]
    assert np.isnan([bound for _, bound in actual]).all()
    away = np.array([shares(run.sum(axis=0)) for run in counts]) - truth
    claimed = np.sqrt(np.mean([error**2 for error, _ in actual], axis=0))
    assert claimed == pytest.approx(np.sqrt((away**2).mean(axis=0)), rel=0.1)


def test_all_fields_are_aligned_with_the_pvs(room_row, furnish):
    """Rows of different lengths; the last room is never met, since its door is bricked up."""
    scene, cells = room_row(4)
    bricks = [[12, 0, -1], [12, 3, -1], [12, 3, 1], [12, 0, 1]]
    scene, cells = furnish(scene, cells, [bricks], [(3, 2)])
    visible = np.ones((4, 4), dtype=bool)
    visible[0, 3] = visible[3, 0] = False
    pvs = Pvs.from_matrix(visible)
    options = AchOptions(samples=24, face=2, backend="embree")
    ach = compute_ach(scene, cells, pvs, options)
    n = len(pvs.cell)
    for name in ("value", "pixels", "error", "p95", "seen"):
        assert getattr(ach, name).shape == (n,), name
    assert ach.views.shape == (n, 6)
    for name in ("missed", "samples", "rejected", "uncertain", "unseen_below", "floor"):
        assert getattr(ach, name).shape == (4,), name
    assert ach.row(0).shape == (3,)
    assert ach.unseen_below.tolist() == [3 / 24] * 4
    for i in range(4):
        entries = ach.entries(i)
        pixels = ach.pixels[entries]
        assert ach.floor[i] == 0.5 / pixels.sum()
        assert ach.value[entries] == pytest.approx(pixels / pixels.sum())
        assert ach.views[entries].sum(axis=0) == pytest.approx(np.ones(6))
        # In a closed room all views are full, but for what is missed.
        if ach.missed[i] == 0:
            assert ach.views[entries].mean(axis=1) == pytest.approx(ach.value[entries])
        assert np.array_equal(np.isnan(ach.error[entries]), pixels == 0)
        assert np.array_equal(ach.seen[entries] > 0, pixels > 0)
        assert (ach.p95[entries][ach.seen[entries] <= 0.05] == 0).all()
    met = ach.pixels > 0
    assert [i for i in range(4) if not met[ach.entries(i)].all()] == [1, 2, 3]
    assert (ach.p95[met & (ach.seen == 1)] >= ach.value[met & (ach.seen == 1)]).all()
    along = ach.views[ach.entries(0)][1:]
    assert along[:, 0].sum() > 0
    assert along[:, 1].sum() == 0, "room 0 has no door at -x"


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_rule_of_three_never_claims_more_than_all(room_row, samples):
    scene, cells = room_row(2)
    options = AchOptions(samples=samples, face=2, backend="embree")
    ach = compute_ach(scene, cells, Pvs.from_matrix(np.ones((2, 2), bool)), options)
    assert ach.unseen_below.tolist() == [1.0, 1.0]
    assert np.isnan(ach.uncertain).all()
    assert np.isnan(ach.error).all() == (samples == 1)
