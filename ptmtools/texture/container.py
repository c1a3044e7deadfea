"""The container: header and group table, before any texel is looked at.

Everything a client needs to know about byte ranges is in the first few hundred bytes, under a CRC
of its own. Specified in ``docs/format-ptm.md``.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

from ptmtools.errors import InputError, LimitError
from ptmtools.texture.model import MAX_COMPONENTS, MAX_LEVELS, MAX_SIDE, Level, PtmHeader
from ptmtools.texture.profiles import PROFILE_NUMBERS
from ptmtools.texture.pyramid import level_sizes

#: As in PNG: a byte above 127, the name, both line ends and an end-of-file mark.
MAGIC = b"\x89PTM\r\n\x1a\n"
VERSION = 1
#: Magic, version, profile, kind, width, height, components, levels, trimmed, zero, head size.
_FIXED = struct.Struct("<8sHBBIIBBBBI")
#: Offset, length, CRC-32 of a group.
_ENTRY = struct.Struct("<QQI")
_CRC = struct.Struct("<I")
#: No head is longer, so that many bytes always suffice for `read_header`.
HEAD_MAX = _FIXED.size + MAX_LEVELS * _ENTRY.size + _CRC.size

_KINDS = {0: "uint8"}
_PROFILES = {number: name for name, number in PROFILE_NUMBERS.items()}
_ENCODE_AGAIN = "the file is damaged: fetch or encode it again"


def assemble(
    width: int, height: int, components: int, profile: str, trimmed: int, groups: Sequence[bytes]
) -> bytes:
    """The bytes of a file: head, then the groups, coarsest first.

    width, height: of the original, texels; the finest group is ``trimmed`` halvings smaller.
    """
    size = _FIXED.size + len(groups) * _ENTRY.size + _CRC.size
    number = PROFILE_NUMBERS[profile]
    counts = (components, len(groups), trimmed, 0)
    head = bytearray(_FIXED.pack(MAGIC, VERSION, number, 0, width, height, *counts, size))
    offset = size
    for group in groups:
        head += _ENTRY.pack(offset, len(group), zlib.crc32(group))
        offset += len(group)
    head += _CRC.pack(zlib.crc32(head))
    return b"".join([head, *groups])


def read_header(data: bytes) -> PtmHeader:
    """The header and group table of a file, from its first `HEAD_MAX` bytes or more.

    Raises
    ------
    InputError: PTM-I101 not a PTM file (or HP's format of that suffix, PTM-I102), PTM-I103 cut
        inside the head, PTM-I104 another version or profile, PTM-I105 damaged head.
    LimitError: PTM-L101 sizes beyond what the format allows.
    """
    _check_magic(data)
    if len(data) < _FIXED.size:
        raise _cut_head(len(data))
    (_, version, profile, kind, width, height, components, count, trimmed, zero, size) = (
        _FIXED.unpack_from(data)
    )
    if version != VERSION:
        raise InputError(
            "PTM-I104",
            f"is of version {version}; this program reads version {VERSION}",
            remedy="use a newer ptmtools, or encode the image again",
        )
    if size != _FIXED.size + count * _ENTRY.size + _CRC.size or count > MAX_LEVELS:
        raise _damaged_head("its size does not match its number of levels")
    if len(data) < size:
        raise _cut_head(len(data))
    (crc,) = _CRC.unpack_from(data, size - _CRC.size)
    if crc != zlib.crc32(data[: size - _CRC.size]):
        raise _damaged_head("its checksum is wrong")
    if profile not in _PROFILES or kind not in _KINDS:
        raise InputError(
            "PTM-I104",
            f"uses profile {profile} with components of kind {kind}, which this program "
            "does not know",
            remedy="use a newer ptmtools, or encode the image again",
        )
    if max(width, height) > MAX_SIDE:
        raise LimitError(
            "PTM-L101",
            f"says it is {width} x {height} texels; the format allows {MAX_SIDE} a side",
            remedy=_ENCODE_AGAIN,
        )
    sizes = _sizes(width, height, components, count, trimmed)
    if zero:
        raise _damaged_head("a reserved byte is not 0")
    entries = [_ENTRY.unpack_from(data, _FIXED.size + i * _ENTRY.size) for i in range(count)]
    levels: list[Level] = []
    expected, texels = size, 0
    for (w, h), (offset, length, crc32) in zip(sizes, entries, strict=True):
        if offset != expected or length > 2 * w * h * components + 64:
            raise _damaged_head(f"the byte range of level {len(levels)} is impossible")
        expected += length
        texels += w * h
        levels.append(Level(w, h, offset, length, crc32, texels * components))
    return PtmHeader(
        width=width,
        height=height,
        components=components,
        kind=_KINDS[kind],
        profile=_PROFILES[profile],
        version=version,
        trimmed=trimmed,
        levels=tuple(levels),
    )


def whole_levels(header: PtmHeader, size: int) -> int:
    """How many levels, from the coarsest, are whole in the first ``size`` bytes of the file."""
    return sum(level.end <= size for level in header.levels)


def _sizes(
    width: int, height: int, components: int, count: int, trimmed: int
) -> list[tuple[int, int]]:
    """Sizes of the stored levels, coarsest first, or an error if there are no such levels."""
    possible = (
        width > 0
        and height > 0
        and 0 < components <= MAX_COMPONENTS
        and 0 < count <= MAX_LEVELS
        and trimmed < MAX_LEVELS
    )
    sizes = level_sizes(width, height) if possible else []
    if count + trimmed > len(sizes) or not count:
        raise _damaged_head(
            f"{count} levels of {components} components, {trimmed} trimmed, cannot be those "
            f"of {width} x {height} texels"
        )
    finest = len(sizes) - trimmed
    return sizes[finest - count : finest]


def _check_magic(data: bytes) -> None:
    if data.startswith(MAGIC):
        return
    if not data:
        raise InputError("PTM-I101", "is empty", remedy="fetch or encode it again")
    if data.startswith(b"PTM_1"):
        raise InputError(
            "PTM-I102",
            "is a Polynomial Texture Map (HP's format, also .ptm), not a progressive texture map",
            remedy="convert it to PNG with a viewer for that format and encode the PNG",
        )
    if MAGIC.startswith(data):
        raise _cut_head(len(data))
    raise InputError(
        "PTM-I101",
        "is not a progressive texture map (wrong first bytes)",
        remedy="if it is an image, encode it with: ptm encode",
    )


def _cut_head(size: int) -> InputError:
    return InputError(
        "PTM-I103",
        f"is cut inside its head, after {size} bytes",
        place=f"byte {size}",
        remedy="no level is whole; fetch or encode it again",
    )


def _damaged_head(what: str) -> InputError:
    return InputError("PTM-I105", f"its head is damaged: {what}", remedy=_ENCODE_AGAIN)
