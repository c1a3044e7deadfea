"""The client `whole`: textures whole or not at all, the least recently seen ones leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.lab.policies import POLICIES
from ptmtools.lab.simulation import simulate
from ptmtools.link import Conditions
from tests.lab.worlds import catalogue, raw, standing

#: Bytes of a texture of 8 × 8 texels.
EACH = sum(raw(8).memory)


@pytest.mark.parametrize(
    ("room", "kept"), [(4 * EACH, [4, 4, 4, 4]), (3 * EACH - 1, [0, 0, 4, 4]), (EACH - 1, [0] * 4)]
)
def test_what_does_not_fit(room: int, kept: list[int]) -> None:
    """Who stands before four textures has the last ones of each look, whole."""
    stays = standing(catalogue([raw(8)] * 4, [(0, t) for t in range(4)]), 5)
    run = simulate(stays, POLICIES["whole"], Conditions(None), room)
    assert run.column[-1].tolist() == kept
    assert run.memory.max() <= room
    assert run.quality[-1] == 1
    assert set(np.unique(run.column)) <= {0, 4}


def test_what_is_out_of_sight_stays_until_room_is_needed() -> None:
    """Who turns from one wall to the other, and back."""
    stock = catalogue([raw(8)] * 2, [(0, 0), (0, 1)])
    low, high = stock.shapes.low.copy(), stock.shapes.high.copy()
    high[0, 2], low[1, 2] = 0.1, 3.9  # walls at z = 0 and z = 4
    stock = replace(stock, shapes=replace(stock.shapes, low=low, high=high))
    stays = standing(stock, 6)
    half = stays.frames // 2
    direction = np.zeros_like(stays.direction)
    direction[:half, 2], direction[half:, 2] = -1, 1
    turns = replace(stays, direction=direction)
    for room, kept in ((2 * EACH, [4, 4]), (2 * EACH - 1, [0, 4])):
        run = simulate(turns, POLICIES["whole"], Conditions(None), room)
        assert run.column[half - 1].tolist() == [4, 0]
        assert run.column[-1].tolist() == kept


def test_cells_out_of_the_visible_set_do_not_count() -> None:
    """`lru` fetches all textures ahead of which it has the geometry; `whole` those of the cell."""
    stock = catalogue([raw(8)] * 2, [(0, 0), (1, 1)], cells=2)
    lone = {**stock.records[0], "visible": [0], "ach": [1.0]}
    assert stock.visible[0].tolist() == [0, 1]
    stock = replace(stock, records=(lone, stock.records[1]))
    assert stock.visible[0].tolist() == [0]
    run = simulate(standing(stock, 5), POLICIES["whole"], Conditions(None), 1 << 30)
    assert run.column[-1].tolist() == [4, 0]
