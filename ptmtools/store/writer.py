"""The right to write in a database folder: its lock, and the folders that a build accepts.

`.ptm-lock` names the writing process. The lock is not the file but the ``flock`` on it, which the
system releases however the process ends: the file of a killed build is stale, and the next build
takes it over. On a disk without such locks, such as some network shares, the file alone is the
lock; it is stale if it names a process of this machine that has ended. The writer removes the file
at its end.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Lock

from ptmtools.errors import DatabaseError, InputError, OutputError
from ptmtools.files import open_regular, writing
from ptmtools.store.folder import DatabaseFolder, last_manifest, read_manifest
from ptmtools.store.layout import LOCK, MANIFEST, STAGING
from ptmtools.store.manifest import Manifest
from ptmtools.store.transaction import Transaction, discard, recover


class DatabaseWriter(DatabaseFolder):
    """A database that only this process writes; a context manager.

    At a normal end it removes `.ptm-new/`; at another end, finished tasks stay there for the next
    run. If nothing was committed or finished, it removes the folders that it has created.
    """

    def __init__(
        self,
        path: Path,
        manifest: Callable[[], Manifest],
        created: list[Path],
        *,
        thoroughly: bool = False,
    ) -> None:
        """``manifest`` is called with the lock held; ``created`` are the folders created for the
        database, outermost first; ``thoroughly`` is for `without_lost`."""
        self._release, self._created, self._turn = acquire(path), created, Lock()
        try:
            recover(path)
            super().__init__(path, manifest())
            self.manifest = self.without_lost(thoroughly=thoroughly)
        except BaseException:
            self._release()
            raise

    @staticmethod
    def open_for_stage(path: str | os.PathLike[str]) -> DatabaseWriter:
        """An existing database, to run one of its stages; raises as `DatabaseFolder.open`, and
        PTM-D007 if another process is writing it."""
        DatabaseFolder.open(path)
        return DatabaseWriter(Path(path), lambda: DatabaseFolder.open(path).manifest, [])

    @staticmethod
    def open_for_model(
        path: str | os.PathLike[str], model: str, *, force: bool = False
    ) -> DatabaseWriter:
        """A new database, or one of the same model to resume or update.

        ``model`` is the model's file name. ``force`` allows a foreign folder, whose files stay, and
        a database of another model.

        Raises
        ------
        OutputError: PTM-O001 if the path is a file; PTM-O010 if the folder is not empty and no
            database, or holds another model; PTM-O002 if it cannot be written.
        DatabaseError: PTM-D002, PTM-D003 (without ``force``), PTM-D007.
        """
        folder = Path(path)
        if folder.exists() and not folder.is_dir():
            raise OutputError(
                "PTM-O001",
                "exists and is not a folder",
                file=folder,
                remedy="specify another folder with -o",
            )
        created = [p for p in (*reversed(folder.parents), folder) if not p.exists()]
        try:
            with writing(folder):
                folder.mkdir(parents=True, exist_ok=True)
            return DatabaseWriter(
                folder, lambda: admitted(folder, model, force=force), created, thoroughly=force
            )
        except BaseException as fault:
            _remove_empty(created)
            if isinstance(fault, OutputError) and fault.code == "PTM-O002":
                fault.remedy = "specify a folder that you may write to with -o"
            raise

    def __enter__(self) -> DatabaseWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        committed = (self.path / MANIFEST).exists()
        # A model that cannot be built leaves nothing behind.
        hopeless = kind is not None and issubclass(kind, InputError)
        with suppress(OSError):
            discard(self.path, also_finished=kind is None or (not committed and hopeless))
        self.digests.save()
        self._release()
        if not committed:
            _remove_empty(self._created)

    def begin(self, name: str) -> Transaction:
        """A transaction; concurrent ones have different names."""
        return Transaction(self, name, self._turn)


def admitted(folder: Path, model: str, *, force: bool) -> Manifest:
    """The manifest that a build of ``model`` starts from (design, "Overwriting"): an empty one for
    a new folder and for a database of an earlier schema.

    Raises as `DatabaseWriter.open_for_model`.
    """
    try:
        manifest = read_manifest(folder)
    except DatabaseError:
        earlier = last_manifest(folder)
        if not force and (earlier is None or earlier.model != model):
            raise
        return Manifest(model, replaced=earlier.replaced if earlier else None)
    if manifest and manifest.model == model:
        return manifest
    if manifest and not force:
        raise OutputError(
            "PTM-O010",
            f"holds the database of another model, {manifest.model}",
            file=folder,
            remedy="specify another folder with -o, or use --force to replace it",
        )
    if not force and _has_foreign_files(folder):
        raise OutputError(
            "PTM-O010",
            "the folder is neither empty nor a ptmtools database",
            file=folder,
            remedy="specify another folder with -o, or use --force to write into it",
        )
    return Manifest(model)


def _has_foreign_files(folder: Path) -> bool:
    with writing(folder):
        return folder.is_dir() and bool({e.name for e in folder.iterdir()} - {STAGING, LOCK})


def _remove_empty(created: list[Path]) -> None:
    with suppress(OSError):
        for folder in reversed(created):
            folder.rmdir()


#: `is_held` holds the lock for a moment: number of attempts, and the pause between, s.
_TRIES, _PAUSE = 5, 0.02


@dataclass(frozen=True)
class Holder:
    """The process named in a lock file."""

    pid: int
    host: str

    def __str__(self) -> str:
        return f"process {self.pid}" + ("" if self._here else f" on {self.host}")

    @property
    def gone(self) -> bool:
        """Whether it is known to have ended. This process may have got its number."""
        if not self._here:
            return False
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return True
        except OSError:
            return False
        return self.pid == os.getpid()

    @property
    def _here(self) -> bool:
        return self.host == socket.gethostname()


def acquire(folder: Path) -> Callable[[], None]:
    """Takes the lock of a folder that exists; returns the function that removes the lock file, then
    releases the lock.

    Raises
    ------
    DatabaseError: PTM-D007 if another process holds it.
    OutputError: PTM-O002 if the file cannot be created.
    """
    file = folder / LOCK
    for attempt in range(_TRIES):
        if attempt:
            time.sleep(_PAUSE)
        with writing(file):
            descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)
        # Between opening and locking it, its last holder may have removed it.
        if _locked(descriptor, folder) and _is(descriptor, file):
            process = {"pid": os.getpid(), "host": socket.gethostname()}
            with suppress(OSError):  # on a full disk it stays empty
                os.ftruncate(descriptor, 0)
                os.pwrite(descriptor, json.dumps(process).encode(), 0)
            return partial(_release, file, descriptor)
        os.close(descriptor)
    owner = holder(folder)
    raise DatabaseError(
        "PTM-D007",
        "another ptm is writing this database" + (f", {owner}" if owner else ""),
        file=folder,
        remedy="wait until it has finished",
    )


def _release(file: Path, descriptor: int) -> None:
    with suppress(OSError):
        file.unlink()
    os.close(descriptor)


def holder(folder: Path) -> Holder | None:
    """The process named in the lock file of a folder, whether or not it still runs."""
    try:
        with open_regular(folder / LOCK) as file:
            fields = json.loads(file.read(4096))
        return Holder(int(fields["pid"]), str(fields["host"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def is_held(folder: Path) -> bool:
    """Whether a process is writing in the folder now."""
    try:
        descriptor = os.open(folder / LOCK, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        return not _locked(descriptor, folder)
    finally:
        os.close(descriptor)


def _locked(descriptor: int, folder: Path) -> bool:
    """Takes the lock, unless another process holds it."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as fault:
        if fault.errno in (errno.EAGAIN, errno.EACCES):
            return False
        owner = holder(folder)  # a disk without locks
        return owner is None or owner.gone
    return True


def _is(descriptor: int, file: Path) -> bool:
    """Whether the open file is the one that has this name now."""
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(file, follow_symlinks=False))
    except OSError:
        return False
