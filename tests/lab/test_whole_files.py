"""The client `whole`: textures whole or not at all, the least recently seen ones leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.link import Conditions
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import simulate
from tests.lab.worlds import catalogue, raw, standing, world

#: Bytes of a texture of 8 × 8 texels.
EACH = sum(raw(8).memory)


@pytest.mark.parametrize(
    ("room", "kept"), [(4 * EACH, [4, 4, 4, 4]), (3 * EACH - 1, [0, 0, 4, 4]), (EACH - 1, [0] * 4)]
)
def test_what_does_not_fit(room: int, kept: list[int]) -> None:
    """Who stands before four textures has the last ones of each look, whole."""
    stays = standing(catalogue([raw(8)] * 4, [(0, t) for t in range(4)]), 5)
    run = simulate(stays, POLICIES["whole"], Conditions(None), room)
    # All have come in the first two seconds.
    assert {tuple(column) for column in run.column[10:].tolist()} == {tuple(kept)}
    assert run.memory.max() <= room
    assert run.quality[-1] == 1
    assert set(np.unique(run.column)) <= {0, 4}


def test_the_least_recently_seen_one_leaves() -> None:
    """Who looks at one wall, the opposite one, the first again and then a third one."""
    stock = catalogue([raw(8)] * 3, [(0, t) for t in range(3)])
    low = np.array([[0.0, 0, 0], [0, 0, 3.9], [3.9, 0, 1.5]])
    high = np.array([[1.5, 3, 0.1], [1.5, 3, 4], [4, 3, 2.5]])
    stock = replace(stock, shapes=replace(stock.shapes, low=low, high=high))
    looks = np.repeat([[0.0, 0, -1], [0, 0, 1], [0, 0, -1], [1, 0, 0]], 10, axis=0)
    turns = world(stock, np.tile([1.0, 1.6, 2.0], (40, 1)), looks)
    for room, kept in ((3, [4, 4, 4]), (2, [4, 0, 4]), (1, [0, 0, 4])):
        run = simulate(turns, POLICIES["whole"], Conditions(None), room * EACH)
        assert run.column[9].tolist() == [4, 0, 0]
        assert run.column[19].tolist() == [4 * (room > 1), 4, 0]
        assert run.column[-1].tolist() == kept


def test_cells_out_of_the_visible_set_do_not_count() -> None:
    """Who comes from the second room into the first one, and looks back through a wall."""
    stock = catalogue([raw(8)] * 2, [(0, 0), (1, 1)], cells=2)
    lone = {**stock.records[0], "visible": [0], "ach": [1.0]}
    stock = replace(stock, records=(lone, stock.records[1]))
    assert [visible.tolist() for visible in stock.visible] == [[0], [1, 0]]
    eye = np.repeat([[5.0, 1.6, 2.0], [1.0, 1.6, 2.0]], 15, axis=0)
    comes = world(stock, eye, np.tile([1.0, 0, 0], (30, 1)))
    run = simulate(comes, POLICIES["whole"], Conditions(None), 2 * EACH - 1)
    assert run.column[14].tolist() == [0, 4]
    assert run.column[-1].tolist() == [4, 0]
