"""Rooms that the model names: its volumes bound and name cells, and bad ones change nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from ptmtools.arrays import Floats
from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.cells.named_rooms import Volume, Volumes, windings
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.model import RoomVolume
from ptmtools.scene.orientation.space import to_world
from tests.cells.buildings import AXES, Box, carved, prism, room, write
from tests.cells.strangers import LINTEL, office
from tests.scene.buildings import box, welded

Rooms = Sequence[tuple[str, Floats]]
Made = Callable[..., Scene]
#: Rooms are not divided where that would save downloading.
WHOLE = SubdivideOptions(gain=1.0)
#: Two rooms of 5 × 4 m west and east of a wall of 0.2 m.
WEST, EAST = room(0, 0, 5, 4), room(5.2, 0, 10.2, 4)
DOORWAY: Box = (5, 1.5, 0), (5.2, 2.4, LINTEL)
HALL = room(0, 0, 10, 6)


@pytest.fixture
def made(tmp_path: Path) -> Made:
    """``made(parts, rooms)``: the scene of triangles, by object or not, with named volumes."""

    def build(parts: Floats | Mapping[str, Floats], rooms: Rooms) -> Scene:
        named = parts if isinstance(parts, Mapping) else {"building": parts}
        scene = ingest(write(tmp_path / "model.obj", named.items()), IngestOptions(**AXES))
        return with_rooms(scene, rooms)

    return build


def with_rooms(scene: Scene, rooms: Rooms) -> Scene:
    """A scene with volumes in the axes of the model."""
    meshes = ((name, *welded(triangles)) for name, triangles in rooms)
    return replace(
        scene,
        rooms=tuple(
            RoomVolume(name, to_world(points, scene.space), faces.astype(np.int32))
            for name, points, faces in meshes
        ),
    )


def name_at(scene: Scene, cells: Cells, *point: float) -> str:
    """The name of the room at a point of the model."""
    return cells.room_name(cell_at(scene, cells, *point))


def cell_at(scene: Scene, cells: Cells, *point: float) -> int:
    return int(cells.locate(to_world(np.array([point]), scene.space))[0])


def left_out(cells: Cells) -> list[str]:
    return [note for note in cells.notes if "of the model left out" in note]


def same(one: Cells, other: Cells) -> bool:
    """Whether two subdivisions are equal but for names and notes."""
    plain = (replace(c, rooms=(), cell_room=np.zeros(0, np.int32), notes=()) for c in (one, other))
    first, second = (c.to_arrays() for c in plain)
    return first.keys() == second.keys() and all(
        np.array_equal(value, second[name]) for name, value in first.items()
    )


def junk(random: np.random.Generator) -> list[tuple[str, Floats]]:
    """Flat, thin, huge, open, doubled and tangled meshes."""
    rooms = []
    for number in range(random.integers(1, 6)):
        low = random.uniform(-2, 8, 3) * [1, 0.5, 0.2]
        solid = box(tuple(low), tuple(low + random.choice([1e-9, 0.3, 2, 5, 12], 3)))
        shapes = (
            solid,
            solid[random.random(12) < 0.8],
            random.normal(4, 3, (random.integers(1, 30), 3, 3)),
            np.concatenate([solid, solid]),
            np.concatenate([solid, solid[:, ::-1]]),
            np.concatenate([solid, solid + 0.5]),
        )
        rooms.append((f"Junk {number}", shapes[random.integers(len(shapes))]))
    return [room for room in rooms if len(room[1])]


def test_rooms_have_the_names_of_the_model(made: Made) -> None:
    rooms = [("Kitchen", box(*WEST)), ("Bath", box(*EAST))]
    scene = made(carved([WEST, EAST], [DOORWAY]), rooms)
    cells = subdivide(scene, WHOLE)
    assert (name_at(scene, cells, 2, 2, 1), name_at(scene, cells, 8, 2, 1)) == ("Kitchen", "Bath")
    assert cells.cell_count == 2  # the doorway is part of one
    assert not left_out(cells)
    again = Cells.from_arrays(cells.to_arrays())
    assert (again.rooms, again.cell_room.tolist()) == (cells.rooms, cells.cell_room.tolist())


def test_models_without_volumes_do_not_change(made: Made) -> None:
    scene = made(carved([WEST, EAST], [DOORWAY]), [])
    assert not any(name.startswith("room") for name in scene.to_arrays())
    cells = subdivide(scene)
    arrays = cells.to_arrays()
    assert "cell_room" not in arrays
    assert b"rooms" not in arrays["about"].tobytes()
    named = with_rooms(scene, [("Kitchen", box(*WEST)), ("Bath", box(*EAST))])
    ignored = subdivide(named, SubdivideOptions(spaces="none"))
    assert ignored.notes == cells.notes
    for name, value in ignored.to_arrays().items():
        assert np.array_equal(value, arrays[name]), name


def test_an_open_plan_is_divided_where_volumes_touch(made: Made) -> None:
    """No wall is between the two; the portal is as large as the hall's section."""
    rooms = [("Kitchen", box((0, 0, 0), (4, 6, 2.8))), ("Living", box((4, 0, 0), (10, 6, 2.8)))]
    scene = made(carved([HALL]), rooms)
    assert subdivide(replace(scene, rooms=()), WHOLE).cell_count == 1
    cells = subdivide(scene, WHOLE)
    assert name_at(scene, cells, 3.99, 3, 1) == "Kitchen"
    assert name_at(scene, cells, 4.01, 3, 1) == "Living"
    assert cells.portal_area.tolist() == pytest.approx([6 * 2.8])
    assert sorted(cells.cell_volumes()) == pytest.approx([4 * 6 * 2.8, 6 * 6 * 2.8])


