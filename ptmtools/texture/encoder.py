"""An image becomes a `.ptm` (paper §4).

Memory: the levels below the finest, a third of the image, and a row of tiles. The finest level is
never copied as a whole, so that an image larger than memory can be encoded from a file that is
mapped or read by rows. Levels are written coarse to fine as they are coded; the head, which says
where they are, is written last into the space left for it.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Iterator
from dataclasses import replace
from typing import IO, TYPE_CHECKING, Any, Protocol

from ptmtools.errors import InputError, LimitError
from ptmtools.texture.container import (
    DESCRIPTION_MAX,
    EXACT,
    TILE_ENTRY,
    WITHIN,
    Head,
    head_size,
    pack_head,
)
from ptmtools.texture.description import pack_description
from ptmtools.texture.model import (
    MAX_COMPONENTS,
    MAX_SIDE,
    TILE_SIDES,
    Description,
    EncodeOptions,
)
from ptmtools.texture.parallel import ordered
from ptmtools.texture.profiles import PROFILE_NUMBERS, Profile, Tile, profile_named
from ptmtools.texture.pyramid import build_pyramid, level_sizes, mean_below
from ptmtools.texture.samples import KINDS
from ptmtools.texture.tiling import Box, tile_box, tile_counts

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Samples = NDArray[Any]

#: A tile is coded without error, though one is allowed, if that takes at most so many times the
#: bytes, and so many more: flat images take fewer at the fine levels, which can be exact only if
#: those below them are.
EXACT_FACTOR, EXACT_MORE = 1.2, 32

_DEFAULTS = EncodeOptions()
_PLAIN = Description()


class Rows(Protocol):
    """An image whose rows can be had: an array, a memory map, or what reads them from a file."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(h, w) or (h, w, c)."""

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of the samples."""

    def __getitem__(self, rows: slice, /) -> Samples:
        """Those rows, (n, w) or (n, w, c)."""


def encode(
    image: Rows,
    options: EncodeOptions = _DEFAULTS,
    *,
    description: Description = _PLAIN,
    threads: int = 1,
) -> bytes:
    """The bytes of a `.ptm` that holds ``image`` and the levels below it.

    Parameters
    ----------
    image: (h, w) or (h, w, c), rows from the top, 1 to 4 components (grey; grey and alpha; RGB;
        RGB and alpha; or whatever else), of uint8, uint16, float16 or float32.
    threads: how many work at once on the tiles; the bytes do not depend on it.

    Raises
    ------
    InputError: PTM-I110 another shape or type, PTM-I111 impossible options.
    LimitError: PTM-L102 a side above 65,536 texels.
    """
    buffer = io.BytesIO()
    encode_to(buffer, image, options, description=description, threads=threads)
    return buffer.getvalue()


def encode_to(
    file: IO[bytes],
    image: Rows,
    options: EncodeOptions = _DEFAULTS,
    *,
    description: Description = _PLAIN,
    threads: int = 1,
) -> None:
    """As `encode`, into a file that can seek, from where it stands.

    The rows of ``image`` are read twice from top to bottom, a few at a time.
    """
    rows = _Image(image)
    profile = _checked(options, rows)
    described = pack_description(description)
    if len(described) > DESCRIPTION_MAX:
        raise LimitError(
            "PTM-L105",
            f"its colour profile has {len(described):,} bytes; {DESCRIPTION_MAX:,} can be kept",
            remedy="leave it out",
        )
    kept = _kept_levels(rows.width, rows.height, options)
    sizes = level_sizes(rows.width, rows.height)
    trimmed = len(sizes) - 1 - kept[-1]
    levels = _levels(rows, sizes, kept)
    start = file.tell()
    file.write(bytes(head_size(len(kept))))
    file.write(described)
    groups: list[tuple[int, int]] = []
    below: Samples | None = None
    memory = None
    while levels:
        # The finest of them may be the image itself, of which nothing is kept.
        level = levels.pop(0)
        finest = not levels
        if below is None:
            base = _whole(level)
            group = profile.encode_base(base)
            file.write(group)
            groups.append((len(group), zlib.crc32(group)))
            below = base
            continue
        across, down = tile_counts(level.shape[1], level.shape[0], options.tile)
        if (across, down) == (1, 1):
            tile = _code(profile, options, _whole(level), below, memory, threads)
            memory = tile.memory
            file.write(tile.data)
            groups.append((len(tile.data), zlib.crc32(tile.data)))
            below = tile.texels
        else:
            made = _Tiled(profile, options, level, below, memory)
            groups.append(made.write(file, threads, keep=not finest))
            below = made.texels
    end = file.tell()
    head = Head(
        rows.width,
        rows.height,
        rows.components,
        rows.dtype.name,
        options.profile,
        trimmed,
        options.tile,
        options.max_error,
    )
    file.seek(start)
    file.write(pack_head(head, described, groups))
    file.seek(end)


class _Image:
    """The image as (h, w, c) rows of a native dtype. Raises InputError PTM-I110."""

    def __init__(self, image: Rows) -> None:
        import numpy as np

        self._rows = image
        shape, dtype = tuple(image.shape), np.dtype(image.dtype)
        fits = len(shape) in (2, 3) and 0 not in shape and dtype.name in KINDS
        self.height, self.width, self.components = (*shape, 1)[:3] if fits else (0, 0, 0)
        if not fits or self.components > MAX_COMPONENTS:
            raise InputError(
                "PTM-I110",
                f"an array of shape {shape} and type {dtype} is not an image",
                remedy="it must be (height, width) or (height, width, 1 to 4) of "
                f"{', '.join(KINDS)}, and not empty",
            )
        if max(self.width, self.height) > MAX_SIDE:
            raise LimitError(
                "PTM-L102",
                f"the image is {self.width} x {self.height} texels; the format allows {MAX_SIDE} "
                "a side",
                remedy="scale it down",
            )
        self.dtype = dtype.newbyteorder("=")
        self.shape = (self.height, self.width, self.components)

    def __getitem__(self, rows: slice) -> Samples:
        import numpy as np

        part = np.asarray(self._rows[rows])
        # The kernels are compiled for writable, contiguous arrays only.
        return np.require(
            part.reshape(-1, self.width, self.components), self.dtype, requirements=["C", "W"]
        )


class _Tiled:
    """One level of several tiles: its group, and its texels as a decoder has them."""

    def __init__(
        self,
        profile: Profile,
        options: EncodeOptions,
        level: Samples | _Image,
        below: Samples,
        memory: object,
    ) -> None:
        self._profile = profile
        self._options = options
        self._level = level
        self._below = below
        self._memory = memory
        height, width = level.shape[:2]
        self._size = width, height
        self._counts = tile_counts(width, height, options.tile)
        self.texels: Samples | None = None

    def write(self, file: IO[bytes], threads: int, keep: bool) -> tuple[int, int]:
        """Writes index and tiles; length of the group and CRC-32 of the index.

        ``keep``: the next level needs ``texels``.
        """
        import numpy as np

        if keep and not self._options.max_error:
            assert not isinstance(self._level, _Image)
            self.texels = self._level
        elif keep:
            self.texels = np.empty(self._level.shape, self._level.dtype)
        start = file.tell()
        across, down = self._counts
        file.write(bytes(across * down * TILE_ENTRY.size))
        index = bytearray()
        for box, tile in ordered(self._coded, self._boxes(), threads):
            file.write(tile.data)
            index += TILE_ENTRY.pack(len(tile.data), zlib.crc32(tile.data))
            if self.texels is not None and self._options.max_error:
                self.texels[box.slices] = tile.texels
        end = file.tell()
        file.seek(start)
        file.write(index)
        file.seek(end)
        return end - start, zlib.crc32(index)

    def _boxes(self) -> Iterator[tuple[Box, Samples]]:
        """Each tile, with the row of tiles that it is cut from."""
        across, down = self._counts
        for row in range(down):
            strip = None
            for column in range(across):
                box = tile_box(*self._size, self._options.tile, column, row)
                if strip is None:
                    strip = self._level[box.y0 : box.y1]
                yield box, strip

    def _coded(self, job: tuple[Box, Samples]) -> tuple[Box, Any]:
        import numpy as np

        box, strip = job
        level = np.ascontiguousarray(strip[:, box.x0 : box.x1])
        below = np.ascontiguousarray(self._below[box.below.slices])
        return box, _code(self._profile, self._options, level, below, self._memory)


def _code(
    profile: Profile,
    options: EncodeOptions,
    level: Samples,
    below: Samples,
    memory: object,
    threads: int = 1,
) -> Tile:
    """One tile; with an allowed error, exactly if that takes hardly more bytes than with it."""
    if not options.max_error:
        return profile.encode_tile(level, below, 0, memory, threads)
    import numpy as np

    within = profile.encode_tile(level, below, options.max_error, memory, threads)
    # Profiles that know the mean of a block can be exact only where it is the mean.
    if np.array_equal(mean_below(level), below):
        exact = profile.encode_tile(level, below, 0, memory, threads)
        if len(exact.data) <= EXACT_FACTOR * len(within.data) + EXACT_MORE:
            return replace(exact, data=bytes([EXACT]) + exact.data)
    return replace(within, data=bytes([WITHIN]) + within.data)


def check_options(options: EncodeOptions) -> None:
    """Raises InputError PTM-I111 for what no image can be encoded with."""
    if options.profile not in PROFILE_NUMBERS:
        raise _impossible(
            f"there is no profile {options.profile!r}", f"use one of {', '.join(PROFILE_NUMBERS)}"
        )
    if options.min_side < 1 or options.max_side < 0:
        raise _impossible(
            "the least or largest side of a level is impossible",
            "min_side must be at least 1; max_side at least 1, or 0 for no limit",
        )
    first, last = options.min_level, options.max_level
    if (first < 0) == (last < 0) and first > last:
        raise _impossible(f"levels {first} to {last} are none", "min_level is the coarser one")
    low, high = TILE_SIDES
    if options.tile and not (low <= options.tile <= high and options.tile % 2 == 0):
        raise _impossible(
            f"tiles of {options.tile} texels are impossible",
            f"use an even number from {low} to {high}, or 0 for none",
        )
    if options.max_error < 0:
        raise _impossible("an error below 0 is impossible", "use 0 for none")
    if options.max_error and options.profile in ("raw", "paper"):
        raise _impossible(
            f"profile {options.profile!r} is always exact", "use fast or small with an error"
        )


def _checked(options: EncodeOptions, image: _Image) -> Profile:
    """The profile of the options. Raises InputError PTM-I111 for what cannot be."""
    check_options(options)
    top = KINDS[image.dtype.name].top_error
    if options.max_error > top:
        raise _impossible(
            f"an error of {options.max_error} cannot be allowed for {image.dtype.name} samples",
            f"use a number from 0 to {top}" if top else "use 0: floats are kept exactly",
        )
    return profile_named(options.profile)


def _impossible(what: str, remedy: str) -> InputError:
    return InputError("PTM-I111", what, remedy=remedy)


def _kept_levels(width: int, height: int, options: EncodeOptions) -> list[int]:
    """Numbers, in the complete pyramid, of the levels to store; there is always one."""
    sizes = level_sizes(width, height)
    count = len(sizes)

    def number(asked: int) -> int:
        return min(max(asked + count if asked < 0 else asked, 0), count - 1)

    last = number(options.max_level)
    first = min(number(options.min_level), last)
    kept = [n for n in range(first, last + 1) if min(sizes[n]) >= options.min_side] or [last]
    small = [n for n in kept if not options.max_side or max(sizes[n]) <= options.max_side]
    return small or kept[:1]


def _levels(image: _Image, sizes: list[tuple[int, int]], kept: list[int]) -> list[Samples | _Image]:
    """The levels to store, coarsest first; the image itself is not read into memory for it."""
    if len(sizes) == 1:
        return [image]
    pyramid: list[Samples | _Image] = [
        *build_pyramid(image, min(sizes[kept[0]]))[:-1],
        image,
    ]
    coarsest = len(sizes) - len(pyramid)
    return [pyramid[n - coarsest] for n in kept]


def _whole(level: Samples | _Image) -> Samples:
    return level[0 : level.shape[0]]
