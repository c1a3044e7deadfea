"""The container: header and group table, before any texel is looked at.

Everything a client needs to know about byte ranges is in the first few hundred bytes, under a CRC
of its own. Specified in ``docs/formats/ptm.md``.

The description of a `.ptm` is a list of tagged values between head and groups. Each is a tag of
four ASCII letters, a length (4 bytes, little endian) and its bytes. Readers skip unknown tags, so
that later versions may add some.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ptmtools.errors import InputError, LimitError
from ptmtools.texture.model import (
    MAX_COMPONENTS,
    MAX_LEVELS,
    MAX_SIDE,
    TILE_SIDES,
    Description,
    EncodeOptions,
    Level,
    PtmHeader,
)
from ptmtools.texture.profiles import PROFILES, Profile
from ptmtools.texture.pyramid import level_sizes, tile_counts
from ptmtools.texture.samples import KINDS, KINDS_BY_NUMBER, SampleKind

#: As in PNG: a byte above 127, the name, both line ends and an end-of-file mark.
MAGIC = b"\x89PTM\r\n\x1a\n"
#: The version written. Version 1 had neither tiles, errors nor a description.
VERSION = 2
#: Magic, version, profile, kind, width, height, components, levels, trimmed, zero, head size.
_FIXED = struct.Struct("<8sHBBIIBBBBI")
#: From version 2 on: side of a tile, largest error, length and CRC-32 of the description.
_MORE = struct.Struct("<IIII")
#: Offset, length, CRC-32 of a group.
_ENTRY = struct.Struct("<QQI")
#: Length and CRC-32 of a tile.
TILE_ENTRY = struct.Struct("<II")
#: First byte of every tile of a file with an allowed error: whether the tile uses it.
EXACT, WITHIN = 0, 1
_CRC = struct.Struct("<I")
#: No head is longer, so that many bytes always suffice for `read_header`.
HEAD_MAX = _FIXED.size + _MORE.size + MAX_LEVELS * _ENTRY.size + _CRC.size
#: No description is longer, bytes.
DESCRIPTION_MAX = 1 << 24

_ENCODE_AGAIN = "the file is damaged: fetch or encode it again"


def head_size(groups: int) -> int:
    """Bytes of the head of a file of that many groups."""
    return _FIXED.size + _MORE.size + groups * _ENTRY.size + _CRC.size


def pack_head(
    shape: tuple[int, int, int],
    kind: str,
    options: EncodeOptions,
    trimmed: int,
    description: bytes,
    groups: Sequence[tuple[int, int]],
) -> bytes:
    """The head of a file: the description follows it, then the groups, coarsest first.

    shape: (h, w, c) of the original image. kind, trimmed: as in `PtmHeader`. groups: length and
    CRC-32 of each.
    """
    height, width, components = shape
    size = head_size(len(groups))
    counts = (components, len(groups), trimmed, 0)
    numbers = (PROFILES[options.profile].number, KINDS[kind].number, width, height)
    packed = bytearray(_FIXED.pack(MAGIC, VERSION, *numbers, *counts, size))
    packed += _MORE.pack(options.tile, options.max_error, len(description), zlib.crc32(description))
    offset = size + len(description)
    for length, crc32 in groups:
        packed += _ENTRY.pack(offset, length, crc32)
        offset += length
    return bytes(packed + _CRC.pack(zlib.crc32(packed)))


def cut(data: bytes, levels: int) -> bytes:
    """A file of version 2 with its first ``levels`` levels, the finer ones left out on purpose.

    Raises as `read_header`.
    """
    header = read_header(data)
    options = EncodeOptions(header.profile, header.max_error, header.tile)
    kept, (offset, length, _) = header.levels[:levels], header.description
    shape = (header.height, header.width, header.components)
    trimmed = header.trimmed + len(header.levels) - len(kept)
    described = data[offset : offset + length]
    groups = [(level.length, level.crc32) for level in kept]
    head = pack_head(shape, header.kind, options, trimmed, described, groups)
    return head + described + data[kept[0].offset : kept[-1].end]


def read_header(data: bytes) -> PtmHeader:
    """The header and group table of a file, from its first `HEAD_MAX` bytes or more.

    Raises
    ------
    InputError: PTM-I101 not a PTM file (or HP's format of that suffix), PTM-I103 cut
        inside the head, PTM-I104 another version or profile, PTM-I105 damaged head.
    LimitError: PTM-L104 sizes beyond what the format allows.
    MissingComponentError: PTM-M110 as `Profiles`, for a profile that ptmtools does not have.
    """
    _check_magic(data)
    if len(data) < _FIXED.size:
        raise _short_head_error(len(data))
    (_, version, profile_number, kind, width, height, components, count, trimmed, zero, size) = (
        _FIXED.unpack_from(data)
    )
    if not 1 <= version <= VERSION:
        raise InputError(
            "PTM-I104",
            f"is of version {version}; this program reads versions 1 to {VERSION}",
            remedy="use a newer ptmtools, or encode the image again",
        )
    table = _FIXED.size + (_MORE.size if version > 1 else 0)
    if size != table + count * _ENTRY.size + _CRC.size or count > MAX_LEVELS:
        raise _head_error("its size does not match the number of levels")
    if len(data) < size:
        raise _short_head_error(len(data))
    (crc,) = _CRC.unpack_from(data, size - _CRC.size)
    if crc != zlib.crc32(data[: size - _CRC.size]):
        raise _head_error("its checksum is wrong")
    profile, samples = _find_profile(version, profile_number, kind)
    if max(width, height) > MAX_SIDE:
        raise LimitError(
            "PTM-L104",
            f"says it is {width} x {height} texels; the format allows {MAX_SIDE} a side",
            remedy=_ENCODE_AGAIN,
        )
    sizes = _sizes(width, height, components, count, trimmed)
    if zero:
        raise _head_error("a reserved byte is not 0")
    more = data[_FIXED.size : size] if version > 1 else bytes(_MORE.size)
    tile, max_error, described, crc32 = _MORE.unpack_from(more)
    if tile and (tile % 2 or not TILE_SIDES[0] <= tile <= TILE_SIDES[1]):
        raise _head_error(f"tiles of {tile} texels are impossible")
    if max_error > (samples.top_error if profile.lossy else 0) or described > DESCRIPTION_MAX:
        raise _head_error("its largest error or the length of its description is impossible")
    entries = [_ENTRY.unpack_from(data, table + i * _ENTRY.size) for i in range(count)]
    return PtmHeader(
        width=width,
        height=height,
        components=components,
        kind=samples.name,
        profile=profile.name,
        version=version,
        trimmed=trimmed,
        tile=tile,
        max_error=max_error,
        description=(size, described, crc32),
        levels=_levels(entries, sizes, tile, components * samples.size, size + described),
    )


def _find_profile(version: int, profile_number: int, kind: int) -> tuple[Profile, SampleKind]:
    """The profile and the kind of samples of these numbers in a head. Raises InputError PTM-I104,
    and as `Profiles.numbered`."""
    profile, samples = PROFILES.by_number(profile_number), KINDS_BY_NUMBER.get(kind)
    if profile and samples and version >= profile.since and not (version == 1 and kind):
        return profile, samples
    package = "" if profile else "install the package that has this profile, "
    raise InputError(
        "PTM-I104",
        f"uses profile {profile_number} with samples of kind {kind}, which this program does not "
        "know",
        remedy=f"{package}use a newer ptmtools, or encode the image again",
    )


def _levels(
    entries: Iterable[tuple[int, int, int]],
    sizes: Iterable[tuple[int, int]],
    tile: int,
    texel_bytes: int,
    start: int,
) -> tuple[Level, ...]:
    """The levels of a group table, the first of which begins at byte ``start``. Raises InputError
    PTM-I105 for byte ranges that no encoder writes."""
    levels: list[Level] = []
    expected, texels = start, 0
    for number, ((w, h), (offset, length, crc)) in enumerate(zip(sizes, entries, strict=True)):
        tiles = tile_counts(w, h, tile) if number else (1, 1)
        # No coder makes a group twice as long as its texels, except for a few bytes.
        if offset != expected or length > 2 * w * h * texel_bytes + 1024 * tiles[0] * tiles[1]:
            raise _head_error(f"the byte range of level {number} is impossible")
        expected += length
        texels += w * h
        levels.append(Level(w, h, offset, length, crc, tiles, texels * texel_bytes))
    return tuple(levels)


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
        raise _head_error(
            f"{count} levels of {components} components, {trimmed} trimmed, cannot be those "
            f"of {width} x {height} texels"
        )
    finest = len(sizes) - trimmed
    return sizes[finest - count : finest]


def _check_magic(data: bytes) -> None:
    if data.startswith(MAGIC):
        return
    if not data:
        raise InputError("PTM-I101", "is empty", remedy="download or encode it again")
    if data.startswith(b"PTM_1"):
        raise InputError(
            "PTM-I101",
            "is a Polynomial Texture Map (HP's format, also .ptm), not a progressive texture map",
            remedy="convert it to PNG with a viewer for that format and encode the PNG",
        )
    if MAGIC.startswith(data):
        raise _short_head_error(len(data))
    raise InputError(
        "PTM-I101",
        "is not a progressive texture map (wrong file signature)",
        remedy="if it is an image, encode it with: ptm encode",
    )


def _short_head_error(size: int) -> InputError:
    return InputError(
        "PTM-I103",
        f"is incomplete: cut inside its head, after {size} bytes",
        place=f"byte {size}",
        remedy="no level is complete; download or encode it again",
    )


def _head_error(what: str) -> InputError:
    return InputError("PTM-I105", f"its head is damaged: {what}", remedy=_ENCODE_AGAIN)


_TAGGED = struct.Struct("<4sI")
#: Tag → attribute of `Description`, number and kind of the integers, and their range.
_TAGS = {
    b"SRGB": ("srgb", 1, "B", range(4)),
    b"GAMA": ("gamma", 1, "I", range(1 << 32)),
    b"CHRM": ("chromaticities", 8, "I", range(1 << 32)),
    b"ORIE": ("orientation", 1, "B", range(1, 9)),
}
_PLAIN = Description()


def pack_description(description: Description) -> bytes:
    """Its bytes; none if it says nothing. Raises InputError PTM-I111 for impossible values."""
    values = [] if description.icc is None else [(b"ICCP", description.icc)]
    for tag, (name, count, letter, allowed) in _TAGS.items():
        value = getattr(description, name)
        if value == getattr(_PLAIN, name):
            continue
        numbers = value if count > 1 else (value,)
        if len(numbers) != count or not all(isinstance(n, int) and n in allowed for n in numbers):
            raise InputError(
                "PTM-I111",
                f"these values for colour and orientation are impossible: {description!r:.200}",
                remedy="see ptmtools.texture.Description for the ranges",
            )
        values.append((tag, struct.pack(f"<{count}{letter}", *numbers)))
    return b"".join(_TAGGED.pack(tag, len(value)) + value for tag, value in values)


def parse_description(data: bytes) -> Description:
    """The inverse of `pack_description`. Raises InputError PTM-I105 for impossible values."""
    values = list(_values(data))
    tags = dict(values)
    if len(tags) < len(values):
        raise _description_error("a tag is repeated")
    fields: dict[str, Any] = {"icc": tags.get(b"ICCP")}
    for tag in _TAGS.keys() & tags.keys():
        name, count, letter, allowed = _TAGS[tag]
        layout = struct.Struct(f"<{count}{letter}")
        fits = len(tags[tag]) == layout.size
        numbers = layout.unpack(tags[tag]) if fits else ()
        if not fits or not all(n in allowed for n in numbers):
            raise _description_error("one of its values is out of range")
        fields[name] = numbers if count > 1 else numbers[0]
    return Description(**fields)


def _values(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 0
    while at < len(data):
        if at + _TAGGED.size > len(data):
            raise _description_error("it is cut short")
        tag, length = _TAGGED.unpack_from(data, at)
        at += _TAGGED.size
        if length > len(data) - at:
            raise _description_error("it is cut short")
        yield tag, data[at : at + length]
        at += length


def _description_error(what: str) -> InputError:
    return InputError(
        "PTM-I105",
        f"the description cannot be read: {what}",
        place="description",
        remedy="the file is damaged or was not written by a conforming encoder; encode it again",
    )
