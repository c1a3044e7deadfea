"""Where the bytes of a `.ptm` come from: a path, bytes, an open file, or whatever reads ranges."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import BinaryIO, Protocol

from ptmtools.errors import InputError

#: ``read(offset, length)``: that range of the file, shorter only where the file ends.
RangeReader = Callable[[int, int], bytes]
#: What `ptmtools.texture.open` takes.
Source = str | os.PathLike[str] | bytes | bytearray | memoryview | BinaryIO | RangeReader


class Ranges(Protocol):
    """A file that can be read in pieces, from several threads."""

    name: str | None

    def read(self, offset: int, length: int) -> bytes:
        """That range of the file; shorter only where the file ends."""

    def size(self) -> int | None:
        """Bytes there are; None if that is not known before reading them."""

    def close(self) -> None:
        """Nothing is read any more."""


class Bytes:
    """A file that lies in memory."""

    name: str | None = None

    def __init__(self, data: bytes | bytearray | memoryview) -> None:
        self._data = memoryview(data).cast("B")

    def read(self, offset: int, length: int) -> bytes:
        """See `Ranges`."""
        return bytes(self._data[offset : offset + length])

    def size(self) -> int:
        """See `Ranges`."""
        return len(self._data)

    def close(self) -> None:
        """See `Ranges`."""


class File:
    """An open file that can seek. It is closed with this only if it was opened by it."""

    def __init__(self, file: BinaryIO, name: str | None = None, own: bool = False) -> None:
        self.name = name
        self._file = file
        self._own = own
        self._lock = Lock()

    def read(self, offset: int, length: int) -> bytes:
        """See `Ranges`. Raises InputError PTM-I122."""
        try:
            with self._lock:
                self._file.seek(offset)
                return self._file.read(length)
        except OSError as error:
            raise InputError(
                "PTM-I122", f"cannot be read ({error.strerror or error})", file=self.name
            ) from None

    def size(self) -> int:
        """See `Ranges`."""
        with self._lock:
            return self._file.seek(0, os.SEEK_END)

    def close(self) -> None:
        """See `Ranges`."""
        if self._own:
            self._file.close()


class Callback:
    """Ranges that the caller reads, over a network for instance."""

    name: str | None = None

    def __init__(self, read: RangeReader) -> None:
        self._read = read

    def read(self, offset: int, length: int) -> bytes:
        """See `Ranges`."""
        return self._read(offset, length)

    def size(self) -> None:
        """See `Ranges`."""

    def close(self) -> None:
        """See `Ranges`."""


def ranges_of(source: Source) -> Ranges:
    """``source`` as something to read ranges from.

    Raises InputError: PTM-I120 no such file, PTM-I121 a folder, PTM-I122 not readable.
    """
    if isinstance(source, bytes | bytearray | memoryview):
        return Bytes(source)
    if isinstance(source, str | os.PathLike):
        return File(open_file(source), os.fspath(source), own=True)
    if callable(source):
        return Callback(source)
    if not (hasattr(source, "seekable") and source.seekable()):
        return Bytes(source.read())
    return File(source)


def open_file(path: str | os.PathLike[str]) -> BinaryIO:
    """A file opened for reading; raises as `ranges_of`."""
    try:
        return Path(path).open("rb")
    except FileNotFoundError:
        raise InputError("PTM-I120", "there is no such file", file=path) from None
    except IsADirectoryError:
        raise InputError(
            "PTM-I121", "is a folder, not a file", file=path, remedy="name a file in it"
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            "PTM-I122", f"cannot be read ({reason})", file=path, remedy="check its permissions"
        ) from None
