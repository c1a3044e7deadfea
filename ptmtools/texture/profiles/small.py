"""Profile `small`: context mixing, for archives and thin lines.

Images of 8 bits by the context mixing coder (`coders.mixing`), which adapts from level to level;
other kinds by the texel coder of `fast`, which does not. A coarsest level of any size is coded as
the pyramid of its own. Noise is coded *evenly*: all blocks with the right mean are equally likely.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ptmtools.texture.coders.damage import damaged
from ptmtools.texture.profiles import Tile

if TYPE_CHECKING:
    from ptmtools.texture.profiles import Samples, Shape

#: The first byte of a group.
MIXED, STORED, TEXEL, EVEN = range(4)
#: Streams beyond this share of the texels, in 1/16, are compared with what noise costs.
_NOISY = 11
#: Bytes of the length of a level in a coarsest level.
_LENGTH = 4


@dataclass(frozen=True)
class SmallProfile:
    """Context mixing; see the module."""

    name: str = "small"

    def encode_base(self, level: Samples) -> bytes:
        """The level's own coarsest level as it is, then what refines it, each with its length."""
        from ptmtools.texture.pyramid import build_pyramid

        levels = build_pyramid(level)
        parts = [levels[0].tobytes()]
        memory = None
        for below, finer in pairwise(levels):
            tile = self.encode_tile(finer, below, memory=memory)
            memory = tile.memory
            parts += [len(tile.data).to_bytes(_LENGTH, "little"), tile.data]
        return b"".join(parts)

    def decode_base(self, data: bytes, shape: Shape, dtype: np.dtype[Any]) -> Samples:
        """The inverse of `encode_base`. Raises InputError PTM-I112."""
        shapes = [shape]
        while min(shapes[-1][:2]) > 1:
            shapes.append((shapes[-1][0] >> 1, shapes[-1][1] >> 1, shape[2]))
        level, data = _texels(data, shapes.pop(), dtype)
        memory = None
        for one in reversed(shapes):
            end = _LENGTH + int.from_bytes(data[:_LENGTH], "little")
            if len(data) < max(end, _LENGTH):
                raise damaged("it is cut short")
            tile = self.decode_tile(data[_LENGTH:end], level, one, memory=memory)
            level, memory, data = tile.texels, tile.memory, data[end:]
        if data:
            raise damaged("it is too long")
        return level

    def encode_tile(
        self,
        level: Samples,
        below: Samples,
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """One byte that names the coder, then what it wrote."""
        if level.dtype != np.uint8:
            from ptmtools.texture.coders.texel import coder as texel

            data, texels = texel.encode(level, below, max_error)
            return Tile(bytes([TEXEL]) + data, texels)
        from ptmtools.texture.coders.mixing import coder as mixing

        stream, texels, learned = mixing.encode_mixing(level, below, max_error, memory, threads)
        if max_error == 0 and (stream is None or 16 * len(stream) > _NOISY * level.nbytes):
            even = mixing.encode_even(level, below)
            if stream is None or len(even) < len(stream):
                return Tile(bytes([EVEN]) + even, level, memory)
        if stream is None or len(stream) > level.nbytes:
            return Tile(bytes([STORED]) + level.tobytes(), level, memory)
        return Tile(bytes([MIXED]) + stream, texels, learned)

    def learn(self, levels: list[Samples]) -> Any:
        """The memory of a decoder that has read ``levels``, coarsest first, without error.

        For random access: a level's texels tell all that was learned up to it.
        """
        memory = None
        for below, level in pairwise(levels):
            memory = self.encode_tile(level, below, memory=memory).memory
        return memory

    def decode_tile(
        self,
        data: bytes,
        below: Samples,
        shape: Shape,
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """The inverse of `encode_tile`. Raises InputError PTM-I112."""
        if not data:
            raise damaged("it is empty")
        coder, data = data[0], data[1:]
        if coder == STORED:
            level, rest = _texels(data, shape, below.dtype)
            if rest:
                raise damaged("it is too long")
            return Tile(b"", level, memory)
        if coder == TEXEL and below.dtype != np.uint8:
            from ptmtools.texture.coders.texel import coder as texel

            return Tile(b"", texel.decode(data, below, shape, below.dtype, max_error))
        if coder == EVEN and max_error == 0 and below.dtype == np.uint8:
            from ptmtools.texture.coders.mixing import coder as mixing

            return Tile(b"", mixing.decode_even(data, below, shape), memory)
        if coder == MIXED and below.dtype == np.uint8:
            from ptmtools.texture.coders.mixing import coder as mixing

            texels, learned = mixing.decode_mixing(data, below, shape, max_error, memory, threads)
            return Tile(b"", texels, learned)
        raise damaged(f"coder {coder} is unknown here")


def _texels(data: bytes, shape: Shape, dtype: np.dtype[Any]) -> tuple[Samples, bytes]:
    """A level as it is at the start of ``data``, and what follows it."""
    size = shape[0] * shape[1] * shape[2] * dtype.itemsize
    if len(data) < size:
        raise damaged("it is cut short")
    return np.frombuffer(bytearray(data[:size]), dtype).reshape(shape), data[size:]
