"""The repeats coder: a group's bytes around the compiled pass (see `repeats_kernels`).

Layout of a coded group: the frequency tables; the stream of `rans`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coder import Data, Shape
from ptmtools.texture.coders import (
    rans as tables,
    repeats_blocks as blocks,
    repeats_kernels as kernels,
)
from ptmtools.texture.coders.group import GroupReader, plane_order
from ptmtools.texture.coders.rans import Sink, check_end, empty_sink, encode_symbols, read_stream
from ptmtools.texture.coders.rans_kernels import split_numbers

#: Weights in 1/64 of W, N, NW and NE, each less the block's mean, in predictions of p, q and r.
WEIGHTS = np.array([[20, 24, -10, -7], [2, 27, -12, -2], [13, -7, -6, -39]], np.int64)

#: Slots of a table, at most, in bits. 16 instead of 13: textures of models 2 to 3 % smaller, and
#: half as long again to decode, because the tables do not stay in a core's own cache.
MOST_BITS = 13

#: Activity below which lies class 0, 1, 2 …
CLASS_BOUNDS = (2, 4, 8, 16, 32, 64, 128, 256, 512)

Bytes = NDArray[np.uint8]


def find(level: Bytes, below: Bytes) -> Sink:
    """The symbols that refine ``below`` (h >> 1, w >> 1, c) to ``level`` (h, w, c)."""
    count = below.shape[0] * below.shape[1]
    edge = level.shape[0] * level.shape[1] - 4 * count
    numbers = np.empty(kernels.MOST_SYMBOLS * count + 5 * edge, np.uint32)
    state = np.zeros(9, np.int64)
    _pass(_pack(level), _pack(below), level.shape, numbers, None, state)
    sink = empty_sink(int(state[blocks.COUNT]), blocks.TABLES)
    split_numbers(numbers[: state[blocks.COUNT]], *sink)
    return sink


def new_texels(sink: Sink) -> int:
    """Number of texels, among the first three of each block, that were not among the guesses."""
    new = sink.counts[blocks.GUESS : blocks.TEXEL, kernels.DIFFERENCES].sum()
    return int(3 * new + sink.counts[blocks.TEXEL : blocks.TEXEL + 36, 5].sum())


def write(sink: Sink) -> bytes:
    """The group of these symbols."""
    return b"".join(encode_symbols(sink, len(sink.counts), tables.built_in_family()))


def decode(data: Data, below: Bytes, shape: Shape) -> Bytes:
    """The inverse of `find` and `write`. Raises InputError PTM-I112 for what no encoder writes."""
    reader = GroupReader(data)
    frequency = tables.parse(reader, blocks.TABLES, tables.built_in_family())
    stream = read_stream(reader, kernels.MOST_SYMBOLS)
    escaped = len(stream.escapes)
    state = np.zeros(9, np.int64)
    state[blocks.ESCAPES_END] = escaped
    level = np.empty(shape[:2], np.uint32)
    words = np.concatenate([stream.escapes, stream.words])
    source = blocks.RepeatsSource(tables.single_tables(frequency), words, escaped + stream.limit)
    check_end(_pass(level, _pack(below), shape, None, source, state))
    if shape[2] != 3:
        return level.astype(f"<u{shape[2]}").view(np.uint8).reshape(shape)
    texels = np.empty(shape, np.uint8)
    kernels.move_rgb(False, texels, level)
    return texels


def _pass(
    level: NDArray[np.uint32],
    below: NDArray[np.uint32],
    shape: tuple[int, ...],
    sink: NDArray[np.uint32] | None,
    source: blocks.RepeatsSource | None,
    state: NDArray[np.int64],
) -> int:
    """Calls `repeats_kernels.repeats_pass` with the tables that it fills."""
    height, width, components = shape
    bits = min(max(below.size.bit_length(), 6), MOST_BITS)
    return kernels.repeats_pass(
        level.reshape(-1), height, width, below, plane_order(components), WEIGHTS,
        np.searchsorted(CLASS_BOUNDS, np.arange(1024), side="right").astype(np.uint8),
        np.zeros((5, 1 << bits), np.uint32), np.zeros(1 << bits, np.uint32),
        np.zeros(below.shape[1] + 1, np.int64), np.zeros(3, np.int64), np.uint64(32 - bits),
        sink, source, state,
    )  # fmt: skip


def _pack(level: Bytes) -> NDArray[np.uint32]:
    """Texels (h, w, c) as one number each."""
    level = np.ascontiguousarray(level)
    if level.shape[2] != 3:
        return level.view(f"<u{level.shape[2]}")[:, :, 0].astype(np.uint32)
    texels = np.empty(level.shape[:2], np.uint32)
    kernels.move_rgb(True, level, texels)
    return texels
