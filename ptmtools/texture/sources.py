"""Sources of bytes and of texels: a path, bytes, an open file or a range reader for a `.ptm`; an
array or a row reader for an image to encode.
"""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.texture.model import MAX_COMPONENTS, MAX_SIDE
from ptmtools.texture.samples import KINDS

#: ``read(offset, length)``: that range of the file, shorter only where the file ends.
RangeReader = Callable[[int, int], bytes]
#: The sources that `ptmtools.texture.open` accepts.
PtmSource = str | os.PathLike[str] | bytes | bytearray | memoryview | BinaryIO | RangeReader


@dataclass(frozen=True)
class Ranges:
    """A file that can be read in pieces, from several threads.

    Attributes
    ----------
    read: returns a range of the file, shorter only where the file ends. Raises InputError PTM-I122.
    size: of the file, bytes, at present; None if unknown before reading it.
    close: called after the last read.
    name: of the file, for messages; None if it has none.
    """

    read: RangeReader
    size: Callable[[], int | None] = lambda: None
    close: Callable[[], object] = lambda: None
    name: str | None = None


def ranges_of(source: PtmSource) -> Ranges:
    """``source`` as something to read ranges from; `Ranges.close` closes what this has opened.

    Raises
    ------
    InputError: PTM-I120 no such file; PTM-I122 a folder, or not readable.
    TypeError: not a `PtmSource`; a text file, for example.
    """
    if isinstance(source, bytes | bytearray | memoryview):
        view = memoryview(source)
        flat = (view if view.c_contiguous else memoryview(bytes(view))).cast("B")
        return Ranges(lambda offset, length: bytes(flat[offset : offset + length]), flat.__len__)
    if isinstance(source, str | os.PathLike):
        file = open_file(source)
        return _ranges_of_file(file, file.close, os.fspath(source))
    if callable(source):
        return Ranges(partial(_call, source))
    unknown: object = source
    if isinstance(unknown, io.TextIOBase) or not hasattr(source, "read"):
        raise TypeError(
            "a .ptm is read from a path, bytes, a file opened in binary mode or a function that "
            f"reads ranges, not from {type(source).__name__}"
        )
    if not (hasattr(source, "seekable") and source.seekable()):
        return ranges_of(source.read())
    return _ranges_of_file(source)


def first_bytes(source: PtmSource, length: int) -> bytes:
    """The first bytes of a file, ``length`` or all; raises as `ranges_of`."""
    ranges = ranges_of(source)
    try:
        return ranges.read(0, length)
    finally:
        ranges.close()


def _call(read: RangeReader, offset: int, length: int) -> bytes:
    """Calls the caller's function, which may read over a network."""
    data: object = read(offset, length)
    if not isinstance(data, bytes | bytearray | memoryview):
        raise InputError(
            "PTM-I122",
            f"the function that reads ranges returned {type(data).__name__} instead of bytes",
        )
    # A longer answer does no harm: some servers send the whole file.
    return bytes(data)[:length]


def _ranges_of_file(
    file: BinaryIO, close: Callable[[], object] = lambda: None, name: str | None = None
) -> Ranges:
    """An open file that can seek."""
    lock = Lock()

    def run_locked(action: Callable[..., Any], *where: int) -> Any:
        try:
            with lock:
                return action(*where)
        except (OSError, ValueError) as error:  # ValueError: it is closed
            reason = getattr(error, "strerror", None) or error
            raise InputError("PTM-I122", f"cannot be read ({reason})", file=name) from None

    def read(offset: int, length: int) -> bytes:
        file.seek(offset)
        return file.read(length)

    return Ranges(
        partial(run_locked, read), partial(run_locked, file.seek, 0, os.SEEK_END), close, name
    )


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
        raise InputError("PTM-I120", "no such file", file=path, remedy="check the path") from None
    except IsADirectoryError:
        raise InputError(
            "PTM-I122", "is a folder, not a file", file=path, remedy="specify a file in it"
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            "PTM-I122", f"cannot be read ({reason})", file=path, remedy="check its permissions"
        ) from None


Samples = NDArray[Any]


class RowSource(Protocol):
    """An image whose rows can be sliced: an array, a memory map, or a reader of rows from a
    file."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(h, w) or (h, w, c)."""

    @property
    def dtype(self) -> np.dtype[Any]:
        """The numpy type of the samples."""

    def __getitem__(self, rows: slice, /) -> Samples:
        """The rows, (n, w) or (n, w, c)."""


class ImageRows:
    """The image as (h, w, c) rows of a native dtype. Raises InputError PTM-I126."""

    def __init__(self, image: RowSource) -> None:
        if not (hasattr(image, "shape") and hasattr(image, "dtype")):
            raise InputError(
                "PTM-I126",
                f"{type(image).__name__} is not an array",
                remedy="use numpy.asarray(image)",
            )
        self._rows = image
        shape, dtype = tuple(image.shape), np.dtype(image.dtype)
        fits = len(shape) in (2, 3) and 0 not in shape and dtype.name in KINDS
        self.height, self.width, self.components = (*shape, 1)[:3] if fits else (0, 0, 0)
        if not fits or self.components > MAX_COMPONENTS:
            raise InputError(
                "PTM-I126",
                f"an array of shape {shape} and type {dtype} is not an image",
                remedy="it must be (height, width) or (height, width, 1 to 4) of "
                f"{', '.join(KINDS)}, and not empty",
            )
        if max(self.width, self.height) > MAX_SIDE:
            raise LimitError(
                "PTM-L104",
                f"the image is {self.width} x {self.height} texels; the format allows {MAX_SIDE} "
                "a side",
                remedy="scale it down",
            )
        self.dtype = dtype.newbyteorder("=")
        self.shape = (self.height, self.width, self.components)

    def __getitem__(self, rows: slice) -> Samples:
        part = np.asarray(self._rows[rows])
        # The kernels are compiled for writable, contiguous arrays only.
        return np.require(
            part.reshape(-1, self.width, self.components), self.dtype, requirements=["C", "W"]
        )
