"""Models that no architect would draw and every exporter writes."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance
from ptmtools.visibility import check_conservative, compute_pvs
from tests.conftest import scene_of

LEAF = SubdivideOptions(cells="leaf")
LOW, HIGH = (0, 0, -2), (8, 4, 2)


def assert_sound(scene: Scene, cells: Cells, segments: int = 20_000) -> None:
    """Cells see themselves and their neighbours, and no segment finds more."""
    pvs = compute_pvs(cells)
    seen = pvs.to_matrix()
    assert np.array_equal(seen, seen.T)
    assert seen.diagonal().all()
    for cell, neighbours in enumerate(cells.adjacent()):
        assert seen[cell, neighbours].all()
    report = check_conservative(scene.corners, cells, pvs, segments)
    assert report.tried > segments / 2
    assert report.missed == ()


def test_an_empty_room_is_one_cell(quads, room_faces) -> None:
    scene = quads(room_faces(LOW, HIGH))
    cells = subdivide(scene)
    assert (cells.closed, cells.leaf_count, cells.cell_count, cells.portal_count) == (True, 1, 1, 0)
    assert cells.leaf_volumes() == pytest.approx([128])
    assert compute_pvs(cells).cell.tolist() == [0]
    assert_sound(scene, cells)


@pytest.mark.parametrize("thick", [0.0, 1e-12, 1e-7, 1e-5])
def test_walls_with_hardly_any_thickness(quads, room_faces, partition, thick: float) -> None:
    """Two sheets, or one twice, around nothing: two rooms and the door, no cell between."""
    sheets = [face for x in (4, 4 + thick) for face in partition(x, (0, 3, -1, 1))]
    scene = quads(room_faces(LOW, HIGH) + sheets)
    cells = subdivide(scene, LEAF)
    assert cells.closed
    assert cells.leaf_count == 2
    assert cells.portal_area == pytest.approx([6.0], rel=1e-4)
    assert_sound(scene, cells)


@pytest.mark.parametrize(
    ("long", "thick"), [(8, 1e-4), (8, 1e-3), (8, 5e-3), (80, 1e-3), (80, 0.03), (80, 0.05)]
)
def test_thin_walls_are_walls(quads, room_faces, partition, long: float, thick: float) -> None:
    """Two rooms whose floors and roofs end at the faces of the wall between them: were the inside
    of the wall part of a room, that would be open to the outside."""
    one = room_faces((4 - long / 2, 0, -2), (4, 4, 2), "+x")
    other = room_faces((4 + thick, 0, -2), (4 + thick + long / 2, 4, 2), "-x")
    sheets = [face for x in (4, 4 + thick) for face in partition(x, (0, 3, -1, 1))]
    reveals = room_faces((4, 0, -1), (4 + thick, 3, 1), "-x +x")
    scene = quads(one + other + sheets + reveals)
    cells = subdivide(scene, LEAF)
    assert cells.closed
    volumes = [6 * thick, 8 * long, 8 * long]
    assert np.sort(cells.leaf_volumes()) == pytest.approx(volumes, rel=1e-3)
    assert cells.portal_area == pytest.approx([6.0, 6.0], rel=1e-4)
    assert_sound(scene, cells)


def test_what_hangs_on_a_wall_is_no_wall(quads, room_faces, partition) -> None:
    """A panel that stands on the floor, with a slit behind it which the floor closes."""
    panel = [[[7.995, y, z] for y, z in ((0, -1), (1.5, -1), (1.5, 1), (0, 1))]]
    scene = quads(room_faces(LOW, HIGH) + partition(4, (0, 3, -1, 1)) + panel)
    assert subdivide(scene, LEAF).leaf_count == 2


def test_a_wall_of_a_hundred_thousand_slivers(quads, room_faces) -> None:
    """Strips as a triangulator may leave them, all in one plane, beside a door."""
    count = 25_000
    y = np.linspace(0, 4, count + 1)
    corners = []
    for z0, z1 in ((-2.0, -1.0), (1.0, 2.0)):
        low, high = y[:-1], y[1:]
        four, near, far = (np.full(count, value) for value in (4.0, z0, z1))
        a, b = (np.stack([four, low, side], axis=1) for side in (near, far))
        c, d = (np.stack([four, high, side], axis=1) for side in (near, far))
        corners += [np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)]
    shell = quads(room_faces(LOW, HIGH))
    lintel = np.array([[[4, 3, -1], [4, 4, -1], [4, 4, 1]], [[4, 3, -1], [4, 4, 1], [4, 3, 1]]])
    scene = scene_of(np.concatenate([shell.corners, *corners, lintel]))
    assert len(scene.triangles) > 100_000
    cells = subdivide(scene, LEAF)
    assert cells.leaf_count == 2
    assert cells.portal_area == pytest.approx([6.0])
    assert_sound(scene, cells)


def test_walls_in_one_plane_are_one_however_thin_walls_may_be(quads, room_faces, partition) -> None:
    """The other half of a wall, out of line by less than an on-plane distance."""
    usual = Tolerance.for_extent(8.0)
    assert usual.for_walls(0) == usual
    assert [usual.for_walls(t).cluster for t in (1e-12, 1e-9, 1e-5)] == [usual.plane] * 3
    assert usual.plane < usual.for_walls(0.01).cluster < usual.cluster == usual.for_walls(1).cluster
    sheets = [face for x in (4, 4 + usual.plane / 2) for face in partition(x, (0, 3, -1, 1))]
    scene = quads(room_faces(LOW, HIGH) + sheets)
    for thickness in (0.0, 1e-9, 0.5):
        cells = subdivide(scene, SubdivideOptions(cells="leaf", wall_thickness=thickness))
        assert cells.leaf_count == 2


def test_a_room_shaped_like_a_ball() -> None:
    """20,000 triangles, none of them a wall: what has no flat wall is not cut."""
    rings, around = 100, 101
    polar = np.linspace(0, np.pi, rings + 1)
    turn = np.linspace(0, 2 * np.pi, around + 1)
    ring, step = np.meshgrid(polar, turn, indexing="ij")
    ball = 6 * np.stack([np.sin(ring) * np.cos(step), np.cos(ring), np.sin(ring) * np.sin(step)], 2)
    a, b, c, d = ball[:-1, :-1], ball[1:, :-1], ball[1:, 1:], ball[:-1, 1:]
    corners = np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)]).reshape(-1, 3, 3)
    scene = scene_of(corners)
    assert len(scene.triangles) > 20_000
    cells = subdivide(scene)
    assert cells.cell_count == 1
    assert np.all(cells.locate(np.array([[0.0, 0, 0], [5, 0, 0]])) == 0)
    assert_sound(scene, cells)


def test_triangles_without_area_change_nothing(quads, room_faces, partition) -> None:
    scene = quads(room_faces(LOW, HIGH) + partition(4, (0, 3, -1, 1)))
    needles = np.array([[[1, 1, 0], [1, 1, 0], [2, 1, 0]], [[1, 2, 1], [2, 2, 1], [3, 2, 1]]])
    one, other = (
        subdivide(scene_of(np.concatenate([scene.corners, more])), LEAF)
        for more in (needles[:0], needles)
    )
    assert np.array_equal(one.portal_point, other.portal_point)
    assert one.leaf_count == other.leaf_count == 2
