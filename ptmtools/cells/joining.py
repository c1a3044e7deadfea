"""Joining of pieces of geometry with the same owners, which the cuts along leaves have separated.

A triangle all of whose pieces have the same owners is restored to the last bit. Of the others, and
of triangles that continue each other (`patches`), pieces with the same owners are united
(`outlines`) and divided into triangles anew (`planar.triangulate_rings`).

No position is new, a corner is removed from all triangles that have it or from none, and a corner
on a shared edge is in all triangles of the edge. So no new gaps open. Only triangles of several
owners go through GEOS; all others cost a few sorts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas, cross, normals, ranges
from ptmtools.cells.outlines import (
    Edges,
    bent_corners,
    loops,
    split_at_corners,
    straight_corners,
    unite_edges,
)
from ptmtools.cells.ownership import Pieces
from ptmtools.cells.planar import triangulate_rings
from ptmtools.cells.search import connect, distinct, first_alike, weld
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance

#: Texture coordinates that differ by less are the same: a tenth of a texel of 8,192.
_UV = 1.2e-5
#: An edge of more triangles than this is left alone.
_MOST = 8


def patches(scene: Scene, triangle: Ints, corner: Ints, may: Bools, tolerance: Tolerance) -> Ints:
    """(n,) for each of the scene's triangles, (n,) ``triangle``, the index of the largest one that
    it continues, directly or through others, or its own.

    ``corner``: (n, 3) numbers of their corners; ``may``: (n,) which may be joined to others.

    An edge is left alone unless all triangles there continue each other in pairs: a wall that
    stands on a floor ends in its edges.
    """
    edge, i, j = _opposite(corner)
    corners, uv = scene.corners[triangle], scene.uv[triangle]
    if scene.colors is not None:  # they differ where they are a level of 255 apart
        uv = np.concatenate([uv, 2 * _UV * scene.colors[triangle].astype(np.float64)], axis=2)
    if scene.normal_uv is not None:
        uv = np.concatenate([uv, scene.normal_uv[triangle]], axis=2)
    flat, same = _continues(corners, uv, i // 3, j // 3, tolerance)
    back = _continues(corners, uv, j // 3, i // 3, tolerance)
    flat, same = flat & back[0], same & back[1]
    paired = np.bincount(np.append(i[flat], j[flat]), minlength=corner.size) == 1
    alone = np.zeros(int(edge.max(initial=-1)) + 1, dtype=np.bool_)
    alone[edge[~paired]] = True
    joins = flat & same & ~alone[edge[i]]
    i, j = i[joins] // 3, j[joins] // 3
    for look in (scene.triangle_object, scene.triangle_material, scene.two_sided, may):
        attribute = look if look is may else look[triangle]
        alike = attribute[i] == attribute[j]
        i, j = i[alike], j[alike]
    i, j = i[may[i]], j[may[i]]
    group = connect(len(triangle), np.stack([i, j], axis=1))
    # Named by its largest triangle, of which all others must be continuations: many small steps
    # lead around a column.
    order = np.lexsort((np.arange(len(group)), -areas(corners), group))
    first = order[np.append(True, np.diff(group[order]) != 0)[: len(order)]]
    largest = np.empty(len(group), dtype=np.int64)
    largest[group[first]] = first
    largest = largest[group]
    row = np.arange(len(group))
    fits = np.logical_and(*_continues(corners, uv, largest, row, tolerance)) | (largest == row)
    stray = np.zeros(len(group), dtype=np.bool_)
    stray[group[~fits]] = True
    return np.where(stray[group], row, largest)


def _opposite(corner: Ints) -> tuple[Ints, Ints, Ints]:
    """The number of each edge of (n, 3) triangles, (3n,), equal for edges with the same ends; and
    all pairs of edges, by row, with the same ends in opposite directions."""
    start, end = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    code = np.minimum(start, end) * (int(corner.max(initial=-1)) + 1) + np.maximum(start, end)
    _, edge, users = np.unique(code, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    order = np.argsort(edge, kind="stable")
    users = users[edge[order]]
    place = np.arange(len(order))
    last = np.searchsorted(edge[order], edge[order], "right") - 1
    more = np.where(users <= _MOST, last - place, 0)
    i, j = np.repeat(order, more), order[ranges(place + 1, more)]
    opposite = start[i] == end[j]
    return edge, i[opposite], j[opposite]


def _continues(
    corners: Floats, uv: Floats, triangle: Ints, candidate: Ints, tolerance: Tolerance
) -> tuple[Bools, Bools]:
    """Whether each ``candidate`` lies in the plane of a ``triangle`` and faces the same way, and
    whether its texture coordinates (and colours) continue those of the latter."""
    origin = corners[triangle, 0]
    a, b = corners[triangle, 1] - origin, corners[triangle, 2] - origin
    aa, ab, bb = (np.einsum("ij,ij->i", p, q) for p, q in ((a, a), (a, b), (b, b)))
    across = normals(corners)
    flat = np.einsum("ij,ij->i", across[triangle], across[candidate]) > 0
    same = np.ones(len(triangle), dtype=np.bool_)
    with np.errstate(divide="ignore", invalid="ignore"):  # one without area is continued by none
        scale = 1 / (aa * bb - ab**2)
        for k in range(3):
            to = corners[candidate, k] - origin
            to_a, to_b = (np.einsum("ij,ij->i", to, side) for side in (a, b))
            x = ((bb * to_a - ab * to_b) * scale)[:, None]
            y = ((aa * to_b - ab * to_a) * scale)[:, None]
            flat &= np.linalg.norm(to - x * a - y * b, axis=1) <= tolerance.file
            expected = (
                uv[triangle, 0]
                + x * (uv[triangle, 1] - uv[triangle, 0])
                + y * (uv[triangle, 2] - uv[triangle, 0])
            )
            same &= np.abs(expected - uv[candidate, k]).max(axis=1) <= _UV
    return flat, same


_NO_OWNER = -1


@dataclass(frozen=True)
class CutMesh:
    """The geometry cut to the cells; the attributes are those of `Cells`."""

    vertex: Floats
    vertex_uv: Floats
    triangle: NDArray[np.int32]
    triangle_source: NDArray[np.int32]
    triangle_cell: NDArray[np.int32]
    visible: int
    owners: int


@dataclass(frozen=True)
class _Cut:
    """Pieces that may be joined."""

    corner: Floats  # (K, 3, 6) as in `Pieces`
    source: Ints  # (K,)
    owner: NDArray[np.integer]  # (K, 2)


@dataclass(frozen=True)
class _Parts:
    """Triangles on their way to a mesh."""

    point: Floats  # (n, 3, 3) corners
    uv: Floats  # (n, 3, 2)
    source: Ints  # (n,)
    owner: NDArray[np.integer]  # (n, 2)


def join_pieces(
    scene: Scene, pieces: Pieces, owner: NDArray[np.int32], tolerance: Tolerance
) -> CutMesh:
    """Join pieces with the same ``owner``: (M, 2) the cells in front of and behind each piece, -1
    for none. Pieces without owners are dropped."""
    count = len(scene.triangles)
    owned = (owner != _NO_OWNER).any(axis=1)
    first = np.searchsorted(pieces.source, np.arange(count))
    alike = (owner == owner[first[pieces.source]]).all(axis=1)
    single = np.bincount(pieces.source, ~alike, count) == 0
    parted = np.bincount(pieces.source, owned, count) > 0
    single, parted = single & parted, parted & ~single
    corner = first_alike(scene.points)[scene.triangles]
    adjacent = single & _sharing_edges(corner, parted)
    whole = np.flatnonzero(single & ~adjacent)
    taken = owned & parted[pieces.source]
    uncut = np.tile(np.eye(3), (int(adjacent.sum()), 1, 1))
    # A triangle with several owners is cut.
    parts = pieces.corner[np.searchsorted(pieces.cut, np.flatnonzero(taken))]
    cut = _Cut(
        np.concatenate([np.dstack([scene.corners[adjacent], uncut]), parts]),
        np.concatenate([np.flatnonzero(adjacent), pieces.source[taken]]),
        np.concatenate([owner[first[adjacent]], owner[taken]]),
    )
    ready = _Parts(scene.corners[whole], scene.uv[whole], whole, owner[first[whole]])
    return _mesh(
        [ready, *_Network.from_pieces(scene, cut, parted, tolerance).parts(scene)],
        _emitters(scene, pieces.source, owner),
    )


def _emitters(scene: Scene, source: Ints, owner: NDArray[np.int32]) -> Ints:
    """(n,) each triangle of the scene once for every cell that emits some of it, ascending."""
    front, back = owner.T
    behind = (back != front) & scene.two_sided[source]
    triangle = np.append(source, source[behind])
    cell = np.append(front, back[behind])
    code = triangle * (int(cell.max(initial=0)) + 1) + cell
    return np.unique(code[cell != _NO_OWNER]) // (int(cell.max(initial=0)) + 1)


def _sharing_edges(corner: NDArray[np.integer], marked: Bools) -> Bools:
    """(T,) which triangles, (T, 3) numbers of their corners, share an edge with a marked one."""
    touched = np.zeros(int(corner.max(initial=-1)) + 1, dtype=np.bool_)
    touched[corner[marked]] = True
    near = np.flatnonzero(touched[corner].sum(axis=1) >= 2)
    code = _codes(corner[near], len(touched))
    sharing = np.zeros(len(corner), dtype=np.bool_)
    sharing[near] = np.isin(code, code[marked[near]]).any(axis=1)
    return sharing


def _codes(corner: NDArray[np.integer], count: int) -> Ints:
    """(T, 3) a number for the edge that begins in each corner, below ``count``, of each triangle,
    the same in both directions."""
    start = corner.astype(np.int64)
    end = np.roll(start, -1, axis=1)
    return np.minimum(start, end) * count + np.maximum(start, end)


@dataclass(frozen=True)
class _Network:
    """Pieces of triangles that share edges, each edge split at all corners on it."""

    cut: _Cut
    points: Floats  # (n, 3) by the numbers of corners
    name: Ints  # (K,) the triangle of the scene that represents each
    corner: Ints  # (K, 3) numbers of the corners of each piece
    kind: Ints  # (K,) equal for pieces that may be united
    frame: Floats  # (K, 2, 3) two unit vectors in the plane of each piece
    fixed: Bools  # (n,) which corners are those of the model
    edges: Edges
    weight: Floats  # (m, 3) barycentric starts of edges, in the triangle of their piece
    reach: float

    @staticmethod
    def from_pieces(scene: Scene, cut: _Cut, parted: Bools, tolerance: Tolerance) -> _Network:
        reach = tolerance.rounding
        triangle, triangle_of_piece = np.unique(cut.source, return_inverse=True)
        model = scene.corners[triangle]
        points = np.concatenate([model.reshape(-1, 3), cut.corner[..., :3].reshape(-1, 3)])
        # The model's own corners stay distinct, however near each other.
        same, number = first_alike(points), weld(points, reach)
        number = np.where(same < model.size // 3, same, number)
        whole, corner = np.split(number.reshape(-1, 3), [len(triangle)])
        sound = (corner != np.roll(corner, 1, axis=1)).all(axis=1)
        corner, triangle_of_piece = corner[sound], triangle_of_piece[sound]
        cut = _Cut(cut.corner[sound], cut.source[sound], cut.owner[sound])

        piece = np.repeat(np.arange(len(corner)), 3)
        edges = Edges(corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1), piece)
        start = cut.corner[..., 3:].reshape(-1, 3)
        end = np.roll(cut.corner[..., 3:], -1, axis=1).reshape(-1, 3)
        lines = _lines(whole, triangle_of_piece, edges, start, end)
        parts, edge, place = split_at_corners(points, edges, lines, reach)
        group = patches(scene, triangle, whole, parted[triangle], tolerance)
        _, kind = np.unique(
            np.column_stack([group[triangle_of_piece], cut.owner]), axis=0, return_inverse=True
        )
        fixed = np.zeros(len(points), dtype=np.bool_)
        fixed[whole] = True
        return _Network(
            cut=cut,
            points=points,
            name=triangle[group[triangle_of_piece]],
            corner=corner,
            kind=kind.reshape(-1),
            frame=_frames(model)[group[triangle_of_piece]],
            fixed=fixed,
            edges=parts,
            weight=start[edge] + place[:, None] * (end[edge] - start[edge]),
            reach=reach,
        )

    def parts(self, scene: Scene) -> list[_Parts]:
        """The triangles of the unions of pieces. A union that cannot be divided into triangles, as
        in models with folds as thin as rounding, stays in pieces, with all its corners."""
        count = len(self.corner)
        apart, fixed = np.zeros(count, dtype=np.bool_), self.fixed.copy()
        while True:
            kind = np.where(apart, len(self.points) + np.arange(count), self.kind)
            outline, union = unite_edges(self.edges, kind)
            row, union_of = self._triangles(outline, fixed)
            done = np.zeros(count, dtype=np.bool_)
            done[union_of] = True
            lost = ~done[union] & ~apart
            if not lost.any():
                break
            apart |= lost
            fixed[self.edges.start[lost[self.edges.polygon]]] = True
        undivided = np.flatnonzero(~done[union])  # pieces alone that cannot be divided either
        corner = outline.start[row]
        at = self._first_starts(union, union_of[:, None] * len(self.points) + corner)
        source = self.cut.source[self.edges.polygon[at]]
        uv = np.einsum("mcw,mcwk->mck", self.weight[at], scene.uv[source])
        weight = self.cut.corner[undivided, :, 3:]
        undivided_uv = np.einsum("mcw,mwk->mck", weight, scene.uv[self.cut.source[undivided]])
        return [
            _Parts(self.points[corner], uv, self.name[union_of], self.cut.owner[union_of]),
            _Parts(
                self.points[self.corner[undivided]],
                undivided_uv,
                self.name[undivided],
                self.cut.owner[undivided],
            ),
        ]

    def _triangles(self, outline: Edges, fixed: Bools) -> tuple[Ints, Ints]:
        """(m, 3) edges of the outlines of unions, whose starts are the corners of triangles, and
        (m,) the union of each; without corners that no edge needs, unless they are ``fixed``."""
        # 1. Edges follow one another in loops, each edge once: row (e,), loop k is
        #    row[start[k]:start[k + 1]]; ``flat`` (e, 2, 2) has the ends of each in its plane.
        frame, origin = self.frame[outline.polygon], self.points[self.corner[outline.polygon, 0]]
        ends = np.stack([self.points[outline.start], self.points[outline.end]], axis=1)
        flat = np.einsum("nek,nfk->nef", ends - origin[:, None], frame)
        row, start = loops(flat, outline)
        corner = outline.start[row]
        # 2. Corners on straight edges go, in all unions or in none, unless they are fixed, so many
        #    small bends would make a large one, or their loop would keep fewer than three.
        spare = np.zeros(len(self.points), dtype=np.bool_)
        spare[straight_corners(self.points, outline, self.reach)] = True
        spare &= ~fixed
        while len(bent := bent_corners(self.points[corner], start, spare[corner], self.reach)):
            spare[corner[bent]] = False
        loop = np.repeat(np.arange(len(start) - 1), np.diff(start))
        stays = ~spare[corner]
        stays &= np.bincount(loop[stays], minlength=len(start) - 1)[loop] >= 3
        row, size = row[stays], np.bincount(loop[stays])
        size = size[size > 0]
        start = np.append(0, np.cumsum(size)).astype(np.int64)
        # 3. The outer loop of each union comes first; it alone runs counter-clockwise, by twice its
        #    signed area.
        x, y = flat[row, 0].T
        after = np.arange(len(row)) + 1
        after[start[1:] - 1] = start[:-1]
        area = np.add.reduceat(x * y[after] - y * x[after], start[:-1]) if len(row) else x
        union = outline.polygon[row[start[:-1]]]
        order = np.lexsort((area <= 0, union))
        row = row[ranges(start[order], size[order])]
        unions, polygon = np.unique(union[order], return_inverse=True)
        polygon = polygon.reshape(-1)
        # 4. Unions with one outer loop are divided into triangles: (m, 3) rows of ``row``.
        start = np.append(0, np.cumsum(size[order]))
        triangle, owner = triangulate_rings(flat[row, 0], start, polygon)
        simple = np.bincount(polygon, area[order] > 0) == 1
        triangle, owner = triangle[simple[owner]], owner[simple[owner]]
        return row[triangle], unions[owner]

    def _first_starts(self, union: Ints, key: Ints) -> Ints:
        """The first edges that start in corners of unions; ``key``: union · points + corner."""
        start = union[self.edges.polygon] * len(self.points) + self.edges.start
        known, first = np.unique(start, return_index=True)
        return np.asarray(first[np.searchsorted(known, key)])


def _lines(whole: Ints, triangle_of_piece: Ints, edges: Edges, start: Floats, end: Floats) -> Ints:
    """(n,) numbers of the lines on which edges of pieces may overlap: an edge of the model, shared
    by all its triangles, or the inside of a triangle.

    ``whole``: (T, 3) the corners of the triangles; ``triangle_of_piece``: (K,) that of each piece;
    ``start``, ``end``: (n, 3) the ends of the edges, barycentric.
    """
    inside = triangle_of_piece[edges.polygon]
    # Cuts do not change a coordinate of 0.
    on = (start == 0) & (end == 0)
    # The side opposite to corner k begins in the next.
    code = np.roll(_codes(whole, int(whole.max(initial=0)) + 1), -1, axis=1)
    _, side = np.unique(code, return_inverse=True)
    side = side.reshape(-1, 3)[inside, on.argmax(axis=1)]
    # Inside most edges have cancelled already, which leaves few corners to compare the others with.
    number, way = edges.number_ends()
    _, number = np.unique(number * len(whole) + inside, return_inverse=True)
    number = number.reshape(-1)
    matched = np.bincount(number, way)[number] == 0
    within = np.where(matched, len(whole) + np.arange(len(on)), inside)
    return np.asarray(np.where(on.any(axis=1), side, code.size + within))


def _frames(corners: Floats) -> Floats:
    """(n, 2, 3) unit vectors that span the planes of (n, 3, 3) triangles, right-handed with their
    normals."""
    z = normals(corners)
    across = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    frame = np.stack([x := cross(across, z), cross(z, x)], axis=1)
    length = np.linalg.norm(frame, axis=2, keepdims=True)
    return np.asarray(np.divide(frame, length, out=np.zeros_like(frame), where=length > 0))


def _mesh(parts: list[_Parts], emitters: Ints) -> CutMesh:
    """Parts in the order of the model's triangles, with the vertices that they share."""
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    point, uv, source, owner = (np.concatenate(column) for column in columns)
    order = np.argsort(source, kind="stable")
    rows = np.concatenate([point, uv], axis=2)[order].reshape(-1, 5) + 0.0
    used, index = distinct(rows)
    return CutMesh(
        vertex=rows[used, :3].copy(),
        vertex_uv=rows[used, 3:].copy(),
        triangle=index.reshape(-1, 3).astype(np.int32),
        triangle_source=source[order].astype(np.int32),
        triangle_cell=owner[order].astype(np.int32),
        visible=len(np.unique(emitters)),
        owners=len(emitters),
    )
