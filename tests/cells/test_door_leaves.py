"""Which objects are door leaves. Expectations follow from the definitions in docs/design/cells.md;
they were written before the first run.
"""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.cells.fabric import is_door_name
from ptmtools.errors import InputError
from tests.cells.conftest import box, panel
from tests.cells.doored_rooms import (
    HOLE,
    A,
    B,
    Faces,
    Hole,
    leaf,
    leaf_names,
    rooms,
    scene,
    sheet,
    solid,
    together,
)
from tests.conftest import subdivided


@pytest.mark.parametrize(
    "name",
    "door_leaf_03 Door01 IfcDoor DOORS frontdoor SlidingDoor Haustür Innentuer_2 Türblatt "  # noqa: SIM905
    "Voordeur innerdörr drzwi_2 Дверь porte-01 puerta.001 M_Door_Oak".split(),
)
def test_what_is_called_door(name: str) -> None:
    assert is_door_name(name)


@pytest.mark.parametrize(
    "name",
    "outdoor indoors outdoor_wall IndoorWall doorway doorway_room1 door_frame doorframe "  # noqa: SIM905
    "doorhandle doormat wall_with_door Türrahmen matador support porter importer tuermatte".split(),
)
def test_what_is_not_called_door(name: str) -> None:
    assert not is_door_name(name)


@pytest.mark.parametrize(
    ("hole", "things"),
    [
        pytest.param(None, {"cupboard_front": leaf(3.95)}, id="on a wall"),
        pytest.param(
            (0, 3.9, -1.9, 1.9),
            {"infill": leaf(4.0, (0, 3.9, -1.9, 1.9), thickness=0.2)},
            id="too large",
        ),
        pytest.param(
            (0.9, 2.9, -0.45, 0.45),
            {"shutter": leaf(4.05, (0.9, 2.9, -0.45, 0.45))},
            id="a window's",
        ),
        pytest.param(
            (0, 2.1, -0.5, 0.5), {"infill": leaf(4.0, thickness=0.2)}, id="as thick as the wall"
        ),
    ],
)
def test_what_is_no_door_by_its_shape(hole: Hole | None, things: dict[str, Faces]) -> None:
    made = scene(rooms(hole), **things)
    assert leaf_names(made) == []
    cells = subdivide(made)
    assert not len(cells.opened)
    assert not together(cells, A, B)


@pytest.mark.parametrize(
    ("hole", "things"),
    [
        pytest.param((0, 4, -2, 2), {"door_side": leaf(4.05, (0, 4, -2, 2))}, id="a wall of 4 m"),
        pytest.param(HOLE, {"door_box": leaf(4.0, thickness=0.2)}, id="20 cm thick"),
        pytest.param(HOLE, {"wall_with_door": leaf(4.0, thickness=0.2)}, id="about a wall"),
        pytest.param(
            (0, 1.0, -0.5, 0.5), {"cat_door": leaf(4.05, (0, 1.0, -0.5, 0.5))}, id="1 m high"
        ),
        pytest.param((0, 4, -2, 2), {"outdoor_wall": leaf(4.05, (0, 4, -2, 2))}, id="outdoor"),
    ],
)
def test_a_name_alone_makes_no_door(hole: Hole, things: dict[str, Faces]) -> None:
    made = scene(rooms(hole), **things)
    assert leaf_names(made) == []
    assert not together(subdivide(made), A, B)


@pytest.mark.parametrize("name", ["door_1", "infill"])
def test_a_leaf_is_thinner_than_a_panel_of_the_wall(name: str) -> None:
    """By name and by shape; both are set back from the faces of a wall of 20 cm."""
    assert leaf_names(scene(rooms(), **{name: leaf(4.045, thickness=0.11)})) == [name]
    assert leaf_names(scene(rooms(), **{name: leaf(4.035, thickness=0.13)})) == []


