"""Answers the requests of the page that edits a tour (`ptm serve DB --edit`).

All requests below `/edit/` but those for sounds need the token of the server, which only the
printed address has, in the header Authorization. A page of another site cannot send that header:
the server answers no preflight. Against pages whose name leads to this machine (DNS rebinding), the
Host of every request must be the address of the server, and the Origin of those that write, too.

===========  ========  =============================================================
``tour``     GET       the document, its tag, and what its fields may name
``tour``     PUT       saves a document in the place of the one with the tag If-Match
``preview``  POST      a document as the page shows it, without saving it
``pick``     POST      the objects on a ray: ``{"eye": [x, y, z], "direction": [x, y, z]}``
===========  ========  =============================================================

Statuses: 403 the token, Host or Origin is wrong; 413 too large; 415 not JSON; 422 `ptm tour check`
would refuse the document; 412 the file was changed since; 428 no If-Match; 500 it cannot be
written; 503 the database is being built. The body of these is ``{"message": …}``, with ``code``,
``place`` and ``remedy`` of an error of ptmtools.
"""

from __future__ import annotations

import json
import math
import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from ptmtools.errors import DatabaseError, OutputError, PtmError
from ptmtools.schemas import ShapeError, parse
from ptmtools.site.editing import StaleError, TourEditor
from ptmtools.site.entry import SiteEntry
from ptmtools.site.lookup import Lookup
from ptmtools.site.program import HTML, INDEX, JAVASCRIPT, PAGE, read_built
from ptmtools.tour.reading import LARGEST

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Receive, Scope, Send

#: The script of the editor, beside that of the page.
SCRIPT = "editor.js"
_VIEWER = re.compile(r'<script type="module" src="(viewer-\w+)/viewer\.js"></script>')
_SETTINGS = re.compile(r'(<script type="application/json" id="site">)(.*?)(</script>)', re.DOTALL)
_FOLDER = re.compile(r"viewer-\w+/" + re.escape(SCRIPT))
#: Bytes of a ray.
_SMALL = 1 << 12
_HEADERS = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff"}
#: The page is in no frame of another.
_PAGE_HEADERS = _HEADERS | {
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}


class _RefusedError(Exception):
    """A response with an error."""

    def __init__(self, status: int, message: str, **more: Any) -> None:
        self.status, self.document = status, {"message": message, **more}


@dataclass(frozen=True)
class Editing:
    """A server that edits a tour; its token is new with each.

    Attributes
    ----------
    editor: of the tour.
    token: of this server.
    """

    editor: TourEditor
    token: str = field(default_factory=lambda: secrets.token_urlsafe(32), repr=False)

    @property
    def address(self) -> str:
        """What follows the URL of the server; browsers send no fragments."""
        return f"?edit#token={self.token}"

    def lookup(self, files: Lookup) -> Lookup:
        """The files of the page, with the script of the editor and the sounds of the tour."""

        def find(name: str) -> SiteEntry | None:
            if _FOLDER.fullmatch(name):
                return SiteEntry(name, read_built(PAGE / SCRIPT), JAVASCRIPT, compressed=True)
            return self.editor.media(name) or files(name)

        return find

    def app(self, plain: ASGIApp, files: Lookup) -> ASGIApp:
        """The application before that which serves the files."""

        async def answer(scope: Scope, receive: Receive, send: Send) -> None:
            response = None
            if scope["type"] == "http":
                response = await self._response(Request(scope, receive), files)
            await (response or plain)(scope, receive, send)

        return answer

    async def _response(self, request: Request, files: Lookup) -> Response | None:
        """The response, None to requests for files."""
        path = request.scope["path"]
        try:
            _check_host(request)
            if path == "/" and "edit" in request.query_params and request.method in ("GET", "HEAD"):
                return await run_in_threadpool(_page, files)
            if path.startswith("/edit/") and not path.startswith("/edit/media/"):
                return await self._answer(request, path.removeprefix("/edit/"))
        except _RefusedError as refusal:
            return JSONResponse(refusal.document, refusal.status, _HEADERS)
        return None

    async def _answer(self, request: Request, name: str) -> Response:
        answers: Mapping[tuple[str, str], tuple[int, Callable[[Request, bytes], Any]]] = {
            ("GET", "tour"): (0, self._tour),
            ("PUT", "tour"): (LARGEST, self._save),
            ("POST", "preview"): (LARGEST, self._preview),
            ("POST", "pick"): (_SMALL, self._pick),
        }
        self._check_token(request)
        if (request.method, name) not in answers:
            raise _RefusedError(
                405 if any(name == known for _, known in answers) else 404, "not known"
            )
        limit, answer = answers[request.method, name]
        if request.method != "GET":
            _check_origin(request)
            _check_type(request)
        body = await _body(request, limit)
        try:
            document = await run_in_threadpool(answer, request, body)
        except StaleError:
            raise _RefusedError(412, "tour.json was changed by another program") from None
        except PtmError as fault:
            raise _RefusedError(
                _status(fault),
                fault.message,
                code=fault.code,
                **{n: str(v) for n in ("place", "remedy", "file") if (v := getattr(fault, n))},
            ) from None
        except OSError as fault:
            raise _RefusedError(503, f"the database cannot be read ({fault})") from None
        return JSONResponse(document, headers=_HEADERS)

    def _check_token(self, request: Request) -> None:
        given = request.headers.get("Authorization", "").encode()
        if not secrets.compare_digest(given, f"Bearer {self.token}".encode()):
            raise _RefusedError(
                403, "the token is missing or wrong: open the address that `ptm serve` printed"
            )

    def _tour(self, request: Request, body: bytes) -> Any:
        document, tag = self.editor.load()
        return {
            "document": document,
            "tag": tag,
            "shown": self.editor.page_document(json.dumps(document).encode()),
            "file": str(self.editor.file),
            "rooms": self.editor.rooms(),
            "places": self.editor.places(),
            "sounds": self.editor.sounds(),
            "captions": self.editor.captions(),
        }

    def _save(self, request: Request, body: bytes) -> Any:
        tag = request.headers.get("If-Match")
        if not tag:
            raise _RefusedError(428, "If-Match is missing")
        shown, after = self.editor.save(body, tag)
        return {"shown": shown, "tag": after}

    def _preview(self, request: Request, body: bytes) -> Any:
        return {"shown": self.editor.page_document(body)}

    def _pick(self, request: Request, body: bytes) -> Any:
        try:
            ray = parse(body)
            eye, direction = _point(ray["eye"]), _point(ray["direction"])
        except (ShapeError, LookupError, TypeError, ValueError):
            raise _RefusedError(422, "not a ray") from None
        if not math.hypot(*direction):
            raise _RefusedError(422, "not a ray: its direction has no length")
        return {"picks": self.editor.pick(eye, direction)}


