"""Encodes an image as a `.ptm` (paper §4).

Memory: the levels below the finest, a third of the image, and a row of tiles. The finest level is
never copied as a whole, so that an image larger than memory can be encoded from a file that is
mapped or read by rows. Levels are written coarse to fine as they are coded; the head, which says
where they are, is written last into the space left for it.

The options decide the levels that the file keeps.
"""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import IO, Any

import numpy as np

from ptmtools.errors import LimitError, OutputError
from ptmtools.options import require
from ptmtools.parallel import map_in_order
from ptmtools.texture.coder import Coder, Coding, Tile
from ptmtools.texture.container import (
    DESCRIPTION_MAX,
    EXACT,
    TILE_ENTRY,
    WITHIN,
    head_size,
    pack_description,
    pack_head,
)
from ptmtools.texture.detail import Detail, LevelPair, compare_levels, detail_of, mean_surplus
from ptmtools.texture.model import Description, EncodeOptions, PtmHeader
from ptmtools.texture.profiles import PROFILES
from ptmtools.texture.pyramid import (
    Box,
    build_pyramid,
    level_sizes,
    mean_below,
    tile_counts,
    tiles_under,
)
from ptmtools.texture.samples import KINDS
from ptmtools.texture.sources import ImageRows, RowSource, Samples


def coder_for(options: EncodeOptions, image: ImageRows) -> Coder:
    """The coder that the options ask for. Raises InputError PTM-I111 if it cannot code the
    image."""
    top = KINDS[image.dtype.name].top_error
    require(
        (
            options.max_error <= top,
            f"an error of {options.max_error} cannot be allowed for {image.dtype.name} samples",
            f"use a number from 0 to {top}" if top else "use 0: floats are kept exactly",
        )
    )
    return PROFILES[options.profile].coder


def kept_levels(width: int, height: int, options: EncodeOptions) -> list[int]:
    """Numbers, in the complete pyramid, of the levels to store; there is always one."""
    sizes = level_sizes(width, height)
    count = len(sizes)

    def number(level: int) -> int:
        return min(max(level + count if level < 0 else level, 0), count - 1)

    last = number(options.max_level)
    first = min(number(options.min_level), last)
    kept = [n for n in range(first, last + 1) if min(sizes[n]) >= options.min_side] or [last]
    small = [n for n in kept if not options.max_side or max(sizes[n]) <= options.max_side]
    return small or kept[:1]


def level_above(header: PtmHeader) -> tuple[int, int, int] | None:
    """Width, height and estimated bytes of the coarsest level above those in the file that was left
    out on purpose, judged by the level below it. None if no level was left out."""
    if not header.trimmed:
        return None
    width, height = level_sizes(header.width, header.height)[-header.trimmed]
    finest = header.levels[-1]
    return width, height, finest.length * width * height // (finest.width * finest.height)


#: A tile below others is coded without error, though one is allowed, if that takes at most this
#: factor more bytes: the tiles above it can then be exact, which takes fewer bytes where an image
#: is flat.
EXACT_FACTOR = 1.2

_DEFAULTS = EncodeOptions()
_PLAIN = Description()


def encode(
    image: RowSource,
    options: EncodeOptions = _DEFAULTS,
    *,
    description: Description = _PLAIN,
    threads: int = 1,
) -> bytes:
    """The bytes of a `.ptm` that holds ``image`` and the levels below it.

    Parameters
    ----------
    image: (h, w) or (h, w, c), rows from the top, 1 to 4 components (grey; grey and alpha; RGB;
        RGB and alpha; or any other meaning), of uint8, uint16, float16 or float32.
    threads: how many work at once on the tiles; the bytes do not depend on it.

    Raises
    ------
    InputError: PTM-I126 another shape or type, PTM-I111 impossible options.
    LimitError: PTM-L104 a side above 65,536 texels.
    """
    buffer = io.BytesIO()
    encode_to(buffer, image, options, description=description, threads=threads)
    return buffer.getvalue()


def encode_to(
    file: IO[bytes],
    image: RowSource,
    options: EncodeOptions = _DEFAULTS,
    *,
    description: Description = _PLAIN,
    threads: int = 1,
) -> Detail:
    """As `encode`, into a file that can seek, from where it stands; returns what its levels show.

    The rows of ``image`` are read twice from top to bottom, a few at a time.

    Raises also OutputError PTM-O002 if the file is open for appending.
    """
    if "a" in str(getattr(file, "mode", "")):
        raise OutputError(
            "PTM-O002",
            "is open for appending, but its head is written last",
            file=str(getattr(file, "name", "")) or None,
            remedy="open it for writing",
        )
    rows = ImageRows(image)
    encoding = _LevelEncoder(coder_for(options, rows), options, threads)
    described = pack_description(description)
    if len(described) > DESCRIPTION_MAX:
        raise LimitError(
            "PTM-L104",
            f"its colour profile has {len(described):,} bytes; {DESCRIPTION_MAX:,} can be kept",
            remedy="leave it out",
        )
    kept = kept_levels(rows.width, rows.height, options)
    start = file.tell()
    file.write(bytes(head_size(len(kept))))
    file.write(described)
    single, tiled, finer = _levels(rows, kept, options.tile)
    beyond = mean_surplus(finer)
    del finer
    tiles = encoding.encode_single([_read_whole(level) for level in single], more=bool(tiled))
    del single
    coarsest, below, memory = tiles[0].texels, tiles[-1].texels, tiles[-1].memory
    above = [compare_levels(tile.texels, under.texels) for under, tile in pairwise(tiles)]
    groups: list[tuple[int, int]] = []
    for tile in tiles:
        file.write(tile.data)
        groups.append((len(tile.data), zlib.crc32(tile.data)))
    del tiles
    while tiled:
        # The finest of them may be the image itself, of which nothing is kept.
        level = tiled.pop(0)
        group, below, pair = encoding.write_tiled(file, level, below, memory, finest=not tiled)
        groups.append(group)
        above.append(pair)
    end = file.tell()
    trimmed = len(level_sizes(rows.width, rows.height)) - 1 - kept[-1]
    file.seek(start)
    file.write(pack_head(rows.shape, rows.dtype.name, options, trimmed, described, groups))
    file.seek(end)
    return detail_of(coarsest, above, beyond)


