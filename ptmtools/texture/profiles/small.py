"""Profile `small`: context mixing, for archives and thin lines.

Images of 8 bits by the context mixing coder (`coders.mixing`), which adapts from level to level;
other kinds by the texel coder of `fast`, which does not. A coarsest level of any size is coded as
the pyramid of its own. Noise is coded *evenly*: all blocks with the right mean are equally likely.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.texture.coder import PLAIN, Coding, Data, Samples, Shape, Tile
from ptmtools.texture.coders import mixing, texel
from ptmtools.texture.coders.group import (
    GroupReader,
    group_error,
    pack_levels,
    shapes_to,
    unpack_levels,
)
from ptmtools.texture.profiles import raw
from ptmtools.texture.pyramid import build_pyramid

#: The first byte of a group.
MIXED, STORED, TEXEL, EVEN = range(4)
#: Streams beyond this share of the texels, in 1/16, are compared with what noise costs.
_NOISY = 11


def encode_base(level: Samples) -> bytes:
    """The level's own coarsest level as it is, then what refines it, each with its length."""
    coarsest, *finer = build_pyramid(level)
    return coarsest.tobytes() + pack_levels(encode_tile, coarsest, finer)


def decode_base(data: Data, shape: Shape, dtype: np.dtype[Any]) -> Samples:
    """The inverse of `encode_base`. Raises InputError PTM-I112."""
    coarsest, *finer = shapes_to(shape)
    reader = GroupReader(data)
    return unpack_levels(decode_tile, reader, reader.texels(coarsest, dtype), finer)


def encode_tile(level: Samples, below: Samples, coding: Coding = PLAIN) -> Tile:
    """One byte that names the coder, then what it wrote."""
    if level.dtype != np.uint8:
        data, texels = texel.encode(level, below, coding.max_error)
        return Tile(bytes([TEXEL]) + data, texels)
    stream, texels, learned = mixing.encode_mixing(level, below, coding)
    if coding.max_error == 0 and (stream is None or 16 * len(stream) > _NOISY * level.nbytes):
        even = mixing.encode_even(level, below)
        if stream is None or len(even) < len(stream):
            return Tile(bytes([EVEN]) + even, level, coding.memory)
    if stream is None or len(stream) > level.nbytes:
        return Tile(bytes([STORED]) + level.tobytes(), level, coding.memory)
    return Tile(bytes([MIXED]) + stream, texels, learned)


def decode_tile(data: Data, below: Samples, shape: Shape, coding: Coding = PLAIN) -> Tile:
    """The inverse of `encode_tile`. Raises InputError PTM-I112."""
    reader = GroupReader(data)
    coder, eight_bits = reader.number(1), below.dtype == np.uint8
    if coder == STORED:
        return Tile(b"", raw.decode_base(reader.rest(), shape, below.dtype), coding.memory)
    if coder == TEXEL and not eight_bits:
        return Tile(b"", texel.decode(reader.rest(), below, shape, coding.max_error))
    if coder == MIXED and eight_bits:
        return Tile(b"", *mixing.decode_mixing(reader.rest(), below, shape, coding))
    if coder == EVEN and eight_bits and coding.max_error == 0:
        return Tile(b"", mixing.decode_even(reader.rest(), below, shape), coding.memory)
    raise group_error(f"coder {coder} is unknown here")
