"""The check of the textures and of their rows in the hints."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from ptmtools.diagnostics import Place
from ptmtools.errors import LimitError, PtmError
from ptmtools.output.model import sizes_of
from ptmtools.texture.model import gpu_texel_bytes

if TYPE_CHECKING:
    from ptmtools.texture import Limits, PtmHeader

#: Formats of the served images, as Pillow names them, by suffix.
IMAGES = {".png": "PNG", ".webp": "WEBP", ".avif": "AVIF", ".jpg": "JPEG"}


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


class ReadPicture(NamedTuple):
    """A served image: its width and height, and its bytes."""

    size: tuple[int, int]
    bytes: int


def read_picture(data: bytes, format: str, limits: Limits, at: Place) -> ReadPicture | None:
    """Decodes an image of a format that Pillow names so; None with PTM-D710 if it is none."""
    from ptmtools.texture import load_image
    from ptmtools.texture.images.opening import open_image, pillow_faults

    try:
        with pillow_faults():
            image = open_image(io.BytesIO(data), limits)
        if image.format == format:
            load_image(data, limits)
            return ReadPicture(image.size, len(data))
        at.add("PTM-D710", f"is not a {format}")
    except PtmError as fault:
        code = "PTM-D713" if isinstance(fault, LimitError) else "PTM-D710"
        at.add(code, f"cannot be read ({fault.message})")
    return None


def check_record(
    record: Mapping[str, Any],
    header: PtmHeader,
    fallback: ReadPicture | None,
    previews: Sequence[ReadPicture | None],
    at: Place,
) -> None:
    """Compares a row of `textures` in `hints.json` with its `.ptm`, its fallback image and its
    previews, None where they could not be read."""
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
    sizes = [(level.width, level.height) for level in header.levels]
    sizes += sizes_of(record)[len(sizes) :]
    for name in ("differences", "offsets"):
        if name in record and len(record[name]) != len(sizes):
            at.add("PTM-D704", f"{name} do not match the levels")
    _check_previews(record, sizes, previews, at)
    if (record["fallback"] is None) != (record["fallbackLevel"] is None):
        at.add("PTM-D704", "only one of fallback and fallbackLevel is null")
    elif fallback is not None and fallback.size not in sizes:
        message = f"is {_size_text(fallback.size)}, which is not the size of any level"
        at.add("PTM-D710", f"{record['fallback']} {message}")
    elif fallback is not None and (level := sizes.index(fallback.size)) != record["fallbackLevel"]:
        message = f"the fallback image is level {level}, not {record['fallbackLevel']}"
        at.add("PTM-D704", message)


def _check_previews(
    record: Mapping[str, Any],
    sizes: Sequence[tuple[int, int]],
    pictures: Sequence[ReadPicture | None],
    at: Place,
) -> None:
    rows = record.get("previews", ())
    order = [(row["level"], row.get("exact", False)) for row in rows]
    if any(a >= b for a, b in pairwise(order)):
        at.add("PTM-D704", "previews are not in ascending order of their levels")
        return
    if sizes_of(record)[len(record["ends"]) - 1] != (record["width"], record["height"]):
        at.add("PTM-D704", "the finest preview and the .ptm are not of one pyramid")
    for row, picture in zip(rows, pictures, strict=True):
        size, place = (row["width"], row["height"]), f"preview of level {row['level']}"
        if row["level"] >= len(sizes):
            at.add("PTM-D704", f"the {place} has no level")
        elif size != sizes[row["level"]]:
            at.add("PTM-D704", f"the {place} is {_size_text(size)}, its level is not")
        if row.get("exact") and row["difference"]:
            at.add("PTM-D704", f"the {place} is exact and differs by {row['difference']:g}")
        if picture and picture != (size, row["bytes"]):
            at.add("PTM-D704", f"the {place} does not match its file")


def _size_text(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]}"
