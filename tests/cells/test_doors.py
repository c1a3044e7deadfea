"""Door leaves that open, stay shut or are hidden, and what follows. Expectations follow from the
definitions in docs/design/cells.md; they were written before the first run.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells import SubdivideOptions, structural_triangles, subdivide
from ptmtools.cells.options import DoorState
from ptmtools.errors import InputError
from ptmtools.scene.model import Material
from ptmtools.visibility import check_conservative, compute_pvs
from tests.cells.conftest import box
from tests.cells.doored_rooms import (
    HOLE,
    OPEN,
    PAIR,
    PANELS,
    WIDE,
    A,
    B,
    Faces,
    Hole,
    leaf,
    leaf_names,
    rooms,
    said,
    scene,
    see,
    sheet,
    solid,
    together,
    wall,
)
from tests.conftest import scene_of


@pytest.mark.parametrize("name", ["Door_1", "thing"])
@pytest.mark.parametrize(
    ("hole", "door", "leaves"),
    [
        pytest.param(HOLE, leaf(4.05), 1, id="a leaf"),
        pytest.param(HOLE, leaf(4.0), 1, id="flush with one face of the wall"),
        pytest.param(HOLE, leaf(4.05, gap=0.003), 1, id="with a gap around it"),
        pytest.param(HOLE, sheet(4.1), 1, id="a sheet"),
        pytest.param(HOLE, leaf(4.05) + PANELS, 1, id="with panels"),
        pytest.param(WIDE, PAIR, 2, id="a pair of leaves"),
        pytest.param(WIDE, leaf(4.05, WIDE), 1, id="a pair in one piece"),
        pytest.param((0, 3.0, -1.2, 1.2), leaf(4.05, (0, 3.0, -1.2, 1.2)), 1, id="the largest"),
        pytest.param((0, 1.8, -0.3, 0.3), leaf(4.05, (0, 1.8, -0.3, 0.3)), 1, id="the smallest"),
    ],
)
def test_a_door_parts_no_building(name: str, hole: Hole, door: Faces, leaves: int) -> None:
    made = scene(rooms(hole), **{name: door})
    assert leaf_names(made) == [name] * leaves
    cells = subdivide(made, OPEN)
    assert cells.closed
    assert together(cells, A, B)
    assert see(cells, A, B)
    assert not any("cannot be reached from the viewpoint" in note for note in cells.notes)
    assert len(said(cells)) == 1
    assert set(cells.triangle_source[cells.emitted(made.two_sided)[0]]) >= set(cells.opened)
    shut = subdivide(made, SubdivideOptions(doors="closed"))
    assert not len(shut.opened)
    assert not said(shut)
    assert shut.locate(np.array([A, B])).min() >= 0
    # What blocks is the same for the check of a database.
    structural = structural_triangles(made, OPEN, cells.opened)
    assert not structural[cells.opened].any()
    assert (structural | np.isin(np.arange(len(structural)), cells.opened)).all()
    report = check_conservative(made.corners[structural], cells, compute_pvs(cells), 20_000)
    assert report.missed == ()


def test_the_check_sees_through_doors_that_are_open() -> None:
    made = scene(rooms(), Door=leaf(4.05))
    opened = subdivide(made, OPEN).opened
    shut = subdivide(made, SubdivideOptions(doors="closed"))
    structural = structural_triangles(made, OPEN, opened)
    report = check_conservative(made.corners[structural], shut, compute_pvs(shut), 20_000)
    assert report.missed


@pytest.mark.parametrize("door", [leaf(4.05), sheet(4.1), leaf(4.05, WIDE)])
def test_doors_that_are_closed_part_rooms(door: Faces) -> None:
    made = scene(rooms(WIDE if door == leaf(4.05, WIDE) else HOLE), Door=door)
    cells = subdivide(made, SubdivideOptions(doors="closed"))
    assert not together(cells, A, B)
    assert not see(cells, A, B)


def test_hidden_doors_are_not_drawn() -> None:
    entrance = leaf(-0.1)
    made = scene(rooms(entrance=HOLE), Door=leaf(4.05) + PANELS, Entrance_door=entrance)
    cells = {state: subdivide(made, SubdivideOptions(doors=state)) for state in ("open", "hidden")}
    drawn = {
        state: set(each.triangle_source[each.emitted(made.two_sided)[0]].tolist())
        for state, each in cells.items()
    }
    inner = set(np.flatnonzero(made.triangle_object == made.objects.index("Door")).tolist())
    assert drawn["open"] - drawn["hidden"] == inner
    assert drawn["open"] >= inner
    assert drawn["hidden"] & set(np.flatnonzero(made.triangle_object == 2).tolist())
    np.testing.assert_array_equal(cells["open"].opened, cells["hidden"].opened)
    opened, hidden = (said(cells[state]) for state in ("open", "hidden"))
    assert "open: drawn" in opened[0]
    assert "open: not drawn" in hidden[0]
    assert opened[1:] == hidden[1:]


def test_a_frame_stays_when_its_leaf_opens() -> None:
    # Leaf, handle and frame are one object; the frame fills a wider opening in a hollow wall.
    hole = (0, 2.2, -0.6, 0.6)
    frame = [
        *solid((4.02, 0, -0.6), (4.18, 2.2, -0.5)),
        *solid((4.02, 0, 0.5), (4.18, 2.2, 0.6)),
        *solid((4.02, 2.1, -0.5), (4.18, 2.2, 0.5)),
    ]
    handle = solid((4.0, 1.0, 0.35), (4.14, 1.03, 0.45))
    made = scene(rooms(hole), Door01=leaf(4.05) + frame + handle)
    cells = subdivide(made)
    assert together(cells, A, B)
    frame_only = np.isin(np.arange(len(made.triangles)), cells.opened)
    corners = made.corners[frame_only]
    assert np.abs(corners[:, :, 2]).max() <= 0.5 + 1e-9
    assert corners[:, :, 1].max() <= 2.1 + 1e-9


def test_a_door_that_is_ajar_opens() -> None:
    turn = np.array([[np.cos(0.5), 0, np.sin(0.5)], [0, 1, 0], [-np.sin(0.5), 0, np.cos(0.5)]])
    hinge = np.array([4.05, 0, -0.5])
    ajar = ((np.array(leaf(4.05)) - hinge) @ turn.T + hinge).tolist()
    made = scene(rooms(), Door=ajar)
    cells = subdivide(made)
    assert len(cells.opened) == 12
    assert together(cells, A, B)


def test_a_closet_in_which_nobody_can_stand_stays_shut() -> None:
    shelves = [
        [[4.2, y, -0.5], [4.2, y, 0.5], [4.9, y, 0.5], [4.9, y, -0.5]] for y in (0.9, 1.8, 2.7, 3.6)
    ]
    closet = box((4.2, 0, -0.5), (4.9, 4, 0.5), "-x")
    room = box((0, 0, -2), (4, 4, 2), "+x")
    made = scene(room, wall(4, 4.2, HOLE), closet, shelves, Door=leaf(4.05))
    assert leaf_names(made) == ["Door"]
    cells = subdivide(made)
    assert cells.closed
    assert not len(cells.opened)
    assert ["shut:" in note for note in said(cells)] == [True]
    without = scene(room, wall(4, 4.2, HOLE), closet, Door=leaf(4.05))
    assert len(subdivide(without).opened) == 12


def test_a_door_of_glass_is_hidden_too() -> None:
    faces = rooms() + leaf(4.05)
    glass = Material("glass", opacity=0.4, transparent=True)
    count = len(rooms())
    made = scene_of(
        faces,
        ["wall"] * count + ["glass_door"] * 6,
        (Material("plain"), glass),
        [0] * count + [1] * 6,
    )
    made = replace(
        made,
        objects=("wall", "glass_door"),
        triangle_object=np.repeat([0, 1], [2 * count, 12]).astype(np.int32),
    )
    hidden = subdivide(made, SubdivideOptions(doors="hidden"))
    assert together(hidden, A, B)
    assert not set(hidden.triangle_source.tolist()) & set(range(2 * count, 2 * count + 12))


def test_rooms_behind_rooms_open_in_one_go() -> None:
    third = box((8.4, 0, -2), (12.4, 4, 2), "-x")
    a, b = box((0, 0, -2), (4, 4, 2), "+x"), box((4.2, 0, -2), (8.2, 4, 2), "-x +x")
    made = scene(a, b, third, wall(4, 4.2, HOLE), wall(8.2, 8.4, HOLE), door=leaf(4.1) + leaf(8.3))
    cells = subdivide(made, SubdivideOptions(reach="main"))
    assert together(cells, A, B, (11.0, 1.0, 1.0))
    assert "2 door leaves" in said(cells)[0]


def test_nothing_but_doors() -> None:
    made = scene(Door=leaf(4.05))
    assert subdivide(made).cell_count == 1
    glass = replace(made, materials=(Material("glass", opacity=0.4, transparent=True),))
    assert subdivide(glass).cell_count == 1


def test_another_building_is_one_too() -> None:
    far = [[[x + 40, y, z] for x, y, z in face] for face in rooms() + leaf(4.05)]
    hall = box((-30, 0, -6), (-6, 4, 6))
    made = scene(hall, far[:-6], Door=far[-6:])
    cells = subdivide(made)
    assert cells.closed
    assert together(cells, (41.0, 1.0, 1.2), (47.0, 1.0, 1.2))
    (reported,) = [note for note in cells.notes if "cannot be reached from the viewpoint" in note]
    assert float(reported.split(" ")[0]) == pytest.approx(2 * 3.5 * 3.5, abs=0.5)
    # The hall, the two rooms, the rest of the doorway, and the inside of the leaf.
    assert cells.leaf_count == 1 + 4


@pytest.mark.parametrize("state", ["ajar", ""])
def test_doors_are_open_closed_or_hidden(state: DoorState) -> None:
    with pytest.raises(InputError, match="open, closed or hidden"):
        SubdivideOptions(doors=state)
