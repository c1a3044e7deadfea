"""A coarsest level of any size, coded as the pyramid of its own: levels in one string of bytes.

Each level has its length in four bytes before it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from ptmtools.texture.coders.reading import Reader
from ptmtools.texture.pyramid import level_sizes

if TYPE_CHECKING:
    from ptmtools.texture.profiles import Samples, Shape, Tile

_LENGTH = 4


def pack_levels(
    encode_tile: Callable[..., Tile], below: Samples, levels: Iterable[Samples]
) -> bytes:
    """Levels, coarsest first, each refining the one before it and the first ``below``."""
    parts, memory = [], None
    for level in levels:
        tile = encode_tile(level, below, memory=memory)
        parts += [len(tile.data).to_bytes(_LENGTH, "little"), tile.data]
        below, memory = level, tile.memory
    return b"".join(parts)


def unpack_levels(
    decode_tile: Callable[..., Tile], reader: Reader, below: Samples, shapes: Iterable[Shape]
) -> Samples:
    """The last of the levels of `pack_levels`, which have these shapes.

    Raises InputError PTM-I112.
    """
    memory = None
    for shape in shapes:
        data = reader.take(reader.number(_LENGTH))
        tile = decode_tile(data, below, shape, memory=memory)
        below, memory = tile.texels, tile.memory
    reader.end()
    return below


def shapes_to(shape: Shape) -> list[Shape]:
    """Shapes of the pyramid of a level, coarsest first."""
    height, width, components = shape
    return [(h, w, components) for w, h in level_sizes(width, height)]
