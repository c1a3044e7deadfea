"""Runs of all policies in made worlds: what no client may do, and what all of them must come to."""

from __future__ import annotations

import itertools
import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings, strategies as st

from ptmtools.arrays import Floats, Ints
from ptmtools.link import Conditions
from ptmtools.site import opening as openings
from ptmtools_lab.client import Client, FileKind, Range
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.policies.whole_files import LruClient
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.world import World, opening_of
from tests.lab.links import CONDITIONS
from tests.lab.worlds import SEEDS, any_world, catalogue, for_policy, raw, standing

#: A world of a smaller seed is no smaller.
PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
EACH = pytest.mark.parametrize("policy", POLICIES)
BUDGETS = st.integers(0, 10_000) | st.just(1 << 40)
#: From a modem on.
LINKS = st.builds(
    replace, CONDITIONS, bandwidth=st.none() | st.floats(2e3, 1e5) | st.floats(1e5, 1e8)
)


class Witness:
    """Plays a client, and checks in each frame what it has against what it was sent."""

    def __init__(self, world: World, policy: str, conditions: Conditions, budget: int) -> None:
        world = for_policy(world, policy)
        self.world, self.requests, self.frames = world, list[Request](), 0
        self.run = simulate(
            world, replace(POLICIES[policy], client=self._watched(policy)), conditions, budget
        )

    def _watched(self, policy: str) -> Any:
        def make(world: World, link: FluidLink, budget: int) -> Client:
            self.client, self.link = POLICIES[policy].client(world, link, budget), link
            ask, look = link.request, self.client.look

            def request(*given: Any, **more: Any) -> Request:
                self.requests.append(ask(*given, **more))
                return self.requests[-1]

            def watched(frame: int) -> None:
                look(frame)
                self._check(frame)

            link.request = request  # type: ignore[method-assign]
            self.client.look = watched  # type: ignore[method-assign]
            return self.client

        return make

    @property
    def asked(self) -> list[Request]:
        """The requests, and the parts of their responses that have begun since."""
        parts = []
        for request in self.requests:
            part: Request | None = request
            while part:
                parts.append(part)
                part = part.following
        return parts

    def _check(self, frame: int) -> None:
        stock, client = self.world.catalogue, self.client
        assert self.link.now == self.world.track.time[frame]
        self.frames += 1
        each = np.arange(stock.texture_count)
        assert (client.column <= stock.levels).all()
        assert (stock.ends[each, client.column] <= self._sent(FileKind.TEXTURE, len(each))).all()
        cells = np.arange(stock.cell_count)
        whole = self._sent(FileKind.GEOMETRY, len(cells)) >= stock.geometry_bytes
        assert (client.geometry.whole == whole).all()

    def _sent(self, kind: FileKind, count: int) -> Ints:
        """(n,) bytes of each file that came without a gap."""
        there = np.zeros(count, np.int64)
        parts = [r for r in self.asked if isinstance(r.tag, Range) and r.tag.kind == kind]
        for request in sorted(parts, key=lambda r: r.tag.begin):  # type: ignore[attr-defined]
            part = request.tag
            assert isinstance(part, Range)
            if part.begin == there[part.number]:
                there[part.number] += part.end - part.begin if request.ended is not None else 0
        return there


@EACH
@settings(max_examples=15, phases=PHASES)
@given(SEEDS, LINKS, BUDGETS)
def test_what_no_client_may_do(policy: str, seed: int, conditions: Conditions, budget: int) -> None:
    world = any_world(seed)
    seen = Witness(world, policy, conditions, budget)
    run, stock = seen.run, world.catalogue
    assert seen.frames == len(run.time) == world.frames
    # Memory.
    each = np.arange(stock.texture_count)
    held = stock.memory[each, run.column].sum(axis=1)
    assert (held <= budget).all()
    assert (held == run.memory).all()
    assert run.overruns == 0
    # The link.
    link = seen.link
    arriving = sum(r.body_bytes for r in seen.asked if r.ended is None)
    known = run.body - arriving + run.overhead
    assert math.isclose(link.carried, known + link.partial, abs_tol=1e-6)
    assert math.isclose(run.body, sum(r.body_bytes for r in seen.asked))
    assert run.requests == len(seen.requests)
    assert (np.diff(run.fetched) >= 0).all()
    assert run.fetched[-1] == run.body
    assert run.useful <= run.body + 1e-6
    _check_once(seen)
    _check_changes(run, world)
    # What is seen.
    assert (run.error >= 0).all()
    assert (run.error <= of_nothing(world) + 1e-4).all()
    for share in (run.quality, run.missing):
        assert (share >= 0).all()
        assert (share <= 1 + 1e-6).all()


