"""Where the bytes of a `.ptm` come from: a path, bytes, an open file, or whatever reads ranges."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable, Iterator
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
        view = memoryview(data)
        self._data = (view if view.c_contiguous else memoryview(bytes(view))).cast("B")

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
        with self._lock, self._refusing():
            self._file.seek(offset)
            return self._file.read(length)

    def size(self) -> int:
        """See `Ranges`. Raises InputError PTM-I122."""
        with self._lock, self._refusing():
            return self._file.seek(0, os.SEEK_END)

    @contextlib.contextmanager
    def _refusing(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as error:  # ValueError: it is closed
            reason = getattr(error, "strerror", None) or error
            raise InputError("PTM-I122", f"cannot be read ({reason})", file=self.name) from None

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
        """See `Ranges`. Raises InputError PTM-I122 if no bytes are given."""
        found: object = self._read(offset, length)
        if not isinstance(found, bytes | bytearray | memoryview):
            raise InputError(
                "PTM-I122", f"what reads ranges gave {type(found).__name__} instead of bytes"
            )
        # More than was asked for is no harm: some servers send all there is.
        return bytes(found)[:length]

    def size(self) -> None:
        """See `Ranges`."""

    def close(self) -> None:
        """See `Ranges`."""


def ranges_of(source: Source) -> Ranges:
    """``source`` as something to read ranges from.

    Raises
    ------
    InputError: PTM-I120 no such file, PTM-I121 a folder, PTM-I122 not readable.
    TypeError: for what is none of the kinds of `Source`; text files are not.
    """
    if isinstance(source, bytes | bytearray | memoryview):
        return Bytes(source)
    if isinstance(source, str | os.PathLike):
        return File(open_file(source), os.fspath(source), own=True)
    if callable(source):
        return Callback(source)
    unknown: object = source
    if isinstance(unknown, io.TextIOBase) or not hasattr(source, "read"):
        raise TypeError(
            "a .ptm is read from a path, bytes, a file opened in binary mode or a function that "
            f"reads ranges, not from {type(source).__name__}"
        )
    if not (hasattr(source, "seekable") and source.seekable()):
        return Bytes(source.read())
    return File(source)


def open_file(path: str | os.PathLike[str]) -> BinaryIO:
    """A file opened for reading, that can seek: a pipe is read whole. Raises as `ranges_of`."""
    try:
        with contextlib.ExitStack() as stack:
            file = stack.enter_context(Path(path).open("rb"))
            if not file.seekable():
                return io.BytesIO(file.read())
            stack.pop_all()
            return file
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
