"""Responses to requests for files: names, conditions, ranges, gzip copies (RFC 9110).

A file that is worth compressing has two representations with a tag each: gzip, sent whole to
clients that accept it, and the bytes themselves, in ranges to clients that ask for these. A range
never consists of compressed bytes.

Not Starlette's `FileResponse`, which knows no files in memory and no 304, answers several or
malformed ranges with multipart or 400 in place of the whole file and a HEAD with 206, omits the
headers for other origins from 416, and opens a file by its name after its state was checked.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator
from typing import BinaryIO
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

from ptmtools.files import open_regular
from ptmtools.output.emission import compress
from ptmtools.site.entry import FRESH, SiteEntry, state_of
from ptmtools.site.lookup import Lookup, name_of
from ptmtools.site.throttle import Paced, Throttle, Visits
from ptmtools.store.layout import sha256

#: Name of a file → its tag, and its gzip copy.
Copies = dict[str, tuple[str, bytes]]

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
    methods = ["GET", "HEAD"]
    common = {"X-Content-Type-Options": "nosniff"}
    if origin:
        methods.append("OPTIONS")
        # The same for all requests, so that no cache holds the wrong answer.
        common |= {
            "Access-Control-Allow-Origin": origin,
            "Access-Control-Expose-Headers": _SHOWN,
            "Timing-Allow-Origin": origin,
        }
    copies: Copies = {}

    def answer(request: Request) -> Response:
        if request.method == "OPTIONS":
            return Response(status_code=204, headers=common | _SHARED)
        name = name_of(request.scope["raw_path"])
        failed = common | {"Cache-Control": FRESH}
        try:
            if entry := files(name) if name is not None else None:
                return _response(request, entry, copies, common)
        except BlockingIOError as later:
            return Response(f"{later}\n", 503, failed | {"Retry-After": "2"}, "text/plain")
        except OSError:
            pass
        return Response("not found\n", 404, failed, "text/plain")

    # Starlette calls it in a thread of its own.
    route = Route("/{path:path}", answer, methods=methods)
    return Paced(Starlette(routes=[route]), throttle or Throttle(), visits)


def _response(
    request: Request, entry: SiteEntry, copies: Copies, common: dict[str, str]
) -> Response:
    """The response to a request for an existing file; raises as `opened`."""
    asked = request.headers
    file, size, tag = open_entry(entry)
    headers = common | {
        "Content-Type": entry.media,
        "Cache-Control": entry.caching,
        "Accept-Ranges": "bytes",
    }
    part = None
    # Ranges are defined for GET alone; those of If-Range need the very same bytes.
    if request.method == "GET" and asked.get("If-Range", tag).strip() == tag:
        part = asked_range(asked.get("Range"), size)
    if entry.compressed:
        headers["Vary"] = "Accept-Encoding"
        packs = part is None and accepts_gzip(asked.get("Accept-Encoding"))
        if packs and (copy := _copy(copies, entry.name, file, size, tag)):
            file.close()
            file, size, tag = io.BytesIO(copy), len(copy), f'{tag[:-1]}-gzip"'
            del headers["Accept-Ranges"]
            headers["Content-Encoding"] = "gzip"
    headers["ETag"] = tag
    begin, end = part or (0, size)
    if names_tag(", ".join(asked.getlist("If-None-Match")), tag):
        file.close()
        return Response(status_code=304, headers=headers)
    status = 200
    if part and begin < end:
        status, headers["Content-Range"] = 206, f"bytes {begin}-{end - 1}/{size}"
    elif part:
        status, headers["Content-Range"] = 416, f"bytes */{size}"
        headers["Cache-Control"] = FRESH
    headers["Content-Length"] = str(end - begin)
    if request.method == "HEAD" or begin == end:
        file.close()
        return Response(status_code=status, headers=headers)
    return StreamingResponse(_pieces(file, begin, end), status, headers)


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


def open_entry(entry: SiteEntry) -> tuple[BinaryIO, int, str]:
    """The bytes of an entry as an open file, their number, and a strong entity tag, of these bytes
    and no others: a name that changes with the content, a hash, or the time of the file.

    Raises OSError if its file is gone, BlockingIOError if it was replaced.
    """
    file: BinaryIO
    if isinstance(entry.source, bytes):
        file, size = io.BytesIO(entry.source), len(entry.source)
        tag = "" if entry.forever else sha256(entry.source)[:20]
    else:
        file = open_regular(entry.source)
        state = os.fstat(file.fileno())
        if entry.state not in (None, state_of(state)):
            file.close()
            raise BlockingIOError(
                f"{entry.name}: the database has been built again; load the page again"
            )
        size, tag = state.st_size, f"{state.st_mtime_ns:x}-{state.st_size:x}"
    return file, size, f'"{quote(entry.name, safe="/%") if entry.forever else tag}"'


def _pieces(file: BinaryIO, begin: int, end: int) -> Iterator[bytes]:
    """The bytes [begin, end) of a file, fewer if it has been cut since; closes it."""
    with file:
        file.seek(begin)
        while begin < end and (piece := file.read(min(_PIECE, end - begin))):
            yield piece
            begin += len(piece)


def _copy(copies: Copies, name: str, file: BinaryIO, size: int, tag: str) -> bytes:
    """The gzip copy of a file, kept from the first request; b"" where it would be no smaller."""
    if size > _MOST:
        return b""
    if name not in copies or copies[name][0] != tag:
        packed = compress(file.read())
        copies[name] = tag, packed if len(packed) < size else b""
    return copies[name][1]
