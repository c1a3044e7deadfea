"""The paper's client, against what §6 says in closed form and by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from ptmtools.arrays import Floats, Ints
from ptmtools.link import Conditions
from ptmtools_lab.client import Client, FileKind, Range
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.policies.paper import PaperClient, PaperOptions, refresh, share_out
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.world import World
from tests.lab.worlds import ROOM, Texture, catalogue, raw, standing, strolling, world

MIB = 1 << 20
LARGE = raw(1024)
PAPER = POLICIES["paper"]


def bare(bandwidth: float | None) -> Conditions:
    """No latency and no headers."""
    return Conditions(bandwidth, latency=0.0, overhead=0)


class Watched(PaperClient):
    """Keeps what it asked for, and when."""

    asks: list[tuple[float, Range]]
    requests: list[Request]

    def ask(self, kind: FileKind, number: int, end: int, priority: float) -> None:
        before = int(self.files[kind].asked[number])
        self.asks = [
            *getattr(self, "asks", []),
            (self.link.now, Range(kind, number, before, end)),
        ]
        super().ask(kind, number, end, priority)


def played(
    made: World, conditions: Conditions, budget: int, options: PaperOptions | None = None
) -> tuple[WalkRun, Watched]:
    """A run of the paper's client, and the client."""
    clients: list[Client] = []

    def make(made: World, link: FluidLink, budget: int) -> Client:
        clients.append(Watched(made, link, budget, options or PaperOptions()))
        return clients[0]

    policy = replace(PAPER.with_options(options or PaperOptions()), client=make)
    run = simulate(made, policy, conditions, budget)
    return run, cast("Watched", clients[0])


# §6.2: how far a level may go.


@pytest.mark.parametrize(
    ("bandwidth", "moving", "still"), [(56e3, 6, 8), (512e3, 7, 10), (None, 11, 11)]
)
def test_levels_of_a_texture_of_1024(bandwidth: float | None, moving: int, still: int) -> None:
    """A level is asked for if it comes within 0.5 s, and 20 s for who stands."""
    stock = catalogue([LARGE], [(0, 0)])
    for made, levels in ((strolling(stock, 60), moving), (standing(stock, 60), still)):
        run = simulate(made, PAPER, bare(bandwidth), 4 * MIB)
        assert run.quality[-1] == levels / 11
        assert run.column[-1] == levels


@pytest.mark.parametrize("latency", [0.0, 0.2, 0.49, 0.51])
def test_the_latency_counts_in_what_a_level_takes(latency: float) -> None:
    stock = catalogue([LARGE], [(0, 0)], geometry=40_000)
    conditions = Conditions(512e3, latency=latency, overhead=0)
    run = simulate(strolling(stock, 60), PAPER, conditions, 4 * MIB)
    levels = sum(latency + 8 * size / 512e3 <= 0.5 for size in LARGE.groups)
    assert run.quality[-1] == levels / 11


def test_what_a_texture_of_1024_takes() -> None:
    """4 MB hold exactly one, by the paper's three bytes a texel."""
    assert sum(LARGE.memory) == 4 * MIB - 1
    stock = catalogue([LARGE], [(0, 0)])
    for budget, levels in ((4 * MIB, 11), (4 * MIB - 1, 11), (4 * MIB - 2, 10)):
        run = simulate(standing(stock, 5), PAPER, bare(None), budget)
        assert run.column[-1] == levels
        assert run.overruns == 0


def test_eight_share_16_mb() -> None:
    """Half of it lies idle: what cannot reach the next level is not given back."""
    stock = catalogue([LARGE] * 8, [(0, t) for t in range(8)])
    run = simulate(standing(stock, 5), PAPER, bare(None), 16 * MIB)
    # An eighth is 2 MB, which is kept, as S(11) is 4 MB; but it holds only S(10), 1 MB.
    assert run.column[-1].tolist() == [10] * 8
    assert run.memory[-1] == 8 * (MIB - 1)


def test_a_second_of_standing_makes_a_client_patient() -> None:
    stock = catalogue([LARGE], [(0, 0)])
    _, client = played(standing(stock, 5), bare(512e3), 4 * MIB)
    beyond = int(stock.ends[0, 7])
    levels = [(when, part) for when, part in client.asks if part.kind == FileKind.TEXTURE]
    assert [part.end for _, part in levels[:8]] == stock.ends[0, 1:9].tolist()
    assert all(when < 1.0 for when, part in levels if part.end <= beyond)
    assert next(when for when, part in levels if part.end > beyond) == 1.0


