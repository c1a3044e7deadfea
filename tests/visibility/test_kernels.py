"""The compiled geometry against plain numpy and shapely."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

from ptmtools.portal_flow import (
    clipping_kernels as clipping,
    flow_kernels,
    flow_kernels as prepass,
    line_kernels as bits,
)
from ptmtools.portal_flow.flow import GROWTH, Portals, geometry, scratch
from ptmtools.portal_flow.storage import Polygons

SLACK = 1e-12
Z = np.array([[0.0, 0, 1]])
RANDOM = st.builds(np.random.default_rng, st.integers(0, 2**32 - 1))


def convex_polygon(rng, n):
    """(n, 2) counter-clockwise, on an ellipse."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, n))
    return np.column_stack([np.cos(angle) * rng.uniform(0.2, 3), np.sin(angle)])


def slots(*polygons, spare=1):
    width = max(len(p) for p in polygons) + GROWTH
    polygon = np.zeros((len(polygons) + spare, width, 3))
    for i, p in enumerate(polygons):
        polygon[i, : len(p), : p.shape[1]] = p
    size = np.array([len(p) for p in polygons] + [0] * spare)
    return Polygons(polygon, size, np.zeros((1, 2 * width, 4)), np.zeros(width), SLACK)


@given(rng=RANDOM, n=st.integers(3, 9), c=st.floats(-2, 2))
@settings(deadline=None)
def test_clip_is_the_half_plane_intersection(rng, n, c):
    points = convex_polygon(rng, n)
    angle = rng.uniform(0, 2 * np.pi)
    normal = np.array([np.cos(angle), np.sin(angle)])
    at = slots(points)
    status = clipping.clip(at, 0, (*normal, 0.0, -c))
    along = np.array([-normal[1], normal[0]])
    half = np.array([-1, 1, 1, -1])[:, None] * 50 * along + np.array([0, 0, 1, 1])[:, None] * (
        50 * normal
    )
    expected = shapely.Polygon(points).intersection(shapely.Polygon(half + c * normal)).area
    kept = 0.0 if status <= clipping.EMPTY else shapely.Polygon(at.vertex[0, : at.size[0], :2]).area
    assert kept == pytest.approx(expected, abs=1e-9)
    assert (status == clipping.WHOLE) == bool((points @ normal >= c - SLACK).all())


def test_clip_drops_what_only_touches_and_keeps_a_sliver():
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    # At 1 + 15 slacks and more it is empty; up to there a near tie.
    for at, status in (
        (1 + 16 * SLACK, clipping.EMPTY),
        (1 + 14 * SLACK, clipping.NEAR_TIE),
        (1.0, clipping.NEAR_TIE),
        (1 - 1e-9, clipping.CUT),
        (0.0, clipping.WHOLE),
    ):
        assert clipping.clip(slots(square), 0, (1.0, 0.0, 0.0, -at)) == status


def test_clip_never_overruns_a_slot():
    # A comb, far from convex: 20 teeth make 40 crossings, more than the slot has room for.
    teeth = np.array([[i * 0.5, i % 2] for i in range(41)] + [[20, -1], [0, -1]], float)
    at = slots(teeth)
    at = at._replace(vertex=np.ascontiguousarray(at.vertex[:, : len(teeth) + 1]))
    before = at.vertex[0].copy()
    assert clipping.clip(at, 0, (0.0, 1.0, 0.0, -0.5)) == clipping.WHOLE
    assert np.array_equal(at.vertex[0], before)


def brute_force_separators(a, b):
    """Every plane through an edge of one polygon and a vertex of the other that has a on its
    one side and b on the other."""
    actual = []
    for p, q, sign in ((a, b, 1.0), (b, a, -1.0)):
        for i in range(len(p)):
            for v in q:
                n = np.cross(p[(i + 1) % len(p)] - p[i], v - p[i])
                if np.linalg.norm(n) < 1e-9:
                    continue
                n /= np.linalg.norm(n)
                for m in (n, -n):
                    if (a @ m).max() <= (b @ m).min() + 1e-9:
                        actual.append(np.append(m, -(b @ m).min() if sign > 0 else -(a @ m).max()))
    return np.array(actual).reshape(-1, 4)


