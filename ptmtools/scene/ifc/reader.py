"""Checks and unpacks IFC files (ISO 16739, as STEP), and reads them through `products`.

IfcOpenShell (LGPL-3, extra `ifc`) reads the content in a child process. This module needs no
library: it tests whether the file is a complete STEP file, and unpacks archives.
"""

from __future__ import annotations

import lzma
import re
import tempfile
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import IO

from ptmtools.errors import InputError, LimitError, naming
from ptmtools.files import open_regular
from ptmtools.progress import Progress, silent
from ptmtools.scene.messages import read_in_sandbox
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.source import ModelSource

#: The start and the end of a file of ISO 10303-21.
_START = re.compile(rb"(\xef\xbb\xbf)?\s*ISO-10303-21\s*;")
_END = re.compile(rb"END-ISO-10303-21\s*;")
#: Number of bytes that contain the start or the end.
_MARGIN = 1 << 12
#: Size limit of an unpacked file, GiB.
_LARGEST = 1
_CHUNK = 1 << 20
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    EOFError,
    NotImplementedError,  # unsupported compression
    RuntimeError,  # with a password
)


def read_ifc(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads an IFC file.

    Points are in metres, Z up, in the coordinate system of the file; openings are cut out.

    Raises
    ------
    InputError: PTM-I266 not a STEP file, or a truncated one, PTM-I243 an unknown schema, PTM-I247
        nothing to draw, and PTM-I254 if IfcOpenShell cannot read the file.
    LimitError: PTM-L203 more triangles than ``options`` allow.
    """
    with naming(path), tempfile.TemporaryDirectory() as scratch:
        return _read(path, path.absolute(), notes, options, scratch)


def read_ifczip(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads the IFC file in an archive. Raises as `read_ifc`, InputError PTM-I266 for an archive
    without exactly one, and LimitError PTM-L204 for one that unpacks to more than 1 GiB."""
    with naming(path), tempfile.TemporaryDirectory() as scratch:
        file = _unpack(path, Path(scratch))
        other_bytes = file.stat().st_size
        return _read(path, file, notes, options, scratch, other_bytes=other_bytes)


def _read(
    path: Path,
    file: Path,
    notes: IngestNotes,
    options: IngestOptions,
    scratch: str,
    *,
    other_bytes: int = 0,
) -> ModelSource:
    """The products of ``file``, which is the model or its unpacked content."""
    _check(file)
    return read_in_sandbox(
        "ptmtools.scene.ifc.products",
        "ifcopenshell",
        path,
        notes,
        scratch,
        str(file),
        str(options.max_triangles),
        other_bytes=other_bytes,
    )


def _check(file: Path) -> None:
    """Raises InputError unless a file begins and ends as STEP files do."""
    with open_regular(file) as stream:
        if not _START.match(stream.read(_MARGIN)):
            raise InputError(
                "PTM-I266",
                "not an IFC file (a STEP file starts with ISO-10303-21)",
                remedy="export it again, as IFC-SPF",
            )
        end = stream.seek(0, 2)
        stream.seek(max(0, end - _MARGIN))
        if not _END.search(stream.read()):
            raise InputError(
                "PTM-I266",
                "truncated (a STEP file ends with END-ISO-10303-21)",
                remedy="copy or export it again",
            )


def _unpack(path: Path, folder: Path) -> Path:
    """Unpacks the file of an archive into a folder."""
    try:
        with open_regular(path) as stream, zipfile.ZipFile(stream) as archive:
            names = [n for n in archive.namelist() if PurePosixPath(n).suffix.lower() == ".ifc"]
            if len(names) != 1:
                raise InputError(
                    "PTM-I266",
                    f"contains {len(names) or 'no'} IFC files instead of one",
                    remedy="unpack it, and use the .ifc file",
                )
            file = folder / "model.ifc"
            with archive.open(names[0]) as packed, open(file, "wb") as unpacked:
                _copy(packed, unpacked)
            return file
    except _DAMAGED as error:
        raise InputError(
            "PTM-I266", f"the archive cannot be unpacked ({error})", remedy="pack it again"
        ) from None


def _copy(packed: IO[bytes], unpacked: IO[bytes]) -> None:
    size = 0
    while chunk := packed.read(_CHUNK):
        size += len(chunk)
        if size > _LARGEST << 30:
            raise LimitError(
                "PTM-L204",
                f"unpacks to more than {_LARGEST} GiB",
                remedy="unpack it, and use the .ifc file",
            )
        unpacked.write(chunk)
