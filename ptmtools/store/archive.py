"""Arrays in one file: an uncompressed `.npz` whose bytes depend on the arrays alone.

`numpy.savez` writes the time of day into each member, and a deflated member depends on the
installed zlib. Here members are stored, in the order of their names, dated 1980-01-01, little
endian, C order. numpy itself reads the result (``numpy.load(path, allow_pickle=False)``).

A database may come from elsewhere, with matching checksums. `unpack_arrays` reads only what
`pack_arrays` writes: plain members of plain names that together are no larger than the file
(entries of one directory may otherwise share, and multiply, the same bytes), numbers only, and
headers that are matched, not evaluated. Each CRC is checked, and a declared shape is compared with
the number of bytes before memory is allocated. Compiled loops do not check indices: `Stored` checks
types, shapes and indices once, as an artifact is read.
"""

from __future__ import annotations

import io
import math
import re
import struct
import zipfile
from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError, Rebuild

Arrays = Mapping[str, NDArray[np.generic]]

#: The earliest date that a zip archive can carry.
ZIP_DATE = (1980, 1, 1, 0, 0, 0)

#: Names of members: those of fields.
_MEMBER = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)\.npy")
#: The flag of UTF-8 names; all others (encrypted, sizes after the data) are refused.
_UTF8 = 1 << 11
#: The header that numpy's `write_array` gives an array of booleans or numbers, and its start.
_HEAD = re.compile(
    rb"\x93NUMPY\x01\x00..\{'descr': '([<|][biuf][1248])', 'fortran_order': False, "
    rb"'shape': \(((?:\d{1,19}, ?){0,31}(?:\d{1,19})?)\), \} *\n",
    re.DOTALL,
)
_HEAD_START = 10
#: The largest side, for arrays without elements.
_LARGEST_SIDE = (1 << 63) - 1
#: The exceptions of `zipfile` for a damaged archive.
_FAULTS = (ArithmeticError, EOFError, LookupError, RuntimeError, TypeError, ValueError,
           struct.error, zipfile.BadZipFile)  # fmt: skip


def pack_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> bytes:
    """The arrays as the bytes of an `.npz`; the same arrays always give the same bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(arrays):
            array = np.asarray(arrays[name])
            array = np.asarray(array, dtype=array.dtype.newbyteorder("<"), order="C")
            member = zipfile.ZipInfo(f"{name}.npy", ZIP_DATE)
            member.create_system = 3
            member.external_attr = 0o644 << 16
            body = io.BytesIO()
            np.lib.format.write_array(body, array, version=(1, 0), allow_pickle=False)
            archive.writestr(member, body.getvalue())
    return out.getvalue()


def without_repeats(arrays: Arrays, *names: str) -> dict[str, NDArray[np.generic]]:
    """The arrays, and of those of these names only the first row where all rows are equal: readers
    know their number (`Stored.repeat_rows`)."""
    kept = dict(arrays)
    for name in names:
        array = np.asarray(arrays[name])
        if len(array) > 1 and (array == array[:1]).all():
            kept[name] = array[:1]
    return kept


def unpack_arrays(data: bytes, *, file: str | PathLike[str]) -> dict[str, NDArray[np.generic]]:
    """Inverse of `pack_arrays`; ``file`` is named in the errors.

    Raises
    ------
    DatabaseError: PTM-D006 if `pack_arrays` has not written the bytes.
    """
    arrays: dict[str, NDArray[np.generic]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > len(data):
                raise ValueError("its members declare more bytes than the file has")
            for member in members:
                name = _checked_name(member)
                if name in arrays:
                    raise ValueError(f"array {name} occurs twice")
                arrays[name] = _array(archive.read(member))
    except _FAULTS as fault:
        raise DatabaseError(
            "PTM-D006",
            f"damaged: {fault}",
            file=file,
            remedy=Rebuild("run {} again to rebuild it"),
        ) from fault
    return arrays


def _checked_name(member: zipfile.ZipInfo) -> str:
    """The array's name; raises ValueError for a member that `pack_arrays` does not write."""
    name = _MEMBER.fullmatch(member.filename)
    if name is None:
        raise ValueError(f"member {member.filename[:80]!r} has an impossible name")
    plain = member.compress_type == zipfile.ZIP_STORED and not member.flag_bits & ~_UTF8
    if not plain or member.compress_size != member.file_size:
        raise ValueError(f"member {member.filename} is not stored as it should be")
    return name[1]


def _array(body: bytes) -> NDArray[np.generic]:
    head = _HEAD.match(body)
    if head is None or head.end() != _HEAD_START + int.from_bytes(body[8:10], "little"):
        raise ValueError("array of a kind that ptmtools never writes")
    dtype = np.dtype(head[1].decode())
    shape = tuple(int(side) for side in head[2].decode().split(",") if side.strip())
    count = math.prod(shape)  # of Python's integers, which do not overflow
    if count * dtype.itemsize != len(body) - head.end() or max(shape, default=0) > _LARGEST_SIDE:
        raise ValueError("array whose shape does not match its bytes")
    return np.frombuffer(body, dtype, count, offset=head.end()).reshape(shape).copy()


class Stored:
    """The arrays of an artifact, checked as they are read by name.

    Raises KeyError for an array that is missing, ValueError for one that fails a check.
    """

    def __init__(self, arrays: Arrays) -> None:
        self._arrays = arrays

    def array(
        self, name: str, dtype: type[np.generic], *shape: int | None, finite: bool = False
    ) -> NDArray[Any]:
        """An array of this type and shape; None is a side of any length. Numbers of another type of
        the same kind are converted. With ``finite``, NaN and infinities are errors."""
        array = np.asarray(self._arrays[name])
        if array.dtype.kind != np.dtype(dtype).kind:
            raise ValueError(f"{name} has elements of type {array.dtype}")
        sides = zip(shape, array.shape, strict=False)
        if len(array.shape) != len(shape) or any(side not in (None, n) for side, n in sides):
            raise ValueError(f"{name} has the shape {array.shape}")
        if finite and not np.isfinite(array).all():
            raise ValueError(f"{name} has numbers that are not finite")
        return array.astype(dtype, copy=False)

    def repeat_rows(self, rows: int, *names: str) -> Stored:
        """The same arrays, of those of these names with a single row as many: the inverse of
        `without_repeats`."""
        arrays = dict(self._arrays)
        for name in names:
            array = np.asarray(arrays[name])
            if array.shape[:1] == (1,):
                arrays[name] = np.repeat(array, rows, axis=0)
        return Stored(arrays)

    def indices(
        self, name: str, dtype: type[np.integer[Any]], *shape: int | None, low: int = 0, high: int
    ) -> NDArray[Any]:
        """An array of integers from ``low`` to below ``high``."""
        array = self.array(name, dtype, *shape)
        if array.size and not low <= int(array.min()) <= int(array.max()) < high:
            raise ValueError(f"{name} has an index out of range")
        return array

    def starts(self, name: str, rows: int | None, total: int) -> NDArray[np.int64]:
        """The row starts of a CSR, (rows + 1,): ascending from 0 to ``total``."""
        array = self.array(name, np.int64, None if rows is None else rows + 1)
        if not len(array) or array[0] != 0 or array[-1] != total or (np.diff(array) < 0).any():
            raise ValueError(f"{name} does not divide {total} entries")
        return array


def texts(values: Any, name: str) -> tuple[str, ...]:
    """A list of texts."""
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise ValueError(f"{name} are not texts")
    return tuple(values)
