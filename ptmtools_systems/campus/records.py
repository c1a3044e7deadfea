"""HTML records of objects: what a browser shows about a building, beside the campus (the paper's
II.B).

A record may come from anywhere, so nothing here parses it, and no page runs its scripts. Its file
has the suffix ``.txt``: a server would send ``.html`` as a page of the site's own origin.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path

from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_below
from ptmtools.quantities import count
from ptmtools_systems.campus.model import RecordFile, record_file

#: Largest record, bytes.
LARGEST = 1 << 20
SUFFIX = ".html"
#: Names that a note lists.
_LISTED = 5


def read_records(
    folder: str | os.PathLike[str], objects: Iterable[tuple[str, str]]
) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """The records of objects, and notes on files of no object.

    Parameters
    ----------
    folder: with ``LABEL.html`` or ``NAME.html`` for an object.
    objects: name in files and label of each.

    Returns the UTF-8 of each record by the name of its object.

    Raises
    ------
    InputError: PTM-I122 the folder or a file cannot be read, or is not UTF-8.
    LimitError: PTM-L204 a file has more than `LARGEST` bytes.
    """
    root = Path(folder)
    try:
        files = sorted(file.name for file in root.iterdir() if file.suffix == SUFFIX)
    except OSError as fault:
        raise _unreadable(root, fault) from None
    left, records = dict.fromkeys(files), {}
    for name, label in objects:
        for file in (f"{label}{SUFFIX}", f"{name}{SUFFIX}"):
            if file in left:
                records[name] = _read(root, file)
                del left[file]
                break
    if not left:
        return records, ()
    listed = ", ".join([*left][:_LISTED]) + (", …" if len(left) > _LISTED else "")
    return records, (f"{count(len(left), 'record')} of no object: {listed}",)


def files_of(records: Mapping[str, bytes]) -> dict[str, tuple[RecordFile, bytes]]:
    """The row and the bytes of each record, by the name of its object."""
    return {
        name: (RecordFile(record_file(name), len(data), zlib.crc32(data)), data)
        for name, data in records.items()
    }


def fault_of(data: bytes) -> str | None:
    """Why a browser could not show a record, or None."""
    if len(data) > LARGEST:
        return f"has more than {LARGEST:,} bytes"
    try:
        data.decode()
    except UnicodeDecodeError as fault:
        return f"byte {fault.start} is not UTF-8"
    return None


def _read(root: Path, name: str) -> bytes:
    try:
        with open_below(root, name) as stream:
            data = stream.read(LARGEST + 1)
    except OSError as fault:
        raise _unreadable(root / name, fault) from None
    if len(data) > LARGEST:
        raise LimitError("PTM-L204", f"{fault_of(data)}", file=root / name)
    if (wrong := fault_of(data)) is not None:
        raise InputError("PTM-I122", wrong, file=root / name, remedy="save it as UTF-8")
    return data


def _unreadable(file: Path, fault: OSError) -> InputError:
    return InputError(
        "PTM-I122",
        f"cannot be read ({fault.strerror or fault})",
        file=file,
        remedy="specify a folder with HTML files, named after objects",
    )
