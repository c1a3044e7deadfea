"""The page and its program: `index.html` filled in, the viewer, the worker and the decoder."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ptmtools.store.layout import sha256
from ptmtools.viewer.entry import Entry
from ptmtools.viewer.joining import joined

HERE = Path(__file__).parent
PAGE, DECODER = HERE / "page", HERE / "decoder"
INDEX = "index.html"
#: Hex digits of a SHA-256 that make a name unique.
DIGITS = 10
HTML, JAVASCRIPT = "text/html; charset=utf-8", "text/javascript; charset=utf-8"
WASM = "application/wasm"
_COMMENT = re.compile(r"(\"[^\"\n]*\"|'[^'\n]*')|/\*.*?\*/", re.DOTALL)
_HTML_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_LINES = re.compile(r"\s*\n\s*")
_PLACE = re.compile(r"\{\{(\w+)\}\}")


def program_files() -> dict[str, Entry]:
    """The viewer, the worker and the decoder, in a folder named by what is in them.

    Raises InputError: PTM-I900 a module is not as it must be.
    """
    assets = {
        DECODER / "decoder.wasm": "decoder.wasm",
        DECODER / "src" / "worker.js": "worker.js",
    }
    texts = {}
    for name, module in ("viewer", PAGE / "main.js"), ("worker", DECODER / "src" / "worker.js"):
        # What most visitors never run has a file of its own: `later`.
        script, later = joined(module, assets, f"./{name}-later.js")
        texts[f"{name}.js"] = script.encode()
        if later:
            texts[f"{name}-later.js"] = later.encode()
    texts["decoder.wasm"] = (DECODER / "decoder.wasm").read_bytes()
    digest = sha256(b"".join(texts[name] for name in sorted(texts)))[:DIGITS]
    names = {name: f"viewer-{digest}/{name}" for name in texts}
    return {
        name: Entry(
            names[name], data, WASM if name.endswith("wasm") else JAVASCRIPT, True, compressed=True
        )
        for name, data in texts.items()
    }


def page(title: str, site: Mapping[str, Any], script: str, preload: Sequence[str]) -> Entry:
    """The page, filled in.

    Parameters
    ----------
    title: of the page, as text.
    site: what its script is told, see docs/guide/publish.md. script: its URL.
    preload: URLs of what it fetches first.
    """
    # Workers take the module out of the cache.
    links = [f'<link rel="modulepreload" href="{site["worker"]}">']
    links += [f'<link rel="preload" as="fetch" href="{url}" crossorigin>' for url in preload]
    style = _COMMENT.sub(r"\1", (PAGE / "style.css").read_text(encoding="utf-8"))
    found = {
        "title": html.escape(title),
        # Nothing in it ends the element that it stands in.
        "site": json.dumps(site, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c"),
        "preload": "\n".join(links),
        "style": _LINES.sub("\n", style).strip(),
        "poster": html.escape(str(site.get("poster") or "")),
        "script": script,
    }
    text = _HTML_COMMENT.sub("", (PAGE / INDEX).read_text(encoding="utf-8"))
    text = _LINES.sub("\n", text)
    return Entry(INDEX, _PLACE.sub(lambda m: found[m[1]], text).encode(), HTML, compressed=True)
