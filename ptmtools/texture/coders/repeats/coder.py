"""The repeats coder: a group's bytes around the compiled pass (`kernels` says what is coded).

Layout of a coded group: the frequency tables; the stream of `rans.stream`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.damage import damaged
from ptmtools.texture.coders.rans import tables
from ptmtools.texture.coders.rans.stream import encode_symbols, read_stream

#: Weights in 1/64 of W, N, NW and NE, each less the block's mean, in predictions of p, q and r.
WEIGHTS = np.array([[20, 24, -10, -7], [2, 27, -12, -2], [13, -7, -6, -39]], np.int64)

Bytes = NDArray[np.uint8]


def encode(level: Bytes, below: Bytes) -> bytes:
    """The group that refines ``below`` (h >> 1, w >> 1, c) to ``level`` (h, w, c)."""
    from ptmtools.texture.coders.repeats import kernels

    blocks = below.shape[0] * below.shape[1]
    edge = level.shape[0] * level.shape[1] - 4 * blocks
    most = kernels.MOST_SYMBOLS * blocks + 5 * edge
    numbers = np.empty(most, np.uint32)
    state = np.zeros(9, np.int64)
    nothing = np.zeros(0, np.uint16)
    _pass(True, _packed(level), _packed(below), level.shape[2], 0, numbers, nothing, state)
    numbers = numbers[: state[4]]
    symbols = (numbers & 0xFFFF).astype(np.uint16)
    contexts = (numbers >> 16).astype(np.uint8)
    keys = contexts.astype(np.int64) << 8 | np.minimum(symbols, tables.ESCAPE)
    counts = np.bincount(keys, minlength=256 * kernels.TABLES).reshape(-1, 256)
    frequency, packed = tables.choose(counts, kernels.TABLES)
    return packed + encode_symbols(symbols, contexts, frequency, kernels.TABLES)


def decode(data: bytes, below: Bytes, shape: tuple[int, int, int]) -> Bytes:
    """The inverse of `encode`. Raises InputError PTM-I112 for what no encoder writes."""
    from ptmtools.texture.coders.repeats import kernels

    frequency, used = tables.parse(data, kernels.TABLES)
    stream = read_stream(data[used:], kernels.MOST_SYMBOLS)
    escaped = len(stream.escapes)
    state = np.zeros(9, np.int64)
    state[7] = escaped
    level = np.empty(shape[:2], np.uint32)
    result = _pass(
        False, level, _packed(below), shape[2], escaped + stream.limit,
        tables.decoding_table(frequency), np.concatenate([stream.escapes, stream.words]), state,
    )  # fmt: skip
    if result == kernels.TRUNCATED:
        raise damaged("its stream ends early")
    if result != kernels.OK:
        raise damaged("its stream leads to impossible texels")
    return _unpacked(level, shape[2])


def _pass(encoding, level, below, components, limit, numbers, words, state):
    from ptmtools.texture.coders.haar.layout import plane_order
    from ptmtools.texture.coders.repeats import kernels

    bits = min(max(below.size.bit_length(), 6), 16)
    return kernels.repeats_pass(
        encoding,
        level,
        level.reshape(-1),
        below,
        np.array(plane_order(components), np.int64),
        WEIGHTS,
        np.zeros((5, 1 << bits), np.uint32),
        np.zeros(1 << bits, np.uint32),
        np.zeros(below.shape[1] + 1, np.int64),
        np.zeros(4, np.uint64),
        np.zeros(8, np.uint64),
        32 - bits,
        limit,
        numbers,
        words,
        state,
    )


def _packed(level: Bytes) -> NDArray[np.uint32]:
    """Texels (h, w, c) as one number each."""
    height, width, components = level.shape
    if components == 4:
        return level.view("<u4").reshape(height, width).astype(np.uint32)
    out = np.zeros((height, width, 4), np.uint8)
    out[:, :, :components] = level
    return out.view("<u4").reshape(height, width).astype(np.uint32, copy=False)


def _unpacked(texels: NDArray[np.uint32], components: int) -> Bytes:
    height, width = texels.shape
    parts = texels.astype("<u4", copy=False).view(np.uint8).reshape(height, width, 4)
    return np.ascontiguousarray(parts[:, :, :components])
