"""Writes a site to a folder or a URL, for any static host, and counts what its visitors download.

A visitor during publication gets the old page or the new one: the files whose contents never change
are written first, then those that replace others, then the page; files of earlier versions alone
are removed last, their pages first. A list in the folder names our files; nothing else is changed
or removed. During a run it has the digests of what each file was and becomes, so that the next one,
of whatever version, knows all that an interrupted run leaves.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from ptmtools.errors import OutputError
from ptmtools.files import (
    leads_inside,
    open_regular,
    real_file,
    real_place,
    refuse_existing,
    write_bytes,
    write_with,
    writing,
)
from ptmtools.output.emitters import is_other_form
from ptmtools.output.representation import representations_in
from ptmtools.progress import Progress, silent
from ptmtools.site.content import Site
from ptmtools.site.entry import SiteEntry, link_bytes
from ptmtools.site.files import DATA
from ptmtools.site.program import INDEX, LATER, attached_scripts
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
from ptmtools.site.uploading import upload
from ptmtools.store.folder import damage_error
from ptmtools.store.layout import sha256
from ptmtools.store.objects import is_url, plain_path

#: Texels of the longer side up to which the textures of a room count in `Weight`.
COARSE = 64
#: The SHA-256s that each file of the list may have, by its name.
Digests = dict[str, tuple[str, ...]]
#: Format of the list of our files.
FORMAT, SCHEMA = "ptmtools site files", 1
#: Data that the walk does not show before a panel asks for them, and copies of other data.
_NOT_OF_WALK = tuple(f"{DATA}/{name}-" for name in ("work", "icon", "vp", "opening", "picture"))
_FIRST_OPENING = rf"{DATA}/opening-\w+-0\.bin"


def publish(
    site: Site,
    target: str | os.PathLike[str],
    options: PublishOptions | None = None,
    *,
    force: bool = False,
    progress: Progress = silent,
) -> Published:
    """Writes a site to a folder or a URL such as ``s3://bucket/prefix``, or brings it up to date.

    ``force`` allows a target that is not a site, and replaces files of the same names in it.

    Raises
    ------
    OutputError: PTM-O001 a file is in the way; PTM-O010 the target is not empty and no site;
        PTM-O002, O003, O005 the folder cannot be written; PTM-O012 the URL.
    InputError: PTM-I111; MissingComponentError: PTM-M100, see `Objects`.
    DatabaseError: PTM-D005, D006 a file of the database is missing or damaged.
    """
    options = options or PublishOptions()
    target = plain_path(target)
    if is_url(target):
        return upload(site, str(target), options, force=force, progress=progress)
    root = Path(target)
    before = _check_folder(root, force)
    files = dict(plain_files(site, options))
    names = [name for step in steps_of(files) for name in step]
    for name in names:
        if name not in before and not force:
            with writing(root):
                refuse_existing(root / name, "move it away, or use --force to replace it")
    with writing(root):
        root.mkdir(parents=True, exist_ok=True)
    now = {name: (digest_of(files[name]),) for name in names}
    # Each digest once.
    both = {name: tuple(dict.fromkeys(before.get(name, ()) + now[name])) for name in names}
    _write_list(root, before | both)
    written: dict[str, None] = {}
    for number, name in enumerate(names):
        progress(number, len(names), "files")
        (digest,) = now[name]
        if _digest_in(root, name) != digest:
            _write(root, name, files[name], digest)
            written[name] = None
    old = dict.fromkeys(name for step in steps_of_removal(before, now, options) for name in step)
    removed = tuple(name for name in old if _remove(root, name, before[name]))
    kept = {name: digests for name, digests in before.items() if name not in old}
    _write_list(root, kept | now)
    unchanged = tuple(name for name in names if name not in written)
    return Published(tuple(written), unchanged, removed)


def _check_folder(root: Path, force: bool) -> Digests:
    """The list of a folder; empty for a new one, or one that was forced."""
    if root.exists() and not root.is_dir():
        raise OutputError(
            "PTM-O001", "exists and is not a folder", file=root, remedy="specify another with -o"
        )
    with writing(root):
        if not root.exists() or not any(root.iterdir()):
            return {}
    listed = _read_list(root)
    if listed is None and not force:
        raise OutputError(
            "PTM-O010",
            "the folder is not empty and not a site that `ptm publish` wrote",
            file=root,
            remedy="specify another folder with -o, or use --force to write into it",
        )
    return listed or {}


def _read_list(root: Path) -> Digests | None:
    """The names in a folder's list that may be ours; None without such a list."""
    try:
        with open_regular(root / LIST) as stream:
            document: Any = json.loads(stream.read())
        if (document["format"], document["schema"]) != (FORMAT, SCHEMA):
            return None
        rows: Mapping[str, Any] = document["files"]
        return {
            name: tuple(digests.split())
            for name, digests in rows.items()
            if isinstance(digests, str) and leads_inside(name)
        }
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def _write_list(root: Path, files: Digests) -> None:
    rows = {name: " ".join(digests) for name, digests in sorted(files.items())}
    document = {"format": FORMAT, "schema": SCHEMA, "files": rows}
    data = (json.dumps(document, indent=0, ensure_ascii=False) + "\n").encode()
    if _digest_in(root, LIST) != sha256(data):
        write_bytes(root / LIST, data, force=True)