def test_a_greater_budget_while_standing() -> None:
    """And what does not fit any more goes at once where the viewpoint moves on."""
    stock = catalogue([LARGE] * 2, [(0, 0), (0, 1)])
    parts = [strolling(stock, 3), standing(stock, 4), strolling(stock, 1)]
    poses = [(w.track.eye, w.track.direction) for w in parts]
    made = world(stock, *(np.concatenate(part) for part in zip(*poses, strict=True)))
    run, _ = played(made, bare(None), 4 * MIB, PaperOptions(static_memory="16MiB"))
    stands = np.flatnonzero(run.still)
    assert run.column[stands[0] - 1].tolist() == [10, 10]
    assert run.column[stands[-1]].tolist() == [11, 11]
    assert run.column[stands[-1] + 1].tolist() == [10, 10]
    assert (run.memory[~run.still] <= 4 * MIB).all()
    assert run.overruns == 0
    same, _ = played(made, bare(None), 4 * MIB, PaperOptions(static_memory="inf"))
    np.testing.assert_array_equal(same.column, run.column)


def test_how_long_a_viewpoint_is_still() -> None:
    """From when on its parameters are those of a static one."""
    stock = catalogue([LARGE] * 2, [(0, 0), (0, 1)])
    parts = [strolling(stock, 3), standing(stock, 8)]
    poses = [(w.track.eye, w.track.direction) for w in parts]
    made = world(stock, *(np.concatenate(part) for part in zip(*poses, strict=True)))
    finest = {}
    for seconds in (1.0, 4.0):
        options = PaperOptions(static_memory="16MiB", static_after=seconds)
        run, _ = played(made, bare(None), 4 * MIB, options)
        whole = np.flatnonzero((run.column == 11).all(axis=1))
        finest[seconds] = run.time[whole[0]]
    assert finest[4.0] - finest[1.0] == pytest.approx(3.0)


def test_a_level_at_a_time() -> None:
    """While one is under way, no other of that texture is asked for; those of others are."""
    stock = catalogue([LARGE] * 3, [(0, 0), (0, 1), (0, 2)])
    _, client = played(strolling(stock, 20), Conditions(256e3), 16 * MIB)
    there: dict[int, int] = {}
    for _, part in (ask for ask in client.asks if ask[1].kind == FileKind.TEXTURE):
        assert part.begin == there.get(part.number, 0)
        assert part.end in stock.ends[part.number]
        assert np.searchsorted(stock.ends[0], part.end) == 1 + np.searchsorted(
            stock.ends[0], part.begin
        )
        there[part.number] = part.end
    assert len(there) == 3


@pytest.mark.parametrize("seconds", [0.01, 0.2, 3.0, 10.0])
def test_patience(seconds: float) -> None:
    stock = catalogue([LARGE], [(0, 0)])
    patient = PAPER.with_options(PaperOptions(seconds, seconds))
    levels = sum(8 * size / 512e3 <= seconds for size in LARGE.groups)
    for made in (strolling(stock, 60), standing(stock, 60)):
        assert simulate(made, patient, bare(512e3), 4 * MIB).quality[-1] == levels / 11


# §6.1: who gets which part of the budget.


def shares(
    budget: float,
    cells: Sequence[tuple[float, Sequence[int]]],
    sizes: Sequence[Sequence[int]],
    column: Sequence[int] | None = None,
    hidden: Sequence[int] = (),
) -> list[float]:
    """What each texture keeps; ``cells`` by descending hint, each with the textures of its shapes;
    ``sizes`` S(1), S(2), … of each texture; ``hidden`` shapes are out of the frustum."""
    wide = max(map(len, sizes)) + 1
    memory = np.array([[0, *row, *[row[-1]] * (wide - 1 - len(row))] for row in sizes])
    texture = np.array([t for _, row in cells for t in row], dtype=np.int64)
    shown = texture >= 0
    shown[[*hidden]] = False
    share = np.zeros(len(sizes))
    share_out(
        np.arange(len(cells)), np.array([hint for hint, _ in cells]),
        np.cumsum([0, *(len(row) for _, row in cells)]), texture, shown, memory,
        np.array([len(row) for row in sizes]),
        np.zeros(len(sizes), np.int64) if column is None else np.array(column), budget, share,
    )  # fmt: skip
    return share.tolist()


