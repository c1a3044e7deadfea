"""A simplified mesh keeps shape, outlines, texture and topology, at any place and size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from ptmtools.simplification import Mesh, Simplified, SimplifyOptions, simplify
from tests.simplification.shapes import (
    box,
    cylinder,
    edge_faces,
    euler,
    facade,
    grid,
    normals,
    sphere,
    torus,
)


def to(faces: int, mesh: Mesh) -> Simplified:
    return simplify(mesh, SimplifyOptions(faces))


def bytes_of(mesh: Mesh) -> list[bytes]:
    arrays = (mesh.points, mesh.triangles, mesh.material, mesh.uv, mesh.colors)
    return [array.tobytes() for array in arrays if array is not None]


def test_a_box_of_many_faces_becomes_twelve_and_its_corners_stay_exact() -> None:
    actual = to(12, box(10))
    assert len(actual.mesh.triangles) == 12
    corners = {(x, y, z) for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 3.0)}
    assert {tuple(point) for point in actual.mesh.points.tolist()} == corners
    assert (edge_faces(actual.mesh) == 2).all()
    assert actual.error < 1e-9
    assert actual.notes == ()


def test_a_sphere_stays_a_sphere() -> None:
    given = sphere(40)
    actual = to(1000, given)
    assert 990 <= len(actual.mesh.triangles) <= 1000
    radius = np.linalg.norm(actual.mesh.points, axis=1)
    assert np.abs(radius - 1).max() < 0.005
    volume = (normals(actual.mesh) * actual.mesh.points[actual.mesh.triangles[:, 0]]).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi, rel=0.01)
    assert 0 < actual.error < 0.01


@pytest.mark.parametrize(("mesh", "characteristic"), [(sphere(20), 2), (torus(60, 40), 0)])
def test_closed_meshes_stay_closed(mesh: Mesh, characteristic: int) -> None:
    for faces in (1000, 200):
        actual = to(faces, mesh)
        assert (edge_faces(actual.mesh) == 2).all()
        assert euler(actual.mesh) == characteristic
        assert len(actual.mesh.triangles) <= faces or actual.notes


def test_faces_do_not_turn() -> None:
    actual = to(400, torus(100, 60)).mesh
    middle = actual.points[actual.triangles].mean(axis=1)
    ring = middle * [1, 1, 0]
    ring *= 2 / np.linalg.norm(ring, axis=1)[:, None]
    assert ((middle - ring) * normals(actual)).sum(axis=1).min() > 0


def test_windows_keep_their_outline_and_bricks_their_texture() -> None:
    given = facade(4, 3, 5)
    # Of the corners of the wall and of 12 windows, 4 are on the border.
    least = 2 * (4 + 4 * 12) - 2 - 4
    actual = to(least, given)
    assert len(actual.mesh.triangles) == least
    # The root of rounding errors of texture coordinates.
    assert actual.error < 1e-6
    area = np.abs(normals(actual.mesh)[:, 2]) / 2
    assert actual.mesh.material is not None
    assert area[actual.mesh.material == 1].sum() == pytest.approx(12)
    assert area.sum() == pytest.approx(9 * 7)
    assert (normals(actual.mesh)[:, 2] > 0).all()
    corner = actual.mesh.points[actual.mesh.triangles][:, :, :2]
    assert actual.mesh.uv is not None
    window = actual.mesh.material == 1
    # The texture is affine over either: what is right at the corners is right in between.
    assert np.abs(actual.mesh.uv[~window] - (corner[~window] * [4, 8] + 0.25)).max() < 1e-9
    low = corner[window].min(axis=1, keepdims=True)
    assert np.abs(actual.mesh.uv[window] - (corner[window] - low)).max() < 1e-9
    assert (low == np.floor(low)).all()
    assert (low % 2 == 1).all()


@pytest.mark.parametrize("painted", [False, True])
def test_materials_or_colours_alone_make_seams(painted: bool) -> None:
    given = replace(facade(2, 2, 4), uv=None)
    assert given.material is not None
    if painted:
        colors = np.repeat(given.material, 9).reshape(-1, 3, 3).astype(np.uint8) * 200
        given = replace(given, material=None, colors=colors)
    actual = to(2 * (4 + 4 * 4) - 2 - 4, given)
    assert not actual.notes
    mesh = actual.mesh
    kind = mesh.material if mesh.colors is None else mesh.colors[:, 0, 0] // 200
    assert (np.abs(normals(mesh)[:, 2]) / 2)[kind == 1].sum() == pytest.approx(4)
    # The corners of the wall and of four windows.
    assert len(mesh.points) == 4 + 4 * 4
    assert (mesh.points == np.round(mesh.points)).all()
    assert mesh.colors is None or (mesh.colors == mesh.colors[:, :1, :1]).all()


def test_a_texture_that_bends_is_dear() -> None:
    """On one flat wall, faces stay where the texture is not affine."""
    triangles = grid(40, 10)
    x, y = np.meshgrid(np.arange(41.0), np.arange(11.0))
    points = np.stack([x.reshape(-1), y.reshape(-1), np.zeros(x.size)], axis=1)
    u = np.where(points[:, 0] < 20, points[:, 0], 20 + 5 * np.sin(points[:, 0] - 20))
    uv = np.stack([u, points[:, 1]], axis=1)[triangles]
    actual = to(42, Mesh(points, triangles, uv=uv))
    assert len(actual.mesh.triangles) == 42
    assert actual.error < 1e-6
    middle = actual.mesh.points[actual.mesh.triangles].mean(axis=1)[:, 0]
    assert (middle > 20).sum() == 40


def test_seams_do_not_crack_and_keep_both_sides() -> None:
    given = cylinder(64, 32)
    actual = to(200, given)
    mesh = actual.mesh
    assert len(mesh.triangles) <= 200
    counts = edge_faces(mesh)
    assert set(counts.tolist()) == {1, 2}
    assert euler(mesh) == 0
    rim = mesh.points[:, 2] % 2 == 0
    assert rim.sum() >= 6
    assert mesh.uv is not None
    corner = mesh.points[mesh.triangles]
    assert mesh.uv[:, :, 1] == pytest.approx(corner[:, :, 2] / 2, abs=1e-12)
    angle = np.arctan2(corner[:, :, 1], corner[:, :, 0]) / (2 * np.pi) % 1
    apart = np.abs(mesh.uv[:, :, 0] - angle)
    assert np.minimum(apart, 1 - apart).max() < 1e-9
    # No face reaches over the seam.
    assert np.ptp(mesh.uv[:, :, 0], axis=1).max() < 0.5


def test_corners_have_what_was_given_to_a_corner_of_that_point() -> None:
    mesh = cylinder(32, 16)
    rng = np.random.default_rng(1)
    colors = rng.integers(0, 4, (len(mesh.points), 3))[mesh.triangles].astype(np.uint8)
    mesh = replace(mesh, colors=colors)
    actual = to(300, mesh).mesh

    def corners(mesh: Mesh) -> set[tuple[float, ...]]:
        assert mesh.uv is not None
        assert mesh.colors is not None
        rows = [mesh.points[mesh.triangles], mesh.uv, mesh.colors.astype(float)]
        return set(map(tuple, np.concatenate(rows, axis=2).reshape(-1, 8).tolist()))

    assert corners(actual) <= corners(mesh)


def test_borders_stay() -> None:
    triangles = grid(20, 20)
    x, y = np.meshgrid(np.arange(21.0), np.arange(21.0))
    points = np.stack([x.reshape(-1), y.reshape(-1), np.zeros(x.size)], axis=1)
    hole = (np.abs(points[triangles].mean(axis=1)[:, :2] - 10) < 3).all(axis=1)
    actual = to(8, Mesh(points, triangles[~hole])).mesh
    assert len(actual.triangles) == 8
    assert np.abs(normals(actual)).sum() / 2 == 20 * 20 - 36
    assert (edge_faces(actual) == 1).sum() == 8


def test_three_walls_that_meet_stay_together() -> None:
    walls, count = [], 11 * 11
    x, y = (each.reshape(-1) for each in np.meshgrid(np.arange(11.0), np.arange(11.0)))
    for angle in (0.0, 2.0, 4.0):
        walls.append(np.stack([x * np.cos(angle), x * np.sin(angle), y], axis=1))
    triangles = np.concatenate([grid(10, 10) + i * count for i in range(3)])
    actual = to(6, Mesh(np.concatenate(walls), triangles)).mesh
    assert len(actual.triangles) == 6
    assert sorted(edge_faces(actual)) == [1] * 9 + [2] * 3 + [3]


def test_a_surface_with_two_sides_becomes_simpler_on_both() -> None:
    mesh = facade(1, 1, 4)
    both = Mesh(mesh.points, np.concatenate([mesh.triangles, mesh.triangles[:, ::-1]]))
    actual = to(4, both).mesh
    assert len(actual.triangles) == 4
    assert sorted(np.sign(normals(actual)[:, 2])) == [-1, -1, 1, 1]


def test_many_parts() -> None:
    ball = sphere(4)
    count = len(ball.points)
    shifts = np.random.default_rng(2).uniform(-50, 50, (500, 3))
    points = (ball.points[None] + shifts[:, None]).reshape(-1, 3)
    triangles = (ball.triangles[None] + count * np.arange(500)[:, None, None]).reshape(-1, 3)
    actual = to(10_000, Mesh(points, triangles.astype(np.int32)))
    assert len(actual.mesh.triangles) == 10_000
    assert (edge_faces(actual.mesh) == 2).all()
    options = SimplifyOptions(1, keep_parts=True)
    least = simplify(Mesh(points, triangles.astype(np.int32)), options)
    assert len(least.mesh.triangles) == 4 * 500
    assert least.notes


def test_no_collapse_has_a_greater_error_than_allowed() -> None:
    given = sphere(20)
    for error in (1e-3, 1e-2):
        actual = simplify(given, SimplifyOptions(1, error=error))
        assert error / 2 < actual.error <= error
        assert actual.notes
    box_again = simplify(box(5), SimplifyOptions(1, error=0.0))
    assert len(box_again.mesh.triangles) == 12
    free = simplify(given, SimplifyOptions(1000, error=1e300))
    assert bytes_of(free.mesh) == bytes_of(to(1000, given).mesh)
    with pytest.raises(ValueError, match="no error"):
        SimplifyOptions(error=float("nan"))


def test_lone_triangles_stay() -> None:
    corners = np.random.default_rng(3).uniform(size=(20, 3, 3))
    given = Mesh(corners.reshape(-1, 3), np.arange(60, dtype=np.int32).reshape(-1, 3))
    actual = simplify(given, SimplifyOptions(1, keep_parts=True))
    assert sorted(map(bytes, actual.mesh.points)) == sorted(map(bytes, corners.reshape(-1, 3)))
    assert len(actual.mesh.triangles) == 20


def test_parts_that_touch_in_a_point_still_do() -> None:
    """A sheet, the middle of whose border is a corner of an octahedron."""
    x, y = (each.reshape(-1) for each in np.meshgrid(np.arange(11.0), np.arange(-5.0, 6.0)))
    ends = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    octahedron = [[a, b, c] for a in (0, 1) for b in (2, 3) for c in (4, 5)]
    points = np.concatenate([np.stack([x, y, 0 * x], axis=1), ends * 3 - [3, 0, 0]])
    faces = [[a, b, c] if (a + b + c) % 2 == 0 else [a, c, b] for a, b, c in octahedron]
    triangles = np.concatenate([grid(10, 10), np.array(faces, np.int32) + len(x)])
    actual = simplify(Mesh(points, triangles), SimplifyOptions(1, keep_parts=True)).mesh
    at_origin = (actual.points[actual.triangles] == 0).all(axis=2).any(axis=1)
    sheet = (actual.points[actual.triangles][:, :, 0] >= 0).all(axis=1)
    assert (at_origin & sheet).any()
    assert (at_origin & ~sheet).any()


def test_the_source_of_each_face_is_where_it_is() -> None:
    mesh = replace(sphere(12), material=np.arange(12 * 144, dtype=np.int32) // 288)
    actual = to(600, mesh)
    assert mesh.material is not None
    assert actual.mesh.material is not None
    assert actual.mesh.material.tolist() == mesh.material[actual.source].tolist()
    here = actual.mesh.points[actual.mesh.triangles].mean(axis=1)
    there = mesh.points[mesh.triangles[actual.source]].mean(axis=1)
    assert np.linalg.norm(here - there, axis=1).max() < 0.6


def test_the_same_mesh_gives_the_same_bytes() -> None:
    for mesh in (torus(50, 40), cylinder(40, 20)):
        assert bytes_of(to(300, mesh).mesh) == bytes_of(to(300, mesh).mesh)


@pytest.mark.parametrize("scale", [2.0**-900, 2.0**-40, 2.0**40, 2.0**900])
def test_size_does_not_matter(scale: float) -> None:
    mesh = torus(40, 30)
    plain = to(300, mesh)
    other = to(300, replace(mesh, points=mesh.points * scale))
    assert (other.mesh.points == plain.mesh.points * scale).all()
    assert (other.source == plain.source).all()
    assert other.error == plain.error * scale


def test_place_does_not_matter() -> None:
    mesh = torus(40, 30)
    rounded = np.round(mesh.points * 2.0**20) / 2.0**20
    plain = to(300, replace(mesh, points=rounded))
    shift = 2.0**20 * np.array([3.0, -5.0, 7.0])
    far = to(300, replace(mesh, points=rounded + shift))
    assert (far.source == plain.source).all()
    assert far.mesh.points - shift == pytest.approx(plain.mesh.points, abs=1e-8)


def test_few_faces_are_returned_as_they_are() -> None:
    mesh = box(3)
    actual = to(12 * 9, mesh)
    assert actual.mesh is mesh
    assert actual.source.tolist() == list(range(12 * 9))
    assert actual.error == 0


def test_nothing_is_nothing() -> None:
    empty = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))
    assert len(to(1, empty).mesh.triangles) == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": np.full((3, 3), np.nan)}, "points has numbers that are not finite"),
        ({"points": np.zeros((3, 2))}, "points has the shape"),
        ({"triangles": np.array([[0, 1, 3]], np.int32)}, "index out of range"),
        ({"triangles": np.array([[0, 1, -1]], np.int32)}, "index out of range"),
        ({"material": np.zeros(2, np.int32)}, "material has the shape"),
        ({"uv": np.full((1, 3, 2), np.inf)}, "uv has numbers"),
        ({"colors": np.zeros((1, 3), np.uint8)}, "colors has the shape"),
    ],
)
def test_arrays_that_do_not_fit_are_named(
    change: dict[str, NDArray[np.generic]], words: str
) -> None:
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32))
    with pytest.raises(ValueError, match=words):
        to(1, replace(mesh, **change))  # type: ignore[arg-type]


def test_no_faces_cannot_be_asked_for() -> None:
    with pytest.raises(ValueError, match="too few"):
        SimplifyOptions(0)


def test_progress_reaches_its_end() -> None:
    printed: list[tuple[int, int, str]] = []
    simplify(torus(30, 20), SimplifyOptions(200), lambda *call: printed.append(call))
    assert printed[-1][0] == printed[-1][1] == 1000
    assert [done for done, _, _ in printed] == sorted(done for done, _, _ in printed)


@given(
    seed=st.integers(0, 2**32 - 1),
    points=st.integers(3, 14),
    faces=st.integers(1, 60),
    target=st.integers(1, 30),
    painted=st.booleans(),
)
def test_any_soup(seed: int, points: int, faces: int, target: int, painted: bool) -> None:
    rng = np.random.default_rng(seed)
    mesh = Mesh(
        rng.integers(0, 3, (points, 3)).astype(float),
        rng.integers(0, points, (faces, 3)).astype(np.int32),
    )
    if painted:
        uv = rng.integers(0, 2, (faces, 3, 2)).astype(float)
        mesh = replace(mesh, material=rng.integers(0, 2, faces).astype(np.int32), uv=uv)
    actual = to(target, mesh)
    left = actual.mesh
    assert len(left.triangles) == len(actual.source) <= faces
    assert np.isfinite(left.points).all()
    assert np.isfinite(actual.error)
    if len(left.triangles):
        assert 0 <= left.triangles.min() <= left.triangles.max() < len(left.points)
    if actual.mesh is not mesh:
        assert (left.triangles != np.roll(left.triangles, 1, axis=1)).all()
        assert len(np.unique(left.triangles)) == len(left.points)
        many = any("faces are left" in note for note in actual.notes)
        assert many == (len(left.triangles) > target)


def test_what_is_painted_around_a_hub_stays_in_place() -> None:
    """The point of a cone of 300 faces, each of which has its edges found from the rim."""
    rng = np.random.default_rng(7)
    turn = np.arange(300) * 2 * np.pi / 300
    radius = 1 + 0.05 * rng.normal(size=300)
    rim = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    points = np.concatenate([[[0, 0, 1.0]], rim, [[0, 0, -1.0]]])
    i, j = np.arange(300) + 1, (np.arange(300) + 1) % 300 + 1
    triangles = np.concatenate(
        [np.stack([0 * i, i, j], axis=1), np.stack([0 * i + 301, j, i], axis=1)]
    ).astype(np.int32)
    # A material for each quarter: lines of kept edges end at the hubs.
    material = (np.tile(np.arange(300), 2) // 75).astype(np.int32)
    given = Mesh(points, triangles, material, points[triangles][..., :2])
    actual = to(60, given).mesh
    assert len(actual.triangles) == 60
    assert actual.uv is not None
    assert np.array_equal(actual.uv, actual.points[actual.triangles][..., :2])
    assert euler(actual) == 2
    assert actual.material is not None
    for number in range(4):
        angle = np.arctan2(
            *actual.points[actual.triangles[actual.material == number]].mean(axis=1)[:, [1, 0]].T
        )
        assert (np.floor(angle % (2 * np.pi) / (np.pi / 2)) == number).all()
