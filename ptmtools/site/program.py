"""The page and its program, as ``web/page/build.py`` leaves them in ``page/``, and the policy of
the page. Packages that attach a representation, a form of textures or a kind of folders bring the
scripts that draw them.

The Content-Security-Policy is written into the page: static hosts send no such header. A page runs
the scripts of its own site and those whose digests are listed, and nothing else, even if a text of
the site were markup. It connects to its own site only.
"""

from __future__ import annotations

import hashlib
import html
import json
import math
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ptmtools.errors import InputError
from ptmtools.output.emitters import EMITTERS
from ptmtools.output.representation import representations
from ptmtools.site.entry import DIGITS, SiteEntry
from ptmtools.site.words import LANGUAGES, words_of
from ptmtools.store.layout import sha256

INDEX = "index.html"
PAGE = Path(__file__).parent / "page"
HTML, JAVASCRIPT = "text/html; charset=utf-8", "text/javascript; charset=utf-8"
#: Scripts that few visits need.
LATER = (
    *("later.js", "compare.js", "light.js", "reliefs.js", "tour.js", "embedded.js"),
    *("register.js", "gamepad.js", "xr.js"),
    *(f"words-{language}.js" for language in LANGUAGES if language != "en"),
)
#: The media type of each file.
PROGRAM = {
    "viewer.js": JAVASCRIPT,
    **dict.fromkeys(LATER, JAVASCRIPT),
    "worker.js": JAVASCRIPT,
    "decoder.wasm": "application/wasm",
}
#: Defines the element for pages that embed a walk.
ELEMENT = "ptm-walk.js"
#: The service worker of sites that work without a network: its folder is what it serves.
WORKER = "offline.js"
#: The page of folders that are no databases (`ptmtools.site.forms`).
FORM_PAGE = "form.html"
#: Scripts and styles in the page; data blocks have a type and do not run.
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_STYLE = re.compile(r"<style>(.*?)</style>", re.DOTALL)
_CHARSET = '<meta charset="utf-8">\n'
_FIELD = re.compile(r"\{\{(\w+)\}\}")


def attached_scripts() -> dict[str, Path]:
    """The scripts of packages that attach to the walk, by their names; few visits need them."""
    files = [kind.script for kind in representations()]
    files += [emitter.site.script for emitter in EMITTERS.values() if emitter.site]
    return {file.name: file for file in files}


def program_files() -> dict[str, SiteEntry]:
    """The scripts and the decoder, by their names, in a folder named by their contents.

    Raises InputError: PTM-I122 one is missing.
    """
    files = attached_scripts() | {name: PAGE / name for name in PROGRAM}
    data = {name: read_built(files[name]) for name in sorted(files)}
    folder = f"viewer-{sha256(b''.join(data.values()))[:DIGITS]}"
    return {
        name: SiteEntry(
            f"{folder}/{name}", content, PROGRAM.get(name, JAVASCRIPT), True, compressed=True
        )
        for name, content in data.items()
    }


def read_built(file: Path) -> bytes:
    """The bytes of a built file; raises as `program_files`."""
    try:
        return file.read_bytes()
    except OSError as fault:
        raise InputError(
            "PTM-I122",
            f"a file of the page cannot be read ({fault.strerror or fault})",
            file=file,
            remedy="install ptmtools again, or the plug-in with this file",
        ) from None


def address_of(viewpoint: Mapping[str, Any]) -> list[float]:
    """What the page's address has of a view: x, y, z in metres and the yaw in degrees."""
    x, _, z = viewpoint["direction"]
    yaw = math.degrees(math.atan2(-x, -z) % math.tau)
    return [*(round(float(part), 2) for part in viewpoint["position"]), round(yaw, 1)]


