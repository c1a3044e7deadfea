"""A void that a model closes, such as a base plate or a thick wall, is not the building."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.cells.building import Building
from ptmtools.cells.space import closed_share, divide
from ptmtools.cells.structure import Surroundings
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.orientation.space import to_world
from ptmtools.tolerance import Tolerance
from tests.cells.buildings import AXES, carved, room, write
from tests.cells.strangers import Parts, galleries, office, serpentine, street
from tests.scene.buildings import box


def walls_on_a_base(thickness: float) -> Parts:
    """Four walls without thickness or roof, 3 m high, on a base plate of 8 × 8 m."""
    around = np.asarray(box((0, 0, 0), (8, 8, 3)))[:, ::-1]
    upright = np.ptp(around[:, :, 2], axis=1) > 0
    return {"base": np.asarray(box((0, 0, -thickness), (8, 8, 0))), "walls": around[upright]}


def court() -> Parts:
    """A court of 18 × 18 m within walls 1 m thick and 4 m high, each a solid of its own."""
    sides = ((0, 0, 20, 1), (0, 19, 20, 20), (0, 1, 1, 19), (19, 1, 20, 19))
    return {"ground": np.asarray(box((0, 0, -0.1), (20, 20, 0)))} | {
        f"wall_{k}": np.asarray(box((x0, y0, 0), (x1, y1, 4)))
        for k, (x0, y0, x1, y1) in enumerate(sides)
    }


def house_in_a_garden() -> Parts:
    """A closed house of 10 × 8 m in a walled garden of 16 × 14 m."""
    wall: Floats = carved([room(-3, -3, 13, 11, 0, 5)], [room(-3, -3, 13, 11, 4, 6)])
    return {"house": carved([room(0, 0, 10, 8, 0.2, 3)]), "garden": wall}


@pytest.mark.parametrize(
    ("parts", "closed", "inside"),
    [
        (walls_on_a_base(0.45), False, (4, 4, 1.5)),
        (walls_on_a_base(0.6), False, (4, 4, 1.5)),
        (walls_on_a_base(2.5), False, (4, 4, 1.5)),
        (court(), False, (10, 10, 1.5)),
        (house_in_a_garden(), True, (5, 4, 1.5)),
    ],
    ids=["plate", "thick plate", "podium", "court", "garden"],
)
def test_where_the_building_is(
    parts: Parts, closed: bool, inside: tuple[float, float, float], tmp_path: Path
) -> None:
    scene = ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES))
    cells = subdivide(scene)
    leaf = int(cells.locate_leaf(to_world(np.array([inside]), scene.space))[0])
    assert cells.closed == closed
    assert leaf >= 0
    assert cells.leaf_standing[leaf]


@pytest.mark.parametrize(
    ("parts", "shows"),
    [
        (walls_on_a_base(0.6), True),
        (court(), True),
        (serpentine(2), True),
        (house_in_a_garden(), False),  # the garden has no more floor than four houses
        (office(4), False),
        (galleries(1, 3), False),
        (street(2), False),  # few walls are around its ground
    ],
    ids=["plate", "court", "halls", "garden", "office", "galleries", "street"],
)
def test_sight_shows_what_a_division_would(parts: Parts, shows: bool, tmp_path: Path) -> None:
    scene = ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES))
    building = Building.from_scene(scene, SubdivideOptions())
    assert (closed_share(building) is not None) == shows
    assert not (shows and divide(building, building.wide).closed)


def test_solids_that_overlap() -> None:
    """The middle of a tower in which two walls end is solid; a room between walls that overlap at
    its corners is not."""
    tower = box((-1, -1, 0), (5, 5, 9)), box((0, 0, 0), (2, 30, 6)), box((0, 0, 0), (30, 2, 6))
    walls = [box((0, k, 0), (9, k + 1, 3)) for k in (0, 8)]
    walls += [box((k, 0, 0), (k + 1, 9, 3)) for k in (0, 8)]
    for solids, points, solid in (
        (tower, [[3.5, 3.5, 1], [1, 1, 1], [1, 4, 5]], True),
        (tower, [[9, 9, 1], [4, 7, 1]], False),
        (walls, [[4, 4, 1], [2, 7, 1]], False),
        (walls, [[0.5, 0.5, 1], [8.5, 0.5, 2]], True),
    ):
        corners = np.concatenate(solids)[..., [1, 2, 0]]
        around = Surroundings(corners, Tolerance.for_extent(30.0))
        assert around.solid_groups(np.array(points)[:, None, [1, 2, 0]]).tolist() == (
            [solid] * len(points)
        )


@pytest.mark.parametrize(("high", "cells"), [(2.1, 2), (1.9, 1)])
def test_a_low_room_beside_a_room_is_noted(high: float, cells: int, tmp_path: Path) -> None:
    parts = {"rooms": carved([room(0, 0, 8, 6, 0, 3), room(8.3, 0, 15, 6, 0, high)])}
    result = subdivide(ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES)))
    assert result.cell_count == cells
    low = [note for note in result.notes if "rooms lower than 2 m" in note]
    assert len(low) == (cells == 1)
