"""Usable sample points: exact clearance, inside closed surfaces only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.coverage.kernels import distance
from ptmtools.coverage.solids import SampleObstacles, edge_groups, edges, solids

SPAN = st.floats(-4, 4).map(lambda x: round(x, 3))
POINT = st.tuples(SPAN, SPAN, SPAN)


def box(low, high):
    """Six outward quadrilaterals of a box."""
    (x, y, z), (X, Y, Z) = low, high
    return [
        [[x, y, z], [x, y, Z], [x, Y, Z], [x, Y, z]],
        [[X, y, z], [X, Y, z], [X, Y, Z], [X, y, Z]],
        [[x, y, z], [X, y, z], [X, y, Z], [x, y, Z]],
        [[x, Y, z], [x, Y, Z], [X, Y, Z], [X, Y, z]],
        [[x, y, z], [x, Y, z], [X, Y, z], [X, y, z]],
        [[x, y, Z], [X, y, Z], [X, Y, Z], [x, Y, Z]],
    ]


STATUE = box([1, 0.5, -1], [2, 2.5, 0])
INSIDE, OUTSIDE = np.array([1.4, 1.3, -0.45]), np.array([3.1, 1.3, 1.15])


def around(room_row, furnish, quads, sides=(0, 0)):
    scene, cells = room_row(1)
    return SampleObstacles.from_scene(*furnish(scene, cells, quads, [sides] * len(quads)))


def test_inside_a_statue(room_row, furnish):
    actual = around(room_row, furnish, STATUE)
    assert len(actual.solids) == 1
    assert actual.in_solid(np.atleast_2d(INSIDE))[0]
    assert not actual.in_solid(np.atleast_2d(OUTSIDE))[0]
    assert not actual.in_solid(np.atleast_2d(np.array([1.5, 2.6, -0.5])))[0]


@pytest.mark.parametrize("flip", [[0], [1, 4], [0, 1, 2]])
def test_winding_need_not_be_right(room_row, furnish, flip):
    quads = [q[::-1] if i in flip else q for i, q in enumerate(STATUE)]
    actual = around(room_row, furnish, quads)
    assert actual.in_solid(np.atleast_2d(INSIDE))[0]
    assert not actual.in_solid(np.atleast_2d(OUTSIDE))[0]


def test_a_shell_that_faces_inwards_is_a_room(room_row, furnish):
    assert around(room_row, furnish, [q[::-1] for q in STATUE]).solids == ()


def test_a_statue_may_stand_on_the_floor(room_row, furnish):
    """Its base then lies in the cell's boundary, which does not make it structure."""
    scene, cells = room_row(1)
    quads = box([1, 0, -1], [2, 2.5, 0])
    sides = [(0, -1) if i == 2 else (0, 0) for i in range(6)]
    assert SampleObstacles.from_scene(*furnish(scene, cells, quads, sides)).in_solid(INSIDE[None])[
        0
    ]


def test_structure_is_the_subdivisions_business(room_row, furnish):
    """The shell of the room itself, wound outwards: everybody is inside it."""
    scene, cells = room_row(1)
    turned = replace(scene, triangles=scene.triangles[:, ::-1])
    assert solids(turned, cells) == []
    # The same shell, none of it in a boundary, is taken for a solid block.
    loose = replace(cells, triangle_cell=np.zeros_like(cells.triangle_cell))
    assert len(solids(turned, loose)) == 1
    # Visitors stand within it.
    assert SampleObstacles.from_scene(turned, loose).solids == ()


def test_a_block_that_fills_half_of_a_room_is_a_solid(room_row, furnish):
    """Half of the places in the room are inside."""
    _, cells = room_row(1)
    (x, _, z), (right, top, back) = cells.vertex.min(axis=0), cells.vertex.max(axis=0)
    block = box([x + 0.1, 0.1, z + 0.1], [x + 0.6 * (right - x), top - 0.1, back - 0.1])
    assert len(around(room_row, furnish, block).solids) == 1


def test_open_and_thin_things_have_no_inside(room_row, furnish):
    sheet = [STATUE[0]]
    no_lid = [q for i, q in enumerate(STATUE) if i != 3]
    twice = [STATUE[0], STATUE[0][::-1]]
    for quads in (sheet, no_lid, twice):
        actual = around(room_row, furnish, quads)
        for point in (INSIDE, OUTSIDE, np.array([1.001, 1.3, -0.45])):
            assert not actual.in_solid(np.atleast_2d(point))[0]


def test_a_body_within_a_body(room_row, furnish):
    actual = around(room_row, furnish, STATUE + box([1.2, 1, -0.8], [1.6, 1.5, -0.2]))
    assert len(actual.solids) == 2
    assert actual.in_solid(np.atleast_2d(INSIDE))[0]


def test_groups_hang_together_by_edges_not_by_corners():
    strip = np.array([[i, i + 1, i + 2] for i in range(200)])
    touching = np.array([[300, 301, 302], [302, 303, 304]])
    edge, _ = edges(np.concatenate([strip, touching]))
    group = edge_groups(edge)
    assert set(group[:200]) == {0}
    assert group[200:].tolist() == [200, 201]


@settings(deadline=None)
@given(a=POINT, b=POINT, c=POINT)
def test_distance_to_a_triangle(a, b, c):
    """Against the least distance to a dense set of points of it, slivers and points included."""
    corners = np.array([a, b, c])
    actual = distance(np.zeros(3), corners)
    n = 60
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
    u, v = (g[i + j <= n] / n for g in (i, j))
    dense = (
        corners[0] + u[:, None] * (corners[1] - corners[0]) + v[:, None] * (corners[2] - corners[0])
    )
    nearest = np.linalg.norm(dense, axis=1).min()
    spacing = np.ptp(corners, axis=0).sum() / n
    assert nearest - spacing - 1e-9 <= actual <= nearest + 1e-9


def test_clearance_stops_looking_when_it_is_enough(room_row, furnish):
    actual = around(room_row, furnish, STATUE)
    points = np.array([[2.25, 1.3, -0.5], [2.0, 1.3, -0.5], [0.5, 2.0, 0.25]])
    assert actual.clearance(points, 1.0) == pytest.approx([0.25, 0, 0.5])
    assert actual.clearance(points, 0.1).tolist() == [0.1, 0, 0.1]


def test_clearance_is_that_of_all_triangles(room_row, furnish):
    """Points in any order, against every triangle."""
    actual = around(room_row, furnish, STATUE)
    points = np.random.default_rng(0).uniform([-0.2, -0.2, -2.2], [4.2, 4.2, 2.2], (300, 3))
    nearest = [min(distance(p, corners) for corners in actual.corners) for p in points]
    assert actual.clearance(points, 0.3) == pytest.approx(np.minimum(nearest, 0.3))