def test_a_hatch_in_the_floor_is_no_door_unless_asked_for() -> None:
    # Two rooms over one another, and a hatch between them.
    below, above = box((0, -3, -2), (4, -0.2, 2), "+y"), box((0, 0, -2), (4, 3, 2), "-y")
    ring = [(0, 4, -2, -1), (0, 4, 1, 2), (0, 1, -1, 1), (2, 4, -1, 1)]
    slab = [
        [[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]]
        for y in (-0.2, 0)
        for x0, x1, z0, z1 in ring
    ]
    sides = [[[x, -0.2, -1], [x, 0, -1], [x, 0, 1], [x, -0.2, 1]] for x in (1, 2)]
    sides += [[[1, -0.2, z], [1, 0, z], [2, 0, z], [2, -0.2, z]] for z in (-1, 1)]
    hatch = solid((1, -0.05, -1), (2, 0, 1))
    made = scene(below, above, slab, sides, hatch_door=hatch)
    up, down = (3.0, 1.0, 0.0), (3.0, -2.0, 0.0)
    assert leaf_names(made) == []
    assert not together(subdivide(made), up, down)
    assert together(subdivide(made, SubdivideOptions(door=("hatch*",))), up, down)


def test_the_user_says_what_is_a_door() -> None:
    hole = (0, 3.6, -1.8, 1.8)
    made = scene(rooms(hole, entrance=HOLE), gate=leaf(4.05, hole), barn_gate=leaf(-0.1))
    asked = SubdivideOptions(door=("gate", "*_gate"))
    cells = subdivide(made, asked)
    assert cells.closed  # whatever the user calls a door
    assert together(cells, A, B)
    kept = SubdivideOptions(door=("gate",), structural=("gate",))
    assert not together(subdivide(made, kept), A, B)
    with pytest.raises(InputError, match="'portcullis'"):
        subdivide(made, SubdivideOptions(door=("portcullis",)))


def test_a_door_on_a_wall_or_open_against_it_is_none() -> None:
    against, on_it = leaf(4.205, (0, 2.1, 0.6, 1.6)), leaf(3.955, (0, 2, -1.6, -0.7))
    made = scene(rooms(), Door=against, Cupboard_door=on_it)
    assert leaf_names(made) == []
    assert together(subdivide(made), A, B)


@pytest.mark.parametrize("times", [1, 6])
def test_walls_of_many_triangles_have_the_same_doors(times: int) -> None:
    made = scene(rooms(entrance=HOLE), Door=leaf(4.05), front_door=leaf(-0.1))
    cells = subdivide(subdivided(made, times))
    assert cells.closed
    assert together(cells, A, B)
    assert len(cells.opened) == 12 * times**2


def test_a_leaf_that_shares_its_corners_with_the_wall_and_lies_in_its_plane() -> None:
    made = subdivided(scene(rooms(), Door=sheet(4.0)), 6)
    cells = subdivide(made)
    assert together(cells, A, B)
    assert len(cells.opened) == 2 * 36


def test_jambs_of_many_triangles_stay_beside_a_leaf_of_the_same_object() -> None:
    # Of the strips of the jambs some are no wider than the leaf is thick.
    made = subdivided(scene(rooms() + leaf(4.043, thickness=0.047)), 12)
    cells = subdivide(made)
    assert cells.closed
    assert together(cells, A, B)
    assert len(cells.opened) == 12 * 12**2


@pytest.mark.parametrize("first", ["leaf", "wall"])
def test_a_leaf_as_thick_as_its_wall_leaves_the_jambs(first: str) -> None:
    door = leaf(4.0, thickness=0.1)
    edges = [face for face in door if len({x for x, _, _ in face}) > 1]
    thin = panel(4.1, HOLE) + panel(4.0, HOLE) + edges
    a, b = box((0, 0, -2), (4, 4, 2), "+x"), box((4.1, 0, -2), (8.2, 4, 2), "-x")
    things = {"Door": door, "masonry": a + b + thin}
    made = scene(**(things if first == "leaf" else dict(reversed(things.items()))))
    cells = subdivide(made)
    assert together(cells, A, B)
    assert {made.objects[i] for i in made.triangle_object[cells.opened]} == {"Door"}
    # The hollow of the wall is still nobody's.
    assert cells.locate(np.array([[4.05, 1.0, 1.5]])) == [-1]


def test_twice_the_same_leaf_opens_twice() -> None:
    once = leaf(4.05)
    made = scene(rooms(), Door=once + [face[::-1] for face in once])
    cells = subdivide(made)
    assert together(cells, A, B)
    assert len(cells.opened) == 24
