"""An image becomes a `.ptm` (paper §4).

Memory: the levels below the finest, a third of the image, and a row of tiles. The finest level is
never copied as a whole, so that an image larger than memory can be encoded from a file that is
mapped or read by rows. Levels are written coarse to fine as they are coded; the head, which says
where they are, is written last into the space left for it.
"""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Iterator
from dataclasses import replace
from typing import IO, TYPE_CHECKING, Any

from ptmtools.errors import LimitError, OutputError
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
    Description,
    EncodeOptions,
)
from ptmtools.texture.options import checked_profile, kept_levels
from ptmtools.texture.parallel import ordered
from ptmtools.texture.profiles import Profile, Tile
from ptmtools.texture.pyramid import build_pyramid, level_sizes, mean_below
from ptmtools.texture.rows import ImageRows, Rows
from ptmtools.texture.tiling import Box, tile_box, tile_counts

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Samples = NDArray[Any]

#: A tile below others is coded without error, though one is allowed, if that takes at most so many
#: times the bytes: it lets those above it be exact, which takes fewer where an image is flat.
EXACT_FACTOR = 1.2

_DEFAULTS = EncodeOptions()
_PLAIN = Description()


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

    Raises also OutputError PTM-O004 if the file is open for appending.
    """
    if "a" in str(getattr(file, "mode", "")):
        raise OutputError(
            "PTM-O004",
            "is open for appending, but its head is written last",
            file=str(getattr(file, "name", "")) or None,
            remedy="open it for writing",
        )
    rows = ImageRows(image)
    profile = checked_profile(options, rows)
    described = pack_description(description)
    if len(described) > DESCRIPTION_MAX:
        raise LimitError(
            "PTM-L105",
            f"its colour profile has {len(described):,} bytes; {DESCRIPTION_MAX:,} can be kept",
            remedy="leave it out",
        )
    kept = kept_levels(rows.width, rows.height, options)
    sizes = level_sizes(rows.width, rows.height)
    trimmed = len(sizes) - 1 - kept[-1]
    levels = _levels(rows, sizes, kept)
    start = file.tell()
    file.write(bytes(head_size(len(kept))))
    file.write(described)
    groups: list[tuple[int, int]] = []
    whole, tiled = _split(levels, options.tile)
    del levels
    base = _whole(whole.pop(0))
    below, memory = base, None
    single = [Tile(profile.encode_base(base), base)]
    if whole:
        single += _single(profile, options, base, whole, bool(tiled), threads)
        below, memory = single[-1].texels, single[-1].memory
    for tile in single:
        file.write(tile.data)
        groups.append((len(tile.data), zlib.crc32(tile.data)))
    del whole, single, base
    while tiled:
        # The finest of them may be the image itself, of which nothing is kept.
        made = _Tiled(profile, options, tiled.pop(0), below, memory, finest=not tiled)
        groups.append(made.write(file, threads))
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


class _Tiled:
    """One level of several tiles: its group, and its texels as a decoder has them."""

    def __init__(
        self,
        profile: Profile,
        options: EncodeOptions,
        level: Samples | ImageRows,
        below: Samples,
        memory: object,
        finest: bool,
    ) -> None:
        self._profile = profile
        self._options = options
        self._level = level
        self._below = below
        self._memory = memory
        height, width = level.shape[:2]
        self._size = width, height
        self._counts = tile_counts(width, height, options.tile)
        self._finest = finest
        #: What the next level needs; nothing of the finest is kept.
        self.texels: Samples = below[:0]

    def write(self, file: IO[bytes], threads: int) -> tuple[int, int]:
        """Writes index and tiles; length of the group and CRC-32 of the index."""
        import numpy as np

        if not self._finest:
            changed = self._options.max_error > 0
            whole = _whole(self._level)
            self.texels = np.empty_like(whole) if changed else whole
        start = file.tell()
        across, down = self._counts
        file.write(bytes(across * down * TILE_ENTRY.size))
        index = bytearray()
        for box, tile in ordered(self._coded, self._boxes(), threads):
            file.write(tile.data)
            index += TILE_ENTRY.pack(len(tile.data), zlib.crc32(tile.data))
            if self._options.max_error and not self._finest:
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
        factor = 1.0 if self._finest else EXACT_FACTOR
        return box, _code(self._profile, self._options, level, below, self._memory, factor)


def _single(
    profile: Profile,
    options: EncodeOptions,
    base: Samples,
    levels: list[Samples | ImageRows],
    more: bool,
    threads: int,
) -> list[Tile]:
    """The levels of one tile each, from the one above ``base``; ``more``: others come after them.

    With an allowed error they are coded with and without it: flat images are smaller without, and a
    level can be exact only if those below it are.
    """

    def chain(factor: float) -> list[Tile]:
        tiles: list[Tile] = []
        below, memory = base, None
        for level in levels:
            tile = _code(profile, options, _whole(level), below, memory, factor, threads)
            tiles.append(tile)
            below, memory = tile.texels, tile.memory
        return tiles

    within = chain(1.0)
    if not options.max_error:
        return within
    exact = chain(math.inf)
    sizes = [sum(len(tile.data) for tile in tiles) for tiles in (exact, within)]
    return exact if sizes[0] <= (EXACT_FACTOR if more else 1.0) * sizes[1] else within


def _code(
    profile: Profile,
    options: EncodeOptions,
    level: Samples,
    below: Samples,
    memory: object,
    factor: float,
    threads: int = 1,
) -> Tile:
    """One tile; with an allowed error, exactly if that takes at most ``factor`` times the bytes."""
    if not options.max_error:
        return profile.encode_tile(level, below, 0, memory, threads)
    import numpy as np

    # Profiles that know the mean of a block can be exact only where it is the mean.
    exact = None
    if np.array_equal(mean_below(level), below):
        exact = profile.encode_tile(level, below, 0, memory, threads)
        if factor == math.inf:
            return replace(exact, data=bytes([EXACT]) + exact.data)
    within = profile.encode_tile(level, below, options.max_error, memory, threads)
    if exact is not None and len(exact.data) <= factor * len(within.data):
        return replace(exact, data=bytes([EXACT]) + exact.data)
    return replace(within, data=bytes([WITHIN]) + within.data)


def _levels(
    image: ImageRows, sizes: list[tuple[int, int]], kept: list[int]
) -> list[Samples | ImageRows]:
    """The levels to store, coarsest first; the image itself is not read into memory for it."""
    if len(sizes) == 1:
        return [image]
    pyramid: list[Samples | ImageRows] = [
        *build_pyramid(image, min(sizes[kept[0]]))[:-1],
        image,
    ]
    coarsest = len(sizes) - len(pyramid)
    return [pyramid[n - coarsest] for n in kept]


def _split(
    levels: list[Samples | ImageRows], tile: int
) -> tuple[list[Samples | ImageRows], list[Samples | ImageRows]]:
    """Levels of one tile, the coarsest always among them, and levels of several."""
    count = 1
    while count < len(levels):
        height, width = levels[count].shape[:2]
        if tile_counts(width, height, tile) != (1, 1):
            break
        count += 1
    return levels[:count], levels[count:]


def _whole(level: Samples | ImageRows) -> Samples:
    return level[0 : level.shape[0]]
