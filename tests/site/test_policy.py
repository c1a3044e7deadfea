"""The viewer's client decides as the simulated one does."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from ptmtools.arrays import Floats
from ptmtools.link import Conditions
from ptmtools.site.choice import Previews, next_fetch, previews_of
from ptmtools.site.client import PRIOR_BANDWIDTH, PRIOR_LATENCY
from ptmtools_lab.allocation import allocate
from ptmtools_lab.catalogue import catalogue_of
from ptmtools_lab.client import Estimate
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies.paper import refresh, share_out
from ptmtools_lab.world import World
from tests.lab.conftest import two_rooms, walk_file, world
from tests.lab.worlds import SEEDS, any_world, catalogue, raw, standing
from tests.site.watching import (
    HERE,
    Witness,
    called,
    documents,
    in_javascript,
    preview_tables,
    same,
    tables,
    write,
)
from tests.web.node import missing, run

__all__ = ["two_rooms", "walk_file", "world"]

EACH = pytest.mark.parametrize("policy", ["best", "paper", "whole"])
#: Cases that one process answers.
CASES = 200


@pytest.fixture(scope="module", autouse=True)
def _node(require: Callable[[str, str], None]) -> None:
    if remedy := missing():
        require("node", remedy)


def tall(random: np.random.Generator) -> tuple[Floats, Any, Any]:
    """Worth and cost (T, K) and last columns (T,): often alike, and some worth nothing."""
    textures, levels = int(random.integers(1, 9)), int(random.integers(1, 7))
    worth = random.integers(0, 4, (textures, levels + 1)).astype(np.float64)
    if random.random() < 0.5:
        worth *= random.random(worth.shape)
    cost = np.cumsum(random.integers(1, 9, worth.shape), axis=1)
    cost -= cost[:, :1]
    return worth, cost, random.integers(0, levels + 1, textures)


def test_what_is_chosen(tmp_path: Path) -> None:
    calls, expected = [], []
    for seed in range(CASES):
        random = np.random.default_rng(seed)
        worth, cost, last = tall(random)
        budget, column = int(random.integers(0, int(cost[:, -1].sum()) + 3)), last.copy()
        used = allocate(worth, cost, last, budget, column, False)
        expected.append([used, column.tolist()])
        reported = {"worth": worth.tolist(), "cost": cost.tolist(), "last": last.tolist()}
        calls.append(("allocate", {**reported, "budget": budget}))
    assert called(tmp_path, calls) == expected


def test_what_is_fetched_next(tmp_path: Path) -> None:
    """Of exact levels and previews, some of them requested, some files busy."""
    calls, expected = [], []
    for seed in range(CASES):
        random = np.random.default_rng(seed)
        worth, ends, last = tall(random)
        count, wide = worth.shape
        stored = random.integers(1, wide, count)
        ends = np.minimum(ends, np.take_along_axis(ends, stored[:, None], axis=1))
        asked, busy = random.integers(0, ends[:, -1] + 1), random.random(count) < 0.3
        previews = any_previews(random, count, wide)
        pending = random.random(len(previews.texture)) < 0.3
        rows = worth[previews.texture] - random.integers(0, 3, (len(pending), wide))
        every = np.concatenate([worth, rows])
        density, source, column = next_fetch(
            every, ends, stored, asked, busy, last, previews, pending, 5
        )
        expected.append([density, source, column if source < count else 0])
        reported = {"worth": every, "ends": ends, "stored": stored, "asked": asked, "last": last}
        reported |= {"busy": busy, "pending": pending}
        more = {"overhead": 5, "previews": preview_tables(previews)}
        calls.append(("next", {k: v.tolist() for k, v in reported.items()} | more))
    assert called(tmp_path, calls) == expected
    assert {source for _, source, _ in expected} >= {-1, 0, 1, 2, 9}


def any_previews(random: np.random.Generator, count: int, wide: int) -> Previews:
    """Up to three previews of each texture."""
    rows = [
        [
            {"level": int(level), "bytes": int(random.integers(1, 30)), "difference": 1.0}
            for level in np.flatnonzero(random.random(wide - 1) < 0.3)
        ]
        for _ in range(count)
    ]
    return previews_of([{"ends": [0] * (wide - 1), "previews": some} for some in rows])


def test_how_the_paper_shares_out(tmp_path: Path) -> None:
    """Rounds in which the budget falls and grows."""
    calls, expected = [], []
    for seed in range(CASES):
        random = np.random.default_rng(seed)
        _, memory, levels = tall(random)
        memory = np.where(np.arange(memory.shape[1]) <= levels[:, None], memory, 0)
        memory = np.maximum.accumulate(memory, axis=1)
        have, column = random.integers(0, levels + 1), np.zeros(len(levels), np.int64)
        cells = [random.integers(0, len(levels), random.integers(0, 5)) for _ in range(4)]
        weight = -np.sort(-random.random(len(cells)))
        first = np.cumsum([0, *map(len, cells)])
        texture = np.concatenate(cells).astype(np.int64)
        shown, idle = np.ones(len(texture), dtype=bool), np.zeros(len(levels), dtype=bool)
        budgets = random.integers(0, int(memory[:, -1].sum()) + 2, 5).tolist()
        rounds = []
        for budget in budgets:
            share = np.zeros(len(levels))
            share_out(
                np.arange(len(cells)), weight, first, texture, shown, memory, levels, column,
                float(budget), share,
            )  # fmt: skip
            asks = refresh(share, memory, levels, have, idle, budget, column)
            rounds.append([share.tolist(), asks.tolist(), column.tolist()])
        expected.append(rounds)
        rows = zip(weight.tolist(), cells, strict=True)
        reported = {
            "memory": memory.tolist(),
            "levels": levels.tolist(),
            "have": have.tolist(),
            "budget": budgets,
            "rounds": len(budgets),
            "column": [0] * len(levels),
            "cells": [{"weight": w, "textures": some.tolist()} for w, some in rows],
        }
        calls.append(("share", reported))
    assert same(called(tmp_path, calls), expected)


@settings(max_examples=5)
@given(
    st.lists(
        st.tuples(SEEDS, st.sampled_from(["h1", "h2"])),
        min_size=10,
        max_size=10,
        unique_by=lambda link: link[0],
    )
)
@example([(570, "h1")])
def test_what_is_believed_of_a_link(
    tmp_path_factory: pytest.TempPathFactory, links: list[tuple[int, str]]
) -> None:
    """As Python's, of the same arrivals, though a browser knows of more moments."""
    notes = [notes_of_a_link(*link) for link in links]
    given = [("estimate", {"calls": calls, "size": 5000}) for calls, _ in notes]
    answers = called(tmp_path_factory.mktemp("estimate"), given)
    for reported, (_, expected) in zip(answers, notes, strict=True):
        known = [(a, b) for a, b in zip(reported, expected, strict=True) if b]
        for actual, wanted in known:
            assert actual == pytest.approx(wanted)


