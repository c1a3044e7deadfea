"""Numbers of the hints: as few digits as they are good for, and no fewer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.errors import DatabaseError
from ptmtools.output.hints import _round_down
from ptmtools.output.numbers import coordinates, json_text, shares_of, significant


@given(st.lists(st.floats(0, 1) | st.floats(1e-12, 1e-6) | st.just(0.0), min_size=1, max_size=400))
def test_shares_still_sum_to_one(parts: list[float]) -> None:
    whole = math.fsum(parts)
    row = np.array(parts) / whole if whole > 1e-6 else np.eye(1, len(parts))[0]
    actual = shares_of(row)
    assert abs(math.fsum(actual) - 1) <= 1e-9
    assert abs(float(np.array(actual, np.float32).astype(np.float64).sum()) - 1) <= 1e-5
    for short, exact in zip(actual, row.tolist(), strict=True):
        assert short >= 0
        assert (short == 0) == (exact == 0) or exact < 1e-15
        assert short == pytest.approx(exact, rel=1.01e-4, abs=1e-10)
    assert sum(len(repr(share)) > 11 for share in actual) <= 1


def test_many_equal_shares() -> None:
    """Rounded one by one they would miss 1 by more than the greatest."""
    row = np.full(70_001, 1 / 70_001)
    actual = shares_of(row)
    assert abs(math.fsum(actual) - 1) <= 1e-9
    assert max(actual) / min(actual) < 1 + 1e-4


def test_coordinates_are_those_of_float32() -> None:
    values = np.array([[0.1, -0.0, 12.0], [1 / 3, 1e-7, -123456.789], [1e20, 5e-40, 2.5]])
    actual = coordinates(values, "points")
    assert (np.array(actual, np.float32) == values.astype(np.float32)).all()
    assert actual[0] == [0.1, 0, 12]
    assert json_text(actual[0]) == "[0.1,0,12]"
    assert json_text(actual[1]) == "[0.33333334,1e-07,-123456.79]"
    with pytest.raises(DatabaseError, match="PTM-D601"):
        coordinates([1e39], "points")


def test_statistics_have_five_digits() -> None:
    values = np.array([1 / 3, np.nan, 0.0, 1.0, 123456.7])
    assert json_text(significant(values)) == "[0.33333,null,0,1,123460]"
    with pytest.raises(DatabaseError, match="PTM-D601"):
        json_text([math.inf])


@given(st.floats(-1e4, 1e4), st.integers(-14, 12))
def test_boxes_are_rounded_outwards(steps: float, decimals: int) -> None:
    """Within the building, that is within thousands of steps."""
    step = 10.0**-decimals
    value = steps * step
    low = float(_round_down(np.array([value]), decimals)[0])
    assert low <= value
    assert value - low <= step * (1 + 1e-9)
    assert len(f"{low:.12g}") <= len(f"{step:.12g}") + 5
