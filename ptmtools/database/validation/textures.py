"""What the textures must satisfy: by themselves, beside their fallback images and the hints."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.validation.findings import Findings
from ptmtools.errors import LimitError, PtmError

if TYPE_CHECKING:
    from ptmtools.texture import Limits, PtmHeader

    Samples = NDArray[Any]

_PNG = b"\x89PNG\r\n\x1a\n"
#: Of the first chunk of a PNG: its length and kind, width and height.
_IHDR = struct.Struct(">I4sII")
#: What the hints say of a level, in the order of the header.
_LEVEL = ("width", "height", "offset", "length", "gpuBytes")


@dataclass(frozen=True)
class ReadTexture:
    """What the hints may say of a `.ptm`.

    Attributes
    ----------
    header: of the file.
    sha256: hex digest of its bytes.
    fallback_level: the level that has the size of the fallback image; None if there is no image, or
        no such level.
    """

    header: PtmHeader
    sha256: str
    fallback_level: int | None = None


def read_texture(
    data: bytes, digest: str, fallback: bytes | None, file: str, limits: Limits, found: Findings
) -> ReadTexture | None:
    """A `.ptm` and its fallback image, if it has one; None, and PTM-D710, without a sound head."""
    from ptmtools.texture import read_header

    texels = check_ptm(data, file, limits, found)
    try:
        header = read_header(data)
    except PtmError:
        return None
    level = None
    if fallback is not None:
        level = _check_fallback(fallback, data, header, texels, file, limits, found)
    return ReadTexture(header, digest, level)


def check_ptm(data: bytes, file: str, limits: Limits, found: Findings) -> Samples | None:
    """A `.ptm` by itself, every group of it. Returns its finest level, if nothing is wrong."""
    from ptmtools.texture.codec import examine

    try:
        faults, texels = examine(data, limits)
    except LimitError as limit:
        # More than is allowed here is no damage; more than the format allows is.
        found.add("PTM-D713" if limit.code == "PTM-L103" else "PTM-D710", file, "", limit.message)
        return None
    for fault in faults:
        found.add("PTM-D710", file, "", fault.partition(" [PTM-")[0])
    return texels


def read_png(data: bytes, file: str, limits: Limits, found: Findings) -> Samples | None:
    """The texels of a PNG, (h, w, c); None, and PTM-D712 or PTM-D713, if it is none."""
    from ptmtools.texture import load_image

    if _png_size(data) is None:
        found.add("PTM-D712", file, "", "is no PNG")
        return None
    try:
        return load_image(data, limits).array()
    except PtmError as fault:
        code = "PTM-D713" if isinstance(fault, LimitError) else "PTM-D712"
        found.add(code, file, "", f"cannot be read ({fault.message})")
        return None


def check_record(
    record: Mapping[str, Any],
    texture: ReadTexture,
    file: str,
    place: str,
    found: Findings,
) -> None:
    """A row of `textures` in `hints.json` beside its `.ptm`."""
    header, levels = texture.header, record["levels"]
    finest = len(header.levels) - 1
    size = (header.levels[-1].width, header.levels[-1].height)
    faults = []
    if record["sha256"] != texture.sha256:
        faults.append("sha256 is not the file's")
    if record["components"] != header.components:
        faults.append(f"the file has {header.components} components")
    if (record["width"], record["height"]) != size:
        faults.append(f"the finest level is {size[0]} x {size[1]}")
    if len(levels) != finest + 1:
        faults.append(f"the file has {finest + 1} levels")
    for n, (row, true) in enumerate(zip(levels, header.levels, strict=False)):
        wanted = (true.width, true.height, true.offset, true.length, true.gpu_bytes)
        for name, value in zip(_LEVEL, wanted, strict=True):
            if row[name] != value:
                faults.append(f"level {n}: {name} is {value} in the file")
    fallback, level = record["fallback"], record["fallbackLevel"]
    if (fallback is None) != (level is None):
        faults.append("fallback and fallbackLevel do not go together")
    elif fallback is not None and texture.fallback_level not in (None, level):
        faults.append(f"the fallback holds level {texture.fallback_level}, not {level}")
    for fault in faults:
        found.add("PTM-D704", file, place, fault)


def _check_fallback(
    fallback: bytes,
    data: bytes,
    header: PtmHeader,
    texels: Samples | None,
    file: str,
    limits: Limits,
    found: Findings,
) -> int | None:
    """The level that the fallback image has the size of; a PNG of the size of none is not
    decoded."""
    from ptmtools.texture import decode

    png = f"{file.removesuffix('.ptm')}.png"
    size, levels = _png_size(fallback), header.levels
    level = next((n for n, v in enumerate(levels) if (v.width, v.height) == size), None)
    if size is not None and level is None:
        found.add(
            "PTM-D711",
            file,
            "",
            f"{png} is {size[0]} x {size[1]}, which is not the size of any level",
        )
        return None
    other = read_png(fallback, png, limits, found)
    if level is None or texels is None or other is None:
        return level
    if level < len(levels) - 1:
        texels = decode(data, level, limits)
    if not _same_image(texels, other):
        found.add("PTM-D711", file, f"level {level}", f"it differs from {png}")
    return level


def _png_size(data: bytes) -> tuple[int, int] | None:
    if not data.startswith(_PNG) or len(data) < len(_PNG) + _IHDR.size:
        return None
    length, kind, width, height = _IHDR.unpack_from(data, len(_PNG))
    return (width, height) if (length, kind) == (13, b"IHDR") else None


def _same_image(one: Samples, other: Samples) -> bool:
    if one.shape[2] != other.shape[2]:
        one, other = _rgba(one), _rgba(other)
    return one.dtype == other.dtype and np.array_equal(one, other)


def _rgba(texels: Samples) -> Samples:
    """Texels of integers, (h, w, 1 to 4), as red, green, blue and alpha."""
    count = texels.shape[2]
    top = np.iinfo(texels.dtype).max if texels.dtype.kind == "u" else 1
    colour = texels[:, :, :3] if count > 2 else np.repeat(texels[:, :, :1], 3, axis=2)
    alpha = texels[:, :, count - 1 :] if count in (2, 4) else np.full_like(colour[:, :, :1], top)
    return np.concatenate([colour, alpha], axis=2)
