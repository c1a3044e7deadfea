"""The application: a request for a file, its conditions and ranges, and the response (RFC 9110).

A file that is worth compressing has two representations, each with a tag of its own: gzip, which is
sent whole to who takes it, and the bytes themselves, in ranges to who asks for ranges. A range is
never one of compressed bytes.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from anyio.to_thread import run_sync
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp

from ptmtools.server.lookup import Lookup, name_of
from ptmtools.server.paced import Paced
from ptmtools.server.ranges import (
    Part,
    asked_part,
    has_already,
    still_valid,
    takes_gzip,
)
from ptmtools.server.stored import Copies, Stored, stored
from ptmtools.server.throttle import Throttle
from ptmtools.server.visits import Visits
from ptmtools.site.content import Entry

FOREVER = "public, max-age=31536000, immutable"
#: May be kept, and is asked about before each use.
FRESH = "no-cache"
_BOTH = {"X-Content-Type-Options": "nosniff"}
#: What a page of another origin may ask, and may see of the answer.
_SHARED = {
    "Access-Control-Allow-Methods": "GET, HEAD",
    "Access-Control-Allow-Headers": "Range, If-Range, If-None-Match",
    "Access-Control-Max-Age": "86400",
}
_SHOWN = "Accept-Ranges, Content-Encoding, Content-Length, Content-Range, ETag"


def app_of(
    files: Lookup,
    *,
    throttle: Throttle | None = None,
    visits: Visits | None = None,
    origin: str | None = None,
) -> ASGIApp:
    """The ASGI application that serves files.

    Parameters
    ----------
    files: what there is; called from several threads.
    throttle: the link that is imitated, if one is.
    visits: records every request.
    origin: whose pages may read the files besides those of this server: an origin, or ``*``.
    """
    methods = ["GET", "HEAD"] + (["OPTIONS"] if origin else [])
    route = Route("/{path:path}", _answer(files, origin), methods=methods)
    return Paced(Starlette(routes=[route]), throttle or Throttle(), visits)


def _answer(files: Lookup, origin: str | None) -> Callable[[Request], Awaitable[Response]]:
    """What answers a request."""
    copies = Copies()
    # The same to all, whoever asks: so no cache can hold the wrong one.
    common = _BOTH | (
        {
            "Access-Control-Allow-Origin": origin,
            "Access-Control-Expose-Headers": _SHOWN,
            "Timing-Allow-Origin": origin,
        }
        if origin
        else {}
    )

    async def answer(request: Request) -> Response:
        if request.method == "OPTIONS":
            return Response(status_code=204, headers=common | _SHARED)
        name = name_of(request.scope["raw_path"])
        try:
            entry = await run_sync(files, name) if name is not None else None
            whole = stored(entry) if entry else None
        except BlockingIOError as later:
            headers = common | {"Cache-Control": FRESH, "Retry-After": "2"}
            return Response(f"{later}\n", 503, headers, "text/plain")
        except OSError:
            whole = None
        if whole is None:
            headers = common | {"Cache-Control": FRESH}
            return Response("not found\n", 404, headers, "text/plain")
        try:
            assert entry
            return await _response(request, entry, whole, copies, common)
        except BaseException:
            whole.close()
            raise

    return answer


async def _response(
    request: Request, entry: Entry, whole: Stored, copies: Copies, common: dict[str, str]
) -> Response:
    """The response to a request for what there is; it closes ``whole`` once it is sent."""
    asked = request.headers
    headers = common | {
        "Content-Type": entry.media,
        "Cache-Control": FOREVER if entry.forever else FRESH,
    }
    part = None
    if request.method == "GET" and still_valid(asked.get("If-Range"), whole.tag):
        part = asked_part(asked.get("Range"), whole.size)
    sent = whole
    if entry.compressed:
        headers["Vary"] = "Accept-Encoding"
        if part is None and takes_gzip(asked.get("Accept-Encoding")):
            sent = await copies.of(entry.name, whole) or whole
    headers["ETag"] = sent.tag
    if sent is whole:
        headers["Accept-Ranges"] = "bytes"
    else:
        whole.close()
        headers["Content-Encoding"] = "gzip"
    if has_already(", ".join(asked.getlist("If-None-Match")), sent.tag):
        sent.close()
        return Response(status_code=304, headers=headers)
    status = 200 if part is None else 206 if len(part) else 416
    if part is None:
        part = Part(0, sent.size, sent.size)
    else:
        headers["Content-Range"] = part.content_range
        if not len(part):
            headers["Cache-Control"] = FRESH
    headers["Content-Length"] = str(len(part))
    if request.method == "HEAD" or not len(part):
        sent.close()
        return Response(status_code=status, headers=headers)
    return StreamingResponse(sent.pieces(part.begin, part.end), status, headers)
