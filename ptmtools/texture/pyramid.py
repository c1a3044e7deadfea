"""Mipmap levels by the mean of 2×2 blocks (paper Eq. 1), for any size and kind of sample, and the
tiles of a level. Specified in ``docs/formats/ptm.md`` and ``docs/formats/ptm-kinds.md``.

Level n-1 is max(1, side >> 1) wide and high, as in OpenGL and WebGPU, so that a decoded level can
be uploaded as it is. An odd last row or column belongs to no 2×2 block and does not reach the
level below. Levels stop where the shorter side is 1.

Means of floats are taken in float64: no sum of finite samples overflows there, so the mean of
finite samples is finite, and the same on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from numpy.typing import NDArray


#: Samples averaged at a time, about: scratch memory is a small multiple of it.
STRIP_SAMPLES = 1 << 18


def level_sizes(width: int, height: int, min_side: int = 1) -> list[tuple[int, int]]:
    """(width, height) of every level, coarsest first.

    Down to the first level whose shorter side is 1, or to the last one whose shorter side is at
    least ``min_side``; the image itself is always among them.
    """
    sizes = [(width, height)]
    while min(sizes[-1]) >> 1 >= max(1, min_side):
        sizes.append((sizes[-1][0] >> 1, sizes[-1][1] >> 1))
    return sizes[::-1]


def build_pyramid(source: Any, min_side: int = 1) -> list[NDArray[Any]]:
    """Levels of an (h, w, c) or (h, w) image, coarsest first, the image itself last.

    ``source`` needs a ``shape``, a ``dtype`` (uint8, uint16, float16 or float32) and rows that can
    be sliced: an array, a memory-mapped file, or an object that produces rows on demand. It is read
    once, from top to bottom, a strip at a time.
    """
    levels = [source]
    while min(levels[-1].shape[:2]) >> 1 >= max(1, min_side):
        levels.append(mean_below(levels[-1]))
    return levels[::-1]


def mean_below(level: Any) -> NDArray[Any]:
    """The level below: the mean of every whole 2×2 block (paper Eq. 1). See `build_pyramid`."""
    import numpy as np

    height, width = level.shape[0] >> 1, level.shape[1] >> 1
    below = np.empty((height, width, *level.shape[2:]), level.dtype)
    per_row = max(1, 2 * int(np.prod(level.shape[1:])))
    strip = max(1, STRIP_SAMPLES // per_row)
    for y in range(0, height, strip):
        rows = np.asarray(level[2 * y : 2 * min(y + strip, height)])
        below[y : y + strip] = _means(rows[:, : 2 * width])
    return below


def _means(blocks: NDArray[Any]) -> NDArray[Any]:
    """Means of the blocks of an even number of rows and columns."""
    import numpy as np

    from ptmtools.texture.samples import round_to

    if blocks.dtype.kind == "u":
        wide = np.uint16 if blocks.dtype.itemsize == 1 else np.uint32
        rows: NDArray[Any] = np.add(blocks[0::2], blocks[1::2], dtype=wide)
        rows = rows.reshape(*rows.shape[:2], math.prod(rows.shape[2:]))
        below = np.empty((len(rows), rows.shape[1] // 2, rows.shape[2]), blocks.dtype)
        # One component at a time: numpy's innermost loop should not be one over three of them.
        for c in range(rows.shape[2]):
            total = rows[:, 0::2, c] + rows[:, 1::2, c]
            np.right_shift(total, 2, out=below[..., c], casting="unsafe")
        return below.reshape(*below.shape[:2], *blocks.shape[2:])
    with np.errstate(all="ignore"):
        real = blocks.astype(np.float64)
        upper, lower = real[0::2], real[1::2]
        mean = upper[:, 0::2] + upper[:, 1::2]
        mean += lower[:, 0::2] + lower[:, 1::2]
        mean *= 0.25
    return round_to(mean, blocks.dtype)


class Box(NamedTuple):
    """A rectangle of texels: from (x0, y0) up to, and without, (x1, y1)."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def below(self) -> Box:
        """The rectangle under its whole 2×2 blocks in the level below; its corner is even."""
        return Box(self.x0 >> 1, self.y0 >> 1, self.x1 >> 1, self.y1 >> 1)

    @property
    def slices(self) -> tuple[slice, slice]:
        """For indexing an array of rows."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)

    def relative_to(self, outer: Box) -> Box:
        """The same rectangle, counted from the corner of another."""
        return Box(self.x0 - outer.x0, self.y0 - outer.y0, self.x1 - outer.x0, self.y1 - outer.y0)


def tile_counts(width: int, height: int, side: int) -> tuple[int, int]:
    """Tiles across and down of a level; (1, 1) if it is not cut. ``side`` 0 never cuts."""
    if not side or max(width, height) <= 2 * side:
        return 1, 1
    return max(1, width // side), max(1, height // side)


def tile_box(width: int, height: int, side: int, column: int, row: int) -> Box:
    """The tile in that column and row."""
    across, down = tile_counts(width, height, side)
    return Box(
        column * side,
        row * side,
        width if column == across - 1 else (column + 1) * side,
        height if row == down - 1 else (row + 1) * side,
    )


def covering_box(width: int, height: int, side: int, box: Box) -> Box:
    """The rectangle of all tiles that share a texel with ``box``."""
    columns, rows = _tiles(width, height, side, box)
    first = tile_box(width, height, side, columns[0], rows[0])
    last = tile_box(width, height, side, columns[-1], rows[-1])
    return Box(first.x0, first.y0, last.x1, last.y1)


def tiles_under(width: int, height: int, side: int, box: Box) -> Iterator[tuple[int, Box]]:
    """Number (row by row) and rectangle of every tile that shares a texel with ``box``."""
    across, _ = tile_counts(width, height, side)
    columns, rows = _tiles(width, height, side, box)
    for row in rows:
        for column in columns:
            yield row * across + column, tile_box(width, height, side, column, row)


def _tiles(width: int, height: int, side: int, box: Box) -> tuple[range, range]:
    """Columns and rows of the tiles that share a texel with ``box``."""
    across, down = tile_counts(width, height, side)
    side = side or max(width, height)
    return (
        range(min(box.x0 // side, across - 1), min((box.x1 - 1) // side, across - 1) + 1),
        range(min(box.y0 // side, down - 1), min((box.y1 - 1) // side, down - 1) + 1),
    )
