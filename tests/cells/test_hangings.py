"""Pictures, screens and boards on walls divide nothing; walls and linings do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.cells.building import Building
from ptmtools.scene import IngestOptions, ingest
from tests.cells.buildings import AXES, carved, room, write
from tests.cells.strangers import Parts
from tests.scene.buildings import box

#: Two rooms of 8 × 5 m with a doorway between, 3 m high, in walls 0.2 m thick.
ROOMS = [room(0, 0, 8, 5, 0, 3), room(0, 5.2, 8, 10.2, 0, 3)]
HOUSE = carved(ROOMS, [room(3.5, 5, 4.5, 5.2, 0, 2.1)])

PICTURES: Parts = {
    "canvas": np.asarray(box((1, 0.02, 1), (4, 0.06, 2.6))),
    "screen": np.asarray(box((5, 0.02, 0.8), (7.6, 0.12, 2.2))),
    "board": np.asarray(box((0.05, 1, 0.9), (0.07, 4, 2.1))),
    "radiator": np.asarray(box((5, 9.98, 0.02), (7.8, 10.1, 0.9))),
}


def walls_of(parts: Parts, folder: Path) -> int:
    """The number of planes that divide."""
    scene = ingest(write(folder / "model.obj", parts.items()), IngestOptions(**AXES))
    return len(Building.from_scene(scene, SubdivideOptions()).walls)


@pytest.mark.parametrize("name", PICTURES)
def test_what_hangs_on_a_wall_does_not_divide(name: str, tmp_path: Path) -> None:
    with_it = walls_of({"house": HOUSE, name: PICTURES[name]}, tmp_path)
    assert with_it == walls_of({"house": HOUSE}, tmp_path)


def test_rooms_with_pictures_have_the_cells_of_bare_ones(tmp_path: Path) -> None:
    shapes = []
    for parts in ({"house": HOUSE}, {"house": HOUSE, **PICTURES}):
        scene = ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES))
        cells = subdivide(scene)
        shapes.append((cells.cell_count, cells.leaf_count, len(cells.portal_leaf)))
        noted = [note for note in cells.notes if "such as pictures" in note]
        assert len(noted) == (len(parts) > 1)
    assert shapes[0] == shapes[1]
    assert shapes[0][0] == 2


@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("screen wall", box((2, 2, 0), (6, 2.1, 3))),  # nothing is behind it
        ("lining", box((0, 0.05, 0), (8, 0.1, 3))),  # from wall to wall
        ("shelf", box((1, 0, 0.5), (5, 0.4, 2.5))),  # too deep
    ],
)
def test_what_stands_free_or_lines_a_room_divides(name: str, part: object, tmp_path: Path) -> None:
    more = walls_of({"house": HOUSE, name: np.asarray(part)}, tmp_path)
    assert more > walls_of({"house": HOUSE}, tmp_path)


def test_a_cover_over_a_hole_divides(tmp_path: Path) -> None:
    """Its sides are reveals between it and the wall; without it, the room would be open."""
    cover = np.asarray(box((2, -0.3, 0.7), (5, -0.2, 2.3)))
    parts = {
        "house": carved(ROOMS[:1], [room(3, -0.2, 3.5, 0, 1, 1.5)]),
        "cover": cover[(cover[:, :, 1] < -0.2).any(axis=1)],  # without a back
    }
    scene = ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES))
    assert subdivide(scene).closed


def test_a_name_turns_the_rule_off(tmp_path: Path) -> None:
    parts = {"house": HOUSE, "canvas": PICTURES["canvas"]}
    scene = ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES))
    plain, forced = (
        len(Building.from_scene(scene, SubdivideOptions(structural=names)).walls)
        for names in ((), ("canvas",))
    )
    assert forced > plain