@dataclass(frozen=True)
class _LevelEncoder:
    """How the levels of one image are coded."""

    coder: Coder
    options: EncodeOptions
    threads: int

    def encode_single(self, levels: list[Samples], more: bool) -> list[Tile]:
        """The levels of one tile each, coarsest first; ``more``: others come after them.

        With an allowed error they are coded with and without it: flat images are smaller without,
        and a level can be exact only if those below it are.
        """
        base = Tile(self.coder.encode_base(levels[0]), levels[0])
        within = self._chain(base, levels[1:], 1.0)
        if not self.options.max_error:
            return within
        exact = self._chain(base, levels[1:], math.inf)
        sizes = [sum(len(tile.data) for tile in tiles) for tiles in (exact, within)]
        return exact if sizes[0] <= (EXACT_FACTOR if more else 1.0) * sizes[1] else within

    def _chain(self, base: Tile, levels: list[Samples], factor: float) -> list[Tile]:
        tiles = [base]
        for level in levels:
            coding = Coding(self.options.max_error, tiles[-1].memory, self.threads)
            tiles.append(self._tile(level, tiles[-1].texels, coding, factor))
        return tiles

    def write_tiled(
        self, file: IO[bytes], level: Samples | ImageRows, below: Samples, memory: Any, finest: bool
    ) -> tuple[tuple[int, int], Samples, LevelPair]:
        """Writes index and tiles of a level of several. Returns length of the group and
        CRC-32 of the index; the texels as a decoder has them, none of the finest level; and how
        they compare with those below (`compare_levels`)."""
        side, coding = self.options.tile, Coding(self.options.max_error, memory)
        height, width = level.shape[:2]
        across, down = tile_counts(width, height, side)
        texels = below[:0]
        if not finest:
            whole = _read_whole(level)
            texels = np.empty_like(whole) if self.options.max_error else whole

        def boxes() -> Iterator[tuple[Box, Samples]]:
            """Each tile, with the row of tiles that it is cut from."""
            for _, box in tiles_under(width, height, side, Box(0, 0, width, height)):
                if box.x0 == 0:
                    strip = level[box.y0 : box.y1]
                yield box, strip

        def code_tile(job: tuple[Box, Samples]) -> tuple[Box, Tile, LevelPair]:
            box, strip = job
            piece = np.ascontiguousarray(strip[:, box.x0 : box.x1])
            under = np.ascontiguousarray(below[box.below.slices])
            tile = self._tile(piece, under, coding, 1.0 if finest else EXACT_FACTOR)
            return box, tile, compare_levels(tile.texels, under)

        start = file.tell()
        file.write(bytes(across * down * TILE_ENTRY.size))
        index, pair = bytearray(), LevelPair(0.0, 0.0, 0, 0)
        for box, tile, more in map_in_order(code_tile, boxes(), self.threads):
            file.write(tile.data)
            index += TILE_ENTRY.pack(len(tile.data), zlib.crc32(tile.data))
            pair += more
            if self.options.max_error and not finest:
                texels[box.slices] = tile.texels
        end = file.tell()
        file.seek(start)
        file.write(index)
        file.seek(end)
        return (end - start, zlib.crc32(index)), texels, pair

    def _tile(self, level: Samples, below: Samples, coding: Coding, factor: float) -> Tile:
        """One tile; with an allowed error, exactly if that takes at most ``factor`` times the
        bytes."""
        encode_tile = self.coder.encode_tile
        if not coding.max_error:
            return encode_tile(level, below, coding)
        # Profiles that know the mean of a block can be exact only where it is the mean.
        exact = None
        if np.array_equal(mean_below(level), below):
            exact = encode_tile(level, below, replace(coding, max_error=0))
            exact = replace(exact, data=bytes([EXACT]) + exact.data)
            if factor == math.inf:
                return exact
        within = encode_tile(level, below, coding)
        if exact and len(exact.data) - 1 <= factor * len(within.data):
            return exact
        return replace(within, data=bytes([WITHIN]) + within.data)


def _levels(
    image: ImageRows, kept: list[int], tile: int
) -> tuple[list[Samples | ImageRows], list[Samples | ImageRows], list[Samples | ImageRows]]:
    """The levels to store, coarsest first: those of one tile, the coarsest always among them, and
    those of several; then the finest to store and all finer ones. The image itself is not read
    into memory for it."""
    sizes = level_sizes(image.width, image.height)
    pyramid = build_pyramid(image, min(sizes[kept[0]]))
    levels: list[Samples | ImageRows] = [pyramid[n - len(sizes)] for n in kept]
    tiled = [tile_counts(*sizes[n], tile) != (1, 1) for n in kept[1:]]
    single = len(kept) - sum(tiled)
    return levels[:single], levels[single:], [*pyramid[kept[-1] - len(sizes) :]]


def _read_whole(level: Samples | ImageRows) -> Samples:
    return level[0 : level.shape[0]]
