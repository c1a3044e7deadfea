"""The visitor's body: walls hold, steps are climbed, doors are open, and nothing else is."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from ptmtools.arrays import Floats
from tests.web import node

HERE = Path(__file__).resolve().parent
RADIUS, EYE, STEP = 0.25, 1.6, 0.5
#: What walls keep from the head of a visitor with a headset, m.
HEAD = 0.2
BERTH = 0.31
Quad = list[list[float]]
AHEAD = {"forward": 1}
RUN = {"forward": 1, "run": True}


@pytest.fixture(scope="module", autouse=True)
def engine(require: Callable[[str, str], None]) -> None:
    if remedy := node.missing():
        require("node", remedy)


def wall(x0: float, z0: float, x1: float, z1: float, low: float = 0, high: float = 3) -> Quad:
    """As thin as a sheet."""
    return [[x0, low, z0], [x1, low, z1], [x1, high, z1], [x0, high, z0]]


def level(
    x0: float, z0: float, x1: float, z1: float, y: float = 0, to: float | None = None
) -> Quad:
    """A floor, or a ceiling; a ramp along -z if it goes `to` another height at z0."""
    far = y if to is None else to
    return [[x0, far, z0], [x0, y, z1], [x1, y, z1], [x1, far, z0]]


def block(low: Sequence[float], high: Sequence[float]) -> list[Quad]:
    """Sides and top of an upright box."""
    (a, b, c), (d, e, f) = low, high
    edges = [(a, c, d, c), (d, c, d, f), (d, f, a, f), (a, f, a, c)]
    return [level(a, c, d, f, e), *(wall(*edge, b, e) for edge in edges)]


def cell(number: int, quads: list[Quad], box: Sequence[float], **more: Any) -> dict[str, Any]:
    return {"cell": number, "quads": quads, "box": list(box), "portals": [], **more}


def walked(folder: Path, *cases: dict[str, Any], script: str = "walk.mjs") -> list[Floats]:
    """The eyes of each case after each of its steps, (n, 3)."""
    plain = {"avatar": [RADIUS, EYE, STEP], "eye": [0, EYE, 0], "yaw": 0}
    file = folder / "cases.json"
    file.write_text(json.dumps([plain | case for case in cases]))
    return [np.array(path) for path in json.loads(node.run(HERE / script, file))]


def stepped(folder: Path, *cases: dict[str, Any]) -> list[Floats]:
    """The heads in the building of visitors with headsets, (n, 3)."""
    return walked(folder, *cases, script="heads.mjs")


def hall(quads: list[Quad], **case: Any) -> dict[str, Any]:
    """One cell of 20 m with a floor and what else there is; the visitor is in its middle."""
    box = (-10, -5, -10, 10, 10, 10)
    return {"cells": [cell(0, [level(-10, -10, 10, 10), *quads], box)], **case}


def off(eyes: Floats, line: Sequence[float]) -> Floats:
    """(n,) distances from a wall, seen from above."""
    start, end = np.array(line).reshape(2, 2)
    way = eyes[:, [0, 2]] - start
    along = np.clip(way @ (end - start) / ((end - start) @ (end - start)), 0, 1)
    return np.asarray(np.linalg.norm(way - along[:, None] * (end - start), axis=1))


def test_pace(tmp_path: Path) -> None:
    """However the time is cut, the way is the same."""
    times = [(400, 0.005), (120, 1 / 60), (10, 0.2)]
    paths = walked(tmp_path, *(hall([], steps=[[n, dt, AHEAD]]) for n, dt in times))
    assert [path[-1][2] for path in paths] == pytest.approx([paths[0][-1][2]] * 3, abs=1e-6)
    assert 2.5 < -paths[0][-1][2] < 3.5
    assert all(np.allclose(path[:, :2], [0, EYE], atol=1e-9) for path in paths)


def test_a_long_pause_is_no_leap(tmp_path: Path) -> None:
    (path,) = walked(tmp_path, hall([], steps=[[1, 3600, RUN]]))
    assert -path[-1][2] < 1


def plan(distance: float, angle: float, start: float, length: float) -> tuple[float, ...]:
    """A wall on a line so far from the visitor's place; on a near one, not where that place is."""
    if distance < BERTH:
        start = abs(start) + math.sqrt(BERTH**2 - distance**2)
    outward = np.array([math.cos(angle), math.sin(angle)])
    along = np.array([-outward[1], outward[0]])
    ends = [distance * outward + way * along for way in (start, start + length)]
    return tuple(float(value) for value in np.concatenate(ends))


