"""Welded, centred mesh with constrained edges and wedges: the input of the edge collapses.

Equal points become one *vertex*. Faces with the same three vertices (a two-sided leaf, a poster on
its wall) go into separate *layers* with separate vertices: welded, they would form edges of four
faces, which cannot collapse.

An edge is *constrained* if it is a boundary (one face), if it is non-manifold (more than two faces,
or two faces of inconsistent orientation), or if it is a seam: material, texture coordinates or
colours change across it. A *wedge* is a set of corners of a vertex connected across unconstrained
edges; it has one value of each attribute. A vertex without constrained edges is free, a vertex of
two moves along their line, any other is fixed.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import frexp, ldexp
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.search import connect, distinct
from ptmtools.simplification.model import Mesh
from ptmtools.tolerance import FILE_SHARE

#: Freedom of a vertex: moves anywhere, moves along its line of constrained edges, does not move.
FREE, LINE, FIXED = 0, 1, 2
#: Relative tolerance of equal texture coordinates: files hold them in single precision.
UV_SHARE = FILE_SHARE
#: Distance equivalent to a change of a colour channel from 0 to 255, as a share of the largest side
#: of the mesh.
COLOR_SHARE = 0.02

Indices = NDArray[np.int32]


@dataclass(frozen=True)
class WeldedSurface:
    """A welded mesh, scaled into a cube of side 1 to 2 about the origin.

    Attributes
    ----------
    point: (V, 3), centred, and scaled by a power of two.
    source_point: (V,) index of the source point of each vertex.
    centre, scale: a source point is ``point * scale + centre``.
    source: (T,) index of the source face; faces with fewer than three vertices are dropped.
    triangle: (T, 3) vertices.
    constraint: (T,) uint8, bit k is set if the edge from corner k to the next is constrained.
    wedge: (T, 3) index of each corner's wedge.
    corner: (W,) the first corner of each wedge, 3 t + k for corner k of face t of `triangle`.
    freedom: (V,) int8, one of `FREE`, `LINE`, `FIXED`.
    """

    point: Floats
    source_point: Ints
    centre: Floats
    scale: float
    source: Indices
    triangle: Indices
    constraint: NDArray[np.uint8]
    wedge: Indices
    corner: Ints
    freedom: NDArray[np.int8]


def surface_of(mesh: Mesh) -> WeldedSurface:
    """Welds a mesh and finds its constrained edges. Raises ValueError as `check_mesh`."""
    check_mesh(mesh)
    source_point, vertex = distinct(mesh.points)
    corners = vertex[mesh.triangles]
    nondegenerate = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    source = np.flatnonzero(nondegenerate).astype(np.int32)
    corners, source_point = _separate_layers(corners[nondegenerate], source_point)
    used, vertices = np.unique(corners, return_inverse=True)
    source_point = source_point[used]
    triangle = vertices.reshape(-1, 3).astype(np.int32)
    point = mesh.points[source_point]
    low, high = point.min(axis=0, initial=np.inf), point.max(axis=0, initial=-np.inf)
    centre = low / 2 + high / 2 if len(point) else np.zeros(3)
    side = float((high / 2 - low / 2).max()) if len(point) else 0.0
    scale = ldexp(1.0, min(max(frexp(side)[1], -1021), 1023)) if side > 0 else 1.0
    point = (point - centre) / scale

    count = len(source_point)
    constraint, leader, ends = _constraints(mesh, source, triangle, count)
    corner, number = np.unique(leader, return_inverse=True)
    wedge = number.reshape(-1, 3).astype(np.int32)
    freedom = np.full(count, FIXED, np.int8)
    freedom[ends == 2] = LINE
    wedges = np.bincount(triangle.reshape(-1)[corner], minlength=count)
    freedom[(ends == 0) & (wedges == 1)] = FREE
    return WeldedSurface(
        point, source_point, centre, scale, source, triangle, constraint, wedge, corner, freedom
    )


def check_mesh(mesh: Mesh) -> None:
    """Raises ValueError for arrays of the wrong shape, indices out of range, and numbers that are
    not finite."""
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


def _separate_layers(triangle: Ints, source_point: Ints) -> tuple[Ints, Ints]:
    """(T, 3) triangles and (V,) source points with separate vertices for coincident faces."""
    first, group = distinct(np.sort(triangle, axis=1))
    if len(first) == len(group):
        return triangle, source_point
    order = np.argsort(group, kind="stable")
    begin = np.searchsorted(group[order], np.arange(len(first)))
    layer = np.empty(len(order), np.int64)
    layer[order] = np.arange(len(order)) - begin[group[order]]
    vertex, index = np.unique(layer[:, None] * len(source_point) + triangle, return_inverse=True)
    return index.reshape(-1, 3), source_point[vertex % len(source_point)]


@dataclass(frozen=True)
class HalfEdges:
    """Edges of a mesh and their half-edges.

    Half-edge 3 t + k runs from corner k of face t to its next corner.

    Attributes
    ----------
    order: (3 T,) half-edges, grouped by edge.
    start: (E,) first index of each edge in `order`.
    faces: (E,) number of faces of each edge.
    key: (E,) ascending keys of the edges: lower vertex times V plus higher vertex.
    count: V.
    begin: (3 T,) first vertex of each half-edge.
    """

    order: Ints
    start: Ints
    faces: Ints
    key: Ints
    count: int
    begin: Ints

    @property
    def ends(self) -> tuple[Ints, Ints]:
        """(E,) lower and (E,) higher vertices of the edges."""
        first, second = np.divmod(self.key, max(self.count, 1))
        return first, second

    @property
    def pairs(self) -> tuple[Ints, Ints]:
        """(P,) and (P,) opposite half-edges of the edges of two faces of consistent orientation."""
        start = self.start[self.faces == 2]
        first, second = self.order[start], self.order[start + 1]
        agree = self.begin[first] != self.begin[second]
        return first[agree], second[agree]


def edges_of(triangle: NDArray[np.integer[Any]], count: int) -> HalfEdges:
    """Edges of (T, 3) triangles over ``count`` vertices."""
    begin = triangle.reshape(-1).astype(np.int64)
    end = np.roll(triangle, -1, axis=1).reshape(-1).astype(np.int64)
    edge = np.minimum(begin, end) * count + np.maximum(begin, end)
    order = np.argsort(edge, kind="stable")
    first = np.ones(len(order), bool)
    first[1:] = np.diff(edge[order]) != 0
    start = np.flatnonzero(first)
    faces = np.diff(start, append=len(order))
    return HalfEdges(order, start, faces, edge[order[start]], count, begin)


def _constraints(
    mesh: Mesh, source: Indices, triangle: Indices, count: int
) -> tuple[NDArray[np.uint8], Ints, Ints]:
    """(T,) constraint bits; (3 T,) the first corner of each corner's wedge; (V,) the number of
    constrained edges of each vertex."""
    edges = edges_of(triangle, count)
    first, second = edges.pairs
    continuous = _is_continuous(mesh, source, first, second)
    first, second = first[continuous], second[continuous]

    is_constrained = np.ones(triangle.size, bool)
    is_constrained[first] = is_constrained[second] = False
    constraint = np.packbits(is_constrained.reshape(-1, 3), axis=1, bitorder="little").reshape(-1)
    is_edge_constrained = is_constrained[edges.order[edges.start]]
    ends = np.bincount(
        np.concatenate([end[is_edge_constrained] for end in edges.ends]), minlength=count
    )
    pairs = [[first, next_corner(second)], [next_corner(first), second]]
    return constraint, connect(triangle.size, np.concatenate(pairs, axis=1).T), ends


def next_corner(corner: Ints) -> Ints:
    """The next corner of the same face."""
    return np.where(corner % 3 == 2, corner - 2, corner + 1)


def _is_continuous(mesh: Mesh, source: Indices, first: Ints, second: Ints) -> Bools:
    """(P,) whether material, texture coordinates and colours are continuous across edges, given
    by their opposite half-edges."""
    first_face, second_face = source[first // 3], source[second // 3]
    ends = ((first % 3, next_corner(second) % 3), (next_corner(first) % 3, second % 3))
    same = np.ones(len(first), bool)
    if mesh.material is not None:
        same &= mesh.material[first_face] == mesh.material[second_face]
    if mesh.uv is not None:
        for a, b in ends:
            first_uv, second_uv = mesh.uv[first_face, a], mesh.uv[second_face, b]
            tolerance = UV_SHARE * np.maximum(np.abs(first_uv), np.abs(second_uv))
            same &= (np.abs(first_uv - second_uv) <= tolerance).all(axis=1)
    if mesh.colors is not None:
        for a, b in ends:
            same &= (mesh.colors[first_face, a] == mesh.colors[second_face, b]).all(axis=1)
    return same
