"""How many handles a mesh has: what no collapse that keeps the topology can take away.

A closed surface of V vertices, E edges and F faces, in c parts with g handles, has V - E + F =
2 c - 2 g. As every face has three edges, each of two faces, F = 2 (V - 2 c) + 4 g: a handle holds
four faces, however small it is. Marching cubes of what a scanner saw leave thousands.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.simplification.surface import Surface, unite

#: Faces that a handle holds.
PER_HANDLE = 4


def handles(surface: Surface) -> int:
    """How many there are; 0 if more than two faces meet in an edge, where nobody can say.

    A border counts as closed by one face of many corners.
    """
    triangle = surface.triangle.astype(np.int64)
    count = len(surface.point)
    begin, end = triangle.reshape(-1), np.roll(triangle, -1, axis=1).reshape(-1)
    edge = np.sort(np.minimum(begin, end) * count + np.maximum(begin, end))
    first = np.flatnonzero(np.diff(edge, prepend=-1))
    faces = np.diff(first, append=len(edge))
    if (faces > 2).any():
        return 0
    one, two = np.divmod(edge[first], max(count, 1))
    lone = faces == 1
    vertices, parts = _parts(count, one, two)
    _, borders = _parts(count, one[lone], two[lone])
    return max(0, (2 * parts - borders - (vertices - len(first) + len(triangle))) // 2)


def _parts(count: int, one: Ints, two: Ints) -> tuple[int, int]:
    """How many of so many vertices edges join, and into how many parts."""
    parent = np.arange(count)
    unite(parent, one, two)
    used = np.zeros(count, dtype=np.bool_)
    used[one] = used[two] = True
    roots = parent == np.arange(count)
    return int(used.sum()), int((roots & used).sum())
