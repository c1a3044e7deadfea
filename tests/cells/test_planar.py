"""Polygons in a plane that no architect draws: nothing raises, and what is undecided is safe."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from ptmtools.cells import planar, subdivision
from ptmtools.cells.diagnostics import undecided_notes
from ptmtools.cells.planar import (
    buffer,
    build_areas,
    counting,
    delaunay,
    difference,
    intersection,
    open_part,
    straighten,
    triangulate_polygons,
    triangulate_rings,
    union,
    unite,
    unite_rows,
)
from ptmtools.cells.space import DividedSpace, divide
from ptmtools.cells.subdivision import subdivide
from ptmtools.tolerance import Tolerance

Outline = Callable[[np.random.Generator], shapely.Geometry]


def ring(random: np.random.Generator, corners: int = 9) -> np.ndarray:
    """(corners, 2) of a simple polygon around 0."""
    angle = np.sort(random.uniform(0, 2 * np.pi, corners))
    return random.uniform(0.5, 5, (corners, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])


def simple(random: np.random.Generator) -> shapely.Geometry:
    return shapely.Polygon(ring(random))


def spiked(random: np.random.Generator) -> shapely.Geometry:
    """Goes out and comes back on the same line, or beside it by rounding."""
    outline = ring(random)
    k = random.integers(1, len(outline))
    tip = outline[k] * random.uniform(1, 3)
    back = outline[k] + random.choice([0, 1e-16, 1e-12]) * random.normal(size=2)
    return shapely.Polygon(np.insert(outline, k + 1, [tip, back], axis=0))


def crossing_itself(random: np.random.Generator) -> shapely.Geometry:
    return shapely.Polygon(random.permutation(ring(random, int(random.integers(4, 12)))))


def repeated(random: np.random.Generator) -> shapely.Geometry:
    return shapely.Polygon(np.repeat(ring(random), random.integers(1, 4, 9), axis=0))


def touching_itself(random: np.random.Generator) -> shapely.Geometry:
    outline = np.round(ring(random, 12))
    outline[random.integers(12)] = outline[random.integers(12)]
    return shapely.Polygon(outline)


def with_holes(random: np.random.Generator) -> shapely.Geometry:
    """Holes that touch the outline or one another, overlap, or lie outside."""
    outline = ring(random)
    holes = [np.round(ring(random, 5) / random.integers(1, 6)) for _ in range(3)]
    holes[0][0] = outline[0]
    holes[1][:2] = outline[[3, 4]]
    holes[2][0] = (outline[6] + outline[7]) / 2
    return shapely.Polygon(outline, holes[: random.integers(1, 4)])


def comb(random: np.random.Generator) -> shapely.Geometry:
    """Teeth whose sides are apart by rounding, and turned."""
    x = np.repeat(np.arange(8.0), 2) + np.tile([0, 10.0 ** random.uniform(-17, -6)], 8)
    y = np.tile([0, 4, 4, 0], 4) + random.normal(0, 10.0 ** random.uniform(-17, -9), 16)
    outline = np.vstack([np.column_stack([x, y]), [[7, -1], [0, -1]]])
    angle = random.uniform(0, 7)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return shapely.Polygon(outline @ turn)


def flat(random: np.random.Generator) -> shapely.Geometry:
    return shapely.Polygon(ring(random) * [1, random.choice([0, 1e-18, 1e-13, 1e-9])])


def coarse(random: np.random.Generator) -> shapely.Geometry:
    return shapely.Polygon(ring(random, 20).astype(np.float16).astype(np.float64))


HOSTILE: list[Outline] = [
    simple, spiked, crossing_itself, repeated, touching_itself, with_holes, comb, flat, coarse,
]  # fmt: skip


def hostile(seed: int, count: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.array([HOSTILE[i](random) for i in random.integers(len(HOSTILE), size=count)])


def moved(shapes: np.ndarray, scale: float, far: float) -> np.ndarray:
    return shapely.transform(shapes, lambda points: (points + far) * scale)


@pytest.mark.parametrize(
    ("scale", "far"),
    [
        (1, 0),
        (1e-9, 0),
        (1e9, 0),
        (1e-60, 0),
        (1e60, 0),
        (1e-150, 0),
        (1e150, 0),
        (1, 1e3),
        (1, 1e5),
        (1e-3, 1e12),
    ],
)
def test_hostile_outlines_by_the_thousand(scale: float, far: float) -> None:
    count = 150
    shapes = moved(hostile(int(np.log10(scale) + far) % 1000 + 1, 2 * count), scale, far)
    one, other = shapes[:count], shapes[count:]
    tolerance = Tolerance.for_extent(10 * scale)
    grid = tolerance.grid
    with counting() as undecided:
        shared, rest = intersection(one, other, grid), difference(one, other, grid)
        both = [union(np.array(pair), grid) for pair in zip(one, other, strict=True)]
        union(one, grid)
        unite_rows(np.arange(count) // 3, np.asarray(shapely.make_valid(one)), grid)
        opening = open_part(one, other, tolerance)
        for distance in (scale, -0.1 * scale):
            buffer(one, distance, join_style="mitre")
        delaunay(one)
        triangulate_polygons(shapely.make_valid(one))
        straighten(one, grid)
    if 1e-100 < scale < 1e100:  # beyond, GEOS cannot tell left from right
        assert undecided.total() - undecided["triangles"] < count / 100
    for result in (shared, rest, np.array(both), opening):
        empty = shapely.is_empty(result)
        assert np.isin(shapely.get_type_id(result[~empty]), [3, 6]).all()  # (multi)polygons
    if far or not 1e-50 < scale < 1e50:  # areas have few digits, or none
        return
    area = shapely.area
    sound = shapely.is_valid(one) & shapely.is_valid(other)
    rounding = 1e-9 * scale**2
    assert np.abs(area(shared) + area(rest) - area(one))[sound].max() <= rounding
    missing = area(one) + area(other) - area(shared) - area(both)
    assert np.abs(missing[sound]).max() <= rounding


@pytest.mark.parametrize("far", [0.0, 1e4, 1e9])
def test_hostile_triangles_by_the_thousand(far: float) -> None:
    random = np.random.default_rng(7)
    for _ in range(25):
        size = int(random.integers(1, 60))
        triangles = random.uniform(-5, 5, (size, 3, 2))
        triangles = np.concatenate([triangles, np.round(triangles), triangles[:, [0, 1, 1]]])
        triangles = np.concatenate([triangles, triangles[::-1, ::-1]]) + far
        noise = 10.0 ** random.uniform(-17, -3)
        triangles += random.normal(0, noise, triangles.shape)
        with counting() as undecided:
            united = unite(triangles, Tolerance.for_extent(10).grid)
        assert not undecided
        assert united.area <= 110
        assert united.is_valid


def test_hostile_outlines_of_segments_and_rings() -> None:
    random = np.random.default_rng(3)
    for _ in range(300):
        corner = np.round(random.uniform(0, 4, (24, 2)), int(random.integers(0, 3)))
        segments = np.stack([corner, np.roll(corner, -1, axis=0)], axis=1)
        areas = build_areas(segments, np.repeat(np.arange(3), 8))
        assert len(areas) == 3
        triangle, of = triangulate_polygons(areas)
        corners = {tuple(point) for point in shapely.get_coordinates(areas).tolist()}
        assert all(tuple(point) in corners for point in triangle.reshape(-1, 2).tolist())
        assert np.all(np.diff(of) >= 0)
        row, _ = triangulate_rings(corner, np.arange(0, 25, 4), np.array([0, 1, 1, 2, 2, 3]))
        assert row.max(initial=0) < len(corner)


def test_what_is_decided_on_a_coarser_grid_is_not_counted() -> None:
    # The grid is finer than the last digit of the coordinates.
    one, other = shapely.box(1e9, 0, 1e9 + 2, 2), shapely.box(1e9 + 1, 1 / 3, 1e9 + 3, 1)
    with counting() as undecided:
        assert intersection(one, other, 1e-13).area == pytest.approx(2 / 3, abs=1e-5)
        assert difference(one, other, 1e-13).area == pytest.approx(4 - 2 / 3, abs=1e-5)
    assert not undecided


@pytest.fixture
def giving_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """GEOS gives up on everything."""

    def give_up(*_: object, **__: object) -> None:
        raise shapely.GEOSException("TopologyException: unable to assign free hole to a shell")

    give_up.__name__ = "gives_up"
    for name in (
        "union", "union_all", "intersection", "difference", "buffer", "build_area",
        "make_valid", "simplify", "set_precision", "constrained_delaunay_triangles",
    ):  # fmt: skip
        give = lambda *_, **__: give_up()  # noqa: E731
        give.__name__ = name
        monkeypatch.setattr(planar.shapely, name, give)


@pytest.mark.usefixtures("giving_up")
def test_what_cannot_be_decided_errs_to_the_safe_side_and_is_counted() -> None:
    low, high = shapely.box(0, 0, 2, 2), shapely.box(1, 1, 4, 4)
    grid = 1e-12
    both = np.array([low, high])
    with counting() as undecided:
        # A wall is smaller, and an opening larger.
        assert planar._union(both, grid, False).equals(high)
        assert planar._union(both, grid, True).equals(shapely.box(0, 0, 4, 4))
        assert difference(low, high, grid).equals(low)
        assert intersection(low, high, grid).is_empty
        assert intersection(low, high, grid, more=True).equals(shapely.box(1, 1, 2, 2))
        assert buffer(low, 1.0).equals(low)
        assert buffer(low, 1.0, more=True).equals(shapely.box(-1, -1, 3, 3))
        assert buffer(low, -1.0, more=True).equals(low)
        # Row by row.
        assert [one.area for one in difference(both, low, grid)] == [4, 9]
        assert len(triangulate_polygons(both)[0]) == 0
        assert build_areas(np.zeros((1, 2, 2)), np.zeros(1, np.int64))[0].is_empty
        square = np.array([[0, 0], [2, 0], [2, 2], [0, 2.0]])
        assert len(triangulate_rings(square, np.array([0, 4]), np.array([0]))[0]) == 0
        assert straighten(low, grid).equals(low)
        assert unite(np.array([[[0, 0], [2, 0], [0, 2.0]]]), grid).area == 2
    assert undecided == {
        "union": 2, "difference": 3, "intersection": 2, "buffer": 3, "triangles": 4,
    }  # fmt: skip
    flat, rest = undecided_notes(undecided)
    assert flat.startswith("4 flat surfaces could not be divided")
    assert "(3 buffers, 3 differences, 2 intersections, 2 unions)" in rest
    assert undecided_notes({}) == []


def test_counts_of_a_context_inside_are_its_own() -> None:
    with counting() as outer:
        with counting() as inner:
            planar.count(["union"])
        planar.count(inner)
        planar.count({"difference": 2})
    assert (inner, outer) == ({"union": 1}, {"union": 1, "difference": 2})
    planar.count(["union"])  # counted nowhere
    assert outer["union"] == 1


def test_a_build_says_what_was_undecided(room_row, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = room_row(2)[0]
    assert not any("polygons in a plane" in note for note in subdivide(scene).notes)

    def at_odds(*arguments: Any) -> DividedSpace:
        return replace(divide(*arguments), undecided=Counter(union=1))

    monkeypatch.setattr(subdivision, "divide", at_odds)
    assert any("polygons in a plane (1 union)" in note for note in subdivide(scene).notes)