def _status(fault: PtmError) -> int:
    if isinstance(fault, OutputError):
        return 500
    return 503 if isinstance(fault, DatabaseError) else 422


def _point(value: Any) -> tuple[float, float, float]:
    x, y, z = (float(part) for part in value)
    if not all(abs(part) < 1e9 for part in (x, y, z)):
        raise ValueError
    return x, y, z


def _host(scope: Scope) -> set[str]:
    """The values of Host of the address at which the server listens."""
    address, port = scope["server"]
    name = f"[{address}]" if ":" in address else address
    return {f"{name}:{port}", *([name] if port == 80 else ())}


def _check_host(request: Request) -> None:
    if request.headers.getlist("Host") not in ([host] for host in _host(request.scope)):
        raise _RefusedError(403, "another host: open the address that `ptm serve` printed")


def _check_origin(request: Request) -> None:
    if request.headers.getlist("Origin") not in ([f"http://{h}"] for h in _host(request.scope)):
        raise _RefusedError(403, "a page of another site, or no page at all")
    if request.headers.get("Sec-Fetch-Site", "same-origin") != "same-origin":
        raise _RefusedError(403, "a page of another site")


def _check_type(request: Request) -> None:
    media = request.headers.get("Content-Type", "").partition(";")[0].strip().lower()
    if media != "application/json":
        raise _RefusedError(415, "the document has to be application/json")


async def _body(request: Request, limit: int) -> bytes:
    """The body of a request, of at most ``limit`` bytes."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > limit:
            raise _RefusedError(413, f"more than {limit:,} bytes")
        parts.append(part)
    return b"".join(parts)


def _page(files: Lookup) -> Response:
    """The page with the script of the editor, which shows the tour itself."""
    entry = files(INDEX)
    if entry is None:
        raise _RefusedError(404, "no page")
    text = entry.read().decode()

    def without_tour(match: re.Match[str]) -> str:
        settings = json.loads(match[2])
        settings.pop("tour", None)
        document = json.dumps(settings, ensure_ascii=False, separators=(",", ":"))
        return match[1] + document.replace("<", "\\u003c") + match[3]

    text = _SETTINGS.sub(without_tour, text)
    # Before that of the page, which writes the place of the visitor over the token in the address.
    editor = rf'<script type="module" src="\1/{SCRIPT}"></script>\n\g<0>'
    return Response(_VIEWER.sub(editor, text), 200, _PAGE_HEADERS, HTML)
