"""Choices of levels, against trying everything, and item buffers against plain geometry."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.arrays import Floats, Ints
from ptmtools.site.choice import next_fetch, no_previews
from ptmtools_lab.allocation import allocate, holes, picture
from tests.lab.worlds import SEEDS, any_world

Case = tuple[Floats, Ints, Ints, int]


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Worth and cost (T, K), last columns (T,), a budget; some levels are worth nothing."""
    random = np.random.default_rng(draw(SEEDS))
    textures, levels = int(random.integers(1, 5)), int(random.integers(1, 5))
    worth = random.integers(0, 50, (textures, levels + 1)).astype(np.float64)
    worth *= random.random(worth.shape) < 0.8
    cost = np.cumsum(random.integers(1, 40, worth.shape), axis=1)
    cost -= cost[:, :1]
    last = random.integers(0, levels + 1, textures)
    return worth, cost, last, draw(st.integers(0, int(cost[:, -1].sum()) + 5))


def chosen(case: Case, *, exact: bool) -> tuple[Ints, int]:
    worth, cost, last, budget = case
    column = np.full(len(last), 99)
    return column, allocate(worth, cost, last, budget, column, exact)


def value(worth: Floats, column: Ints) -> float:
    return float(sum(row[1 : k + 1].sum() for row, k in zip(worth, column, strict=True)))


def spent(cost: Ints, column: Ints) -> int:
    return int(cost[np.arange(len(column)), column].sum())


def best(case: Case) -> float:
    """Of all that fit."""
    worth, cost, last, budget = case
    every = (np.array(columns) for columns in product(*(range(n + 1) for n in last.tolist())))
    return max(value(worth, column) for column in every if spent(cost, column) <= budget)


@given(cases())
def test_what_is_chosen_fits_and_is_worth_most_but_for_a_step(case: Case) -> None:
    worth, cost, last, budget = case
    column, used = chosen(case, exact=False)
    exchanged, used_then = chosen(case, exact=True)
    for columns, bytes_ in ((column, used), (exchanged, used_then)):
        assert ((columns >= 0) & (columns <= last)).all()
        assert bytes_ == spent(cost, columns) <= budget
    assert value(worth, column) <= value(worth, exchanged) <= best(case)
    # A greedy choice misses less than what the first step that did not fit is worth.
    steps = max(value(worth[t : t + 1], last[t : t + 1]) for t in range(len(last)))
    assert value(worth, column) >= best(case) - steps


