"""The site of a folder that is no database (`ptmtools.folder_kinds`).

Each kind brings the script of its page, which the page of databases does not load. All files are in
``data-HASH``, with a hash of the index, which has the checksums of the others.
"""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import quote

from ptmtools import schemas
from ptmtools.errors import InputError
from ptmtools.files import open_below
from ptmtools.folder_kinds import FolderKind
from ptmtools.site.about import About
from ptmtools.site.content import Site, SiteOptions, title_of
from ptmtools.site.entry import DIGITS, SiteEntry, link_bytes, state_of
from ptmtools.site.files import DATA, SiteFiles, add_manifest
from ptmtools.site.program import form_page, form_script
from ptmtools.store.layout import sha256

#: The options of a site that such a folder has.
OPTIONS = ("title", "description", "address")
#: Largest index, bytes.
_LONGEST = 1 << 26
_MEDIA = {
    ".json": "application/json",
    ".glb": "model/gltf-binary",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".webp": "image/webp",
    ".txt": "text/plain; charset=utf-8",
}


def form_site(folder: Path, kind: FolderKind, options: SiteOptions | None = None) -> Site:
    """The site of a folder. Checks its index alone: the page checks what it fetches. Of the options
    `OPTIONS` apply.

    Raises InputError PTM-I122: a file is missing or cannot be read, or the index is none.
    """
    data, _ = _read(folder, kind.index, _LONGEST)
    try:
        index = schemas.parse(data)
        schemas.check(index, kind.schema)
    except schemas.ShapeError as fault:
        raise InputError(
            "PTM-I122",
            f"describes no folder that ptmtools has written ({fault})",
            file=folder / kind.index,
            remedy="write the folder again",
        ) from fault
    place = f"data-{sha256(data)[:DIGITS]}"
    options = options or SiteOptions()
    title = options.title or title_of(folder)
    files = SiteFiles()
    files.put(SiteEntry(f"{place}/{kind.index}", data, _MEDIA[".json"], True, compressed=True))
    for name in kind.files.load()(index):
        file = folder / name
        _, state = _read(folder, name, 0)
        media = _MEDIA.get(file.suffix, "application/octet-stream")
        packed = file.suffix in (".glb", ".txt")
        files.put(SiteEntry(f"{place}/{quote(name)}", file, media, True, packed, state))
    script = form_script(kind.script)
    files.put(script)
    settings = {"title": title, "index": f"{place}/{kind.index}"}
    about = About(title, options.description, address=options.address)
    files.put(form_page(settings, script.name, [*about.lines()], framed=kind.records))
    add_manifest(files, title)
    return Site(files.entries, index, title=title)


def form_weight(site: Site) -> tuple[int, int]:
    """Bytes that a visitor downloads: of the page with its script, and of everything."""
    sizes = {name: link_bytes(entry) for name, entry in site.entries.items()}
    page = sum(size for name, size in sizes.items() if not name.startswith(("data-", f"{DATA}/")))
    return page, sum(sizes.values())


def _read(folder: Path, name: str, length: int) -> tuple[bytes, tuple[int, int, int]]:
    """The first bytes of a file, and its state; refuses links."""
    file = folder / name
    try:
        with open_below(folder, name) as stream:
            data, state = stream.read(length + 1), state_of(os.fstat(stream.fileno()))
    except OSError as fault:
        raise InputError(
            "PTM-I122",
            f"cannot be read ({fault.strerror or fault})",
            file=file,
            remedy="write the folder again",
        ) from fault
    if length and len(data) > length:
        raise InputError("PTM-I122", "is too long for an index", file=file)
    return data, state
