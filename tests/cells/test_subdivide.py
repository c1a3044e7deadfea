"""Cells, portals, reach and ownership on rooms small enough to check by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, structural_triangles, subdivide
from ptmtools.errors import InputError
from ptmtools.scene.model import Material, Scene
from tests.conftest import subdivided

LEAF = SubdivideOptions(cells="leaf")


def piece_areas(cells: Cells) -> np.ndarray:
    p = cells.vertex[cells.triangle]
    return np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2


@pytest.mark.parametrize("rooms", [1, 2, 5])
def test_a_row_of_rooms(room_row, rooms: int) -> None:
    scene, by_hand = room_row(rooms)
    cells = subdivide(scene)
    assert cells.closed
    assert cells.cell_count == rooms
    assert cells.portal_count == rooms - 1
    assert np.allclose(cells.portal_area, 6.0)
    assert np.allclose(cells.leaf_volumes(), 64)
    middles = np.array([[4 * i + 2.0, 2, 0] for i in range(rooms)])
    where = cells.locate(middles)
    assert sorted(where) == list(range(rooms))
    assert [list(a) for a in cells.adjacent()] == [
        sorted(where[j] for j in (i - 1, i + 1) if 0 <= j < rooms)
        for i in (int(np.flatnonzero(where == c)[0]) for c in range(rooms))
    ]
    # Owners, by hand: -1 stays -1, room i is where[i].
    order = np.lexsort((cells.triangle_source,))
    rename = np.append(where, -1)
    assert np.array_equal(cells.triangle_cell[order], rename[by_hand.triangle_cell])


def test_portals_lie_in_both_leaves_and_point_forward(room_row) -> None:
    cells = subdivide(room_row(4)[0])
    for k in range(cells.portal_count):
        polygon, plane = cells.portal(k), cells.portal_plane[k]
        assert np.allclose(polygon @ plane[:3] + plane[3], 0)
        assert np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0]) @ plane[:3] > 0
        behind, ahead = cells.portal_leaf[k]
        middle = polygon.mean(axis=0)
        assert cells.locate_leaf(middle + 0.1 * plane[:3]) == ahead
        assert cells.locate_leaf(middle - 0.1 * plane[:3]) == behind


@pytest.mark.parametrize(("length", "times"), [(4, 1), (500, 1), (4, 2), (4, 3)])
def test_walls_with_thickness_leave_solids_out(
    quads, room_faces, length: float, times: int
) -> None:
    # Two rooms 0.3 m apart, a door tunnel between them with jambs, floor and lintel. In a building
    # of 500 m 0.3 m is less than the cluster distance would be without a bound.
    left = room_faces((0, 0, -2), (4, 4, 2), "+x")
    right = room_faces((4.3, 0, -2), (4.3 + length, 4, 2), "-x")
    walls = []
    for x in (4.0, 4.3):
        for y0, y1, z0, z1 in ((0, 4, -2, -1), (0, 4, 1, 2), (3, 4, -1, 1)):
            walls.append([[x, y0, z0], [x, y1, z0], [x, y1, z1], [x, y0, z1]])
    tunnel = room_faces((4, 0, -1), (4.3, 3, 1), "-x +x")
    # No triangle of a subdivided jamb reaches from one face of the wall to the other.
    cells = subdivide(subdivided(quads(left + right + walls + tunnel), times), LEAF)
    assert cells.closed
    inside = cells.locate(np.array([[2.0, 1, 0], [4.15, 1, 0], [6, 1, 0]]))
    assert len(set(inside)) == 3
    assert np.all(inside >= 0)
    # The doorway is a cell of its own; the solid around it and the outside are nobody's.
    assert cells.cell_count == 3
    solid = [[4.15, 3.5, 0], [4.15, 1, 1.5], [4.15, 1, -1.5]]
    outside = [[-0.5, 1, 0], [2, 4.5, 0], [5 + length, 1, 0]]
    assert np.all(cells.locate(np.array(solid + outside)) == -1)


def test_no_ceiling_is_open_and_said(quads, room_faces, partition) -> None:
    faces = room_faces((0, 0, -2), (8, 4, 2), "+y") + partition(4, (0, 3, -1, 1))
    cells = subdivide(quads(faces))
    assert not cells.closed
    assert any("open" in note for note in cells.notes)
    assert cells.root_box[1, 1] == pytest.approx(4)
    assert cells.cell_count == 2
    assert np.allclose(cells.portal_area, 6.0)


def test_a_window_opens_the_model_but_glass_is_not_a_wall(quads, room_faces) -> None:
    glass = Material("glass", opacity=0.3, transparent=True)
    hole = [[8, y, z] for y, z in ((1, -1), (3, -1), (3, 1), (1, 1))]
    around = [
        [[8, y0, z0], [8, y1, z0], [8, y1, z1], [8, y0, z1]]
        for y0, y1, z0, z1 in ((0, 4, -2, -1), (0, 4, 1, 2), (0, 1, -1, 1), (3, 4, -1, 1))
    ]
    faces = [*room_faces((0, 0, -2), (8, 4, 2), "+x"), *around, hole]
    material = [0] * (len(faces) - 1) + [1]
    open_scene = quads(faces, materials=(Material("wall"), glass), material=material)
    assert not subdivide(open_scene).closed
    solid = replace(open_scene, materials=(Material("wall"), Material("board")))
    assert subdivide(solid).closed


def test_an_opening_of_a_square_centimetre_is_kept_and_a_crack_is_not(
    quads, room_faces, partition
) -> None:
    shell = room_faces((0, 0, -2), (8, 4, 2))
    tiny = subdivide(quads(shell + partition(4, (1, 1.01, 0, 0.01))))
    assert tiny.portal_count == 1
    assert tiny.portal_area[0] == pytest.approx(1e-4)
    crack = subdivide(quads(shell + partition(4, (1, 3, 0, 1e-5))), SubdivideOptions(reach="main"))
    assert crack.portal_count == 0
    assert crack.cell_count == 1  # the other room cannot be reached


def test_a_slit_between_staggered_walls_stays_open(quads, room_faces) -> None:
    # Two half walls 1 mm apart in depth that overlap: one can look through between them.
    lower = [[4, 0, -2], [4, 2.5, -2], [4, 2.5, 2], [4, 0, 2]]
    upper = [[4.001, 2, -2], [4.001, 4, -2], [4.001, 4, 2], [4.001, 2, 2]]
    cells = subdivide(quads([*room_faces((0, 0, -2), (8, 4, 2)), lower, upper]))
    left, gap, right = cells.locate(np.array([[2.0, 1, 0], [4.0005, 2.2, 0], [6, 1, 0]]))
    assert [sorted(a) for a in (cells.adjacent()[left], cells.adjacent()[right])] == [[gap], [gap]]


def test_walls_present_twice_and_overlapping_unite(quads, room_faces, partition) -> None:
    two_walls = partition(4, (0, 3, -1, 1))
    two_walls += [face[::-1] for face in two_walls]
    two_walls.append([[4, 0, 0.9], [4, 4, 0.9], [4, 4, 2], [4, 0, 2]])
    cells = subdivide(quads(room_faces((0, 0, -2), (8, 4, 2)) + two_walls))
    assert cells.cell_count == 2
    assert cells.portal_area == pytest.approx([3 * 1.9])


def test_a_concave_opening_becomes_its_hull(quads, room_faces) -> None:
    shell = room_faces((0, 0, -2), (8, 4, 2))
    # An opening like an L: a wall with a door and a hatch beside it.
    solid = [(0, 4, -2, -1), (3, 4, -1, 2), (0, 2, 1, 2)]
    walls = [[[4, y0, z0], [4, y1, z0], [4, y1, z1], [4, y0, z1]] for y0, y1, z0, z1 in solid]
    cells = subdivide(quads(shell + walls))
    assert cells.portal_count == 1
    assert cells.portal_area[0] == pytest.approx(3 * 2 + 1 * 1)
    flat = cells.portal(0)[:, 1:]
    hull = 0.5 * abs(
        np.sum(flat[:, 0] * np.roll(flat[:, 1], -1) - flat[:, 1] * np.roll(flat[:, 0], -1))
    )
    assert hull == pytest.approx(3 * 3 - 2 * 1 / 2)


def furniture(scene_faces: list, quads) -> Scene:
    screen = [[2, 0, -1.5], [2, 3, -1.5], [2, 3, 1.5], [2, 0, 1.5]]
    names = ["shell"] * len(scene_faces) + ["screen_1"]
    return quads([*scene_faces, screen], objects=names)


def test_detail_and_structural_by_name(quads, room_faces) -> None:
    scene = furniture(room_faces((0, 0, -2), (4, 4, 2)), quads)
    assert subdivide(scene).leaf_count == 2
    assert subdivide(scene, SubdivideOptions(detail=("screen*",))).leaf_count == 1
    assert subdivide(scene, SubdivideOptions(wall_area=10)).leaf_count == 1
    forced = SubdivideOptions(wall_area=10, structural=("screen*",))
    assert subdivide(scene, forced).leaf_count == 2
    both = SubdivideOptions(detail=("*",), structural=("shell", "screen_1"))
    assert np.all(structural_triangles(scene, both))


def test_max_leaves_keeps_the_best_splits(room_row) -> None:
    scene, _ = room_row(6)
    cells = subdivide(scene, SubdivideOptions(max_leaves=3))
    assert cells.cell_count <= 3
    assert subdivide(scene, SubdivideOptions(max_leaves=1)).cell_count == 1


def test_the_flood_starts_at_the_viewpoints(quads, room_faces) -> None:
    # A large sealed hall and a small sealed room.
    faces = room_faces((0, 0, -4), (20, 4, 4)) + room_faces((30, 0, -2), (34, 4, 2))
    scene = quads(faces)
    hall = subdivide(scene, SubdivideOptions(reach="main"))
    assert hall.locate(np.array([[10.0, 1, 0]]))[0] >= 0
    assert hall.locate(np.array([[32.0, 1, 0]]))[0] == -1
    room = subdivide(scene, SubdivideOptions(viewpoints=((32, 1.6, 0),), reach="main"))
    assert room.locate(np.array([[32.0, 1, 0]]))[0] >= 0
    assert room.locate(np.array([[10.0, 1, 0]]))[0] == -1


def test_cuts_keep_area_place_and_texture(quads, room_faces, partition) -> None:
    # A banner of 6 m runs diagonally through both rooms and the door plane.
    banner = [[1, 1, -0.9], [7, 1.2, 0.7], [7, 2.2, 0.7], [1, 2, -0.9]]
    faces = [*room_faces((0, 0, -2), (8, 4, 2)), *partition(4, (0, 3, -1, 1)), banner]
    scene = quads(faces)
    cells = subdivide(scene, SubdivideOptions(detail=(f"quad{len(faces) - 1}",)))
    cut_up = cells.triangle_source >= 2 * (len(faces) - 1)
    owners = cells.triangle_cell[cut_up]
    assert np.all(owners[:, 0] == owners[:, 1])
    assert len(np.unique(owners)) == 2
    corners = scene.corners
    whole = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    # Halves of a quadrilateral are joined, and parts of them go by the name of either.
    parts = np.bincount(cells.triangle_source // 2, weights=piece_areas(cells))
    assert np.allclose(parts, np.bincount(np.arange(len(whole)) // 2, whole / 2))
    points = cells.vertex[cells.triangle]
    assert np.array_equal(cells.locate(points[cut_up].mean(axis=1)), owners[:, 0])
    # Texture coordinates stay the affine function of position that they were.
    for t in np.unique(cells.triangle_source[cut_up]):
        basis = np.column_stack([corners[t], np.ones(3)])
        affine, *_ = np.linalg.lstsq(basis, scene.uv[t], rcond=None)
        mine = cells.triangle[cells.triangle_source == t].ravel()
        predicted = np.column_stack([cells.vertex[mine], np.ones(len(mine))]) @ affine
        assert np.allclose(predicted, cells.vertex_uv[mine], atol=1e-9)


def test_a_shared_edge_is_cut_in_one_point(quads, room_faces, partition) -> None:
    # The banner's two triangles share a diagonal that crosses the plane of the partition. It is
    # bent there: of a flat one nothing would remain of the diagonal.
    banner = [[1, 1, -0.9], [7, 1.2, 0.7], [7, 2.2, 0.7], [1, 2, -0.8]]
    faces = [*room_faces((0, 0, -2), (8, 4, 2)), *partition(4, (0, 3, -1, 1)), banner]
    cells = subdivide(quads(faces), SubdivideOptions(detail=(f"quad{len(faces) - 1}",)))
    cut_up = cells.triangle[cells.triangle_source >= 2 * (len(faces) - 1)]
    at_cut = {tuple(p) for p in cells.vertex[cut_up.ravel()] if abs(p[0] - 4) < 1e-6}
    assert len(at_cut) == 3


def test_one_sided_faces_in_a_boundary_belong_to_the_side_they_face(
    quads, room_faces, partition
) -> None:
    faces = room_faces((0, 0, -2), (8, 4, 2)) + partition(4, (0, 3, -1, 1))
    scene = quads(faces)
    cells = subdivide(scene)
    boundary = cells.triangle_cell[:, 0] != cells.triangle_cell[:, 1]
    inner = boundary & np.all(cells.triangle_cell >= 0, axis=1)
    assert inner.sum() == 6
    _, both = cells.emitted(scene.two_sided)
    triangle, one = cells.emitted(np.zeros(len(scene.triangles), dtype=bool))
    assert len(both) == len(one) + 6
    assert np.array_equal(cells.triangle_cell[triangle, 0], one)


def test_only_a_floor(quads) -> None:
    cells = subdivide(quads([[[0, 0, 0], [0, 0, 5], [5, 0, 5], [5, 0, 0]]]))
    assert cells.cell_count == 1
    assert not cells.closed
    assert np.ptp(cells.leaf_points(0), axis=0).min() > 0
    assert np.all(cells.triangle_cell == 0)


def test_same_input_same_arrays(room_row) -> None:
    scene, _ = room_row(3)
    first, second = subdivide(scene).to_arrays(), subdivide(scene).to_arrays()
    assert all(np.array_equal(first[k], second[k]) for k in first)
    back = Cells.from_arrays(first)
    assert all(np.array_equal(first[k], array) for k, array in back.to_arrays().items())
    assert back.tolerance == scene.tolerance
    for extent in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match=r"extent"):
            Cells.from_arrays({**first, "extent": np.array(extent)})


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
def test_the_subdivision_scales_with_the_scene(room_row, scale: float) -> None:
    scene, _ = room_row(3)
    large = scene.with_points(scene.points * scale)
    cells = subdivide(large, SubdivideOptions(wall_area=2 * scale**2))
    assert cells.closed
    assert cells.cell_count == 3
    assert np.allclose(cells.portal_area, 6 * scale**2)


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"wall_area": 0}, "PTM-I111"),
        ({"wall_area": float("nan")}, "PTM-I111"),
        ({"wall_thickness": -1}, "PTM-I111"),
        ({"gain": float("nan")}, "PTM-I111"),
        ({"cells": "hall"}, "PTM-I111"),
        ({"max_leaves": 0}, "PTM-I111"),
        ({"viewpoints": ((1e3, 0, 0),)}, "PTM-I111"),
        ({"detail": ("no such thing",)}, "PTM-I302"),
    ],
)
def test_bad_options(room_row, options: dict[str, Any], code: str) -> None:
    with pytest.raises(InputError) as caught:
        subdivide(room_row(1)[0], SubdivideOptions(**options))
    assert caught.value.code == code


def test_places_out_of_reach_are_a_note_each(quads: Any, room_faces: Any) -> None:
    rooms = [((0, 0, -4), (20, 4, 4)), ((30, 0, -2), (34, 4, 2)), ((40, 0, -2), (43, 4, 2))]
    scene = quads([face for low, high in rooms for face in room_faces(low, high)])
    printed = [note for note in subdivide(scene).notes if "reached from the viewpoint" in note]
    assert len(printed) == 2
    assert ["--reach main" in note for note in printed] == [True, False], (
        "the first note names the remedy for all"
    )
    assert not any("--reach" in note for note in subdivide(scene).notes if note not in printed)
