"""The link between a client and its server: requests that share a bandwidth, as a fluid.

Bytes are real numbers and flow at the rate of the link, so the link changes only at events: the
first byte of a response, its last, the next step of a trace. Between two events all is linear, and
nothing is approximated. Slow start, queues in routers and the server's own time are not modelled;
`Conditions.latency` is the whole time before the first byte. Time is seconds from 0, without a
clock. No client cancels requests, so the link cannot either.

The cost of a request: `Conditions.latency` until its first byte, then `Conditions.overhead` bytes
of headers, then its body. Alone on the link it takes latency + 8 (overhead + size) / bandwidth.

`h1` (HTTP/1.1): a number of connections, six in browsers, of one request each; those that are past
their first byte share the bandwidth equally. Further requests wait for a connection, those of the
highest priority first. The connections are open at the beginning. `h2` (HTTP/2): one connection
takes all requests at once. All bandwidth goes to the request of the highest priority among those
past their latency; of two equal ones to the elder.

Loss: at a share p of lost packets, goodput is 1 − p of the bandwidth; with probability p the
request or the head of its response is lost, and the first byte comes one latency later. A seeded
generator draws once per request.
"""

from __future__ import annotations

import math
from bisect import insort
from dataclasses import dataclass
from operator import attrgetter
from random import Random

from ptmtools.link import Conditions, Step


@dataclass(eq=False, slots=True)
class Request:
    """A range of bytes that a client has requested; only its link writes it.

    Attributes
    ----------
    size: bytes of the body.
    overhead: bytes of headers, which come before.
    priority: greater values go first.
    tag: an identifier of the client's choice.
    number: number of requests made before.
    issued: time of the request, s. late: delay of its sending on its connection, s.
    sent: time of its sending, s, later if it had to wait for a connection; None before.
    first_byte: start of the arrival of its response, s; None before.
    ended: time of its end, s; None before.
    left: bytes still to arrive, headers included.
    starts: earliest arrival of its response, s.
    rest: size and tag of each part of the response that follows this one.
    following: the next part, once this one has ended.
    """

    size: int
    overhead: int
    priority: float
    tag: object
    number: int
    issued: float
    late: float = 0.0
    sent: float | None = None
    first_byte: float | None = None
    ended: float | None = None
    left: float = math.nan
    starts: float = math.inf
    rest: tuple[tuple[int, object], ...] = ()
    following: Request | None = None

    def __post_init__(self) -> None:
        self.left = float(self.overhead + self.size)

    @property
    def arrived_bytes(self) -> float:
        """Bytes that have arrived, headers included."""
        return self.overhead + self.size - self.left

    @property
    def outstanding(self) -> float:
        """Bytes still to arrive, with those of all parts that follow."""
        return self.left + sum(size for size, _ in self.rest)

    @property
    def body_bytes(self) -> float:
        """Bytes of the body, from its beginning, that the client holds."""
        return max(0.0, self.arrived_bytes - self.overhead)

    @property
    def rank(self) -> tuple[float, int]:
        """Requests of a lesser rank go first."""
        return -self.priority, self.number


_bytes_left, _rank, _starts = attrgetter("left"), attrgetter("rank"), attrgetter("starts")