def test_hints_are_made_to_sum_to_1() -> None:
    """.6 and .3 of what is in the frustum are 2/3 and 1/3."""
    assert shares(900, [(0.6, [0]), (0.3, [1])], [[10_000], [10_000]]) == pytest.approx([600, 300])


def test_what_a_cell_does_not_use_is_left_for_the_next() -> None:
    """Of 900, the first gets 600 and uses 400; the other is alone with the 500 that are left. It
    offers 250 to the first of its two, which keeps them; and to the second, which needs 100."""
    sizes = [[400], [1000], [100]]
    actual = shares(900, [(0.6, [0]), (0.3, [1, 2])], sizes)
    assert actual == pytest.approx([400, 250, 100])


def test_what_a_shape_does_not_use_is_left_for_the_next() -> None:
    """The first needs 100 of its 250; the other is offered 400."""
    assert shares(500, [(0.3, [1, 0])], [[1000], [100]]) == pytest.approx([400, 100])


def test_three_cells() -> None:
    """1000 · .5 = 500, of which 200 are used; 800 · .3/.5 = 480, all of them; 320 · .2/.2."""
    sizes = [[200], [900], [900]]
    actual = shares(1000, [(0.5, [0]), (0.3, [1]), (0.2, [2])], sizes)
    assert actual == pytest.approx([200, 480, 320])


def test_a_texture_of_two_cells_saves_up() -> None:
    """It keeps 500 of the first cell, which are too few for 700, and 200 of the second."""
    sizes = [[700], [900]]
    actual = shares(1000, [(0.5, [0]), (0.5, [0, 1])], sizes)
    # The second cell has 500: 250 are offered, of which 200 are missing, and 300 go to the other.
    assert actual == pytest.approx([700, 300])


def test_the_next_level_counts_or_the_present_one_if_there_is_none() -> None:
    sizes = [[10, 50, 200]]
    cells = [(1.0, [0])]
    assert shares(1000, cells, sizes, [0]) == [10]
    assert shares(1000, cells, sizes, [1]) == [50]
    assert shares(1000, cells, sizes, [2]) == [200]
    assert shares(1000, cells, sizes, [3]) == [200]
    assert shares(120, cells, sizes, [3]) == [120]


def test_shapes_out_of_the_frustum_and_without_texture_get_nothing() -> None:
    actual = shares(600, [(1.0, [0, 1, -1, 2])], [[900]] * 3, hidden=[1])
    assert actual == pytest.approx([300, 0, 300])
    assert shares(600, [(1.0, [-1]), (0.5, [0])], [[900]]) == pytest.approx([600])


# §6.2: what comes and goes.

SIZES = np.array([[0, 10, 50, 200]])


def refreshed(
    share: float, column: int, have: int, *, pending: bool = False, budget: int = 1000
) -> tuple[int, bool]:
    """The column of a texture after a frame, and whether it asks for the next level."""
    after = np.array([column])
    asks = refresh(
        np.array([share]), SIZES, np.array([3]), np.array([have]), np.array([pending]), budget,
        after,
    )  # fmt: skip
    return int(after[0]), asks.tolist() == [0]


@pytest.mark.parametrize(
    ("share", "column", "have", "pending", "after", "asks"),
    [
        (50, 1, 2, False, 2, False),  # S(L+1) ≤ N, and it is there: added
        (49, 1, 2, False, 1, False),  # S(L+1) > N ≥ S(L): stays
        (9, 1, 2, False, 0, False),  # S(L) > N: removed
        (0, 3, 3, False, 2, False),  # one level a frame
        (50, 1, 1, False, 1, True),  # S(L+1) ≤ N, and it is not there: asked for
        (50, 1, 1, True, 1, False),  # … but for one that is under way
        (49, 1, 1, False, 1, False),  # … and not if it would not fit
        (999, 3, 3, False, 3, False),  # there is no level beyond the last
        (200, 0, 3, False, 1, False),  # one level a frame
    ],
)
def test_a_level_comes_or_goes(
    share: float, column: int, have: int, pending: bool, after: int, asks: bool
) -> None:
    assert refreshed(share, column, have, pending=pending) == (after, asks)


