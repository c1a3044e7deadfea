"""Arrays in one file: an uncompressed `.npz` whose bytes depend on the arrays alone.

`numpy.savez` writes the time of day into each member, and a deflated member depends on the
installed zlib. Here members are stored, in the order of their names, dated 1980-01-01, little
endian, C order. numpy itself reads the result (``numpy.load(path, allow_pickle=False)``).

`read_arrays` trusts nothing: each member's CRC is checked, pickles are refused, and an array's
declared shape is held against the bytes that are there before memory is taken for it.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError

#: The earliest date that a zip archive can carry.
ZIP_DATE = (1980, 1, 1, 0, 0, 0)


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
            for member in archive.infolist():
                if member.compress_type != zipfile.ZIP_STORED or member.file_size > len(data):
                    raise ValueError(f"member {member.filename} is not stored as it should be")
                arrays[member.filename.removesuffix(".npy")] = _array(archive.read(member))
    except (ValueError, zipfile.BadZipFile, EOFError, KeyError, NotImplementedError) as fault:
        raise DatabaseError(
            "PTM-D006",
            f"damaged: {fault}",
            file=file,
            remedy="run `ptm build-scene` again to rebuild it",
        ) from fault
    return arrays


def _array(body: bytes) -> NDArray[np.generic]:
    stream = io.BytesIO(body)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("array of an unknown format version")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    if dtype.hasobject or fortran:
        raise ValueError("array of a kind that ptmtools never writes")
    count = 1
    for side in shape:
        count *= int(side)  # Python integers: the product cannot overflow
    if count * dtype.itemsize != len(body) - stream.tell():
        raise ValueError("array whose shape does not match its bytes")
    return np.frombuffer(body, dtype, count, offset=stream.tell()).reshape(shape).copy()