@given(rng=RANDOM, na=st.integers(3, 6), nb=st.integers(3, 6))
@settings(deadline=None)
def test_separators_are_those_of_brute_force(rng, na, nb):
    flat = [np.column_stack([convex_polygon(rng, n), np.zeros(n)]) for n in (na, nb)]
    tilt = rng.uniform(-0.4, 0.4)
    turn = np.array([[np.cos(tilt), 0, -np.sin(tilt)], [0, 1, 0], [np.sin(tilt), 0, np.cos(tilt)]])
    a, b = flat[0], flat[1] @ turn + [rng.uniform(-2, 2), rng.uniform(-2, 2), 3.0]
    at = slots(a, b)
    normal = np.array([Z[0], Z[0] @ turn])
    count = clipping.separate(at, normal, 0, 0, 1, 3, 0)
    ours, theirs = at.plane[0, :count], brute_force_separators(a, b)
    assert count > 0
    for one, other in ((ours, theirs), (theirs, ours)):
        for m in one:
            assert np.abs(other - m).max(axis=1).min() < 1e-6


@given(rng=RANDOM)
@settings(deadline=None)
def test_no_line_through_both_polygons_leaves_the_separators(rng):
    a = np.column_stack([convex_polygon(rng, 5), np.zeros(5)])
    b = np.column_stack([convex_polygon(rng, 4) + rng.uniform(-1, 1, 2), np.full(4, 0.7)])
    at = slots(a, b)
    normal = np.concatenate([Z, Z])
    count = clipping.separate(at, normal, 0, 0, 1, 3, 0)
    p = rng.dirichlet(np.ones(5), 200) @ a
    q = rng.dirichlet(np.ones(4), 200) @ b
    beyond = p + rng.uniform(1, 20, (200, 1)) * (q - p)
    assert (beyond @ at.plane[0, :count, :3].T + at.plane[0, :count, 3] >= -1e-9).all()


def test_lowest_set_bit_of_every_word():
    for i in range(64):
        low = (1 << i) * 0x03F79D71B4CB0A89 % 2**64 >> 58
        assert bits.LOW_BIT[low] == i


def two_portals(first, second, leaves, normals):
    point = np.concatenate([first, second]).astype(float)
    start = np.cumsum([0, len(first), len(second)])
    return geometry(Portals(4, np.array(leaves, np.int32), np.array(normals, float), point, start))


SQUARE = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]])
NONE = np.zeros(0, np.uint64)


@pytest.mark.parametrize("reverse", [False, True])
def test_ahead(reverse):
    step = -1 if reverse else 1
    turned = (SQUARE[::step] + [1, 0, 0]) if reverse else SQUARE + [1, 0, 0]
    g = two_portals(SQUARE, turned, [[0, 1], [1, 2]], [[1, 0, 0], [1, 0, 0]])
    # Along +x: first, then second; back: second, then first. Never otherwise, never itself.
    expected = np.zeros((4, 4), bool)
    expected[0, 2] = expected[3, 1] = True
    assert np.array_equal([[prepass.ahead(g, p, q) for q in range(4)] for p in range(4)], expected)


def test_ahead_in_one_plane_and_touching():
    side = two_portals(SQUARE, SQUARE + [0, 1, 0], [[0, 1], [2, 3]], [[1, 0, 0], [1, 0, 0]])
    assert not any(prepass.ahead(side, p, q) for p in range(4) for q in range(4))
    wall = SQUARE[:, [1, 0, 2]] + [0, 1, 0]  # in y = 1, x 0 … 1: shares an edge with the first
    g = two_portals(SQUARE, wall, [[0, 1], [1, 2]], [[1, 0, 0], [0, 1, 0]])
    assert prepass.ahead(g, 0, 2)
    assert not prepass.ahead(g, 1, 2)


def test_geometry_turns_polygons_counter_clockwise_about_their_normals():
    for points in (SQUARE, SQUARE[::-1]):
        for n in (1.0, -1.0):
            g = two_portals(
                points, points + [3, 0, 0], [[0, 1], [1, 2]], [[n, 0, 0], [2 * n, 0, 0]]
            )
            p = g.point[:4]
            assert np.cross(p[1] - p[0], p[2] - p[1]) @ [n, 0, 0] > 0
            assert np.allclose(g.normal, [n, 0, 0])
            assert np.allclose(g.low, [-1.5 * n, 1.5 * n])
            assert (np.linalg.norm(p - g.ball[0, :3], axis=1) <= g.ball[0, 3]).all()


