"""Convex hulls and portals in the numbers of the files, convex for every client.

The numbers are float32 in their shortest decimals. A VRML browser reads exactly that float32;
JavaScript and NumPy read the decimals as float64, which differ by up to half a unit of float32's
last place. The difference does not matter for points. A plane or a line through points that are
close together turns by the difference over their distance.

- A facet of a hull may be a sliver, a tenth of a millimetre high or less: a vertex near the edge of
  a large face. The convex hull is exact in float32, but read as float64 such a facet cut up to 5 m
  into its cell (two rooms whose corners are moved by 3 mm to 3 cm). The vertices of such a hull are
  written with the digits of float64, which are the float32 numbers in both readings. (Rejected:
  other triangles over the same vertices, no longer the exact hull in either reading; fewer
  vertices, which do not enclose the cell: a cell with a bevel of 0.1 mm has no hull without
  slivers.)
- A leaf may be thin for a model of kilometres: its faces are hardly wider than the distance within
  which a point lies in a plane, and float32 turns them. Such a leaf has float64's digits, too.
- A portal may have a vertex in the middle of a side, with a short edge beside it: rounding bends
  the side inwards there, and the line through the short edge leaves corners outside. The vertex is
  dropped, as the convex hull of the rounded polygon would drop it. (Rejected: float64 digits.
  Hints hold float32 numbers, and a client may keep them as such.)

`convex_hull` is exact. A client culls whole cells by their hulls, so a hull must enclose its cell
in the floats that the client reads. They are integers times a power of two, and all determinants
are those of integers. Incremental construction: start from a tetrahedron, then replace the
triangles that are visible from a new point by the fan from that point over their horizon. Vertices
within a face or an edge are dropped, and the corners alone are joined again. Most of many points
are dropped beforehand: those certainly inside the hull of the outermost few. (Rejected: Qhull
through SciPy, one more dependency, which merges or joggles nearly coplanar faces, as most of a
cell's are. Tried: signs of all triangles at once in float64, with integers where that is uncertain.
Most cells have 8 to 30 points, where calling NumPy takes longer than integers do: 9 ms a cell, 1
now.)
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, cross, normals, polygon_planes
from ptmtools.cells.model import Cells
from ptmtools.errors import DatabaseError
from ptmtools.output.numbers import coordinates, row_texts
from ptmtools.tolerance import ROUNDING_SHARE, Tolerance

#: How far a point may lie outside of a plane or a line as read, as a share of the on-plane distance
#: of the leaves' extent: clients and `ptm validate` allow the whole of it.
SLACK_SHARE = 0.5
_TINY = np.finfo(np.float64).tiny


def slack_of(cells: Cells) -> float:
    """The largest distance of a point outside of its hull or portal as read, metres."""
    return SLACK_SHARE * Tolerance.for_points(cells.leaf_point).plane


def hull_rows(points: Singles, triangles: NDArray[np.integer], slack: float) -> list[str]:
    """The text of each vertex of a convex hull: the shortest decimals if the hull is convex in them
    within ``slack`` metres, else float64's, which are the float32 numbers themselves.

    Parameters
    ----------
    points: (h, 3) vertices.
    triangles: (f, 3) indices into them, counter-clockwise seen from outside.
    """
    rows, exact = row_texts(points), points.astype(np.float64)
    decimals = np.array([row.split() for row in rows], dtype=np.float64)
    # No point is in front of an exact facet, so turning it lifts none farther than `reach`.
    unit = _units(decimals[triangles])
    turn = np.linalg.norm(unit - _units(exact[triangles]), axis=1)
    reach = turn * np.linalg.norm(np.ptp(exact, axis=0))
    slivers = ~(reach <= slack)
    height = unit[slivers] @ decimals.T
    height -= np.einsum("ij,ij->i", unit[slivers], decimals[triangles[slivers, 0]])[:, None]
    return rows if (height <= slack).all() else row_texts(exact)


def leaf_numbers(cells: Cells, slack: float) -> list[list[list[float]]]:
    """The vertices of each leaf as the numbers to write: float32's, or float64's where the leaf is
    not convex in those within ``slack`` metres.

    Raises DatabaseError: PTM-D601 a number is not finite in float32.
    """
    points = coordinates(cells.leaf_point, "leaf points")
    decimals, start, faces = np.array(points, np.float64), cells.leaf_point_start, cells.face_start
    unit = _face_units(cells, decimals)
    turn = np.linalg.norm(unit - _face_units(cells, cells.leaf_point), axis=1)
    low, high = (
        end.reduceat(cells.leaf_point, start[:-1], axis=0) for end in (np.minimum, np.maximum)
    )
    reach = np.maximum.reduceat(turn, cells.leaf_face_start[:-1])
    reach *= np.linalg.norm(high - low, axis=1)
    numbers: list[list[list[float]]] = []
    for leaf, (a, b) in enumerate(pairwise(start.tolist())):
        numbers.append(points[a:b])
        if reach[leaf] > slack:
            face_range = slice(*cells.leaf_face_start[leaf : leaf + 2].tolist())
            corner = decimals[cells.face_index[faces[:-1][face_range]]]
            height = (
                unit[face_range] @ decimals[a:b].T
                - np.einsum("ij,ij->i", unit[face_range], corner)[:, None]
            )
            if height.max() > slack:
                numbers[-1] = cells.leaf_point[a:b].tolist()
    return numbers


def _face_units(cells: Cells, point: Floats) -> Floats:
    """(F, 3) unit normals of the faces of all leaves with vertices at ``point``; 0 for a sliver,
    the plane of which is arbitrary."""
    following = np.arange(1, len(cells.face_index) + 1)
    following[cells.face_start[1:] - 1] = cells.face_start[:-1]
    corner_point, start = point[cells.face_index], cells.face_start[:-1]
    planes, sound = polygon_planes(
        corner_point, corner_point[following], start, cells.tolerance.plane
    )
    unit: Floats = planes[:, :3] * sound[:, None]
    return unit


def portal_polygons(
    point: Floats, start: NDArray[np.integer], normal: Floats, slack: float
) -> list[list[list[float]]]:
    """The vertices of portals as the numbers to write: convex within ``slack`` metres, read as
    float32 or as float64.

    Parameters
    ----------
    point, start: (Q, 3) vertices of convex polygons; (K + 1,) CSR over polygons.
    normal: (K, 3) unit normals, counter-clockwise about which the vertices are.

    Raises DatabaseError: PTM-D601 a number is not finite in float32.
    """
    if len(start) < 2:
        return []
    points = coordinates(point, "portals")
    decimals = np.array(points, dtype=np.float64)
    readings = np.stack([decimals, decimals.astype(np.float32).astype(np.float64)])
    bent = _may_be_concave(readings, start, normal, slack)
    polygons = []
    for k, (first, last) in enumerate(zip(start[:-1].tolist(), start[1:].tolist(), strict=True)):
        polygon = points[first:last]
        if bent[k]:
            kept = _convex(readings[:, first:last], normal[k], slack)
            polygon = [polygon[corner] for corner in kept]
        polygons.append(polygon)
    return polygons


def _units(corners: Floats) -> Floats:
    """(f, 3) unit normals of (f, 3, 3) triangles; NaN for one without area."""
    normal = normals(corners)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit: Floats = normal / np.linalg.norm(normal, axis=1)[:, None]
    return unit


def _may_be_concave(
    readings: Floats, start: NDArray[np.integer], normal: Floats, slack: float
) -> Bools:
    """(K,) whether a polygon of the (r, Q, 3) points may have a corner more than ``slack`` outside
    of an edge: no corner turns inwards so far that all of them together could cause it."""
    size = np.diff(start)
    following = np.arange(1, start[-1] + 1)
    following[start[1:] - 1] = start[:-1]
    edge = readings[:, following] - readings
    length = np.linalg.norm(edge, axis=2)
    turn = np.einsum("rqi,qi->rq", cross(edge, edge[:, following]), np.repeat(normal, size, axis=0))
    with np.errstate(invalid="ignore", divide="ignore"):
        turn /= length * length[:, following]
    reach = size * np.add.reduceat(length, start[:-1], axis=1)
    straight = turn * np.repeat(reach, size, axis=1) >= -slack
    return ~np.logical_and.reduceat(straight.all(axis=0), start[:-1])


def _convex(readings: Floats, normal: Floats, slack: float) -> list[int]:
    """Which corners of the (r, n, 3) readings of a polygon to keep, ascending: all but those that
    reach the least beyond the line between their neighbours, until it is convex."""
    kept = list(range(readings.shape[1]))
    while len(kept) > 3 and _concavity(points := readings[:, kept], normal) > slack:
        before = np.roll(points, 1, axis=1)
        chord = np.roll(points, -1, axis=1) - before
        height = cross(points - before, chord) @ normal
        height /= np.maximum(np.linalg.norm(chord, axis=2), _TINY)
        del kept[int(height.min(axis=0).argmin())]
    return kept


def _concavity(readings: Floats, normal: Floats) -> float:
    """How far a corner of (r, n, 3) polygons lies outside of the line of an edge, metres."""
    edge = np.roll(readings, -1, axis=1) - readings
    inner = cross(normal, edge) / np.maximum(np.linalg.norm(edge, axis=2), _TINY)[..., None]
    inside = np.einsum("rik,rjk->rij", inner, readings)
    inside -= np.einsum("rik,rik->ri", inner, readings)[..., None]
    return float(-inside.min())


_Whole = tuple[int, int, int]


#: Corners a, b, c and the normal n; a point p lies outside where n · p is greater than the last.
_Face = tuple[int, int, int, int, int, int, int]


#: Number of points from which dropping the inner ones first is faster.
_MANY = 64


#: The outermost points to either side along these are taken.
_DIRECTIONS = np.array(
    [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1)]
    + [(0, 1, 1), (0, 1, -1), (1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)],
    dtype=np.float64,
)


def convex_hull(points: Singles) -> tuple[Singles, NDArray[np.int32]]:
    """The hull of (n, 3) points.

    Returns (points, triangles): the (h, 3) vertices of the hull in lexical order, and (f, 3)
    indices into them, counter-clockwise seen from outside, in lexical order.

    Raises DatabaseError: PTM-D601 if the points lie in one plane.
    """
    distinct = np.unique(points, axis=0)
    if len(distinct) >= _MANY:
        distinct = _outer(distinct)
    faces = _incremental(_whole(distinct))
    extreme = _extreme(faces)
    if len(extreme) < len(distinct):
        distinct = distinct[extreme]
        faces = _incremental(_whole(distinct))
    triangles = np.array([face[:3] for face in faces], dtype=np.int32)
    turn = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3
    triangles = np.take_along_axis(triangles, turn, axis=1)
    order = np.lexsort((triangles[:, 2], triangles[:, 1], triangles[:, 0]))
    return distinct, triangles[order]


def _whole(points: Singles) -> list[_Whole]:
    """The points as integers, all of them with the same scale."""
    ratios = [x.as_integer_ratio() for x in points.ravel().tolist()]
    scale = max((denominator for _, denominator in ratios), default=1)
    whole = [n * (scale // d) for n, d in ratios]
    return list(zip(whole[::3], whole[1::3], whole[2::3], strict=True))


def _incremental(points: list[_Whole]) -> list[_Face]:
    faces = _tetrahedron(points)
    for p, (x, y, z) in enumerate(points):
        visible = [f for f in faces if f[3] * x + f[4] * y + f[5] * z > f[6]]
        if not visible:
            continue
        edges = {edge for a, b, c, *_ in visible for edge in ((a, b), (b, c), (c, a))}
        horizon = sorted((a, b) for a, b in edges if (b, a) not in edges)
        removed = set(visible)
        faces = [f for f in faces if f not in removed]
        faces += [_face(points, a, b, p) for a, b in horizon]
    return faces


def _face(points: list[_Whole], a: int, b: int, c: int) -> _Face:
    x, y, z = _normal(points[a], points[b], points[c])
    return (a, b, c, x, y, z, _dot((x, y, z), points[a]))


def _tetrahedron(points: list[_Whole]) -> list[_Face]:
    """Four counter-clockwise triangles over points that lie in no plane."""
    n = len(points)
    c = next((i for i in range(1, n - 1) if any(_normal(points[0], points[-1], points[i]))), None)
    if c is not None:
        base = _face(points, 0, n - 1, c)
        sides = ((i, _dot(base[3:6], p) - base[6]) for i, p in enumerate(points))
        d, side = next(((i, s) for i, s in sides if s), (None, 0))
    if c is None or d is None:
        raise DatabaseError(
            "PTM-D601",
            "a cell is flat after rounding to single precision",
            remedy="use the model's unit with --unit, or make fewer and larger cells",
        )
    a, b = (0, n - 1) if side < 0 else (n - 1, 0)
    return [_face(points, *f) for f in ((a, b, c), (b, a, d), (c, b, d), (a, c, d))]


def _extreme(faces: list[_Face]) -> Ints:
    """The true corners: vertices around which the normals span space."""
    normals: dict[int, list[_Whole]] = {}
    for face in faces:
        for vertex in face[:3]:
            normals.setdefault(vertex, []).append(face[3:6])
    return np.array(sorted(v for v, around in normals.items() if _spans(around)), dtype=np.int64)


def _outer(points: Singles) -> Singles:
    """The points without those that certainly lie inside the hull of the outermost ones."""
    place = points.astype(np.float64)
    height = place @ _DIRECTIONS.T
    few = place[np.unique([height.argmin(axis=0), height.argmax(axis=0)])]
    try:
        faces = _incremental(_whole(few.astype(np.float32)))
    except DatabaseError:  # the few lie in a plane, the others need not
        return points
    inside = np.ones(len(points), dtype=np.bool_)
    for face in faces:
        a, b, c = few[list(face[:3])]
        u, v, w = b - a, c - a, place - a
        plus, minus = u[[1, 2, 0]] * v[[2, 0, 1]], u[[2, 0, 1]] * v[[1, 2, 0]]
        bound = abs(w) @ (abs(plus) + abs(minus)) * ROUNDING_SHARE
        inside &= w @ (plus - minus) < -bound
    return points[~inside]


def _spans(normals: list[_Whole]) -> bool:
    first = normals[0]
    across = next((c for n in normals if any(c := _cross(first, n))), None)
    return across is not None and any(_dot(across, n) for n in normals)


def _normal(a: _Whole, b: _Whole, c: _Whole) -> _Whole:
    """A triangle's normal; all zero if its corners lie in one line."""
    u = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    return _cross(u, (c[0] - a[0], c[1] - a[1], c[2] - a[2]))


def _cross(u: _Whole, v: _Whole) -> _Whole:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def _dot(u: _Whole, v: _Whole) -> int:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
