"""A database at a URL, and a model at a URL, each with a copy in the user's cache folder.

::

    manifest.json     the state of the database, as in a folder
    objects/SHA256    each file that the manifest lists, under the digest of its bytes

Objects never change. So any machine may write them at any time, workers read and write them by
their digests alone, and a build that is killed leaves the state that the manifest describes. The
manifest is written last, on condition that it is still the one that was read; S3 checks that at
the moment of writing, other stores shortly before.

A build works in the copy, which is ahead of the URL after an interrupted build; it is replaced if
the manifest at the URL is another than at the last exchange.

Tried and rejected: the names of the database as names of objects. A reader would then meet new
files with the old manifest, and S3 renames nothing.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from ptmtools.errors import DatabaseError, OutputError, PtmError
from ptmtools.files import leads_inside, real_file, real_folder, write_bytes, writing
from ptmtools.parallel import ordered
from ptmtools.progress import announce
from ptmtools.store.digests import Digests, cache_folder
from ptmtools.store.folder import damaged, last_manifest, lists_in, read_manifest, unreadable
from ptmtools.store.layout import MANIFEST, sha256
from ptmtools.store.lists import read_list
from ptmtools.store.manifest import Manifest, listed_before
from ptmtools.store.objects import Headers, Held, Objects
from ptmtools.store.transaction import recover, remove_former, remove_output
from ptmtools.store.writer import acquire

#: Objects that are sent or fetched at a time: each waits for the network.
AT_ONCE = 8
OBJECTS = "objects"
_DATA = Headers("application/octet-stream", "public, max-age=31536000, immutable")
_STATE = Headers("application/json", "no-cache")


def object_of(digest: str) -> str:
    """The object of the file with a SHA-256."""
    return f"{OBJECTS}/{digest}"


class RemoteDatabase:
    """A database at a URL.

    Attributes
    ----------
    url: its URL. folder: its copy.

    Raises as `Objects`; all methods raise OutputError PTM-O012 if the store refuses.
    """

    def __init__(self, url: str) -> None:
        self._objects = Objects(url)
        self.url = self._objects.url
        self.folder = _cached("databases", self.url) / "db"
        self._base = self.folder.parent / "version"
        self._version = ""
        self._before: Manifest | None = None
        self._present: set[str] = set()

    def fetch(self, *, force: bool = False, reading: bool = False) -> None:
        """Brings the copy up to the state at the URL, unless it is that, or ahead of it. Without
        ``reading``, a manifest of an earlier schema counts as none, since a build replaces it.

        Raises
        ------
        OutputError: PTM-O010 other objects are there, without ``force``.
        DatabaseError: PTM-D001 to D003 the manifest is wrong; PTM-D006 an object is damaged;
            PTM-D007 another process is writing the copy.
        """
        announce(f"reading {self.url}")
        real_folder(self.folder.parent)
        held = self._objects.listing()
        self._note(held)
        foreign = [name for name in held if not name.startswith(f"{OBJECTS}/")]
        if foreign and MANIFEST not in held and not force:
            raise OutputError(
                "PTM-O010",
                "the URL has objects and is not a ptmtools database",
                file=self.url,
                remedy="specify another prefix, or use --force to write beside them",
            )
        if MANIFEST not in held:
            return
        data = self._objects.read(MANIFEST)
        try:
            file = f"{self.url}/{MANIFEST}"
            self._before = Manifest.from_bytes(data, file=file, lists=self._list)
        except DatabaseError:
            if reading or not (force or listed_before(data)):
                raise
            return
        if self._version != self._last_version():
            with self._locked():
                self._replace_copy(self._before, data)
                self._remember()

    def read(self, digest: str) -> bytes:
        """The bytes of an object; raises DatabaseError PTM-D006 if they are others."""
        data = self._objects.read(object_of(digest))
        if sha256(data) != digest:
            raise DatabaseError(
                "PTM-D006",
                "damaged: its SHA-256 is not its name",
                file=f"{self.url}/{object_of(digest)}",
                remedy="remove it and build again",
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
        """Writes an object unless it was there at the last listing."""
        if digest not in self._present:
            self.write(digest, load())
            self._present.add(digest)

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
        before = self._before.files() if self._before else {}
        held = self._objects.listing()
        if _version(held) != self._version:
            raise self._overtaken()
        self._note(held)
        missing = {d: name for name, d in now.items() if d not in self._present}
        for _ in ordered(self._send, missing.items(), AT_ONCE):
            pass
        if self._before is None or data != self._before.to_bytes():
            try:
                self._objects.write(MANIFEST, data, _STATE, instead_of=self._version)
            except OutputError:
                if _version(self._objects.listing()) != self._version:
                    raise self._overtaken() from None
                raise
            self._version = _version(self._objects.listing())
        self._remember()
        old = set(before.values()).difference(now.values()) & self._present
        for _ in ordered(self._objects.remove, map(object_of, sorted(old)), AT_ONCE):
            pass

    def _note(self, held: dict[str, Held]) -> None:
        self._version = _version(held)
        self._present = {name.partition("/")[2] for name in held if name != MANIFEST}

    def _send(self, item: tuple[str, str]) -> None:
        digest, name = item
        file = self.folder / name
        try:
            data = file.read_bytes()
        except OSError as fault:
            raise unreadable(file, fault) from fault
        if sha256(data) != digest:
            raise damaged(file, "its SHA-256 is not the recorded one")
        self.write(digest, data)

    def _replace_copy(self, manifest: Manifest, data: bytes) -> None:
        recover(self.folder)
        digests = Digests(self.folder)
        former = last_manifest(self.folder)

        def bring(item: tuple[str, str]) -> None:
            name, digest = item
            file = real_file(self.folder, name)
            if file is None or digests.of(file) != digest:
                folder, _, base = name.rpartition("/")
                place = real_folder(self.folder, folder) / base
                write_bytes(place, self.read(digest), force=True)

        for _ in ordered(bring, manifest.files().items(), AT_ONCE):
            pass
        if former:
            with writing(self.folder):
                remove_former(self.folder, former, manifest)
        write_bytes(self.folder / MANIFEST, data, force=True)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        with writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        release = acquire(self.folder)
        try:
            yield
        finally:
            release()

    def _last_version(self) -> str:
        return self._base.read_text() if self._base.is_file() else ""

    def _remember(self) -> None:
        write_bytes(self._base, self._version.encode(), force=True)

    def _overtaken(self) -> DatabaseError:
        return DatabaseError(
            "PTM-D007",
            "another ptm has written this database since this one has read it",
            file=self.url,
            remedy="run the command again",
        )


def fetch_database(url: str) -> Path:
    """The copy of a database at a URL, to read; raises as `RemoteDatabase.fetch`, and PTM-D001 if
    there is none."""
    remote = RemoteDatabase(url)
    with naming_url(url, remote.folder):
        remote.fetch(reading=True)
        if not (remote.folder / MANIFEST).is_file():
            raise DatabaseError("PTM-D001", "there is no such database", file=url)
    return remote.folder


def fetch_model(url: str) -> Path:
    """The copy of a model at a URL, with all other files of its folder; fetches those that have
    changed.

    Raises InputError PTM-I122 if the store refuses or has no such model; OutputError PTM-O002,
    PTM-O003.
    """
    base, _, name = url.rpartition("/")
    objects = Objects(base, reading=True)
    announce(f"reading {base}")
    held = {own: row for own, row in objects.listing().items() if leads_inside(own)}
    if name not in held:
        raise objects.failure("there is no such model", url)
    folder = real_folder(_cached("models", base))
    index = folder / "versions.json"
    known = json.loads(index.read_bytes()) if index.is_file() else {}
    copy = real_folder(folder, "files")

    def bring(own: str) -> None:
        if known.get(own) != held[own].version or real_file(copy, own) is None:
            parent, _, last = own.rpartition("/")
            write_bytes(real_folder(copy, parent) / last, objects.read(own), force=True)

    for _ in ordered(bring, held, AT_ONCE):
        pass
    with writing(copy):
        for own in known.keys() - held.keys():
            remove_output(copy, own)
    versions = {own: row.version for own, row in held.items()}
    write_bytes(index, json.dumps(versions).encode(), force=True)
    return copy / name


@contextmanager
def naming_url(url: str, copy: Path) -> Iterator[None]:
    """Errors that name a file of a copy name its URL instead."""
    try:
        yield
    except PtmError as fault:
        if fault.file and Path(fault.file).is_relative_to(copy):
            name = Path(fault.file).relative_to(copy).as_posix()
            fault.file = url if name == "." else f"{url}/{name}"
        raise


def _version(held: dict[str, Held]) -> str:
    return held[MANIFEST].version if MANIFEST in held else ""


def _cached(kind: str, url: str) -> Path:
    """The folder for the copy of a URL."""
    folder = cache_folder(kind)
    if folder is None:
        raise OutputError(
            "PTM-O002", "there is no folder for copies", file=url, remedy="set XDG_CACHE_HOME"
        )
    return folder / sha256(url.encode())[:32]