def page(
    settings: Mapping[str, Any],
    script: str,
    preload: Sequence[str],
    openings: Mapping[str, Sequence[float]],
    about: Sequence[str] = (),
) -> SiteEntry:
    """The page, filled in.

    Parameters
    ----------
    settings: the JSON that its script reads (docs/guide/publish.md).
    script: URL of its script. preload: URLs of the files that it fetches first.
    openings: URLs, which differ in their last number, and addresses, see `openings_of`.
    about: elements of the head for other programs (`ptmtools.site.about`).

    Raises InputError: PTM-I122 the template is missing.
    """
    # Workers take the module out of the cache.
    links = [f'<link rel="modulepreload" href="{settings["worker"]}">']
    links += [f'<link rel="preload" as="fetch" href="{url}" crossorigin>' for url in preload]
    if openings:
        # The page makes it a preload, with the number of the view that its address leads to.
        views = json.dumps([*openings.values()], separators=(",", ":"))
        links.append(
            f'<link id="opening" rel="next" as="fetch" href="{next(iter(openings))}" '
            f'data-views="{views}" crossorigin>'
        )
    links += about
    catalogue, works = settings.get("catalogue"), words_of("en")["markup"]["works"]
    poster = html.escape(str(settings.get("poster") or ""))
    fields = {
        "poster": f'<img id="poster" src="{poster}" alt="">' if poster else "",
        "catalogue": f'<p><a href="{catalogue}">{html.escape(works)}</a></p>' if catalogue else "",
    }
    return _fill(INDEX, settings, script, links, fields)


def fixed_script(name: str) -> SiteEntry:
    """`ELEMENT` or `WORKER`, whose names never change."""
    return SiteEntry(name, read_built(PAGE / name), JAVASCRIPT, compressed=True)


def registration(program: Mapping[str, SiteEntry]) -> str:
    """The element of the head that installs the service worker, after the page itself."""
    url = program["register.js"].name
    return f'<script>addEventListener("load", () => import("./{url}"))</script>'


def form_script(file: Path) -> SiteEntry:
    """A script of a `FolderKind`, in a folder named by its contents; raises as `program_files`."""
    data = read_built(file)
    name = f"viewer-{sha256(data)[:DIGITS]}/{file.name}"
    return SiteEntry(name, data, JAVASCRIPT, True, compressed=True)


def form_page(
    settings: Mapping[str, Any], script: str, about: Sequence[str], *, framed: bool
) -> SiteEntry:
    """The page of a single object, filled in; raises as `page`. ``framed``: see `add_policy`."""
    links = [f'<link rel="preload" as="fetch" href="{settings["index"]}" crossorigin>', *about]
    return _fill(FORM_PAGE, settings, script, links, {}, framed=framed)


def _fill(
    template: str,
    settings: Mapping[str, Any],
    script: str,
    links: Sequence[str],
    fields: Mapping[str, str],
    *,
    framed: bool = False,
) -> SiteEntry:
    """A page, filled in."""
    text = json.dumps(settings, ensure_ascii=False, separators=(",", ":"))
    values = {
        "title": html.escape(settings["title"]),
        # Nothing in it ends the element that holds it.
        "site": text.replace("<", "\\u003c"),
        "preload": "\n".join(links),
        "script": script,
        **fields,
    }
    filled = _FIELD.sub(lambda match: values[match[1]], read_built(PAGE / template).decode())
    return SiteEntry(INDEX, add_policy(filled, framed=framed).encode(), HTML, compressed=True)


def add_policy(page: str, *, framed: bool = False) -> str:
    """A page with its policy, at the beginning of its head. ``framed``: it shows documents of
    others in frames, which inherit the policy; their styles, fonts and sounds are in them."""
    begin, charset, rest = page.partition(_CHARSET)
    policy = policy_of(page, framed=framed)
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
    return begin + charset + meta + rest


def policy_of(page: str, *, framed: bool = False) -> str:
    """The policy of a page. One without scripts of its own runs none."""
    scripts, styles = (
        [f"'sha256-{_digest(text)}'" for text in kind.findall(page)] for kind in (_SCRIPT, _STYLE)
    )
    rules = {"default-src": ["'none'"]}
    if '<script type="module"' in page:
        rules["script-src"] = ["'self'", "'wasm-unsafe-eval'", *scripts]
        rules["worker-src"] = rules["connect-src"] = ["'self'"]
    rules["style-src"] = ["'unsafe-inline'"] if framed else styles
    rules["img-src"] = ["'self'", "data:", "blob:"]
    rules["media-src"] = ["'self'", "data:"] if framed else ["'self'"]
    if framed:
        rules["font-src"] = ["data:"]
    if '<link rel="manifest"' in page:
        rules["manifest-src"] = ["'self'"]
    rules["base-uri"] = rules["form-action"] = ["'none'"]
    return "; ".join(f"{name} {' '.join(values)}" for name, values in rules.items() if values)


def _digest(text: str) -> str:
    return b64encode(hashlib.sha256(text.encode()).digest()).decode()