#: The walls of a crooked room.
OUTER = [(-4, -3, 3, -4), (3, -4, 4, 4), (4, 4, -3, 3), (-3, 3, -4, -3)]
PLAN = st.builds(
    plan, st.floats(0, 3), st.floats(-math.pi, math.pi), st.floats(-3, 3), st.floats(0.06, 5)
)
MOVES = st.tuples(
    st.sampled_from([0.002, 1 / 144, 1 / 60, 1 / 20, 0.25, 5]),
    st.floats(-1, 1),
    st.floats(-1, 1),
    st.floats(-1, 1),
    st.booleans(),
)


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.tuples(st.lists(PLAN, max_size=8), st.lists(MOVES, min_size=4, max_size=12)),
        min_size=8,
        max_size=8,
    )
)
def test_walls_hold(tmp_path: Path, rooms: list[Any]) -> None:
    """At any angle, in any corner, at any frame rate: no wall comes nearer than the radius."""
    cases = []
    for lines, moves in rooms:
        steps = [
            [int(min(2 / dt, 100)) + 1, dt, {"forward": a, "right": b, "turn": c, "run": run}]
            for dt, a, b, c, run in moves
        ]
        cases.append(hall([wall(*line) for line in [*OUTER, *lines]], steps=steps))
    for (lines, _), path in zip(rooms, walked(tmp_path, *cases), strict=True):
        for line in [*OUTER, *lines]:
            assert off(path, line).min() > RADIUS - 1e-5
        assert abs(path[:, [0, 2]]).max() < 4
        assert np.allclose(path[:, 1], EYE, atol=1e-9)


#: Steps of a head in its room, and the push of a stick.
HEADS = st.tuples(
    st.floats(-0.9, 0.9),
    st.floats(0.3, 2),
    st.floats(-0.9, 0.9),
    st.floats(-math.pi, math.pi),
    st.sampled_from([0, 0, 1]),
)


@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.tuples(st.lists(PLAN, max_size=8), st.lists(HEADS, min_size=4, max_size=16)),
        min_size=8,
        max_size=8,
    )
)
def test_walls_stop_a_head(tmp_path: Path, rooms: list[Any]) -> None:
    """Leaps and steps at any height, beside a stick: no wall comes nearer than that."""
    cases = []
    for lines, heads in rooms:
        ways = np.array([(0, EYE, 0, 0, 0), *heads], float)
        ways[:, [0, 2]] = ways[:, [0, 2]].cumsum(axis=0)
        walls = [wall(*line) for line in [*OUTER, *lines]]
        cases.append(hall(walls, heads=ways.tolist()))
    for (lines, heads), path in zip(rooms, stepped(tmp_path, *cases), strict=True):
        for line in [*OUTER, *lines]:
            assert off(path, line).min() > HEAD - 1e-5
        assert abs(path[:, [0, 2]]).max() < 4
        assert np.allclose(path[1:, 1], [head[1] for head in heads], atol=1e-9)


