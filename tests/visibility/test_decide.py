"""Decisions in numbers of twice the length of a double, against integers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ptmtools.tolerance import Tolerance
from ptmtools.visibility import exact
from ptmtools.visibility.decide import Decisions
from ptmtools.visibility.doubled import kernels
from ptmtools.visibility.exact import ExactPortals
from ptmtools.visibility.flow import Portals, geometry

#: What edges of doors are moved by: nothing, noise, a little more, what doubles would notice.
SHIFTS = (0.0, 0.0, 3e-15, -3e-15, 4e-14, -4e-14, 1e-12, -1e-12, 1e-9, -1e-9)
NUMBERS = st.floats(-4, 4, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-100)


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


def fraction(number: tuple[float, float]) -> Fraction:
    return Fraction(number[0]) + Fraction(number[1])


@given(a=NUMBERS, b=NUMBERS, c=NUMBERS, d=NUMBERS)
@settings(deadline=None)
def test_arithmetic_is_as_precise_as_it_says(a, b, c, d):
    assert fraction(kernels.two_sum(a, b)) == Fraction(a) + Fraction(b)
    assert fraction(kernels.two_product(a, b)) == Fraction(a) * Fraction(b)
    x, y = kernels.two_sum(a, b * 2.0**-53), kernels.two_sum(c, d * 2.0**-53)
    p, q = fraction(x), fraction(y)
    least = Fraction(2) ** -800  # products of low parts may underflow
    assert abs(fraction(kernels.added(x, y)) - (p + q)) <= (abs(p) + abs(q)) / 2**104
    assert abs(fraction(kernels.less(x, y)) - (p - q)) <= (abs(p) + abs(q)) / 2**104
    assert abs(fraction(kernels.times(x, y)) - p * q) <= abs(p * q) / 2**102 + least
    if q != 0 and abs(p) < abs(q) * 2**200:
        assert abs(fraction(kernels.over(x, y)) - p / q) <= abs(p / q) / 2**100 + least
    assert kernels.greater(x, y) == (p > q)


def test_the_bounds_of_errors_fit_each_other():
    """What the proof in `kernels` takes for granted."""
    k = kernels
    most = (k.CUTS + 1) * k.ERROR  # of a vertex; 1 for its coordinates
    assert most <= k.WRONG
    assert k.SLACK / 2 >= 4 * k.WRONG  # two polygons, both as wrong, both measured
    assert k.SLACK > 4 * k.WRONG
    assert k.FLAT * k.ROUGHLY >= 64 * k.WRONG
    assert k.ROUGHLY > 2.0**-40  # in doubles
    assert Tolerance.for_extent(0.5).noise > 1000 * k.FLAT  # else nothing would be certain


def without_rounding(portals: ExactPortals, way: tuple[int, ...]) -> bool | None:
    """Whether something is left; None if that takes too long numbers."""
    polygon, plane = portals._directed(way[0])
    left: exact._Left | None = exact._Left(polygon, [], [plane])
    for q in way[1:]:
        try:
            left = exact._beyond(left, *portals._directed(q))
        except exact._LengthError:
            return None
        if left is None:
            return False
    return True


def test_what_is_certain_of_long_sequences_is_true(monkeypatch):
    """Doors that leave about as much room as they are drawn in, against integers never rounded."""
    monkeypatch.setattr(exact, "BITS", 20_000)
    monkeypatch.setattr(exact, "LONGEST", 20_000)
    rng = np.random.default_rng(7)
    tried = {True: 0, False: 0}
    certain = 0
    for seed in range(60):
        count = int(rng.integers(15, 21))
        portals = lined_up(seed, count, turned=seed % 2 == 1, shifts=SHIFTS[:6])
        room = rng.uniform(0.55, 0.85) * Tolerance.for_points(portals.point).noise
        for k in range(count):
            door = portals.point[4 * k : 4 * k + 4]
            middle = door.mean(axis=0)
            door += (door - middle) * 2 * room
        g = geometry(portals)
        way = tuple(2 * k for k in range(count))
        expected = without_rounding(ExactPortals(g), way)
        if expected is None:
            continue
        decisions = Decisions(g)
        for k in range(count):
            decisions._load(k)
        row = np.array(way, np.int64)
        outside, inside = (
            kernels.left(decisions._portals, decisions._scratch, row, o) for o in (True, False)
        )
        assert outside != kernels.CLOSED or not expected
        assert inside != kernels.OPEN or expected
        tried[expected] += 1
        certain += outside == kernels.CLOSED or inside == kernels.OPEN
    assert min(tried.values()) >= 10
    assert certain >= 0.7 * sum(tried.values())


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 7), turned=st.booleans())
@settings(max_examples=150, deadline=None)
def test_what_is_certain_is_what_integers_find(seed, count, turned):
    g = geometry(lined_up(seed, count, turned=turned))
    there = tuple(2 * k for k in range(count))
    integers, decisions = ExactPortals(g), Decisions(g)
    for way in (there, tuple(q ^ 1 for q in reversed(there)), there[::2] if count > 2 else there):
        expected = integers.passes(way)
        assert decisions.passes(way) == expected
        row = np.array(way, np.int64)
        outside, inside = (
            kernels.left(decisions._portals, decisions._scratch, row, o) for o in (True, False)
        )
        assert outside != kernels.CLOSED or not expected
        assert inside != kernels.OPEN or expected


def test_nearly_all_is_certain_and_either_way():
    answers, integers = [], 0
    for seed in range(120):
        decisions = Decisions(geometry(lined_up(seed, 5, turned=seed % 2 == 1)))
        answers.append(decisions.passes((0, 2, 4, 6, 8)))
        integers += decisions.in_integers
    assert integers <= 3
    assert 20 < sum(answers) < 100


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_decisions_do_not_depend_on_the_unit(scale):
    """As often as the noise of coordinates does not decide, which multiplying them changes."""
    same = [
        Decisions(geometry(lined_up(seed, 4))).passes((0, 2, 4, 6))
        == Decisions(geometry(lined_up(seed, 4, scale))).passes((0, 2, 4, 6))
        for seed in range(60)
    ]
    assert sum(same) >= 58


def test_a_gap_as_wide_as_noise_is_none():
    """Two doors that overlap by less than they are drawn in, and by more, seen through a third."""
    for gap, expected in ((0.5, False), (8.0, True)):
        doors = np.array([(0.0, -1.0), (1.0, 0.0), (2.0, -1.0)])
        points = []
        for x, low in doors:
            points.append([(x, low, 0), (x, low + 1, 0), (x, low + 1, 1), (x, low, 1)])
        point = np.concatenate(points)
        point[4:8, 1] -= gap * Tolerance.for_points(point).noise
        leaf = np.array([[0, 1], [1, 2], [2, 3]], np.int32)
        portals = Portals(4, leaf, np.eye(3)[[0, 0, 0]], point, np.arange(4) * 4)
        decisions = Decisions(geometry(portals))
        assert decisions.passes((0, 2, 4)) == expected
        assert decisions.in_integers == 0


def test_without_room_for_vertices_integers_decide(monkeypatch):
    from ptmtools.visibility import decide

    monkeypatch.setattr(decide, "GROWTH", 0)
    g = geometry(lined_up(3, 6, turned=True))
    way = (0, 2, 4, 6, 8, 10)
    decisions = Decisions(g)
    assert decisions.passes(way) == ExactPortals(g).passes(way)
    assert decisions.in_integers == 1
