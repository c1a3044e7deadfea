"""A TCP proxy that stands for a thin, long link between a browser and a server on this machine.

It passes bytes on without looking at them, so HTTP/1.1, TLS and HTTP/2 are shaped alike, and every
page pays for its own handshakes and heads. The model, for each connection:

- a handshake takes one round trip: bytes sent earlier by the browser count as sent after it;
- every byte takes half a round trip in either direction; requests take no bandwidth;
- all bytes to the browser share one bandwidth; connections with bytes to send get equal shares, in
  pieces (`ptmtools.site.throttle.SharedLink`);
- TCP's slow start (RFC 5681, RFC 6928): at first `WINDOW` bytes may be on their way, and as many
  more as were acknowledged. No packet is lost, so the window only grows.

Buffers between the server and the link are small (`BUFFER`), or an HTTP/2 server could not put an
urgent response before others any more. Not modelled: lost packets, queues of other traffic, the
upload's bandwidth, DNS, and the certificate chain of a public authority, which is longer than ours.

(Tried and left: `tc netem` on a network namespace of its own has the kernel's TCP, but needs root.)
"""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ptmtools.site.throttle import SharedLink, Throttle

#: Bytes of TCP's initial window: ten segments.
WINDOW = 10 * 1460
#: Bytes that the kernel may keep on either side of the server's connection.
BUFFER = 16 << 10
_CHUNK = 8 << 10
#: s without a byte of the server, after which it had none.
_IDLE = 0.005

Floats = NDArray[np.float64]


@dataclass
class Traffic:
    """Bytes to the browser so far; written by the proxy's thread, read by others.

    Attributes
    ----------
    rows: (s of `time.monotonic`, bytes in all) at every arrival.
    connections: how many the browser opened and used.
    """

    rows: list[tuple[float, int]] = field(default_factory=lambda: [(time.monotonic(), 0)])
    connections: int = 0

    def arrived(self, count: int) -> None:
        """Adds bytes that arrive now."""
        self.rows.append((time.monotonic(), self.rows[-1][1] + count))

    def at(self, moment: Floats) -> Floats:
        """(n,) bytes that had arrived at moments of `time.monotonic`."""
        when, sent = np.array(self.rows, dtype=np.float64).T
        return sent[np.maximum(np.searchsorted(when, moment, side="right") - 1, 0)]


@contextmanager
def shaped(port: int, link: Throttle, traffic: Traffic) -> Iterator[int]:
    """The port of a proxy before another port of this machine; ``link.latency``: s of a round
    trip."""
    loop = asyncio.new_event_loop()
    listener = socket.create_server(("127.0.0.1", 0))
    proxy = _Proxy(port, link, traffic)
    thread = threading.Thread(target=loop.run_until_complete, args=(proxy.run(listener),))
    thread.start()
    try:
        yield listener.getsockname()[1]
    finally:
        loop.call_soon_threadsafe(proxy.over.set)
        thread.join()
        loop.close()
        listener.close()


class _Proxy:
    def __init__(self, port: int, link: Throttle, traffic: Traffic) -> None:
        self._port, self._traffic = port, traffic
        self._half = link.latency / 2
        self._link = SharedLink(Throttle(link.bandwidth))
        self._tasks: set[asyncio.Task[None]] = set()
        self.over = asyncio.Event()

    async def run(self, listener: socket.socket) -> None:
        listener.setblocking(False)
        accepting = asyncio.ensure_future(self._accept(listener))
        await self.over.wait()
        for task in (accepting, *self._tasks):
            task.cancel()
        await asyncio.gather(accepting, *self._tasks, return_exceptions=True)

    async def _accept(self, listener: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            client, _ = await loop.sock_accept(listener)
            task = loop.create_task(self._connection(client))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _connection(self, client: socket.socket) -> None:
        """Both directions, until either side closes."""
        loop = asyncio.get_running_loop()
        opened = time.monotonic() + 2 * self._half
        server = socket.socket()
        for one in (client, server):
            one.setblocking(False)
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        try:
            await loop.sock_connect(server, ("127.0.0.1", self._port))
            async with asyncio.TaskGroup() as both:
                both.create_task(self._up(client, server, opened))
                both.create_task(self._down(server, client))
        except* OSError:
            pass  # either side closed
        finally:
            client.close()
            server.close()

    async def _up(self, client: socket.socket, server: socket.socket, opened: float) -> None:
        """The browser's bytes, half a round trip late."""
        late = _Late(self._half)
        sending = asyncio.ensure_future(late.send_to(server))
        loop = asyncio.get_running_loop()
        used = False
        try:
            while data := await loop.sock_recv(client, _CHUNK):
                self._traffic.connections += not used
                used = True
                late.put(max(time.monotonic(), opened), data)
            late.put(time.monotonic(), b"")
            await sending
        finally:
            sending.cancel()

    async def _down(self, server: socket.socket, client: socket.socket) -> None:
        """The server's bytes, through the shared link and within the window."""
        loop = asyncio.get_running_loop()
        late, window = _Late(self._half, self._traffic), _Window(2 * self._half)
        sending = asyncio.ensure_future(late.send_to(client))
        asked = time.monotonic()
        flow = self._link.open(asked)
        try:
            while data := await loop.sock_recv(server, _CHUNK):
                # The link forgives late timers, not bytes that were not there.
                if (now := time.monotonic()) - asked > _IDLE:
                    flow.ready = max(flow.ready, now)
                body = memoryview(data)
                while body:
                    free, since = await window.free()
                    flow.ready = max(flow.ready, since)
                    piece, through = self._link.book(flow, min(len(body), free), time.monotonic())
                    await asyncio.sleep(max(0.0, through - time.monotonic()))
                    window.sent(through, piece)
                    late.put(through, bytes(body[:piece]))
                    body = body[piece:]
                self._link.close(flow)  # its share is free until it has more
                asked = time.monotonic()
            late.put(time.monotonic(), b"")
            await sending
        finally:
            self._link.close(flow)
            sending.cancel()


class _Late:
    """Bytes that arrive a fixed time after they were put; empty bytes end them."""

    def __init__(self, delay: float, traffic: Traffic | None = None) -> None:
        self._delay, self._traffic = delay, traffic
        self._queue: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

    def put(self, moment: float, data: bytes) -> None:
        self._queue.put_nowait((moment + self._delay, data))

    async def send_to(self, target: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            moment, data = await self._queue.get()
            await asyncio.sleep(max(0.0, moment - time.monotonic()))
            if not data:
                target.shutdown(socket.SHUT_WR)
                return
            await loop.sock_sendall(target, data)
            if self._traffic is not None:
                self._traffic.arrived(len(data))


class _Window:
    """How many bytes may be sent before the next acknowledgement, which takes a round trip."""

    def __init__(self, trip: float) -> None:
        self._trip, self._size, self._opened = trip, WINDOW, 0.0
        self._way: list[tuple[float, int]] = []
        self._full = False

    def sent(self, moment: float, count: int) -> None:
        self._way.append((moment + self._trip, count))

    async def free(self) -> tuple[int, float]:
        """Bytes, at least one, and the moment of the acknowledgement that they waited for."""
        while True:
            now = time.monotonic()
            while self._way and self._way[0][0] <= now:
                moment, count = self._way.pop(0)
                self._size += count
                if self._full:
                    self._opened, self._full = moment, False
            free = self._size - sum(count for _, count in self._way)
            if free > 0:
                return free, self._opened
            self._full = True
            await asyncio.sleep(self._way[0][0] - now)
