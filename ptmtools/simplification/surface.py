"""A mesh made ready for collapses: welded, centred, its seams found.

Equal points become one *vertex*. Of faces that have the same three vertices (a leaf with two
sides, a poster on its wall) each is in a *layer* of its own, with vertices of its own: together
they would be edges of four faces, along which nothing can move.

An edge is *kept* if it is a border (one face), if more than two faces meet there or two that
disagree on their front, or if material, texture coordinates or colours change across it. The
corners about a vertex that hang together across the other edges are a *wedge*: it has one value of
each attribute. A vertex is free if no kept edge ends there, on a line if two do; else it stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import frexp, ldexp
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.search import connected, distinct
from ptmtools.simplification.model import Mesh
from ptmtools.tolerance import FILE_SHARE

#: What a vertex may do: go anywhere, go along its line of kept edges, nothing.
FREE, LINE, FIXED = 0, 1, 2
#: Texture coordinates count as equal if they differ by less than this share of the largest: files
#: have them in single precision.
UV_SHARE = FILE_SHARE
#: The distance, as a share of the largest side of the mesh, that a channel of a colour counts as
#: moved by if it changes from 0 to 255.
COLOR_SHARE = 0.02

Indices = NDArray[np.int32]


@dataclass(frozen=True)
class Surface:
    """A mesh in a cube about the origin of side 1 to 2.

    Attributes
    ----------
    point: (V, 3), centred, and scaled by a power of two.
    given: (V,) index of the point of the mesh that each vertex is.
    centre, scale: a given point is ``point * scale + centre``.
    source: (T,) index of the face of the mesh; faces with fewer than three vertices are left out.
    triangle: (T, 3) vertices.
    kept: (T,) uint8, bit k is set if the edge from corner k to the next is kept.
    wedge: (T, 3) index of each corner's wedge.
    corner: (W,) the first corner (3 t + k, of faces of `triangle`) of each wedge.
    freedom: (V,) int8, one of `FREE`, `LINE`, `FIXED`.
    """

    point: Floats
    given: Ints
    centre: Floats
    scale: float
    source: Indices
    triangle: Indices
    kept: NDArray[np.uint8]
    wedge: Indices
    corner: Ints
    freedom: NDArray[np.int8]


def surface_of(mesh: Mesh) -> Surface:
    """Welds a mesh and finds its seams. ValueError where arrays do not fit each other."""
    check(mesh)
    given, vertex = distinct(mesh.points)
    corners = vertex[mesh.triangles]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    source = np.flatnonzero(whole).astype(np.int32)
    corners, given = _layered(corners[whole], given)
    used, vertices = np.unique(corners, return_inverse=True)
    given = given[used]
    triangle = vertices.reshape(-1, 3).astype(np.int32)
    point = mesh.points[given]
    low, high = point.min(axis=0, initial=np.inf), point.max(axis=0, initial=-np.inf)
    centre = low / 2 + high / 2 if len(point) else np.zeros(3)
    side = float((high / 2 - low / 2).max()) if len(point) else 0.0
    scale = ldexp(1.0, min(max(frexp(side)[1], -1021), 1023)) if side > 0 else 1.0
    point = (point - centre) / scale

    count = len(given)
    kept, leader, ends = _seams(mesh, source, triangle, count)
    corner, number = np.unique(leader, return_inverse=True)
    wedge = number.reshape(-1, 3).astype(np.int32)
    freedom = np.full(count, FIXED, np.int8)
    freedom[ends == 2] = LINE
    wedges = np.bincount(triangle.reshape(-1)[corner], minlength=count)
    freedom[(ends == 0) & (wedges == 1)] = FREE
    return Surface(point, given, centre, scale, source, triangle, kept, wedge, corner, freedom)


def check(mesh: Mesh) -> None:
    """ValueError for arrays that are of other shapes, for indices out of range, and for numbers
    that are not finite."""
    faces = len(mesh.triangles)
    shapes: dict[str, tuple[NDArray[Any] | None, tuple[int, ...]]] = {
        "points": (mesh.points, (len(mesh.points), 3)),
        "triangles": (mesh.triangles, (faces, 3)),
        "material": (mesh.material, (faces,)),
        "uv": (mesh.uv, (faces, 3, 2)),
        "colors": (mesh.colors, (faces, 3, 3)),
    }
    for name, (array, shape) in shapes.items():
        if array is not None and array.shape != shape:
            raise ValueError(f"{name} has the shape {array.shape}, not {shape}")
        if array is not None and not np.isfinite(array).all():
            raise ValueError(f"{name} has numbers that are not finite")
    if faces and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.points):
        raise ValueError("triangles has an index out of range")


def _layered(triangle: Ints, given: Ints) -> tuple[Ints, Ints]:
    """The same with vertices of their own for faces that coincide with earlier ones."""
    first, group = distinct(np.sort(triangle, axis=1))
    if len(first) == len(group):
        return triangle, given
    order = np.argsort(group, kind="stable")
    begin = np.searchsorted(group[order], np.arange(len(first)))
    layer = np.empty(len(order), np.int64)
    layer[order] = np.arange(len(order)) - begin[group[order]]
    place, index = np.unique(layer[:, None] * len(given) + triangle, return_inverse=True)
    return index.reshape(-1, 3), given[place % len(given)]


@dataclass(frozen=True)
class Edges:
    """The edges of faces, which meet in some.

    An edge of a face is 3 t + k, from the corner k of the face t to the next.

    Attributes
    ----------
    order: (3 T,) the edges of faces, those that are the same edge of the mesh side by side.
    start: (E,) where each edge of the mesh begins in it. faces: (E,) how many faces it has.
    key: (E,) a number for each, ascending: of its vertices the lesser times V, and the other.
    count: V. begin: (3 T,) the vertex at which an edge of a face begins.
    """

    order: Ints
    start: Ints
    faces: Ints
    key: Ints
    count: int
    begin: Ints

    @property
    def ends(self) -> tuple[Ints, Ints]:
        """The vertices of each edge of the mesh."""
        one, two = np.divmod(self.key, max(self.count, 1))
        return one, two

    @property
    def pairs(self) -> tuple[Ints, Ints]:
        """The edges of faces of which each is that of two, which agree on their front."""
        first = self.start[self.faces == 2]
        one, two = self.order[first], self.order[first + 1]
        agree = self.begin[one] != self.begin[two]
        return one[agree], two[agree]


def edges_of(triangle: NDArray[np.integer[Any]], count: int) -> Edges:
    """Those of (T, 3) triangles of so many vertices."""
    begin = triangle.reshape(-1).astype(np.int64)
    end = np.roll(triangle, -1, axis=1).reshape(-1).astype(np.int64)
    edge = np.minimum(begin, end) * count + np.maximum(begin, end)
    order = np.argsort(edge, kind="stable")
    first = np.ones(len(order), bool)
    first[1:] = np.diff(edge[order]) != 0
    start = np.flatnonzero(first)
    faces = np.diff(start, append=len(order))
    return Edges(order, start, faces, edge[order[start]], count, begin)


def _seams(
    mesh: Mesh, source: Indices, triangle: Indices, count: int
) -> tuple[NDArray[np.uint8], Ints, Ints]:
    """Which edges are kept, bit by bit; the first corner of each corner's wedge, (3 T,); and how
    many kept edges end in each vertex."""
    edges = edges_of(triangle, count)
    one, two = edges.pairs
    across = _continued(mesh, source, one, two)
    one, two = one[across], two[across]

    open_ = np.ones(triangle.size, bool)
    open_[one] = open_[two] = False
    kept = np.packbits(open_.reshape(-1, 3), axis=1, bitorder="little").reshape(-1)
    lone = open_[edges.order[edges.start]]
    ends = np.bincount(np.concatenate([end[lone] for end in edges.ends]), minlength=count)
    pairs = [[one, following(two)], [following(one), two]]
    return kept, connected(triangle.size, np.concatenate(pairs, axis=1).T), ends


def following(corner: Ints) -> Ints:
    """The next corner of the same face."""
    return np.where(corner % 3 == 2, corner - 2, corner + 1)


def _continued(mesh: Mesh, source: Indices, one: Ints, two: Ints) -> Bools:
    """Whether what is painted goes on across edges, given by the corner at which each of their two
    faces begins them."""
    here, there = source[one // 3], source[two // 3]
    ends = ((one % 3, following(two) % 3), (following(one) % 3, two % 3))
    same = np.ones(len(one), bool)
    if mesh.material is not None:
        same &= mesh.material[here] == mesh.material[there]
    if mesh.uv is not None:
        for a, b in ends:
            mine, other = mesh.uv[here, a], mesh.uv[there, b]
            slack = UV_SHARE * np.maximum(np.abs(mine), np.abs(other))
            same &= (np.abs(mine - other) <= slack).all(axis=1)
    if mesh.colors is not None:
        for a, b in ends:
            same &= (mesh.colors[here, a] == mesh.colors[there, b]).all(axis=1)
    return same