def test_a_head_leans_and_kneels(tmp_path: Path) -> None:
    """Over a table, not into it; from one that it has come down into, out again; beside a wall."""
    table = [*block((-2, 0, -2), (2, 0.75, -0.5)), level(-2, -2, 2, -0.5, 0.1), wall(-9, -2, 9, -2)]
    beam = [*block((-2, 1.7, -1), (2, 2, -0.5)), level(-2, -1, 2, -0.5, 1.7)]
    begin = [0, EYE, 0, 0, 0]
    into = [begin, [0, EYE, -0.8, 0, 0], [0, 0.4, -0.8, 0, 0]]
    over, low, out, along, tall, under, leap, slides = stepped(
        tmp_path,
        hall(table, heads=[begin, [0, EYE, -0.9, 0, 0]]),
        hall(table, heads=[begin, [0, 0.4, 0, 0, 0], [0, 0.4, -0.9, 0, 0]]),
        hall(table, heads=[*into, [0, 0.4, -0.1, 0, 0]]),
        hall(table, heads=[*into, [0, 0.4, -1.7, 0, 0], [0, 0.4, -2.6, 0, 0]]),
        hall(beam, heads=[begin, [0, 1.85, 0, 0, 0], [0, 1.85, -0.9, 0, 0]]),
        hall(beam, heads=[begin, [0, 1.3, -0.8, 0, 0], [0, 1.85, -0.8, 0, 0], [0, 1.85, 0, 0, 0]]),
        hall([], heads=[begin, [0, EYE, -1.5, 0, 0], [0, EYE, -1.6, 0, 0]]),
        hall(
            table, heads=[begin, [0, EYE, -0.9, 0, 0], [0, EYE, -1.8, 0, 0], [0.9, EYE, -2, 0, 0]]
        ),
    )
    assert over[-1] == pytest.approx([0, EYE, -0.9])
    assert low[-1] == pytest.approx([0, 0.4, -0.5 + HEAD], abs=1e-5)
    assert out[-1] == pytest.approx([0, 0.4, -0.1])
    assert along[-1] == pytest.approx([0, 0.4, -2 + HEAD], abs=1e-5)
    assert tall[-1] == pytest.approx([0, 1.85, -0.5 + HEAD], abs=1e-5)
    assert under[-1] == pytest.approx([0, 1.85, 0])
    assert leap[-1] == pytest.approx([0, EYE, -0.1])
    assert slides[-1] == pytest.approx([0.9, EYE, -2 + HEAD], abs=1e-5)


def test_a_head_stays_where_geometry_is(tmp_path: Path) -> None:
    """Before a cell has come, and in the building."""
    heads = [[0, EYE, -0.5 * k, 0, 0] for k in range(9)]
    missing, there, outside = stepped(
        tmp_path,
        {**doorway([], portal=True, beyond=True), "heads": heads},
        {**doorway([], portal=True), "heads": heads},
        {"cells": doorway([], portal=True)["cells"][:1], "heads": heads},
    )
    for path in (missing, outside):
        assert -2 <= path[-1][2] <= -1.5
    assert there[-1][2] == pytest.approx(-4)


def test_walls_are_slid_along(tmp_path: Path) -> None:
    """Obliquely into a wall: the way goes on along it."""
    (path,) = walked(tmp_path, hall([wall(-8, -1, 8, -1)], yaw=0.8, steps=[[180, 1 / 60, AHEAD]]))
    assert path[-1][2] == pytest.approx(-1 + RADIUS, abs=1e-4)
    assert path[-1][0] < -2.5


@pytest.mark.parametrize(
    ("rise", "climbs"), [(0.1, True), (0.18, True), (STEP, True), (0.52, False)]
)
@pytest.mark.parametrize("dt", [1 / 144, 1 / 30, 0.25])
def test_stairs(tmp_path: Path, rise: float, climbs: bool, dt: float) -> None:
    """Steps as high as may be are climbed, higher ones not; and the eye glides."""
    treads = [b for k in range(8) for b in block((-1, 0, -9), (1, rise * (k + 1), -1 - 0.3 * k))]
    (path,) = walked(
        tmp_path, hall(treads, steps=[[int(5 / dt), dt, AHEAD], [int(1 / dt), dt, {}]])
    )
    if not climbs:
        assert path[-1] == pytest.approx([0, EYE, -1 + RADIUS], abs=1e-4)
        return
    assert path[-1][1] == pytest.approx(EYE + 8 * rise, abs=1e-4)
    assert np.diff(path[:, 1]).min() > -1e-9
    if dt < 0.01:
        assert np.diff(path[:, 1]).max() < 0.12 * rise


def test_down_the_stairs_and_over_the_edge(tmp_path: Path) -> None:
    """Downstairs one walks, from a ledge one falls as bodies fall; both end on the floor."""
    stairs = [b for k in range(8) for b in block((-1, 0, -1 - 0.3 * k), (1, 1.6 - 0.2 * k, 1))]
    ledge = block((-1, 0, -1), (1, 3, 1))
    steps = [[300, 1 / 60, AHEAD]]
    down, over = walked(tmp_path, hall(stairs, eye=[0, 3.2, 0], steps=steps),
                        hall(ledge, eye=[0, 4.6, 0], steps=steps))  # fmt: skip
    for path in (down, over):
        assert path[-1][1] == pytest.approx(EYE, abs=1e-4)
        assert path[-1][2] < -5
        assert np.diff(path[:, 1]).max() < 1e-9
    assert -np.diff(down[:, 1]).min() < 0.06
    falls = np.flatnonzero((over[:, 1] < 4.5) & (over[:, 1] > 1.8))
    fallen = math.sqrt(2 * 2.8 / 9.8) - math.sqrt(2 * 0.1 / 9.8)
    assert len(falls) / 60 == pytest.approx(fallen, abs=0.04)


