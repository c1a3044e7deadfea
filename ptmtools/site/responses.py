"""Responses to requests for files: names, conditions, ranges, gzip copies (RFC 9110).

A file that is worth compressing has two representations with a tag each: gzip, sent whole to
clients that accept it, and the bytes themselves, in ranges to clients that ask for these. A range
never consists of compressed bytes.

Not Starlette's `FileResponse`, which knows no files in memory and no 304, answers several or
malformed ranges with multipart or 400 in place of the whole file and a HEAD with 206, omits the
headers for other origins from 416, and opens a file by its name after its state was checked.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
import re
from collections import defaultdict
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from functools import partial
from typing import BinaryIO
from urllib.parse import quote

from anyio.to_thread import run_sync
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

from ptmtools.files import open_regular
from ptmtools.output.emission import compressed
from ptmtools.site.content import Entry, state_of
from ptmtools.site.lookup import Lookup, name_of
from ptmtools.site.throttle import Paced, Throttle, Visits

FOREVER = "public, max-age=31536000, immutable"
#: May be kept, and is revalidated before each use.
FRESH = "no-cache"
#: Permissions of pages of another origin, and the fields that they may read.
_SHARED = {
    "Access-Control-Allow-Methods": "GET, HEAD",
    "Access-Control-Allow-Headers": "Range, If-Range, If-None-Match",
    "Access-Control-Max-Age": "86400",
}
_SHOWN = "Accept-Ranges, Content-Encoding, Content-Length, Content-Range, ETag"
#: Bytes that are read at a time.
_PIECE = 1 << 18
#: Files of more bytes are not compressed, which is done in memory.
_MOST = 64 << 20
#: One range; a number with more digits than any file size is malformed.
_RANGE = re.compile(r"bytes[ \t]*=[ \t,]*(\d{0,18})-(\d{0,18})[ \t,]*", re.ASCII | re.IGNORECASE)
_TAG = re.compile(r'(?:W/)?("[^"]*")')
_CODING = re.compile(r"([^\s;,]+)\s*(?:;\s*q\s*=\s*([\d.]+))?", re.ASCII | re.IGNORECASE)


def app_of(
    files: Lookup,
    *,
    throttle: Throttle | None = None,
    visits: Visits | None = None,
    origin: str | None = None,
) -> Paced:
    """The ASGI application that serves files.

    Parameters
    ----------
    files: finds a file by its name; called from several threads.
    throttle: the link to simulate.
    visits: records every request.
    origin: whose pages may read the files besides those of this server: an origin, or ``*``.
    """
    methods = ["GET", "HEAD"] + (["OPTIONS"] if origin else [])
    route = Route("/{path:path}", _answer(files, origin), methods=methods)
    return Paced(Starlette(routes=[route]), throttle or Throttle(), visits)


def _answer(files: Lookup, origin: str | None) -> Callable[[Request], Awaitable[Response]]:
    """The endpoint."""
    copies = Copies()
    common = {"X-Content-Type-Options": "nosniff"}
    if origin:
        # The same for all requests, so that no cache holds the wrong answer.
        common |= {
            "Access-Control-Allow-Origin": origin,
            "Access-Control-Expose-Headers": _SHOWN,
            "Timing-Allow-Origin": origin,
        }

    async def answer(request: Request) -> Response:
        if request.method == "OPTIONS":
            return Response(status_code=204, headers=common | _SHARED)
        name = name_of(request.scope["raw_path"])
        try:
            entry = await run_sync(files, name) if name is not None else None
            content = Content.of(entry) if entry else None
        except BlockingIOError as later:
            headers = common | {"Cache-Control": FRESH, "Retry-After": "2"}
            return Response(f"{later}\n", 503, headers, "text/plain")
        except OSError:
            entry = content = None
        if entry is None or content is None:
            headers = common | {"Cache-Control": FRESH}
            return Response("not found\n", 404, headers, "text/plain")
        try:
            return await _response(request, entry, content, copies, common)
        except BaseException:
            content.close()
            raise

    return answer


async def _response(
    request: Request, entry: Entry, content: Content, copies: Copies, common: dict[str, str]
) -> Response:
    """The response to a request for an existing file. The stream closes ``content`` in the end."""
    request_headers = request.headers
    headers = common | {
        "Content-Type": entry.media,
        "Cache-Control": FOREVER if entry.forever else FRESH,
    }
    part, size = None, content.size
    # Ranges are defined for GET alone; those of If-Range need the very same bytes.
    if (
        request.method == "GET"
        and request_headers.get("If-Range", content.tag).strip() == content.tag
    ):
        part = asked_range(request_headers.get("Range"), size)
    sent = content
    if entry.compressed:
        headers["Vary"] = "Accept-Encoding"
        if part is None and accepts_gzip(request_headers.get("Accept-Encoding")):
            sent = await copies.of(entry.name, content) or content
    headers["ETag"] = sent.tag
    if sent is content:
        headers["Accept-Ranges"] = "bytes"
    else:
        content.close()
        headers["Content-Encoding"] = "gzip"
    if names_tag(", ".join(request_headers.getlist("If-None-Match")), sent.tag):
        sent.close()
        return Response(status_code=304, headers=headers)
    status = 200
    begin, end = part or (0, sent.size)
    if part and begin < end:
        status, headers["Content-Range"] = 206, f"bytes {begin}-{end - 1}/{size}"
    elif part:
        status, headers["Content-Range"] = 416, f"bytes */{size}"
        headers["Cache-Control"] = FRESH
    headers["Content-Length"] = str(end - begin)
    if request.method == "HEAD" or begin == end:
        sent.close()
        return Response(status_code=status, headers=headers)
    return StreamingResponse(sent.pieces(begin, end), status, headers)


def asked_range(header: str | None, size: int) -> tuple[int, int] | None:
    """The bytes [begin, end) that ``Range`` asks for of a file of ``size`` bytes, empty if the file
    has none of them; None for the whole file.

    Several ranges, other units and malformed ones count as no header, which RFC 9110 permits.
    """
    match = _RANGE.fullmatch((header or "").strip())
    if not match or match.groups() == ("", ""):
        return None
    first, last = match.groups()
    if not first:
        return max(0, size - int(last)), size
    if last and int(last) < int(first):
        return None
    begin = min(int(first), size)
    return begin, min(int(last) + 1, size) if last else size


def names_tag(if_none_match: str, tag: str) -> bool:
    """Whether ``If-None-Match`` names the tag, or any."""
    return if_none_match.strip() == "*" or tag in _TAG.findall(if_none_match)


def accepts_gzip(accept_encoding: str | None) -> bool:
    """Whether ``Accept-Encoding`` allows gzip."""
    quality = {name.lower(): q or "1" for name, q in _CODING.findall(accept_encoding or "")}
    chosen = quality.get("gzip", quality.get("x-gzip", quality.get("*", "0")))
    return chosen.strip("0.") != ""


class Content:
    """Bytes to be sent, in memory or in an open file.

    Attributes
    ----------
    size: bytes. tag: a strong entity tag, of these bytes and no others.
    """

    def __init__(self, source: bytes | BinaryIO, tag: str | None = None) -> None:
        self._source = source
        if isinstance(source, bytes):
            self.size = len(source)
            self.tag = tag or f'"{hashlib.sha256(source).hexdigest()[:20]}"'
        else:
            state = os.fstat(source.fileno())
            self.size = state.st_size
            self.tag = tag or f'"{state.st_mtime_ns:x}-{state.st_size:x}"'

    @classmethod
    def of(cls, entry: Entry) -> Content:
        """The bytes of an entry. A name that changes with the content serves as tag.

        Raises OSError if its file is gone, BlockingIOError if it was replaced.
        """
        tag = f'"{quote(entry.name, safe="/%")}"' if entry.forever else None
        if isinstance(entry.source, bytes):
            return cls(entry.source, tag)
        file = open_regular(entry.source)
        if entry.state and entry.state != state_of(os.fstat(file.fileno())):
            file.close()
            raise BlockingIOError(
                f"{entry.name}: the database has been built again; load the page again"
            )
        return cls(file, tag)

    def read(self, begin: int, end: int) -> bytes | memoryview:
        """The bytes [begin, end); fewer if the file has been cut since."""
        if isinstance(self._source, bytes):
            return memoryview(self._source)[begin:end]
        self._source.seek(begin)
        return self._source.read(end - begin)

    async def pieces(self, begin: int, end: int) -> AsyncIterator[bytes | memoryview]:
        """The bytes [begin, end) in pieces; a file is read in another thread, then closed."""
        try:
            for at in range(begin, end, _PIECE):
                yield await run_sync(self.read, at, min(at + _PIECE, end))
        finally:
            self.close()

    def close(self) -> None:
        """Close the file."""
        if not isinstance(self._source, bytes):
            self._source.close()


class Copies:
    """Gzip copies, compressed at the first request and kept."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[str, Content | None]] = {}
        self._locks: defaultdict[str, asyncio.Lock] = defaultdict(asyncio.Lock)

    async def of(self, name: str, content: Content) -> Content | None:
        """The copy of a file of that name, or None where it would be no smaller."""
        if content.size > _MOST:
            return None
        async with self._locks[name]:
            tag, copy = self._kept.get(name, ("", None))
            if tag != content.tag:
                # A client that leaves does not wait for a large copy.
                copy = await run_sync(partial(_copy, content), abandon_on_cancel=True)
                self._kept[name] = content.tag, copy
            return copy


def _copy(content: Content) -> Content | None:
    packed = b""
    with suppress(OSError, ValueError):  # closed meanwhile, after its client left
        packed = compressed(bytes(content.read(0, content.size)))
    if not packed or len(packed) >= content.size:
        return None
    return Content(packed, f'{content.tag[:-1]}-gzip"')
