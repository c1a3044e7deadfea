"""Reads a database: every file is compared with its recorded hash."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.files import open_regular, real_place, write_bytes
from ptmtools.store.digests import Digests
from ptmtools.store.layout import MANIFEST, arrays_of, sha256
from ptmtools.store.lists import ReadList, list_file, read_list
from ptmtools.store.manifest import Manifest, StageRecord, damaged_manifest

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Elsewhere(Protocol):
    """Files of a database that its folder lacks, by their SHA-256."""

    def size(self, digest: str) -> int | None:
        """Bytes of a file; None if there is none."""

    def read(self, digest: str, start: int = 0, end: int | None = None) -> bytes:
        """The bytes of a file from ``start`` to before ``end``; checked, if these are all."""


class DatabaseFolder:
    """A database on disk.

    Attributes
    ----------
    path: the folder.
    manifest: its last committed state.
    digests: of its files and of the model's.
    elsewhere: further files; None if the folder must have all.
    """

    elsewhere: Elsewhere | None = None

    def __init__(self, path: Path, manifest: Manifest) -> None:
        self.path = path
        self.manifest = manifest
        self.digests = Digests(path)

    @staticmethod
    def open(path: str | os.PathLike[str]) -> DatabaseFolder:
        """An existing database, to read.

        Raises
        ------
        DatabaseError: PTM-D001 no database there; PTM-D002 damaged manifest; PTM-D003 schema of
            another version.
        """
        folder = Path(path)
        manifest = read_manifest(folder)
        if manifest is None:
            raise DatabaseError(
                "PTM-D001",
                "not a ptmtools database" if folder.exists() else "there is no such database",
                file=folder,
                remedy="make one with `ptm build-scene MODEL -o DB`",
            )
        return DatabaseFolder(folder, manifest)

    def record(self, stage: str) -> StageRecord:
        """The record of a stage.

        Raises
        ------
        DatabaseError: PTM-D004 if the stage has not been run.
        """
        record = self.manifest.stages.get(stage)
        if record is None:
            raise DatabaseError(
                "PTM-D004",
                f"the {stage} stage has not been run, this command needs it",
                file=self.path,
                remedy=Rebuild("run {} first"),
            )
        return record

    def read(self, name: str, digest: str) -> bytes:
        """The bytes of a file of the database.

        Raises
        ------
        DatabaseError: PTM-D005 if it is missing, PTM-D006 if its hash is not the recorded one.
        """
        try:
            return read_recorded(self.path / name, digest)
        except DatabaseError:
            if self.elsewhere is None or self.elsewhere.size(digest) is None:
                raise
            return self.elsewhere.read(digest)

    def source(self, name: str, digest: str) -> Path | Callable[[int, int], bytes]:
        """A file of the database, or a function ``read(offset, length)`` if it is elsewhere."""
        elsewhere, file = self.elsewhere, self.path / name
        if elsewhere is None or self.has(name, digest):
            return file
        return lambda offset, length: elsewhere.read(digest, offset, offset + length)

    def size(self, name: str, digest: str) -> int:
        """Bytes of a file of the database; raises PTM-D005 if it is missing."""
        size = self.elsewhere.size(digest) if self.elsewhere else None
        if size is not None:
            return size
        file = self.path / name
        try:
            return file.stat().st_size
        except OSError as fault:
            raise reading_error(file, fault) from fault

    def read_output(self, stage: str, name: str) -> bytes:
        """The bytes of an output that a stage must have; raises as `output` and `read`."""
        return self.read(name, self.output(stage, name))

    def output(self, stage: str, name: str) -> str:
        """The recorded hash of an output that a stage must have; raises as `record`, and
        PTM-D002 if it has no such output."""
        digest = self.record(stage).outputs.get(name)
        if digest is None:
            # The stage counts as current, so only a build of everything runs it again.
            what = f"the {stage} stage lists no {name}"
            raise damaged_manifest(self.path / MANIFEST, what, "--force --rebuild")
        return digest

    def read_arrays(self, stage: str) -> dict[str, NDArray[np.generic]]:
        """The arrays of a stage; raises as `read_output`."""
        from ptmtools.store.archive import unpack_arrays

        name = arrays_of(stage)
        return unpack_arrays(self.read_output(stage, name), file=self.path / name)

    def bring(self, name: str, digest: str) -> None:
        """Copies a file that is only elsewhere into the folder; raises as `read`."""
        missing = self.elsewhere is None or self.elsewhere.size(digest) is None
        if not missing and not self.has(name, digest):
            write_bytes(real_place(self.path, name), self.read(name, digest), force=True)

    def without_lost(self, *, thoroughly: bool = False) -> Manifest:
        """The manifest without stages that lack one of their lists (`Manifest.lost`), or with
        ``thoroughly`` have one that is no list of theirs."""
        lost = {}
        for name, record in self.manifest.stages.items():
            files = record.list_files()
            if file := next((f for f, digest in files.items() if not self.has(f, digest)), None):
                lost[name] = file
            elif thoroughly:
                try:
                    len(record.inputs), len(record.outputs)
                except DatabaseError:
                    lost[name] = next(iter(files))
        return self.manifest.without_stages(lost)

    def first_damage(self, outputs: Mapping[str, str]) -> str | None:
        """The first file that is missing or has another hash, or None."""
        elsewhere = self.elsewhere
        for name, digest in outputs.items():
            if not self.has(name, digest) and (elsewhere is None or elsewhere.size(digest) is None):
                return name
        return None

    def has(self, name: str, digest: str) -> bool:
        """Whether the folder itself has a file."""
        with suppress(OSError, ValueError):  # a NUL in the name
            return self.digests.digest(self.path / name) == digest
        return False


def read_recorded(file: Path, digest: str) -> bytes:
    """The bytes of a file; raises as `DatabaseFolder.read`."""
    try:
        with open_regular(file) as stream:
            data = stream.read()
    except OSError as fault:
        raise reading_error(file, fault) from fault
    if sha256(data) != digest:
        raise damage_error(file, "its SHA-256 is not the recorded one")
    return data


def lists_in(folder: Path) -> ReadList:
    """Reads the lists of a database; raises PTM-D005 and PTM-D006."""

    def read(digest: str) -> Mapping[str, str]:
        file = folder / list_file(digest)
        return read_list(read_recorded(file, digest), file=file)

    return read


def reading_error(file: Path, fault: OSError) -> DatabaseError:
    """The error for a file of a database that cannot be read, PTM-D005."""
    return _unusable("PTM-D005", f"cannot be read ({fault.strerror or fault})", file)


def damage_error(file: Path, what: str) -> DatabaseError:
    """The error for a file of a database with damaged contents, PTM-D006."""
    return _unusable("PTM-D006", f"damaged: {what}", file)


def _unusable(code: str, message: str, file: Path) -> DatabaseError:
    return DatabaseError(code, message, file=file, remedy=Rebuild("run {} again to rebuild it"))


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest of a folder, None if there is none.

    Raises
    ------
    DatabaseError: as `DatabaseFolder.open`.
    """
    file = folder / MANIFEST
    try:
        with open_regular(file) as stream:
            data = stream.read()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as fault:
        raise DatabaseError(
            "PTM-D001", f"cannot be read ({fault.strerror or fault})", file=file
        ) from fault
    return Manifest.from_bytes(data, file=file, lists=lists_in(folder))


def last_manifest(folder: Path) -> Manifest | None:
    """As `read_manifest`; None if it is damaged."""
    with suppress(DatabaseError):
        return read_manifest(folder)
    return None
