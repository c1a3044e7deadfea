"""Octree textures in a client's catalogue: textures behind the others (`Catalogue`)."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.lab.catalogue import LEAST, Catalogue, Columns, Shapes
from ptmtools.lab.relief.octrees import Octrees, octree_columns
from ptmtools.output.served import Served

#: Points of each object at which the levels of its octree are compared, and where they are put.
_POINTS, _SEED = 4096, 1


#: Share of white that what is lit gives back, where the light on it is compared.
_BRIGHT = 255 * 0.7


def without_octrees(stock: Catalogue, octrees: Octrees) -> Catalogue:
    """What a client knows that draws none: nothing can be fetched of them.

    There are as many columns as the tables of the walk have.
    """
    return _none(stock, octrees.number + 1, octrees)


def with_octrees(stock: Catalogue, served: Served, octrees: Octrees) -> Catalogue:
    """What a client knows that draws octrees; ``stock`` is of the textures alone."""
    columns = octree_columns(served)
    joined = stock.beside(columns, differences(served, octrees, columns), _shapes(served, octrees))
    # Behind them what nothing mends, see the package.
    return _none(joined, 1, octrees)


def _none(stock: Catalogue, count: int, octrees: Octrees) -> Catalogue:
    """With so many textures more of which nothing can be fetched."""
    wide = 1 + int(octrees.levels.max(initial=1))
    last, table = np.zeros(count, np.int64), np.zeros((count, wide), np.int64)
    nothing = Columns(last, table, table, np.zeros((count, wide, 2), np.int64))
    return stock.beside(nothing, np.zeros((count, wide)))


def differences(served: Served, octrees: Octrees, columns: Columns) -> Floats:
    """(O, K) of each level to the one before it, as pictures show it: on average over the object, 0
    to 255. hints.json does not say them; who writes it could."""
    from ptmtools.lab.relief.kernels import DEEP, descend

    result = np.zeros(columns.ends.shape)
    random, surfaces = np.random.default_rng(_SEED), served.surfaces
    for o in range(octrees.number):
        own = np.flatnonzero(octrees.of == o)
        levels = int(octrees.levels[o])
        if len(own):
            corner = surfaces.corner[own]
            area = np.linalg.norm(
                np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
            )
            total = np.cumsum(area)
            which = np.searchsorted(total, random.uniform(0, total[-1], _POINTS), "right")
            weight = random.dirichlet(np.ones(3), _POINTS)
            place = np.einsum("nk,nkj->nj", weight, corner[np.minimum(which, len(own) - 1)])
            light, steps = np.zeros(DEEP), np.zeros(levels)
            for x, y, z in place.tolist():
                count = descend(octrees, o, x, y, z, DEEP, light)
                steps[1:count] += np.abs(np.diff(light[:count]))
            result[o, 1 : levels + 1] = _BRIGHT * steps / _POINTS
        stored = result[o, 1 : levels + 1]
        result[o, 1 : levels + 1] = np.maximum(stored, LEAST)
    return result


def _shapes(served: Served, octrees: Octrees) -> Shapes:
    """The shapes that show octrees, once more with these."""
    surfaces, first = served.surfaces, len(served.index["textures"])
    low, high = surfaces.boxes()
    shape, where = np.unique(surfaces.shape, return_index=True)
    some = octrees.of[where] >= 0
    shape, where = shape[some], where[some]
    cell, number = surfaces.cell[where].astype(np.int64), octrees.of[where].astype(np.int64)
    side = np.repeat(octrees.side[number][:, None], 2, axis=1)
    return Shapes(cell, first + number, low[shape], high[shape], side)
