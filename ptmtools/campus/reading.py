"""The index of a campus, read back."""

from __future__ import annotations

import os
from pathlib import Path

from ptmtools import schemas
from ptmtools.campus.model import INDEX, Campus
from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_below

#: An index longer than this is none, bytes.
LONGEST = 1 << 28


def read_campus(folder: str | os.PathLike[str]) -> Campus:
    """The index of a campus folder. What else a campus must be is for `check_campus`.

    Raises
    ------
    InputError: PTM-I832 it cannot be read, PTM-I833 it is not as its schema says, or an object has
        fewer or more meshes than the campus has levels.
    LimitError: PTM-L831 it is too long.
    """
    file = Path(folder) / INDEX
    try:
        with open_below(folder, INDEX) as stream:
            data = stream.read(LONGEST + 1)
    except (OSError, ValueError) as fault:
        why = getattr(fault, "strerror", None) or str(fault)
        raise InputError(
            "PTM-I832",
            f"cannot be read ({why})",
            file=file,
            remedy="name a folder that `ptm campus` wrote",
        ) from None
    return parse_campus(data, file)


def parse_campus(data: bytes, file: Path) -> Campus:
    """The campus that the bytes of an index describe; raises as `read_campus`."""
    if len(data) > LONGEST:
        raise LimitError("PTM-L831", "is too long for the index of a campus", file=file)
    try:
        campus = Campus.from_document(schemas.read(data, schemas.CAMPUS))
    except schemas.ShapeError as fault:
        raise _wrong(file, fault.place or None, fault.message) from None
    for place, each in enumerate(campus.objects):
        if len(each.meshes) != campus.lods:
            what = f"has {len(each.meshes)} items, not {campus.lods}"
            raise _wrong(file, f"objects[{place}].meshes", what)
    return campus


def _wrong(file: Path, place: str | None, what: str) -> InputError:
    remedy = "write it again with `ptm campus`"
    return InputError("PTM-I833", what, file=file, place=place, remedy=remedy)