@pytest.mark.parametrize("gap", [-0.1, 0.0, 0.1])
def test_volumes_touch_within_the_thickness_of_a_wall(made: Made, gap: float) -> None:
    """The plane is half way between them."""
    rooms = [
        ("Kitchen", box((0, 0, 0), (4 - gap / 2, 6, 2.6))),
        ("Living", box((4 + gap / 2, 0, 0), (10, 6, 2.6))),
    ]
    scene = made(carved([HALL]), rooms)
    cells = subdivide(scene, WHOLE)
    assert sorted(cells.cell_volumes()) == pytest.approx([4 * 6 * 2.8, 6 * 6 * 2.8])


def test_an_l_shaped_room_around_another_is_one_cell(made: Made) -> None:
    """The bar is a corner of the hall; the rest of the hall is no convex leaf."""
    ell = np.concatenate(
        [
            prism([(0, 0), (6, 0), (6, 2.8), (0, 2.8)], 0, 3),
            prism([(0, 0), (10, 0), (10, 2.8), (0, 2.8)], 3, 6),
        ]
    )
    scene = made(carved([HALL]), [("Lounge", ell), ("Bar", box((6, 0, 0), (10, 3, 2.8)))])
    cells = subdivide(scene, WHOLE)
    assert cells.cell_count == 2
    assert sorted(cells.cell_volumes()) == pytest.approx([4 * 3 * 2.8, (60 - 12) * 2.8])
    for x, y, name in ((1, 1, "Lounge"), (9, 5, "Lounge"), (8, 1, "Bar")):
        assert name_at(scene, cells, x, y, 1) == name


def test_walls_hide_where_volumes_meet_in_the_middle_of_them(made: Made) -> None:
    """Volumes may end in the middle of walls: nothing is split there."""
    rooms = [
        ("Kitchen", box((-0.1, -0.1, 0), (5.1, 4.1, 2.8))),
        ("Bath", box((5.1, -0.1, 0), (10.3, 4.1, 2.8))),
    ]
    scene = made(carved([WEST, EAST], [DOORWAY]), rooms)
    plain, cells = subdivide(replace(scene, rooms=()), WHOLE), subdivide(scene, WHOLE)
    assert sorted(cells.rooms) == ["Bath", "Kitchen"]
    assert cells.leaf_count == plain.leaf_count


def test_volumes_that_reach_a_little_into_another_room_split_nothing(made: Made) -> None:
    """Two rooms along a corridor have 0.2 m of it, where their common side would split it."""
    corridor = room(0, -2.2, 10.2, -0.2)
    building = carved([WEST, EAST, corridor], [((1, -0.2, 0), (2, 0, 2.1))])
    rooms = [
        ("Corridor", box(*corridor)),
        ("Kitchen", box((0, -0.4, 0), (5.1, 4, 2.8))),
        ("Bath", box((5.1, -0.4, 0), (10.2, 4, 2.8))),
    ]
    scene = made(building, rooms)
    cells = subdivide(scene, WHOLE)
    assert cells.leaf_count == subdivide(replace(scene, rooms=()), WHOLE).leaf_count
    assert name_at(scene, cells, 5, -1, 1) == "Corridor"


