"""Around the application: its responses at the pace of a link, and a record of each."""

from __future__ import annotations

import time

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ptmtools.server.throttle import Flow, Link, Throttle, until
from ptmtools.server.visits import Visit, Visits

#: Bytes of a status line, of the date that uvicorn adds, and of the end of a head.
_LINE = len("HTTP/1.1 206 Partial Content\r\n")
_DATE = len("date: Mon, 23 Nov 2026 03:29:48 GMT\r\n")
_END = len("\r\n")


class Paced:
    """An ASGI application whose responses share a link, and are recorded.

    The application has to end when its client does, as Starlette's streams do: a response that
    nobody takes would keep its share of the link.
    """

    def __init__(self, app: ASGIApp, throttle: Throttle, visits: Visits | None) -> None:
        self._app = app
        self.link = Link(throttle)
        self._visits = visits

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        now = time.monotonic()
        asked = next((value for name, value in scope["headers"] if name == b"range"), None)
        visit = Visit(
            method=scope["method"],
            path=scope["raw_path"].decode("ascii"),
            range=asked.decode("latin-1") if asked is not None else None,
            begun=now,
        )
        if self._visits is not None:
            self._visits.add(visit)
        flow = self.link.open(now)

        async def paced(message: Message) -> None:
            if message["type"] == "http.response.start":
                head = _head(message)
                await until(flow.ready)
                await self._flow(flow, head)
                visit.status, visit.header_bytes = message["status"], head
                visit.length = _length(message)
                visit.first_byte = time.monotonic()
                await send(message)
                return
            body = memoryview(message.get("body", b""))
            more = message.get("more_body", False)
            while True:
                piece = await self._piece(flow, len(body)) if body else 0
                last = piece == len(body) and not more
                visit.bytes += piece
                if (
                    last or visit.bytes == visit.length
                ):  # noted first: who has the last byte finds the visit ended
                    visit.whole, visit.ended = True, time.monotonic()
                await send({**message, "body": bytes(body[:piece]), "more_body": not last})
                body = body[piece:]
                if not body:
                    return

        try:
            await self._app(scope, receive, paced)
        finally:
            self.link.close(flow)
            if not visit.whole:
                visit.ended = time.monotonic()

    async def _flow(self, flow: Flow, count: int) -> None:
        """So many bytes pass."""
        while count:
            count -= await self._piece(flow, count)

    async def _piece(self, flow: Flow, left: int) -> int:
        """Some of what is left has passed."""
        piece, through = self.link.book(flow, left, time.monotonic())
        await until(through)
        return piece


def _head(message: Message) -> int:
    """Bytes of the head of a response."""
    return _LINE + _DATE + _END + sum(len(n) + len(v) + 4 for n, v in message["headers"])


def _length(message: Message) -> int | None:
    """What a response says of the length of its body, bytes."""
    given = next((v for n, v in message["headers"] if n == b"content-length"), None)
    return None if given is None else int(given)
