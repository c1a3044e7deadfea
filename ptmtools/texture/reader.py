"""Reads the levels of a `.ptm`, coarse to fine, and no more of the file than they need.

Of a tiled level only the tiles that are asked for are read and decoded, and of the levels below it
only what lies under those: a window of a level costs about its own size, whatever the level's.

`decode` and `check` take a whole `.ptm` in one call.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError, naming
from ptmtools.parallel import map_in_order
from ptmtools.texture.coder import Coder, Coding, Shape, Tile
from ptmtools.texture.coders.group import group_error
from ptmtools.texture.container import (
    EXACT,
    HEAD_MAX,
    TILE_ENTRY,
    WITHIN,
    parse_description,
    read_header,
    whole_levels,
)
from ptmtools.texture.model import Description, Level, Limits, PtmHeader
from ptmtools.texture.profiles import PROFILES
from ptmtools.texture.pyramid import Box, covering_box, tiles_under
from ptmtools.texture.sources import PtmSource, Ranges, ranges_of

Samples = NDArray[Any]
_LIMITS = Limits()
#: Bytes that decoding a tile takes for each of its samples, besides the level: at most, where
#: samples are of 8 bits without an error, and otherwise (numbers of 32 and 64 bits).
PLAIN_WORK, WORK = 10, 33


def open(source: PtmSource, *, limits: Limits = _LIMITS, threads: int = 1) -> PtmReader:
    """Opens a `.ptm` to take levels from; reads only its head.

    Parameters
    ----------
    source: a path; bytes; an open file (read from its beginning, not closed); or a function
        ``read(offset, length)`` that gives that range of the file, shorter only where it ends.
    threads: how many work at once on the tiles of a level. A function is then called from several.

    Raises
    ------
    InputError: PTM-I120, PTM-I122 for a path; those of `read_header`.
    LimitError: those of `read_header`.
    """
    ranges = ranges_of(source)
    try:
        with naming(ranges.name):
            return PtmReader(ranges, limits, threads)
    except BaseException:
        ranges.close()
        raise


class PtmReader:
    """An open `.ptm`; see `open`. Use it in a ``with``, or call `close`.

    Damage is never passed over: a group whose checksum is wrong is an error.
    """

    def __init__(self, ranges: Ranges, limits: Limits, threads: int) -> None:
        self._ranges = ranges
        self._limits = limits
        self._threads = threads
        #: Where the file ends, once a source of unknown size has come to its end.
        self._end: int | None = None
        self.header: PtmHeader = read_header(ranges.read(0, HEAD_MAX))

    @property
    def _coder(self) -> Coder:
        return PROFILES[self.header.profile].coder

    def __enter__(self) -> PtmReader:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file, if `open` opened it."""
        self._ranges.close()

    @property
    def dtype(self) -> np.dtype[Any]:
        """The numpy type of the samples."""
        return np.dtype(self.header.kind)

    @property
    def whole(self) -> int:
        """Number of whole levels, judged by the length of the file."""
        size = self._size
        return len(self.header.levels) if size is None else whole_levels(self.header, size)

    @property
    def _size(self) -> int | None:
        size = self._ranges.size()
        return self._end if size is None else size

    def description(self) -> Description:
        """Colour and orientation. Raises InputError PTM-I103, PTM-I108, PTM-I105."""
        offset, length, crc32 = self.header.description
        with naming(self._ranges.name):
            return parse_description(self._read_checked(offset, length, crc32, "description"))

    def level(self, number: int | None = None) -> Samples:
        """Level ``number``, (h, w, c), rows from the top; None is the finest that is whole.

        Raises
        ------
        InputError: PTM-I111 no such level, PTM-I103 the level is not whole in the file (the
            message names the last one that is), PTM-I108 wrong checksum, PTM-I112 a group that no
            encoder writes.
        LimitError: PTM-L103 the level is larger than the limits allow.
        """
        with naming(self._ranges.name):
            while True:
                chosen = self._number(number)
                try:
                    return self._window(chosen, self.header.levels[chosen].box)
                except InputError:
                    # A source of unknown size may have ended: fewer levels are whole.
                    if number is not None or chosen < self.whole:
                        raise

    def window(self, number: int, x: int, y: int, width: int, height: int) -> Samples:
        """The texels (height, width, c) of a level from column ``x`` and row ``y`` on.

        Raises as `level`; InputError PTM-I111 also where the window leaves the level. The limit is
        that of the window.
        """
        with naming(self._ranges.name):
            box = Box(x, y, x + width, y + height)
            return self._window(self._number(number, box), box)

    def levels(self) -> Iterator[Samples]:
        """All whole levels, coarsest first, each decoded once: as `level` of each."""
        with naming(self._ranges.name):
            whole = self.whole
            if whole:
                self._check_limit(whole - 1, self.header.levels[whole - 1].box)
            state = None
            for number in range(whole):
                try:
                    state = self._step(number, self.header.levels[number].box, state)
                except InputError:
                    if number >= self.whole:
                        return
                    raise
                yield state.texels

    def wrong_checksums(self) -> list[str]:
        """One line for every whole level or tile whose checksum is wrong; nothing is decoded."""
        wrong = []
        for number in range(self.whole):
            level = self.header.levels[number]
            pieces = [(level.offset, level.length, level.crc32, f"level {number}")]
            if level.tiled:
                try:
                    index = self._index(level, f"level {number}")
                except InputError as error:
                    wrong.append(str(error))
                    continue
                pieces = [
                    (*piece, f"level {number}, tile {i}") for i, piece in enumerate(index.tolist())
                ]
            for offset, length, crc32, place in pieces:
                try:
                    self._read_checked(offset, length, crc32, place)
                except InputError as error:
                    wrong.append(str(error))
        return wrong

    def _number(self, number: int | None, window: Box | None = None) -> int:
        """The number of a level that may be decoded. Raises as `level`."""
        header = self.header
        whole = self.whole
        if number is None:
            # Nothing whole: asking for level 0 gives the error for that.
            number = max(0, whole - 1)
        if not 0 <= number < len(header.levels):
            raise InputError(
                "PTM-I111",
                f"there is no level {number}",
                place=f"level {number}",
                remedy=f"it has levels 0 to {len(header.levels) - 1}",
            )
        level = header.levels[number]
        box = window or level.box
        if not (0 <= box.x0 < box.x1 <= level.width and 0 <= box.y0 < box.y1 <= level.height):
            raise InputError(
                "PTM-I111",
                f"columns {box.x0} to {box.x1} and rows {box.y0} to {box.y1} are not within it",
                place=f"level {number}",
                remedy=f"it is {level.width} x {level.height} texels",
            )
        if number >= whole:
            raise self._cut_error(f"level {number}", whole)
        return number

    def _window(self, number: int, box: Box) -> Samples:
        """A rectangle of a level, by way of those under it."""
        boxes = [box]
        for n in range(number, -1, -1):
            level = self.header.levels[n]
            side = self.header.tile if level.tiled else 0
            covered = covering_box(level.width, level.height, side, boxes[-1])
            self._check_limit(n, covered)
            boxes.append(covered.below)
        boxes.pop()
        state = None
        for n, part in enumerate(reversed(boxes)):
            state = self._step(n, part, state)
        assert state is not None
        return state.texels

    def _check_limit(self, number: int, box: Box) -> None:
        """Counts the texels and the memory that decoding them a tile at a time takes besides."""
        header, level = self.header, self.header.levels[number]
        width, height, limit = box.x1 - box.x0, box.y1 - box.y0, self._limits.decoded_bytes
        tile = 4 * header.tile**2 if level.tiled else level.width * level.height
        plain = self.dtype.itemsize == 1 and not header.max_error
        working = (PLAIN_WORK if plain else WORK) * header.components * min(tile, width * height)
        needed = width * height * header.texel_bytes + working
        if needed > limit:
            raise LimitError(
                "PTM-L103",
                f"{width} x {height} texels of {header.texel_bytes} bytes take "
                f"up to {needed} bytes to decode, more than the limit of {limit}",
                place=f"level {number}",
                remedy="choose a coarser level, or raise the limit (--limit)",
            )

    def _step(self, number: int, box: Box, below: _State | None) -> _State:
        """The texels of a level within ``box``, given at least the texels under its tiles."""
        header, level = self.header, self.header.levels[number]
        shape = (level.height, level.width, header.components)
        place = f"level {number}"
        if below is None or not level.tiled:
            data = self._read_checked(level.offset, level.length, level.crc32, place)
            with naming(place=place):
                if below is None:
                    tile = Tile(b"", self._coder.decode_base(data, shape, self.dtype))
                else:
                    coding = Coding(header.max_error, below.memory, self._threads)
                    tile = self._decode(data, below.texels, shape, coding)
            return _State(tile.texels[box.slices], box, tile.memory)
        index, coding = self._index(level, place), Coding(header.max_error, below.memory)
        texels = np.empty((box.y1 - box.y0, box.x1 - box.x0, header.components), self.dtype)

        def decode_tile(job: tuple[int, Box]) -> tuple[Box, Samples]:
            tile_number, area = job
            where = f"{place}, tile {tile_number}"
            under = np.ascontiguousarray(below.texels[area.below.relative_to(below.box).slices])
            offset, length, crc32 = index[tile_number].tolist()
            data = self._read_checked(offset, length, crc32, where)
            size = (area.y1 - area.y0, area.x1 - area.x0, header.components)
            with naming(place=where):
                tile = self._decode(data, under, size, coding)
            return area, tile.texels

        jobs = tiles_under(level.width, level.height, header.tile, box)
        for area, part in map_in_order(decode_tile, jobs, self._threads):
            shared = Box(
                max(area.x0, box.x0),
                max(area.y0, box.y0),
                min(area.x1, box.x1),
                min(area.y1, box.y1),
            )
            texels[shared.relative_to(box).slices] = part[shared.relative_to(area).slices]
        return _State(texels, box, below.memory)

    def _decode(self, data: bytes, below: Samples, shape: Shape, coding: Coding) -> Tile:
        """Decodes one tile, after the byte that says whether it uses an allowed error."""
        if coding.max_error:
            if data[:1] == bytes([EXACT]):
                coding = replace(coding, max_error=0)
            elif data[:1] != bytes([WITHIN]):
                raise group_error("it is neither exact nor within the error")
            data = data[1:]
        return self._coder.decode_tile(data, below, shape, coding)

    def _index(self, level: Level, place: str) -> NDArray[np.int64]:
        """Offset, length and CRC-32 (n, 3) of every tile of a level."""
        size = level.tiles[0] * level.tiles[1] * TILE_ENTRY.size
        if size <= level.length:
            data = self._read_checked(level.offset, size, level.crc32, place)
            entries = np.frombuffer(data, "<u4").reshape(-1, 2).astype(np.int64)
            ends = level.offset + size + np.cumsum(entries[:, 0])
            if ends[-1] == level.end:
                return np.column_stack([ends - entries[:, 0], entries])
        raise InputError(
            "PTM-I112",
            "the index of its tiles contradicts its length",
            place=place,
            remedy="the file is damaged or its encoder does not conform; encode it again",
        )

    def _read_checked(self, offset: int, length: int, crc32: int, place: str) -> bytes:
        data = self._ranges.read(offset, length)
        if len(data) < length:
            self._end = offset + len(data)
            raise self._cut_error(place)
        if zlib.crc32(data) != crc32:
            raise InputError(
                "PTM-I108",
                "the checksum is wrong",
                place=place,
                remedy="the file is damaged, but coarser levels may be intact; download or "
                "encode it again",
            )
        return data

    def _cut_error(self, place: str, whole: int | None = None) -> InputError:
        size = self._size
        extent = f" after {size} of {self.header.file_size} bytes" if size is not None else ""
        remedy = None
        if whole is not None:
            remedy = f"the last whole level is {whole - 1}" if whole else "no level is complete"
        return InputError(
            "PTM-I103", f"is cut{extent}, inside or before this", place=place, remedy=remedy
        )