def test_a_volume_through_a_wall_joins_nothing(made: Made) -> None:
    """It has a metre of the next room, which has no volume of its own, and keeps its walls."""
    scene = made(carved([WEST, EAST], [DOORWAY]), [("Kitchen", box((0, 0, 0), (6.2, 4, 2.8)))])
    cells = subdivide(scene, WHOLE)
    assert same(cells, subdivide(replace(scene, rooms=()), WHOLE))
    assert (name_at(scene, cells, 2, 2, 1), name_at(scene, cells, 8, 2, 1)) == ("Kitchen", "")


def test_a_wide_opening_within_a_volume_joins(made: Made) -> None:
    """It is 2.2 m of 4 m wide, less than joins two regions elsewhere."""
    opening: Box = (5, 0.9, 0), (5.2, 3.1, 2.8)
    scene = made(carved([WEST, EAST], [opening]), [("Salon", box((0, 0, 0), (10.2, 4, 2.8)))])
    assert subdivide(replace(scene, rooms=()), WHOLE).cell_count == 2
    cells = subdivide(scene, WHOLE)
    assert (cells.cell_count, cells.rooms) == (1, ("Salon",))


def test_a_hall_goes_on_behind_a_core(made: Made) -> None:
    """Ways of 2 m lead around a core of 6 × 3 m, much narrower than the hall on either side."""
    core: Box = (2, 8, 0), (8, 11, 2.8)
    scene = made(carved([room(0, 0, 10, 18)], (), [core]), [("Hall", box(*room(0, 0, 10, 18)))])
    assert subdivide(replace(scene, rooms=()), WHOLE).cell_count > 1
    cells = subdivide(scene, WHOLE)
    assert (cells.cell_count, cells.rooms) == (1, ("Hall",))


def test_two_storeys_of_one_plan(made: Made) -> None:
    """Volumes that reach up to the next floor touch through the slab."""
    low, high = room(0, 0, 6, 4, 0, 2.8), room(0, 0, 6, 4, 3, 5.8)
    rooms = [("Shop", box((0, 0, 0), (6, 4, 3))), ("Flat", box((0, 0, 3), (6, 4, 6)))]
    scene = made(carved([low, high]), rooms)
    cells = subdivide(scene, WHOLE)
    assert cells.cell_count == 2
    assert (name_at(scene, cells, 3, 2, 1), name_at(scene, cells, 3, 2, 4)) == ("Shop", "Flat")


