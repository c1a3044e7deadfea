"""The hull is exact: closed, convex in integers, and made of the input's extreme points."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.errors import DatabaseError
from ptmtools.output.convexity import convex_hull


def side(a, b, c, p) -> int:
    """Sign of the determinant in rational arithmetic."""
    o, *rest = ([Fraction(float(x)) for x in q] for q in (a, b, c, p))
    u, v, w = ([x - y for x, y in zip(q, o, strict=True)] for q in rest)
    det = (
        (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
    )
    return (det > 0) - (det < 0)


def check(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    hull, faces = convex_hull(points)
    assert {tuple(p) for p in hull.tolist()} <= {tuple(p) for p in points.tolist()}
    edges = [(int(f[i]), int(f[(i + 1) % 3])) for f in faces for i in range(3)]
    assert len(set(edges)) == len(edges)
    assert all((b, a) in set(edges) for a, b in edges)
    assert len(faces) == 2 * len(hull) - 4
    for a, b, c in faces:
        assert all(side(hull[a], hull[b], hull[c], p) <= 0 for p in points)
        assert any(side(hull[a], hull[b], hull[c], p) < 0 for p in points)
    return hull, faces


def test_a_box_of_many_points_has_eight_corners() -> None:
    grid = np.array(list(product(range(4), repeat=3)), np.float32) * np.float32(0.1)
    hull, faces = check(grid)
    assert len(hull) == 8
    assert hull.tolist() == sorted(hull.tolist())
    assert faces.tolist() == sorted(faces.tolist())
    assert (faces.min(axis=1) == faces[:, 0]).all()


def test_a_tetrahedron_in_any_order() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    wanted = check(corners)
    for order in ([3, 2, 1, 0], [1, 3, 0, 2]):
        got = convex_hull(corners[order])
        np.testing.assert_array_equal(got[0], wanted[0])
        np.testing.assert_array_equal(got[1], wanted[1])


#: Small integers meet in planes and lines; floats far from the origin nearly do.
SOME = st.one_of(
    st.integers(-2, 2).map(float),
    st.sampled_from([1e6, 1e6 + 0.0625, 1e-30, 0.1, 0.3]),
)


@given(st.lists(st.tuples(SOME, SOME, SOME), min_size=4, max_size=10))
@settings(max_examples=50, deadline=None)
def test_any_points(points: list[tuple[float, float, float]]) -> None:
    array = np.array(points, np.float32)
    a = array[0]
    flat = all(side(a, b, c, p) == 0 for b in array for c in array for p in array)
    if flat:
        with pytest.raises(DatabaseError, match="PTM-D601"):
            convex_hull(array)
    else:
        check(array)


@pytest.mark.parametrize("seed", range(3))
def test_many_points(seed: int) -> None:
    """Of which most lie inside: in a ball, in a thin slab, and in a slab far from the origin."""
    random = np.random.default_rng(seed)
    ball = random.normal(0, 1, (70, 3))
    ball /= np.maximum(np.linalg.norm(ball, axis=1), 1)[:, None]
    points = [ball, ball * [9, 1e-6, 9], np.round(ball * 3) * [1, 0.0625, 1] + 1e6][seed]
    hull, _ = check(points.astype(np.float32))
    assert len(hull) < 70


def test_the_outermost_may_be_flat() -> None:
    """The outermost in every direction that is tried lie in a plane: all points are kept."""
    grid = np.array([(2 * i + 3 * j, -i, -j) for i in range(9) for j in range(9)], np.float32)
    bump = grid[40] + np.float32(0.0625) * np.array([1, 2, 3], np.float32)
    hull, _ = check(np.concatenate([grid, [bump]]))
    assert len(hull) == 5


def test_flat_points_are_refused() -> None:
    for flat in (
        np.zeros((5, 3)),
        np.array([[0, 0, 0], [1, 1, 1], [2, 2, 2], [3, 3, 3]]),
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [3, 4, 0]]),
    ):
        with pytest.raises(DatabaseError, match="PTM-D601"):
            convex_hull(flat.astype(np.float32))
