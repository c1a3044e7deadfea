"""`ptm serve`: a database, or a folder that `ptm publish` wrote, over HTTP to browsers on this
machine.

A server for looking and for measuring, not for the public: static hosts do that
(docs/guide/publish.md). It adds a simulated slow link and a list of requests
(`ptmtools.site.throttle`).
"""

from __future__ import annotations

import errno
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from ptmtools.errors import InputError
from ptmtools.options import option
from ptmtools.quantities import parse_bandwidth, parse_duration
from ptmtools.site.entry import SiteEntry
from ptmtools.site.lookup import Lookup, entry_lookup
from ptmtools.site.throttle import Throttle, Visits

if TYPE_CHECKING:
    from starlette.types import ASGIApp

    from ptmtools.site.edit_requests import Editing

#: Seconds for which an idle connection is kept: browsers that pause find it open.
_KEPT = 75
#: Addresses that only this machine can reach.
LOCAL = ("127.0.0.1", "::1")
#: Seconds that responses may take to end once their connections are closed.
_LATE = 0.1


@dataclass(frozen=True)
class ServeOptions:
    """Options of `ptm serve`.

    Raises InputError: PTM-I111 an impossible link, an unreadable quantity, or --edit at an address
    that other machines can reach.
    """

    heading: ClassVar[str] = "Server"

    port: int = option(0, "Port to listen on; 0 picks a free one.")
    host: str = option(
        "127.0.0.1",
        "Address to listen on; 0.0.0.0 means all addresses of this machine.",
        metavar="ADDRESS",
    )
    bandwidth: str = option(
        "inf",
        "Total bandwidth of all connections, in bit/s: 56k, 4M (k = 1,000, M = 1,000,000) or inf.",
        metavar="RATE",
    )
    latency: str = option(
        "0", "Delay before the first byte of each response: 100ms or 0.1.", metavar="TIME"
    )

    edit: bool = option(
        False,
        "Edit the tour on the page: place labels with a click, write, and save to tour.json beside "
        "the database. Open the printed address, which has the permission to write. On "
        "127.0.0.1 or ::1 only.",
    )

    def __post_init__(self) -> None:
        self.throttle  # noqa: B018 - raises for unreadable values
        if self.edit and self.host not in LOCAL:
            raise InputError(
                "PTM-I111",
                f"--edit with --host {self.host}: other machines could write",
                remedy=f"use --host {LOCAL[0]} or {LOCAL[1]}",
            )

    @property
    def throttle(self) -> Throttle:
        """The link."""
        return Throttle(parse_bandwidth(self.bandwidth), parse_duration(self.latency))


@contextmanager
def serving(
    files: Mapping[str, SiteEntry] | Lookup,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    throttle: Throttle | None = None,
    visits: Visits | None = None,
    origin: str | None = None,
    editing: Editing | None = None,
) -> Iterator[str]:
    """Serves files in a thread inside the ``with``; yields the URL, which ends in a slash.

    Parameters
    ----------
    files: by their names, or a function that finds them.
    host, port: see `running`. throttle, visits, origin: see `ptmtools.site.responses.app_of`.
    editing: of the tour, at an address of `LOCAL`.

    Raises as `running` does.
    """
    from ptmtools.site.responses import app_of

    lookup = entry_lookup(files) if isinstance(files, Mapping) else files
    lookup = editing.lookup(lookup) if editing else lookup
    app: ASGIApp = app_of(lookup, throttle=throttle, visits=visits, origin=origin)
    if editing:
        app = editing.app(app, lookup)
    with running(app, host=host, port=port) as url:
        yield url


@contextmanager
def running(app: ASGIApp, *, host: str = "127.0.0.1", port: int = 0) -> Iterator[str]:
    """Runs an ASGI application in a thread inside the ``with``; yields its URL. At the end,
    responses under way are cut.

    Parameters
    ----------
    host, port: to listen on; port 0 for any free one.

    Raises InputError: PTM-I920 the port is taken, or the address does not exist or is not
    permitted.
    """
    import asyncio

    import uvicorn

    config = uvicorn.Config(
        app,
        loop="asyncio",
        http="h11",
        ws="none",
        lifespan="off",
        log_config=None,
        log_level="critical",
        access_log=False,
        server_header=False,
        timeout_keep_alive=_KEPT,
    )
    with _listening(host, port) as listener:
        server, ended = uvicorn.Server(config), threading.Event()
        url = url_of(listener)

        async def serve() -> None:
            under_way = asyncio.create_task(server.serve(sockets=[listener]))
            await asyncio.to_thread(ended.wait)
            # At `should_exit`, uvicorn would look at its next tick, and wait again for connections.
            for connection in server.server_state.connections:
                connection.transport.abort()
            # Most responses end with their connection.
            if responses := server.server_state.tasks:
                await asyncio.wait(responses, timeout=_LATE)
            under_way.cancel()

        thread = threading.Thread(target=asyncio.run, args=(serve(),), daemon=True)
        thread.start()
        try:
            yield url
        finally:
            ended.set()
            thread.join()


def url_of(listener: socket.socket) -> str:
    """The URL of a socket for browsers on this machine."""
    host, port = listener.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def _listening(host: str, port: int) -> socket.socket:
    """A socket that listens; raises InputError PTM-I920."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family)
        # Inherited by its connections, which asyncio does not recognise as TCP: otherwise the body
        # of a small file waits 40 ms for the acknowledgement of its head.
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return listener
    except (OSError, OverflowError, UnicodeError) as fault:
        reason = f"cannot be listened on ({getattr(fault, 'strerror', None) or fault})"
        remedy = "use an address of this machine with --host, and a port from 1024 to 65535"
        if getattr(fault, "errno", None) == errno.EADDRINUSE:
            reason = "the port is taken by another program"
            remedy = "use another one with --port, or none for any free one"
        raise InputError("PTM-I920", reason, file=f"{host}:{port}", remedy=remedy) from None