@pytest.mark.parametrize("step", [0.1, STEP])
def test_ramps(tmp_path: Path, step: float) -> None:
    """A slope of 40° is a floor, one of 50° a wall."""
    ends = []
    for angle in (40, 50):
        top = 4 * math.tan(math.radians(angle))
        ramp = [level(-1, -5, 1, -1, 0, to=top), level(-1, -9, 1, -5, top)]
        case = hall(ramp, avatar=[RADIUS, EYE, step], steps=[[240, 1 / 60, AHEAD]])
        ends.append((walked(tmp_path, case)[0][-1], top))
    (over, top), (below, _) = ends
    assert over[1] == pytest.approx(EYE + top, abs=0.01)
    assert below[1] < EYE + STEP
    assert below[2] > -2


@pytest.mark.parametrize(("height", "passes"), [(1.2, False), (1.65, False), (1.75, True)])
def test_beams(tmp_path: Path, height: float, passes: bool) -> None:
    beam = [
        level(-9, -2.2, 9, -2, height),
        wall(-9, -2, 9, -2, height, 3),
        wall(-9, -2.2, 9, -2.2, height),
    ]
    (path,) = walked(tmp_path, hall(beam, steps=[[180, 1 / 60, AHEAD]]))
    assert (path[-1][2] < -2.5) == passes
    if not passes:
        assert path[-1][2] == pytest.approx(-2 + RADIUS, abs=1e-4)


def test_a_beam_over_stairs(tmp_path: Path) -> None:
    """Where the head does not fit the foot does not go."""
    treads = [b for k in range(8) for b in block((-1, 0, -9), (1, 0.2 * (k + 1), -1 - 0.3 * k))]
    (path,) = walked(
        tmp_path, hall([*treads, level(-2, -9, 2, -1, 2.45)], steps=[[240, 1 / 60, AHEAD]])
    )
    assert path[:, 1].max() < 2.45 - 0.05
    assert path[-1][2] > -3


def doorway(leaf: list[Quad], portal: bool, *, beyond: bool = False) -> dict[str, Any]:
    """Two rooms, and between them a wall 0.3 m thick with a doorway of 0.9 m and a leaf in it."""
    jambs = [b for x in (-9, 0.45) for b in block((x, 0, -2.3), (x + 8.55, 3, -2))]
    lintel = block((-0.45, 2.1, -2.3), (0.45, 3, -2))
    polygon = [[-0.45, 0, -2], [0.45, 0, -2], [0.45, 2.1, -2], [-0.45, 2.1, -2]]
    portals = [{"neighbour": 1, "polygon": polygon}] if portal else []
    near = [level(-9, -2, 9, 9), *jambs, *lintel, *leaf]
    return {
        "cells": [
            cell(0, near, (-9, 0, -2, 9, 3, 9), portals=portals),
            cell(1, [level(-9, -9, 9, -2)], (-9, 0, -9, 9, 3, -2), portals=portals, missing=beyond),
        ]
    }


def test_doors_are_open(tmp_path: Path) -> None:
    """A leaf in a portal lets through, at its hinges too; without a portal it does not."""
    leaf = block((-0.46, 0.01, -2.17), (0.46, 2.1, -2.13)) + block(
        (0.3, 1, -2.22), (0.4, 1.1, -2.1)
    )
    steps = [[150, 1 / 60, AHEAD]]
    through, aside, closed, ajar = walked(
        tmp_path,
        {**doorway(leaf, portal=True), "steps": steps},
        {**doorway(leaf, portal=True), "eye": [0.35, EYE, -1], "steps": steps},
        {**doorway(leaf, portal=False), "steps": steps},
        {**doorway([wall(-0.2, -1, -0.2, -1.9, 0, 2.1)], portal=True), "steps": steps},
    )
    assert through[-1] == pytest.approx([0, EYE, -3.8], abs=0.2)
    assert aside[-1][2] < -1.7  # beside the way through the jamb pushes
    assert off(aside, (0.45, -2, 0.45, -2.3)).min() > RADIUS - 1e-4
    assert closed[-1][2] == pytest.approx(-2.13 + RADIUS, abs=0.02)
    assert ajar[-1][2] < -3
    assert off(ajar, (-0.2, -1, -0.2, -1.9)).min() > RADIUS - 1e-4


