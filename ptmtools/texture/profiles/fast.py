"""Profile `fast`: static entropy coding; each tile by the coder that suits it.

Images of 8 bits, without error, are coded as *Haar* differences (photographs, most textures;
`coders.haar`), as *repeats* (flat areas, patterns, drawings, few colours, and atlases that mix
these with photographs; `coders.repeats`), or *stored* as in `raw`, so that no group is longer than
that and one byte. A sixteenth of the blocks decides which to try; trying both everywhere gained
0.7 % on photographs and 5 % on the textures of models and took twice the time or more. A coarsest
level of any size is coded as the *pyramid* of its own. `coders.texel` codes other kinds of sample
and near-lossless images.

Rejected: deflate in the place of repeats (models' textures 0.871 of PNG instead of 0.818); mapping
repeats first and decoding new texels by rows afterwards, which would be faster but detects too few
(office atlas 2.2 instead of 0.68).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coder import PLAIN, Coding, Data, Samples, Shape, Tile
from ptmtools.texture.coders import haar, repeats, texel
from ptmtools.texture.coders.group import (
    GroupReader,
    decode_differences,
    group_error,
    inflate,
    pack_levels,
    shapes_to,
    unpack_levels,
)
from ptmtools.texture.profiles import raw
from ptmtools.texture.profiles.raw import group_length
from ptmtools.texture.pyramid import build_pyramid

#: Coders 1 to 3 are those of files of version 1.
STORED, HAAR_1, DEFLATED_1, DIFFERENCES_1, HAAR, REPEATS, PYRAMID = range(7)

#: A group of fewer blocks is coded by both coders; of others a sixteenth is looked at first.
PROBED_BLOCKS = 16 * 16
#: Share of new texels up to which repeats is taken, and from which Haar is; between them both are
#: tried, and with one or two components wherever repeats is not taken at once.
BOTH_FROM, BOTH_TO = 0.4, 0.55
#: Haar decodes faster: repeats has to be smaller than this share of it. Compared with 0.97, models'
#: textures have 0.6 % more bytes and decode a fifth faster; 0.7 costs another 0.2 % and gains a
#: fiftieth (``benchmarks/codec/choice.py``).
WORTH = 0.85
#: Texels are counted in 30 bits by `coders.repeats`.
TOO_MANY_BLOCKS = 1 << 27


Bytes = NDArray[np.uint8]


def encode_base(level: Samples) -> bytes:
    """One byte that names the coder, then what it wrote."""
    levels = build_pyramid(level)
    nested = bytes([PYRAMID]) + pack_levels(
        encode_tile, _empty_below(levels[0].shape, level.dtype), levels
    )
    return min(nested, bytes([STORED]) + raw.encode_base(level), key=len)


def decode_base(data: Data, shape: Shape, dtype: np.dtype[Any]) -> Samples:
    """The inverse of `encode_base`. Raises InputError PTM-I112."""
    reader = GroupReader(data)
    coder = reader.number(1)
    if coder == PYRAMID:
        shapes = shapes_to(shape)
        return unpack_levels(decode_tile, reader, _empty_below(shapes[0], dtype), shapes)
    body = reader.rest()
    if coder == DEFLATED_1:
        return raw.decode_base(inflate(body, shape[0] * shape[1] * shape[2]), shape, dtype)
    if coder == STORED:
        return raw.decode_base(body, shape, dtype)
    raise group_error(f"coder {coder} is unknown for the coarsest level")


def encode_tile(level: Samples, below: Samples, coding: Coding = PLAIN) -> Tile:
    """One byte that names the coder, then what it wrote."""
    if level.dtype == np.uint8 and coding.max_error == 0:
        coded = _encode_best(level, below)
        if len(coded) > 1 + group_length((level.shape[0], level.shape[1], level.shape[2])):
            coded = bytes([STORED]) + raw.encode_tile(level, below).data
        return Tile(coded, level)
    return Tile(*texel.encode(level, below, coding.max_error))


def decode_tile(data: Data, below: Samples, shape: Shape, coding: Coding = PLAIN) -> Tile:
    """The inverse of `encode_tile`. Raises InputError PTM-I112."""
    if below.dtype == np.uint8 and coding.max_error == 0:
        return Tile(b"", _decode_bytes(data, below, shape))
    return Tile(b"", texel.decode(data, below, shape, coding.max_error))


def _encode_best(level: Bytes, below: Bytes) -> bytes:
    """Any level, of 8 bits, without error, by repeats or Haar."""
    blocks = below.shape[0] * below.shape[1]
    if blocks > TOO_MANY_BLOCKS:
        return bytes([HAAR]) + haar.encode(level, below)
    new = BOTH_FROM
    if blocks >= PROBED_BLOCKS:
        piece, under = _probe(level, below)
        new = repeats.new_texels(repeats.find(piece, under)) / (3 * under[..., 0].size)
    if new > BOTH_TO and level.shape[2] > 2:
        return bytes([HAAR]) + haar.encode(level, below)
    repeated = bytes([REPEATS]) + repeats.write(repeats.find(level, below))
    if new < BOTH_FROM:
        return repeated
    coded = bytes([HAAR]) + haar.encode(level, below)
    return repeated if len(repeated) < WORTH * len(coded) else coded


def _probe(level: Bytes, below: Bytes) -> tuple[Bytes, Bytes]:
    """Four strips, together a sixteenth of the block rows, as one smaller group."""
    height = below.shape[0]
    rows = -(-height // 64)
    starts = [(2 * i + 1) * height // 8 - rows // 2 for i in range(4)]
    piece = np.concatenate([level[2 * y : 2 * (y + rows), : 2 * below.shape[1]] for y in starts])
    return piece, np.concatenate([below[y : y + rows] for y in starts])


def _decode_bytes(data: Data, below: Bytes, shape: Shape) -> Bytes:
    reader = GroupReader(data)
    coder, body = reader.number(1), reader.rest()
    if coder == REPEATS:
        return repeats.decode(body, below, shape)
    if coder in (HAAR, HAAR_1):
        return haar.decode(body, below, shape, coder == HAAR_1)
    if coder == DIFFERENCES_1:
        return decode_differences(body, below, shape)
    if coder == DEFLATED_1:
        return raw.decode_tile(inflate(body, group_length(shape)), below, shape).texels
    if coder == STORED:
        return raw.decode_tile(body, below, shape).texels
    raise group_error(f"coder {coder} is unknown")


def _empty_below(shape: tuple[int, ...], dtype: np.dtype[Any]) -> Samples:
    """The empty level below a level whose shorter side is 1."""
    return np.zeros((shape[0] >> 1, shape[1] >> 1, shape[2]), dtype)