def _check_changes(run: WalkRun, world: World) -> None:
    """Levels that come are uploaded, those that go cost nothing."""
    uploads = switches = 0
    for memory, columns in zip(world.catalogue.memory, run.column.T.tolist(), strict=True):
        for before, after in itertools.pairwise([0, *columns]):
            uploads += int(memory[max(before, after)] - memory[before])
            switches += before != after
    assert (run.uploads, run.switches) == (uploads, switches)
    assert run.stalls == sum(not run.loaded[f, c] for f, c in enumerate(world.track.cell.tolist()))


def _check_once(seen: Witness) -> None:
    """Each byte is asked for once."""
    ranges: dict[tuple[FileKind, int], list[tuple[int, int]]] = {}
    for request in seen.asked:
        part = request.tag
        assert isinstance(part, Range)
        assert request.size == part.end - part.begin > 0
        assert part.end <= seen.client.files[part.kind].size[part.number]
        ranges.setdefault((part.kind, part.number), []).append((part.begin, part.end))
    for parts in ranges.values():
        parts.sort()
        assert all(a[1] <= b[0] for a, b in itertools.pairwise(parts))


def same(a: WalkRun, b: WalkRun) -> bool:
    values = [(getattr(a, f.name), getattr(b, f.name)) for f in fields(WalkRun)]
    return all(
        x.tobytes() == y.tobytes() if isinstance(x, np.ndarray) else x == y for x, y in values
    )


@EACH
@settings(max_examples=5, phases=PHASES)
@given(SEEDS, LINKS, BUDGETS)
def test_the_same_run_twice(policy: str, seed: int, conditions: Conditions, budget: int) -> None:
    world = for_policy(any_world(seed), policy)
    declared = POLICIES[policy]
    first = simulate(world, declared, conditions, budget)
    assert same(first, simulate(world, declared, conditions, budget))


@settings(max_examples=8, phases=PHASES)
@given(SEEDS, st.sampled_from(["h1", "h2"]))
def test_all_come_to_the_same_without_limits(seed: int, protocol: str) -> None:
    """Who stands sees the full picture, whatever the policy, with the same levels on the screen."""
    world = any_world(seed, frames=3)
    rows = world.views.rows(0)
    texture, need = world.views.texture[rows], world.views.need[rows]
    wanted = np.zeros(world.catalogue.texture_count, np.int64)
    painted = texture >= 0
    np.maximum.at(wanted, texture[painted], (need[painted] > 0).sum(axis=1))
    # The coarsest level is one texel, of the mean colour: some see no use in it alone.
    wanted[wanted == 1] = 0
    for name, policy in POLICIES.items():
        stays = for_policy(world, name).standing(10)
        run = simulate(stays, policy, Conditions(None, protocol=protocol), 1 << 50)
        assert run.error[-1] == 0, name
        assert (np.minimum(run.column[-1], wanted) == wanted).all(), name


@EACH
@settings(max_examples=5, phases=PHASES)
@given(SEEDS)
def test_nothing_comes_before_it_can(policy: str, seed: int) -> None:
    """The index takes a latency, the record and the geometry one more, textures a third; those of
    an opening come with the index."""
    world = for_policy(any_world(seed), policy)
    run = simulate(world, POLICIES[policy], Conditions(None, latency=0.5), 1 << 40)
    opened = bool(POLICIES[policy].previews and world.opening)
    early = run.time < (0.5 if opened else 1.0)
    assert run.error[early] == pytest.approx(of_nothing(world)[early])
    assert not run.column[run.time < (0.5 if opened else 1.5)].any()
    assert run.stalls >= early.sum()


#: Policies that request geometry after the record of the cell.
AFTER_RECORD = ("lru", "whole", "gpuii")


@pytest.mark.parametrize("policy", [name for name in POLICIES if name != "paper"])
def test_a_run_counted_by_hand(policy: str) -> None:
    """Who stands before two textures gets all there is, once, and all of it is on the screen."""
    textures = [raw(8), raw(16)]
    stock = catalogue(textures, [(0, 0), (0, 1)])
    stays = for_policy(standing(stock, 5), policy)
    run = simulate(stays, POLICIES[policy], Conditions(None, 0.1), 1 << 40)
    files = sum(sum(t.groups) for t in textures) + 4000
    # The index and the record; ach-views goes by the statistics, too.
    documents = 500 + 300 + 700 * (policy == "ach-views")
    assert (run.documents, run.body, run.useful) == (documents, documents + files, files)
    assert run.overhead == 300 * run.requests
    assert run.memory[-1] == run.uploads == sum(sum(t.memory) for t in textures)
    assert run.quality[-1] == 1
    # Geometry comes after the index, and for who waits for it also after the record.
    assert run.stalls == run.loaded[:, 0].argmax() == (1 + (policy in AFTER_RECORD))


