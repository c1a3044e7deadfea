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
    InputError: PTM-I832 it cannot be read, PTM-I833 it is not as its schema says.
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
        return Campus.from_document(schemas.read(data, schemas.CAMPUS))
    except schemas.ShapeError as fault:
        raise InputError(
            "PTM-I833",
            fault.message,
            file=file,
            place=fault.place or None,
            remedy="write it again with `ptm campus`",
        ) from None
