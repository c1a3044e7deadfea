"""Clients decide by past information only."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings, strategies as st

from ptmtools.arrays import Bools
from ptmtools.link import Conditions
from ptmtools_lab.catalogue import Catalogue
from ptmtools_lab.client import Client, FileKind
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.tables import WalkViews
from ptmtools_lab.world import World
from tests.lab.worlds import SEEDS, any_world, for_policy, leaf

PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
HONEST = [name for name in POLICIES if not name.startswith("oracle")]
EACH = pytest.mark.parametrize("policy", HONEST)
#: So slow that not all comes within the walk.
LINKS = st.builds(Conditions, st.floats(2e3, 5e4), st.floats(0, 0.5))
BUDGETS = st.integers(1, 10_000)


def played(
    policy: str, world: World, conditions: Conditions, budget: int
) -> tuple[WalkRun, Client, list[Request]]:
    """A run, the client as it is in the end, and what it asked for."""
    clients, asked = [], []

    def make(world: World, link: FluidLink, budget: int) -> Client:
        ask = link.request

        def request(*given: Any, **more: Any) -> Request:
            asked.append(ask(*given, **more))
            return asked[-1]

        link.request = request  # type: ignore[method-assign]
        clients.append(POLICIES[policy].client(world, link, budget))
        return clients[0]

    declared = replace(POLICIES[policy], client=make)
    run = simulate(for_policy(world, policy), declared, conditions, budget)
    return run, clients[0], asked


def did(
    run: WalkRun, _: Client, asked: list[Request], frames: int | None = None
) -> tuple[Any, ...]:
    """All that a client has done, until the last of its first frames."""
    until = run.time[:frames][-1]
    tables = [table[:frames].tobytes() for table in (run.column, run.loaded, run.fetched)]
    return tables, [(r.issued, r.tag, r.priority) for r in asked if r.issued <= until]


@EACH
@settings(max_examples=20, phases=PHASES)
@given(SEEDS, st.integers(1, 1000), st.integers(1, 20))
def test_the_way_to_come(policy: str, seed: int, budget: int, frames: int) -> None:
    """Who goes elsewhere later has done the same until then, however little fits into memory."""
    world, link = any_world(seed), Conditions(1e6, 0.05)
    before = np.arange(world.frames) < frames
    first = np.where(before, np.arange(world.frames), 0)
    other = replace(
        world,
        track=replace(
            world.track.looking(first),
            cell=np.where(before, world.track.cell, world.catalogue.cell_count - 1),
        ),
    )
    runs = [played(policy, each, link, budget) for each in (world, other)]
    assert did(*runs[0], frames) == did(*runs[1], frames)


def test_the_oracle_knows_the_way_to_come() -> None:
    """Or the test above could not fail."""
    differ = []
    for seed in range(10):
        world = any_world(seed)
        view = np.minimum(world.track.view, 4)
        stays = replace(world, track=replace(world.track, view=view))
        runs = [played("oracle", each, Conditions(5e4, 0.0), 500) for each in (world, stays)]
        differ.append(did(*runs[0], 5) != did(*runs[1], 5))
    assert any(differ)


@EACH
@settings(max_examples=15, phases=PHASES)
@given(SEEDS, LINKS, BUDGETS)
def test_what_has_not_come(policy: str, seed: int, link: Conditions, budget: int) -> None:
    """Records and geometry may say anything as long as they have not come."""
    world = any_world(seed)
    known = played(policy, world, link, budget)
    record, geometry = (known[1].files[kind].whole for kind in (FileKind.RECORD, FileKind.GEOMETRY))
    stock = _scrambled(world.catalogue, record, geometry)
    other = replace(world, catalogue=stock, views=_unseen(world.views, geometry))
    assert did(*played(policy, other, link, budget)) == did(*known)


def _scrambled(stock: Catalogue, record: Bools, geometry: Bools) -> Catalogue:
    """Where they are not there, records that say little, and shapes that are elsewhere."""
    shapes, away = stock.shapes, 7.0 * ~geometry[stock.shapes.cell][:, None]
    painted = np.where(geometry[shapes.cell], shapes.texture, -1)
    nowhere = {"leaves": [leaf(np.full(3, -99.0), np.full(3, -98.0))]}
    little = {"ach": [1.0], "adjacent": [], "need": [], "textures": [[]]}
    records: list[Any] = []
    for c, row in enumerate(stock.records):
        unsaid = {} if record[c] else {**little, "visible": [c]}
        # The paper's cells bring their hulls with their geometry.
        unplaced = {} if record[c] or geometry[c] else nowhere
        records.append({**row, **unsaid, **unplaced})
    low, high = shapes.low + away, shapes.high + 2 * away
    scrambled = replace(shapes, low=low, high=high, texture=painted)
    return replace(stock, records=tuple(records), shapes=scrambled)


def _unseen(views: WalkViews, geometry: Bools) -> WalkViews:
    """Where they are not there, cells that show nothing."""
    sight = np.where(geometry[views.cell][:, None], views.sight, 0)
    depth = np.where((views.owner >= 0) & geometry[views.owner], views.depth, np.inf)
    return replace(views, sight=sight.astype(np.float32), depth=depth.astype(np.float32))
