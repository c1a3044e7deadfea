"""The repeats coder: a group's bytes around the compiled pass (`kernels` says what is coded).

Layout of a coded group: the frequency tables; the stream of `rans.stream`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.damage import damaged
from ptmtools.texture.coders.rans import tables
from ptmtools.texture.coders.rans.stream import encode_symbols, read_stream

if TYPE_CHECKING:
    from ptmtools.texture.coders.repeats.symbols import Source

#: Weights in 1/64 of W, N, NW and NE, each less the block's mean, in predictions of p, q and r.
WEIGHTS = np.array([[20, 24, -10, -7], [2, 27, -12, -2], [13, -7, -6, -39]], np.int64)

#: Slots of a table, at most, in bits. 16 instead of 13: textures of models 2 to 3 % smaller, and
#: half as long again to decode, because the tables do not stay in a core's own cache.
MOST_BITS = 13

#: Activity below which lies class 0, 1, 2 …
CLASS_BOUNDS = (2, 4, 8, 16, 32, 64, 128, 256, 512)

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Symbols:
    """What the pass makes of a group, before it is written.

    Attributes
    ----------
    symbols: (n,) uint16. contexts: (n,) uint8, the table of each.
    counts: (tables, 256) int64, how often each occurs; all above 254 count as 255.
    """

    symbols: NDArray[np.uint16]
    contexts: NDArray[np.uint8]
    counts: NDArray[np.int64]

    @property
    def hits(self) -> int:
        """Blocks that were the first guess."""
        from ptmtools.texture.coders.repeats.symbols import FIRST, GUESS

        return int(self.counts[FIRST:GUESS, 0].sum())

    @property
    def new(self) -> int:
        """Texels that were not among the guesses, of the first three of each block."""
        from ptmtools.texture.coders.repeats.kernels import DIFFERENCES
        from ptmtools.texture.coders.repeats.symbols import GUESS, TEXEL

        blocks = self.counts[GUESS:TEXEL, DIFFERENCES].sum()
        texels = self.counts[TEXEL : TEXEL + 36, 5].sum()
        return int(3 * blocks + texels)


def find(level: Bytes, below: Bytes) -> Symbols:
    """The symbols that refine ``below`` (h >> 1, w >> 1, c) to ``level`` (h, w, c)."""
    from ptmtools.texture.coders.rans.kernels import split_numbers
    from ptmtools.texture.coders.repeats import kernels
    from ptmtools.texture.coders.repeats.symbols import TABLES

    blocks = below.shape[0] * below.shape[1]
    edge = level.shape[0] * level.shape[1] - 4 * blocks
    numbers = np.empty(kernels.MOST_SYMBOLS * blocks + 5 * edge, np.uint32)
    state = np.zeros(9, np.int64)
    _pass(_packed(level), _packed(below), level.shape, numbers, None, state)
    numbers = numbers[: state[4]]
    symbols = np.empty(len(numbers), np.uint16)
    contexts = np.empty(len(numbers), np.uint8)
    counts = np.zeros((TABLES, 256), np.int64)
    split_numbers(numbers, symbols, contexts, counts)
    return Symbols(symbols, contexts, counts)


def write(found: Symbols) -> bytes:
    """The group of these symbols."""
    plain = len(found.counts)
    frequency, packed = tables.choose(found.counts, plain)
    return packed + encode_symbols(found.symbols, found.contexts, frequency, plain)


def decode(data: bytes, below: Bytes, shape: tuple[int, int, int]) -> Bytes:
    """The inverse of `find` and `write`. Raises InputError PTM-I112 for what no encoder writes."""
    from ptmtools.texture.coders.repeats import kernels
    from ptmtools.texture.coders.repeats.symbols import TABLES, Source

    frequency, used = tables.parse(data, TABLES)
    stream = read_stream(memoryview(data)[used:], kernels.MOST_SYMBOLS)
    escaped = len(stream.escapes)
    state = np.zeros(9, np.int64)
    state[7] = escaped
    level = np.empty(shape[:2], np.uint32)
    words = np.concatenate([stream.escapes, stream.words])
    source = Source(tables.single_tables(frequency), words, escaped + stream.limit)
    result = _pass(level, _packed(below), shape, None, source, state)
    if result == kernels.TRUNCATED:
        raise damaged("its stream ends early")
    if result != kernels.OK:
        raise damaged("its stream leads to impossible texels")
    return _unpacked(level, shape[2])


def _pass(
    level: NDArray[np.uint32],
    below: NDArray[np.uint32],
    shape: tuple[int, ...],
    sink: NDArray[np.uint32] | None,
    source: Source | None,
    state: NDArray[np.int64],
) -> int:
    """`kernels.repeats_pass`, with the tables that it fills."""
    from ptmtools.texture.coders.haar.layout import plane_order
    from ptmtools.texture.coders.repeats import kernels

    height, width, components = shape
    bits = min(max(below.size.bit_length(), 6), MOST_BITS)
    return kernels.repeats_pass(
        level.reshape(-1),
        height,
        width,
        below,
        np.array(plane_order(components), np.int64),
        WEIGHTS,
        np.searchsorted(CLASS_BOUNDS, np.arange(1024), side="right").astype(np.uint8),
        np.zeros((5, 1 << bits), np.uint32),
        np.zeros(1 << bits, np.uint32),
        np.zeros(below.shape[1] + 1, np.int64),
        np.zeros(3, np.int64),
        np.uint64(32 - bits),
        sink,
        source,
        state,
    )


def _packed(level: Bytes) -> NDArray[np.uint32]:
    """Texels (h, w, c) as one number each."""
    from ptmtools.texture.coders.repeats import kernels

    texels = np.empty(level.shape[:2], np.uint32)
    kernels.move_texels(True, np.ascontiguousarray(level), texels)
    return texels


def _unpacked(texels: NDArray[np.uint32], components: int) -> Bytes:
    from ptmtools.texture.coders.repeats import kernels

    level = np.empty((*texels.shape, components), np.uint8)
    kernels.move_texels(False, level, texels)
    return level
