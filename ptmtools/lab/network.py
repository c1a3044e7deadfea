"""The link between a client and its server: requests that share a bandwidth, as a fluid.

Bytes are real numbers and flow at the rate of the link, so that the link changes only at events:
the first byte of a response, its last, the end of what was under way when a request was cancelled,
the next step of a trace. Between two events all is linear, and nothing is approximated. Slow start,
queues in routers and the server's own time are not modelled; `Conditions.latency` is all that
passes before the first byte. Time is seconds from 0, on no clock.

What a request costs: `Conditions.latency` until its first byte, then `Conditions.overhead` bytes of
headers, then its body. Alone on the link it takes latency + 8 (overhead + size) / bandwidth.

`h1` (HTTP/1.1): so many connections, six in browsers, of one request each; those that are past
their first byte share the bandwidth equally. Further requests wait for a connection, those of the
highest priority first. The connections are open at the beginning.
`h2` (HTTP/2): one connection takes all requests at once, and all of the bandwidth goes to that of
the highest priority among those past their latency, of two equal ones to the elder.

Cancelling: what the client holds stays, and so does, on the link, what the server has sent by then,
that is what would arrive within half a latency; nobody wants it any more. On `h1` the connection is
lost, and the one opened in its place costs its first request one more latency.

Loss: at a share p of lost packets, goodput is 1 − p of the bandwidth, and with the probability p
the request or the head of its response is itself lost, and the first byte comes one latency later.
The draws are those of a seeded generator, one a request.

A range of bytes that a client has asked for, as `Link` keeps it.
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
    """For the client to read; only its link writes it.

    Attributes
    ----------
    size: bytes of the body.
    overhead: bytes of headers, which come before.
    priority: the greater, the sooner.
    tag: whatever the client wants to know it by.
    number: how many requests were made before.
    issued: when it was asked for, s. late: so many seconds later it goes out on its connection.
    sent: when it went out, s, later than that if it had to wait for a connection; None before.
    first_byte: when its response began to arrive, s; None before.
    ended: when it was finished or cancelled, s; None before.
    finished, cancelled: whether it has come whole; whether the client gave it up.
    left: bytes that are yet to come, headers included.
    kept: what ``left`` was when it was cancelled: what came later, nobody wanted.
    starts, stops: when its response may begin to arrive, s; when, once it is cancelled, the last of
        what was under way has arrived.
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
    finished: bool = False
    cancelled: bool = False
    left: float = math.nan
    kept: float = math.nan
    starts: float = math.inf
    stops: float = math.inf

    def __post_init__(self) -> None:
        self.left = float(self.overhead + self.size)

    @property
    def arrived(self) -> float:
        """Bytes that arrived while they were wanted, headers included."""
        return self.overhead + self.size - (self.kept if self.cancelled else self.left)

    @property
    def received(self) -> float:
        """Bytes of the body, from its beginning, that the client holds."""
        return max(0.0, self.arrived - self.overhead)

    @property
    def unwanted(self) -> float:
        """Bytes that arrived when it had been cancelled, headers included."""
        return self.kept - self.left if self.cancelled else 0.0

    @property
    def rank(self) -> tuple[float, int]:
        """Requests with a lesser one go first."""
        return -self.priority, self.number


#: So much of a latency is what the server sends on its way.
_UNDER_WAY = 0.5
_left, _rank = attrgetter("left"), attrgetter("rank")
_starts, _stops = attrgetter("starts"), attrgetter("stops")