def test_what_is_missing_is_not_entered(tmp_path: Path) -> None:
    """Neither a cell whose geometry is not there, nor the dark that no cell is known to be in."""
    steps = [[200, 1 / 60, RUN]]
    missing, unknown = walked(
        tmp_path,
        {**doorway([], portal=True, beyond=True), "steps": steps},
        {"cells": doorway([], portal=True)["cells"][:1], "steps": steps},
    )
    for path in (missing, unknown):
        assert -2.3 < path[-1][2] < -1.5
        assert path[-1][1] == pytest.approx(EYE, abs=1e-6)


def test_no_floor_no_fall(tmp_path: Path) -> None:
    """Over a hole whose floor is not there one stays at one's height; over a floor one falls."""
    box = (-9, -9, -9, 9, 9, 9)
    shelf = level(-9, -1, 9, 9)
    steps = [[240, 1 / 60, AHEAD]]
    hole, pit = walked(
        tmp_path,
        {"cells": [cell(0, [shelf], box)], "steps": steps},
        {"cells": [cell(0, [shelf, level(-9, -9, 9, -1, -4)], box)], "steps": steps},
    )
    assert np.allclose(hole[:, 1], EYE, atol=1e-9)
    assert pit[-1][1] == pytest.approx(EYE - 4, abs=1e-4)


def test_seams_in_the_floor_do_not_swallow(tmp_path: Path) -> None:
    """Strips with gaps of 0.1 m, over a floor 2 m below."""
    strips = [level(-9, z, 9, z + 0.4) for z in np.arange(-9, 9, 0.5)]
    floor = [*strips, level(-9, -9, 9, 9, -2)]
    world = {"cells": [cell(0, floor, (-9, -9, -9, 9, 9, 9))]}
    (path,) = walked(tmp_path, {**world, "steps": [[600, 1 / 144, AHEAD]]})
    assert path[:, 1].min() > EYE - 1e-6


def test_out_of_what_one_is_put_in(tmp_path: Path) -> None:
    """Out of a table, a wall or the outside one can get, through a wall never."""
    steps = [[150, 1 / 60, AHEAD]]
    table, outside, wall_near, away = walked(
        tmp_path,
        hall(block((-0.6, 0, -0.6), (0.6, 0.75, 0.6)), steps=steps),
        hall([wall(-10, 10, 10, 10)], eye=[0, EYE, 11], steps=steps),
        hall([wall(-9, -0.03, 9, -0.03)], steps=[[150, 0.25, RUN]]),
        hall([wall(-9, 0.03, 9, 0.03)], steps=steps),
    )
    for path in (table, away):
        assert path[-1][2] < -2
    assert outside[-1][2] < 9
    assert wall_near[:, 2].min() > -0.03


def test_a_place_is_kept_until_the_first_step(tmp_path: Path) -> None:
    """Turning moves nothing; then the eye glides to its height above the floor."""
    steps = [[20, 0.05, {"turn": 1, "look": 0.5}], [40, 0.05, AHEAD]]
    (path,) = walked(tmp_path, hall([], eye=[1, 1.3, 1], steps=steps))
    assert np.array_equal(path[:20], [[1, 1.3, 1]] * 20)
    assert path[20][1] < 1.5
    assert path[-1][1] == pytest.approx(EYE, abs=1e-4)


def test_a_cell_that_comes_bit_by_bit_is_the_same() -> None:
    """A call does little, nothing is met before all is there, and then it is what comes at once."""
    count = 5000
    reported = json.loads(node.run(HERE / "slices.mjs", count))
    assert reported["calls"] > count / 64
    assert reported["early"] == 0
    assert reported["parts"] == reported["whole"]
    assert 0 < sum(map(len, reported["whole"])) < 20 * count
