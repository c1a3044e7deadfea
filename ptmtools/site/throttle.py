"""A slow link between the server and all its clients together, and the record of its requests.

The model is that of a fluid on HTTP/1.1: a response begins one latency after its request, then its
head and its body flow, and the responses under way share the bandwidth equally. Here the fluid
comes in pieces. Each flow has one piece on the link at a time, in turn; a piece is as large as the
flow's share of `PIECE` seconds. So each flow receives one every 10 ms, whatever the bandwidth, as
browsers expect of a link; the shares of a second differ from the fluid's by less than a hundredth.

`SharedLink` has no clock: callers pass the time. Pieces are booked one after another, each from
the moment at which the one before it is through. A late timer of a busy server therefore costs
nothing: what could have left meanwhile leaves at once. A client that is slow to read loses its
share of the meantime, beyond `LATE`.
"""

from __future__ import annotations

import asyncio
import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ptmtools.link import Conditions

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: Seconds of the link that a round of pieces takes, one piece of each flow.
PIECE = 0.01
#: Seconds by which a client may be late to take a piece and lose nothing.
LATE = 0.05
#: Bytes of a head besides its fields: status line, the date that uvicorn adds, and the empty line.
_HEAD = len("HTTP/1.1 206 Partial Content\r\ndate: Mon, 23 Nov 2026 03:29:48 GMT\r\n\r\n")


@dataclass(frozen=True)
class Throttle(Conditions):
    """The bandwidth and the latency of the link, without latency by default; the other conditions
    do not count."""

    latency: float = 0.0


class Flow:
    """A response on the link.

    Attributes
    ----------
    ready: s, from when its next piece may be on the link.
    late: s by which the timer of its last piece was late.
    """

    def __init__(self, ready: float) -> None:
        self.ready, self.late = ready, 0.0


class SharedLink:
    """The link; its flows exist from `open` to `close`."""

    def __init__(self, throttle: Throttle) -> None:
        self.throttle = throttle
        self._rate = math.inf if throttle.bandwidth is None else throttle.bandwidth / 8
        self._flowing: set[Flow] = set()
        self._free = 0.0

    @property
    def flow_count(self) -> int:
        """Number of responses under way."""
        return len(self._flowing)

    def open(self, now: float) -> Flow:
        """A flow for a request that arrives at ``now``, s; its first byte may leave at its
        ``ready``."""
        return Flow(now + self.throttle.latency)

    def book(self, flow: Flow, remaining: int, now: float) -> tuple[int, float]:
        """Put the next of ``remaining`` bytes on the link.

        Returns their number, at least one, and the moment, s, at which they are through and more
        may be booked. ValueError if none are left.
        """
        if remaining < 1:
            raise ValueError("nothing is left to send")
        self._flowing.add(flow)
        if self._rate == math.inf:
            flow.ready = max(flow.ready, now)
            return remaining, flow.ready
        share = self._rate * PIECE / len(self._flowing)
        piece = remaining if remaining <= share else max(1, math.floor(share))
        self._free = flow.ready = max(self._free, flow.ready, now - LATE) + piece / self._rate
        return piece, flow.ready

    def close(self, flow: Flow) -> None:
        """End the flow, whole or not."""
        self._flowing.discard(flow)


@dataclass
class Exchange:
    """A request and its response.

    Attributes
    ----------
    method, path: of the request; the path as written, without the query.
    range: its ``Range`` header, or None.
    begun: s, `time.monotonic`, when it arrived.
    status: of the response, 0 before it begins.
    header_bytes, bytes: of the response's head and body, sent so far.
    length: bytes of the body, as the head says; of a HEAD that of a GET.
    first_byte, ended: s, when the head was sent, and the last byte; None before.
    whole: whether all of the response was sent; otherwise it is under way, or the client left.
    """

    method: str
    path: str
    range: str | None
    begun: float
    status: int = 0
    header_bytes: int = 0
    bytes: int = 0
    length: int | None = None
    first_byte: float | None = None
    ended: float | None = None
    whole: bool = False


class Visits(list[Exchange]):
    """Requests in the order of their arrival. The server's thread adds to it, others read it; a
    visit may change until it has ended."""

    @property
    def bytes(self) -> int:
        """Bytes sent in all, heads and bodies."""
        return sum(visit.header_bytes + visit.bytes for visit in self)


class Paced:
    """An ASGI application whose responses share a link and are recorded.

    The application has to end when its client does, as Starlette's streams do: a response without
    a reader would keep its share of the link.
    """

    def __init__(self, app: ASGIApp, throttle: Throttle, visits: Visits | None) -> None:
        self._app = app
        self.link = SharedLink(throttle)
        self._visits = visits

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        now = time.monotonic()
        asked = dict(scope["headers"]).get(b"range")
        path = scope["raw_path"].decode("ascii")
        text = None if asked is None else asked.decode("latin-1")
        visit = Exchange(scope["method"], path, text, now)
        if self._visits is not None:
            self._visits.append(visit)
        flow = self.link.open(now)

        async def send_paced(message: Message) -> None:
            if message["type"] == "http.response.start":
                await self._start(flow, visit, message, send)
            else:
                await self._body(flow, visit, message, send)

        try:
            await self._app(scope, receive, send_paced)
        finally:
            self.link.close(flow)
            if not visit.whole:
                visit.ended = time.monotonic()

    async def _start(self, flow: Flow, visit: Exchange, message: Message, send: Send) -> None:
        head = remaining = _HEAD + sum(len(n) + len(v) + 4 for n, v in message["headers"])
        flow.late = await _wait_until(flow.ready)
        while remaining:
            remaining -= await self._piece(flow, remaining)
        length = dict(message["headers"]).get(b"content-length")
        visit.length = None if length is None else int(length)
        visit.status, visit.header_bytes = message["status"], head
        visit.first_byte = time.monotonic()
        await send(message)

    async def _body(self, flow: Flow, visit: Exchange, message: Message, send: Send) -> None:
        body, more = memoryview(message.get("body", b"")), message.get("more_body", False)
        while True:
            piece = await self._piece(flow, len(body)) if body else 0
            last = piece == len(body) and not more
            visit.bytes += piece
            # Noted before sending: a client with the last byte finds the visit ended.
            if last or visit.bytes == visit.length:
                visit.whole, visit.ended = True, time.monotonic()
            await send({**message, "body": bytes(body[:piece]), "more_body": not last})
            body = body[piece:]
            if not body:
                return

    async def _piece(self, flow: Flow, remaining: int) -> int:
        """Number of bytes, of ``remaining``, that are through next."""
        piece, through = self.link.book(flow, remaining, time.monotonic() - flow.late)
        flow.late = await _wait_until(through)
        return piece


async def _wait_until(moment: float) -> float:
    """Wait for a moment of `time.monotonic`; other tasks run even if it is past. Returns by how
    many seconds it is."""
    await asyncio.sleep(max(0.0, moment - time.monotonic()))
    return max(0.0, time.monotonic() - moment)
