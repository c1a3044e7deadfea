"""The viewer's point location and frustum tests agree with Python's."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.output.locating import SLACK
from ptmtools.rendering.rays import Frustum, axes
from ptmtools_lab.policies.paper import _crossing
from ptmtools_lab.world import World
from tests.lab.conftest import two_rooms, walk_file, world
from tests.site.watching import called
from tests.web.node import missing

__all__ = ["two_rooms", "walk_file", "world"]

CASES = 100


@pytest.fixture(scope="module", autouse=True)
def _node(require: Callable[[str, str], None]) -> None:
    if remedy := missing():
        require("node", remedy)


def test_what_a_camera_takes_in(tmp_path: Path) -> None:
    calls, expected = [], []
    for seed in range(CASES):
        random = np.random.default_rng(seed)
        yaw, pitch = random.uniform(-4, 4), random.uniform(-1.5, 1.5)
        ahead = np.array(
            [-np.sin(yaw) * np.cos(pitch), np.sin(pitch), -np.cos(yaw) * np.cos(pitch)]
        )
        eye, angle, aspect = random.normal(size=3), random.uniform(0.3, 2), random.uniform(0.4, 2.5)
        low = random.uniform(-4, 4, (30, 3))
        high = low + random.uniform(0, 2, (30, 3))
        hulls = random.uniform(-4, 4, (20, 1, 3)) + random.normal(size=(20, 7, 3))
        frustum = Frustum(eye, ahead, angle, aspect)
        met = frustum.meets_boxes(low, high).tolist()
        right, up = axes(ahead[None])
        expected.append(
            {
                "direction": ahead.tolist(),
                "right": right[0].tolist(),
                "up": up[0].tolist(),
                "boxes": met,
                "rows": met,
                "hulls": [frustum.meets_hull(points) for points in hulls],
                "distances": frustum.distance(low, high).tolist(),
            }
        )
        reported = {
            "pose": {"eye": eye.tolist(), "yaw": yaw, "pitch": pitch},
            "angle": angle,
            "aspect": aspect,
            "low": low.tolist(),
            "high": high.tolist(),
            "hulls": hulls.tolist(),
        }
        calls.append(("frustum", reported))
    actual = called(tmp_path, calls)
    sides = [
        {name: case.pop(name) for name in ("direction", "right", "up")}
        for cases in (actual, expected)
        for case in cases
    ]
    for one, other in zip(sides[:CASES], sides[CASES:], strict=True):
        assert one == {name: pytest.approx(axis, abs=1e-12) for name, axis in other.items()}
    assert actual == expected
    assert 0.1 < np.mean([case["boxes"] for case in expected]) < 0.9
    assert 0.1 < np.mean([case["hulls"] for case in expected]) < 0.9


def test_the_camera_straight_up_has_a_right_side(tmp_path: Path) -> None:
    pose = {"eye": [0, 0, 0], "yaw": 0.7, "pitch": math.pi / 2}
    reported = {"pose": pose, "angle": 1, "aspect": 1, "low": [], "high": [], "hulls": []}
    (actual,) = called(tmp_path, [("frustum", reported)])
    assert actual["right"] == pytest.approx([math.cos(0.7), 0, -math.sin(0.7)])
    assert actual["up"] == pytest.approx([math.sin(0.7), 0, math.cos(0.7)])


def located(
    folder: Path, world: World, eyes: Floats, known: list[int], cell: int = -1
) -> list[Any]:
    """The cell of each eye, each from the one before, and the cells whose record may say more."""
    reported = {"index": world.served.index, "records": world.served.records, "known": known}
    call = {**reported, "eyes": eyes.tolist(), "from": cell}
    rows: list[Any] = called(folder, [("locate", call)])[0]
    return rows


def test_the_cell_along_a_walk(tmp_path: Path, world: World) -> None:
    """And straight from each cell to the next, through walls."""
    stock = world.catalogue
    every = list(range(stock.cell_count))
    middle = (stock.low + stock.high) / 2
    share = np.linspace(0, 1, 37)[:, None]
    ways = [(1 - share) * a + share * b for a, b in itertools.pairwise(middle)]
    eyes = np.concatenate([world.track.eye, *ways])
    actual = located(tmp_path, world, eyes, every)
    cells = [cell for cell, _ in actual]
    assert cells == world.served.locator.cells_along(eyes).tolist()
    assert len(set(cells)) > 1
    assert not any(candidates for _, candidates in actual)


def test_the_cell_anywhere(tmp_path: Path, world: World) -> None:
    """Leaves that touch overlap by the slack; no other two."""
    random = np.random.default_rng(5)
    stock, locator = world.catalogue, world.served.locator
    low, high = stock.low.min(axis=0) - 1, stock.high.max(axis=0) + 1
    eyes = random.uniform(low, high, (400, 3))
    every = list(range(stock.cell_count))
    actual = [cell for cell, _ in located(tmp_path, world, eyes, every)]
    outside = np.array([locator.distance_outside(cell, eyes) for cell in every])
    for cell, far in zip(actual, outside.T, strict=True):
        assert far[cell] <= SLACK if cell >= 0 else (far > SLACK).all()
    assert len(set(actual)) > 2


def test_the_cells_on_both_sides_of_a_door_leaf(tmp_path: Path) -> None:
    """Cells 0, 1 and 2 along x, passages at 4 and at 4.05, a portal at 0; the reach is 0.5 m."""

    def portal(neighbour: int, x: float, **more: bool) -> dict[str, Any]:
        return {"neighbour": neighbour, "polygon": [[x, 0, 0], [x, 2, 0], [x, 2, 1]], **more}

    portals = [
        [portal(1, 4, passage=True), portal(3, 0)],
        [portal(0, 4, passage=True), portal(2, 4.05, passage=True)],
        [portal(1, 4.05, passage=True)],
        [portal(0, 0, passage=False)],
    ]
    records = [{"leaves": [], "adjacent": [], "portals": row} for row in portals]
    expected = {
        (3.4, 1.0, 0.5): [0],
        (3.52, 1.0, 0.5): [0, 1],
        (3.6, 1.0, 0.5): [0, 1, 2],
        (3.99, 2.4, 0.5): [0, 1, 2],
        (3.99, 2.6, 0.5): [0],
        (3.99, 1.0, 1.6): [0],
        (0.1, 1.0, 0.5): [0],
    }
    call = {"records": records, "eyes": [*expected], "cell": 0}
    assert called(tmp_path, [("around", call)]) == [[*expected.values()]]


def test_cells_whose_record_is_not_there(tmp_path: Path, world: World) -> None:
    """By their boxes, those next to the cell before first."""
    stock = world.catalogue
    here = int(world.track.cell[0])
    middle = (stock.low + stock.high) / 2
    reported = located(tmp_path, world, middle, [here], here)
    for cell, (_, candidates) in enumerate(reported):
        inside = (stock.low <= middle[cell]) & (middle[cell] <= stock.high)
        near = set(np.flatnonzero(inside.all(axis=1)).tolist()) - {here}
        assert set(candidates) == near
        beside = [c in stock.adjacent[here] for c in candidates]
        assert beside == sorted(beside, reverse=True)
    assert any(candidates for _, candidates in reported)


def test_ways_through_polygons(tmp_path: Path) -> None:
    calls, expected = [], []
    for seed in range(300):
        random = np.random.default_rng(seed)
        angle = np.sort(random.uniform(0, 2 * np.pi, int(random.integers(3, 8))))
        circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)
        turned = np.linalg.qr(random.normal(size=(3, 3)))[0]
        polygon = random.normal(size=3) + circle * random.uniform(0.5, 2) @ turned
        eye = random.normal(size=3)
        to = polygon.mean(axis=0) + 0.5 * random.normal(size=3)
        way = (to - eye) * random.uniform(0.5, 2)
        if seed % 10 == 0:
            way = polygon[1] - polygon[0]
        if seed % 10 == 1:
            way = np.zeros(3)
        share = _crossing(eye, way, polygon)
        expected.append(share if math.isfinite(share) else "infinite")
        reported = {"eye": eye.tolist(), "way": way.tolist(), "polygon": polygon.tolist()}
        calls.append(("crossing", reported))
    for actual, wanted in zip(called(tmp_path, calls), expected, strict=True):
        assert actual == (pytest.approx(wanted) if wanted != "infinite" else wanted)
    assert 30 < expected.count("infinite") < 270
