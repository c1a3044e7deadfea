"""Finds the file that a URL names, and nothing outside the served folder.

Names are compared after percent-decoding, once, component by component. A name that decodes to a
slash, a backslash, a colon, a NUL or a dotted step matches no file.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from threading import Lock
from urllib.parse import unquote, unquote_to_bytes

from ptmtools.errors import DatabaseError, PtmError
from ptmtools.files import leads_inside
from ptmtools.folder_kinds import folder_kind
from ptmtools.site.about import MANIFEST, MANIFEST_MEDIA
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.entry import SiteEntry, is_marked, stamp_of
from ptmtools.site.forms import form_site
from ptmtools.site.program import HTML, INDEX, JAVASCRIPT
from ptmtools.store.layout import MANIFEST as DATABASE, SERVED
from ptmtools.texture.previews import FORMATS
from ptmtools.tour.model import NAME
from ptmtools.tour.reading import CAPTIONS, SOUNDS

#: The file of a decoded name, or None; raises BlockingIOError for one that will exist later.
Lookup = Callable[[str], SiteEntry | None]

#: Suffix → (media type, whether it is worth compressing).
_MEDIA = {
    ".html": (HTML, True),
    ".js": (JAVASCRIPT, True),
    ".css": ("text/css; charset=utf-8", True),
    ".json": ("application/json", True),
    ".svg": ("image/svg+xml", True),
    ".txt": ("text/plain; charset=utf-8", True),
    ".wasm": ("application/wasm", True),
    ".glb": ("model/gltf-binary", True),
    ".wrl": ("model/vrml", True),
    Path(MANIFEST).suffix: (MANIFEST_MEDIA, False),
    **{suffix: (media, False) for suffix, media in (SOUNDS | CAPTIONS).items()},
    **{form.suffix: (form.media, False) for form in FORMATS.values()},
    ".png": ("image/png", False),
}
_OTHER = ("application/octet-stream", False)


def name_of(path: bytes) -> str | None:
    """The decoded name in the raw path of a request; None if no file can have it."""
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


def entry_lookup(entries: Mapping[str, SiteEntry]) -> Lookup:
    """The entries of a site, by their names."""
    return {unquote(name): entry for name, entry in entries.items()}.get


def folder_lookup(folder: Path, *, hashed: bool = False) -> Lookup:
    """The regular files below a folder; links are followed as long as they stay there.

    With ``hashed``, names with a hash as `ptm publish` writes it may be kept for ever.
    """
    root = folder.resolve()

    def find(name: str) -> SiteEntry | None:
        try:
            file = (root / name).resolve(strict=True)
            if not (file.is_relative_to(root) and file.is_file()):
                return None
        except (OSError, RuntimeError, ValueError):  # no such file, circular links, a NUL
            return None
        media, compressed = _MEDIA.get(file.suffix.lower(), _OTHER)
        return SiteEntry(name, file, media, hashed and is_marked(name), compressed)

    return find


def files_of(folder: str | PathLike[str]) -> Lookup:
    """The files of a database: those of its site, without pictures, then those in its `www`; those
    of a folder that `ptm publish` wrote; or those of the site of another form (`forms`).

    Raises
    ------
    InputError: PTM-I122 as `form_site`.
    DatabaseError: PTM-D001 it is none of them; PTM-D002, D003 a damaged database, or one of another
        schema; PTM-D004 one that is not finished; and as `site_of`.
    """
    path = Path(folder)
    if (path / INDEX).is_file() and not (path / DATABASE).exists():
        return folder_lookup(path, hashed=True)
    if kind := folder_kind(path):
        return entry_lookup(form_site(path, kind).entries)
    return _Database(path)


class _Database:
    """The files of a database. It may be built again meanwhile, or its tour changed: the next
    request for the page then gets a new site."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lock = Lock()
        self._stamps = self._database_stamp(), self._tour_stamp()
        self._site = self._new_site()
        self._find = entry_lookup(self._site.entries)
        self._others = folder_lookup(path / SERVED)

    def __call__(self, name: str) -> SiteEntry | None:
        if name == INDEX:
            self._renew()
        return self._find(name) or self._others(name)

    def _renew(self) -> None:
        with self._lock:
            before = self._stamps
            stamps = self._database_stamp(), self._tour_stamp()
            if stamps == before:
                return
            try:
                again = self._site.again if stamps[0] == before[0] else None
                self._site = again() if again else self._new_site()
            except (PtmError, OSError) as fault:
                print(f"ptm: {fault}", file=sys.stderr)
                if stamps[0] != before[0]:
                    raise BlockingIOError("the database is being built, or damaged") from None
            # A tour with an error leaves the one before it, and is reported once.
            self._stamps = stamps
            self._find = entry_lookup(self._site.entries)

    def _database_stamp(self) -> tuple[int, ...]:
        """That of the manifest, which changes when a stage is finished."""
        return stamp_of(self._path / DATABASE)

    def _tour_stamp(self) -> tuple[int, ...]:
        return stamp_of(self._path.absolute().parent / NAME)

    def _new_site(self) -> Site:
        try:
            return site_of(self._path, SiteOptions(pictures=False))
        except DatabaseError as fault:
            if fault.code == "PTM-D001" and self._path.exists():
                fault.message = (
                    "neither a database, nor a folder that `ptm publish`, `ptm apo`, "
                    "`ptm interlace` or `ptm campus` wrote"
                )
            raise
