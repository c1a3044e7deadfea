"""Sampling, Morton codes, and the division of samples into an octree."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays

from ptmtools.arrays import Floats, areas
from ptmtools_systems.apo.octree import (
    ENOUGH,
    MARGIN,
    Bounds,
    OctreeLevel,
    Samples,
    average_levels,
    codes_of,
    cube_around,
    divide,
    join_levels,
    prune,
)
from ptmtools_systems.apo.sampling import interpolate, spacing_for, spread

shares = st.floats(0, 1, exclude_max=True, width=32)


def test_samples_are_as_far_apart_as_asked() -> None:
    rng = np.random.default_rng(4)
    corner = rng.random((300, 3, 3))
    points = spread(corner, 0.02)
    actual = np.bincount(points.triangle, minlength=len(corner)) * 0.02**2
    large = areas(corner) > 0.05
    np.testing.assert_allclose(actual[large], areas(corner)[large], rtol=0.15)
    assert points.weight.min() > 0
    np.testing.assert_allclose(points.weight.sum(axis=1), 1)
    assert (np.diff(points.triangle) >= 0).all()
    middle = np.array(
        [interpolate(corner, points)[points.triangle == k].mean(axis=0) for k in range(300)]
    )
    np.testing.assert_allclose(middle[large], corner[large].mean(axis=1), atol=0.01)


def test_a_thin_triangle_has_samples_along_its_length_and_none_too_many() -> None:
    corner = np.array([[[0, 0, 0], [0.5, 1e-3, 0], [1, 0, 0]]], dtype=float)
    points = spread(corner, 0.02)
    x = np.sort(interpolate(corner, points)[:, 0])
    assert len(x) == 25  # of 50 in a row half as long, half way up
    assert np.diff(x).max() < 0.03


@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.sampled_from([1.0, 1e-2, 1e-4, 1e-9]))
def test_samples_are_about_as_many_as_asked(seed: int, faces: int, thin: float) -> None:
    """Of needles, too: by their area they would have thousands in a row."""
    random = np.random.default_rng(seed)
    corner = random.random((faces, 3, 3)) * [1, thin, thin]
    count = 8 * faces
    spacing = spacing_for(corner, count)
    actual = len(spread(corner, spacing).triangle)
    assert faces <= actual <= 3 * count
    by_area = np.sqrt(areas(corner).sum() / count)
    assert spacing >= by_area * (1 - 1e-9)
    if thin == 1 and faces >= 30:  # of a few random triangles, all may be needles
        assert spacing == pytest.approx(by_area)
    assert spacing_for(corner * 0, count) == 0


@pytest.mark.parametrize(
    "corner", [np.zeros((1, 3, 3)), np.array([[[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]])]
)
def test_a_triangle_without_area_has_a_sample_too(corner: Floats) -> None:
    points = spread(corner, 0.1)
    assert len(points.triangle) >= 1
    assert np.isfinite(interpolate(corner, points)).all()


def plain_code(q: Floats, depth: int) -> int:
    code, low, side = 0, np.zeros(3), 1.0
    for _ in range(depth):
        side /= 2
        upper = q >= low + side
        low = low + side * upper
        code = code * 8 + int(upper @ [1, 2, 4])
    return code


@given(st.tuples(shares, shares, shares), st.integers(0, 20))
def test_codes(q: tuple[float, ...], depth: int) -> None:
    assert int(codes_of(np.array([q]), depth)[0]) == plain_code(np.array(q), depth)


@pytest.mark.parametrize("place", [0.0, 1e6, -3e-7])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_cube_holds_its_points_also_in_single_precision(place: float, scale: float) -> None:
    points = np.random.default_rng(1).random((50, 3)) * [1, 3, 2] * scale + place * scale
    cube = cube_around(points)
    q = ((points - cube.low) / cube.side).astype(np.float32)
    assert (q >= 0).all()
    assert (q < 1).all()
    assert np.ptp(q, axis=0).max() > 1 - 2 * MARGIN
    assert (cube.coordinates(points + 2 * cube.side) < 1).all()


# Division, against the words of the docs on one node after the other.


def plain(samples: Samples, depth: int, prefix: int, bounds: Bounds, bottom: int) -> Any:
    """(normal, {child: node}) of a node, or None where there is no sample."""
    here = samples.code >> np.uint64(3 * (bottom - depth)) == np.uint64(prefix)
    if not here.any():
        return None
    value, n = samples.value[here], int(samples.count[here].sum())
    mean = value.sum(axis=0) / n
    unit = mean[:3] / np.linalg.norm(mean[:3]) if mean[:3].any() else np.array([0.0, 1, 0])
    # All are unit vectors: the mean of |v - m|² is 1 + |m|² - 2 m · mean of v.
    off = 2 - 2 * float(unit @ mean[:3]) > bounds.error**2
    if len(mean) > 3:
        spread = samples.square[here].sum() / n - float(mean[3:] @ mean[3:])
        off = off or spread > bounds.color_error**2
    opposed = np.linalg.norm(mean[:3]) < 0.5 and n > 1
    if not off or depth == bottom or (n < ENOUGH and not opposed):
        return unit, {}
    below = {c: plain(samples, depth + 1, 8 * prefix + c, bounds, bottom) for c in range(8)}
    below = {c: node for c, node in below.items() if node}
    mean = sum(node[0] for node in below.values())
    return (mean / np.linalg.norm(mean) if np.any(mean) else unit), below


def nested(levels: list[OctreeLevel], depth: int = 0, prefix: int = 0) -> Any:
    level = levels[depth]
    k = int(np.searchsorted(level.code, np.uint64(prefix)))
    below = [c for c in range(8) if level.children[k] >> c & 1]
    return level.value[k, :3], {c: nested(levels, depth + 1, 8 * prefix + c) for c in below}


def alike(found: Any, expected: Any) -> None:
    np.testing.assert_allclose(found[0], expected[0], atol=1e-5)
    assert list(found[1]) == list(expected[1])
    for c, node in expected[1].items():
        alike(found[1][c], node)


def made(codes: Any, normals: Floats, colors: Floats | None = None) -> Samples:
    order = np.argsort(codes, kind="stable")
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    value = unit if colors is None else np.concatenate([unit, colors], axis=1)
    square = (value[:, 3:] ** 2).sum(axis=1)
    count = np.ones(len(order), np.int64)
    return Samples(np.sort(codes).astype(np.uint64), count, value[order], square[order])


@settings(max_examples=60)
@given(
    arrays.arrays(np.int64, st.integers(1, 80), elements=st.integers(0, 8**3 - 1)),
    st.integers(0, 2**32),
    st.floats(0, 1),
    st.booleans(),
)
def test_division(codes: Any, seed: int, error: float, colored: bool) -> None:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(len(codes), 3)) + [0, 2, 0]
    colors = rng.random((len(codes), 3)) if colored else None
    bounds = Bounds(error, 0.3, 3)
    samples = made(codes, normals, colors)
    levels = average_levels(divide(samples, 0, 3, bounds))
    alike(nested(levels), plain(samples, 0, 0, bounds, 3))


def test_normals_that_cancel_out_have_a_direction_all_the_same() -> None:
    normals = np.tile([[1.0, 0, 0], [-1, 0, 0]], (8, 1))
    levels = average_levels(divide(made(np.zeros(16, int), normals), 0, 2, Bounds(0.1, 1, 2)))
    assert [len(level.code) for level in levels] == [1, 1, 1]
    for level in levels:
        np.testing.assert_allclose(np.linalg.norm(level.value, axis=1), 1)


def test_few_samples_are_not_divided_and_alike_ones_neither() -> None:
    rng = np.random.default_rng(2)
    few = made(np.arange(ENOUGH - 1), rng.normal(size=(ENOUGH - 1, 3)) + [0, 4, 0])
    assert len(divide(few, 0, 1, Bounds(0.01, 1, 1))) == 1
    sides = made(np.array([0, 7]), np.array([[0, 1.0, 0], [0, -1, 0]]))
    assert len(divide(sides, 0, 1, Bounds(0.01, 1, 1))) == 2
    alike = made(np.arange(8), np.tile([0.0, 0, 1], (8, 1)))
    assert len(divide(alike, 0, 1, Bounds(0.01, 1, 1))) == 1


def test_parts_make_the_whole() -> None:
    """Blocks that begin at level 1, cut to what the levels above leave, give the same octree."""
    rng = np.random.default_rng(3)
    samples = made(rng.integers(0, 8**4, 3000), rng.normal(size=(3000, 3)))
    bounds = Bounds(0.3, 1, 4)
    whole = divide(samples, 0, 4, bounds)
    cut = int(np.searchsorted(samples.code, np.uint64(3 * 8**3)))
    parts = [
        divide(Samples(*(field[rows] for field in vars(samples).values())), 1, 4, bounds)
        for rows in (slice(0, cut), slice(cut, None))
    ]
    below = join_levels([prune(part, whole[1].code) for part in parts], 3)
    for actual, expected in zip(below, whole[1:], strict=True):
        assert np.array_equal(actual.code, expected.code)
        assert np.array_equal(actual.children, expected.children)
    none = prune(parts[0], np.zeros(0, np.uint64))
    assert not any(len(level.code) for level in none)
