"""Cutting convex polyhedra."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.cells.planes import Polyhedron, clip_polygon, cut, section

ROUNDING = 1e-9
UNIT = Polyhedron.box(np.zeros(3), np.ones(3))
number = st.floats(-1, 1, allow_nan=False, width=32)


def outward(body: Polyhedron) -> bool:
    centre = body.points.mean(axis=0)
    for loop in body.faces:
        p = body.points[loop]
        normal = sum(np.cross(p[i] - p[0], p[i + 1] - p[0]) for i in range(1, len(p) - 1))
        if normal @ (p[0] - centre) <= 0:
            return False
    return True


def test_box_volume_and_orientation() -> None:
    body = Polyhedron.box(np.array([1.0, 2, 3]), np.array([2.0, 4, 6]))
    assert body.volume == pytest.approx(6)
    assert outward(body)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(number, number, number, number), min_size=1, max_size=8))
def test_cuts_keep_volume_and_stay_closed(planes: list[tuple[float, ...]]) -> None:
    bodies = [UNIT]
    for tag, plane in enumerate(planes):
        normal = np.array(plane[:3])
        length = np.linalg.norm(normal)
        if length < 0.1:
            continue
        normal = normal / length
        p = np.append(normal, -normal @ np.full(3, 0.5) + 0.4 * plane[3])
        parts = [half for body in bodies for half in cut(body, p, tag, ROUNDING)]
        bodies = [part for part in parts if part is not None]
    assert sum(b.volume for b in bodies) == pytest.approx(1.0, abs=1e-6)
    for body in bodies:
        edges = [
            (int(a), int(b))
            for loop in body.faces
            for a, b in zip(loop, np.roll(loop, -1), strict=True)
        ]
        assert len(edges) == len(set(edges))
        assert {(b, a) for a, b in edges} == set(edges)
        if body.volume > 1e-6:
            assert outward(body)


def test_a_plane_through_vertices_makes_no_slivers() -> None:
    diagonal = np.array([1.0, 0, -1, 0]) / np.sqrt(2)
    front, back = cut(UNIT, diagonal, 7, ROUNDING)
    assert front is not None
    assert back is not None
    assert len(front.points) == len(back.points) == 6
    assert front.tags.count(7) == back.tags.count(7) == 1


def test_a_plane_beside_the_body_cuts_nothing() -> None:
    front, back = cut(UNIT, np.array([1.0, 0, 0, 0]), 0, ROUNDING)
    assert front is UNIT
    assert back is None
    assert len(section(UNIT, np.array([1.0, 0, 0, 0]), ROUNDING)) == 0


def test_section_and_polygon_clipping() -> None:
    square = section(UNIT, np.array([0.0, 1, 0, -0.25]), ROUNDING)
    assert len(square) == 4
    assert np.allclose(square[:, 1], 0.25)
    half = clip_polygon(square, np.array([1.0, 0, 0, -0.75]), ROUNDING)
    assert np.ptp(half[:, 0]) == pytest.approx(0.25)
    assert len(clip_polygon(square, np.array([1.0, 0, 0, -2]), ROUNDING)) == 0
    assert clip_polygon(square, np.array([1.0, 0, 0, 2]), ROUNDING) is square
