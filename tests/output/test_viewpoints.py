"""Viewpoints: where they stand, where they look, and what becomes of those that were asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from ptmtools.cells.model import Cells
from ptmtools.errors import InputError
from ptmtools.output import EmitOptions, GivenViewpoint
from ptmtools.output.standpoints import FloorFinder
from ptmtools.output.storeys import (
    area,
    leaf_section,
    main_floors,
    polygon_section,
    triangle_section,
)
from ptmtools.output.viewpoints import orientation, place_viewpoints, walk
from ptmtools.output.views import lengths
from ptmtools.scene.model import Camera, Scene, Storey


def turned(v: np.ndarray, turn: tuple[float, float, float, float]) -> np.ndarray:
    """Rodrigues."""
    k, angle = np.array(turn[:3]), turn[3]
    return v * np.cos(angle) + np.cross(k, v) * np.sin(angle) + k * (k @ v) * (1 - np.cos(angle))


UNIT = st.floats(-1, 1)


@given(st.tuples(UNIT, UNIT, UNIT))
@example((0.0, 5.60179522222552e-162, -1.0))
def test_orientation_turns_minus_z(direction: tuple[float, float, float]) -> None:
    length = np.linalg.norm(direction)
    if length < 1e-3:
        return
    wanted = np.array(direction) / length
    turn = orientation(wanted)
    assert np.isclose(np.linalg.norm(turn[:3]), 1)
    assert abs(turn[3]) <= np.pi
    np.testing.assert_allclose(turned(np.array([0.0, 0, -1]), turn), wanted, atol=1e-9)
    assert turned(np.array([0.0, 1, 0]), turn)[1] >= -1e-9, "head up"
    assert abs(turned(np.array([1.0, 0, 0]), turn)[1]) < 1e-9, "no roll"


def test_simple_orientations() -> None:
    for direction, turn in (
        ((0, 0, -1), (0, 1, 0, 0)),
        ((0, 0, 1), (0, 1, 0, np.pi)),
        ((1, 0, 0), (0, 1, 0, -np.pi / 2)),
        ((-1, 0, 0), (0, 1, 0, np.pi / 2)),
        ((0, 1, 0), (1, 0, 0, np.pi / 2)),
        ((0, -1, 0), (1, 0, 0, -np.pi / 2)),
    ):
        np.testing.assert_allclose(orientation(np.array(direction, float)), turn, atol=1e-12)


def test_chosen_look_down_the_row(room_row) -> None:
    scene, cells = room_row(3)
    views, notes = place_viewpoints(scene, cells, EmitOptions())
    assert notes == ()
    assert sorted(v.cell for v in views) == [0, 1, 2]
    for v in views:
        assert v.position[1] == 1.6
        assert int(cells.locate(np.array(v.position))[0]) == v.cell
        assert abs(v.direction[0]) > 0.95, "the rooms stand in a row along x"
    by_cell = {v.cell: v.direction[0] for v in views}
    assert by_cell[0] > 0 > by_cell[2]


def test_only_so_many(room_row) -> None:
    scene, cells = room_row(3)
    views, notes = place_viewpoints(scene, cells, EmitOptions(viewpoint_count=2))
    assert [v.name for v in views] == ["VP_0", "VP_1"]
    assert notes == ("rooms without a viewpoint: 1; --viewpoint-count adds some",)
    (view,), _ = place_viewpoints(scene, cells, EmitOptions(viewpoint_count=0))
    assert view == views[0]
    with pytest.raises(InputError, match="PTM-I111"):
        EmitOptions(viewpoint_count=-1)


def test_from_room_to_room(room_row) -> None:
    """Rooms in the order of a walk; those that have a viewpoint already get no second one."""
    scene, cells = room_row(6)
    views, _ = place_viewpoints(scene, cells, EmitOptions())
    assert [v.cell for v in views] == [0, 1, 2, 3, 4, 5]
    assert [v.description for v in views] == [f"Room {i}" for i in range(1, 7)]
    begin = EmitOptions(viewpoints=(GivenViewpoint((14.0, 1.0, 0.0)),))
    views, _ = place_viewpoints(scene, cells, begin)
    assert [v.cell for v in views] == [3, 4, 5, 2, 1, 0], "the shorter branch first"
    assert [v.name for v in views] == [f"VP_{i}" for i in range(6)]
    assert [v.description for v in views[:3]] == ["Viewpoint 1", "Room 1", "Room 2"]
    views, _ = place_viewpoints(scene, cells, replace(begin, viewpoint_count=0))
    assert [v.cell for v in views] == [3]
    shut = replace(cells, portal_point=cells.portal_point * [1, 0.3, 1])
    views, _ = place_viewpoints(scene, shut, begin)
    assert len(views) == 6, "low openings are still ways"
    walled = replace(cells, portal_leaf=cells.portal_leaf[:0], portal_start=cells.portal_start[:1])
    views, _ = place_viewpoints(scene, walled, begin)
    assert [v.cell for v in views] == [3, 0, 1, 2, 4, 5], "nothing leads there: last, by index"


def test_a_low_opening_is_a_long_way(room_row) -> None:
    """Rooms 0 and 2 are joined by a hatch: the walk still goes through room 1."""
    _, cells = room_row(3)
    hatch = cells.portal(0) * [1, 0.2, 1]
    joined = replace(
        cells,
        portal_leaf=np.append(cells.portal_leaf, [[0, 2]], axis=0).astype(np.int32),
        portal_plane=np.append(cells.portal_plane, cells.portal_plane[:1], axis=0),
        portal_point=np.append(cells.portal_point, hatch, axis=0),
        portal_start=np.append(cells.portal_start, cells.portal_start[-1] + len(hatch)),
    )
    assert walk(joined, 0, [2, 1], 1.6) == [1, 0]
    assert walk(joined, 0, [2, 1], 0.1) == [1, 0], "the farther branch last"
    assert walk(joined, 1, [2, 0, 1], 1.6) == [2, 1, 0]
    assert walk(cells, 0, [], 1.6) == []


def two_storeys(room_row, even: bool = False) -> tuple[Scene, Cells]:
    """Four rooms, every second lifted by a storey: those of ``even`` numbers, or the others."""
    scene, cells = room_row(4)
    corner = cells.leaf_point.copy()
    lift = [4 * (i % 2 != even) for i in range(4)]
    corner[:, 1] += np.repeat(lift, 8)
    lifted = replace(cells, leaf_point=corner, root_box=np.array([[0, 0, -2], [16, 8, 2.0]]))
    floor = np.array([[0, 4, -2], [0, 4, 2], [4, 4, 2], [4, 4, -2]])
    quads = [floor * [1, 0, 1] + [4 * i, lift[i], 0] for i in range(4)]
    return replace(scene, points=np.concatenate([*quads, scene.points[16:] * 0])), lifted


def test_storeys_one_after_the_other(room_row) -> None:
    """Those of the lower one come first."""
    views, _ = place_viewpoints(*two_storeys(room_row), EmitOptions())
    assert [v.description for v in views] == [
        "Storey 1, room 1",
        "Storey 1, room 2",
        "Storey 2, room 1",
        "Storey 2, room 2",
    ]
    assert [v.cell for v in views] == [0, 2, 1, 3]
    assert [v.position[1] for v in views] == [1.6, 1.6, 5.6, 5.6]


def test_a_walk_begins_on_the_lowest_of_equal_storeys(room_row) -> None:
    """Whatever the order of the rooms."""
    for even, cells in ((False, {0, 2}), (True, {1, 3})):
        views, _ = place_viewpoints(*two_storeys(room_row, even), EmitOptions())
        assert views[0].cell in cells
        assert views[0].position[1] == 1.6


@pytest.mark.parametrize(("rooms", "first"), [(24, 0), (4, 3)], ids=["cabin", "court"])
def test_rooms_that_lost_their_ceilings_come_before_a_cabin(room_row, rooms, first) -> None:
    """Only the last room of the row has a ceiling: a lift's cabin in a building without them, but
    the room of a small house with courts."""
    scene, cells = room_row(rooms)
    kept = np.ones(len(scene.triangles), dtype=bool)
    for ceiling in range(1, 4 * (rooms - 1), 4):
        kept[2 * ceiling : 2 * ceiling + 2] = False
    fields = ("triangles", "uv", "triangle_object", "triangle_material", "two_sided")
    open_above = replace(scene, **{name: getattr(scene, name)[kept] for name in fields})
    views, _ = place_viewpoints(open_above, cells, EmitOptions())
    assert views[0].cell == first


@pytest.mark.parametrize(
    ("named", "called"),
    [
        ([("EG", -0.1), ("OG", 4.2)], ("EG", "OG")),
        ([("EG", 0), ("Mezzanine", 2), ("OG", 4)], ("EG", "OG")),
        ([("OG", 4)], ("Storey 1", "OG")),
        ([("Cellar", -3), ("Roof", 8)], ("Storey 1", "Storey 2")),
        ([("Parking", 0.5), ("EG", 0.1)], ("EG", "Storey 2")),
    ],
)
def test_storeys_with_names(room_row, named, called: tuple[str, str]) -> None:
    """The nearest to a floor, if it is near."""
    scene, cells = two_storeys(room_row)
    scene = replace(scene, storeys=tuple(Storey(*storey) for storey in named))
    views, _ = place_viewpoints(scene, cells, EmitOptions())
    low, high = called
    assert [v.description for v in views] == [
        f"{low}, room 1",
        f"{low}, room 2",
        f"{high}, room 1",
        f"{high}, room 2",
    ]


def test_one_storey_needs_no_name(room_row) -> None:
    scene, cells = room_row(2)
    scene = replace(scene, storeys=(Storey("EG", 0.0), Storey("OG", 4.0)))
    views, _ = place_viewpoints(scene, cells, EmitOptions())
    assert [v.description for v in views] == ["Room 1", "Room 2"]


def test_rooms_with_names(room_row) -> None:
    """A named room of two cells has one viewpoint; the rooms without a name are counted."""
    scene, cells = room_row(5)
    of = np.array([0, 0, -1, 1, 2], dtype=np.int32)
    cells = replace(cells, rooms=("Foyer", "Lab", "Lab"), cell_room=of)
    views, _ = place_viewpoints(scene, cells, EmitOptions())
    assert {v.cell: v.description for v in views[1:]} | {views[0].cell: "Foyer"} == {
        views[0].cell: "Foyer",
        2: "Room 1",
        3: "Lab",
        4: "Lab (2)",
    }
    assert views[0].cell in (0, 1)
    assert views[0].description == "Foyer"
    begin = EmitOptions(viewpoints=(GivenViewpoint((2.0, 1.0, 0.0)),))
    views, _ = place_viewpoints(scene, cells, begin)
    assert [v.cell for v in views] == [0, 2, 3, 4], "the foyer has one already"


def test_names_of_rooms_follow_those_of_storeys(room_row) -> None:
    scene, cells = two_storeys(room_row)
    of = np.array([0, 1, -1, -1], dtype=np.int32)
    cells = replace(cells, rooms=("Hall", "Hall"), cell_room=of)
    views, _ = place_viewpoints(scene, cells, EmitOptions())
    assert sorted(v.description for v in views) == [
        "Storey 1, Hall",
        "Storey 1, room 1",
        "Storey 2, Hall",
        "Storey 2, room 1",
    ]


def test_main_floors_are_the_largest() -> None:
    floors, sizes = np.array([0.0, 4.0, 0.2, 4.1, 1.7, 4.0, 0.0]), np.array([9, 3, 8, 5, 1, 3, 0.0])
    assert main_floors(floors, sizes, 1.6).tolist() == [0.0, 1.7, 4.0]
    assert main_floors(floors[::-1], sizes[::-1], 1.8).tolist() == [0.0, 4.0]
    assert main_floors(floors, sizes * 0, 1.6).tolist() == [0.0, 1.7, 4.0], "the lowest first"


@pytest.mark.parametrize("seed", range(3))
def test_the_floor_below(room_row, seed: int) -> None:
    """Against every triangle, one after the other."""
    random = np.random.default_rng(seed)
    scene, _ = room_row(1)
    corners = random.uniform(-5, 5, (120, 1, 3)) + random.normal(0, 2, (120, 3, 3)) * [1, 0.1, 1]
    scene = replace(
        scene,
        points=corners.reshape(-1, 3),
        triangles=np.arange(360, dtype=np.int32).reshape(-1, 3),
        two_sided=random.random(120) < 0.5,
    )
    points = random.uniform(-9, 9, (40, 3))
    wanted = []
    for p in points:
        heights = [-np.inf]
        for (a, b, c), both in zip(corners, scene.two_sided, strict=True):
            normal = np.cross(b - a, c - a)
            slope = normal[1] / np.linalg.norm(normal)
            height = a[1] - (normal[[0, 2]] @ (p - a)[[0, 2]]) / normal[1]
            turns = [np.cross(v - u, p - u)[1] for u, v in ((a, b), (b, c), (c, a))]
            inside = min(turns) >= 0 or max(turns) <= 0
            if (abs(slope) if both else slope) > np.cos(np.pi / 4) and inside and height <= p[1]:
                heights.append(height)
        wanted.append(max(heights))
    np.testing.assert_allclose(FloorFinder(scene).floor_below(points), wanted, atol=1e-9)
    assert np.isfinite(wanted).sum() > 5
    assert FloorFinder(scene).floor_below(points[:0]).shape == (0,)


@pytest.mark.parametrize("seed", range(3))
def test_the_longest_view(seed: int) -> None:
    """Against every direction with every wall."""
    random = np.random.default_rng(seed)
    walls = random.uniform(-5, 5, (40, 1, 2)) + random.normal(0, 1, (40, 2, 2))
    walls = np.concatenate(
        [walls, [[[-9, -9], [9, -9.1]], [[9, -9.1], [9.1, 9]], [[9.1, 9], [-9, 9.1]]]]
    )
    places = random.uniform(-4, 4, (5, 2))
    yaws = 2 * np.pi * np.arange(72) / 72
    ray = np.stack([-np.sin(yaws), -np.cos(yaws)], axis=1)
    for place, actual in zip(places, lengths(places, walls), strict=True):
        free = np.full(72, np.inf)
        for a, b in walls:
            for i, way in enumerate(ray):
                far, share = np.linalg.solve(np.stack([way, a - b], axis=1), a - place)
                if far > 0 and 0 <= share <= 1:
                    free[i] = min(free[i], far)
        free[np.isinf(free)] = 0
        mean = [np.roll(free, 3 - i)[:7].mean() for i in range(72)]
        np.testing.assert_allclose(actual, mean)
    assert not lengths(places[:2], walls[:0]).any()


def test_nowhere_to_stand(room_row) -> None:
    """No floor at all, or an eye above every ceiling: still one place to begin."""
    scene, cells = room_row(1)
    none = replace(scene, points=scene.points[:, [1, 0, 2]] * 0)
    for bare, options in (
        (none, EmitOptions()),
        (scene, EmitOptions(avatar_size=(0.25, 9.0, 0.75))),
    ):
        (view,) = place_viewpoints(bare, cells, options)[0]
        assert (view.cell, view.description) == (0, "Room 1")
        np.testing.assert_allclose(view.position, (2, 2, 0))


def test_nothing_beside_the_feet_lifts_the_eye(room_row) -> None:
    """Browsers stand on what is highest within the avatar's width: a bench of 0.5 m, say."""
    scene, cells = room_row(1)
    (free,) = place_viewpoints(scene, cells, EmitOptions())[0]
    x, _, z = free.position
    bench = np.array([[x + a, 0.5, z + b] for a, b in ((0.1, -1), (0.1, 1), (0.6, 1), (0.6, -1))])
    beside = replace(
        scene,
        points=np.concatenate([scene.points, bench]),
        triangles=np.concatenate(
            [scene.triangles, len(scene.points) + np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)]
        ),
        uv=np.concatenate([scene.uv, np.zeros((2, 3, 2))]),
        triangle_object=np.append(scene.triangle_object, [0, 0]).astype(np.int32),
        triangle_material=np.append(scene.triangle_material, [0, 0]).astype(np.int32),
        two_sided=np.append(scene.two_sided, [True, True]),
    )
    (moved,) = place_viewpoints(beside, cells, EmitOptions())[0]
    off = np.maximum(np.abs(np.array(moved.position)[[0, 2]] - (x + 0.35, z)) - (0.25, 1), 0)
    assert moved.position != free.position
    assert np.linalg.norm(off) > 0.25 * np.sqrt(2)
    assert moved.position[1] == 1.6


