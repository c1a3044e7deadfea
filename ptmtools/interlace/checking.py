"""The check of an interlaced image: every byte is read, and every file decoded."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ptmtools.errors import InputError, LimitError
from ptmtools.findings import Findings, Place, Severity, ValidationReport
from ptmtools.interlace.model import INDEX, Interlaced, Part, axes_of
from ptmtools.interlace.reading import check_joined, part_bytes, part_texels, read_manifest
from ptmtools.quantities import count
from ptmtools.texture.model import Limits

_LIMITS = Limits()

CODES: Mapping[str, tuple[Severity, str]] = {
    "PTM-D800": ("error", "interlace.json cannot be read, or is not as its schema says"),
    "PTM-D801": ("error", "interlace.json has another schema number"),
    "PTM-D802": ("error", "interlace.json contradicts itself: names, axes or sizes of the files"),
    "PTM-D803": ("error", "a file of an interlaced image is missing or cannot be read"),
    "PTM-D804": ("error", "a file of an interlaced image has another size or checksum"),
    "PTM-D805": ("error", "a file of an interlaced image is not the image that is described"),
    "PTM-D806": ("warning", "a file in the folder of an interlaced image that it does not name"),
    "PTM-D807": ("warning", "files too large for --limit: only their checksums were compared"),
    "PTM-D808": ("warning", "an image is split otherwise than its minimum asks for"),
}
#: What reading raises → what the check finds.
_FOUND = {
    "PTM-I821": "PTM-D800",
    "PTM-I822": "PTM-D801",
    "PTM-I823": "PTM-D802",
    "PTM-I824": "PTM-D803",
    "PTM-I825": "PTM-D804",
    "PTM-I826": "PTM-D805",
    "PTM-L822": "PTM-D800",
    "PTM-L823": "PTM-D804",
}


def validate_interlaced(folder: Path, limits: Limits = _LIMITS) -> ValidationReport:
    """Checks a folder of `ptm interlace`; what is wrong stands in the report.

    ``limits``: for the whole image; beyond them checksums are compared, and nothing is decoded.
    Raises InputError PTM-I820 if there is no interlaced image.
    """
    found = Findings(CODES)
    files = 1
    try:
        size = os.lstat(folder / INDEX).st_size
        interlaced = read_manifest(folder)
    except InputError as fault:
        if fault.code == "PTM-I820":
            raise
        code = "PTM-D800" if fault.code == "PTM-I824" else _FOUND[fault.code]
        found.add(code, INDEX, fault.place or "", fault.message)
        return ValidationReport(found.issues(), files, 0)
    _check_split(interlaced, found.at(INDEX))
    decoded = True
    try:
        check_joined(interlaced, len(interlaced.parts), limits, folder)
    except LimitError as fault:
        found.add("PTM-D807", INDEX, "", fault.message)
        decoded = False
    for part in interlaced.parts:
        length = _check_part(folder, interlaced, part, decoded, found.at(part.name))
        size += length
        files += length > 0
    named = {INDEX, *(part.name for part in interlaced.parts)}
    for name in sorted(set(os.listdir(folder)) - named):
        found.add("PTM-D806", name, "", "is not named in interlace.json")
    return ValidationReport(found.issues(), files, size)


def _check_split(interlaced: Interlaced, at: Place) -> None:
    wanted = axes_of(interlaced.width, interlaced.height, interlaced.min)
    if tuple(part.axis for part in interlaced.parts[1:]) != wanted:
        at.add(
            "PTM-D808",
            f"a minimum of {interlaced.min} asks for {count(len(wanted) + 1, 'file')}, columns and "
            "rows in turn",
            "files",
        )


def _check_part(folder: Path, interlaced: Interlaced, part: Part, decoded: bool, at: Place) -> int:
    """Checks one file; how many bytes were read."""
    data = b""
    try:
        data = part_bytes(folder, interlaced, part)
        if decoded:
            part_texels(folder / part.name, data, interlaced, part)
    except InputError as fault:
        at.add(_FOUND[fault.code], fault.message)
    return len(data)
