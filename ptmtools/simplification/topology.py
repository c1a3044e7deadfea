"""What no collapse that keeps the topology can take away: handles and parts.

A closed surface of V vertices, E edges and F faces, in c parts with g handles, has V - E + F =
2 c - 2 g. As every face has three edges, each of two faces, F = 2 (V - 2 c) + 4 g: a handle holds
four faces, however small it is, and so does a closed part; one with a border holds one. Marching
cubes of what a scanner saw leave thousands of either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.simplification.surface import Surface, edges_of, flattened, unite

#: Faces that a handle, a closed part and one with a border hold.
PER_HANDLE, PER_CLOSED, PER_OPEN = 4, 4, 1
#: What holds a greater share of the faces that are to be left gives way.
HELD = 0.1


@dataclass(frozen=True)
class Topology:
    """What a mesh has of each.

    Attributes
    ----------
    handles: 0 if more than two faces meet in an edge, where nobody can say.
    closed, bordered: parts without a border, and with one.
    """

    handles: int
    closed: int
    bordered: int

    @property
    def parts(self) -> int:
        """How many there are."""
        return self.closed + self.bordered

    @property
    def held(self) -> int:
        """Faces that handles hold, and parts beside one."""
        parts = PER_CLOSED * self.closed + PER_OPEN * self.bordered
        return PER_HANDLE * self.handles + parts * (self.parts > 1)


def topology(surface: Surface) -> Topology:
    """That of a mesh. A border counts as closed by one face of many corners."""
    edges = edges_of(surface.triangle, len(surface.point))
    one, two = edges.ends
    part = joined(len(surface.point), one, two)
    lone = edges.faces == 1
    parts = np.unique(part[one])
    bordered = np.unique(part[one[lone]])
    handles = 0
    if not (edges.faces > 2).any():
        border = np.unique(joined(len(surface.point), one[lone], two[lone])[one[lone]])
        vertices = len(np.unique(surface.triangle))
        characteristic = vertices - len(one) + len(surface.triangle)
        handles = max(0, (2 * len(parts) - len(border) - characteristic) // 2)
    return Topology(handles, len(parts) - len(bordered), len(bordered))


def joined(count: int, one: Ints, two: Ints) -> Ints:
    """Of each of so many vertices the least that edges join it with."""
    parent = np.arange(count)
    unite(parent, one, two)
    return flattened(parent)
