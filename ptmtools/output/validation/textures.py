"""The check of the textures and the octree textures (docs/formats/apo.md), and of their rows in the
hints."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ptmtools.diagnostics import Place
from ptmtools.errors import InputError, LimitError, PtmError
from ptmtools.output.names import HINTS
from ptmtools.output.validation.files import ReadHints, ServedDatabase
from ptmtools.texture.model import gpu_texel_bytes

if TYPE_CHECKING:
    from ptmtools.texture import Limits, PtmHeader

_PNG = b"\x89PNG\r\n\x1a\n"
#: Of the first chunk of a PNG: its length and kind, width and height.
_IHDR = struct.Struct(">I4sII")
#: Texels of an octree take less than this many bytes, however they are deflated: the texels are
#: fewer than the addresses.
_MOST_BYTES = 1 << 27


def read_ptm(data: bytes, limits: Limits, at: Place) -> PtmHeader | None:
    """Decodes every group of a `.ptm`; its header, None with PTM-D710 if that is damaged."""
    from ptmtools.texture import read_header
    from ptmtools.texture.reader import faults_of

    try:
        faults = faults_of(data, limits)
    except LimitError as limit:
        # Exceeding the caller's limit is no damage; exceeding the format's is.
        at.add("PTM-D713" if limit.code == "PTM-L103" else "PTM-D710", limit.message)
    else:
        for fault in faults:
            at.add("PTM-D710", fault.partition(" [PTM-")[0])
    try:
        return read_header(data)
    except PtmError:
        return None


def read_png(data: bytes, limits: Limits, at: Place) -> tuple[int, int] | None:
    """Decodes a PNG; its width and height, None with PTM-D710 if it is none."""
    from ptmtools.texture import load_image

    if not data.startswith(_PNG) or len(data) < len(_PNG) + _IHDR.size:
        at.add("PTM-D710", "is not a PNG")
        return None
    length, kind, width, height = _IHDR.unpack_from(data, len(_PNG))
    if (length, kind) != (13, b"IHDR"):
        at.add("PTM-D710", "is not a PNG")
        return None
    try:
        load_image(data, limits)
    except PtmError as fault:
        code = "PTM-D713" if isinstance(fault, LimitError) else "PTM-D710"
        at.add(code, f"cannot be read ({fault.message})")
    return width, height


def check_record(
    record: Mapping[str, Any], header: PtmHeader, image: tuple[int, int] | None, at: Place
) -> None:
    """Compares a row of `textures` in `hints.json` with its `.ptm` and with the width and height of
    its fallback image."""
    finest = header.levels[-1]
    actual = {
        "components": header.components,
        "width": finest.width,
        "height": finest.height,
        "texelBytes": header.texel_bytes,
        "gpuTexelBytes": gpu_texel_bytes(header.texel_bytes, header.components),
        "ends": [level.end for level in header.levels],
    }
    for name, value in actual.items():
        if record.get(name, value) != value:
            at.add("PTM-D704", f"{name} does not match the file, which has {value}")
    if "differences" in record and len(record["differences"]) != len(header.levels):
        at.add("PTM-D704", "differences do not match the levels in the file")
    if (record["fallback"] is None) != (record["fallbackLevel"] is None):
        at.add("PTM-D704", "only one of fallback and fallbackLevel is null")
    elif image is not None:
        sizes = [(level.width, level.height) for level in header.levels]
        level = sizes.index(image) if image in sizes else None
        if level is None:
            message = f"is {image[0]} x {image[1]}, which is not the size of any level"
            at.add("PTM-D710", f"{record['fallback']} {message}")
        elif level != record["fallbackLevel"]:
            message = f"the fallback image is level {level}, not {record['fallbackLevel']}"
            at.add("PTM-D704", message)


def check_octrees(hints: ReadHints, database: ServedDatabase) -> None:
    """Checks each octree texture: its row, its length, its levels and the order of its texels."""
    rows = hints.index.get("octrees", ())
    files = database.resolve_each(HINTS, "octrees", [row["file"] for row in rows])
    for i, (row, file) in enumerate(zip(rows, files, strict=True)):
        if fault := _row_fault(row):
            database.at(HINTS, f"octrees[{i}]").add("PTM-D700", fault)
        elif file:
            _check_octree(row, database.head(file, row["ends"][-1] + 1), database.at(file))


def _row_fault(row: Mapping[str, Any]) -> str:
    """The fault of a row by itself; "" if there is none."""
    from ptmtools.neighbours.apo.model import ADDRESS_BITS

    levels, ends = row["levels"], row["ends"]
    if not len(levels) == len(ends) == len(row["crc32"]):
        return "levels, ends and crc32 are not aligned"
    if min(b - a for a, b in zip([0, *ends], ends, strict=False)) <= 0:
        return "ends are not in ascending order"
    if sum(levels) > 1 << ADDRESS_BITS or ends[-1] > _MOST_BYTES:
        return f"has {sum(levels):,} texels in {ends[-1]:,} bytes, more than an octree can have"
    return ""


def _check_octree(row: Mapping[str, Any], data: bytes, at: Place) -> None:
    """Inflates the levels of a row, each by itself, and checks that they form an octree."""
    from ptmtools.neighbours.apo.files import inflated
    from ptmtools.neighbours.apo.model import Octree
    from ptmtools.neighbours.apo.octree import fault_of

    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    if len(data) != row["ends"][-1]:
        less = len(data) < row["ends"][-1]
        at.add("PTM-D710", f"ends {'before' if less else 'after'} the last level")
    try:
        texels = inflated(data, start, row)
    except InputError as error:
        at.add("PTM-D710", error.message, error.place or "")
        return
    octree = Octree(texels, start, np.array(row["cube"]["low"]), row["cube"]["side"])
    if fault := fault_of(octree):
        place, message = fault
        at.add("PTM-D710", message, place)