def notes_of_a_link(seed: int, protocol: str) -> tuple[list[list[Any]], list[Any]]:
    """What a client notes of the arrivals of a link, and what Python believes then, if anything."""
    random = np.random.default_rng(seed)
    latency = float(random.uniform(0.01, 0.3))
    link = FluidLink(Conditions(float(random.uniform(2e4, 2e7)), latency, protocol=protocol))
    estimate = Estimate(link, PRIOR_BANDWIDTH, PRIOR_LATENCY)
    calls: list[list[Any]] = []
    expected: list[Any] = []
    asked: list[Request] = []
    begun: set[int] = set()
    carried = 0.0

    def note(name: str, *values: float) -> None:
        calls.append([name, *values])
        expected.append(None)

    def wait(until: float) -> Request | None:
        """Moments at which responses begin are told when they are over, as the link tells them."""
        nonlocal carried
        finished = link.advance(until)
        estimate.observe(finished)
        new = [(r.first_byte, n) for n, r in enumerate(asked) if r.first_byte is not None]
        for first_byte, n in sorted(new):
            if n not in begun:
                begun.add(n)
                note("sent", n, asked[n].sent)
                note("firstByte", n, first_byte)
        note("bytes", link.now, link.carried - carried)
        carried = link.carried
        if finished:
            note("finished", asked.index(finished), link.now)
        expected[-1] = [estimate.bandwidth, estimate.latency, estimate.duration(5000)]
        return finished

    for _ in range(12):
        for _ in range(int(random.integers(0, 4))):
            asked.append(link.request(int(random.integers(1, 40_000)), float(random.random())))
        until = link.now + float(random.uniform(0.05, 2))
        while wait(until):
            pass
    return calls, expected


def test_a_queue_is_no_latency(tmp_path: Path) -> None:
    """Responses that come one after the other, as over HTTP/2, in packets of 30 ms: the link was
    busy between them, and only the first one tells how long the way is."""
    calls: list[list[Any]] = []
    ways = [(k, 0.0, 0.2 + 0.03 * k) for k in range(40)]
    ways += [(k, 0.2 + 0.03 * (k - 40), 0.2 + 0.03 * k) for k in range(40, 400)]
    for k, sent, came in ways:
        calls += [["sent", k, sent], ["firstByte", k, came], ["bytes", came, 2000]]
        calls.append(["finished", k, came])
    believed = called(tmp_path, [("estimate", {"calls": calls, "size": 0})])[0]
    for k in (150, 250, 399):
        bandwidth, latency, _ = believed[4 * k + 3]
        assert latency == pytest.approx(0.2)
        assert bandwidth == pytest.approx(8 * 2000 / 0.03, rel=0.05)


