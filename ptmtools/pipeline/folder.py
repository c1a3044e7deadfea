"""The database folder: who may write in it, and how it passes from one state to the next.

A transaction. Outputs of a stage gather in `.ptm-new/` inside the database; once all are there,
the new manifest is put beside them, and that is the commit: from then on they are moved to their
places, what they replace is removed, and the manifest goes last. Killed before the commit, the
database is what it was; killed after it, the next run finishes the move. Either way the next run
resumes at the first stage that is not current. (Tried: renaming every output as it is written. A
build killed half-way through an update then leaves files that no manifest describes.)

Nothing is removed but what a manifest of ours lists, and `.ptm-new/` itself.
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError, OutputError
from ptmtools.files import write_bytes, writing
from ptmtools.pipeline.archive import pack_arrays, unpack_arrays
from ptmtools.pipeline.manifest import Manifest, StageRecord

MANIFEST = "manifest.json"
STAGING = ".ptm-new"


def sha256(data: bytes) -> str:
    """Hex digest."""
    return hashlib.sha256(data).hexdigest()


class DatabaseFolder:
    """A database on disk: reading, with every file held against its recorded hash.

    Attributes
    ----------
    path: the folder.
    manifest: what it says of itself.
    """

    def __init__(self, path: Path, manifest: Manifest) -> None:
        self.path = path
        self.manifest = manifest

    @staticmethod
    def open(path: str | os.PathLike[str]) -> DatabaseFolder:
        """An existing database, to read.

        Raises
        ------
        DatabaseError: PTM-D001 no database there; PTM-D002 damaged manifest; PTM-D003 schema of
            another version.
        """
        folder = Path(path)
        manifest = _read_manifest(folder)
        if manifest is None:
            raise DatabaseError(
                "PTM-D001",
                "not a ptmtools database" if folder.exists() else "there is no such database",
                file=folder,
                remedy="make one with `ptm build-scene MODEL -o DB`",
            )
        return DatabaseFolder(folder, manifest)

    def record(self, stage: str, needed_for: str = "this") -> StageRecord:
        """The record of a stage.

        Raises
        ------
        DatabaseError: PTM-D004 if the stage has not been run.
        """
        record = self.manifest.stages.get(stage)
        if record is None:
            command = "cells MODEL -o" if stage in ("scene", "cells") else stage
            raise DatabaseError(
                "PTM-D004",
                f"the {stage} stage has not been run, {needed_for} needs it",
                file=self.path,
                remedy=f"run `ptm {command} DB` or `ptm build-scene MODEL -o DB` first",
            )
        return record

    def read(self, name: str, digest: str) -> bytes:
        """The bytes of a file of the database.

        Raises
        ------
        DatabaseError: PTM-D005 if it is missing, PTM-D006 if it is not what was recorded.
        """
        file = self.path / name
        try:
            data = file.read_bytes()
        except OSError as fault:
            raise DatabaseError(
                "PTM-D005",
                f"cannot be read ({fault.strerror or fault})",
                file=file,
                remedy="run `ptm build-scene` again to rebuild it",
            ) from fault
        if sha256(data) != digest:
            raise DatabaseError(
                "PTM-D006",
                "damaged: its SHA-256 is not the recorded one",
                file=file,
                remedy="run `ptm build-scene` again to rebuild it",
            )
        return data

    def read_arrays(self, stage: str, needed_for: str) -> dict[str, NDArray[np.generic]]:
        """The arrays of ``stages/<stage>.npz``; raises as `record` and `read` do."""
        name = f"stages/{stage}.npz"
        digest = self.record(stage, needed_for).outputs.get(name)
        if digest is None:
            raise DatabaseError("PTM-D002", f"the {stage} stage lists no {name}", file=self.path)
        return unpack_arrays(self.read(name, digest), file=self.path / name)

    def intact(self, outputs: Mapping[str, str]) -> bool:
        """Whether each file is there with its recorded hash."""
        try:
            for name, digest in outputs.items():
                with (self.path / name).open("rb") as file:
                    if hashlib.file_digest(file, "sha256").hexdigest() != digest:
                        return False
        except OSError:
            return False
        return True


class DatabaseWriter(DatabaseFolder):
    """A database that this process, and no other, writes; a context manager.

    A folder that was made for it goes again if nothing was committed.
    """

    def __init__(self, path: Path, manifest: Manifest, lock: int, made: list[Path]) -> None:
        super().__init__(path, manifest)
        self._lock = lock
        self._made = made
        self._pending: dict[str, str] = {}

    @property
    def staging(self) -> Path:
        """Where outputs wait for their commit, each under its name in the database."""
        return self.path / STAGING

    @staticmethod
    def open_for_stage(path: str | os.PathLike[str]) -> DatabaseWriter:
        """An existing database, to run one of its stages; raises as `DatabaseFolder.open` does,
        and PTM-D007 if another process is writing it."""
        folder = Path(path)
        DatabaseFolder.open(folder)
        lock = _lock(folder)
        try:
            _finish(folder)
            return DatabaseWriter(folder, DatabaseFolder.open(folder).manifest, lock, [])
        except BaseException:
            os.close(lock)
            raise

    @staticmethod
    def open_for_model(
        path: str | os.PathLike[str], model: str, *, force: bool = False
    ) -> DatabaseWriter:
        """A new database, or one of the same model to resume or update.

        ``model`` is the model's file name. ``force`` allows a folder that is not ours and a
        database of another model; foreign files in it stay.

        Raises
        ------
        OutputError: PTM-O001 if a file is in the way; PTM-O010 if the folder is not empty and not
            ours; PTM-O011 if it holds another model; PTM-O002 if it cannot be written.
        DatabaseError: PTM-D002, PTM-D003 (without ``force``), PTM-D007.
        """
        folder = Path(path)
        if folder.exists() and not folder.is_dir():
            raise OutputError(
                "PTM-O001", "exists and is not a folder", file=folder, remedy="name another output"
            )
        made = _make(folder)
        try:
            lock = _lock(folder)
        except BaseException:
            _unmake(made)
            raise
        try:
            _finish(folder)
            return DatabaseWriter(folder, _admit(folder, model, force), lock, made)
        except BaseException:
            os.close(lock)
            _unmake(made)
            raise

    def __enter__(self) -> DatabaseWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        shutil.rmtree(self.staging, ignore_errors=True)
        os.close(self._lock)
        if not (self.path / MANIFEST).exists():
            _unmake(self._made)

    def is_current(self, stage: str, work: StageRecord) -> bool:
        """Whether the stage has done this very work, and its outputs are all intact."""
        record = self.manifest.stages.get(stage)
        return record is not None and record.same_work(work) and self.intact(record.outputs)

    def put(self, name: str, data: bytes) -> None:
        """Stages one output; it takes its place at `commit`.

        Raises
        ------
        OutputError: PTM-O002, PTM-O003.
        """
        file = self.staging / name
        with writing(file):
            file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(file, data, force=True)
        self._pending[name] = sha256(data)

    def adopt(self, name: str) -> None:
        """Stages a file that another wrote into `staging`."""
        self._pending[name] = sha256((self.staging / name).read_bytes())

    def put_arrays(self, stage: str, arrays: Mapping[str, NDArray[np.generic]]) -> None:
        """Stages ``stages/<stage>.npz``."""
        self.put(f"stages/{stage}.npz", pack_arrays(arrays))

    def pending(self) -> dict[str, str]:
        """What was put since the last commit: name → SHA-256."""
        return dict(self._pending)

    def commit(self, records: Mapping[str, StageRecord]) -> None:
        """Makes what was put the outputs of these stages, and records them."""
        manifest = self.manifest
        for stage, record in records.items():
            manifest = manifest.with_stage(stage, record)
        with writing(self.path):
            self.staging.mkdir(exist_ok=True)
        write_bytes(self.staging / MANIFEST, manifest.to_bytes(), force=True)
        _finish(self.path)
        self.manifest = manifest
        self._pending = {}


def _read_manifest(folder: Path) -> Manifest | None:
    file = folder / MANIFEST
    try:
        data = file.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as fault:
        raise DatabaseError(
            "PTM-D001", f"cannot be read ({fault.strerror or fault})", file=file
        ) from fault
    return Manifest.from_bytes(data, file=file)


def _admit(folder: Path, model: str, force: bool) -> Manifest:
    """The manifest to start from, or a refusal (design, "Overwriting")."""
    try:
        manifest = _read_manifest(folder)
    except DatabaseError:
        if not force:
            raise
        return Manifest(model)
    if manifest is None:
        if not force and any(folder.iterdir()):
            raise OutputError(
                "PTM-O010",
                "the folder is not empty and not a ptmtools database",
                file=folder,
                remedy="name another folder, or give --force to write into this one",
            )
        return Manifest(model)
    if manifest.model != model:
        if not force:
            raise OutputError(
                "PTM-O011",
                f"holds the database of another model, {manifest.model}",
                file=folder,
                remedy="name another folder, or give --force to replace it",
            )
        return Manifest(model)
    return manifest


def _finish(folder: Path) -> None:
    """Completes a committed transaction, and drops one that was not."""
    staging = folder / STAGING
    if not staging.is_dir():
        return
    with writing(folder):
        if (staging / MANIFEST).is_file():
            try:
                before = _read_manifest(folder)
            except DatabaseError:
                before = None
            after = Manifest.from_bytes(
                (staging / MANIFEST).read_bytes(), file=staging / MANIFEST
            ).outputs()
            for name in after:
                if (staging / name).is_file():
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    (staging / name).replace(folder / name)
            for name in before.outputs() if before else ():
                if name not in after:
                    _remove(folder, name)
            (staging / MANIFEST).replace(folder / MANIFEST)
        shutil.rmtree(staging)


def _remove(folder: Path, name: str) -> None:
    """Removes an output that no stage has any more, and the folders that this empties."""
    file = folder / name
    file.unlink(missing_ok=True)
    with suppress(OSError):
        while (file := file.parent) != folder:
            file.rmdir()


def _make(folder: Path) -> list[Path]:
    """Makes the folder; returns what was made, outermost first."""
    made = [p for p in (*reversed(folder.parents), folder) if not p.exists()]
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    return made


def _unmake(made: list[Path]) -> None:
    with suppress(OSError):
        for folder in reversed(made):
            folder.rmdir()


def _lock(folder: Path) -> int:
    """An advisory lock on the folder itself: nothing to leave behind."""
    try:
        import fcntl
    except ImportError:  # no advisory locks there: the transaction still keeps it whole
        return os.open(os.devnull, os.O_RDONLY)
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as fault:
        if fault.errno in (errno.EAGAIN, errno.EACCES):
            os.close(descriptor)
            raise DatabaseError(
                "PTM-D007",
                "another ptm is writing this database",
                file=folder,
                remedy="wait until it has ended",
            ) from fault
        # A file system without locks, such as some network shares.
    return descriptor
