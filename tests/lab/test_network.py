"""The link: nothing is lost or made, nothing comes too early, and all as the closed forms say."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.errors import InputError
from ptmtools.link import Conditions, Step, Trace
from ptmtools_lab.network import FluidLink, Request
from tests.lab.links import (
    ACTS,
    CONDITIONS,
    PROTOCOL,
    Act,
    Client,
    by_small_steps,
    run,
)

MEGABIT = 1_000_000


def close(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-6)


@given(CONDITIONS, ACTS)
def test_every_byte_is_accounted_for(conditions: Conditions, acts: list[Act]) -> None:
    client = Client(link := FluidLink(conditions))
    before = 0.0
    for _ in client.play(acts):
        held = link.bytes + link.overhead_bytes + link.partial
        assert close(held, link.carried)
        if not conditions.trace:
            assert conditions.bandwidth is not None
            assert close(link.carried, conditions.bandwidth / 8 * link.busy)
        assert before <= link.now
        assert link.busy <= link.now + 1e-9
        before = link.now
    assert close(sum(r.body_bytes for r in client.asked), link.bytes)


@given(CONDITIONS, ACTS)
def test_requests_come_whole_and_not_too_early(conditions: Conditions, acts: list[Act]) -> None:
    client = run(conditions, acts)
    assert len({id(r) for r in client.finished}) == len(client.finished) == len(client.asked)
    assert conditions.bandwidth is not None
    for r in client.finished:
        assert r.sent is not None
        assert r.first_byte is not None
        assert r.ended is not None
        assert r.body_bytes == r.size
        assert r.issued <= r.sent
        assert r.sent + conditions.latency <= r.first_byte + 1e-9
        seconds = (r.size + conditions.overhead) * 8 / conditions.bandwidth
        assert r.first_byte + seconds <= r.ended + 1e-9


@given(CONDITIONS, ACTS)
def test_connections(conditions: Conditions, acts: list[Act]) -> None:
    """On h1 there are never more than allowed, and none is idle while something waits."""
    client = Client(FluidLink(conditions))
    for _ in client.play(acts):
        under_way = sum(r.sent is not None and r.ended is None for r in client.asked)
        waiting = [r for r in client.asked if r.sent is None and r.ended is None]
        if conditions.protocol == "h2":
            assert not waiting
        else:
            assert under_way <= conditions.connections
            assert under_way == conditions.connections or not waiting


@given(CONDITIONS, ACTS)
def test_what_has_arrived_stays(conditions: Conditions, acts: list[Act]) -> None:
    client = Client(link := FluidLink(conditions))
    held: dict[Request, float] = {}
    for _ in client.play(acts):
        for r in client.asked:
            assert held.get(r, 0) <= r.body_bytes <= r.size
            held[r] = r.body_bytes
    assert link.advance(link.now + 1e3) is None
    assert link.partial == 0


def played(conditions: Conditions, acts: list[Act]) -> list[Any]:
    client = run(conditions, acts)
    link = client.link
    return [
        [(r.tag, r.sent, r.first_byte, r.ended, r.body_bytes) for r in client.asked],
        [r.tag for r in client.finished],
        (link.now, link.busy, link.carried, link.bytes, link.overhead_bytes),
    ]


@given(CONDITIONS, ACTS)
def test_the_same_calls_give_the_same_floats(conditions: Conditions, acts: list[Act]) -> None:
    assert played(conditions, acts) == played(conditions, acts)


@given(
    CONDITIONS.map(lambda conditions: replace(conditions, trace=None)),
    st.lists(st.integers(0, 100_000), min_size=1, max_size=10),
    st.lists(st.floats(0, 0.2), max_size=50),
)
def test_looking_more_often_changes_nothing(
    conditions: Conditions, sizes: list[int], looks: list[float]
) -> None:
    asks: list[Act] = [("ask", size, size % 4) for size in sizes]
    once, often = run(conditions, asks), run(conditions, asks + [("wait", t) for t in looks])
    ends = [[r.ended for r in client.asked] for client in (once, often)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)


@given(
    PROTOCOL,
    st.none()
    | st.lists(
        st.builds(Step, st.floats(0.05, 1), st.none() | st.floats(0, 1e6), st.floats(0, 0.1)),
        min_size=1,
        max_size=4,
    ).map(lambda steps: Trace((*steps, Step(0.3, 4e5)))),
    st.lists(
        st.tuples(st.floats(0, 2), st.integers(1, 40_000), st.integers(0, 99)),
        min_size=1,
        max_size=6,
        unique_by=(lambda ask: ask[2]),
    ),
)
@settings(max_examples=30)
def test_as_by_small_steps(
    protocol: str, trace: Trace | None, asks: list[tuple[float, int, int]]
) -> None:
    """The sharing and the trace, against Euler's method."""
    conditions = Conditions(8e5, 0.1, 300, protocol, trace=trace)
    asks = sorted(asks)
    tick, end = 5e-4, 8.0
    reference = by_small_steps(conditions, asks, tick, end)
    link = FluidLink(conditions)
    requests: list[Request] = []
    for when, size, rank in asks:
        while link.advance(when):
            pass
        requests.append(link.request(size, rank))
    while link.advance(end):
        pass
    # A tick's worth for each of at most six changes of who shares.
    slack = 8 * 8e5 / 8 * tick
    for mine, theirs in zip(requests, reference, strict=True):
        assert max(theirs.left, 0) == pytest.approx(mine.left, abs=slack)


