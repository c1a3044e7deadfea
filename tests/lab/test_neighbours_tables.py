"""The tables of `benchmarks/neighbours.py`, as far as they need no simulation."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))
import neighbours


def world(still: list[int]) -> Any:
    return SimpleNamespace(track=SimpleNamespace(still=np.array(still, bool)))


@pytest.mark.parametrize(
    ("still", "expected"),
    [([0, 0, 0], []), ([0, 1, 1, 0, 1], [1, 4]), ([1, 1, 1], [])],
)
def test_a_place_is_a_frame_in_which_the_walker_comes_to_stand(
    still: list[int], expected: list[int]
) -> None:
    assert neighbours.standing_places(world(still)) == expected


def test_a_walk_without_a_stop_has_no_table_by_bytes() -> None:
    (line,) = neighbours.bytes_table(world([0, 0, 0]), [neighbours.POLICIES["best"]])
    assert "Nobody" in line
