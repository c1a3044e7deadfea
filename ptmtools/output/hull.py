"""The convex hull of points as they are written, exact.

A client culls whole cells by their hulls, so a hull must hold every point of its cell in the very
floats that it reads. The points are float32, which are integers times a power of two, and all
determinants are those of integers.

Incremental construction: start from a tetrahedron, then replace the triangles that a new point
sees strictly from outside by the fan from that point over their horizon. Vertices that turn out
to lie within a face or an edge are dropped, and the corners alone are joined again. Of many points
most are dropped beforehand: those that certainly lie inside the hull of the outermost few.
(Rejected: Qhull through SciPy. One more dependency, and it merges or joggles nearly coplanar
faces, which most of a cell's are. Tried: signs of all triangles at once in float64, with integers
where that cannot tell. Most cells have 8 to 30 points, where calling NumPy takes longer than
integers do: 9 ms a cell, 1 now.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError
from ptmtools.tolerance import ROUNDING_SHARE

_Whole = tuple[int, int, int]
#: Corners a, b, c and the normal n; a point p lies outside where n · p is greater than the last.
_Face = tuple[int, int, int, int, int, int, int]

#: From this many points on it pays to look for those inside first.
_MANY = 64
#: The outermost points are looked for to either side along these.
_DIRECTIONS = np.array(
    [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1)]
    + [(0, 1, 1), (0, 1, -1), (1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)],
    dtype=np.float64,
)


def convex_hull(points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The hull of (n, 3) points.

    Returns (points, triangles): the (h, 3) vertices of the hull in lexical order, and (f, 3)
    indices into them, counter-clockwise seen from outside, in lexical order.

    Raises DatabaseError: PTM-D603 if the points lie in one plane.
    """
    distinct = np.unique(points, axis=0)
    if len(distinct) >= _MANY:
        distinct = _outer(distinct)
    faces = _incremental(_whole(distinct))
    extreme = _extreme(faces)
    if len(extreme) < len(distinct):
        distinct = distinct[extreme]
        faces = _incremental(_whole(distinct))
    found = np.array([face[:3] for face in faces], dtype=np.int32)
    turn = (found.argmin(axis=1)[:, None] + np.arange(3)) % 3
    found = np.take_along_axis(found, turn, axis=1)
    return distinct, found[np.lexsort((found[:, 2], found[:, 1], found[:, 0]))]


def _whole(points: NDArray[np.float32]) -> list[_Whole]:
    """The points as integers, all of them with the same scale."""
    ratios = [x.as_integer_ratio() for x in points.ravel().tolist()]
    scale = max((denominator for _, denominator in ratios), default=1)
    whole = [n * (scale // d) for n, d in ratios]
    return list(zip(whole[::3], whole[1::3], whole[2::3], strict=True))


def _incremental(points: list[_Whole]) -> list[_Face]:
    faces = _tetrahedron(points)
    for p, (x, y, z) in enumerate(points):
        seen = [f for f in faces if f[3] * x + f[4] * y + f[5] * z > f[6]]
        if not seen:
            continue
        edges = {edge for a, b, c, *_ in seen for edge in ((a, b), (b, c), (c, a))}
        horizon = sorted((a, b) for a, b in edges if (b, a) not in edges)
        gone = set(seen)
        faces = [f for f in faces if f not in gone]
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
            "PTM-D603",
            "a cell is flat after rounding to single precision",
            remedy="give the model's unit with --unit, or make fewer and larger cells",
        )
    a, b = (0, n - 1) if side < 0 else (n - 1, 0)
    return [_face(points, *f) for f in ((a, b, c), (b, a, d), (c, b, d), (a, c, d))]


def _extreme(faces: list[_Face]) -> NDArray[np.int64]:
    """The true corners: vertices around which the normals span space."""
    normals: dict[int, list[_Whole]] = {}
    for face in faces:
        for vertex in face[:3]:
            normals.setdefault(vertex, []).append(face[3:6])
    return np.array(sorted(v for v, around in normals.items() if _spans(around)), dtype=np.int64)


def _outer(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Without points that lie inside the hull of the outermost ones, beyond doubt."""
    place = points.astype(np.float64)
    height = place @ _DIRECTIONS.T
    few = place[np.unique([height.argmin(axis=0), height.argmax(axis=0)])]
    try:
        faces = _incremental(_whole(few.astype(np.float32)))
    except DatabaseError:  # the few are flat, which says nothing of the others
        return points
    inside = np.ones(len(points), dtype=np.bool_)
    for face in faces:
        a, b, c = few[list(face[:3])]
        u, v, w = b - a, c - a, place - a
        left, right = u[[1, 2, 0]] * v[[2, 0, 1]], u[[2, 0, 1]] * v[[1, 2, 0]]
        bound = abs(w) @ (abs(left) + abs(right)) * ROUNDING_SHARE
        inside &= w @ (left - right) < -bound
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
