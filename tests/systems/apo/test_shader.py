"""The shader beside numpy: the same texels, and pictures as rays draw them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from ptmtools.coverage.backends.opengl import create_context, is_software
from ptmtools.errors import InputError, MissingComponentError
from ptmtools_systems.apo import rays
from ptmtools_systems.apo.picture import RenderOptions, render
from ptmtools_systems.apo.traversal import look_up, stop_depth, unpack_normals
from ptmtools_systems.apo.view import Look, OctreePicture, OctreeView, view_of
from tests.systems.apo.building import Node, ball, nodes, octree_of
from tests.systems.apo.look_up_shader import look_up_by_shader
from tests.systems.apo.test_normals import sphere

LOW, SIDE = (-20.0, 3.0, 7.0), 4.0


def mesh(rows: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """The sphere that `ball` is of."""
    points, triangles = sphere(rows)
    return np.array(LOW) + SIDE * (0.5 + 0.45 * points), triangles


def draws_in_software() -> bool:
    context = create_context()
    software = is_software(context.info["GL_RENDERER"])
    context.release()
    return software


def drawn(levels: int, backend: str, **options: object) -> OctreePicture:
    octree = ball(5, LOW, SIDE)
    settings = RenderOptions(levels=levels, width=161, height=120, backend=backend, **options)
    return render(octree, *mesh(), settings)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(nodes(4), st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_texels_of_points_are_those_of_numpy(gl: None, root: Node, levels: int, seed: int) -> None:
    octree = octree_of(root)
    random = np.random.default_rng(seed)
    q = random.random((300, 3), dtype=np.float32)
    q[::3] = np.round(q[::3] * 16) / 16  # on the boundaries of nodes
    stop = random.integers(-1, 6, len(q))
    for where in (None, stop):
        address, depth = look_up_by_shader(octree, q, levels, where)
        actual = look_up(octree, q, levels, where)
        np.testing.assert_array_equal(address, actual.address)
        np.testing.assert_array_equal(depth, actual.depth)


def test_an_octree_of_many_rows_and_nothing_to_look_up(gl: None) -> None:
    octree = ball(6)
    assert len(octree.texels) > 3 * 4096
    q = np.random.default_rng(1).random((9000, 3), dtype=np.float32)
    address, depth = look_up_by_shader(octree, q)
    np.testing.assert_array_equal(address, look_up(octree, q).address)
    assert depth.max() == 6
    assert look_up_by_shader(octree, q[:0])[0].shape == (0,)


def test_damaged_octrees_lead_nowhere_else(gl: None) -> None:
    random = np.random.default_rng(3)
    octree = ball(4)
    texels = octree.texels.copy()
    for _ in range(20):
        texels[random.integers(len(texels), size=30)] = random.integers(0, 256, (30, 4))
        damaged = replace(octree, texels=texels)
        q = random.random((2000, 3), dtype=np.float32)
        address, _ = look_up_by_shader(damaged, q)
        np.testing.assert_array_equal(address, look_up(damaged, q).address)


@pytest.mark.parametrize("levels", [1, 3, 6])
def test_pixels_show_what_numpy_finds_at_their_places(gl: None, levels: int) -> None:
    octree = ball(5, LOW, SIDE)
    shown = drawn(levels, "gl", what="normals", distance=2.5)
    at = shown.covered
    assert 0.02 < at.mean() < 0.5
    actual = look_up(octree, shown.place[at], levels, shown.stop[at])
    np.testing.assert_array_equal(shown.address[at], actual.address)
    stored = octree.texels[actual.address, :3].astype(int)
    normals = np.rint((unpack_normals(octree.texels[actual.address]) / 2 + 0.5) * 255)
    assert np.abs(shown.picture[at] - normals).max() <= 1
    assert np.abs(stored - normals).max() < 3
    assert not shown.picture[~at].any()


@pytest.mark.parametrize("what", ["shaded", "normals"])
@pytest.mark.parametrize("levels", [0, 2, 6])
@pytest.mark.parametrize("distance", [0.0, 0.8, 6.0])
def test_rays_draw_the_same(gl: None, levels: int, what: str, distance: float) -> None:
    one = drawn(levels, "gl", what=what, distance=distance)
    other = drawn(levels, "embree", what=what, distance=distance)
    both = one.covered & other.covered
    assert (one.covered != other.covered).mean() < 1e-3
    away = np.abs(one.place - other.place)[both].max(axis=1)
    assert np.median(away) < 1e-4
    # Graphics cards move vertices by up to 1/256 of a pixel, which counts most at outlines.
    assert away.max() < (1e-4 if draws_in_software() else 2e-3)
    # Apart from pixels whose place or size is within rounding of a boundary.
    assert (one.stop != other.stop)[both].mean() < 0.01
    assert (one.address != other.address)[both].mean() < 0.01
    same = both & (one.address == other.address)
    assert np.abs(one.picture.astype(int) - other.picture)[same].max() <= 1


def test_pixels_stop_where_nodes_become_smaller() -> None:
    """Seen from the front, the middle of the sphere: a pixel is 2 tan(a/2) d / lines wide."""
    octree, (points, triangles) = ball(5), mesh(64)
    corners = ((points - LOW) / SIDE)[triangles]
    middle = np.full(3, 0.5)
    for far in (1.0, 3.0, 9.0):
        view = OctreeView(middle + [0, 0, 0.45 + far], middle, 101, 101)
        shown = rays.draw(octree, corners, corners, view, Look(6))
        wide = 2 * np.tan(np.radians(35 / 2)) * far / 101
        assert shown.stop[50, 50] == stop_depth(np.array([wide * 0.98]))[0]


def test_levels_come_nearer_to_the_sphere() -> None:
    errors = []
    for levels in range(1, 7):
        shown = drawn(levels, "embree")
        at = shown.covered
        truth = shown.place[at] - 0.5
        truth /= np.linalg.norm(truth, axis=1, keepdims=True)
        normals = unpack_normals(ball(5).texels[shown.address[at]])
        errors.append(np.degrees(np.arccos((normals * truth).sum(axis=1).clip(-1, 1))).mean())
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 2


def test_lit_from_the_upper_left() -> None:
    shown = drawn(6, "embree", azimuth=-70.0)
    row, column = np.nonzero(shown.covered)
    top, left = row < np.median(row), column < np.median(column)
    bright = [shown.picture[row[s], column[s]].mean() for s in (top & left, ~top & ~left)]
    assert bright[0] > 1.5 * bright[1]


@pytest.mark.parametrize("backend", ["gl", "embree"])
def test_colours(request: pytest.FixtureRequest, backend: str) -> None:
    if backend == "gl":
        request.getfixturevalue("gl")
    octree = ball(4, LOW, SIDE)
    colors = np.zeros_like(octree.texels)
    colors[:, 1] = 255
    options = RenderOptions(width=40, height=40, backend=backend)
    shown = render(replace(octree, colors=colors), *mesh(), options)
    green = shown.picture[shown.covered]
    assert not green[:, [0, 2]].any()
    assert green[:, 1].max() > 200


def test_without_opengl_rays_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> None:
        raise MissingComponentError("PTM-M500", "no OpenGL")

    monkeypatch.setattr("ptmtools_systems.apo.shader.create_context", absent)
    assert drawn(3, "auto").renderer.startswith("Embree")
    with pytest.raises(MissingComponentError):
        drawn(3, "gl")


@pytest.mark.parametrize(
    "wrong", [{"width": 0}, {"height": 10**5}, {"elevation": 91.0}, {"azimuth": float("nan")}]
)
def test_options_out_of_range(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        render(ball(2), *mesh(), RenderOptions(**wrong))


def test_a_mesh_without_extent() -> None:
    for points in (np.zeros((0, 3)), np.ones((3, 3))):
        with pytest.raises(InputError, match="PTM-I247"):
            render(ball(2), points, np.zeros((0, 3), dtype=np.int32))


def test_views_frame_the_points() -> None:
    points = np.array([[0.0, 0, 0], [1, 2, 30]])
    for azimuth, elevation in ((0, 0), (90, 0), (33, 90), (200, -90), (123, 45)):
        for width, height in ((300, 200), (100, 400)):
            view = view_of(points, azimuth, elevation, width=width, height=height)
            right, up, ahead = view.axes
            np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-12)
            np.testing.assert_allclose(np.cross(right, up), -ahead, atol=1e-12)
            corners = points[[0, 1]]
            local = (corners - view.eye) @ view.axes.T
            assert (np.abs(local[:, :2] / local[:, 2:]) < view.half).all()
    assert view_of(points, 90, 0, width=1, height=1).eye[0] > 10
