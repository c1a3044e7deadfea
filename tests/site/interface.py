"""The page in Chromium, without a site: files from the tree, and an app that stands for main.js."""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ptmtools.site.words import words_of

HERE = Path(__file__).resolve().parent
PAGE = HERE.parents[1] / "web" / "page"
#: Any host: what is asked of it is answered here.
HOST = "http://walk.test"
SITE = {"index": "data/index.json", "title": "A museum"}


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


#: A pixel.
PNG = b"".join(
    [
        b"\x89PNG\r\n\x1a\n",
        _chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)),
        _chunk(b"IDAT", zlib.compress(b"\0\x60\x80\xa0")),
        _chunk(b"IEND", b""),
    ]
)


def page_text(script: str = "/fake.mjs") -> str:
    """The page as it is sent."""
    words = words_of("en")["markup"]
    text = re.sub(r"\[\[(\w+)\]\]", lambda m: words[m[1]], (PAGE / "index.html").read_text())
    filled = {
        "title": SITE["title"],
        "preload": "",
        "style": (PAGE / "style.css").read_text(),
        "site": json.dumps(SITE),
        "script": script,
        "poster": '<img id="poster" src="data/poster.png" alt="">',
    }
    for name, value in filled.items():
        text = text.replace(f"{{{{{name}}}}}", value)
    return text


def _answer(route: Any) -> None:
    path = route.request.url.removeprefix(HOST).split("#")[0]
    if path == "/":
        route.fulfill(body=page_text(), content_type="text/html")
    elif path == "/bare":
        route.fulfill(body=page_text(""), content_type="text/html")
    elif path.endswith(".png"):
        route.fulfill(body=PNG, content_type="image/png")
    else:
        web = path.startswith(("/page/", "/client/", "/ptm/"))
        file = PAGE.parent / path[1:] if web else HERE / path[1:]
        route.fulfill(body=file.read_text(), content_type="text/javascript")


@contextmanager
def visit(browser: Any, path: str = "/", *, size: tuple[int, int], **options: Any) -> Iterator[Any]:
    """A page of its own; AssertionError if the console says anything."""
    with own_page(browser, size=size, **options) as page, visit_by(page, path):
        yield page


@contextmanager
def own_page(browser: Any, *, size: tuple[int, int], **options: Any) -> Iterator[Any]:
    """A page for one visit after the other."""
    width, height = size
    context = browser.new_context(viewport={"width": width, "height": height}, **options)
    context.route("**/*", _answer)
    try:
        yield context.new_page()
    finally:
        context.close()


@contextmanager
def visit_by(page: Any, path: str = "/") -> Iterator[None]:
    """As `visit`; nothing is kept for the next one."""
    printed: list[str] = []

    def hear(message: Any) -> None:
        printed.append(message.text)

    def fail(error: Any) -> None:
        printed.append(str(error))

    page.on("console", hear)
    page.on("pageerror", fail)
    try:
        page.goto(HOST + path)
        yield
        page.evaluate("localStorage.clear()")
        page.goto("about:blank")
        assert printed == []
    finally:
        page.remove_listener("console", hear)
        page.remove_listener("pageerror", fail)
