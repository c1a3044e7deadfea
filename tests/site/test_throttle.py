"""The link, on a clock of the test: its pieces counted beside the fluid of the simulator."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from itertools import pairwise
from random import Random
from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest

from ptmtools.errors import InputError
from ptmtools.link import Conditions
from ptmtools.site import throttle
from ptmtools.site.throttle import LATE, PIECE, Paced, SharedLink, Throttle, Visits
from ptmtools_lab.network import FluidLink

if TYPE_CHECKING:
    from starlette.types import Message, Receive, Scope, Send

BANDWIDTHS = [56e3, 512e3, 4e6, 16e6]
#: Seconds by which timers are late at most, as those of a busy machine are.
LATENESS = 0.004


def passed(
    link: SharedLink, requests: Sequence[tuple[float, int]], lateness: float = LATENESS
) -> list[list[tuple[float, int]]]:
    """Of each request, (when it is made, how many bytes) → when pieces were sent, and how large."""
    random = Random(1)
    flows = [link.open(begin) for begin, _ in requests]
    left = [size for _, size in requests]
    sent: list[list[tuple[float, int]]] = [[] for _ in requests]
    due = [(flow.ready, i) for i, flow in enumerate(flows)]
    heapq.heapify(due)
    waiting: dict[int, int] = {}
    while due:
        moment, i = heapq.heappop(due)
        now = moment + random.uniform(0, lateness) if lateness else moment
        if i in waiting:
            sent[i].append((now, waiting.pop(i)))
        if not left[i]:
            link.close(flows[i])
            continue
        piece, through = link.book(flows[i], left[i], now)
        left[i] -= piece
        waiting[i] = piece
        heapq.heappush(due, (through, i))
    return sent


def by(pieces: list[tuple[float, int]], moment: float) -> int:
    return sum(size for when, size in pieces if when <= moment)


@pytest.mark.parametrize("bandwidth", BANDWIDTHS)
@pytest.mark.parametrize("flows", [1, 2, 6])
def test_bandwidth_is_kept_and_shared_equally(bandwidth: float, flows: int) -> None:
    seconds = 3.0
    each = math.ceil(bandwidth / 8 * seconds)
    sent = passed(SharedLink(Throttle(bandwidth, 0.1)), [(0.0, each)] * flows)
    amounts = [by(pieces, 0.1 + seconds) for pieces in sent]
    assert sum(amounts) == pytest.approx(bandwidth / 8 * seconds, rel=0.02)
    assert min(amounts) == pytest.approx(max(amounts), rel=0.03)
    assert all(pieces[0][0] >= 0.1 for pieces in sent)


@pytest.mark.parametrize("bandwidth", BANDWIDTHS)
def test_each_of_six_gets_a_steady_stream(bandwidth: float) -> None:
    sent = passed(SharedLink(Throttle(bandwidth)), [(0.0, round(bandwidth / 8))] * 6)
    for pieces in sent:
        times = [when for when, _ in pieces]
        gaps = [b - a for a, b in pairwise(times)]
        assert max(gaps) < PIECE + 3 * LATENESS
        # Bytes are whole: of a small share less than one is lost.
        assert max(size for _, size in pieces) <= max(1.0, bandwidth / 8 * PIECE)


@pytest.mark.parametrize("bandwidth", BANDWIDTHS)
@pytest.mark.parametrize("seed", range(5))
def test_responses_end_when_they_do_in_the_simulator(bandwidth: float, seed: int) -> None:
    """As its `h1`: the same requests at the same times, up to six at once."""
    random = Random(seed)
    fluid = FluidLink(Conditions(bandwidth, 0.08, overhead=0))
    requests = []
    now, expected = 0.0, {}
    for number in range(6):
        now += random.uniform(0, 0.5)
        while finished := fluid.advance(now):
            expected[finished.tag] = fluid.now
        size = random.randint(1, round(bandwidth / 8))
        requests.append((now, size))
        fluid.request(size, 0.0, number)
    while finished := fluid.advance(1e6):
        expected[finished.tag] = fluid.now
    sent = passed(SharedLink(Throttle(bandwidth, 0.08)), requests)
    for number, pieces in enumerate(sent):
        begun = requests[number][0]
        allowed = 3 * PIECE + LATENESS + 0.02 * (expected[number] - begun)
        assert abs(pieces[-1][0] - expected[number]) < allowed, number


def test_late_timers_lose_nothing_but_long_absence_does() -> None:
    rate = 1e6 / 8
    for absence, lost in ((LATE / 2, 0.0), (1.0, 1.0 - LATE)):
        link = SharedLink(Throttle(1e6))
        flow = link.open(0.0)
        piece, through = link.book(flow, 10**6, 0.0)
        second, again = link.book(flow, 10**6, through + absence)
        assert again == pytest.approx((piece + second) / rate + lost)


@pytest.mark.parametrize(("timer", "client", "most"), [(1.0, 0.0, 2.1), (0.0, 1.0, math.inf)])
def test_the_server_may_be_late_and_a_client_may_not(
    monkeypatch: pytest.MonkeyPatch, timer: float, client: float, most: float
) -> None:
    """A second of the link, in pieces, with timers that ring a second late, or a client that takes
    each piece after a second."""
    now = 0.0

    async def sleep(seconds: float) -> None:
        nonlocal now
        now += seconds + timer * (seconds > 0)

    async def send(message: Message) -> None:
        nonlocal now
        now += client

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": bytes(125_000)})

    async def receive() -> Message:
        raise AssertionError

    monkeypatch.setattr(throttle, "time", SimpleNamespace(monotonic=lambda: now))
    monkeypatch.setattr(throttle, "asyncio", SimpleNamespace(sleep=sleep))
    visits = Visits()
    scope = {"type": "http", "method": "GET", "raw_path": b"/", "headers": []}
    paced = Paced(app, Throttle(1e6), visits)
    # Nothing in it waits for an event loop.
    with pytest.raises(StopIteration):
        paced(scope, receive, send).send(None)
    assert visits[0].bytes == 125_000
    assert now <= most
    assert now > 1.0 if timer else now > 1.0 / PIECE * (1.0 - LATE)


def test_who_gives_up_leaves_the_link_to_the_others() -> None:
    link = SharedLink(Throttle(800_000))  # 1000 bytes in a hundredth of a second
    stays, leaves = link.open(0.0), link.open(0.0)
    _, through = link.book(stays, 10**6, 0.0)
    assert link.book(leaves, 10**6, 0.0)[0] == 500
    assert link.book(stays, 10**6, through)[0] == 500
    link.close(leaves)
    assert link.book(stays, 10**6, through)[0] == 1000


def test_without_limit_only_the_latency_counts() -> None:
    link = SharedLink(Throttle(latency=0.2))
    flow = link.open(1.0)
    assert flow.ready == pytest.approx(1.2)
    assert link.book(flow, 10**9, 1.3) == (10**9, 1.3)


def test_there_is_always_a_byte() -> None:
    link = SharedLink(Throttle(1))
    flow = link.open(0.0)
    assert link.book(flow, 5, 0.0) == (1, 8.0)
    with pytest.raises(ValueError, match="nothing"):
        link.book(flow, 0, 8.0)


@pytest.mark.parametrize("wrong", [(0, 0.0), (-1, 0.0), (math.inf, 0.0), (1, -1.0), (1, math.nan)])
def test_links_that_cannot_be(wrong: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        Throttle(*wrong)