@dataclass(frozen=True)
class _State:
    """The state of decoding: a rectangle of a level, and what the profile has learned."""

    texels: Samples
    box: Box
    memory: Any


def decode(
    source: PtmSource, level: int | None = None, limits: Limits = _LIMITS, *, threads: int = 1
) -> NDArray[Any]:
    """Level ``level`` of a `.ptm`: (h, w, c) of its kind, rows from the top.

    ``level`` None is the finest level that is whole: of a complete file the finest, of a file cut
    short the finest before the cut. Damage is never passed over: a group whose checksum is wrong
    is an error, even if coarser levels could be decoded by naming them.

    Raises InputError and LimitError: those of `ptmtools.texture.open` and `PtmReader.level`.
    """
    with open(source, limits=limits, threads=threads) as ptm:
        return ptm.level(level)


def decode_levels(
    source: PtmSource, limits: Limits = _LIMITS, *, threads: int = 1
) -> Iterator[NDArray[Any]]:
    """All whole levels of a `.ptm`, coarsest first, each decoded once: as `decode` of each.

    Stops where the file is cut. Raises as `decode`, when the level in question comes up; the
    limit is that of the finest whole level.
    """
    with open(source, limits=limits, threads=threads) as ptm:
        yield from ptm.levels()


def check(data: bytes, limits: Limits = _LIMITS) -> list[str]:
    """The faults of a `.ptm`, one line each; empty if it is intact.

    Decodes every level, which also detects a group with a correct checksum and wrong contents.
    """
    try:
        return faults_of(data, limits)
    except LimitError as error:
        return [str(error)]


def faults_of(data: bytes, limits: Limits = _LIMITS) -> list[str]:
    """The faults as `check`.

    Raises LimitError, those of `ptmtools.texture.open` and `PtmReader.level`: nothing is wrong as
    far as the checksums tell.
    """
    problems: list[str] = []
    try:
        with open(data, limits=limits) as ptm:
            header = ptm.header
            whole = whole_levels(header, len(data))
            if whole < len(header.levels):
                what = f"the last whole level is {whole - 1}" if whole else "no level is complete"
                problems.append(f"cut after {len(data)} of {header.file_size} bytes: {what}")
            if len(data) > header.file_size:
                problems.append(f"{len(data) - header.file_size} bytes after the last group")
            problems += ptm.wrong_checksums()
            if not problems:
                ptm.description()
                for _ in ptm.levels():
                    pass
    except LimitError:
        raise
    except InputError as error:
        problems.append(str(error))
    return problems