class Link:
    """A link, and what is on it.

    Bytes are booked twice: ``carried`` is the integral of the rate over time, and equals
    ``bytes + overhead_bytes + wasted + partial``.

    Attributes
    ----------
    now: s.
    busy: s during which something was arriving, or would have been had the link not been down.
    carried: all bytes that have arrived.
    bytes, overhead_bytes: of bodies and of headers, of requests that have ended, before they ended.
    wasted: bytes that arrived after their request had been cancelled, once the last of them has.
    requests: how many there were.
    """

    def __init__(self, conditions: Conditions) -> None:
        self.conditions = conditions
        self.now = self.busy = self.carried = 0.0
        self.bytes = self.overhead_bytes = self.wasted = 0.0
        self.requests = 0
        self._shared = conditions.protocol == "h1"
        #: Connections that are free: open ones, and those that are to be opened.
        self._open, self._closed = conditions.connections, 0
        #: Without a connection, by rank; before the first byte, by its time; arriving, by rank;
        #: cancelled ones of the latter two, by the end of what is under way.
        self._queue: list[Request] = []
        self._away: list[Request] = []
        self._arriving: list[Request] = []
        self._unwanted: list[Request] = []
        self._random = Random(conditions.seed)
        self._steps = conditions.trace.steps if conditions.trace else (Step(math.inf),)
        self._step, self._step_ends = -1, 0.0
        self._next_step()

    @property
    def partial(self) -> float:
        """Bytes so far of what is still arriving: headers, bodies, and what is unwanted."""
        return sum(r.unwanted if r.cancelled else r.arrived for r in self._arriving)

    def request(self, size: int, priority: float, tag: object = None, late: float = 0.0) -> Request:
        """Ask for ``size`` bytes now; ValueError if they are fewer than none. It goes out so many
        seconds late, ``late``, on a connection that it has taken."""
        if size < 0:
            raise ValueError(f"a request of {size} bytes")
        request = Request(
            size, self.conditions.overhead, priority, tag, self.requests, self.now, late
        )
        self.requests += 1
        if self._shared:
            insort(self._queue, request, key=_rank)
            self._connect()
        else:
            self._send(request, self._latency)
        return request

    def reprioritise(self, request: Request, priority: float) -> None:
        """Change the priority of a request: at once, and on ``h1`` to no effect once it is sent."""
        ranked = next((some for some in (self._queue, self._arriving) if request in some), None)
        if ranked is not None:
            ranked.remove(request)
        request.priority = priority
        if ranked is not None:
            insort(ranked, request, key=_rank)

    def cancel(self, request: Request) -> None:
        """Give a request up now; nothing happens to one that has ended."""
        if request.ended is not None:
            return
        request.kept, request.cancelled, request.ended = request.left, True, self.now
        if request.sent is None:
            self._queue.remove(request)
            return
        self.bytes += request.received
        self.overhead_bytes += request.arrived - request.received
        request.stops = self.now + _UNDER_WAY * self._latency
        insort(self._unwanted, request, key=_stops)
        if self._shared:
            self._closed += 1
            self._connect()

    def advance(self, until: float) -> Request | None:
        """Let time pass until the next request is finished, which is returned, or ``until``, s.

        Of requests that are finished at the same moment each call returns one. ValueError if
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
                self._unwanted[0].stops if self._unwanted else math.inf,
            )
            whole = self._flow(following) if self._arriving else None
            if whole and not whole.cancelled:
                return self._finished(whole)
            if whole:
                self._unwanted.remove(whole)
                self.wasted += whole.kept
            elif last:
                return None
            else:
                self.now = following

    def _turn(self) -> None:
        """What is due now: steps of the trace, first bytes, the end of what is unwanted."""
        while self._step_ends <= self.now:
            self._next_step()
        while self._away and self._away[0].starts <= self.now:
            insort(self._arriving, self._away.pop(0), key=_rank)
        while self._unwanted and self._unwanted[0].stops <= self.now:
            request = self._unwanted.pop(0)
            (self._arriving if request.starts <= self.now else self._away).remove(request)
            self.wasted += request.unwanted

    def _flow(self, until: float) -> Request | None:
        """What arrives by ``until``; at most until a request is whole, which then is returned."""
        receivers = self._arriving if self._shared else self._arriving[:1]
        nearest = min(receivers, key=_left)
        rate = self._rate / len(receivers)
        amount = nearest.left
        seconds = amount / rate if rate else math.inf if amount else 0.0
        whole = self.now + seconds <= until
        if not whole:
            seconds = until - self.now
            amount = min(amount, rate * seconds)  # which rounding may take beyond what is left
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

    def _finished(self, request: Request) -> Request:
        request.finished, request.ended = True, self.now
        if request.first_byte is None:
            request.first_byte = self.now
        self.bytes += request.size
        self.overhead_bytes += request.overhead
        if self._shared:
            self._open += 1
            self._connect()
        return request

    def _connect(self) -> None:
        """Connections that are free take what waits; one that is to be opened needs a latency."""
        while self._queue and self._open + self._closed:
            if self._open:
                self._open -= 1
                self._send(self._queue.pop(0), self._latency)
            else:
                self._closed -= 1
                self._send(self._queue.pop(0), 2 * self._latency)

    def _send(self, request: Request, latency: float) -> None:
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
