"""Writing a file so that it is there whole or not at all.

The bytes go to a temporary file beside the target, are flushed to the disk and renamed onto it.
A temporary file is named `.ptm-<random>.tmp`; whatever goes wrong, it is removed.
"""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ptmtools.errors import OutputError

_FULL = (errno.ENOSPC, errno.EDQUOT)


def write_bytes(path: str | os.PathLike[str], data: bytes, force: bool = False) -> None:
    """Writes a file atomically.

    Raises
    ------
    OutputError: PTM-O001 if it exists and ``force`` is not given, PTM-O002 if it cannot be
        written, PTM-O003 if the disk is full.
    """
    target = Path(path)
    if target.exists() and not target.is_file():  # renaming would replace a device
        kind = "a folder" if target.is_dir() else "a device"
        raise OutputError("PTM-O002", f"is {kind}, not a file", file=target, remedy="name a file")
    if not force and os.path.lexists(target):
        raise OutputError(
            "PTM-O001",
            "exists already",
            file=target,
            remedy="name another output, or give --force to overwrite it",
        )
    with writing(target):
        temporary = target.with_name(f".ptm-{secrets.token_hex(8)}.tmp")
        try:
            with temporary.open("xb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(target)
        except BaseException:
            with suppress(OSError):
                temporary.unlink()
            raise


@contextmanager
def writing(file: str | os.PathLike[str]) -> Iterator[None]:
    """Turns what the system says about a file being written into an `OutputError`."""
    try:
        yield
    except OSError as fault:
        full = fault.errno in _FULL
        raise OutputError(
            "PTM-O003" if full else "PTM-O002",
            "the disk is full" if full else f"cannot be written ({fault.strerror or fault})",
            file=file,
            remedy="free some space and run again" if full else "check the folder and its rights",
        ) from fault