@given(PROTOCOL, st.integers(1, 6), st.integers(1, 10**6))
def test_equal_requests(protocol: str, n: int, size: int) -> None:
    """h1 finishes them together, h2 one after the other."""
    link = FluidLink(Conditions(MEGABIT, 0.1, 300, protocol))
    for i in range(n):
        link.request(size, 1.0, i)
    each = 8 * (size + 300) / MEGABIT
    for i in range(n):
        request = link.advance(1e4)
        assert request is not None
        assert request.tag == i
        last = n if protocol == "h1" else i + 1
        assert link.now == pytest.approx(0.1 + last * each, rel=1e-12)


def test_the_seventh_waits_for_a_connection() -> None:
    link = FluidLink(Conditions(MEGABIT, 0.1, 0))
    first = [link.request(125, 0.0) for _ in range(6)]
    low, high = link.request(125, 1.0), link.request(125, 2.0)
    assert [r.sent for r in first] == [0.0] * 6
    assert (low.sent, high.sent) == (None, None)
    finished = link.advance(1.0)
    assert finished is first[0]
    assert link.now == pytest.approx(0.1 + 6 * 0.001)
    assert (low.sent, high.sent) == (None, link.now)
    link.reprioritise(low, 3.0)
    assert low.priority == 3.0
    assert link.advance(1.0) is first[1]
    assert low.sent == link.now


@pytest.mark.parametrize("protocol", ["h1", "h2"])
def test_a_response_of_several_parts_is_one_request(protocol: str) -> None:
    """Its parts end one after the other, as if each were alone; headers and latency come once."""
    link = FluidLink(Conditions(MEGABIT, 0.1, 300, protocol, connections=1))
    first = link.request(700, 1, "a", rest=((1000, "b"), (2000, "c")))
    other = link.request(1000, 0, "d")
    assert first.outstanding == 4000
    part, ends = first, list[tuple[object, float]]()
    while part:
        finished = link.advance(10)
        assert finished is part
        ends.append((finished.tag, finished.ended))
        part = part.following
    assert [tag for tag, _ in ends] == ["a", "b", "c"]
    assert [end for _, end in ends] == pytest.approx([0.108, 0.116, 0.132])
    # Its connection is free only then.
    assert link.advance(10) is other
    assert other.ended == pytest.approx(0.132 + (0.1 if protocol == "h1" else 0) + 0.0104)
    assert (link.requests, link.bytes, link.overhead_bytes) == (2, 4700, 600)


def test_h2_serves_the_highest_priority() -> None:
    link = FluidLink(Conditions(MEGABIT, 0.1, 0, "h2"))
    low, high = link.request(12_500, 1.0), link.request(12_500, 2.0)
    assert link.advance(0.15) is None
    assert (low.body_bytes, high.body_bytes) == (0, pytest.approx(6_250))
    urgent = link.request(1250, 3.0)
    assert link.advance(1.0) is high
    assert link.now == pytest.approx(0.2)
    assert link.advance(0.25) is None
    assert urgent.body_bytes == 0  # It begins at .25, and takes the link from the low one.
    assert link.advance(1.0) is urgent
    assert link.now == pytest.approx(0.26)
    assert low.body_bytes == pytest.approx(6_250)
    assert link.advance(1.0) is low
    assert link.now == pytest.approx(0.31)
    assert low.first_byte == pytest.approx(0.2)


