"""Viewpoints: where they stand, where they look, and what becomes of those that were asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ptmtools.database import EmitOptions, GivenViewpoint
from ptmtools.database.section import area, leaf_section, polygon_section, triangle_section
from ptmtools.database.storeys import storeys
from ptmtools.database.viewpoints import orientation, place_viewpoints
from ptmtools.errors import InputError
from ptmtools.scene.model import Camera


def turned(v: np.ndarray, turn: tuple[float, float, float, float]) -> np.ndarray:
    """Rodrigues."""
    k, angle = np.array(turn[:3]), turn[3]
    return v * np.cos(angle) + np.cross(k, v) * np.sin(angle) + k * (k @ v) * (1 - np.cos(angle))


UNIT = st.floats(-1, 1)


@given(st.tuples(UNIT, UNIT, UNIT))
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
    views, _ = place_viewpoints(scene, cells, EmitOptions(viewpoint_count=2))
    assert [v.name for v in views] == ["VP_0", "VP_1"]


def test_nowhere_to_stand(room_row) -> None:
    """No floor at all, or an eye above every ceiling: still one place to begin."""
    scene, cells = room_row(1)
    none = replace(scene, points=scene.points[:, [1, 0, 2]] * 0)
    for bare, options in (
        (none, EmitOptions()),
        (scene, EmitOptions(avatar_size=(0.25, 9.0, 0.75))),
    ):
        (view,) = place_viewpoints(bare, cells, options)[0]
        assert view.cell == 0
        np.testing.assert_allclose(view.position, (2, 2, 0))


def test_one_sided_ceilings_are_no_floors(room_row) -> None:
    scene, cells = room_row(1)
    scene = replace(scene, two_sided=np.zeros_like(scene.two_sided))
    (view,) = place_viewpoints(scene, cells, EmitOptions())[0]
    assert view.position[1] == 1.6
    upside_down = replace(scene, triangles=scene.triangles[:, ::-1])
    (view,) = place_viewpoints(upside_down, cells, EmitOptions())[0]
    assert view.position == (2.0, 2.0, 0.0), "the floor's back is no floor either"


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
    with pytest.raises(InputError, match="PTM-I600"):
        place_viewpoints(scene, cells, outside)


def test_cameras_come_first(room_row) -> None:
    scene, cells = room_row(2)
    cameras = (
        Camera("aloft", (0.0, 90.0, 0.0), (0.0, -1.0, 0.0)),
        Camera("door", (5.0, 1.8, 0.0), (-2.0, 0.0, 0.0), 7.0),
    )
    views, notes = place_viewpoints(replace(scene, cameras=cameras), cells, EmitOptions())
    (view,) = views
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


def test_storeys(room_row) -> None:
    _, cells = room_row(2)
    assert storeys(cells, 1.2, 1.5) == [0.0]
    lifted = cells.leaf_point.copy()
    lifted[8:, 1] += 4
    two = replace(cells, leaf_point=lifted)
    assert storeys(two, 1.2, 1.5) == [0.0, 4.0]
    step = cells.leaf_point.copy()
    step[8:, 1] += 0.5
    assert len(storeys(replace(cells, leaf_point=step), 1.2, 1.5)) == 1
