"""Writes a site to the objects below a URL, from which the store itself serves it.

Object stores send what they hold with the headers that they hold: they compress nothing. So files
that are worth compressing are stored as gzip with ``Content-Encoding``, which all browsers accept;
textures, which are read in ranges, are stored as they are. Files that are replaced under their
names are revalidated before each use, all others are immutable. A store whose objects have no
headers gets the files of a folder.

The order is that of a folder: the list, the new files, those that replace others, the page,
removal, the list. Each object appears whole, so an interrupted upload leaves the former page with
all that it names, and the next run sends only what is missing. The list has for each object the
SHA-256 of its contents and headers, the MD5 of its bytes and the version that the store gave it; an
object counts as ours while one of the last two is that of the store's listing. During a run it has
two rows of each object that is replaced: the next run, of whatever version, sees which one holds.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ptmtools.errors import OutputError
from ptmtools.files import leads_inside
from ptmtools.output.emission import compress
from ptmtools.parallel import map_in_order
from ptmtools.progress import Progress
from ptmtools.site.content import Site
from ptmtools.site.entry import FRESH, SiteEntry, state_of
from ptmtools.site.published import (
    LIST,
    Published,
    PublishOptions,
    digest_of,
    file_digest,
    plain_files,
    reading,
    steps_of,
    steps_of_removal,
)
from ptmtools.store.folder import damage_error
from ptmtools.store.layout import sha256
from ptmtools.store.objects import Headers, ListedObject, Objects

FORMAT, SCHEMA = "ptmtools site objects", 1
#: Objects that are sent at a time: each waits for the network.
AT_ONCE = 16


@dataclass(frozen=True)
class ObjectRow:
    """An object in the list: SHA-256 of contents and headers, MD5 of the bytes, and its version;
    "" where unknown."""

    sha256: str
    md5: str
    version: str = ""

    def is_of(self, present: ListedObject | None) -> bool:
        """Whether the object in a listing has the bytes of this row."""
        return present is not None and (
            bool(self.version and self.version == present.version)
            or bool(self.md5 and self.md5 == present.md5)
        )


#: The rows of the list, by the names of the objects: one, and during a run also the next one.
Rows = dict[str, tuple[ObjectRow, ...]]


@dataclass(frozen=True)
class Item:
    """An object to store: its bytes or file, its headers, its row of the list."""

    entry: SiteEntry
    body: bytes | Path
    headers: Headers
    row: ObjectRow


def upload(
    site: Site, url: str, options: PublishOptions, *, force: bool, progress: Progress
) -> Published:
    """Writes a site to the objects below a URL, or brings them up to date; see `publish`."""
    objects = Objects(url)
    present = objects.listing()
    rows = _rows(objects, present, force)

    def row_held(name: str) -> ObjectRow:
        return _row_held(objects, name, present.get(name), rows[name])

    before = dict(zip(rows, map_in_order(row_held, rows, AT_ONCE), strict=True))
    # Headers take the place of gzip copies and of the file with caching rules.
    encode = objects.kind is not None
    entries = {unquote(name): entry for name, entry in site.entries.items()}
    files = entries if encode else dict(plain_files(site, options))
    steps = steps_of(files)
    names = [name for step in steps for name in step]
    strangers = present.keys() - before.keys()
    if not force and (name := next((name for name in names if name in strangers), "")):
        raise OutputError(
            "PTM-O001",
            "already exists and was not changed",
            file=f"{objects.url}/{name}",
            remedy="move it away, or use --force to replace it",
        )
    items = {name: _item(files[name], encode=encode) for name in names}

    def current(name: str) -> bool:
        row = before.get(name)
        return bool(row and row.sha256 == items[name].row.sha256 and row.is_of(present.get(name)))

    unchanged = tuple(name for name in names if current(name))
    changed = {*names} - {*unchanged}
    written = tuple(name for name in names if name in changed)
    # What is there under a name that only --force replaces is not ours: its row is empty.
    unknown = {name: ObjectRow("", "") for name in written if name in strangers}
    both: Rows = {name: (row,) for name, row in (before | unknown).items()}
    both |= {name: (*both.get(name, ()), items[name].row) for name in written}
    if written:
        _write_list(objects, both)

    send = partial(_send, objects, items)
    # What replaces a former object waits for the new ones that it names, and the page for all.
    waves = [[name for name in step if name in changed] for step in steps]
    uploads = chain.from_iterable(map_in_order(send, wave, AT_ONCE) for wave in waves)
    for number, _ in enumerate(uploads):
        progress(number, len(written), "files")
    old = steps_of_removal(before, items, options)
    waves = [[name for name in step if before[name].is_of(present.get(name))] for step in old]
    for wave in waves:
        list(map_in_order(objects.remove, wave, AT_ONCE))
    gone = {*changed, *chain.from_iterable(old)}
    after = {name: row for name, row in before.items() if name not in gone}
    if written:
        after |= _stored_rows(objects.listing(), items, written)
    final: Rows = {name: (row,) for name, row in after.items()}
    if final != rows:
        _write_list(objects, final)
    return Published(written, unchanged, tuple(chain.from_iterable(waves)))


def _stored_rows(
    listing: Mapping[str, ListedObject], items: Mapping[str, Item], written: Iterable[str]
) -> dict[str, ObjectRow]:
    """The rows of the written objects that are listed, with their versions."""
    return {
        name: replace(items[name].row, version=listing[name].version)
        for name in written
        if name in listing
    }


def _send(objects: Objects, items: Mapping[str, Item], name: str) -> None:
    item = items[name]
    objects.write(name, item.body, item.headers)
    if isinstance(item.body, Path):
        with reading(item.body):
            state = state_of(item.body.stat())
        if item.entry.state not in (None, state):
            raise damage_error(item.body, "it changed while it was copied")


def _item(entry: SiteEntry, *, encode: bool) -> Item:
    """The object of a file; its contents are checked."""
    digest = digest_of(entry)
    body = entry.source
    headers = Headers(entry.media, entry.caching)
    if encode and entry.compressed:
        data = entry.read()
        if sha256(data) != digest:
            raise damage_error(Path(entry.name), "it changed while it was copied")
        packed = compress(data)
        body = data
        if len(packed) < len(data):
            body, headers = packed, replace(headers, encoding="gzip")
    if isinstance(body, bytes):
        md5 = hashlib.md5(body, usedforsecurity=False).hexdigest()
    else:
        with reading(body):
            md5 = file_digest(body, "md5")
    text = json.dumps([digest, *asdict(headers).values()])
    return Item(entry, body, headers, ObjectRow(sha256(text.encode()), md5))


def _rows(objects: Objects, present: Mapping[str, ListedObject], force: bool) -> Rows:
    """The list of an earlier publication; empty for a new one, or one that was forced.

    Raises OutputError PTM-O010 if other objects are there.
    """
    if not present:
        return {}
    rows = _read_list(objects.read(LIST)) if LIST in present else None
    if rows is None and not force:
        raise OutputError(
            "PTM-O010",
            "the URL has objects and is not a site that `ptm publish` wrote",
            file=objects.url,
            remedy="specify another prefix, or use --force to write beside them",
        )
    return rows or {}


def _row_held(
    objects: Objects, name: str, present: ListedObject | None, rows: Sequence[ObjectRow]
) -> ObjectRow:
    """The row whose bytes the object has; the first one if none fits. Only an interrupted run
    leaves an object without a version in the list: if the store gives no MD5, it is read."""
    if present and not present.md5 and len(rows) + (not rows[0].version) > 1:
        md5 = hashlib.md5(objects.read(name), usedforsecurity=False).hexdigest()
        present = replace(present, md5=md5)
    for row in reversed(rows):
        if present and row.is_of(present):
            return replace(row, version=present.version)
    return rows[0]


def _read_list(data: bytes) -> Rows | None:
    """The rows of a list that may be ours; None if it is no list."""
    try:
        document: Any = json.loads(data)
        if (document["format"], document["schema"]) != (FORMAT, SCHEMA):
            return None
        rows: Rows = {name: (row,) for name, row in _valid(document["files"])}
        # Only an interrupted run leaves these.
        for name, row in _valid(document.get("next", {})):
            rows[name] = (*rows.get(name, ()), row)
        return rows
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def _valid(files: Mapping[str, Any]) -> Iterator[tuple[str, ObjectRow]]:
    for name, fields in files.items():
        parts = [fields["sha256"], fields["md5"], fields["version"]]
        if leads_inside(name) and name != LIST and all(isinstance(part, str) for part in parts):
            yield name, ObjectRow(*parts)


def _write_list(objects: Objects, rows: Rows) -> None:
    files = {name: asdict(alternatives[0]) for name, alternatives in sorted(rows.items())}
    document = {"format": FORMAT, "schema": SCHEMA, "files": files}
    second = {name: asdict(row) for name, (_, *others) in sorted(rows.items()) for row in others}
    if second:
        document["next"] = second
    data = (json.dumps(document, indent=0, ensure_ascii=False) + "\n").encode()
    objects.write(LIST, data, Headers("application/json", FRESH))