class FluidLink:
    """A link with its requests.

    Bytes are booked twice: ``carried`` is the integral of the rate over time, and equals
    ``bytes + overhead_bytes + partial``.

    Attributes
    ----------
    now: s.
    busy: s during which bytes were arriving, or would have been if the link had not been down.
    carried: all bytes that have arrived.
    bytes, overhead_bytes: bytes of bodies and of headers of ended requests.
    requests: number of requests.
    """

    def __init__(self, conditions: Conditions) -> None:
        self.conditions = conditions
        self.now = self.busy = self.carried = 0.0
        self.bytes = self.overhead_bytes = 0.0
        self.requests = 0
        self._shared = conditions.protocol == "h1"
        #: Free connections.
        self._free = conditions.connections
        #: Requests without a connection, by rank; before the first byte, by its time; arriving, by
        #: rank.
        self._queue: list[Request] = []
        self._away: list[Request] = []
        self._arriving: list[Request] = []
        self._random = Random(conditions.seed)
        self._steps = conditions.trace.steps if conditions.trace else (Step(math.inf),)
        self._step, self._step_ends = -1, 0.0
        self._next_step()

    @property
    def partial(self) -> float:
        """Bytes so far of arriving requests: headers and bodies."""
        return sum(r.arrived_bytes for r in self._arriving)

    def request(
        self,
        size: int,
        priority: float,
        tag: object = None,
        late: float = 0.0,
        rest: tuple[tuple[int, object], ...] = (),
    ) -> Request:
        """Requests ``size`` bytes now, on a connection that it occupies ``late`` seconds before
        sending; ValueError for a negative size. ``rest``: sizes and tags of the further parts of
        the response, each of which arrives, and ends, as a request of its own."""
        if size < 0:
            raise ValueError(f"a request of {size} bytes")
        overhead = self.conditions.overhead
        request = Request(size, overhead, priority, tag, self.requests, self.now, late, rest=rest)
        self.requests += 1
        if self._shared:
            insort(self._queue, request, key=_rank)
            self._connect()
        else:
            self._send(request)
        return request

    def reprioritise(self, request: Request, priority: float) -> None:
        """Changes the priority of a request at once; on ``h1`` without effect once it is sent."""
        ranked = next((some for some in (self._queue, self._arriving) if request in some), None)
        if ranked is not None:
            ranked.remove(request)
        request.priority = priority
        if ranked is not None:
            insort(ranked, request, key=_rank)

    def advance(self, until: float) -> Request | None:
        """Advances time until the next request is finished, which is returned, or to ``until``, s.

        Each call returns one of the requests that finish at the same moment. ValueError if
        ``until`` is past or not finite.
        """
        if not self.now <= until < math.inf:
            raise ValueError(f"cannot advance from {self.now} s to {until} s")
        while True:
            self._turn()
            last = self.now == until
            following = min(
                until,
                self._step_ends,
                self._away[0].starts if self._away else math.inf,
            )
            whole = self._flow(following) if self._arriving else None
            if whole:
                return self._finish(whole)
            if last:
                return None
            self.now = following

    def _turn(self) -> None:
        """Handles events that are due: steps of the trace, first bytes."""
        while self._step_ends <= self.now:
            self._next_step()
        while self._away and self._away[0].starts <= self.now:
            insort(self._arriving, self._away.pop(0), key=_rank)

    def _flow(self, until: float) -> Request | None:
        """Moves bytes up to ``until``, at most until a request is complete, which is then
        returned."""
        receivers = self._arriving if self._shared else self._arriving[:1]
        nearest = min(receivers, key=_bytes_left)
        rate = self._rate / len(receivers)
        amount = nearest.left
        seconds = amount / rate if rate else math.inf if amount else 0.0
        whole = self.now + seconds <= until
        if not whole:
            seconds = until - self.now
            amount = min(amount, rate * seconds)  # rounding may exceed the rest
        for request in receivers:
            if amount and request.first_byte is None:
                request.first_byte = self.now
            request.left -= amount
        self.carried += amount * len(receivers)
        self.busy += seconds
        if not whole:
            return None
        self.now += seconds
        self._arriving.remove(nearest)
        return nearest

    def _finish(self, request: Request) -> Request:
        request.ended = self.now
        if request.first_byte is None:
            request.first_byte = self.now
        self.bytes += request.size
        self.overhead_bytes += request.overhead
        if request.rest:
            (size, tag), *rest = request.rest
            more = Request(size, 0, request.priority, tag, request.number, request.issued)
            more.rest = tuple(rest)
            request.following = more
            insort(self._arriving, more, key=_rank)
        elif self._shared:
            self._free += 1
            self._connect()
        return request

    def _connect(self) -> None:
        """Gives free connections to waiting requests."""
        while self._queue and self._free:
            self._free -= 1
            self._send(self._queue.pop(0))

    def _send(self, request: Request) -> None:
        latency = self._latency
        if self._loss and self._random.random() < self._loss:
            latency += self._latency
        request.sent = self.now + request.late
        request.starts = request.sent + latency
        insort(self._away, request, key=_starts)

    def _next_step(self) -> None:
        self._step = (self._step + 1) % len(self._steps)
        step = self._steps[self._step]
        bounds = (b for b in (self.conditions.bandwidth, step.bandwidth) if b is not None)
        self._rate = min(bounds, default=math.inf) / 8 * (1 - step.loss)
        self._latency = self.conditions.latency + step.latency
        self._loss = step.loss
        self._step_ends += step.seconds
