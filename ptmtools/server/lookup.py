"""From the path of a request to a file, and to nothing outside what is served.

Names are compared after percent-decoding, once, component by component: what decodes to a slash, a
backslash, a colon, a NUL or a dotted step names nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

from ptmtools.files import leads_inside
from ptmtools.site.content import Entry

#: The file of a decoded name, or None; raises BlockingIOError for what will be there later.
Lookup = Callable[[str], Entry | None]

INDEX = "index.html"
#: Suffix → (media type, whether it is worth compressing).
_MEDIA = {
    ".html": ("text/html; charset=utf-8", True),
    ".js": ("text/javascript; charset=utf-8", True),
    ".css": ("text/css; charset=utf-8", True),
    ".json": ("application/json", True),
    ".svg": ("image/svg+xml", True),
    ".txt": ("text/plain; charset=utf-8", True),
    ".wasm": ("application/wasm", True),
    ".glb": ("model/gltf-binary", True),
    ".wrl": ("model/vrml", True),
    ".png": ("image/png", False),
    ".jpg": ("image/jpeg", False),
    ".webp": ("image/webp", False),
}
_OTHER = ("application/octet-stream", False)
#: What `ptm publish` puts into names that change with the content.
_HASH = re.compile(r"-[0-9a-f]{10}(?=[./])")


def name_of(path: bytes) -> str | None:
    """The decoded name that the raw path of a request stands for; None if it can be no file's."""
    if not path.startswith(b"/"):
        return None
    try:
        steps = [unquote_to_bytes(step).decode() for step in path[1:].split(b"/")]
    except UnicodeDecodeError:
        return None
    name = "/".join(steps)
    if not name:
        return INDEX
    return name if name.count("/") + 1 == len(steps) and leads_inside(name) else None


def among(entries: Mapping[str, Entry]) -> Lookup:
    """The entries of a site, by their names."""
    return {unquote(name): entry for name, entry in entries.items()}.get


def below(folder: Path, *, hashed: bool = False) -> Lookup:
    """The regular files below a folder; a link is followed as long as it stays there.

    With ``hashed``, names with a hash as `ptm publish` writes it may be kept for ever.
    """
    root = folder.resolve()

    def find(name: str) -> Entry | None:
        try:
            file = (root / name).resolve(strict=True)
            found = file.is_relative_to(root) and file.is_file()
        except (OSError, RuntimeError, ValueError):  # no such file, links in a circle, a NUL
            return None
        if not found:
            return None
        media, compressed = _MEDIA.get(file.suffix.lower(), _OTHER)
        return Entry(name, file, media, hashed and bool(_HASH.search(name)), compressed)

    return find
