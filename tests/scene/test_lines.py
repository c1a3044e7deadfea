"""Sample lines, compared with each line tried against each triangle."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.scene.orientation.facing import SampleLines

from .buildings import box, divided, house, meadow, turned_in_plan, welded


def one_by_one(lines: SampleLines, triangles: np.ndarray, axis: int) -> list[tuple[int, int]]:
    """Pairs of line and triangle, by solving for the point in barycentric coordinates."""
    u, v = (k for k in range(3) if k != axis)
    rows_u, rows_v = lines.rows(u), lines.rows(v)
    actual = []
    for t, (a, b, c) in enumerate(triangles[:, :, [u, v]]):
        edges = np.stack([b - a, c - a], axis=1)
        if abs(np.linalg.det(edges)) == 0:
            continue
        for i, x in enumerate(rows_u):
            for j, y in enumerate(rows_v):
                p, q = np.linalg.solve(edges, np.array([x, y]) - a)
                if min(p, q, 1 - p - q) > 0:
                    actual.append((i * len(rows_v) + j, t))
    return sorted(actual)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_crossings(axis: int) -> None:
    random = np.random.default_rng(axis)
    points = random.normal(size=(24, 3))
    faces = random.permutation(np.repeat(np.arange(24), 2))[:45].reshape(15, 3)
    lines = SampleLines(points, faces)
    actual = lines.crossings(axis)
    pairs = list(zip(actual.line.tolist(), actual.triangle.tolist(), strict=True))
    assert sorted(pairs) == one_by_one(lines, points[faces], axis)
    assert len(pairs) > 200
    corner = points[faces[actual.triangle]]
    low, high = corner[:, :, axis].min(axis=1), corner[:, :, axis].max(axis=1)
    assert np.all((low <= actual.position) & (actual.position <= high))
    after, gap = actual.gaps()
    assert np.all(gap >= 0)
    assert np.all(actual.line[after] == actual.line[after + 1])
    assert len(after) == len(pairs) - len(np.unique(actual.line))


def test_areas_are_summed_up() -> None:
    """Of a meadow of 480 m well, and roughly of a house of 8 × 5 m in its middle, which is met."""
    points, faces = welded(meadow(box((0, 0, 0), (8, 5, 3))))
    actual = SampleLines(points, faces).crossings(2)
    ground = points[faces][actual.triangle][:, :, 2].max(axis=1) < 0
    assert actual.section[ground].sum() == pytest.approx(480**2, rel=0.05)
    assert 2 * 40 < actual.section[~ground].sum() < 0.01 * 480**2


def test_dividing_triangles_changes_nothing() -> None:
    whole = turned_in_plan(house(), 20)
    one, many = (SampleLines(*welded(each)).crossings(0) for each in (whole, divided(whole)))
    assert one.section.sum() == pytest.approx(many.section.sum(), rel=0.1)


def test_a_heap_of_large_triangles_is_met_by_fewer_lines() -> None:
    """Each triangle spans the model, and hardly any meets a line."""
    random = np.random.default_rng(0)
    ends = random.random((2, 40_000, 3)) * 0.05 + np.array([0.0, 0.95])[:, None, None]
    points = np.concatenate([*ends, ends[0] + 1e-4 * random.random((40_000, 3))])
    faces = np.arange(120_000).reshape(3, -1).T
    lines = SampleLines(points, faces)
    assert 1 <= max(len(lines.rows(axis)) for axis in range(3)) <= 12
    assert SampleLines(points, faces[:1000]).rows(0).size == 24


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_flat_and_tiny_models(axis: int) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    actual = SampleLines(points, faces).crossings(axis)
    assert (len(actual.line) > 0) == (axis == 2)
    assert len(SampleLines(points[:3] * 0, faces[:1]).crossings(axis).line) == 0
