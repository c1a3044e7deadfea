"""A server that runs in a thread of its own, until who started it is done."""

from __future__ import annotations

import errno
import os
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ptmtools.errors import InputError
from ptmtools.lazy import component
from ptmtools.server.lookup import Lookup, among
from ptmtools.server.throttle import Throttle
from ptmtools.server.visits import Visits
from ptmtools.site.content import Entry

if TYPE_CHECKING:
    from starlette.types import ASGIApp

#: Seconds for which an idle connection is kept. Browsers that wander for a while find it open.
_KEPT = 75


@contextmanager
def serving(
    files: Mapping[str, Entry] | Lookup,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    throttle: Throttle | None = None,
    visits: Visits | None = None,
    origin: str | None = None,
) -> Iterator[str]:
    """Serves files meanwhile; yields the URL, which ends in a slash.

    Parameters
    ----------
    files: by their names, or what finds them.
    host, port: as `running` has them.
    throttle, visits, origin: as `ptmtools.server.app.app_of` has them.

    Raises as `require` and `running` do.
    """
    require()
    from ptmtools.server.app import app_of

    lookup = among(files) if isinstance(files, Mapping) else files
    app = app_of(lookup, throttle=throttle, visits=visits, origin=origin)
    with running(app, host=host, port=port) as url:
        yield url


@contextmanager
def running(app: ASGIApp, *, host: str = "127.0.0.1", port: int = 0) -> Iterator[str]:
    """Runs an ASGI application meanwhile; yields its URL. Responses that are under way at the end
    are cut.

    Parameters
    ----------
    host, port: to listen on; port 0 is any that is free.

    Raises InputError: PTM-I920 the port is taken; PTM-I921 there is no such address, or it may not
    be used.
    """
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
        timeout_graceful_shutdown=0,
    )
    with _listening(host, port) as listener:
        server = uvicorn.Server(config)
        url = url_of(listener)
        thread = threading.Thread(target=server.run, args=([listener],), daemon=True)
        thread.start()
        try:
            yield url
        finally:
            server.should_exit = True
            thread.join()


def require() -> None:
    """Raises `MissingComponentError` PTM-M920 without Starlette or uvicorn."""
    for module in ("starlette", "uvicorn"):
        component(module, "PTM-M920", f"{module} is not installed; `ptm serve` needs it", "viewer")


def url_of(listener: socket.socket) -> str:
    """Where a browser on this machine finds what listens there."""
    host, port = listener.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def _listening(host: str, port: int) -> socket.socket:
    """A socket that listens; raises InputError PTM-I920, I921."""
    place = f"{host}:{port}"
    try:
        if not 0 <= port < 1 << 16:  # of which the system would take the lower bits
            raise OverflowError("there is no such port")
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
    except (OSError, OverflowError, UnicodeError) as fault:
        raise _refused(place, fault) from None
    try:
        # A port that a server has just left is free; on Windows this would share a taken one.
        if os.name == "posix":
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen()
    except (OSError, OverflowError) as fault:
        listener.close()
        raise _refused(place, fault) from None
    return listener


def _refused(place: str, fault: Exception) -> InputError:
    if isinstance(fault, OSError) and fault.errno == errno.EADDRINUSE:
        return InputError(
            "PTM-I920",
            "the port is taken by another program",
            file=place,
            remedy="give another one with --port, or none for any that is free",
        )
    reason = getattr(fault, "strerror", None) or fault
    return InputError(
        "PTM-I921",
        f"cannot be listened on ({reason})",
        file=place,
        remedy="give an address of this machine with --host, and a port from 1024 to 65535",
    )