def _digest_in(root: Path, name: str) -> str | None:
    """The SHA-256 of a file of the folder, None if it does not exist."""
    file = real_file(root, name)
    if file is None:
        return None
    with writing(file):
        return file_digest(file)


def _write(root: Path, name: str, entry: SiteEntry, digest: str) -> None:
    """Writes a file whole, or not at all."""
    target = real_place(root, name)
    source = entry.source
    if isinstance(source, bytes):
        write_bytes(target, source, force=True)
        return

    def copy(file: IO[bytes]) -> None:
        with reading(source), open_regular(source) as stream:
            shutil.copyfileobj(stream, file)
        file.seek(0)
        if hashlib.file_digest(file, "sha256").hexdigest() != digest:  # type: ignore[arg-type]
            raise damage_error(source, "it changed while it was copied")

    write_with(target, copy, force=True)


def _remove(root: Path, name: str, digests: Collection[str]) -> bool:
    """Removes a file, and its folder if that is empty; False if others have changed the file."""
    if _digest_in(root, name) not in digests:
        return False
    with writing(root / name):
        (root / name).unlink()
    with suppress(OSError):
        (root / name).parent.rmdir()
    return True


@dataclass(frozen=True)
class Weight:
    """Bytes that a visitor of a site downloads, without the headers of HTTP; files that servers
    compress count compressed.

    Attributes
    ----------
    page: the page, the viewer, a worker and the decoder, which come before the building.
    first_room: the page, its poster, the index, and the room of the first viewpoint.
    mean_room, worst_room: record and geometry of a room, and of the textures in it the levels up to
        `COARSE` texels. Of all cells in which one can stand; worst_cell is the heaviest.
    whole: all that a walk from the first viewpoint can need: its opening in place of what that
        has of other files. Pictures in panels and VRML files do not count.
    """

    page: int
    first_room: int
    mean_room: int
    worst_room: int
    worst_cell: int
    whole: int


def weight_of(site: Site) -> Weight:
    """The bytes of a site."""
    from ptmtools.site.opening import parts_of

    index = site.index
    rooms = {
        number: _room(site.entries, index, row)
        for number, row in enumerate(index["cells"])
        if row.get("standing", True)
    }
    used = {kind.script.name for kind in representations_in(index)}
    used |= {"light.js"} & {f"{name}.js" for name in index}
    used |= {"reliefs.js" for row in index["textures"] if row.keys() & {"relief", "normals"}}
    used |= {"tour.js" for name in site.entries if name.startswith(f"{DATA}/tour-")}
    unused = {*LATER, *attached_scripts()} - used
    bytes_of = {n: link_bytes(e) for n, e in site.entries.items() if _is_walked(n, unused)}
    opening = next((n for n in site.entries if re.fullmatch(_FIRST_OPENING, n)), "")
    saved = -link_bytes(site.entries[opening]) if opening else 0
    for kind, number, size in parts_of(site.entries[opening].read()) if opening else ():
        whole = kind in ("record", "geometry")
        saved += index["cells"][number][f"{kind}Bytes"] if whole else size
    begins = (f"{DATA}/index-", f"{DATA}/poster-")
    page = sum(size for name, size in bytes_of.items() if not name.startswith(f"{DATA}/"))
    before = sum(size for name, size in bytes_of.items() if name.startswith(begins))
    first = _room(site.entries, index, index["cells"][index["viewpoints"][0]["cell"]])
    worst = max(rooms, key=rooms.__getitem__)
    return Weight(
        page=page,
        first_room=page + before + first,
        mean_room=round(sum(rooms.values()) / len(rooms)),
        worst_room=rooms[worst],
        worst_cell=worst,
        whole=sum(bytes_of.values()) - saved,
    )


def _is_walked(name: str, unused: Collection[str]) -> bool:
    """Whether every walk may need a file, which is not one of the ``unused`` scripts."""
    later = name.rpartition("/")[2] in unused or is_other_form(name)
    walked = name.startswith(("viewer-", f"{DATA}/")) and not name.startswith(_NOT_OF_WALK)
    return name == INDEX or (walked and not later)


def _room(
    entries: Mapping[str, SiteEntry], index: Mapping[str, Any], row: Mapping[str, Any]
) -> int:
    record = json.loads(entries[f"{DATA}/{row['record']}"].read())
    coarse = sum(_coarse(index["textures"][texture]) for texture in record["textures"][0])
    return int(row["recordBytes"]) + int(row["geometryBytes"]) + coarse


def _coarse(texture: Mapping[str, Any]) -> int:
    """Bytes of the levels of a texture up to `COARSE` texels; of the coarsest at least."""
    side, ends = max(texture["width"], texture["height"]), texture["ends"]
    coarse = [end for n, end in enumerate(ends) if side >> (len(ends) - 1 - n) <= COARSE]
    return int(coarse[-1] if coarse else ends[0])
