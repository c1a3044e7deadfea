"""The rooms of a model: clear heights, and the visitors that fit."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cells.options import WALKER
from ptmtools.scene.orientation.room_sizes import HEIGHT, NO_ROOMS, RADIUS, RoomSizes
from ptmtools.scene.orientation.up_axis import NamedFaces, evidence
from tests.scene.buildings import (
    atrium,
    box,
    castle,
    corridor,
    house,
    mezzanine,
    sheet,
    tower,
    wall,
    welded,
)
from tests.scene.districts import (
    boulder,
    city,
    flat,
    hills,
    museum,
    office,
    serpentine,
    square,
    table,
)


def of(triangles: Floats) -> RoomSizes:
    """With Z up."""
    points, faces = welded(triangles)
    named = NamedFaces(*np.zeros((2, len(faces)), dtype=bool))
    return evidence(points, faces, named)["z"].rooms


def test_the_visitor_is_the_default_one() -> None:
    assert (WALKER.radius, WALKER.height) == (RADIUS, HEIGHT)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_plain_room(scale: float) -> None:
    room = of(box((0, 0, 0), (3 * scale, 4 * scale, 2.5 * scale)))
    assert room.visitors == pytest.approx([2.5 * scale] * 20)
    assert room.heights == pytest.approx([2.5 * scale] * 20)
    assert room.storey == (pytest.approx(2.5 * scale), 1.0)
    assert room.share(2.4 * scale) == 1
    assert room.share(2.6 * scale) == 0


def test_a_narrow_passage_limits_the_visitor() -> None:
    """40 cm wide and 1.9 m high: the visitor of 1.7 m needs 50 cm."""
    passage = of(box((0, 0, 0), (8, 0.4, 1.9)))
    assert passage.visitors == pytest.approx([1.7 * 0.4 / 0.5] * 20)
    assert passage.heights == pytest.approx([1.9] * 20)


def test_two_heights() -> None:
    """Rooms 3 m and 5 m high of equal area: 3 and 5 of 8 parts of the space."""
    parts = [box((0, 0, 0), (4, 4, 3)), box((4, 0, 0), (8, 4, 5))]
    rooms = of(np.concatenate(parts))
    assert rooms.share(2.9) == 1
    assert rooms.share(4.9) == pytest.approx(5 / 8, abs=0.1)
    assert rooms.storey == (pytest.approx(5), pytest.approx(5 / 8, abs=0.1))


def test_without_a_ceiling_a_room_is_as_high_as_its_walls() -> None:
    """Beside a mast of 20 m."""
    court = [box((0, 0, -0.2), (10, 10, 0)), box((12, 0, 0), (12.2, 0.2, 20))]
    court += [wall((0, y), (10, y), 4) for y in (0.0, 10.0)]
    court += [wall((x, 0), (x, 10), 4) for x in (0.0, 10.0)]
    rooms = of(np.concatenate(court))
    assert 3 < rooms.storey[0] < 5


def test_without_a_floor_a_room_is_as_high_as_its_walls() -> None:
    """A block of a city whose base is missing, beside a shaft that is 20 m deep."""
    block = box((0, 0, 0), (12, 12, 9))
    block = block[(block[:, :, 2] > 0).any(axis=1)]
    shaft = box((14, 0, -20), (14.2, 0.2, 0))
    rooms = of(np.concatenate([block, shaft]))
    assert 8 < rooms.storey[0] < 10
    assert rooms.share(8) > 0.9


@pytest.mark.parametrize(
    "triangles",
    [
        house(),
        house(roof=False),
        house(floor=False),
        house(12, 12, 2.7, storeys=20),
        corridor(40, 2, 3, rooms=True),
        mezzanine(),
        castle(3),
        tower(),
        atrium(),
        city(),
        city(ground=False),
        square(),
        square(solid=False),
        museum(),
        serpentine(),
        office(),
        flat(),
    ],
)
def test_a_visitor_fits_in_metres_only(triangles: Floats) -> None:
    """At most places, whatever stands there; in none of the buildings a hundredth of the size."""
    rooms = of(triangles)
    assert rooms.share(HEIGHT) >= 0.6
    assert rooms.share(HEIGHT * 100) == 0


@pytest.mark.parametrize(
    "triangles",
    [
        house(floor=False, roof=False),
        hills(),
        boulder(),
        table(),
        box((-400, -400, -0.6), (400, 400, -0.3)),
        sheet((0, 0, 0), (5, 0, 0), (5, 3, 0), (0, 3, 0)),
    ],
)
def test_no_rooms(triangles: Floats) -> None:
    """Walls without floors and ceilings, terrain, objects, a slab."""
    assert of(triangles) == NO_ROOMS
    assert NO_ROOMS.share(1e9) == 1
    assert NO_ROOMS.storey == (0, 0)
