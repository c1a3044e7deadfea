"""The files of an interlaced image: read and joined, described, and checked.

A folder may come from an untrusted source. The manifest must match its schema and be consistent; a
file is opened only under the name that follows from its number, if it is a regular file of the
recorded size; sizes are compared with the limit before memory is allocated. The check reads every
byte and decodes every file.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from ptmtools import schemas
from ptmtools.diagnostics import FOLDER_CODES, Findings, Place, ValidationReport
from ptmtools.errors import InputError, LimitError, PtmError, naming
from ptmtools.files import open_below
from ptmtools.quantities import count, size
from ptmtools.texture.model import Limits
from ptmtools_systems.interlace.containers import CONTAINERS, Texels
from ptmtools_systems.interlace.model import INDEX, Interlaced, InterlacedFile, axes_of, sizes_of
from ptmtools_systems.interlace.steps import join
from ptmtools_systems.schemas import INTERLACE

_LIMITS = Limits()
#: A manifest of 33 files has 7 kB; more fields may be added.
_MANIFEST_MOST = 1 << 20
#: Most bytes of a file: for each byte of its texels, and in addition.
_BYTES, _BYTES_MORE = 8, 1 << 20
_AGAIN = "write it again with `ptm interlace`"


def read_manifest(folder: str | os.PathLike[str]) -> Interlaced:
    """The manifest of an interlaced image.

    Raises
    ------
    InputError: PTM-I120 no interlaced image; PTM-I821 not valid against the schema, of another
        schema number, or inconsistent; PTM-I122 it cannot be read.
    LimitError: PTM-L204 too large for a manifest.
    """
    file = Path(folder) / INDEX
    if not os.path.lexists(file):
        exists = Path(folder).is_dir()
        raise InputError(
            "PTM-I120",
            f"is not an interlaced image: it has no {INDEX}" if exists else "is not a folder",
            file=folder,
            remedy="specify a folder that `ptm interlace` wrote",
        )
    data = _bytes_of(Path(folder), INDEX, _MANIFEST_MOST, "a manifest")
    with naming(file):
        interlaced = Interlaced.from_document(_document(data))
        _check_chain(interlaced)
    return interlaced


def _document(data: bytes) -> dict[str, Any]:
    try:
        document = schemas.parse(data)
        number = document.get("schema") if isinstance(document, dict) else None
        if type(number) is int and number != 1:
            raise InputError(
                "PTM-I821",
                f"has the schema number {str(number)[:20]}; this program knows 1",
                remedy="update ptmtools, or write the folder again",
            )
        schemas.check(document, INTERLACE)
    except schemas.ShapeError as fault:
        raise InputError(
            "PTM-I821",
            f"is not the manifest of an interlaced image: {fault.message}",
            place=fault.place or None,
            remedy=_AGAIN,
        ) from None
    return cast("dict[str, Any]", document)


def _check_chain(interlaced: Interlaced) -> None:
    """Raises InputError PTM-I821 unless names, axes and sizes of the files belong to one image."""

    def require(holds: bool, message: str, place: str = "") -> None:
        if not holds:
            raise InputError("PTM-I821", message, place=place or None, remedy=_AGAIN)

    for side in (interlaced.width, interlaced.height):
        require(side & (side - 1) == 0, f"a side of {side} is not a power of two")
    container = CONTAINERS[interlaced.container]
    require(interlaced.lossless == container.lossless, "lossless does not match the container")
    supported = interlaced.components in container.components
    supported &= interlaced.kind in container.kinds
    require(supported, f"{interlaced.container} does not support such samples")
    parts = interlaced.parts
    axes = [part.axis for part in parts[1:] if part.axis]
    require(parts[0].axis is None, "the first file has an axis", "files[0]")
    require(len(axes) == len(parts) - 1, "a file after the first has no axis")
    sizes = sizes_of(interlaced.width, interlaced.height, axes)
    require(min(sizes[0][0]) > 0, "there are more files than sides that can be halved")
    for number, (part, (extent, joined)) in enumerate(zip(parts, sizes, strict=True)):
        place = f"files[{number}]"
        name = f"{number + 1}.{interlaced.container}"
        require(part.name == name, f"is named {part.name}, not {name}", place)
        require(
            (part.width, part.height) == extent and part.joined == joined,
            f"must have {extent[0]} x {extent[1]} texels, joined {joined[0]} x {joined[1]}, by the "
            "axes and the size of the image",
            place,
        )


def deinterlace(
    folder: str | os.PathLike[str], step: int | None = None, limits: Limits = _LIMITS
) -> Texels:
    """The (h, w, c) image of the first ``step`` files, by default all; only those are read.

    Raises
    ------
    InputError: as `read_manifest` and `read_part`; PTM-I111 the step does not exist.
    LimitError: PTM-L104 more texels than ``limits`` allow.
    """
    interlaced = read_manifest(folder)
    file_count = len(interlaced.parts)
    step = file_count if step is None else step
    if not 1 <= step <= file_count:
        raise InputError(
            "PTM-I111",
            f"step {step} does not exist: it has {count(file_count, 'file')}",
            file=folder,
            remedy=f"--step is a number from 1 to {file_count}",
        )
    check_joined(interlaced, step, limits, folder)
    image = read_part(Path(folder), interlaced, interlaced.parts[0])
    for part in interlaced.parts[1:step]:
        assert part.axis is not None
        image = join(image, read_part(Path(folder), interlaced, part), part.axis)
    return image


def check_joined(
    interlaced: Interlaced, step: int, limits: Limits, folder: str | os.PathLike[str]
) -> None:
    """Raises LimitError PTM-L104 if the image after a step exceeds the limit."""
    width, height = interlaced.parts[step - 1].joined
    if width * height * interlaced.texel_bytes > limits.decoded_bytes:
        raise LimitError(
            "PTM-L104",
            f"is {width} x {height} texels of {count(interlaced.texel_bytes, 'byte')}, more than "
            f"the limit of {limits.decoded_bytes} bytes",
            file=folder,
            remedy="raise the limit (--limit), or join fewer files (--step)",
        )


def read_part(folder: Path, interlaced: Interlaced, part: InterlacedFile) -> Texels:
    """The (h, w, c) texels of one file.

    Raises
    ------
    InputError: PTM-I122 it is missing, not a regular file or unreadable; PTM-I821 it has another
        length or checksum, or is not the image that the manifest describes.
    LimitError: PTM-L204 it is too large for its texels.
    """
    return part_texels(folder / part.name, part_bytes(folder, interlaced, part), interlaced, part)


def part_bytes(folder: Path, interlaced: Interlaced, part: InterlacedFile) -> bytes:
    """The bytes of a file, compared with length and checksum; raises as `read_part`."""
    texels = part.width * part.height * interlaced.texel_bytes
    limit = _BYTES * texels + _BYTES_MORE
    content = f"{part.width} x {part.height} texels"
    data = _bytes_of(folder, part.name, limit, content)
    fault = ""
    if len(data) != part.bytes:
        fault = f"has {len(data)} bytes instead of {part.bytes}"
    elif zlib.crc32(data) != part.crc32:
        fault = "has another checksum than recorded"
    if fault:
        raise InputError(
            "PTM-I821", fault, file=folder / part.name, remedy=f"download it again, or {_AGAIN}"
        )
    return data


def part_texels(file: Path, data: bytes, interlaced: Interlaced, part: InterlacedFile) -> Texels:
    """The texels in the bytes of a file; raises InputError PTM-I821."""
    from ptmtools.texture.images import load_image

    container = CONTAINERS[interlaced.container]
    shape = part.height, part.width, interlaced.components
    try:
        if not data.startswith(container.magic):
            raise ValueError(f"not a {interlaced.container}")
        # Larger images are refused before decoding; WebP counts four bytes a texel.
        limit = part.width * part.height * max(4, interlaced.texel_bytes)
        picture = load_image(data, Limits(decoded_bytes=limit))
        if picture.texels.shape[:2] != shape[:2]:
            height, width = picture.texels.shape[:2]
            raise ValueError(f"{width} x {height} instead of {part.width} x {part.height} texels")
        if picture.texels.dtype.name != interlaced.kind:
            raise ValueError(f"samples of {picture.texels.dtype} instead of {interlaced.kind}")
        return np.asarray(container.read(picture.array(), interlaced.components))
    except (ValueError, PtmError) as fault:
        reason = fault.message if isinstance(fault, PtmError) else str(fault)
        raise InputError(
            "PTM-I821",
            f"is not the image that the manifest describes ({reason})",
            file=file,
            remedy=_AGAIN,
        ) from None


def _bytes_of(folder: Path, name: str, limit: int, content: str) -> bytes:
    """The bytes of a regular file; raises InputError PTM-I122, LimitError PTM-L204."""
    file = folder / name
    try:
        with open_below(folder, name) as stream:
            length = os.fstat(stream.fileno()).st_size
            if length > limit:
                raise LimitError(
                    "PTM-L204",
                    f"has {length} bytes, too many for {content}",
                    file=file,
                    remedy=_AGAIN,
                )
            return stream.read(limit)
    except FileNotFoundError:
        raise InputError(
            "PTM-I122", "is missing", file=file, remedy=f"download it again, or {_AGAIN}"
        ) from None
    except OSError as fault:
        raise InputError(
            "PTM-I122",
            f"cannot be read ({fault.strerror or fault})",
            file=file,
            remedy="check its type and permissions",
        ) from None


def describe(folder: Path) -> tuple[tuple[str, ...], Mapping[str, Any]]:
    """The lines of ``ptm info`` for a folder, and its record as JSON; raises as `read_manifest`."""
    interlaced = read_manifest(folder)
    width, height = interlaced.original
    scaled = (
        ""
        if (width, height) == (interlaced.width, interlaced.height)
        else (f", scaled from {width} x {height}")
    )
    lines = [
        f"{interlaced.width} x {interlaced.height}{scaled}, "
        f"{count(interlaced.components, 'component')} of {interlaced.kind}, "
        f"{'lossless' if interlaced.lossless else 'lossy'}, "
        f"{count(len(interlaced.parts), 'file')}, {size(interlaced.bytes)}",
        "file          image  joined by         makes         bytes   share      up to here",
    ]
    end = 0
    for part in interlaced.parts:
        end += part.bytes
        extent, joined = f"{part.width} x {part.height}", f"{part.joined[0]} x {part.joined[1]}"
        lines.append(
            f"{part.name:<7} {extent:>11}  {part.axis or '':<9} {joined:>13} {part.bytes:>13,} "
            f"{part.bytes / interlaced.bytes:>7.2%} {end:>15,}"
        )
    return tuple(lines), interlaced.document()


def validate_interlaced(folder: Path, limits: Limits = _LIMITS) -> ValidationReport:
    """Checks a folder of `ptm interlace`; all faults are in the report.

    ``limits``: for the whole image; beyond them only checksums are compared.
    Raises InputError PTM-I120 if there is no interlaced image.
    """
    findings = Findings(FOLDER_CODES)
    files = 1
    try:
        size = os.lstat(folder / INDEX).st_size
        interlaced = read_manifest(folder)
    except InputError as fault:
        if fault.code == "PTM-I120":
            raise
        findings.add("PTM-D800", INDEX, fault.place or "", fault.message)
        return ValidationReport(findings.issues(), files, 0)
    _check_split(interlaced, findings.place(INDEX))
    decoded = True
    try:
        check_joined(interlaced, len(interlaced.parts), limits, folder)
    except LimitError as fault:
        findings.add("PTM-D713", INDEX, "", fault.message)
        decoded = False
    for part in interlaced.parts:
        length = _check_part(folder, interlaced, part, decoded, findings.place(part.name))
        size += length
        files += length > 0
    listed = {INDEX, *(part.name for part in interlaced.parts)}
    for name in sorted(set(os.listdir(folder)) - listed):
        findings.add("PTM-D806", name, "", "is not named in interlace.json")
    return ValidationReport(findings.issues(), files, size)


def _check_split(interlaced: Interlaced, at: Place) -> None:
    axes = axes_of(interlaced.width, interlaced.height, interlaced.min)
    if tuple(part.axis for part in interlaced.parts[1:]) != axes:
        at.add(
            "PTM-D808",
            f"a minimum of {interlaced.min} requires {count(len(axes) + 1, 'file')}, alternating "
            "columns and rows",
            "files",
        )


def _check_part(
    folder: Path, interlaced: Interlaced, part: InterlacedFile, decoded: bool, at: Place
) -> int:
    """Checks one file; returns the number of bytes read."""
    data = b""
    try:
        data = part_bytes(folder, interlaced, part)
        if decoded:
            part_texels(folder / part.name, data, interlaced, part)
    except InputError as fault:
        at.add("PTM-D803" if fault.code == "PTM-I122" else "PTM-D804", fault.message)
    return len(data)


def page_files(index: Mapping[str, Any]) -> Iterator[str]:
    """The files of a folder with this index that its page fetches."""
    return (part["name"] for part in index["files"])
