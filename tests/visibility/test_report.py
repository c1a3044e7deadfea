"""Leaks are found and named, work is counted portal by portal, and the sets survive storage."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.errors import InputError
from ptmtools.visibility import Pvs, PvsOptions, compute_pvs
from ptmtools.visibility.report import report

#: Rooms of a row, and rows; in all rows but the last the doors take turns and hide the far rooms.
LONG, ROWS = 20, 4
#: Where the last row has its smallest door.
GAP = 9


@pytest.fixture(scope="module")
def leaky(build_rooms):
    xs, zs = np.arange(LONG + 1) * 4.0, np.arange(ROWS + 1) * 4.0
    doors = {}
    for k in range(ROWS):
        for i in range(LONG - 1):
            low = 4.0 * k + (0.0 if i % 2 else 3.0)
            span = (low, low + 1.0)
            if k == ROWS - 1:
                span = (zs[k] + 1.0, zs[k] + 3.0)
            if k == ROWS - 1 and i == GAP:
                span = (zs[k] + 1.99, zs[k] + 2.01)
            doors[i, 0, k, 0] = [(0.0, 2.0, *span)]
    rooms = build_rooms(xs, [0.0, 3.0], zs, doors)
    area = np.array(
        [np.ptp(rooms.cells.portal(k)[:, 2]) * 2.0 for k in range(rooms.cells.portal_count)]
    )
    object.__setattr__(rooms.cells, "portal_area", area)
    return rooms


def test_the_smallest_opening_that_shows_half_is_named(leaky):
    cells = leaky.cells
    summary = report(cells, compute_pvs(cells))
    row = [leaky.index(i, 0, ROWS - 1) for i in range(LONG)]
    assert {leak.cell for leak in summary.leaks} <= set(row)
    first = next(leak for leak in summary.leaks if leak.cell == row[0])
    assert set(first.cells) == {row[GAP], row[GAP + 1]}
    assert (first.sees, first.through) == (LONG, LONG - GAP - 1)
    assert first.area == pytest.approx(0.04)
    assert first.centre == pytest.approx((4.0 * (GAP + 1), 1.0, 4.0 * ROWS - 2.0))


def test_rooms_that_all_see_as_much_do_not_leak(room_row):
    _, cells = room_row(9)
    assert report(cells, compute_pvs(cells)).leaks == ()


def test_sizes_and_work_add_up(leaky):
    pvs = compute_pvs(leaky.cells)
    summary = report(leaky.cells, pvs)
    sizes = np.diff(pvs.start)
    assert summary.sizes[0] == (0.0, sizes.min())
    assert summary.sizes[-1] == (1.0, sizes.max())
    assert dict(summary.sizes)[0.5] == np.sort(sizes)[len(sizes) // 2 - 1]
    assert summary.average == pytest.approx(sizes.mean())
    assert summary.operations == pvs.work.sum() > 0
    costliest = [one.operations for one in summary.costliest]
    assert costliest == sorted(pvs.work.tolist(), reverse=True)[: len(costliest)]
    assert summary.fallbacks == sum(compute_pvs(leaky.cells).cut)
    assert summary.conservative


def test_methods_are_ordered(leaky):
    full, fast, sampled = (
        compute_pvs(leaky.cells, PvsOptions(method=method))  # type: ignore[arg-type]
        for method in ("full", "fast", "sampled")
    )
    assert not np.any(full.to_matrix() & ~fast.to_matrix())
    assert not np.any(sampled.to_matrix() & ~full.to_matrix())
    assert [pvs.conservative for pvs in (full, fast, sampled)] == [True, True, False]
    assert not report(leaky.cells, sampled).conservative
    assert report(leaky.cells, sampled).costliest == ()


def test_all_of_it_survives_storage(leaky):
    for method in ("full", "sampled"):
        pvs = compute_pvs(leaky.cells, PvsOptions(method=method))  # type: ignore[arg-type]
        again = Pvs.from_arrays(pvs.to_arrays())
        assert report(leaky.cells, again) == report(leaky.cells, pvs)
        assert np.array_equal(again.to_matrix(), pvs.to_matrix())


@pytest.mark.parametrize("options", [{"method": "exact"}, {"lines": 0}])
def test_options_out_of_range(options):
    with pytest.raises(InputError, match="PTM-I111"):
        PvsOptions(**options)
