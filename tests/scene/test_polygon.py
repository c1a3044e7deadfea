"""Polygons become triangles of the same area, the same winding, and no overlap."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from ptmtools.scene import polygon
from ptmtools.scene.polygon import triangulate


def cut(*outlines: list[tuple[float, float]], lift: float = 0.0) -> list[np.ndarray]:
    """The triangles (k, 3, 2) of each outline, laid on a slanted plane and seen from its front."""
    flat = np.concatenate([np.array(o, dtype=float) for o in outlines])
    points = np.stack([flat[:, 0], flat[:, 1], lift * flat[:, 0]], axis=1)
    start = np.cumsum([0] + [len(o) for o in outlines])
    result = triangulate(points, start)
    return [flat[result.corner[result.polygon == i]] for i in range(len(outlines))]


def signed(ring: np.ndarray) -> float:
    x, y = ring[..., 0], ring[..., 1]
    return 0.5 * (x * np.roll(y, -1, -1) - y * np.roll(x, -1, -1)).sum(-1)


def check(outline: list[tuple[float, float]], triangles: np.ndarray) -> None:
    polygon = shapely.Polygon(outline)
    pieces = [shapely.Polygon(t) for t in triangles]
    area = signed(np.array(outline, dtype=float))
    assert (np.sign(area) * signed(triangles) >= -1e-12).all()
    assert signed(triangles).sum() == pytest.approx(area)
    assert shapely.unary_union(pieces).symmetric_difference(polygon).area < 1e-9


SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
ARROW = [(0, 0), (4, 0), (1, 1), (0, 4)]
ELL = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)]
COMB = [(0, 0), (7, 0), (7, 5), (6, 1), (5, 5), (4, 1), (3, 5), (2, 1), (1, 5)]
MIDPOINTS = [(0, 0), (2, 0), (4, 0), (4, 2), (4, 4), (2, 4), (0, 4), (0, 2)]
WINDOW = [(0, 0), (9, 0), (9, 9), (0, 9), (0, 0), (3, 3), (3, 6), (6, 6), (6, 3), (3, 3)]


@pytest.mark.parametrize("outline", [SQUARE, ARROW, ELL, COMB, MIDPOINTS, WINDOW])
@pytest.mark.parametrize("lift", [0.0, 3.0])
def test_outlines_from_every_corner_and_both_sides(outline: list, lift: float) -> None:
    turns = [outline[i:] + outline[:i] for i in range(len(outline))]
    if outline is WINDOW:  # a keyhole: the bridge is walked twice
        turns = [outline]
    turns += [turn[::-1] for turn in turns]
    for turn, triangles in zip(turns, cut(*turns, lift=lift), strict=True):
        check(turn, triangles)
        assert len(triangles) <= len(turn) - 2


@settings(deadline=None)
@given(
    radius=st.lists(st.floats(0.2, 5), min_size=5, max_size=24),
    scale=st.sampled_from([1.0, 1e-150, 1e150]),
)
def test_stars_of_any_size(radius: list[float], scale: float) -> None:
    angle = np.linspace(0, 2 * np.pi, len(radius), endpoint=False)
    star = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.array(radius)[:, None]
    result = triangulate(
        np.column_stack([star * scale, np.zeros(len(star))]), np.array([0, len(star)])
    )
    check([tuple(p) for p in star], star[result.corner])
    assert result.tangled == 0


def test_crossing_outlines_are_told_and_lines_leave_one_face() -> None:
    bow = [(0, 0), (4, 4), (4, 0), (0, 4), (-1, 2)]
    eight = [(0, 0), (4, 4), (4, 0), (0, 4)]
    line = [(0, 0), (1, 1), (2, 2), (3, 3), (4, 4)]
    points = np.array([(x, y, 0.0) for x, y in bow + eight + line])
    result = triangulate(points, np.array([0, 5, 9, 14]))
    assert result.tangled >= 1
    assert np.bincount(result.polygon).tolist()[2] == 1


@given(
    corners=hnp.arrays(
        float, (12, 3), elements=st.sampled_from([0.0, 1.0, -2.5, np.nan, np.inf, 1e308, 5e-324])
    ),
    sizes=st.sampled_from([[3, 4, 5], [12], [4, 4, 4], [6, 6]]),
)
def test_nothing_that_a_file_may_hold_breaks_it(corners: np.ndarray, sizes: list[int]) -> None:
    result = triangulate(corners, np.cumsum([0, *sizes]))
    assert set(result.polygon.tolist()) == set(range(len(sizes)))
    start = np.cumsum([0, *sizes])
    assert (result.corner >= start[result.polygon][:, None]).all()
    assert (result.corner < start[result.polygon + 1][:, None]).all()


def stars(corners: int, count: int = 1) -> tuple[np.ndarray, np.ndarray]:
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    reach = 1 + 0.5 * (np.arange(corners) % 2)
    star = np.stack([reach * np.cos(angle), reach * np.sin(angle), 0 * angle], axis=1)
    return np.tile(star, (count, 1)), np.arange(count + 1) * corners


def test_a_polygon_of_a_million_corners_becomes_a_fan() -> None:
    result = triangulate(*stars(1_000_000))
    assert result.tangled == 1
    assert len(result.corner) == 999_998
    assert (result.corner[:, 0] == 0).all()


def test_the_steps_of_clipping_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps are those of all outlines together; what they do not suffice for is a fan."""
    assert triangulate(*stars(100, 4)).tangled == 0
    steps = polygon._clip_ears(stars(100)[0], 1 << 60)[2]
    monkeypatch.setattr(polygon, "_CORNER_STEPS", 0)
    monkeypatch.setattr(polygon, "_BASE_STEPS", int(2.9 * steps))
    result = triangulate(*stars(100, 4))
    assert 1 <= result.tangled <= 2
    assert np.bincount(result.polygon).tolist() == [98] * 4
