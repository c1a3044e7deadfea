"""What a `.ptm` holds: options, header, levels, limits. Plain values; nothing heavy is imported."""

from __future__ import annotations

from dataclasses import dataclass

#: Longest side of an image, texels.
MAX_SIDE = 1 << 16
#: Largest number of levels: a side of 2^16 halves 16 times.
MAX_LEVELS = 17
MAX_COMPONENTS = 4


@dataclass(frozen=True)
class EncodeOptions:
    """How an image is encoded.

    Attributes
    ----------
    profile: "fast" (compressed) or "raw" (the paper's layout, §4.3).
    min_side: levels go down to the last one whose shorter side is at least this, texels. 1 stores
        every level; a client computes the missing ones with the 2×2 mean.
    max_side: levels whose longer side is above this are left out; None keeps all of them. The
        levels are renumbered from 0 and the header keeps the original size.
    """

    profile: str = "fast"
    min_side: int = 1
    max_side: int | None = None


@dataclass(frozen=True)
class Limits:
    """What a decoder accepts, checked against the header before memory is taken.

    Attributes
    ----------
    decoded_bytes: size of the finest level asked for, bytes.
    """

    decoded_bytes: int = 1 << 30


@dataclass(frozen=True)
class Level:
    """One level and the group that refines the level below to it.

    Attributes
    ----------
    width, height: texels.
    offset, length: the group's bytes in the file.
    crc32: of those bytes (ISO 3309, as in PNG and zip).
    gpu_bytes: what the pyramid up to and including this level takes in a client's texture memory,
        at ``components`` bytes a texel, from the coarsest stored level on.
    """

    width: int
    height: int
    offset: int
    length: int
    crc32: int
    gpu_bytes: int

    @property
    def end(self) -> int:
        """Length of the prefix of the file that holds this level and all below it."""
        return self.offset + self.length


@dataclass(frozen=True)
class PtmHeader:
    """The header and group table of a `.ptm`.

    Attributes
    ----------
    width, height: size of the original image, texels.
    components: 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha.
    kind: type of a component: "uint8".
    profile: how the groups are coded: "raw", "fast".
    version: of the container.
    trimmed: how many of the finest levels of the original were left out on purpose.
    levels: from the coarsest, level 0, to the finest stored.
    """

    width: int
    height: int
    components: int
    kind: str
    profile: str
    version: int
    trimmed: int
    levels: tuple[Level, ...]

    @property
    def file_size(self) -> int:
        """Bytes of the whole file."""
        return self.levels[-1].end