def test_a_chain_longer_than_the_scratch_is_accepted_whole(room_row):
    cells = room_row(12)[1]
    g = geometry(
        Portals(
            12, cells.portal_leaf, cells.portal_plane[:, :3], cells.portal_point, cells.portal_start
        )
    )
    known = np.zeros((22, 1), np.uint64)
    for p in range(22):  # everything further along in the same direction
        bits = range(p + 2, 22, 2) if p % 2 == 0 else range(p - 2, 0, -2)
        known[p, 0] = sum(1 << q for q in bits)
    whole = scratch(g, 1)
    polygons = whole.polygons
    few = polygons._replace(vertex=polygons.vertex[-9:], plane=polygons.plane[:4])
    short = whole._replace(might=whole.might[:3], polygons=few)
    for storage, expected_cut in ((whole, False), (short, True)):
        seen = np.zeros(1, np.uint64)
        _, cut, *_ = flow_kernels.flow(g, storage, known, 0, 10**6, NONE, False, seen)
        assert cut == expected_cut
        assert seen[0] == known[0, 0]


def test_a_glance_sees_a_straight_corridor_and_nothing_behind_a_corner(room_row, build_rooms):
    for cells, last in (
        (room_row(5)[1], 6),
        (build_rooms(np.arange(5) * 4.0, [0.0, 3.0], [0.0, 4.0], {
            (0, 0, 0, 0): [(0.0, 2.0, 0.0, 1.0)],
            (1, 0, 0, 0): [(0.0, 2.0, 3.0, 4.0)],
            (2, 0, 0, 0): [(0.0, 2.0, 0.0, 1.0)],
        }).cells, 2),
    ):  # fmt: skip
        g = geometry(
            Portals(
                cells.leaf_count,
                cells.portal_leaf,
                cells.portal_plane[:, :3],
                cells.portal_point,
                cells.portal_start,
            )
        )
        n = len(g.leaf)
        known = np.full((n, 1), (1 << n) - 1, np.uint64)
        known[0, 0] ^= np.uint64(1)
        seen = np.zeros(1, np.uint64)
        assert flow_kernels.glance(g, known, 0, seen, np.zeros((2, 3))) > 0
        assert seen[0] == sum(1 << q for q in range(2, last + 1, 2))


@given(RANDOM)
def test_transposing_bits(rng):
    rows = rng.integers(0, 2**64, 64, dtype=np.uint64)
    before, after = (
        np.unpackbits(square.view(np.uint8).reshape(64, 8), axis=1, bitorder="little")
        for square in (rows, turned(rows))
    )
    assert np.array_equal(after, before.T)


def turned(rows):
    square = rows.copy()
    bits.transpose(square)
    return square


@pytest.mark.parametrize("count", [2, 64, 70, 200])
def test_sight_is_returned(count):
    rng = np.random.default_rng(count)
    sees = rng.random((count, count)) < 0.7
    words = (count + 63) // 64
    rows = np.zeros((count, words * 64), bool)
    rows[:, :count] = sees
    known = np.packbits(rows, axis=1, bitorder="little").view(np.uint64).reshape(count, words)
    bits.return_sight(known, 0, words)
    back = np.arange(count) ^ 1
    expected = sees & sees[back][:, back].T
    actual = np.unpackbits(known.view(np.uint8), axis=1, count=count, bitorder="little")
    assert np.array_equal(actual.astype(bool), expected)
    # A bit that goes later takes its way back with it.
    p, q = np.argwhere(expected)[0]
    dropped = np.zeros(words, np.uint64)
    dropped[q >> 6] = np.uint64(1) << np.uint64(q & 63)
    bits.drop_unreturned(known, p, dropped)
    expected[q ^ 1, p ^ 1] = False
    actual = np.unpackbits(known.view(np.uint8), axis=1, count=count, bitorder="little")
    assert np.array_equal(actual.astype(bool), expected)