def test_h2_takes_what_becomes_more_urgent_at_once() -> None:
    link = FluidLink(Conditions(MEGABIT, 0.0, 0, "h2"))
    first, second = link.request(12_500, 2.0), link.request(12_500, 1.0)
    assert link.advance(0.05) is None
    link.reprioritise(second, 3.0)
    assert link.advance(1.0) is second
    assert link.now == pytest.approx(0.15)
    assert link.advance(1.0) is first


@given(PROTOCOL, st.floats(0, 1), st.lists(st.integers(0, 10**9), min_size=1, max_size=6))
def test_without_a_limit_all_comes_after_the_latency(
    protocol: str, latency: float, sizes: list[int]
) -> None:
    link = FluidLink(Conditions(None, latency, 300, protocol))
    requests = [link.request(size, 1.0) for size in sizes]
    actual = [link.advance(latency) for _ in sizes]
    assert {id(r) for r in actual} == {id(r) for r in requests}
    assert {r.ended for r in requests} == {r.first_byte for r in requests} == {latency}
    assert link.advance(latency) is None
    assert (link.busy, link.carried) == (0, sum(sizes) + 300 * len(sizes))


def test_without_a_limit_the_seventh_comes_after_two_latencies() -> None:
    link = FluidLink(Conditions(None, 0.1))
    requests = [link.request(10**6, 1.0) for _ in range(7)]
    while link.advance(1.0):
        pass
    assert [r.ended for r in requests] == [0.1] * 6 + [0.2]


def test_a_trace_by_hand() -> None:
    """Down for a second, then a tenth of what the link would carry, at a latency of its own."""
    trace = Trace((Step(1.0, 0.0), Step(1.0, 100_000, latency=0.4)))
    link = FluidLink(Conditions(MEGABIT, 0.1, 0, trace=trace))
    request = link.request(18_750, 1.0)
    assert link.advance(2.5) is None
    assert request.first_byte == 1.0
    assert request.body_bytes == pytest.approx(12_500)
    assert link.advance(3.25) is None
    late = link.request(0, 1.0)
    assert late.starts == pytest.approx(3.25 + 0.1 + 0.4)
    assert link.advance(9.0) is request
    assert link.now == pytest.approx(3.5)


def test_loss_slows_the_link_and_delays_some() -> None:
    def played(seed: int) -> list[float]:
        trace = Trace((Step(1e4, loss=0.2),))
        link = FluidLink(Conditions(MEGABIT, 0.1, 0, connections=1, trace=trace, seed=seed))
        requests = [link.request(1000, 1.0) for _ in range(500)]
        while link.advance(1000.0):
            pass
        return [r.ended - r.sent for r in requests if r.ended and r.sent is not None]

    seconds = played(1)
    whole = 8000 / (0.8 * MEGABIT)
    late = sum(s > 0.15 for s in seconds)
    assert 60 <= late <= 140
    assert sum(seconds) == pytest.approx(500 * (0.1 + whole) + 0.1 * late)
    assert seconds == played(1) != played(2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bandwidth": 0}, "a bandwidth of 0 bit/s"),
        ({"bandwidth": math.inf}, "a bandwidth of inf bit/s"),
        ({"latency": -1}, "a latency of -1 s"),
        ({"latency": math.nan}, "a latency of nan s"),
        ({"overhead": -1}, "an overhead of -1 bytes"),
        ({"protocol": "h3"}, "the protocol 'h3', which is none of h1, h2"),
        ({"connections": 0}, "0 connections"),
    ],
)
def test_links_that_cannot_be(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=rf"no link has {message}.*\[PTM-I111\]"):
        Conditions(**options)


def test_calls_that_make_no_sense() -> None:
    link = FluidLink(Conditions())
    link.advance(1.0)
    for until in (0.5, math.inf, math.nan):
        with pytest.raises(ValueError, match="cannot advance"):
            link.advance(until)
    with pytest.raises(ValueError, match="-1 bytes"):
        link.request(-1, 1.0)
