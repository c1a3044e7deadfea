"""Handles, connected parts and small holes: faces that no topology-preserving collapse removes.

A part is a set of faces connected by edges; faces that touch only in a vertex belong to different
parts. A closed surface of V vertices, E edges and F faces, in c parts with g handles (its genus),
has V - E + F = 2 c - 2 g. Each face has three edges and each edge two faces, so F = 2 (V - 2 c) +
4 g: a handle costs four faces, however small it is, as does a closed part; a part with a boundary
costs one. Marching cubes of scanned volumes produce thousands of both.

A hole that shares no corner with another costs five faces, however small it is: three vertices
stand for six faces in a closed surface, less the hole itself. Scans with occlusion have thousands
of holes. Where they cost too many faces, `fill_small_holes` fills the holes that are smaller than
the faces of the result and much smaller than their part, so that the outline of a sheet stays open.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.search import connect
from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.model import Mesh
from ptmtools.simplification.surface import HalfEdges, WeldedSurface, edges_of, next_corner

#: Faces required by a handle, by a closed part and by a part with a boundary.
FACES_PER_HANDLE, FACES_PER_CLOSED_PART, FACES_PER_OPEN_PART = 4, 4, 1
#: Handles, parts or holes that require a larger share of the target faces are removed.
MAX_IRREDUCIBLE_SHARE = 0.1


@dataclass(frozen=True)
class Topology:
    """Topological counts of a mesh.

    Attributes
    ----------
    handles: genus, summed over parts; 0 if an edge has more than two faces, where it is undefined.
    closed_parts, open_parts: numbers of parts without and with a boundary.
    """

    handles: int
    closed_parts: int
    open_parts: int

    @property
    def parts(self) -> int:
        """Number of parts."""
        return self.closed_parts + self.open_parts

    @property
    def irreducible_faces(self) -> int:
        """Number of faces required by handles and, if there is more than one part, by parts."""
        parts = FACES_PER_CLOSED_PART * self.closed_parts + FACES_PER_OPEN_PART * self.open_parts
        return FACES_PER_HANDLE * self.handles + parts * (self.parts > 1)


def topology(surface: WeldedSurface) -> Topology:
    """Counts handles and parts. A boundary loop counts as closed by one polygon."""
    triangle = surface.triangle
    edges = edges_of(triangle, len(surface.point))
    part = parts_of(edges, len(triangle))
    boundary = edges.order[edges.start[edges.faces == 1]]
    parts, open_parts = len(np.unique(part)), len(np.unique(part[boundary // 3]))
    handles = 0
    if not (edges.faces > 2).any():
        # Count a vertex once for each fan of faces that touches there.
        fan = _fans(edges, triangle.size)
        begin, end = fan[boundary], fan[next_corner(boundary)]
        loops = len(np.unique(connect(triangle.size, np.stack([begin, end], axis=1))[begin]))
        characteristic = len(np.unique(fan)) - len(edges.start) + len(triangle)
        handles = max(0, (2 * parts - loops - characteristic) // 2)
    return Topology(handles, parts - open_parts, open_parts)


def parts_of(edges: HalfEdges, faces: int) -> Ints:
    """(T,) the lowest face index in the part of each face."""
    shares_edge = np.ones(len(edges.order), np.bool_)
    shares_edge[edges.start] = False
    later = np.flatnonzero(shares_edge)
    return connect(faces, edges.order[np.stack([later - 1, later], axis=1)] // 3)


def _fans(edges: HalfEdges, corners: int) -> Ints:
    """(3 T,) the lowest corner in the fan of each corner: the corners of its vertex that edges of
    two faces connect."""
    start = edges.start[edges.faces == 2]
    first, second = edges.order[start], edges.order[start + 1]
    agree = edges.begin[first] != edges.begin[second]
    begin, end = (
        np.where(agree, next_corner(second), second),
        np.where(agree, second, next_corner(second)),
    )
    return connect(corners, np.concatenate([[first, begin], [next_corner(first), end]], axis=1).T)


Scalar = TypeVar("Scalar", bound=np.generic)

#: Faces required by a hole.
FACES_PER_HOLE = 5
#: Maximum diagonal of a small hole, as a share of the diagonal of its part.
MAX_HOLE_SHARE = 0.1
#: Maximum number of corners of a filled hole.
MAX_HOLE_CORNERS = 64
#: Values instead of an opposite half-edge: boundary, or ambiguous.
BOUNDARY, NON_MANIFOLD = -1, -2


@dataclass(frozen=True)
class FilledMesh:
    """A mesh whose small holes are filled.

    Attributes
    ----------
    mesh: new faces have the material of an adjacent face and the attributes of adjacent corners.
    source: (T + n,) the source face of each face; a new face has that of an adjacent face.
    holes: number of filled holes.
    """

    mesh: Mesh
    source: Ints
    holes: int


class HoleBuffers(NamedTuple):
    """Buffers of `fill_holes`; ``position`` is -1 on entry and return.

    Attributes
    ----------
    visited: (3 T,) whether a half-edge is interior or already processed.
    position: (V,) index of each vertex in the current loop. loop: (n,) half-edges of the loop.
    """

    visited: Bools
    position: Ints
    loop: Ints


def fill_small_holes(mesh: Mesh, surface: WeldedSurface, faces: int) -> FilledMesh | None:
    """Fills the small holes of a mesh if they cost too large a share of the ``faces`` target faces;
    returns None otherwise."""
    if not surface.constraint.any():
        return None
    triangle = surface.triangle.astype(np.int64)
    edges = edges_of(triangle, len(surface.point))
    opposite = np.full(triangle.size, NON_MANIFOLD)
    opposite[edges.order[edges.start[edges.faces == 1]]] = BOUNDARY
    first, second = edges.pairs
    opposite[first], opposite[second] = second, first
    next_edge = np.full(triangle.size, NON_MANIFOLD)
    link_boundaries(opposite, next_edge)

    part = connect(len(surface.point), np.stack(edges.ends, axis=1))
    low, high = np.full(surface.point.shape, np.inf), np.full(surface.point.shape, -np.inf)
    np.minimum.at(low, part, surface.point)
    np.maximum.at(high, part, surface.point)
    a, b, c = (surface.point[triangle[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    # Side of a face of the result, if all faces were equilateral and of equal area.
    side = np.sqrt(4 / np.sqrt(3) * area / max(faces, 1))
    max_diagonal = np.minimum(MAX_HOLE_SHARE * np.linalg.norm(high - low, axis=1), side)[part]
    corner = np.empty((int((opposite == BOUNDARY).sum()), 3), np.int64)
    counts = np.zeros(2, np.int64)
    buffers = HoleBuffers(
        next_edge < 0, np.full(len(surface.point), -1), np.empty(len(corner), np.int64)
    )
    fill_holes(triangle, surface.point, next_edge, max_diagonal, edges.key, buffers, corner, counts)
    holes, corner = int(counts[0]), corner[: counts[1]]
    if FACES_PER_HOLE * holes <= MAX_IRREDUCIBLE_SHARE * faces:
        return None

    face, at = surface.source[corner // 3].astype(np.int64), corner % 3
    source = np.concatenate([np.arange(len(mesh.triangles)), face[:, 0]])
    filled_mesh = Mesh(
        mesh.points,
        _append_corners(mesh.triangles, face, at),
        None if mesh.material is None else mesh.material[source],
        None if mesh.uv is None else _append_corners(mesh.uv, face, at),
        None if mesh.colors is None else _append_corners(mesh.colors, face, at),
    )
    return FilledMesh(filled_mesh, source, holes)


def _append_corners(values: NDArray[Scalar], face: Ints, at: Ints) -> NDArray[Scalar]:
    """Appends the values of some corners to (T, 3, …) values of corners."""
    return np.concatenate([values, values[face, at]])


@kernel
def link_boundaries(opposite: Ints, next_edge: Ints) -> None:
    """Links each boundary half-edge to the next one of the same hole; `NON_MANIFOLD` where faces
    between them have inconsistent orientation."""
    for edge in range(len(opposite)):
        if opposite[edge] != BOUNDARY:
            continue
        at = edge - 2 if edge % 3 == 2 else edge + 1
        while opposite[at] >= 0:
            at = opposite[at]
            at = at - 2 if at % 3 == 2 else at + 1
        if opposite[at] == BOUNDARY:
            next_edge[edge] = at


@kernel
def fill_holes(
    triangle: Ints,
    point: Floats,
    next_edge: Ints,
    max_diagonal: Floats,
    key: Ints,
    buffers: HoleBuffers,
    corner: Ints,
    counts: Ints,
) -> None:
    """Fills the holes whose diagonal is at most ``max_diagonal`` (V,) of their vertices.

    Writes new faces to ``corner`` (n, 3), as corners of ``triangle``, and the numbers of holes and
    faces to ``counts`` (2,). ``key`` (E,) holds the keys of all edges, ascending. Where a boundary
    visits a vertex twice, two holes touch; the loop between the visits is one hole.
    """
    visited, position, loop = buffers.visited, buffers.position, buffers.loop
    for begin in range(len(next_edge)):
        if visited[begin]:
            continue
        count, edge = 0, begin
        while edge >= 0:
            v = triangle[edge // 3, edge % 3]
            first = position[v]
            if first >= 0:
                for i in range(first, count):
                    position[triangle[loop[i] // 3, loop[i] % 3]] = -1
                hole = loop[first:count]
                small = (
                    3 <= len(hole) <= MAX_HOLE_CORNERS
                    and squared_diagonal(triangle, point, hole) <= max_diagonal[v] ** 2
                )
                fillable = small and not is_outer_boundary(triangle, point, hole)
                if fillable and clip_ears(triangle, point, hole, key, corner[counts[1] :]):
                    counts[0] += 1
                    counts[1] += count - first - 2
                count = first
            if visited[edge]:
                break
            visited[edge] = True
            position[v], loop[count] = count, edge
            count += 1
            edge = next_edge[edge]
        for i in range(count):
            position[triangle[loop[i] // 3, loop[i] % 3]] = -1


@kernel
def squared_diagonal(triangle: Ints, point: Floats, loop: Ints) -> float:
    """Squared diagonal of the bounding box of a loop."""
    square = 0.0
    for k in range(3):
        low, high = np.inf, -np.inf
        for i in range(len(loop)):
            value = point[triangle[loop[i] // 3, loop[i] % 3], k]
            low, high = min(low, value), max(high, value)
        square += (high - low) ** 2
    return square


@kernel
def is_outer_boundary(triangle: Ints, point: Floats, loop: Ints) -> bool:
    """Whether a loop is the outer boundary of its faces instead of a hole: a filling would have the
    opposite orientation."""
    agreement = 0.0
    o = triangle[loop[0] // 3, loop[0] % 3]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        fill = face = 0.0
        for edge in loop:
            t = edge // 3
            a, b, c = (
                triangle[t, edge % 3],
                triangle[t, (edge + 1) % 3],
                triangle[t, (edge + 2) % 3],
            )
            # The loop has its faces on the left, so the filling runs in the opposite direction.
            fill += (point[b, i] - point[o, i]) * (point[a, j] - point[o, j])
            fill -= (point[b, j] - point[o, j]) * (point[a, i] - point[o, i])
            face += (point[b, i] - point[a, i]) * (point[c, j] - point[a, j])
            face -= (point[b, j] - point[a, j]) * (point[c, i] - point[a, i])
        agreement += fill * face
    return agreement <= 0.0


@kernel
def clip_ears(triangle: Ints, point: Floats, loop: Ints, key: Ints, corner: Ints) -> bool:
    """Triangulates a loop by ear clipping, the shortest new edge first; False if every ear would
    duplicate an edge."""
    count, clipped = len(loop), 0
    while count > 3:
        least, best = np.inf, -1
        for i in range(count):
            previous, following = (
                loop[i - 1 if i else count - 1],
                loop[i + 1 if i + 1 < count else 0],
            )
            a, b = triangle[previous // 3, previous % 3], triangle[following // 3, following % 3]
            edge = min(a, b) * len(point) + max(a, b)
            at = np.searchsorted(key, edge)
            if a == b or (at < len(key) and key[at] == edge):
                continue
            square = 0.0
            for k in range(3):
                square += (point[a, k] - point[b, k]) ** 2
            if square < least:
                least, best = square, i
        if best < 0:
            return False
        corner[clipped, 0] = loop[best + 1 if best + 1 < count else 0]
        corner[clipped, 1] = loop[best]
        corner[clipped, 2] = loop[best - 1 if best else count - 1]
        clipped += 1
        count -= 1
        for i in range(best, count):
            loop[i] = loop[i + 1]
    corner[clipped, 0], corner[clipped, 1], corner[clipped, 2] = loop[2], loop[1], loop[0]
    return True
