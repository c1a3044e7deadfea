"""Octree textures in a client's catalogue: textures after the others (`Catalogue`)."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, areas
from ptmtools.lab.catalogue import Catalogue, Columns, Shapes, aligned
from ptmtools.lab.previews import LEAST
from ptmtools.output.served import Served
from ptmtools.rendering.octrees import Octrees

#: Number of points of each object at which the levels of its octree are compared, and the seed of
#: their places.
_POINTS, _SEED = 4096, 1
#: Bytes of a texel in texture memory.
_TEXEL = 4
#: Brightness of the lit surface in the comparison, 0 to 255.
_BRIGHT = 255 * 0.7


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
        columns, differences(served, octrees, columns), _shapes(served, octrees)
    )
    # After them, errors that no download reduces; see the package.
    return _with_empty(extended, 1, octrees)


def _with_empty(stock: Catalogue, count: int, octrees: Octrees) -> Catalogue:
    """The catalogue with ``count`` more textures without columns."""
    wide = 1 + int(octrees.levels.max(initial=1))
    last, table = np.zeros(count, np.int64), np.zeros((count, wide), np.int64)
    nothing = Columns(last, last, table, table, np.zeros((count, wide, 2), np.int64))
    return stock.joined_with(nothing, np.zeros((count, wide)))


def differences(served: Served, octrees: Octrees, columns: Columns) -> Floats:
    """(O, K) mean difference of each level to the one before, over the object as displayed, 0 to
    255. hints.json does not hold them; its writer could."""
    from ptmtools.rendering.relief import DEEP, descend

    result = np.zeros(columns.ends.shape)
    random, surfaces = np.random.default_rng(_SEED), served.surfaces
    for o in range(octrees.number):
        own = np.flatnonzero(octrees.of == o)
        levels = int(octrees.levels[o])
        if len(own):
            corner = surfaces.corner[own]
            total = np.cumsum(areas(corner))
            which = np.searchsorted(total, random.uniform(0, total[-1], _POINTS), "right")
            weight = random.dirichlet(np.ones(3), _POINTS)
            place = np.einsum("nk,nkj->nj", weight, corner[np.minimum(which, len(own) - 1)])
            light, steps = np.zeros(DEEP), np.zeros(levels)
            for x, y, z in place.tolist():
                count = descend(octrees, o, x, y, z, DEEP, light)
                steps[1:count] += np.abs(np.diff(light[:count]))
            result[o, 1 : levels + 1] = _BRIGHT * steps / _POINTS
        result[o, 1 : levels + 1] = np.maximum(result[o, 1 : levels + 1], LEAST)
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
