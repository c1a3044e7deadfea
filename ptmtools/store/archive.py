"""Arrays in one file: an uncompressed `.npz` whose bytes depend on the arrays alone.

`numpy.savez` writes the time of day into each member, and a deflated member depends on the
installed zlib. Here members are stored, in the order of their names, dated 1980-01-01, little
endian, C order. numpy itself reads the result (``numpy.load(path, allow_pickle=False)``).

`unpack_arrays` trusts nothing. It reads what `pack_arrays` writes and no other archive: plain
members of plain names that together are no larger than the file (entries of one directory may
otherwise share, and multiply, the same bytes), numbers only, and heads that are matched, not
evaluated. Each CRC is checked, and a declared shape is held against the bytes that are there
before memory is taken for it.
"""

from __future__ import annotations

import io
import math
import re
import struct
import zipfile
from collections.abc import Mapping
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError

#: The earliest date that a zip archive can carry.
ZIP_DATE = (1980, 1, 1, 0, 0, 0)

#: Names that are stored under: those of fields.
_MEMBER = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)\.npy")
#: The flag that says that a name is UTF-8; all others (encrypted, sizes further on) are refused.
_UTF8 = 1 << 11
#: What numpy's `write_array` puts before an array of truths or numbers, and where it begins.
_HEAD = re.compile(
    rb"\x93NUMPY\x01\x00..\{'descr': '([<|][biuf][1248])', 'fortran_order': False, "
    rb"'shape': \(((?:\d{1,19}, ?){0,31}(?:\d{1,19})?)\), \} *\n",
    re.DOTALL,
)
_HEAD_START = 10
#: The largest side, of an array that has no elements.
_MOST = (1 << 63) - 1
#: What `zipfile` raises for a damaged archive.
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


def unpack_arrays(data: bytes, *, file: str | PathLike[str]) -> dict[str, NDArray[np.generic]]:
    """Inverse of `pack_arrays`; ``file`` is named in the errors.

    Raises
    ------
    DatabaseError: PTM-D006 if the bytes are no such archive, or damaged.
    """
    arrays: dict[str, NDArray[np.generic]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > len(data):
                raise ValueError("its members claim more bytes than the file has")
            for member in members:
                name = _checked_name(member)
                if name in arrays:
                    raise ValueError(f"array {name} is there twice")
                arrays[name] = _array(archive.read(member))
    except _FAULTS as fault:
        raise DatabaseError(
            "PTM-D006",
            f"damaged: {fault}",
            file=file,
            remedy="run `ptm build-scene` again to rebuild it",
        ) from fault
    return arrays


def _checked_name(member: zipfile.ZipInfo) -> str:
    """The name of the array that a member holds, if `pack_arrays` can have written it."""
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
    if count * dtype.itemsize != len(body) - head.end() or max(shape, default=0) > _MOST:
        raise ValueError("array whose shape does not match its bytes")
    return np.frombuffer(body, dtype, count, offset=head.end()).reshape(shape).copy()
