"""Measures of runs that are written down by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ptmtools.link import Conditions
from ptmtools_lab.measures import measure
from ptmtools_lab.simulation import WalkRun


def run_of(error: list[float], still: list[bool]) -> WalkRun:
    count = len(error)
    return WalkRun(
        policy="by hand",
        conditions=Conditions(),
        budget=100,
        time=np.arange(count) / 2,
        still=np.array(still),
        error=np.array(error),
        square=np.array(error) ** 2,
        missing=np.array(error) / 10,
        quality=1 - np.array(error) / 10,
        memory=np.zeros(count, np.int64),
        fetched=np.zeros(count),
        column=np.zeros((count, 1), np.int64),
        state=np.zeros((count, 1), np.int64),
        loaded=np.ones((count, 1), dtype=bool),
        body=1000.0,
        overhead=30.0,
        documents=200,
        useful=450.0,
        uploads=7,
        switches=6,
        requests=3,
        stalls=2,
        overruns=1,
    )


@pytest.fixture
def world() -> Any:
    """Two frames a second, in which e is 8 if nothing is there."""
    views = SimpleNamespace(rows=lambda frame: slice(0, 2), error=np.array([[5.0, 1], [3, 1]]))
    track = SimpleNamespace(rate=2.0, view=np.zeros(4, np.int64))
    return SimpleNamespace(track=track, frames=4, views=views)


RUN = run_of([8, 4, 2, 2], [False, False, True, True])


def test_means(world: Any) -> None:
    m = measure(RUN, world, RUN)
    assert (m.e.mean, m.e.still, m.e.moving) == (4, 2, 6)
    assert m.e.p95 == pytest.approx(7.4)  # between 4 and 8, linearly
    assert m.rmse.mean == pytest.approx(math.sqrt((64 + 16 + 4 + 4) / 4))
    assert m.rmse.moving == pytest.approx(math.sqrt(40))
    assert m.quality.mean == pytest.approx(1 - m.missing.mean)
    assert m.quality.p95 == pytest.approx(1 - m.missing.p95)  # the low end is the bad one


def test_costs(world: Any) -> None:
    m = measure(RUN, world, RUN)
    assert (m.bytes, m.overhead, m.requests, m.uploads) == (1000, 30, 3, 7)
    # Of 800 bytes of textures and geometry, 450 were displayed.
    assert m.waste == pytest.approx(0.4375)
    assert (m.stalls, m.switches, m.overruns) == (1.0, 180.0, 1)


def test_nothing_received_is_nothing_wasted(world: Any) -> None:
    bare = replace(RUN, body=200.0, useful=0.0)
    assert measure(bare, world, RUN).waste == 0


def test_who_never_stands_has_no_such_mean(world: Any) -> None:
    moving = run_of([1, 2, 3, 4], [False] * 4)
    m = measure(moving, world, RUN)
    assert math.isnan(m.e.still)
    assert m.e.moving == m.e.mean == 2.5


def test_seconds_to_the_picture(world: Any) -> None:
    standing = run_of([8, 5, 4, 0.9, 0.8, 0.09], [True] * 6)
    assert measure(RUN, world, standing).final == (1.0, 2.0, None)
    assert measure(RUN, world, run_of([8, 0, 0], [True] * 3)).final == (0.5, 0.5, 0.5)
