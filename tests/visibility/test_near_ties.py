"""Near ties: sequences of portals in double-double arithmetic, and what the flow makes of them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.cells.sight import portals_of
from ptmtools.parallel import Local
from ptmtools.portal_flow import (
    double_double,
    double_double as near_ties,
    double_double_kernels as kernels,
    flow as searching,
)
from ptmtools.portal_flow.double_double import SequenceTest
from ptmtools.portal_flow.flow import Portals, geometry, portal_flow
from ptmtools.tolerance import Tolerance
from ptmtools.visibility import compute_pvs

#: What edges of doors are moved by: nothing, noise, a little more, what doubles would notice.
SHIFTS = (0.0, 0.0, 3e-15, -3e-15, 4e-14, -4e-14, 1e-12, -1e-12, 1e-9, -1e-9)
NUMBERS = st.floats(-4, 4, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-100)


ROW = (np.arange(5) * 4.0, [0.0, 3.0], [0.0, 4.0])
# All lines through the first two doors pass the third wall at z >= 2; the third ends at `top`.
FIRST_TWO = {(0, 0, 0, 0): [(0.0, 2.0, 0.0, 1.0)], (1, 0, 0, 0): [(0.0, 2.0, 1.5, 4.0)]}


def three_doors(build_rooms, top):
    return build_rooms(*ROW, {**FIRST_TWO, (2, 0, 0, 0): [(0.0, 2.0, 0.0, top)]}).cells


def along_a_line(seed: int, count: int, miss: float | None = None) -> SequenceTest:
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
    return SequenceTest(geometry(portals))


def lined_up(
    seed: int,
    count: int,
    scale: float = 1.0,
    turned: bool = False,
    shifts: tuple[float, ...] = SHIFTS,
) -> Portals:
    """Doors, one behind the other, with edges on planes that all touch two lines or one, but for
    some of the ``shifts``."""
    rng = np.random.default_rng(seed)
    slope, height = rng.uniform(-0.3, 0.3, 2)
    points = []
    for i in range(count):
        x = 2.0 * i + rng.choice([0.0, rng.uniform(0, 1)])
        edge = np.array([slope * x + rng.choice(shifts), height * x + rng.choice(shifts)])
        # The line passes the door's corner or a side, or runs through the middle.
        low = edge - rng.choice([0.0, 0.0, 0.5, 1.0], 2)
        points.append([(x, low[0], low[1]), (x, low[0] + 1, low[1]),
                       (x, low[0] + 1, low[1] + 1), (x, low[0], low[1] + 1)])  # fmt: skip
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if turned else np.eye(3)
    turn *= np.linalg.det(turn)
    leaf = np.column_stack([np.arange(count), np.arange(1, count + 1)]).astype(np.int32)
    normal = np.tile(np.eye(3)[0], (count, 1)) @ turn
    point = scale * (np.concatenate(points) @ turn)
    return Portals(count + 1, leaf, normal, point, 4 * np.arange(count + 1))


def fraction(number: complex) -> Fraction:
    return Fraction(number.real) + Fraction(number.imag)


@given(a=NUMBERS, b=NUMBERS, c=NUMBERS, d=NUMBERS)
@settings(deadline=None)
def test_arithmetic_is_as_precise_as_it_says(a, b, c, d):
    assert fraction(kernels.two_sum(a, b)) == Fraction(a) + Fraction(b)
    assert fraction(kernels.two_product(a, b)) == Fraction(a) * Fraction(b)
    x, y = kernels.two_sum(a, b * 2.0**-53), kernels.two_sum(c, d * 2.0**-53)
    p, q = fraction(x), fraction(y)
    least = Fraction(2) ** -800  # products of low parts may underflow
    assert abs(fraction(kernels.add(x, y)) - (p + q)) <= (abs(p) + abs(q)) / 2**104
    assert abs(fraction(kernels.less(x, y)) - (p - q)) <= (abs(p) + abs(q)) / 2**104
    assert abs(fraction(kernels.times(x, y)) - p * q) <= abs(p * q) / 2**102 + least
    if q != 0 and abs(p) < abs(q) * 2**200:
        assert abs(fraction(kernels.divide(x, y)) - p / q) <= abs(p / q) / 2**100 + least
    assert kernels.greater(x, y) == (p > q)


def test_the_bounds_of_errors_fit_each_other():
    """What the proof in `double_double_kernels` takes for granted."""
    k = kernels
    most = (k.CUTS + 1) * k.ERROR  # of a vertex; 1 for its coordinates
    assert most <= k.WRONG
    assert k.SLACK / 2 >= 4 * k.WRONG  # two polygons, both as wrong, both measured
    assert k.SLACK > 4 * k.WRONG
    assert k.ROUGHLY > 2.0**-40  # in doubles
    # What is lost by polygons too large, over levers of a thousand, is no more than noise.
    assert Tolerance.for_extent(0.5).noise > 1e6 * k.SLACK


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 9))
@settings(max_examples=40, deadline=None)
def test_a_line_passes_what_it_passes(seed, count):
    portals = along_a_line(seed, count)
    there = tuple(2 * k for k in range(count))
    assert portals.passes(there)
    assert portals.passes(tuple(q ^ 1 for q in reversed(there)))
    assert portals.passes((*there[:1], *there[1::2]))  # with portals between left out


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
    assert SequenceTest(g).passes((0, 2, 4)) == open_
    assert SequenceTest(g).passes((5, 3, 1)) == open_


def test_sequences_nearly_in_line_are_open_and_closed():
    """Doors with edges on one line, some moved by as much as noise or a little more."""
    answers = []
    for seed in range(120):
        test = SequenceTest(geometry(lined_up(seed, 5, turned=seed % 2 == 1)))
        answers.append(test.passes((0, 2, 4, 6, 8)))
    assert 20 < sum(answers) < 100


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_decisions_do_not_depend_on_the_unit(scale):
    """As often as the noise of coordinates does not decide, which multiplying them changes."""
    same = [
        SequenceTest(geometry(lined_up(seed, 4))).passes((0, 2, 4, 6))
        == SequenceTest(geometry(lined_up(seed, 4, scale))).passes((0, 2, 4, 6))
        for seed in range(60)
    ]
    assert sum(same) >= 58


def test_without_room_for_vertices_polygons_stay_too_large(monkeypatch):
    """What cannot be cut is left uncut: nothing that passes is lost."""
    monkeypatch.setattr(double_double, "GROWTH", 0)
    for seed in range(20):
        assert along_a_line(seed, 9).passes(tuple(range(0, 18, 2)))


def test_a_hairline_is_seen_and_a_touch_is_not(build_rooms):
    touching = compute_pvs(three_doors(build_rooms, 2.0))
    assert touching.decided.sum() > 0
    assert touching.opened.sum() == 0
    assert not touching.to_matrix()[0, 3]
    hairline = compute_pvs(three_doors(build_rooms, 2.0 + 1e-11))
    assert hairline.opened.sum() > 0
    assert hairline.to_matrix()[0, 3]
    assert np.array_equal(hairline.to_matrix(), hairline.to_matrix().T)


@pytest.mark.parametrize(
    ("module", "limit", "most"), [(near_ties, "DECIDED", 0), (searching, "NEAR_TIE_WORDS", 2)]
)
def test_too_many_to_decide_or_to_note_count_as_seen(build_rooms, monkeypatch, module, limit, most):
    monkeypatch.setattr(module, limit, most)
    pvs = compute_pvs(three_doors(build_rooms, 2.0))
    assert pvs.to_matrix()[0, 3]
    assert pvs.fallbacks > 0
    assert pvs.decided.sum() == 0


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


def test_a_repeated_search_is_bounded(build_rooms):
    portals = portals_of(raster(build_rooms, 8, 1e-12))
    for budget in (5, 10, 20):
        flow = portal_flow(portals, budget)
        assert flow.cut.any()
        assert np.all(flow.work <= 2 * (near_ties.COSTLIEST + 1) * (budget + 100))


def test_answers_do_not_depend_on_the_number_of_workers(build_rooms):
    portals = portals_of(raster(build_rooms, 6, 1e-12))
    one = portal_flow(portals, 200_000)
    with Local(3) as local:
        three = portal_flow(portals, 200_000, executor=local)
    assert one.decided.sum() > 10
    assert one.opened.sum() > 0
    for name in ("sees", "cut", "work", "ties", "decided", "opened"):
        assert np.array_equal(getattr(one, name), getattr(three, name))
