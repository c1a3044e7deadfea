"""A database at a URL, and a model at a URL, each with a copy in the user's cache folder.

::

    manifest.json     the state of the database, as in a folder
    objects/SHA256    each file that the manifest lists, under the digest of its bytes

Objects never change. So any machine may write them at any time, workers read and write them by
their digests alone, and a build that is killed leaves the state that the manifest describes. The
manifest is written last, on condition that it is still the one that was read; S3 checks that at
the moment of writing, other stores shortly before.

A build works in a copy, which need not have all files (`Elsewhere`): textures of machines that
share no folder with this one never come here. The copy is ahead of the URL after an interrupted
build. If the manifest at the URL is another than at the last exchange, it replaces that of the
copy. A command that reads a database has a copy of its own, with all files.

Tried and rejected: the names of the database as names of objects. A reader would then meet new
files with the old manifest, and S3 renames nothing.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from ptmtools.errors import DatabaseError, OutputError, PtmError, Rebuild
from ptmtools.files import (
    leads_inside,
    real_file,
    real_folder,
    real_place,
    write_bytes,
    writing,
)
from ptmtools.parallel import map_in_order
from ptmtools.progress import announce
from ptmtools.store.copies import BUILDS, DATABASES, READERS, folder_for, note_url
from ptmtools.store.digests import Digests
from ptmtools.store.folder import last_manifest, lists_in, read_manifest, read_recorded
from ptmtools.store.layout import MANIFEST, sha256
from ptmtools.store.lists import read_list
from ptmtools.store.lock import acquire
from ptmtools.store.manifest import Manifest
from ptmtools.store.objects import Headers, Objects, is_url, plain_path
from ptmtools.store.transaction import recover, remove_former, remove_output

#: Objects that are sent or fetched at a time: each waits for the network.
AT_ONCE = 8
OBJECTS = "objects"
#: The objects of a database in a folder below.
_OF_DATABASE = re.compile(rf"/{OBJECTS}/[0-9a-f]{{64}}$")
_DATA = Headers("application/octet-stream", "public, max-age=31536000, immutable")
_STATE = Headers("application/json", "no-cache")


def object_of(digest: str) -> str:
    """The object of the file with a SHA-256."""
    return f"{OBJECTS}/{digest}"


class RemoteDatabase:
    """A database at a URL.

    It is the `Elsewhere` of its copy.

    Attributes
    ----------
    url: its URL. folder: its copy. reading: whether that is to be read, and not built.

    Raises as `Objects`; all methods raise OutputError PTM-O012 if the store refuses.
    """

    def __init__(self, url: str, *, reading: bool = False) -> None:
        self._objects = Objects(url)
        self.url, self.reading = self._objects.url, reading
        self.folder = folder_for(DATABASES, self.url) / (READERS if reading else BUILDS)
        self._base = self.folder.with_name(f"{self.folder.name}-version")
        self._version = ""
        #: The manifest as it was read.
        self._before: tuple[Manifest, bytes] | None = None
        #: Of all objects, once they were listed.
        self._sizes: dict[str, int] = {}
        self._listed = False

    def fetch(self, *, new: bool = False, force: bool = False) -> None:
        """Brings the copy up to the state at the URL, unless it is that, or ahead of it: to read,
        all files; to build, the manifest and its lists, as far as they can be read. With ``new``
        there need be no database.

        Raises
        ------
        OutputError: PTM-O010 other objects are there, without ``force``.
        DatabaseError: PTM-D001 to D003 there is no manifest, or a wrong one; PTM-D005, D006 an
            object is missing or damaged; PTM-D007 another process is writing the copy.
        """
        announce(f"reading {self.url}")
        note_url(self.folder.parent, self.url)
        listing = self._objects.listing()
        self._version = listing[MANIFEST].version if MANIFEST in listing else ""
        self._sizes = {n.partition("/")[2]: row.size for n, row in listing.items() if n != MANIFEST}
        self._listed = True
        if MANIFEST not in listing:
            if not new:
                raise DatabaseError("PTM-D001", "there is no such database", file=self.url)
            if any(not name.startswith(f"{OBJECTS}/") for name in listing) and not force:
                raise OutputError(
                    "PTM-O010",
                    "the URL has objects and is not a ptmtools database",
                    file=self.url,
                    remedy="specify another prefix, or use --force to write beside them",
                )
            return
        data = self._objects.read(MANIFEST)
        try:
            file = f"{self.url}/{MANIFEST}"
            manifest = Manifest.from_bytes(data, file=file, lists=self._list)
        except DatabaseError:
            if not new or not force:
                raise
            return
        self._before = manifest, data
        copied = self._is_copied(manifest, data) if self.reading else self._is_current()
        if not copied:
            with self._lock_copy():
                self._bring(manifest.files() if self.reading else manifest.lists())
                self._replace_manifest(manifest, data)
                self._remember()

    def size(self, digest: str) -> int | None:
        """See `Elsewhere.size`, at the last listing."""
        return self._sizes.get(digest)

    def read(self, digest: str, start: int = 0, end: int | None = None) -> bytes:
        """See `Elsewhere.read`; raises DatabaseError PTM-D005 if there is none, PTM-D006 if the
        bytes are others."""
        if self._listed and digest not in self._sizes:
            raise DatabaseError(
                "PTM-D005",
                "is missing",
                file=f"{self.url}/{object_of(digest)}",
                remedy=Rebuild("run {} again to rebuild it"),
            )
        data = self._objects.read(object_of(digest), start, end)
        if start == 0 and end is None and sha256(data) != digest:
            raise DatabaseError(
                "PTM-D006",
                "damaged: its SHA-256 is not its name",
                file=f"{self.url}/{object_of(digest)}",
                remedy=Rebuild("remove it, then run {} again"),
            )
        return data

    def _list(self, digest: str) -> Mapping[str, str]:
        with suppress(DatabaseError):
            return lists_in(self.folder)(digest)
        return read_list(self.read(digest), file=f"{self.url}/{object_of(digest)}")

    def write(self, digest: str, data: bytes) -> None:
        """Writes an object."""
        self._objects.write(object_of(digest), data, _DATA)

    def provide(self, digest: str, load: Callable[[], bytes]) -> None:
        """Writes an object unless it is there."""
        if digest not in self._sizes:
            data = load()
            self.write(digest, data)
            self.note(digest, len(data))

    def note(self, digest: str, size: int) -> None:
        """Notes an object that was written since the last listing."""
        self._sizes[digest] = size

    def commit(self) -> None:
        """Writes what the copy has and the URL lacks, then the manifest, then removes the objects
        that the former manifest alone lists.

        Raises DatabaseError: PTM-D007 another process has written the manifest; PTM-D005, D006 a
        file of the copy is missing or damaged.
        """
        announce(f"writing {self.url}")
        data = (self.folder / MANIFEST).read_bytes()
        manifest = read_manifest(self.folder)
        assert manifest
        now = manifest.files()
        if self._version_now() != self._version:
            raise self._conflict()
        missing = {d: name for name, d in now.items() if d not in self._sizes}
        for _ in map_in_order(self._send, missing.items(), AT_ONCE):
            pass
        before, last = self._before or (None, b"")
        if data != last:
            try:
                self._objects.write(MANIFEST, data, _STATE, instead_of=self._version)
            except OutputError:
                if self._version_now() != self._version:
                    raise self._conflict() from None
                raise
            self._version = self._version_now()
        self._remember()
        if before:
            former = before.outputs_beyond(None, readable=True) | before.lists()
            old = {*former.values()}.difference(now.values()) & self._sizes.keys()
            for _ in map_in_order(self._objects.remove, map(object_of, sorted(old)), AT_ONCE):
                pass

    def _version_now(self) -> str:
        present = self._objects.info(MANIFEST)
        return present.version if present else ""

    def _send(self, item: tuple[str, str]) -> None:
        digest, name = item
        self.write(digest, read_recorded(self.folder / name, digest))

    def _is_current(self) -> bool:
        """Whether the copy was made from this state of the URL."""
        version = self._base.read_text() if self._base.is_file() else ""
        return version == self._version and real_file(self.folder, MANIFEST) is not None

    def _is_copied(self, manifest: Manifest, data: bytes) -> bool:
        """Whether the copy has this manifest, and all its files."""
        file = real_file(self.folder, MANIFEST)
        if file is None or file.read_bytes() != data:
            return False
        return all(real_file(self.folder, name) for name in manifest.files())

    def _bring(self, files: Mapping[str, str]) -> None:
        """Fetches files that the copy lacks or has with other bytes; those to be read all."""
        recover(self.folder)
        digests, builds = Digests(self.folder), self.folder.with_name(BUILDS)

        def bring(item: tuple[str, str]) -> None:
            name, digest = item
            file = real_file(self.folder, name)
            if file is not None and digests.digest(file) == digest:
                return
            data = b""
            with suppress(DatabaseError):
                data = read_recorded(builds / name, digest)
            with suppress(*() if self.reading else (DatabaseError,)):
                data = data or self.read(digest)
                write_bytes(real_place(self.folder, name), data, force=True)

        for _ in map_in_order(bring, files.items(), AT_ONCE):
            pass

    def _replace_manifest(self, manifest: Manifest, data: bytes) -> None:
        """Replaces that of the copy, and removes the files that it alone lists."""
        if former := last_manifest(self.folder):
            with writing(self.folder):
                remove_former(self.folder, former, manifest)
        write_bytes(self.folder / MANIFEST, data, force=True)

    @contextmanager
    def _lock_copy(self) -> Iterator[None]:
        with writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        release = acquire(self.folder)
        try:
            yield
        finally:
            release()

    def _remember(self) -> None:
        write_bytes(self._base, self._version.encode(), force=True)

    def _conflict(self) -> DatabaseError:
        return DatabaseError(
            "PTM-D007",
            "another ptm has written this database since this one has read it",
            file=self.url,
            remedy="run the command again",
        )


def fetch_database(url: str) -> Path:
    """The copy of a database at a URL, to read; raises as `RemoteDatabase.fetch`."""
    remote = RemoteDatabase(url, reading=True)
    with naming_url(url, remote.folder):
        remote.fetch()
    return remote.folder


def fetch_model(url: str) -> Path:
    """The copy of a model at a URL, with all other files of its folder but those of databases;
    fetches those that have changed.

    Raises InputError PTM-I122 if the store refuses or has no such model; OutputError PTM-O002,
    PTM-O003.
    """
    base, _, name = url.rpartition("/")
    objects = Objects(base, reading=True)
    announce(f"reading {base}")
    listing = objects.listing()
    of_databases = {name for name in listing if _OF_DATABASE.search(name)}
    of_databases |= {_OF_DATABASE.sub(f"/{MANIFEST}", name) for name in of_databases}
    files = {n: row for n, row in listing.items() if leads_inside(n) and n not in of_databases}
    if name not in files:
        raise objects.failure("there is no such model", url)
    folder = real_folder(folder_for("models", base))
    index = folder / "versions.json"
    known = json.loads(index.read_bytes()) if index.is_file() else {}
    copy = real_folder(folder, "files")

    def bring(file: str) -> None:
        if known.get(file) != files[file].version or real_file(copy, file) is None:
            write_bytes(real_place(copy, file), objects.read(file), force=True)

    for _ in map_in_order(bring, files, AT_ONCE):
        pass
    with writing(copy):
        for file in known.keys() - files.keys():
            remove_output(copy, file)
    versions = {file: row.version for file, row in files.items()}
    write_bytes(index, json.dumps(versions).encode(), force=True)
    return copy / name


@contextmanager
def folder_to_build(
    db: str | os.PathLike[str], *, new: bool = False, force: bool = False
) -> Iterator[tuple[Path, RemoteDatabase | None]]:
    """The folder of a database to build; of one at a URL that of its copy, after `fetch`."""
    db = plain_path(db)
    if not is_url(db):
        yield Path(db), None
        return
    remote = RemoteDatabase(str(db))
    with naming_url(remote.url, remote.folder):
        remote.fetch(new=new, force=force)
        yield remote.folder, remote


@contextmanager
def model_file(model: str | os.PathLike[str]) -> Iterator[tuple[Path, str]]:
    """The file of a model, of one at a URL that of its copy; and the URL of its folder, or ""."""
    model = plain_path(model)
    if not is_url(model):
        yield Path(model), ""
        return
    file, folder = fetch_model(str(model)), str(model).rpartition("/")[0]
    with naming_url(folder, file.parent):
        yield file, folder


@contextmanager
def naming_url(url: str, copy: Path) -> Iterator[None]:
    """Errors that name a copy, or a file of it, name its URL instead."""
    try:
        yield
    except PtmError as fault:
        if fault.file and Path(fault.file).is_relative_to(copy):
            name = Path(fault.file).relative_to(copy).as_posix()
            fault.file = url if name == "." else f"{url}/{name}"
        raise
