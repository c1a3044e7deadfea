"""Visible copy of a piece in a boundary, by viewpoint."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.output.locating import Locator
from ptmtools.output.surfaces import sides
from tests.lab.worlds import leaf

#: In the plane x = 1, of which the normal points to +x.
WALL = np.array([[1.0, 0.2, 0.2], [1.0, 0.8, 0.2], [1.0, 0.5, 0.9]])
#: Two rooms on both sides of it, and one that is nowhere near.
ROOMS = Locator(
    [{"leaves": [leaf(low, low + 1)]} for low in np.array([[0.0, 0, 0], [1, 0, 0], [9, 0, 0]])]
)


def found(corner: list[Floats], cell: list[int], two_sided: bool = True) -> list[list[int]]:
    count = len(corner)
    return sides(
        np.array(corner).reshape(-1, 3, 3),
        np.array(cell, np.int32),
        np.full(count, two_sided),
        ROOMS,
    ).tolist()


def test_the_copy_on_the_viewers_side_is_seen() -> None:
    assert found([WALL, WALL], [0, 1]) == [[1, 0], [1, 0]]
    assert found([WALL, WALL], [1, 0]) == [[0, 1], [0, 1]]


@pytest.mark.parametrize("turn", [1, 2])
def test_copies_may_begin_with_another_corner_or_be_wound_the_other_way(turn: int) -> None:
    """What is in front is said of each by its own normal."""
    assert found([WALL, np.roll(WALL, turn, axis=0)], [0, 1]) == [[1, 0], [1, 0]]
    assert found([WALL, np.roll(WALL[::-1], turn, axis=0)], [0, 1]) == [[1, 0], [0, 1]]


def test_others_are_seen_themselves() -> None:
    """One that is alone, copies in one cell, one-sided ones, and on a side on which there is none
    of the cells."""
    above = WALL + [0, 0.05, 0]
    assert found([WALL, above], [0, 1]) == [[0, 0], [1, 1]]
    assert found([WALL, WALL], [1, 1]) == [[0, 0], [1, 1]]
    assert found([WALL, WALL], [0, 1], two_sided=False) == [[0, 0], [1, 1]]
    assert found([WALL, WALL], [0, 2]) == [[0, 0], [1, 0]]
    assert found([], []) == []


def test_a_flat_one_is_seen_itself() -> None:
    assert found([WALL[[0, 0, 0]]] * 2, [0, 1]) == [[0, 0], [1, 1]]
