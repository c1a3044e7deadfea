"""How a level is cut into tiles (``docs/formats/ptm.md``).

A level with a side of more than twice the tile's is cut into as many whole tiles as go into it
each way; the last of a row or column takes what is left over, so that none is a sliver. Tiles
begin at multiples of their side, which is even, so a tile refines a rectangle of the level below
that no other tile refines.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple


class Box(NamedTuple):
    """A rectangle of texels: from (x0, y0) up to, and without, (x1, y1)."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def below(self) -> Box:
        """What lies under its whole 2×2 blocks in the level below; its corner is even."""
        return Box(self.x0 >> 1, self.y0 >> 1, self.x1 >> 1, self.y1 >> 1)

    @property
    def slices(self) -> tuple[slice, slice]:
        """For indexing an array of rows."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)

    def within(self, outer: Box) -> Box:
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


def covering(width: int, height: int, side: int, box: Box) -> Box:
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
