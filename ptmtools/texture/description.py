"""The description of a `.ptm`: tagged values between head and groups.

Each is a tag of four ASCII letters, a length (4 bytes, little endian) and so many bytes. Unknown
tags are passed over, so that later versions may add some.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from ptmtools.errors import InputError
from ptmtools.texture.model import Description

_ENTRY = struct.Struct("<4sI")
_CHROMATICITIES = struct.Struct("<8I")


def pack_description(description: Description) -> bytes:
    """Its bytes; none if it says nothing. Raises InputError PTM-I111 for impossible values."""
    _check(description)
    values: list[tuple[bytes, bytes]] = []
    if description.icc is not None:
        values.append((b"ICCP", description.icc))
    if description.srgb is not None:
        values.append((b"SRGB", bytes([description.srgb])))
    if description.gamma is not None:
        values.append((b"GAMA", description.gamma.to_bytes(4, "little")))
    if description.chromaticities is not None:
        values.append((b"CHRM", _CHROMATICITIES.pack(*description.chromaticities)))
    if description.orientation != 1:
        values.append((b"ORIE", bytes([description.orientation])))
    return b"".join(_ENTRY.pack(tag, len(value)) + value for tag, value in values)


def parse_description(data: bytes) -> Description:
    """The inverse of `pack_description`. Raises InputError PTM-I113 for impossible values."""
    values = list(_values(data))
    found = dict(values)
    if len(found) < len(values):
        raise _impossible("a tag is repeated")
    srgb, gamma = found.get(b"SRGB"), found.get(b"GAMA")
    points, orientation = found.get(b"CHRM"), found.get(b"ORIE", b"\1")
    if (
        (srgb is not None and (len(srgb) != 1 or srgb[0] > 3))
        or (gamma is not None and len(gamma) != 4)
        or (points is not None and len(points) != _CHROMATICITIES.size)
        or len(orientation) != 1
        or not 1 <= orientation[0] <= 8
    ):
        raise _impossible("one of its values is out of range")
    return Description(
        icc=found.get(b"ICCP"),
        srgb=None if srgb is None else srgb[0],
        gamma=None if gamma is None else int.from_bytes(gamma, "little"),
        chromaticities=None if points is None else _CHROMATICITIES.unpack(points),
        orientation=orientation[0],
    )


def _check(description: Description) -> None:
    """Raises for values that no file can hold."""

    def within(value: int | None, low: int, high: int) -> bool:
        return value is None or (isinstance(value, int) and low <= value <= high)

    points = description.chromaticities
    if not (
        within(description.srgb, 0, 3)
        and within(description.gamma, 0, (1 << 32) - 1)
        and within(description.orientation, 1, 8)
        and (points is None or (len(points) == 8 and all(within(p, 0, 2**32 - 1) for p in points)))
    ):
        raise InputError(
            "PTM-I111",
            f"these values for colour and orientation are impossible: {description!r:.200}",
            remedy="see ptmtools.texture.Description for the ranges",
        )


def _values(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 0
    while at < len(data):
        if at + _ENTRY.size > len(data):
            raise _impossible("it is cut short")
        tag, length = _ENTRY.unpack_from(data, at)
        at += _ENTRY.size
        if length > len(data) - at:
            raise _impossible("it is cut short")
        yield tag, data[at : at + length]
        at += length


def _impossible(what: str) -> InputError:
    return InputError(
        "PTM-I113",
        f"the description cannot be read: {what}",
        place="description",
        remedy="the file is damaged or was not written by a conforming encoder; encode it again",
    )
