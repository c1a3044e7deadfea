"""The storeys of a building: of the floors of rooms, not of what else is level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cells import Cells
from ptmtools.output.storeys import storey_names, storeys
from ptmtools.scene.model import Scene, Storey
from tests.conftest import scene_of

#: Height, metres, area, m², and whether something is above it.
Level = tuple[float, float, bool]
CUT = 1.2


def sheet(x: float, width: float, height: float, z: float = 0.0) -> list[list[float]]:
    """A level square, 1 m deep, at z or beyond."""
    corners = ((0, 0), (0, 1), (1, 1), (1, 0))
    return [[x + width * i, height, z + k] for i, k in corners]


def halves(quads: list[list[list[float]]]) -> Floats:
    return np.array(quads)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


def building(room_row, levels: Sequence[Level], left_out: int = 0) -> tuple[Scene, Cells]:
    """Floors side by side, far from the leaves of a room, the last ``left_out`` of them in no cell;
    ceilings are 2.5 m above them."""
    _, cells = room_row(1)
    x = np.cumsum([100.0, *(size for _, size, _ in levels)])
    floors = [sheet(at, size, y) for at, (y, size, _) in zip(x, levels, strict=False)]
    roofs = [
        sheet(at, size, y + 2.5)
        for at, (y, size, covered) in zip(x, levels, strict=False)
        if covered
    ]
    corners, first = halves(floors), 2 * (len(levels) - left_out)
    cells = replace(cells, eye_floor=corners[:first], left_out=corners[first:])
    return scene_of([*floors, *roofs]), cells


STEPS = [(0.15 * k, 0.4, True) for k in range(1, 24)]
CASES: dict[str, tuple[list[Level], list[float]]] = {
    "rooms above terrain": ([(0.2, 900, False), (0.65, 90, True), (5.45, 90, True)], [0.65, 5.45]),
    "roofs": ([(0, 300, True), (9, 60, False), (14, 50, False)], [0]),
    "stairs, landings": ([(0, 100, True), *STEPS, (1.8, 6, True), (3.6, 100, True)], [0, 3.6]),
    "split levels": ([(1.4 * k, 50, True) for k in range(4)], [0, 1.4, 2.8, 4.2]),
    "one step down": ([(0, 100, True), (-0.45, 80, True)], [0]),
    "a platform": ([(0, 190, True), (1.1, 130, True)], [0, 1.1]),
    "cupboards without ceilings": ([(0.3, 99, False), (2.1, 70, False)], [0.3]),
}


@pytest.mark.parametrize("name", CASES)
def test_floors_of_rooms(room_row, name: str) -> None:
    levels, expected = CASES[name]
    assert storeys(*building(room_row, levels), CUT) == pytest.approx(expected)
    assert storeys(*building(room_row, levels[::-1]), CUT) == pytest.approx(expected)


def test_every_floor_is_cut_at_a_useful_height(room_row) -> None:
    """Those of a storey's area, whatever their heights."""
    random = np.random.default_rng(5)
    for _ in range(30):
        levels = [(y, 50.0, True) for y in random.uniform(0, 9, 6).tolist()]
        cuts = np.array(storeys(*building(room_row, levels), CUT)) + CUT
        for y, _, _ in levels:
            assert ((cuts - y >= CUT / 2 - 1e-9) & (cuts - y <= 1.5 * CUT + 1e-9)).any()


def test_storeys_that_the_model_names_may_be_small(room_row) -> None:
    levels = [(0.0, 100.0, True), (3.0, 100.0, True), (6.2, 5.0, True)]
    scene, cells = building(room_row, levels)
    assert storeys(scene, cells, CUT) == [0, 3]
    named = replace(scene, storeys=(Storey("EG", -0.1), Storey("Plant", 6.0), Storey("Top", 9.0)))
    floors = storeys(named, cells, CUT)
    assert floors == pytest.approx([0, 3, 6.2])
    assert storey_names(named, floors) == ["EG", "Storey 2", "Plant"]
    assert storey_names(scene, [0.0, 3.0]) == ["Storey 1", "Storey 2"]
    assert storey_names(scene, [0.0]) == [""]
    assert storey_names(named, [0.0]) == ["EG"]


def test_floor_in_no_cell_counts_under_a_ceiling(room_row) -> None:
    levels = [(0.0, 100.0, True), (3.0, 80.0, True), (6.0, 80.0, False)]
    assert storeys(*building(room_row, levels, left_out=2), CUT) == [0, 3]


def test_a_canopy_makes_no_room(room_row) -> None:
    """A place is a room if most of its leaf's floor is covered: open ground is the storey, not what
    is below a small roof on it."""
    _, cells = room_row(1)
    for width, expected in ((0.4, [0.0]), (3.0, [0.0, 1.0])):
        ground, stage = sheet(0, 4 - width, 0.0), sheet(4 - width, width, 1.0)
        scene = scene_of([ground, stage, sheet(4 - width, width, 3.5)])
        cells = replace(cells, eye_floor=halves([ground, stage]))
        assert storeys(scene, cells, 0.8) == expected


def test_eyes_anywhere(room_row) -> None:
    """The bottoms of the leaves are floors, where the subdivision knows no others."""
    _, cells = room_row(2)
    scene = scene_of([sheet(0, 8, 9.0, z=-0.5)])
    for lift, expected in ((0.0, [0.0]), (4.0, [0.0, 4.0]), (0.5, [0.0])):
        lifted = cells.leaf_point.copy()
        lifted[8:, 1] += lift
        assert storeys(scene, replace(cells, leaf_point=lifted), CUT) == expected
