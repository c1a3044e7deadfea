"""Links, what is asked of them, and the same once more by small steps of time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from hypothesis import strategies as st

from ptmtools.link import Conditions, Step, Trace
from ptmtools_lab.network import FluidLink, Request

PROTOCOL = st.sampled_from(["h1", "h2"])
STEPS = st.builds(
    Step,
    st.floats(0.01, 2),
    st.none() | st.just(0.0) | st.floats(1e4, 1e7),
    st.floats(0, 0.2),
    st.floats(0, 0.9),
)
#: At least one step is up, so that all comes to its end.
TRACES = st.lists(STEPS, max_size=5).map(lambda steps: Trace((*steps, Step(0.5, 5e5))))
CONDITIONS = st.builds(
    Conditions,
    bandwidth=st.floats(5e4, 2e7),
    latency=st.just(0.0) | st.floats(0, 0.5),
    overhead=st.integers(0, 500),
    protocol=PROTOCOL,
    connections=st.integers(1, 6),
    trace=st.none() | TRACES,
    seed=st.integers(0, 3),
)

#: Acts of a client: it requests bytes at a priority, waits, or changes the priority of the n-th
#: request.
Act = tuple[str, int, int] | tuple[str, float]
ACTS = st.lists(
    st.tuples(st.just("ask"), st.integers(0, 100_000), st.integers(0, 3))
    | st.tuples(st.just("wait"), st.floats(0, 2))
    | st.tuples(st.just("rank"), st.integers(0, 30), st.integers(0, 3)),
    max_size=40,
)


@dataclass
class Client:
    """Plays acts on a link, and yields after each step."""

    link: FluidLink
    asked: list[Request] = field(default_factory=list)
    finished: list[Request] = field(default_factory=list)

    def play(self, acts: list[Act]) -> Iterator[None]:
        for act in acts:
            match act:
                case "ask", size, priority:
                    self.asked.append(self.link.request(size, priority, len(self.asked)))
                case "rank", number, priority if self.asked:
                    self.link.reprioritise(self.asked[number % len(self.asked)], priority)
                case "wait", seconds:
                    yield from self.wait(self.link.now + seconds)
            yield
        while any(request.ended is None for request in self.asked):
            yield from self.wait(self.link.now + 10)

    def wait(self, until: float) -> Iterator[None]:
        while request := self.link.advance(until):
            self.finished.append(request)
            yield
        assert self.link.now == until


def run(conditions: Conditions, acts: list[Act]) -> Client:
    """A client that has played its acts to their end."""
    client = Client(FluidLink(conditions))
    for _ in client.play(acts):
        pass
    return client


@dataclass
class Ticked:
    """What is left of one request, by small steps."""

    left: float
    priority: float
    sent: float
    ended: float | None = None


def by_small_steps(
    conditions: Conditions, asks: list[tuple[float, int, int]], tick: float, end: float
) -> list[Ticked]:
    """A link without loss and without a limit of connections, by Euler's method.

    ``asks``: time, bytes and priority of each request.
    """

    def at(time: float) -> Step:
        steps = conditions.trace.steps if conditions.trace else (Step(1.0),)
        time %= sum(step.seconds for step in steps)
        for step in steps:
            if time < step.seconds:
                return step
            time -= step.seconds
        return steps[-1]

    requests = []
    for when, size, priority in asks:
        latency = conditions.latency + at(when).latency
        requests.append(Ticked(conditions.overhead + size, priority, when + latency))
    for i in range(round(end / tick)):
        now = i * tick
        ready = [r for r in requests if r.ended is None and r.sent <= now]
        if not ready:
            continue
        limits = [b for b in (conditions.bandwidth, at(now).bandwidth) if b is not None]
        amount = min(limits) / 8 * tick
        if conditions.protocol == "h2":
            first = max(ready, key=lambda r: r.priority)
            ready = [first]
        for request in ready:
            request.left -= amount / len(ready)
            if request.left <= 0:
                request.ended = now + tick
    return requests
