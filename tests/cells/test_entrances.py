"""Entrances, rooms that the flood reaches from outside, and roofs. Expectations follow from the
definitions in docs/design/cells.md; they were written before the first run.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.scene.model import Material
from tests.cells.conftest import box, panel
from tests.cells.doored_rooms import (
    HOLE,
    OUT,
    A,
    B,
    Faces,
    Hole,
    leaf,
    reveals,
    rooms,
    said,
    scene,
    sheet,
    solid,
    together,
    wall,
)


@pytest.mark.parametrize("name", ["Door_front", "thing"])
@pytest.mark.parametrize("thickness", [0.04, 0.0])
def test_an_entrance_stays_shut(name: str, thickness: float) -> None:
    front = leaf(-0.1, thickness=thickness) if thickness else sheet(-0.1)
    made = scene(rooms(entrance=HOLE), inner_door=leaf(4.05), **{name: front})
    ground = [[[-30, -0.1, -30], [30, -0.1, -30], [30, -0.1, 30], [-30, -0.1, 30]]]
    for all_of_it in (
        made,
        scene(rooms(entrance=HOLE), ground, inner_door=leaf(4.05), front=front),
    ):
        cells = subdivide(all_of_it)
        assert cells.closed
        assert together(cells, A, B)
        assert cells.locate(np.array([OUT])) == [-1]
        opened, shut = said(cells)
        assert "inner_door" in opened
        assert "shut:" in shut
        assert all_of_it.objects[-1] in shut


def test_an_entrance_of_an_open_building_stays_shut() -> None:
    # B has a window; eaves and the walls of a porch stand before the entrance.
    window = (1.0, 2.0, -1.0, 1.0)
    back = box((0, 0, -2), (4, 4, 2), "-x +x") + box((4.2, 0, -2), (8.2, 4, 2), "-x +x")
    shell = back + wall(-0.2, 0, HOLE) + wall(4, 4.2, HOLE) + wall(8.2, 8.4, window)
    porch = solid((-1.2, 2.5, -2), (-0.2, 2.6, 2)) + solid((-8, -0.3, -8), (14, -0.1, 8))
    fence = solid((-8, -0.1, -8), (-7.9, 2.0, 8))
    made = scene(shell, porch, fence, Door=leaf(4.05), Door_front=leaf(-0.1))
    cells = subdivide(made)
    assert not cells.closed
    assert together(cells, A, B)
    inner = np.flatnonzero(made.triangle_object == made.objects.index("Door"))
    np.testing.assert_array_equal(cells.opened, inner)


WINDOW: Hole = (1.0, 2.0, -1.0, 1.0)
SLIT: Hole = (0.2, 0.4, -0.2, 0.2)


def hall(far: Faces) -> Faces:
    """A room A without windows, larger than the room B behind its door, whose far wall is given."""
    a, b = box((-3, 0, -2), (4, 4, 2), "+x"), box((4.2, 0, -2), (8.2, 4, 2), "-x +x")
    return a + b + wall(4, 4.2, HOLE) + far


@pytest.mark.parametrize("name", ["Door", "thing"])
@pytest.mark.parametrize(
    "far",
    [
        pytest.param(wall(8.2, 8.4, WINDOW), id="a window"),
        pytest.param(wall(8.2, 8.4, HOLE), id="an entrance without a leaf"),
        pytest.param(wall(8.2, 8.4, HOLE) + leaf(8.25, gap=0.01), id="an entrance with a gap"),
        pytest.param(wall(8.2, 8.4, SLIT), id="a hole"),
    ],
)
@pytest.mark.parametrize("ground", [False, True])
def test_a_room_behind_a_door_is_kept_wherever_the_flood_starts(
    far: Faces, name: str, ground: bool
) -> None:
    # A by itself is closed; B may be reached from outside, and is a room all the same.
    around = solid((-30, -0.3, -30), (30, -0.1, 30)) if ground else []
    made = scene(hall(far), around, **{name: leaf(4.05)})
    for viewpoints in ((), (A,), (B,)):
        cells = subdivide(made, SubdivideOptions(viewpoints=viewpoints))
        assert together(cells, A, B)
        assert not cells.closed
        assert not len(cells.left_out)


def test_a_facade_of_glass_is_a_wall_of_the_room_behind_it() -> None:
    a, b = box((-3, 0, -2), (4, 4, 2), "+x"), box((4.2, 0, -2), (8.2, 4, 2), "-x +x -z")
    glass = box((4.2, 0, -2), (8.2, 4, 2), "-x -y +y +z")
    made = scene(a + b + wall(4, 4.2, HOLE), panes=glass, Door=leaf(4.05))
    panes = np.flatnonzero(made.triangle_object == made.objects.index("panes"))
    material = Material("glass", opacity=0.4, transparent=True)
    of = made.triangle_material.copy()
    of[panes] = len(made.materials)
    made = replace(made, materials=(*made.materials, material), triangle_material=of)
    cells = subdivide(made)
    assert together(cells, A, B)
    main = subdivide(made, SubdivideOptions(doors="closed"))
    assert main.locate(np.array([B])) == [-1]
    (reported,) = [note for note in main.notes if "open to the outside" in note]
    assert isinstance(reported, Warned)


def test_an_entrance_that_is_detail_is_no_door() -> None:
    made = scene(rooms(entrance=HOLE), inner_door=leaf(4.05), front_door=leaf(-0.1))
    cells = subdivide(made, SubdivideOptions(detail=("front*",)))
    assert not cells.closed
    assert together(cells, A, B)
    assert not any("front_door" in note for note in said(cells))
    # Asked for as a door, it is one.
    asked = subdivide(made, SubdivideOptions(detail=("front*",), door=("front*",)))
    assert any("front_door" in note for note in said(asked))


@pytest.mark.parametrize(("low", "told"), [(1.7, True), (2.1, False)])
def test_what_is_called_door_and_is_none_is_told_if_something_cannot_be_reached(
    low: float, told: bool
) -> None:
    hole: Hole = (0, low, -0.5, 0.5)
    cells = subdivide(scene(rooms(hole), hobbit_door=leaf(4.05, hole)))
    notes = [note for note in cells.notes if note.startswith("named like a door")]
    assert ["hobbit_door; --door NAME" in note for note in notes] == [True] * told
    assert together(cells, A, B) != told


def test_a_viewpoint_that_is_no_number_is_outside() -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        subdivide(scene(rooms()), SubdivideOptions(viewpoints=((float("nan"), 1.0, 1.0),)))


def test_a_viewpoint_inside_a_wall_is_told() -> None:
    made = scene(rooms(), solid((2, 0, 0.5), (2.6, 3, 1.1)), inner_door=leaf(4.05))
    for point, reported in (((2.3, 1.5, 0.8), True), (A, False)):
        cells = subdivide(made, SubdivideOptions(viewpoints=(point,)))
        notes = [note for note in cells.notes if note.endswith("which becomes a cell")]
        assert [isinstance(note, Warned) for note in notes] == [True] * reported


@pytest.mark.parametrize("slab", [0.1, 0.3])
def test_a_thick_floor_is_no_roof(slab: float) -> None:
    faces = [f for f in rooms() if not all(y == 4 for _, y, _ in f)]
    made = scene(faces, solid((-0.2, -slab, -2.2), (8.4, -0.001, 2.2)), Door=leaf(4.05))
    cells = subdivide(made)
    assert any("open at the top" in note for note in cells.notes)
    assert together(cells, A, B)


def test_without_ceilings_walls_tell_what_is_inside() -> None:
    faces = [f for f in rooms() if not all(y == 4 for _, y, _ in f)]
    made = scene(faces, Door=leaf(4.05))
    cells = subdivide(made)
    assert not cells.closed
    assert together(cells, A, B)
    assert len(cells.opened) == 12


def test_a_door_whose_frame_would_let_the_outside_in_stays_shut() -> None:
    # The frame, or the leaf, is the only jamb of a hollow wall that is open at its ends.
    hole = (0, 2.2, -0.6, 0.6)
    walls = box((0, 0, -2), (4, 4, 2), "+x") + box((4.2, 0, -2), (8.2, 4, 2), "-x")
    walls += panel(4, hole) + panel(4.2, hole) + reveals(4, 4.2, hole)[-2:-1]
    frame = [
        *solid((4.0, 0, -0.6), (4.2, 2.2, -0.5)),
        *solid((4.0, 0, 0.5), (4.2, 2.2, 0.6)),
        *solid((4.0, 2.1, -0.5), (4.2, 2.2, 0.5)),
    ]
    made = scene(walls, Gate=leaf(4.05) + frame)
    asked = SubdivideOptions(door=("Gate",))
    cells = subdivide(made, asked)
    assert cells.closed
    assert together(cells, A, B)
    assert np.abs(made.corners[cells.opened][:, :, 2]).max() == pytest.approx(0.5)  # the leaf
    assert ["shut:" in note for note in said(cells)] == [False, True]
    stopper = leaf(4.0, hole, thickness=0.2)
    elsewhere = box((-30, 0, -6), (-6, 4, 6))  # the start, from which nothing leads here
    for more in ([], elsewhere):
        cells = subdivide(scene(walls, more, Gate=stopper), asked)
        assert cells.closed
        assert not together(cells, A, B)
        assert not len(cells.opened)
        assert cells.locate(np.array([[4.1, 1.0, 3.0]])) == [-1]  # the outside