def test_a_client_that_takes_more_memory_than_there_is() -> None:
    """Is found out: none of ours is, or should be."""
    careless = replace(POLICIES["lru"], client=lambda *given: LruClient(*given[:2], 1 << 40))
    stock = catalogue([raw(8)], [(0, 0)])
    whole = stock.whole
    for budget, over in ((whole, False), (whole - 1, True)):
        run = simulate(standing(stock, 5), careless, Conditions(None), budget)
        assert run.overruns == over * np.count_nonzero(run.column[:, 0] == stock.levels[0])
    assert run.overruns > 0


def test_the_papers_quality_is_of_what_was_downloaded() -> None:
    """Whether or not any of it fits into memory."""
    stock = catalogue([raw(8)], [(0, 0)])
    run = simulate(standing(stock, 5), POLICIES["lru"], Conditions(None), 0)
    assert not run.column.any()
    assert (run.quality[0], run.quality[-1]) == (0, 1)


@settings(max_examples=20, phases=PHASES)
@given(SEEDS, st.lists(st.integers(0, 5000), min_size=2, max_size=4))
def test_more_memory_is_no_worse_for_who_knows_all(seed: int, budgets: list[int]) -> None:
    """With all downloaded, for the oracle; but for what it holds on to, a few hundredths."""
    stand = any_world(seed).standing(10)
    errors = [
        simulate(stand, POLICIES["oracle"], Conditions(None, latency=0.0), budget).error[-1]
        for budget in sorted(budgets)
    ]
    assert all(b <= a + 0.02 * (1 + a) for a, b in itertools.pairwise(errors))


@settings(max_examples=10, phases=PHASES)
@given(SEEDS)
def test_who_stands_sees_no_worse(seed: int) -> None:
    """Over a slow link, without a limit of memory, the oracle's picture only gets better."""
    stand = any_world(seed).standing(20)
    run = simulate(stand, POLICIES["oracle"], Conditions(20e3, latency=0.05), 1 << 40)
    assert (np.diff(run.error) <= 1e-6).all()


def of_nothing(world: World) -> Floats:
    """(F,) the error of each frame with nothing there."""
    return np.array(
        [world.views.error[world.views.rows(int(v)), 0].sum() for v in world.track.view]
    )


def test_an_opening_brings_the_first_view_after_one_latency() -> None:
    """What it has is not requested again, and what it lacks follows."""
    textures = [raw(8), raw(16)]
    stock = catalogue(textures, [(0, 0), (0, 1)])
    ends = stock.ends
    opening = (
        ("record", 0, int(stock.record_bytes[0])),
        ("geometry", 0, int(stock.geometry_bytes[0])),
        ("texture", 0, int(ends[0, -1])),
        ("texture", 1, int(ends[1, 2])),
    )
    link = Conditions(None, 0.5)
    bare = replace(for_policy(standing(stock, 5), "best"), opening=())
    without = simulate(bare, POLICIES["best"], link, 1 << 40)
    run = simulate(replace(bare, opening=opening), POLICIES["best"], link, 1 << 40)
    assert run.body == without.body
    assert run.overhead == 300 * run.requests
    # The index, the opening, and the rest of a texture.
    assert run.requests == 3 < without.requests
    first = int(run.column.any(axis=1).argmax())
    assert run.time[first] == pytest.approx(0.6)
    assert run.column[first].tolist() == [4, 2]
    assert not without.column[without.time < 1.4].any()
    assert run.column[-1].tolist() == without.column[-1].tolist() == [4, 5]


def test_only_a_walk_from_the_viewpoint_has_the_opening(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless that has all rooms."""
    served, stock = world.served, world.catalogue
    view = served.index["viewpoints"][0]
    eye, direction = (np.array(view[name]) for name in ("position", "direction"))
    monkeypatch.setattr(openings, "WHOLE", 1 << 40)
    everything = opening_of(served, stock, eye + 2, direction)
    assert sum(kind == "geometry" for kind, *_ in everything) == served.cell_count
    monkeypatch.setattr(openings, "WHOLE", 0)
    parts = opening_of(served, stock, eye + 0.2, direction)
    kinds = [kind for kind, _, _ in parts]
    assert kinds[:2] == ["record", "geometry"]
    assert {"texture", "preview"} & {*kinds}
    assert [number for _, number, _ in parts[:2]] == [view["cell"]] * 2
    for kind, number, end in parts:
        size = {
            "record": stock.record_bytes, "geometry": stock.geometry_bytes,
            "texture": stock.ends[:, -1], "preview": stock.previews.bytes,
        }[kind][number]  # fmt: skip
        assert 0 < end <= size
        assert kind == "texture" or end == size
    assert opening_of(served, stock, eye + 2, direction) == ()
    # A database of an earlier release has no site.
    rows = [
        {k: v for k, v in row.items() if k != "differences"} for row in served.index["textures"]
    ]
    old = replace(served, index={**served.index, "textures": rows})
    assert opening_of(old, stock, eye, direction) == ()
    assert opening_of(served, stock, eye, -direction) == ()
