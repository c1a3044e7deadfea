"""Profile `small`: context mixing, for archives and thin lines.

Images of 8 bits by the context mixing coder (`coders.mixing`), which adapts from level to level;
other kinds by the texel coder of `fast`, which does not. A coarsest level of any size is coded as
the pyramid of its own. Noise is coded *evenly*: all blocks with the right mean are equally likely.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ptmtools.texture.coder import Tile
from ptmtools.texture.coders.group import Reader, damaged, pack_levels, shapes_to, unpack_levels
from ptmtools.texture.pyramid import build_pyramid

if TYPE_CHECKING:
    from ptmtools.texture.coder import Samples, Shape

#: The first byte of a group.
MIXED, STORED, TEXEL, EVEN = range(4)
#: Streams beyond this share of the texels, in 1/16, are compared with what noise costs.
_NOISY = 11


def encode_base(level: Samples) -> bytes:
    """The level's own coarsest level as it is, then what refines it, each with its length."""
    coarsest, *finer = build_pyramid(level)
    return coarsest.tobytes() + pack_levels(encode_tile, coarsest, finer)


def decode_base(data: bytes | memoryview, shape: Shape, dtype: np.dtype[Any]) -> Samples:
    """The inverse of `encode_base`. Raises InputError PTM-I112."""
    coarsest, *finer = shapes_to(shape)
    reader = Reader(data)
    return unpack_levels(decode_tile, reader, reader.texels(coarsest, dtype), finer)


def encode_tile(
    level: Samples,
    below: Samples,
    max_error: int = 0,
    memory: Any = None,
    threads: int = 1,
) -> Tile:
    """One byte that names the coder, then what it wrote."""
    if level.dtype != np.uint8:
        from ptmtools.texture.coders import texel

        data, texels = texel.encode(level, below, max_error)
        return Tile(bytes([TEXEL]) + data, texels)
    from ptmtools.texture.coders import mixing

    stream, texels, learned = mixing.encode_mixing(level, below, max_error, memory, threads)
    if max_error == 0 and (stream is None or 16 * len(stream) > _NOISY * level.nbytes):
        even = mixing.encode_even(level, below)
        if stream is None or len(even) < len(stream):
            return Tile(bytes([EVEN]) + even, level, memory)
    if stream is None or len(stream) > level.nbytes:
        return Tile(bytes([STORED]) + level.tobytes(), level, memory)
    return Tile(bytes([MIXED]) + stream, texels, learned)


def decode_tile(
    data: bytes | memoryview,
    below: Samples,
    shape: Shape,
    max_error: int = 0,
    memory: Any = None,
    threads: int = 1,
) -> Tile:
    """The inverse of `encode_tile`. Raises InputError PTM-I112."""
    reader = Reader(data)
    coder, eight_bits = reader.number(1), below.dtype == np.uint8
    if coder == STORED:
        level = reader.texels(shape, below.dtype)
        reader.end()
        return Tile(b"", level, memory)
    if coder == TEXEL and not eight_bits:
        from ptmtools.texture.coders import texel

        return Tile(b"", texel.decode(reader.rest(), below, shape, max_error))
    if eight_bits and (coder == MIXED or (coder == EVEN and max_error == 0)):
        from ptmtools.texture.coders import mixing

        body = reader.rest()
        if coder == EVEN:
            return Tile(b"", mixing.decode_even(body, below, shape), memory)
        texels, learned = mixing.decode_mixing(body, below, shape, max_error, memory, threads)
        return Tile(b"", texels, learned)
    raise damaged(f"coder {coder} is unknown here")
