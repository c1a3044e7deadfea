"""Sequences of portals in exact arithmetic, and what the flow makes of the answers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ptmtools.executors import Local
from ptmtools.tolerance import Tolerance
from ptmtools.visibility import PvsOptions, compute_pvs, exact, hairs, searching
from ptmtools.visibility.exact import ExactPortals
from ptmtools.visibility.flow import Portals, geometry, portal_flow
from ptmtools.visibility.pvs import portals_of

ROW = (np.arange(5) * 4.0, [0.0, 3.0], [0.0, 4.0])
# All lines through the first two doors pass the third wall at z >= 2; the third ends at `top`.
FIRST_TWO = {(0, 0, 0, 0): [(0.0, 2.0, 0.0, 1.0)], (1, 0, 0, 0): [(0.0, 2.0, 1.5, 4.0)]}


def three_doors(build_rooms, top):
    return build_rooms(*ROW, {**FIRST_TWO, (2, 0, 0, 0): [(0.0, 2.0, 0.0, top)]}).cells


def along_a_line(seed: int, count: int, miss: float | None = None) -> ExactPortals:
    """Random convex portals around a random line, crossed in turn; the last one so many times its
    radius beside it."""
    rng = np.random.default_rng(seed)
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    points, normals = [], []
    for at in range(count):
        normal = axes[0] + 0.3 * rng.uniform(-1, 1, 3)  # within a right angle of the line
        normal /= np.linalg.norm(normal)
        u = np.cross(normal, axes[1])
        u /= np.linalg.norm(u)
        angle = np.sort(rng.uniform(0, 2 * np.pi / 5, 5) + 2 * np.pi / 5 * np.arange(5))
        radius = rng.uniform(0.05, 1)
        ring = radius * (np.outer(np.cos(angle), u) + np.outer(np.sin(angle), np.cross(normal, u)))
        shift = 0 if miss is None or at + 1 < count else miss * radius * np.cross(normal, u)
        points.append(4 * at * axes[0] + ring + shift)
        normals.append(normal)
    leaf = np.column_stack([np.arange(count), np.arange(1, count + 1)]).astype(np.int32)
    start = 5 * np.arange(count + 1)
    portals = Portals(count + 1, leaf, np.array(normals), np.concatenate(points), start)
    return ExactPortals(geometry(portals))


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 9))
@settings(max_examples=40, deadline=None)
def test_a_line_passes_what_it_passes(seed, count):
    portals = along_a_line(seed, count)
    there = tuple(2 * k for k in range(count))
    assert portals.passes(there)
    assert portals.passes(tuple(q ^ 1 for q in reversed(there)))
    assert portals.passes((*there[:1], *there[1::2]))  # with portals between left out


def test_rounded_vertices_lose_no_line(monkeypatch):
    """With few bits every cut is rounded, and still nothing that passes is lost."""
    monkeypatch.setattr(exact, "BITS", 64)
    monkeypatch.setattr(exact, "SHARE", 8)
    for seed in range(20):
        assert along_a_line(seed, 9).passes(tuple(range(0, 18, 2)))


def test_a_rounded_vertex_is_where_it_was_however_long_the_numbers_of_the_ends():
    """From (1, 2, 3) with short numbers to (5, 2, 3) with long ones, a third of the way."""
    long = 3**500
    inner, outer = (1, 2, 3, 1), (5 * long, 2 * long, 3 * long, long)
    for one, other, at in ((inner, outer, 1 + 4 / 3), (outer, inner, 5 - 4 / 3)):
        inward, outward = (one[3] << 2000, other[3] << 2001)  # distances times the numbers' length
        x, y, z, w = exact._between(one, other, inward, outward)
        assert max(x, y, z, w).bit_length() < 2 * exact.BITS
        assert abs(Fraction(x, w) - Fraction(at)) < Fraction(1, 2**50)
        assert (y, z) == (2 * w, 3 * w)


def test_what_takes_too_long_numbers_counts_as_open(monkeypatch):
    portals = along_a_line(1, 5, miss=3.0)
    assert not portals.passes((0, 2, 4, 6, 8))
    monkeypatch.setattr(exact, "LONGEST", 100)
    portals = along_a_line(1, 5, miss=3.0)
    assert portals.passes((0, 2, 4, 6, 8))
    monkeypatch.setattr(exact, "_beyond", None)  # and is not tried again, nor what begins with it
    assert portals.passes((0, 2, 4, 6, 8))
    assert portals.passes((0, 2, 4, 6, 8, 8))


def test_numbers_do_not_grow_without_bound():
    portals = along_a_line(3, 30)
    assert portals.passes(tuple(range(0, 60, 2)))
    left = portals._left[tuple(range(0, 60, 2))]
    longest = max(n.bit_length() for point in left.source for n in point)
    assert longest < exact.BITS + 30 * (exact.SHARE + 1)  # exactly, every cut makes it five times


def test_portals_in_the_wrong_order_or_far_aside_are_refuted():
    portals = along_a_line(1, 5)
    assert not portals.passes((4, 2))
    assert not portals.passes((0, 2, 1))
    small = along_a_line(1, 3, miss=1e6)
    assert not small.passes((0, 2, 4))


@pytest.mark.parametrize("beyond", [-1e-12, 0.0, 1e-15, 1e-12])
def test_what_is_more_than_noise_decides(beyond):
    """Below z = 0 at x = 0 and above 1/2 at 4, lines pass x = 8 above 1, where the third ends."""
    doors = [(0.0, -1.0, 0.0), (4.0, 0.5, 1.5), (8.0, 0.0, 1.0 + beyond)]
    points = [
        [(x, 0.0, low), (x, 1.0, low), (x, 1.0, high), (x, 0.0, high)] for x, low, high in doors
    ]
    leaf = np.array([[0, 1], [1, 2], [2, 3]], np.int32)
    portals = Portals(4, leaf, np.eye(3)[[0, 0, 0]], np.concatenate(points), np.arange(4) * 4)
    g = geometry(portals)
    open_ = beyond > 2 * Tolerance.for_points(g.point).noise
    assert open_ == (beyond == 1e-12)
    assert ExactPortals(g).passes((0, 2, 4)) == open_
    assert ExactPortals(g).passes((5, 3, 1)) == open_


def test_a_hairline_is_seen_in_exact_arithmetic(build_rooms):
    touching = compute_pvs(three_doors(build_rooms, 2.0))
    assert touching.decided.sum() > 0
    assert touching.opened.sum() == 0
    assert not touching.to_matrix()[0, 3]
    cells = three_doors(build_rooms, 2.0 + 1e-11)
    hairline, rounded = (compute_pvs(cells, PvsOptions(exact=e)) for e in (True, False))
    assert rounded.ties.sum() > 0
    assert rounded.decided.sum() == 0
    assert not rounded.to_matrix()[0, 3]
    assert hairline.opened.sum() > 0
    assert hairline.to_matrix()[0, 3]
    assert np.array_equal(hairline.to_matrix(), hairline.to_matrix().T)


def test_too_many_to_decide_count_as_seen(build_rooms, monkeypatch):
    monkeypatch.setattr(hairs, "DECIDED", 0)
    pvs = compute_pvs(three_doors(build_rooms, 2.0))
    assert pvs.to_matrix()[0, 3]
    assert pvs.fallbacks > 0
    assert pvs.decided.sum() == 0


def test_too_many_to_note_count_as_seen(build_rooms, monkeypatch):
    monkeypatch.setattr(searching, "HAIR", 2)
    pvs = compute_pvs(three_doors(build_rooms, 2.0 + 1e-11))
    assert pvs.to_matrix()[0, 3]
    assert pvs.fallbacks > 0


def raster(build_rooms, side, noise=0.0, transform=lambda p: p):
    """A floor of square rooms with a door to each neighbour, their edges on a coarse raster so that
    many line up, but for some ``noise``."""
    rng = np.random.default_rng(4)
    doors = {}
    for i, j in np.ndindex(side, side):
        for axis, far in ((0, i), (2, j)):
            at = rng.integers(0, 4) * 0.5 + rng.choice([-noise, 0, noise])
            if far + 1 < side:
                span = (at, at + 1)
                doors[i, 0, j, axis] = [(*span, 0.0, 2.0) if axis == 2 else (0.0, 2.0, *span)]
    grid = np.arange(side + 1) * 4.0
    return build_rooms(grid, [0.0, 3.0], grid, doors, transform).cells


def test_turning_a_building_opens_nothing(build_rooms):
    """Edges in one line are so no more when they are turned; that is noise, and stays closed."""
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    straight = compute_pvs(raster(build_rooms, 8))
    turned = compute_pvs(raster(build_rooms, 8, transform=lambda p: p @ turn.T + 0.3))
    assert turned.decided.sum() > 20
    assert turned.opened.sum() == 0
    assert np.array_equal(straight.cell, turned.cell)


def test_a_search_cut_short_stays_cut(build_rooms):
    portals = portals_of(raster(build_rooms, 8, 1e-12))
    for budget in (5, 10, 20):
        rounded, exactly = (portal_flow(portals, budget, exact=e) for e in (False, True))
        assert rounded.cut.any()
        # What earlier searches found differs, and with it what later ones take; but not by much.
        assert exactly.cut.sum() >= 0.9 * rounded.cut.sum()
        assert np.all(exactly.work <= 2 * (hairs.COSTLIEST + 1) * (budget + 100))


def test_exact_answers_do_not_depend_on_the_number_of_workers(build_rooms):
    portals = portals_of(raster(build_rooms, 6, 1e-12))
    one = portal_flow(portals, 200_000)
    with Local(3) as local:
        three = portal_flow(portals, 200_000, executor=local)
    assert one.decided.sum() > 10
    assert one.opened.sum() > 0
    for name in ("sees", "cut", "work", "ties", "decided", "opened"):
        assert np.array_equal(getattr(one, name), getattr(three, name))
