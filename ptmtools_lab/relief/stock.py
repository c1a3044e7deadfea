"""Octree textures in a client's catalogue: textures after the others (`Catalogue`)."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.output.served import Served
from ptmtools.site.client import LEAST_DIFFERENCE
from ptmtools_lab.catalogue import Catalogue, Columns, Shapes, aligned
from ptmtools_systems.apo.served_octrees import Octrees, level_differences

#: Bytes of a texel in texture memory.
_TEXEL = 4


def octree_columns(served: Served) -> Columns:
    """The columns of each octree: a column is a level, its size the number of nodes along a
    side."""
    rows = []
    for row in served.index.get("octrees", ()):
        across = 1 << np.arange(len(row["levels"]))
        memory = np.cumsum(row["levels"]) * _TEXEL
        rows.append((row["ends"], memory, np.stack([across, across], axis=1)))
    return aligned(rows)


def without_octrees(stock: Catalogue, octrees: Octrees) -> Catalogue:
    """The catalogue of a client that draws no octrees, with nothing to fetch of them.

    It has as many columns as the tables of the walk.
    """
    return _with_empty(stock, octrees.number + 1, octrees)


def with_octrees(stock: Catalogue, served: Served, octrees: Octrees) -> Catalogue:
    """The catalogue of a client that draws octrees; ``stock`` is that of the textures alone."""
    columns = octree_columns(served)
    extended = stock.joined_with(
        columns, _differences(served, octrees, columns), _shapes(served, octrees)
    )
    # After them, errors that no download reduces; see the package.
    return _with_empty(extended, 1, octrees)


def _with_empty(stock: Catalogue, count: int, octrees: Octrees) -> Catalogue:
    """The catalogue with ``count`` more textures without columns."""
    wide = 1 + int(octrees.levels.max(initial=1))
    last, table = np.zeros(count, np.int64), np.zeros((count, wide), np.int64)
    nothing = Columns(last, last, table, table, np.zeros((count, wide, 2), np.int64))
    return stock.joined_with(nothing, np.zeros((count, wide)))


def _differences(served: Served, octrees: Octrees, columns: Columns) -> Floats:
    """(O, K) mean difference of each level to the one before, at least `LEAST_DIFFERENCE`."""
    result = np.zeros(columns.ends.shape)
    for o, steps in enumerate(level_differences(served.surfaces, octrees)):
        levels = int(octrees.levels[o])
        result[o, 1 : levels + 1] = np.maximum(steps[:levels], LEAST_DIFFERENCE)
    return result


def _shapes(served: Served, octrees: Octrees) -> Shapes:
    """The shapes with octrees, once more with these as textures."""
    surfaces, first = served.surfaces, len(served.index["textures"])
    low, high = surfaces.boxes()
    shape, where = np.unique(surfaces.shape, return_index=True)
    some = octrees.of[where] >= 0
    shape, where = shape[some], where[some]
    cell, number = surfaces.cell[where].astype(np.int64), octrees.of[where].astype(np.int64)
    side = np.repeat(octrees.side[number][:, None], 2, axis=1)
    return Shapes(cell, first + number, low[shape], high[shape], side)
