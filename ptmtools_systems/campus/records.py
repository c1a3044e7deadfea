"""HTML records of objects: what a browser shows about a building, beside the campus (the paper's
II.B), and the icons and ranks of points of interest, which an administrator writes by hand.

A record may come from anywhere, so nothing here parses it, and no page runs its scripts. Its file
has the suffix ``.txt``: a server would send ``.html`` as a page of the site's own origin.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_below
from ptmtools.quantities import count
from ptmtools_systems.campus.model import HIGHEST_RANK, ICONS, RecordFile, record_file

#: Largest record, bytes.
LARGEST = 1 << 20
SUFFIX = ".html"
#: Icons and ranks of objects, in the folder of the records.
PLACES = "places.json"
#: An example of it.
_EXAMPLE = '{"Library": {"icon": "books", "rank": 1}}'
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
    unused, records = dict.fromkeys(files), {}
    for name, label in objects:
        for file in (f"{label}{SUFFIX}", f"{name}{SUFFIX}"):
            if file in unused:
                records[name] = _read(root, file)
                del unused[file]
                break
    if not unused:
        return records, ()
    listed = ", ".join([*unused][:_LISTED]) + (", …" if len(unused) > _LISTED else "")
    return records, (f"{count(len(unused), 'record')} of no object: {listed}",)


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


def read_places(
    folder: str | os.PathLike[str], objects: Iterable[tuple[str, str]]
) -> tuple[dict[str, dict[str, Any]], tuple[str, ...]]:
    """The fields ``icon`` and ``rank`` of objects by their names in files, and notes on places of
    no object; none if the folder has no `PLACES`.

    Parameters
    ----------
    folder: that of the records.
    objects: name in files and label of each.

    Raises
    ------
    InputError: PTM-I122 the file cannot be read, is too long, or is not a table of places.
    """
    root = Path(folder)
    file = root / PLACES
    if not file.exists():
        return {}, ()
    try:
        with open_below(root, PLACES) as stream:
            data = stream.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise _wrong_place(file, f"has more than {LARGEST:,} bytes")
        table = json.loads(data)
    except OSError as fault:
        raise _wrong_place(file, f"cannot be read ({fault.strerror or fault})") from None
    except (ValueError, RecursionError):
        raise _wrong_place(file, "is not JSON") from None
    if not isinstance(table, dict):
        raise _wrong_place(file, "is not a JSON object")
    for key, fields in table.items():
        _check_place(file, key, fields)
    unused, places = dict.fromkeys(table), {}
    for name, label in objects:
        key = next((key for key in (label, name) if key in unused), None)
        if key is not None:
            places[name] = table[key]
            del unused[key]
    return places, tuple(f"{PLACES}: no object is called {key!r}" for key in unused)


def _check_place(file: Path, key: str, fields: Any) -> None:
    """Raises InputError PTM-I122."""
    if not isinstance(fields, Mapping) or not fields or not fields.keys() <= {"icon", "rank"}:
        raise _wrong_place(file, "has other fields than icon and rank", key)
    if "icon" in fields and fields["icon"] not in ICONS:
        raise _wrong_place(file, f"icon is not one of {', '.join(ICONS)}", key)
    rank = fields.get("rank", 0)
    if type(rank) is not int or not 0 <= rank <= HIGHEST_RANK:
        raise _wrong_place(file, f"rank is not a whole number from 0 to {HIGHEST_RANK}", key)


def _wrong_place(file: Path, message: str, place: str | None = None) -> InputError:
    return InputError("PTM-I122", message, file=file, place=place, remedy=f"write {_EXAMPLE}")