def test_an_office_with_doors(made: Made) -> None:
    """Every cell has the name of its space, and there are at most half as many again."""
    spaces = [("Corridor", box((0, 0, 0), (12.4, 2, 3)))]
    for k in range(6):
        x, y = 4.2 * (k // 2), -5.2 if k % 2 else 2.2
        spaces.append((f"Office {k}", box((x, y, 0), (x + 4, y + 5, 3))))
    scene = made(office(6), spaces)
    cells = subdivide(scene)
    assert len(spaces) <= cells.cell_count <= 1.5 * len(spaces)
    assert sorted(cells.rooms) == sorted(name for name, _ in spaces)
    for k in range(6):
        x, y = 4.2 * (k // 2) + 2, -2.7 if k % 2 else 4.7
        assert name_at(scene, cells, x, y, 1.5) == f"Office {k}"


class TestBad:
    """Volumes that are no rooms are left out, with a note, and the cells are as without them."""

    BUILDING = carved([WEST, EAST], [DOORWAY])
    GOOD: Rooms = (("Kitchen", box(*WEST)), ("Bath", box(*EAST)))

    @pytest.mark.parametrize(
        ("bad", "reason"),
        [
            (box(*WEST), "a duplicate of another"),
            (box(*WEST)[2:], "not closed"),
            (box((0, 0, 0), (10.2, 4, 2.8)), "around several others"),
            (box((-0.2, -0.2, -0.2), (10.4, 4.2, 3)), "around several others"),
            (box((1, 1, 1), (1.5, 1.5, 1.5)), "too small for a visitor"),
            (box((1, 1, 1), (1, 3, 2)), "too small for a visitor"),
            (box((-500, -500, -500), (500, 500, 500)), "larger than the building"),
            (box((90, 90, 0), (94, 94, 2)), "no cell is mostly inside"),
        ],
    )
    def test_beside_good_ones(self, made: Made, bad: Floats, reason: str) -> None:
        scene = made(self.BUILDING, [*self.GOOD, ("Bad", bad)])
        cells = subdivide(scene, WHOLE)
        good = subdivide(with_rooms(scene, self.GOOD), WHOLE)
        assert left_out(cells) == [f"1 space of the model left out, {reason}: Bad"]
        assert same(cells, good)
        assert cells.rooms == good.rooms

    def test_one_around_the_whole_building(self, made: Made) -> None:
        scene = made(self.BUILDING, [("Storey", box((0, 0, 0), (10.2, 4, 2.8)))])
        cells = subdivide(scene, WHOLE)
        assert left_out(cells) == ["1 space of the model left out, several rooms in one: Storey"]
        assert same(cells, subdivide(replace(scene, rooms=()), WHOLE))

    def test_none_is_usable(self, made: Made) -> None:
        nothing = RoomVolume("Nothing", np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))
        scene = replace(made(self.BUILDING, []), rooms=(nothing,))
        assert same(subdivide(scene, WHOLE), subdivide(replace(scene, rooms=()), WHOLE))

    @given(st.integers(0, 2**32 - 1))
    @settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
    def test_of_any_shape(self, made: Made, seed: int) -> None:
        """Whatever the volumes are, the rooms have the same walls and the same space."""
        scene = with_rooms(made(self.BUILDING, []), junk(np.random.default_rng(seed)))
        cells = subdivide(scene, WHOLE)
        doorway = 0.2 * 0.9 * LINTEL
        assert cells.leaf_volumes().sum() == pytest.approx(2 * 5 * 4 * 2.8 + doorway)
        assert cell_at(scene, cells, 2, 2, 1) != cell_at(scene, cells, 8, 2, 1)
        again = Cells.from_arrays(cells.to_arrays())
        assert again.rooms == cells.rooms

    def test_overlapping_ones(self, made: Made) -> None:
        """Of two over one room the one counts that has more of it; both keep their own rooms."""
        wide = box((0, 0, 0), (7, 4, 2.8))
        scene = made(self.BUILDING, [("Wide", wide), ("Bath", box(*EAST))])
        cells = subdivide(scene, WHOLE)
        assert (name_at(scene, cells, 2, 2, 1), name_at(scene, cells, 6, 2, 1)) == ("Wide", "Bath")
        assert cells.cell_count == 2

    def test_faces_that_point_inwards(self, made: Made) -> None:
        scene = made(self.BUILDING, [(n, tris[:, ::-1]) for n, tris in self.GOOD])
        cells = subdivide(scene, WHOLE)
        assert not left_out(cells)
        assert sorted(cells.rooms) == ["Bath", "Kitchen"]


def test_winding_numbers() -> None:
    solid = box((0, 0, 0), (2, 3, 4))
    points = np.array([[1, 1, 1], [1.9, 2.9, 3.9], [-1, 1, 1], [1, 1, 9]], dtype=np.float64)
    assert windings(points, solid).tolist() == pytest.approx([1, 1, 0, 0], abs=1e-12)
    # From the middle of a cube each side is a sixth of all directions.
    cube = box((0, 0, 0), (2, 2, 2))
    centre = np.array([[1.0, 1.0, 1.0]])
    sides = [windings(centre, cube[a:b])[0] for a, b in pairwise(range(0, 13, 2))]
    assert sides == pytest.approx([1 / 6] * 6)


def test_a_room_of_two_boxes_holds_both() -> None:
    both = np.concatenate([box((0, 0, 0), (1, 1, 1)), box((2, 0, 0), (3, 1, 1))])
    points, faces = welded(both)
    volume = Volume.from_room(RoomVolume("", points, faces.astype(np.int32)))
    assert volume.size == pytest.approx(2)
    at = np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]])
    assert volume.contains(at).tolist() == [True, False, True]


def test_no_volumes_of_no_rooms(made: Made) -> None:
    assert Volumes.from_scene(made(carved([HALL]), []), WHOLE) == Volumes()
