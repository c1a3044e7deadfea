"""The convex hull of points as they are written, exact.

A client culls whole cells by their hulls, so a hull must hold every point of its cell in the very
floats that it reads. The points are float32, which are integers times a power of two; the sign of
each determinant is decided in float64 where its error bound allows and in integers where not.

Incremental construction: start from a tetrahedron, then replace the triangles that a new point
sees strictly from outside by the fan from that point over their horizon. Vertices that turn out
to lie within a face or an edge are dropped, and the corners alone are joined again. (Rejected:
Qhull through SciPy. One more dependency, and it merges or joggles nearly coplanar faces, which
most of a cell's are.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError
from ptmtools.tolerance import ROUNDING_SHARE

_Whole = tuple[int, int, int]


def convex_hull(points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The hull of (n, 3) points.

    Returns (points, triangles): the (h, 3) vertices of the hull in lexical order, and (f, 3)
    indices into them, counter-clockwise seen from outside, in lexical order.

    Raises
    ------
    DatabaseError: PTM-D603 if the points lie in one plane.
    """
    distinct = np.unique(points, axis=0)
    faces = _incremental(distinct)
    extreme = _extreme(distinct, faces)
    if len(extreme) < len(distinct):
        distinct = distinct[extreme]
        faces = _incremental(distinct)
    turn = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    faces = np.take_along_axis(faces, turn, axis=1)
    faces = faces[np.lexsort((faces[:, 2], faces[:, 1], faces[:, 0]))]
    return distinct, faces.astype(np.int32)


def _incremental(points: NDArray[np.float32]) -> NDArray[np.int64]:
    solid = _Determinant(points)
    faces = _tetrahedron(solid, len(points))
    for p in range(len(points)):
        seen = solid.signs(faces, p) > 0
        if not seen.any():
            continue
        edges = {(f[i], f[i - 2]) for f in faces[seen].tolist() for i in range(3)}
        horizon = sorted((a, b) for a, b in edges if (b, a) not in edges)
        fan = np.array([(a, b, p) for a, b in horizon], dtype=np.int64)
        faces = np.concatenate([faces[~seen], fan])
    return faces


def _extreme(points: NDArray[np.float32], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """The true corners: vertices around which the normals span space."""
    solid = _Determinant(points)
    normals: dict[int, list[_Whole]] = {}
    for face in faces.tolist():
        normal = solid.normal(*face)
        for vertex in face:
            normals.setdefault(vertex, []).append(normal)
    return np.array(sorted(v for v, around in normals.items() if _spans(around)), dtype=np.int64)


def _spans(normals: list[_Whole]) -> bool:
    first = normals[0]
    across = next((c for n in normals if any(c := _cross(first, n))), None)
    return across is not None and any(_dot(across, n) for n in normals)


def _cross(u: _Whole, v: _Whole) -> _Whole:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def _dot(u: _Whole, v: _Whole) -> int:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


class _Determinant:
    """Which side of a triangle's plane a point lies on, for (n, 3) distinct points."""

    def __init__(self, points: NDArray[np.float32]) -> None:
        self._float = points.astype(np.float64)
        ratios = [x.as_integer_ratio() for x in self._float.ravel().tolist()]
        scale = max(denominator for _, denominator in ratios)
        whole = [n * (scale // d) for n, d in ratios]
        self._whole = [tuple(whole[i : i + 3]) for i in range(0, len(whole), 3)]

    def signs(self, faces: NDArray[np.int64], p: int) -> NDArray[np.int8]:
        """(f,) +1 where point ``p`` lies outside of a counter-clockwise triangle's plane, 0 in it,
        -1 behind it."""
        a = self._float[faces[:, 0]]
        u, v, w = self._float[faces[:, 1]] - a, self._float[faces[:, 2]] - a, self._float[p] - a
        left = np.stack([u[:, [1, 2, 0]], v[:, [1, 2, 0]]])
        right = np.stack([v[:, [2, 0, 1]], u[:, [2, 0, 1]]])
        products = left * right
        det = np.einsum("ij,ij->i", products[0] - products[1], w)
        bound = np.einsum("ij,ij->i", abs(products).sum(axis=0), abs(w)) * ROUNDING_SHARE
        sign: NDArray[np.int8] = np.sign(det).astype(np.int8)
        for i in np.flatnonzero(abs(det) <= bound).tolist():
            sign[i] = self.exact(int(faces[i, 0]), int(faces[i, 1]), int(faces[i, 2]), p)
        return sign

    def exact(self, a: int, b: int, c: int, p: int) -> int:
        """The same for one triangle, in integers."""
        det = _dot(self.normal(a, b, c), self._from(a, p))
        return (det > 0) - (det < 0)

    def normal(self, a: int, b: int, c: int) -> _Whole:
        """A triangle's normal, in integers; all zero if its corners lie in one line."""
        return _cross(self._from(a, b), self._from(a, c))

    def _from(self, a: int, b: int) -> _Whole:
        o, q = self._whole[a], self._whole[b]
        return (q[0] - o[0], q[1] - o[1], q[2] - o[2])


def _tetrahedron(solid: _Determinant, n: int) -> NDArray[np.int64]:
    """Four counter-clockwise triangles over points that lie in no plane."""
    c = next((i for i in range(1, n - 1) if any(solid.normal(0, n - 1, i))), None)
    sides = ((i, solid.exact(0, n - 1, c, i)) for i in range(n)) if c is not None else iter(())
    d, side = next(((i, s) for i, s in sides if s), (None, 0))
    if c is None or d is None:
        raise DatabaseError(
            "PTM-D603",
            "a cell is flat after rounding to single precision",
            remedy="give the model's unit with --unit, or fewer and larger cells",
        )
    a, b = (0, n - 1) if side < 0 else (n - 1, 0)
    return np.array([(a, b, c), (b, a, d), (c, b, d), (a, c, d)], dtype=np.int64)
