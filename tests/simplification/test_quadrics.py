"""The compiled arithmetic against its reference, and what the numbers mean."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats
from ptmtools.simplification.model import Mesh
from ptmtools.simplification.quadrics import (
    LINE_WEIGHT,
    PER_ATTRIBUTE,
    SIZE,
    add,
    attributes,
    optimal_position,
    shift,
    shift_wedge,
    value_at,
    vertex_quadrics,
    wedge_quadrics,
    wedge_value_at,
)
from ptmtools.simplification.surface import surface_of
from tests.simplification.shapes import cylinder, facade, sphere

SEEDS = st.integers(0, 2**32 - 1)


def _matrix(row: Floats) -> Floats:
    matrix = np.empty((3, 3))
    matrix[np.triu_indices(3)] = row[:6]
    matrix.T[np.triu_indices(3)] = row[:6]
    return matrix


def value(quadric: Floats, d: Floats) -> float:
    """The value of a vertex's row for a displacement."""
    return float(d @ _matrix(quadric) @ d + 2 * quadric[6:9] @ d + quadric[9])


def shifted(quadric: Floats, d: Floats) -> Floats:
    """The row relative to a vertex moved by ``d``."""
    moved = quadric.copy()
    moved[6:9] = quadric[6:9] + _matrix(quadric) @ d
    moved[9] = value(quadric, d)
    return moved


def attribute_value(quadric: Floats, d: Floats, s: Floats) -> float:
    """The value of a wedge's row for displacements of the vertex and of its attributes."""
    result = value(quadric, d)
    for k, step in enumerate(s):
        g, r, w = np.split(quadric[10 + PER_ATTRIBUTE * k :][:PER_ATTRIBUTE], [3, 4])
        result += float(step * step * w[0] - 2 * step * (g @ d + r[0]))
    return result


def attribute_shifted(quadric: Floats, d: Floats, s: Floats) -> Floats:
    """A wedge's row relative to a vertex moved by ``d`` and attributes moved by ``s``."""
    moved = quadric.copy()
    moved[6:9] = quadric[6:9] + _matrix(quadric) @ d
    for k, step in enumerate(s):
        begin = 10 + PER_ATTRIBUTE * k
        moved[6:9] -= step * quadric[begin : begin + 3]
        moved[begin + 3] += quadric[begin : begin + 3] @ d - step * quadric[begin + 4]
    moved[9] = attribute_value(quadric, d, s)
    return moved


def planes(rng: np.random.Generator, count: int) -> Floats:
    """A quadric of planes, with more to it than one of a mesh has at first."""
    row = np.zeros(SIZE)
    for normal, away, weight in zip(
        rng.normal(size=(count, 3)), rng.normal(size=count), rng.random(count), strict=True
    ):
        outer = np.outer(normal, normal)
        row[:6] += weight * outer[np.triu_indices(3)]
        row[6:9] += weight * away * normal
        row[9] += weight * away**2
        row[10] += weight
    return row


def painted(rng: np.random.Generator, count: int, m: int) -> Floats:
    """A quadric of so many faces with m attributes."""
    row = np.zeros(10 + 5 * m)
    for _ in range(count):
        for k in range(m):
            g, r, w = rng.normal(size=3), rng.normal(), rng.random()
            row[:6] += w * np.outer(g, g)[np.triu_indices(3)]
            row[6:9] += w * r * g
            row[9] += w * r * r
            row[10 + 5 * k : 15 + 5 * k] += [*(w * g), w * r, w]
    return row


@given(SEEDS)
def test_kernels_equal_the_reference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = np.stack([planes(rng, 4), planes(rng, 2)])
    d = rng.normal(size=3)
    assert value_at(rows, 0, *d) == pytest.approx(value(rows[0], d))
    expected = shifted(rows[0], d)
    shift(rows, 0, *d)
    assert rows[0] == pytest.approx(expected)
    add(rows, 1, 0)
    assert value_at(rows, 1, *d) > 0


