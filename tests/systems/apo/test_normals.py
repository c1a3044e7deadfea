"""Normals at corners: known solids, and the kernel beside its plain form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from ptmtools_systems.apo import normals
from ptmtools_systems.apo.normals import (
    ARCCOS,
    FAN,
    corner_normals,
    corners_by_point,
    least_cosine,
)

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
CUBE_TRIANGLES = np.array([[f[0], f[k], f[k + 1]] for f in FACES for k in (1, 2)])


def sphere(rows: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A sphere of squares cut in two, all of whose points have length one."""
    i, j = np.meshgrid(np.arange(1, rows), np.arange(2 * rows), indexing="ij")
    theta, phi = np.pi * i / rows, np.pi * j / rows
    at = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    points = np.concatenate([at.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    number = np.arange(len(points) - 2).reshape(i.shape)
    right = np.roll(number, -1, axis=1)
    quads = np.stack([number[:-1], number[1:], right[1:], right[:-1]], -1).reshape(-1, 4)
    north, south = len(points) - 2, len(points) - 1
    top = np.stack([np.full(2 * rows, north), number[0], right[0]], -1)
    low = np.stack([np.full(2 * rows, south), right[-1], number[-1]], -1)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], top, low])


def test_a_sphere_is_smooth() -> None:
    points, triangles = sphere()
    actual = corner_normals(points, triangles)
    cosine = (actual * points[triangles]).sum(axis=2)
    assert np.degrees(np.arccos(cosine.min())) < 1
    np.testing.assert_allclose(np.linalg.norm(actual, axis=2), 1, rtol=1e-12)


def test_a_cube_keeps_its_edges_below_its_angle_and_loses_them_above() -> None:
    flat = np.cross(*(CUBE[CUBE_TRIANGLES[:, k]] - CUBE[CUBE_TRIANGLES[:, 0]] for k in (1, 2)))
    np.testing.assert_array_equal(
        corner_normals(CUBE, CUBE_TRIANGLES, 89), np.repeat(flat[:, None], 3, axis=1)
    )
    # Each side weighs a right angle at a corner, however it is cut.
    smooth = corner_normals(CUBE, CUBE_TRIANGLES, 91)
    np.testing.assert_allclose(smooth, ((2 * CUBE - 1) / 3**0.5)[CUBE_TRIANGLES], atol=1e-4)


def test_only_what_is_near_the_own_normal_counts() -> None:
    """Three strips, each 30° from the next: the outer two are beyond the crease of each other."""
    turn = np.radians([0, 30, 60])
    across = np.cumsum(np.stack([np.cos(turn), np.sin(turn)], 1), axis=0)
    across = np.concatenate([[[0, 0]], across])
    points = np.array([[x, y, z] for x, z in across for y in (0.0, 1.0)])
    triangles = np.array(
        [
            t
            for k in range(3)
            for t in ([2 * k, 2 * k + 2, 2 * k + 1], [2 * k + 1, 2 * k + 2, 2 * k + 3])
        ]
    )
    actual = corner_normals(points, triangles, 40)
    first = np.degrees(np.arctan2(-actual[0, :, 0], actual[0, :, 2]))
    assert first[0] == 0
    assert 0 < first[1] < 30
    np.testing.assert_array_equal(actual, corner_normals(points, triangles, 40))
    np.testing.assert_array_equal(corner_normals(points, triangles, 29)[0], [[0, 0, 1]] * 3)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_size_and_place_change_nothing(scale: float) -> None:
    points, triangles = sphere(5)
    moved = corner_normals(points * scale + 1000 * scale, triangles)
    np.testing.assert_allclose(moved, corner_normals(points, triangles), atol=1e-9)


def test_flat_triangles_and_fans_are_no_trouble(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2.0, 0, 0]])
    actual = corner_normals(points, np.array([[0, 1, 2], [0, 3, 1], [3, 3, 3]]))
    np.testing.assert_array_equal(actual[:2], np.broadcast_to([0, 0, 1.0], (2, 3, 3)))
    np.testing.assert_array_equal(actual[2], np.broadcast_to([0, 0, 1.0], (3, 3)))
    assert corner_normals(points, np.zeros((0, 3), np.int32)).shape == (0, 3, 3)
    count = normals.FAN + 1
    turn = 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(turn), np.sin(turn), -np.ones(count)], 1)
    cone = np.concatenate([rim, [[0, 0, 0]]])
    k = np.arange(count)
    tip = np.stack([np.full(count, count), k, (k + 1) % count], 1)
    actual = corner_normals(cone, tip)[:, 0]
    np.testing.assert_allclose(actual, np.broadcast_to([0, 0, 1.0], actual.shape), atol=1e-9)


def plain_corner_normals(points: np.ndarray, triangles: np.ndarray, crease: float) -> np.ndarray:
    """The readable equivalent of `corner_normals`."""
    triangle = np.asarray(triangles, dtype=np.int64)
    corners = points[triangle]
    edge = _units(np.roll(corners, -1, axis=1) - corners)
    normal = _units(np.cross(edge[:, 0], -edge[:, 2])).reshape(-1, 3)
    flat = np.asarray(~normal.any(axis=1))
    weight = _angles(-_dot(edge, np.roll(edge, 1, axis=1)))
    weight[flat] = 0
    out = np.zeros((len(triangle), 3, 3))
    order, start = corners_by_point(triangle, len(points))
    for p in range(len(points)):
        around = order[start[p] : start[p + 1]]
        around_triangle, side = np.divmod(around, 3)
        for t, k in zip(around_triangle, side, strict=True):
            near = np.asarray(_dot(normal[around_triangle], normal[t]) >= least_cosine(crease))
            if len(around_triangle) > FAN or flat[t]:
                near[:] = True
            near |= around_triangle == t
            total = np.zeros(3)
            for other, turn in zip(around_triangle[near], side[near], strict=True):
                total += weight[other, turn] * normal[other]
            unit = _units(total)
            fallback = normal[t] if not flat[t] else np.array([0.0, 0.0, 1.0])
            out[t, k] = unit if unit.any() else fallback
    return out


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def _units(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length one; zero vectors stay."""
    length = np.sqrt(_dot(vectors, vectors))[..., None]
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def _angles(cosine: np.ndarray) -> np.ndarray:
    x = np.minimum(np.abs(cosine), 1.0)
    a, b, c, d = ARCCOS
    angle = np.sqrt(1 - x) * (a + x * (b + x * (c + x * d)))
    return np.asarray(np.where(cosine < 0, math.pi - angle, angle))


@given(
    arrays(np.int64, (12, 3), elements=st.integers(-3, 3)),
    arrays(np.int32, (20, 3), elements=st.integers(0, 11)),
    st.sampled_from([0.0, 30.0, 40.0, 90.0, 135.0, 180.0]),
)
def test_the_kernel_is_the_plain_form(
    points: np.ndarray, triangles: np.ndarray, crease: float
) -> None:
    at = points + 0.25 * np.sin(np.arange(36).reshape(12, 3))
    plain = plain_corner_normals(at, triangles, crease)
    np.testing.assert_array_equal(corner_normals(at, triangles, crease), plain)
    np.testing.assert_allclose(np.linalg.norm(plain, axis=2), 1, rtol=1e-12)
