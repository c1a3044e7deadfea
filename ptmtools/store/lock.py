"""One writer a database: a lock file that says who, and a lock on it that the system lets go.

`.ptm-lock` names the process that writes. What counts is not the file but the lock that the
process holds on it (``flock``): the system lets go of that however the process ends, so the file
of a killed build is stale, and is taken over without a question. On a disk without such locks,
such as some network shares, the file alone counts, and is stale if the process that it names ran
on this machine and runs no more. The file goes when the writer is done.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import socket
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ptmtools.errors import DatabaseError
from ptmtools.files import open_regular, writing
from ptmtools.store.layout import LOCK

#: Who only looks whether a lock is held holds it for a moment: how often to try, and the pause.
_TRIES, _PAUSE = 5, 0.02


@dataclass(frozen=True)
class Holder:
    """The process that a lock file names."""

    pid: int
    host: str

    def __str__(self) -> str:
        return f"process {self.pid}" + ("" if self._here else f" on {self.host}")

    @property
    def gone(self) -> bool:
        """Whether it is known to run no more. Another process may have its number since."""
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


class Lock:
    """The right to write in a folder; `release` gives it back."""

    def __init__(self, file: Path, descriptor: int) -> None:
        self._file = file
        self._descriptor = descriptor

    def release(self) -> None:
        """Removes the lock file, then lets go."""
        with suppress(OSError):
            self._file.unlink()
        os.close(self._descriptor)


def acquire(folder: Path) -> Lock:
    """Takes the lock of a folder that exists.

    Raises
    ------
    DatabaseError: PTM-D007 if another process has it.
    OutputError: PTM-O002 if no file can be made there.
    """
    file = folder / LOCK
    for attempt in range(_TRIES):
        if attempt:
            time.sleep(_PAUSE)
        with writing(file):
            descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)
        # Between opening and locking it, its last holder may have removed it.
        if _locked(descriptor, folder) and _is(descriptor, file):
            signature = {"pid": os.getpid(), "host": socket.gethostname()}
            with suppress(OSError):  # on a full disk it stays unsigned
                os.ftruncate(descriptor, 0)
                os.pwrite(descriptor, json.dumps(signature).encode(), 0)
            return Lock(file, descriptor)
        os.close(descriptor)
    found = holder(folder)
    raise DatabaseError(
        "PTM-D007",
        "another ptm is writing this database" + (f", {found}" if found else ""),
        file=folder,
        remedy="wait until it has finished",
    )


def holder(folder: Path) -> Holder | None:
    """The process that the lock file of a folder names, whether or not it still runs."""
    try:
        with open_regular(folder / LOCK) as file:
            found = json.loads(file.read(4096))
        return Holder(int(found["pid"]), str(found["host"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def is_held(folder: Path) -> bool:
    """Whether a process is writing in the folder at this moment."""
    try:
        descriptor = os.open(folder / LOCK, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        return not _locked(descriptor, folder)
    finally:
        os.close(descriptor)


def _locked(descriptor: int, folder: Path) -> bool:
    """Takes the lock, unless another process has it."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as fault:
        if fault.errno in (errno.EAGAIN, errno.EACCES):
            return False
        found = holder(folder)  # a disk without locks
        return found is None or found.gone
    return True


def _is(descriptor: int, file: Path) -> bool:
    """Whether a descriptor is of the file that now has this name."""
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(file, follow_symlinks=False))
    except OSError:
        return False
