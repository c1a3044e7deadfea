"""The value types of a `.ptm`: options, header, levels, limits. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar

from ptmtools.options import option, require
from ptmtools.texture.profiles import PROFILES
from ptmtools.texture.pyramid import Box
from ptmtools.texture.samples import KINDS

#: Longest side of an image, texels.
MAX_SIDE = 1 << 16
#: Largest number of levels: a side of 2^16 halves 16 times.
MAX_LEVELS = 17
MAX_COMPONENTS = 4
#: Sides that tiles may have, texels.
TILE_SIDES = (16, 1 << 15)


@dataclass(frozen=True)
class EncodeOptions:
    """Options of `ptmtools.texture.encode`."""

    heading: ClassVar[str] = "Textures"

    profile: str = option("fast", "Coding of the levels", choices=PROFILES)
    max_error: int = option(
        0,
        "Maximum error of any sample of any level; 0 is lossless. An error of 4 per 8-bit sample "
        "(range 0 to 255) is hard to see and makes most files about half as large. Integer images "
        "only.",
        basic=True,
    )
    tile: int = option(
        512,
        "Width and height of the tiles into which large levels are cut, for parallel work, "
        "bounded memory and random access; 0 disables tiles.",
        metavar="TEXELS",
    )
    min_side: int = option(
        1,
        "Omit levels whose width or height is below this. Clients can compute them.",
        metavar="TEXELS",
    )
    max_side: int = option(
        0,
        "Omit levels whose width or height is above this; 0 keeps all. Both halve from level to "
        "level, so the finest level kept may be much smaller.",
        metavar="TEXELS",
        basic=True,
    )
    min_level: int = option(
        0,
        "Coarsest level to keep: 0 is the coarsest of all, -1 the finest, -2 the next coarser one. "
        "Images without that level keep the nearest one.",
    )
    max_level: int = option(
        -1,
        "Finest level to keep, numbered in the same way. The levels kept are numbered from 0; "
        "the file records the original size.",
    )

    def __post_init__(self) -> None:
        """Raises InputError PTM-I111 for options that no image can be encoded with."""
        for field in fields(self):
            value = getattr(self, field.name)
            whole = not isinstance(field.default, int) or type(value) is type(field.default)
            require((whole, f"{field.name} is {value!r}", "use a whole number"))
        if self.profile not in PROFILES:
            names = ", ".join(PROFILES)
            require((False, f"there is no profile {self.profile!r}", f"use one of {names}"))
        first, last, (low, high) = self.min_level, self.max_level, TILE_SIDES
        sized = not self.tile or (low <= self.tile <= high and self.tile % 2 == 0)
        require(
            (
                self.min_side >= 1 and self.max_side >= 0,
                "min_side or max_side is impossible",
                "min_side must be at least 1, max_side at least 1 or 0 for no limit",
            ),
            (
                (first < 0) != (last < 0) or first <= last,
                f"there are no levels {first} to {last}",
                "min_level must be the coarser one",
            ),
            (
                sized,
                f"tiles of {self.tile} texels are impossible",
                f"use an even number from {low} to {high}, or 0 for none",
            ),
            (self.max_error >= 0, "max_error is below 0", "use 0 for none"),
        )
        if self.max_error and not PROFILES[self.profile].lossy:
            names = " or ".join(name for name, profile in PROFILES.items() if profile.lossy)
            fault = f"profile {self.profile!r} is always exact"
            require((False, fault, f"for an allowed error use {names}"))


@dataclass(frozen=True)
class Limits:
    """What a decoder accepts, checked against the header before memory is taken.

    Attributes
    ----------
    decoded_bytes: bytes of the finest level asked for, and of what decoding its largest tile takes
        besides (levels that are not cut are one tile).
    """

    decoded_bytes: int = 1 << 30


@dataclass(frozen=True)
class Description:
    """How to display the texels, from the image file; none of it changes a texel.

    Attributes
    ----------
    icc: an ICC profile.
    srgb: rendering intent of sRGB, 0 to 3, as in PNG.
    gamma: gamma of the image times 100,000, as in PNG.
    chromaticities: white, red, green, blue, x and y times 100,000 each, as in PNG.
    orientation: of EXIF, 1 to 8: how the rows as stored are to be shown. 1 is as they are.
    """

    icc: bytes | None = None
    srgb: int | None = None
    gamma: int | None = None
    chromaticities: tuple[int, ...] | None = None
    orientation: int = 1


@dataclass(frozen=True)
class Level:
    """One level and the group that refines the level below to it.

    Attributes
    ----------
    width, height: texels.
    offset, length: the group's bytes in the file.
    crc32: of those bytes (ISO 3309, as in PNG and zip); where there are several tiles, of their
        index, which holds a CRC-32 for each of them.
    tiles: how many tiles it has, across and down.
    gpu_bytes: what the pyramid up to and including this level takes in a client's texture memory,
        at the size of a texel, from the coarsest stored level on.
    """

    width: int
    height: int
    offset: int
    length: int
    crc32: int
    tiles: tuple[int, int]
    gpu_bytes: int

    @property
    def end(self) -> int:
        """Length of the prefix of the file that holds this level and all below it."""
        return self.offset + self.length

    @property
    def box(self) -> Box:
        """All of its texels."""
        return Box(0, 0, self.width, self.height)

    @property
    def tiled(self) -> bool:
        """Whether it has more than one tile."""
        return self.tiles != (1, 1)


def gpu_texel_bytes(texel_bytes: int, components: int) -> int:
    """Bytes of a texel as GPUs hold it: they have no texels of three components, so RGB takes the
    room of RGBA."""
    return texel_bytes * (4 if components == 3 else components) // components


@dataclass(frozen=True)
class PtmHeader:
    """The header and group table of a `.ptm`.

    Attributes
    ----------
    width, height: size of the original image, texels.
    components: 1 grey, 2 grey and alpha (or any two), 3 RGB, 4 RGB and alpha.
    kind: of the samples, one of `ptmtools.texture.samples.KINDS`: the name of a numpy type.
    profile: how the groups are coded, a name in `ptmtools.texture.profiles.PROFILES`.
    version: of the container.
    trimmed: how many of the finest levels of the original were left out on purpose.
    tile: side of the tiles of a level that has several; 0 if none has.
    max_error: as in `EncodeOptions`.
    description: offset, length and CRC-32 of the `Description` in the file.
    levels: from the coarsest, level 0, to the finest stored.
    """

    width: int
    height: int
    components: int
    kind: str
    profile: str
    version: int
    trimmed: int
    tile: int
    max_error: int
    description: tuple[int, int, int]
    levels: tuple[Level, ...]

    @property
    def texel_bytes(self) -> int:
        """Bytes of a texel, decoded."""
        return self.components * KINDS[self.kind].size

    @property
    def file_size(self) -> int:
        """Bytes of the whole file."""
        return self.levels[-1].end
