"""The client of the campus: what it asks for, in which order, and what it shows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools_lab.campus.client import CampusClient
from ptmtools_lab.campus.options import CampusWalkOptions
from ptmtools_lab.campus.simulation import simulate_campus
from ptmtools_lab.campus.stock import Stock
from ptmtools_lab.network import FluidLink, Request
from ptmtools_systems.campus.model import PRESETS, Quality
from tests.lab.campus.stocks import (
    APART,
    COARSE,
    FINE,
    INDEX_BYTES,
    LIGHTMAP,
    SEEDS,
    TEXTURE,
    any_campus,
    any_walk,
    campus,
    stock,
    world,
)

LOW, MEDIUM, HIGH, ULTRA, CACHED = PRESETS
#: Five boxes; all share a texture, and each has one of its own.
FIVE = [(0, i + 1) for i in range(5)]
ONE_THREAD = CampusWalkOptions(nearest=2, threads=1, bandwidth="4M")


class Noting(FluidLink):
    """A link that remembers what it was asked for, and the most that was on the way at once."""

    def __init__(self, made: Stock, options: CampusWalkOptions) -> None:
        super().__init__(options.link())
        self.made = made
        self.names: list[str] = []
        self.open: list[Request] = []
        self.most = 0

    def request(self, size: int, priority: float, tag: object = None, late: float = 0.0) -> Request:
        made = super().request(size, priority, tag, late)
        assert isinstance(tag, int)
        self.names.append(self.made.names[tag])
        self.open = [*(r for r in self.open if r.ended is None), made]
        self.most = max(self.most, len(self.open))
        return made


class Walker:
    """Goes along with a client."""

    def __init__(self, made: Stock, options: CampusWalkOptions, quality: Quality = MEDIUM) -> None:
        self.link = Noting(made, options)
        self.client = CampusClient(made, self.link, quality, options)

    def at(self, x: float, seconds: float = 0.0) -> None:
        """Is at a place now, and stays so long."""
        end = self.link.now + seconds
        while True:
            self.client.look(np.array([x, 1.6, -5.0]))
            self.client.fetch()
            if self.link.now >= end:
                return
            until = min(end, self.link.now + 0.2)
            while finished := self.link.advance(until):
                self.client.receive(finished)
                self.client.fetch()

    def memory_of(self, names: list[str]) -> int:
        """Bytes of graphics memory."""
        made = self.link.made
        return int(sum(made.memory[made.names.index(name)] for name in names))


def test_low_detail_of_all_comes_first_and_the_nearest_before_the_others() -> None:
    walker = Walker(stock(campus(FIVE)), ONE_THREAD)
    walker.at(2 * APART + 3, 60)
    order = [2, 1, 3, 0, 4]  # from 3 metres right of the left side of box 2
    expected = ["campus.json"]
    for nth, i in enumerate(order):
        expected.append(f"meshes/box{i}_0.glb")
        expected += ["textures/base0_128_d.jpg"] if not nth else []
        expected.append(f"textures/base{i + 1}_128_d.jpg")
    for nth, i in enumerate(order[:2]):
        expected.append(f"meshes/box{i}_1.glb")
        expected += ["textures/base0_256_d.jpg"] if not nth else []
        expected.append(f"textures/base{i + 1}_256_d.jpg")
    assert walker.link.names == expected
    assert walker.client.near == (2, 1)
    assert all(walker.client.full(i) for i in (1, 2))
    assert not any(walker.client.full(i) for i in (0, 3, 4))


@pytest.mark.parametrize("threads", [1, 3, 4])
def test_threads_bound_what_is_on_the_way_and_high_detail_waits(threads: int) -> None:
    options = replace(ONE_THREAD, threads=threads)
    walker = Walker(stock(campus(FIVE)), options)
    walker.at(0.0, 60)
    assert walker.link.most == threads
    names = walker.link.names
    last = max(i for i, name in enumerate(names) if name.endswith(("_0.glb", "_128_d.jpg")))
    first = min(i for i, name in enumerate(names) if name.endswith(("_1.glb", "_256_d.jpg")))
    # The last of the threads may still be at it while another has nothing else to do.
    assert first > last - threads
    assert all(name in names[: last + 1] for name in names if name.endswith("_0.glb"))


def test_a_thread_finishes_what_it_began() -> None:
    made = stock(campus(FIVE, lit=True))
    walker = Walker(made, replace(ONE_THREAD, nearest=1), HIGH)
    while "meshes/box0_1.glb" not in walker.link.names:
        walker.at(0.0, 0.2)
    # Away, while the mesh of the first is on the way.
    walker.at(4 * APART, 60)
    names = walker.link.names
    begun = names.index("meshes/box0_1.glb")
    assert names[begun : begun + 5] == [
        "meshes/box0_1.glb", "textures/base0_256_d.jpg", "textures/base1_256_d.jpg",
        "textures/box0_2048_l.jpg", "meshes/box4_1.glb",
    ]  # fmt: skip
    assert walker.client.near == (4,)
    assert walker.client.full(4)


def test_objects_are_sorted_again_when_the_viewpoint_has_moved() -> None:
    walker = Walker(stock(campus(FIVE)), replace(ONE_THREAD, move=2.0, nearest=1))
    between = APART / 2 + 5  # from here the first and the second box are as far away
    walker.at(between - 0.9, 10)
    assert (walker.client.near, walker.client.sorts) == ((0,), 1)
    walker.at(between + 1.0, 1)
    assert (walker.client.near, walker.client.sorts) == ((0,), 1)
    walker.at(between + 1.2, 1)
    assert (walker.client.near, walker.client.sorts) == ((1,), 2)
    walker.at(between + 1.2, 1)
    assert walker.client.sorts == 2


def test_high_detail_leaves_memory_at_once_and_comes_back_without_a_request() -> None:
    walker = Walker(stock(campus(FIVE)), replace(ONE_THREAD, nearest=1))
    walker.at(0.0, 60)
    base = [f"meshes/box{i}_0.glb" for i in range(5)]
    base += [f"textures/base{i}_128_d.jpg" for i in range(6)]
    first = [*base, "meshes/box0_1.glb", "textures/base0_256_d.jpg", "textures/base1_256_d.jpg"]
    assert walker.client.memory == walker.memory_of(first)
    walker.at(4 * APART)
    # Its own mesh and texture are gone; what the next one shares stays.
    assert walker.client.memory == walker.memory_of([*base, "textures/base0_256_d.jpg"])
    walker.at(4 * APART, 60)
    requests = len(walker.link.names)
    walker.at(0.0)
    assert walker.client.memory == walker.memory_of(first)
    assert len(walker.link.names) == requests


def test_no_room_for_all_of_it() -> None:
    made = stock(campus(FIVE))
    low = int(made.most[np.unique([f for o in range(5) for f in made.low(o)])].sum())
    high = int(made.most[list(made.high(0, MEDIUM, True))].sum())
    walker = Walker(made, replace(ONE_THREAD, memory=str(low + high)))
    walker.at(0.0, 60)
    assert walker.client.full(0)
    assert not walker.client.full(1)
    assert "meshes/box1_1.glb" not in walker.link.names
    nothing = Walker(made, replace(ONE_THREAD, memory="1"))
    nothing.at(0.0, 60)
    assert nothing.link.names == ["campus.json"]
    assert not nothing.client.shown.any()


@settings(deadline=None)
@given(SEEDS, st.integers(1, 60_000_000), st.sampled_from(PRESETS), st.integers(0, 9),
       st.integers(1, 6), st.booleans())  # fmt: skip
def test_the_budget_is_never_exceeded(
    seed: int, budget: int, quality: Quality, nearest: int, threads: int, h2: bool
) -> None:
    made = stock(any_campus(seed))
    options = CampusWalkOptions(
        memory=str(budget), nearest=nearest, threads=threads, protocol="h2" if h2 else "h1"
    )
    walker = Walker(made, options, quality)
    for x in any_walk(seed, made.objects):
        walker.at(float(x), 0.2)
        assert walker.client.memory <= budget
    # No file comes twice, whoever shares it.
    assert len(set(walker.link.names)) == len(walker.link.names)
    assert walker.link.most <= threads


@settings(deadline=None)
@given(SEEDS, st.sampled_from(PRESETS), st.integers(0, 9))
def test_in_the_end_what_is_near_is_shown_in_full(
    seed: int, quality: Quality, nearest: int
) -> None:
    made = stock(any_campus(seed))
    walker = Walker(made, CampusWalkOptions(nearest=nearest, bandwidth="inf"), quality)
    walk = any_walk(seed, made.objects)
    for x in walk:
        walker.at(float(x), 0.2)
    walker.at(float(walk[-1]), 30)
    client = walker.client
    assert client.begun
    assert not client.waiting
    assert all(client.full(number) for number in client.near)
    wanted = {f for o in range(made.objects) for f in client.low[o]}
    wanted |= {f for o in client.near for f in client.high[o]}
    assert set(np.flatnonzero(client.shown).tolist()) == wanted


@settings(deadline=None)
@given(SEEDS, st.sampled_from(PRESETS))
def test_the_same_walk_is_the_same_run(seed: int, quality: Quality) -> None:
    made = stock(any_campus(seed))
    walk = world(made, any_walk(seed, made.objects))
    one, other = (simulate_campus(walk, quality) for _ in range(2))
    for name, value in vars(one).items():
        assert _same(value, getattr(other, name)), name


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    return bool(one == other)


def near_all(seconds: float = 120.0) -> Any:
    """Who stands long enough for everything to come."""
    made = stock(campus(FIVE, lit=True))
    return made, world(made, np.zeros(round(5 * seconds)))


@pytest.mark.parametrize("quality", PRESETS[:4])
def test_a_preset_loads_its_bytes(quality: Quality) -> None:
    made, walk = near_all()
    run = simulate_campus(walk, quality, CampusWalkOptions(nearest=5))
    preset = next(p for p in made.campus.presets if p.name == quality.name)
    assert run.body == INDEX_BYTES + preset.bytes
    assert run.overhead == 300 * run.requests
    dark = simulate_campus(walk, quality, CampusWalkOptions(nearest=5, lightmaps=False))
    assert run.body - dark.body == 5 * LIGHTMAP[quality.light]


def test_what_the_browser_has_costs_a_request_each_and_no_bytes() -> None:
    _, walk = near_all()
    ultra, cached = (
        simulate_campus(walk, q, CampusWalkOptions(nearest=5)) for q in (ULTRA, CACHED)
    )
    assert (cached.body, cached.overhead) == (0, ultra.overhead)
    assert cached.requests == ultra.requests
    assert cached.memory.max() == ultra.memory.max()
    assert cached.begun is not None
    assert ultra.begun is not None
    assert 0 < cached.begun < ultra.begun


def test_what_a_run_says_of_time() -> None:
    made = stock(campus([(0,)]))
    options = CampusWalkOptions(bandwidth="80k", threads=1, nearest=1)
    run = simulate_campus(world(made, np.zeros(100)), MEDIUM, options)
    parts = [INDEX_BYTES, COARSE, TEXTURE[128], FINE, TEXTURE[256]]
    ends = np.cumsum([0.1 + 8 * (300 + each) / 80_000 for each in parts])
    assert run.begun == pytest.approx(ends[2])
    # In frames of a fifth of a second: the index, then the whole.
    there, full = (np.ceil(ends[i] * 5) / 5 for i in (0, 4))
    assert run.delays == pytest.approx([full - there])
    assert run.late == pytest.approx(full * 5 / 100)
    assert run.idle == pytest.approx(np.array([[ends[4], run.time[-1]]]))
    assert (run.never, run.pauses, run.requests) == (0, 1, 5)
    assert run.fetched[-1] == sum(parts)
    assert run.floor == made.memory[list(made.low(0))].sum()


def test_who_leaves_too_early_sees_less() -> None:
    made = stock(campus(FIVE))
    options = CampusWalkOptions(bandwidth="80k", nearest=1)
    walk = np.concatenate([np.zeros(45), np.full(5, 4 * APART)])
    run = simulate_campus(world(made, walk), ULTRA, options)
    assert (run.delays, run.never, run.late) == ((), 2, 1.0)
