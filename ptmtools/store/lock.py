"""The lock of a database folder.

`.ptm-lock` names the writing process. The lock is not the file but the ``flock`` on it (on Windows,
``LockFile`` of one byte far behind its end), which the system releases however the process ends:
the file of a killed build is stale, and the next build takes it over. On a disk without such locks,
such as some network shares, the file alone is the lock; it is stale if it names a process of this
machine that has ended. The writer removes the file at its end.
"""

from __future__ import annotations

import errno
import json
import os
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ptmtools.errors import DatabaseError
from ptmtools.files import open_regular, writing
from ptmtools.store.layout import LOCK

fcntl: Any
msvcrt: Any
try:
    import fcntl
except ImportError:  # Windows
    import msvcrt

    fcntl = None

#: The byte that Windows locks. Others cannot read a locked byte, and the name lies before it.
_LOCKED_BYTE = 1 << 30
#: No links, no pipes; the descriptor is not inherited. Windows has none of these.
_FLAGS = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_CLOEXEC", "O_NONBLOCK"))
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
    def has_ended(self) -> bool:
        """Whether it is known to have ended. This process may have got its number."""
        if not self._here or fcntl is None:  # on Windows, signal 0 would end the process
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
            descriptor = os.open(file, os.O_RDWR | os.O_CREAT | _FLAGS, 0o644)
        # Between opening and locking it, its last holder may have removed it.
        if _lock(descriptor, folder) and _is_named(descriptor, file):
            process = {"pid": os.getpid(), "host": socket.gethostname()}
            with suppress(OSError):  # on a full disk it stays empty
                os.ftruncate(descriptor, 0)
                os.lseek(descriptor, 0, os.SEEK_SET)
                os.write(descriptor, json.dumps(process).encode())
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
    with suppress(OSError):  # Windows removes no open file
        file.unlink()
    os.close(descriptor)
    if fcntl is None:
        with suppress(OSError):  # another process has opened it
            file.unlink()


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
        descriptor = os.open(folder / LOCK, os.O_RDONLY | _FLAGS)
    except OSError:
        return False
    try:
        return not _lock(descriptor, folder)
    finally:
        os.close(descriptor)


def _lock(descriptor: int, folder: Path) -> bool:
    """Takes the lock, unless another process holds it."""
    try:
        if fcntl is None:
            os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as fault:
        if fault.errno in (errno.EAGAIN, errno.EACCES):
            return False
        owner = holder(folder)  # a disk without locks
        return owner is None or owner.has_ended
    return True


def _is_named(descriptor: int, file: Path) -> bool:
    """Whether the open file is the one that has this name now."""
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(file, follow_symlinks=False))
    except OSError:
        return False
