"""What no collapse that keeps the topology can take away: handles and parts.

A part is what hangs together by edges; where faces only touch in a vertex, there are several. A
closed surface of V vertices, E edges and F faces, in c parts with g handles, has V - E + F =
2 c - 2 g. As every face has three edges, each of two faces, F = 2 (V - 2 c) + 4 g: a handle holds
four faces, however small it is, and so does a closed part; one with a border holds one. Marching
cubes of what a scanner saw leave thousands of either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.simplification.surface import (
    Edges,
    Surface,
    edges_of,
    flattened,
    following,
    unite,
)

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
    triangle = surface.triangle
    edges = edges_of(triangle, len(surface.point))
    part = parts_of(edges, len(triangle))
    lone = edges.order[edges.start[edges.faces == 1]]
    parts, bordered = len(np.unique(part)), len(np.unique(part[lone // 3]))
    handles = 0
    if not (edges.faces > 2).any():
        # Where fans of faces touch in a vertex each has one of its own.
        fan = _fans(edges, triangle.size)
        begin, end = fan[lone], fan[following(lone)]
        borders = len(np.unique(joined(triangle.size, begin, end)[begin]))
        characteristic = len(np.unique(fan)) - len(edges.start) + len(triangle)
        handles = max(0, (2 * parts - borders - characteristic) // 2)
    return Topology(handles, parts - bordered, bordered)


def parts_of(edges: Edges, faces: int) -> Ints:
    """(T,) of each face the least of its part."""
    same = np.ones(len(edges.order), np.bool_)
    same[edges.start] = False
    later = np.flatnonzero(same)
    return joined(faces, edges.order[later - 1] // 3, edges.order[later] // 3)


def _fans(edges: Edges, corners: int) -> Ints:
    """(3 T,) of each corner the least of those about its vertex that edges of two faces join."""
    first = edges.start[edges.faces == 2]
    one, two = edges.order[first], edges.order[first + 1]
    agree = edges.begin[one] != edges.begin[two]
    begin, end = np.where(agree, following(two), two), np.where(agree, two, following(two))
    return joined(corners, np.append(one, following(one)), np.append(begin, end))


def joined(count: int, one: Ints, two: Ints) -> Ints:
    """Of each of so many things the least that pairs join it with."""
    parent = np.arange(count)
    unite(parent, one, two)
    return flattened(parent)