@pytest.mark.parametrize(("behind", "expected"), [(0.1, 0.3), (0.6, 0.5)])
def test_only_a_shorter_wait_behind_another_counts(
    tmp_path: Path, behind: float, expected: float
) -> None:
    calls: list[list[Any]] = []
    for k in range(12):
        alone, other = 2 * k, 2 * k + 1
        calls += [["sent", alone, 2.0 * k], ["firstByte", alone, 2 * k + 0.5]]
        calls += [["sent", other, 2 * k + 0.7], ["finished", alone, 2 * k + 0.75]]
        begins = 2 * k + 0.7 + behind
        calls += [["firstByte", other, begins], ["finished", other, begins]]
    *_, (_, latency, _) = called(tmp_path, [("estimate", {"calls": calls, "size": 0})])[0]
    assert latency == pytest.approx(expected)


@pytest.mark.parametrize("normals", [False, True])
def test_the_catalogue_of_an_index(tmp_path: Path, world: World, normals: bool) -> None:
    served = replace(world.served, index=json.loads(json.dumps(world.served.index)))
    for row in served.index["textures"][::2] if normals else ():
        row["normals"] = True
    expected = tables(catalogue_of(served, world.pyramids.differences, world.pyramids.mean))
    sizes = {"recordBytes": served.record_bytes, "geometryBytes": served.geometry_bytes}
    index = json.loads(json.dumps(served.index))
    for c, cell in enumerate(index["cells"]):
        cell |= {name: int(size[c]) for name, size in sizes.items()}
    actual = called(tmp_path, [("catalogue", {"index": index})])[0]
    flat = {k: np.ravel(v).tolist() if isinstance(v, list) else v for k, v in expected.items()}
    assert actual == flat


def test_requests_at_a_time(tmp_path: Path) -> None:
    """As many as the protocol takes; one that browsers do not name is the old one."""
    protocols = ["", "http/1.1", "h2", "h3"]
    assert called(tmp_path, [("concurrency", {"protocols": protocols})])[0] == [6, 6, 24, 24]


@EACH
@settings(max_examples=5)
@given(
    st.lists(
        st.tuples(SEEDS, st.booleans(), st.booleans()),
        min_size=5,
        max_size=5,
        unique_by=lambda walk: walk[0],
    )
)
def test_walks(
    tmp_path_factory: pytest.TempPathFactory, policy: str, walks: list[tuple[int, bool, bool]]
) -> None:
    """What it holds, has, lacks and asks for, at each look and each arrival."""
    witnesses = [a_walk(policy, *walk) for walk in walks]
    answers = in_javascript(tmp_path_factory.mktemp("walk"), *witnesses)
    for witness, own in zip(witnesses, answers, strict=True):
        assert same(own, witness.answers)


def a_walk(policy: str, seed: int, previews: bool, meshes: bool) -> Witness:
    random = np.random.default_rng(seed)
    # The paper's client knows none; the page's fetches those that the `.ptm` lacks.
    previews &= policy == "best"
    made = any_world(seed, 40, previews=previews, meshes=meshes)
    witness = Witness(made, policy, int(random.integers(0, 3000)))
    bandwidth = float(random.choice([2e3, 2e4, 2e5, 1e7]))
    witness.walk(Conditions(bandwidth, float(random.choice([0.0, 0.05, 0.3]))))
    return witness


@EACH
@pytest.mark.parametrize("bandwidth", [56e3, 512e3, 4e6])
def test_a_walk_through_a_database(
    tmp_path: Path, world: World, policy: str, bandwidth: float
) -> None:
    witness = Witness(world, policy, world.catalogue.whole // 4)
    witness.walk(Conditions(bandwidth))
    (answers,) = in_javascript(tmp_path, witness)
    assert same(answers, witness.answers)
    looks = [a for a, e in zip(answers, witness.events, strict=True) if e["act"] == "look"]
    assert any(any(column) for column, _ in looks)
    if policy == "best":
        assert bandwidth > 1e5 or max(lacking for _, lacking in looks) > 1
        assert bandwidth < 1e6 or min(lacking for _, lacking in looks) == 0


@EACH
@pytest.mark.parametrize("seed", range(1, 7))
def test_a_link_that_fails(tmp_path: Path, policy: str, seed: int) -> None:
    """No range twice or on top of another, nothing sooner again than was said, never more than is
    there or the budget holds; and in the end all is there."""
    random = np.random.default_rng(seed)
    shapes = sorted((int(random.integers(5)), t) for t in range(8))
    world = standing(catalogue([raw(128)] * 8, shapes, cells=5, random=random), 1.0)
    file = tmp_path / "life.json"
    write(file, {**documents(world), "policy": policy, "seed": seed})
    reported = json.loads(run(HERE / "life.mjs", file))
    assert reported["failures"] > 0
    assert [reported[name] for name in ("overlaps", "beyond", "above", "early")] == [0] * 4
    assert reported["forgotten"]
    assert reported["again"] > 0
    assert reported["missing"] == 0
