"""The check of textures: each by itself, against its fallback image and its row in the hints."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.errors import LimitError, PtmError
from ptmtools.texture.model import gpu_texel_bytes

if TYPE_CHECKING:
    from ptmtools.texture import Limits, PtmHeader
    from ptmtools.texture.detail import Detail

    Samples = NDArray[Any]

_PNG = b"\x89PNG\r\n\x1a\n"
#: Relative slack of `differences` of levels, which are rounded, and summed in another order here.
_DIFFERENCE_SLACK = 0.01
#: Of the first chunk of a PNG: its length and kind, width and height.
_IHDR = struct.Struct(">I4sII")


@dataclass(frozen=True)
class ReadTexture:
    """The properties of a `.ptm` that the hints repeat.

    Attributes
    ----------
    header: of the file.
    sha256: hex digest of its bytes.
    detail: of its levels; None if they could not be decoded.
    fallback_level: the level with the size of the fallback image; None without an image or such a
        level.
    """

    header: PtmHeader
    sha256: str
    detail: Detail | None = None
    fallback_level: int | None = None


def read_texture(
    data: bytes, digest: str, fallback: bytes | None, limits: Limits, at: Place
) -> ReadTexture | None:
    """A `.ptm` and its fallback image, if it has one; None, with PTM-D710, if the header is
    damaged. A PNG with the size of no level is not decoded."""
    from ptmtools.texture import decode, read_header

    shown = check_ptm(data, limits, at)
    detail, texels = shown or (None, None)
    try:
        header = read_header(data)
    except PtmError:
        return None
    if fallback is None:
        return ReadTexture(header, digest, detail)
    png, size = f"{at.file.removesuffix('.ptm')}.png", _png_size(fallback)
    level = next((n for n, v in enumerate(header.levels) if (v.width, v.height) == size), None)
    if size is not None and level is None:
        message = f"{png} is {size[0]} x {size[1]}, which is not the size of any level"
        at.add("PTM-D710", message)
        return ReadTexture(header, digest, detail)
    other = read_png(fallback, limits, at.findings.at(png))
    if level is not None and texels is not None and other is not None:
        if level < len(header.levels) - 1:
            texels = decode(data, level, limits)
        if not _same_image(texels, other):
            at.add("PTM-D710", f"differs from {png}", f"level {level}")
    return ReadTexture(header, digest, detail, level)


def check_ptm(data: bytes, limits: Limits, at: Place) -> tuple[Detail, Samples] | None:
    """Checks every group of a `.ptm`. Returns the detail of its levels and the texels of the
    finest; None after a fault."""
    from ptmtools.texture.reader import examine

    try:
        faults, shown = examine(data, limits)
    except LimitError as limit:
        # Exceeding the caller's limit is no damage; exceeding the format's is.
        at.add("PTM-D713" if limit.code == "PTM-L103" else "PTM-D710", limit.message)
        return None
    for fault in faults:
        at.add("PTM-D710", fault.partition(" [PTM-")[0])
    return shown


def read_png(data: bytes, limits: Limits, at: Place) -> Samples | None:
    """The texels of a PNG, (h, w, c); None, with PTM-D710 or PTM-D713, if it cannot be read."""
    from ptmtools.texture import load_image

    if _png_size(data) is None:
        at.add("PTM-D710", "is not a PNG")
        return None
    try:
        return load_image(data, limits).array()
    except PtmError as fault:
        code = "PTM-D713" if isinstance(fault, LimitError) else "PTM-D710"
        at.add(code, f"cannot be read ({fault.message})")
        return None


def check_record(record: Mapping[str, Any], texture: ReadTexture, at: Place) -> None:
    """Compares a row of `textures` in `hints.json` with its `.ptm`."""
    header = texture.header
    finest = header.levels[-1]
    faults = _differing(
        record,
        {
            "components": header.components,
            "width": finest.width,
            "height": finest.height,
            "texelBytes": header.texel_bytes,
            "gpuTexelBytes": gpu_texel_bytes(header.texel_bytes, header.components),
            "ends": [level.end for level in header.levels],
        },
    )
    if texture.detail:
        faults += _differing(record, {"color": list(texture.detail.color)})
        actual = texture.detail.differences
        listed = record.get("differences", actual)
        if len(listed) != len(actual) or not np.allclose(listed, actual, _DIFFERENCE_SLACK, 0):
            faults.append("differences are not those of the levels in the file")
    fallback, level = record["fallback"], record["fallbackLevel"]
    if (fallback is None) != (level is None):
        faults.append("only one of fallback and fallbackLevel is null")
    elif fallback is not None and texture.fallback_level not in (None, level):
        faults.append(f"the fallback image is level {texture.fallback_level}, not {level}")
    for fault in faults:
        at.add("PTM-D704", fault)


def _differing(row: Mapping[str, Any], actual: Mapping[str, Any]) -> list[str]:
    """The fields of a row that differ from the file."""
    return [f"{name} is {v} in the file" for name, v in actual.items() if row.get(name, v) != v]


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