def test_one_sided_ceilings_are_no_floors(room_row) -> None:
    scene, cells = room_row(1)
    scene = replace(scene, two_sided=np.zeros_like(scene.two_sided))
    (view,) = place_viewpoints(scene, cells, EmitOptions())[0]
    assert view.position[1] == 1.6
    upside_down = replace(scene, triangles=scene.triangles[:, ::-1])
    (view,) = place_viewpoints(upside_down, cells, EmitOptions())[0]
    assert view.position == (2.0, 2.0, 0.0), "the floor's back is no floor either"


def test_rooms_of_glass(room_row) -> None:
    scene, cells = room_row(2)
    glass = tuple(replace(material, transparent=True) for material in scene.materials)
    views, _ = place_viewpoints(replace(scene, materials=glass), cells, EmitOptions())
    assert [v.cell for v in views] == [0, 1]


def test_given_ones(room_row) -> None:
    scene, cells = room_row(3)
    wanted = (
        GivenViewpoint((1.0, 0.0, 0.5)),
        GivenViewpoint((6.0, 2.5, 0.0), yaw=90.0),
        GivenViewpoint((10.0, 3.9, 1.0), yaw=0.0),
    )
    (a, b, c), _ = place_viewpoints(scene, cells, EmitOptions(viewpoints=wanted))
    assert a.position == (1.0, 1.6, 0.5)
    assert a.direction[0] > 0.9, "along the longest view"
    assert b.position == (6.0, 1.6, 0.0)
    np.testing.assert_allclose(b.direction, (-1, 0, 0), atol=1e-12)
    assert c.position == (10.0, 3.9, 1.0), "too high above the floor: as asked"
    np.testing.assert_allclose(c.direction, (0, 0, -1), atol=1e-12)
    assert [v.cell for v in (a, b, c)] == [0, 1, 2]
    outside = EmitOptions(viewpoints=(GivenViewpoint((1.0, 1.0, 9.0)),))
    with pytest.raises(InputError, match="PTM-I111"):
        place_viewpoints(scene, cells, outside)