@given(cases())
def test_more_memory_is_worth_no_less(case: Case) -> None:
    worth, cost, last, most = case
    values = []
    for budget in range(0, most + 1, max(1, most // 25)):
        column, _ = chosen((worth, cost, last, budget), exact=False)
        values.append(value(worth, column))
    assert (np.diff(values) >= 0).all()


@given(cases(), st.integers(1, 30))
def test_of_levels_that_cost_the_same_and_add_less_and_less_the_best(case: Case, each: int) -> None:
    worth, cost, last, budget = case
    worth[:, 1:] = -np.sort(-worth[:, 1:], axis=1)
    cost[:] = each * np.arange(cost.shape[1])
    for exact in (False, True):
        column, _ = chosen((worth, cost, last, budget), exact=exact)
        assert value(worth, column) == best((worth, cost, last, budget))


@given(cases(), SEEDS, st.integers(0, 50))
def test_the_next_bytes(case: Case, seed: int, overhead: int) -> None:
    """The texture and column of the greatest worth per byte that is still to be asked for."""
    worth, ends, last, _ = case
    asked = np.random.default_rng(seed).integers(0, ends[:, -1] + 1)
    options = {}
    for t in range(len(last)):
        whole = max(k for k in range(ends.shape[1]) if ends[t, k] <= asked[t])
        for k in range(whole + 1, int(last[t]) + 1):
            gain = float(worth[t, whole + 1 : k + 1].sum())
            if gain > 0:
                options[t, k] = gain / float(ends[t, k] - asked[t] + overhead)
    free, none = np.zeros(len(last), np.bool_), np.zeros(0, np.bool_)
    stored = np.full(len(last), ends.shape[1] - 1)
    density, texture, column = next_fetch(
        worth, ends, stored, asked, free, last, no_previews(len(last)), none, overhead
    )
    if not options:
        assert (density, texture, column) == (0.0, -1, 0)
    else:
        assert density == pytest.approx(max(options.values()), rel=1e-12)
        assert options[texture, column] == pytest.approx(density, rel=1e-12)


@settings(max_examples=50)
@given(SEEDS)
def test_placeholders_are_the_far_faces_of_boxes(seed: int) -> None:
    """By the faces of each box that a ray pierces, one by one."""
    random = np.random.default_rng(seed)
    cells, pixels = int(random.integers(1, 6)), 20
    low = random.uniform(-5, 5, (cells, 3))
    high = low + random.uniform(0.5, 6, (cells, 3))
    eye = random.uniform(-6, 6, 3)
    ray = random.normal(size=(pixels, 3))
    ray[0] = [0.0, 1.0, 0.0]
    there = random.random(cells) < 0.5
    owner = random.integers(-1, cells, pixels).astype(np.int32)
    depth = random.uniform(0.1, 8, pixels).astype(np.float32)
    missing = np.flatnonzero(~there)
    expected = np.zeros(cells)
    for i in range(pixels):
        far = {int(c): _far_face(eye, ray[i], low[c], high[c]) for c in missing}
        cell, distance = min(far.items(), key=lambda item: item[1], default=(-1, np.inf))
        hidden = owner[i] >= 0 and there[owner[i]] and depth[i] <= distance
        if distance < np.inf and not hidden:
            expected[cell] += 1 / pixels
    share = np.zeros(cells)
    holes(ray, owner, depth, eye, low, high, there, missing, share)
    assert share == pytest.approx(expected)


def _far_face(eye: Floats, ray: Floats, low: Floats, high: Floats) -> float:
    """How far along a ray the last face of a box is that it pierces; infinity if there is none."""
    pierced = []
    for axis in range(3):
        for plane in (low[axis], high[axis]):
            if ray[axis]:
                far = (plane - eye[axis]) / ray[axis]
                point = np.delete(eye + far * ray, axis)
                inside = (np.delete(low, axis) <= point) & (point <= np.delete(high, axis))
                if far >= 0 and inside.all():
                    pierced.append(float(far))
    return max(pierced, default=np.inf)


@settings(max_examples=30)
@given(SEEDS, st.booleans())
def test_the_picture_of_a_frame(seed: int, colored: bool) -> None:
    """Row by row: what is resident is wrong by its column's error, what is missing by all of it, or
    by all but its mean colour, if that is known."""
    world = any_world(seed, frames=4)
    random = np.random.default_rng(seed)
    stock, views = world.catalogue, world.views
    there = random.random(stock.cell_count) < 0.7
    column = random.integers(0, stock.levels + 1)
    for frame in range(world.frames):
        rows = views.rows(frame)
        shown, drawn = np.zeros(stock.ends.shape, np.bool_), np.zeros(stock.cell_count, np.bool_)
        actual = picture(
            rows.start, rows.stop, views.cell, views.texture, views.error, views.square,
            views.need, there, column, np.arange(len(column)), column, colored, shown, drawn,
        )  # fmt: skip
        sums, levels, seen = np.zeros(2), np.zeros(2), np.zeros_like(shown)
        for r in range(rows.start, rows.stop):
            t, known = int(views.texture[r]), bool(there[views.cell[r]])
            if known and t < 0:
                continue
            held = int(column[t]) if known else 0
            at = held + 1 if known and (held or colored) else 0
            sums += [float(views.error[r, at]), float(views.square[r, at])]
            if t >= 0:
                levels += [float(views.need[r, held:].sum()), float(views.need[r].sum())]
                seen[t, 1 : held + 1] |= views.need[r, :held] > 0
        assert actual == pytest.approx((*sums, levels[0] / levels[1] if levels[1] else 0.0))
        assert (shown == seen).all()
        on_screen = np.isin(np.arange(stock.cell_count), views.cell[rows])
        assert (drawn == (on_screen & there)).all()