def of_two(share: Floats, column: Ints, budget: int) -> list[int]:
    after = column.copy()
    memory, three = np.repeat(SIZES, 2, axis=0), np.array([3, 3])
    refresh(share, memory, three, three, np.zeros(2, np.bool_), budget, after)
    return after.tolist()


def test_a_level_is_added_only_if_it_fits() -> None:
    """Who turns around: one texture goes level by level, the other waits for its room."""
    share = np.array([0.0, 59.0])
    seen = [column := np.array([3, 0])]
    while len(seen) < 5:
        column = np.array(of_two(share, column, 59))
        seen.append(column)
    assert [c.tolist() for c in seen] == [[3, 0], [2, 0], [1, 1], [0, 2], [0, 2]]


def test_a_budget_that_shrinks_is_kept_at_once() -> None:
    assert of_two(np.array([50.0, 50.0]), np.array([3, 3]), 100) == [2, 2]
    assert of_two(np.array([9.0, 90.0]), np.array([3, 3]), 99) == [1, 2]


# What is fetched besides, and when.


def row_of_rooms() -> World:
    """Who walks at 1 m/s through three rooms, past a second of standing in the first."""
    small = Texture((100, 300), (30, 120))
    stock = catalogue([small] * 3, [(0, 0), (1, 1), (2, 2)], 3)
    x = np.concatenate([np.full(8, 0.2), np.arange(0.2, 3 * ROOM[0] - 0.2, 0.2)])
    eye = np.stack([x, np.full(len(x), 1.6), np.full(len(x), 2.0)], axis=1)
    return world(stock, eye, np.tile([1.0, 0.0, 0.0], (len(x), 1)))


def test_the_next_cell_is_fetched_two_seconds_ahead() -> None:
    made = row_of_rooms()
    _, client = played(made, bare(None), 1000)
    when = {part.number: when for when, part in client.asks if part.kind == FileKind.RECORD}
    # The doors are at 4 m and 8 m.
    early = [
        made.track.time[np.argmax(made.track.eye[:, 0] >= door - 2 - 1e-9)] for door in (4.0, 8.0)
    ]
    assert [when[1], when[2]] == pytest.approx(early, abs=1 / made.track.rate)


def test_walls_are_no_doors() -> None:
    """The way leads past the door, which is from 1.5 m to 2.5 m."""
    made = row_of_rooms()
    aside = made.track.eye - [0.0, 0.0, 1.0]
    beside = replace(made, track=replace(made.track, eye=aside))
    _, client = played(beside, bare(None), 1000)
    when = {part.number: when for when, part in client.asks if part.kind == FileKind.RECORD}
    entered = made.track.time[np.argmax(made.track.cell == 1)]
    assert when[1] == pytest.approx(entered, abs=1e-9)


def test_the_cell_comes_before_what_it_sees_and_that_before_levels() -> None:
    """On one connection; what already waits comes sooner once the walker is there."""
    made = row_of_rooms()
    link = FluidLink(Conditions(20e3, latency=0.0, overhead=0, connections=1))
    client = Watched(made, link, 1000)
    while client.cell < 0:
        while done := link.advance(link.now + 0.1):
            client.receive(done)
        client.look(0)
        client.fetch()
    client.look(int(np.argmax(made.track.cell == 2)))
    client.fetch()
    kinds = [part.kind for _, part in client.asks]
    assert kinds[:3] == [FileKind.INDEX, FileKind.RECORD, FileKind.GEOMETRY]
    waiting = {request.tag: request.priority for request in client.waiting}
    size = int(made.catalogue.geometry_bytes[0])
    near, far = (Range(FileKind.GEOMETRY, cell, 0, size) for cell in (1, 2))
    assert waiting[far] > waiting[near]


def test_who_enters_a_cell_drops_what_it_cannot_see() -> None:
    small = Texture((100, 300), (30, 120))
    stock = catalogue([small] * 5, [(c, c) for c in range(5)], 5)
    x = np.linspace(0.2, 5 * ROOM[0] - 0.2, 100)
    eye = np.stack([x, np.full(100, 1.6), np.full(100, 2.0)], axis=1)
    made = world(stock, eye, np.tile([-1.0, 0.0, 0.0], (100, 1)))
    run, _ = played(made, bare(None), 10_000)
    for f in range(100):
        unseen = np.setdiff1d(np.arange(5), stock.in_sight[made.track.cell[f]])
        assert not run.column[f, unseen].any()
    assert run.column.max(axis=0).tolist() == [2] * 5