def test_cameras_come_first(room_row) -> None:
    scene, cells = room_row(2)
    cameras = (
        Camera("aloft", (0.0, 90.0, 0.0), (0.0, -1.0, 0.0)),
        Camera("door", (5.0, 1.8, 0.0), (-2.0, 0.0, 0.0), 7.0),
    )
    views, notes = place_viewpoints(replace(scene, cameras=cameras), cells, EmitOptions())
    view, room = views
    assert (room.name, room.description, room.cell) == ("VP_1", "Room 1", 0)
    assert (view.name, view.description, view.cell) == ("VP_0", "door", 1)
    assert view.position == (5.0, 1.6, 0.0)
    assert view.direction == (-1.0, 0.0, 0.0)
    assert 0 < view.field_of_view < np.pi
    assert notes == ("camera 'aloft' lies in no cell and was left out",)
    lost = replace(scene, cameras=cameras[:1])
    views, notes = place_viewpoints(lost, cells, EmitOptions())
    assert len(views) == 2
    assert len(notes) == 1


def test_sections(room_row) -> None:
    scene, cells = room_row(3)
    section = leaf_section(cells, 1, 1.0)
    assert sorted(map(tuple, section.tolist())) == [(4, -2), (4, 2), (8, -2), (8, 2)]
    assert area(section) == 16
    assert len(leaf_section(cells, 1, 9.0)) == 0
    assert len(leaf_section(cells, 1, -1.0)) == 0
    door = polygon_section(cells.portal(0), 1.0)
    assert door is not None
    assert sorted(map(tuple, door.tolist())) == [(4, -1), (4, 1)]
    assert polygon_section(cells.portal(0), 3.5) is None
    walls = triangle_section(scene.corners, 1.0)
    length = np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1).sum()
    assert np.isclose(length, 2 * 12 + 2 * 4 + 2 * 2), "two long walls, two ends, door jambs"
    above = triangle_section(scene.corners, 3.5)
    length = np.linalg.norm(above[:, 1] - above[:, 0], axis=1).sum()
    assert np.isclose(length, 2 * 12 + 4 * 4), "above the doors the partitions are whole"