@given(SEEDS, st.integers(1, 5))
def test_kernels_of_attributes_equal_the_reference(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    rows = painted(rng, 3, m)[None]
    attribute = rng.normal(size=(2, m))
    d, s = rng.normal(size=3), attribute[1] - attribute[0]
    expected = attribute_value(rows[0], d, s)
    assert expected >= 0
    assert wedge_value_at(rows, attribute, 0, 1, *d) == pytest.approx(expected)
    moved = attribute_shifted(rows[0], d, s)
    shift_wedge(rows, attribute, 0, 1, *d)
    assert rows[0] == pytest.approx(moved)


@given(SEEDS)
def test_a_shifted_quadric_says_the_same_of_every_place(seed: int) -> None:
    rng = np.random.default_rng(seed)
    row, d, there = planes(rng, 3), rng.normal(size=3), rng.normal(size=3)
    assert value(shifted(row, d), there - d) == pytest.approx(value(row, there))
    row, s, other = painted(rng, 3, 2), rng.normal(size=2), rng.normal(size=2)
    again = attribute_value(attribute_shifted(row, d, s), there - d, other - s)
    assert again == pytest.approx(attribute_value(row, there, other))


@given(SEEDS)
def test_nowhere_is_better_than_the_optimal_position(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = np.stack([planes(rng, 3), planes(rng, 3)])
    away, place = rng.normal(size=3), np.empty(3)
    actual = optimal_position(rows, 0, 1, *away, 1e-12, place)
    both = rows[0] + shifted(rows[1], -away)
    assert actual == pytest.approx(value(both, place), rel=1e-6, abs=1e-9)
    exact = np.linalg.lstsq(_matrix(both), -both[6:9], rcond=None)[0]
    assert actual <= value(both, exact) + 1e-6 * (1 + abs(both[9]))


def test_the_optimal_position_in_a_plane_is_the_middle() -> None:
    rows = np.zeros((2, SIZE))
    rows[:, 5] = rows[:, 10] = 1.0
    place = np.empty(3)
    assert optimal_position(rows, 0, 1, 2.0, 4.0, 0.0, 1e-3, place) == pytest.approx(0)
    assert place == pytest.approx([1, 2, 0])


def test_a_vertex_knows_the_distances_to_its_planes_by_area() -> None:
    surface = surface_of(sphere(5))
    quadric = vertex_quadrics(surface)
    rng = np.random.default_rng(1)
    for v in rng.integers(0, len(surface.point), 10):
        d = rng.normal(size=3)
        expected = 0.0
        for face in surface.triangle[(surface.triangle == v).any(axis=1)]:
            a, b, c = surface.point[face]
            normal = np.cross(b - a, c - a)
            size = np.linalg.norm(normal)
            expected += size / 2 * float(((surface.point[v] + d - a) @ normal / size) ** 2)
        assert value(quadric[v], d) == pytest.approx(expected)


def test_a_vertex_of_a_border_knows_its_distance_from_the_line() -> None:
    surface = surface_of(
        Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32))
    )
    quadric = vertex_quadrics(surface)
    corner = int(np.flatnonzero((surface.point == [-0.5, -0.5, 0]).all(axis=1))[0])
    # The two borders at the corner are one long, and it goes away from one of them.
    side = 1 / surface.scale
    assert value(quadric[corner], np.array([1.0, 0, 0])) == pytest.approx(LINE_WEIGHT * side**2)


def test_an_affine_texture_costs_nothing_and_a_shift_counts_as_distance() -> None:
    mesh = facade(1, 1, 4)
    surface = surface_of(mesh)
    attribute = attributes(mesh, surface)
    quadric = wedge_quadrics(mesh, surface, attribute)
    assert mesh.material is not None
    rng = np.random.default_rng(1)
    bricks = mesh.material[surface.source[surface.corner // 3]] == 0
    for wedge in rng.choice(np.flatnonzero(bricks), 5):
        d = np.append(rng.normal(size=2), 0.0)
        uv = d[:2] * surface.scale * [4, 8]
        assert attribute_value(quadric[wedge], d, uv) == pytest.approx(0, abs=1e-9)
        # Bricks are twice as many upwards: a distance is that of the mean of the squares.
        area = quadric[wedge, 14] * surface.scale**2 * (4**2 + 8**2) / 2
        shifted_by = np.array([0.5, 0.0])
        expected = area * 0.5**2 / ((4**2 + 8**2) / 2) / surface.scale**2
        actual = attribute_value(quadric[wedge], d, uv + shifted_by)
        assert actual == pytest.approx(expected)


def test_what_a_texture_wrapped_around_costs_is_its_bend_alone() -> None:
    mesh = cylinder(16, 4)
    surface = surface_of(mesh)
    attribute = attributes(mesh, surface)
    quadric = wedge_quadrics(mesh, surface, attribute)
    assert np.abs(quadric[:, 9]).max() == 0
    assert len(surface.corner) == 17 * 5
    assert len(surface.point) == 16 * 5
