"""Cuts polygons into triangles without adding points.

Convex polygons become fans around their first vertex, as every viewer draws them; a quad whose
fan would fold over takes its other diagonal. All others are cut by clipping ears in the plane of
their Newell normal (Meisters 1975), which also serves concave, slightly bent and keyhole outlines.
Shapely's constrained Delaunay triangulation was rejected: it refuses outlines that touch
themselves, and needs a GEOS newer than the one we ask for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.tolerance import ROUNDING_SHARE


@dataclass(frozen=True)
class Triangulation:
    """Triangles of polygons.

    Attributes
    ----------
    corner: (T, 3) int64 indices into the corners, ordered by polygon.
    polygon: (T,) int64 the polygon of each triangle.
    tangled: number of polygons whose outline crosses itself; they are cut as fans.
    """

    corner: NDArray[np.int64]
    polygon: NDArray[np.int64]
    tangled: int


def triangulate(corners: NDArray[np.float64], start: NDArray[np.int64]) -> Triangulation:
    """Cut each polygon into triangles of the same winding.

    Parameters
    ----------
    corners: (C, 3) positions; NaN and infinity are passed through.
    start: (P + 1,) polygon p has the corners ``start[p]`` to ``start[p + 1]``, at least three.
    """
    size = np.diff(start)
    corner: list[NDArray[np.int64]] = []
    polygon: list[NDArray[np.int64]] = []
    tangled = 0
    for n in np.unique(size).tolist():
        which = np.flatnonzero(size == n)
        index = start[which][:, None] + np.arange(n)
        if n == 3:
            corner.append(index)
            polygon.append(which)
            continue
        shape = _normalised(corners[index])
        cut, done = _fans(shape)
        corner.append(np.take_along_axis(index[done], cut[done].reshape(-1, 3 * (n - 2)), axis=1))
        corner[-1] = corner[-1].reshape(-1, 3)
        polygon.append(np.repeat(which[done], n - 2))
        for row in np.flatnonzero(~done):
            ears, simple = _clip_ears(shape[row])
            tangled += not simple
            corner.append(index[row][ears])
            polygon.append(np.full(len(ears), which[row]))
    if not corner:
        return Triangulation(np.zeros((0, 3), np.int64), np.zeros(0, np.int64), 0)
    owner = np.concatenate(polygon)
    order = np.argsort(owner, kind="stable")
    return Triangulation(np.concatenate(corner)[order], owner[order], tangled)


def _normalised(shape: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, n, 3) polygons moved to their first vertex and scaled to a size of 1."""
    with np.errstate(all="ignore"):
        moved = shape - shape[:, :1]
        scale = np.abs(moved).max(axis=(1, 2), keepdims=True)
        scaled: NDArray[np.float64] = moved / np.where(scale > 0, scale, 1.0)
    return scaled


def _fans(shape: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Fans (m, n - 2, 3) of local indices, and for which polygons they are right."""
    m, n, _ = shape.shape
    steps = np.arange(1, n - 1)
    fan = np.stack([np.zeros_like(steps), steps, steps + 1], axis=1)
    with np.errstate(all="ignore"):
        cross = np.cross(shape[:, 1:-1], shape[:, 2:])
        normal = cross.sum(axis=1)
        right = (np.einsum("mkc,mc->mk", cross, normal) > ROUNDING_SHARE).all(axis=1)
    cut = np.tile(fan, (m, 1, 1))
    if n == 4:
        other = np.array([[1, 2, 3], [1, 3, 0]])
        with np.errstate(all="ignore"):
            b = shape - shape[:, 1:2]
            halves = np.stack([np.cross(b[:, 2], b[:, 3]), np.cross(b[:, 3], b[:, 0])], axis=1)
            turned = (np.einsum("mkc,mc->mk", halves, normal) > ROUNDING_SHARE).all(axis=1)
        cut[turned & ~right] = other
        right |= turned
    # What is not finite is dropped later; there is nothing to clip.
    right |= ~np.isfinite(shape).all(axis=(1, 2))
    return cut, right


def _clip_ears(shape: NDArray[np.float64]) -> tuple[NDArray[np.int64], bool]:
    """Triangles (k, 3) of one polygon, and whether its outline is simple."""
    n = len(shape)
    cross = np.cross(shape[1:-1], shape[2:])
    fan = np.array([[0, i, i + 1] for i in range(1, n - 1)], dtype=np.int64)
    if np.abs(cross).max() <= ROUNDING_SHARE:
        return fan[:1], True  # a line or a point: one degenerate triangle stands for it
    normal = cross.sum(axis=0)
    axis = int(np.abs(normal).argmax())
    if abs(normal[axis]) <= ROUNDING_SHARE:
        return fan, False
    flat = shape[:, [(axis + 1) % 3, (axis + 2) % 3]] * [1.0, np.sign(normal[axis])]

    ring = list(range(n))
    ears: list[list[int]] = []
    at = tried = 0
    while len(ring) > 2:
        m = len(ring)
        a, b, c = ring[(at - 1) % m], ring[at % m], ring[(at + 1) % m]
        area = _turn(flat[a], flat[b], flat[c])
        if area > ROUNDING_SHARE and not _occupied(flat, ring, a, b, c):
            ears.append([a, b, c])
            ring.pop(at % m)
            at, tried = at % m, 0
        elif tried > m and abs(area) <= ROUNDING_SHARE:
            ring.pop(at % m)  # no ear is left but this point lies on a straight edge
            tried = 0
        else:
            at, tried = (at + 1) % m, tried + 1
            if tried > 2 * m + 2:
                ears += [[ring[0], ring[i], ring[i + 1]] for i in range(1, m - 1)]
                return np.array(ears, dtype=np.int64), False
    return np.array(ears, dtype=np.int64), True


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _occupied(flat: NDArray[np.float64], ring: list[int], a: int, b: int, c: int) -> bool:
    """Whether a vertex of the ring lies in the closed triangle, other than in its corners."""
    p = flat[ring]
    inside = np.ones(len(ring), dtype=bool)
    for s, t in ((a, b), (b, c), (c, a)):
        u, v = flat[s], flat[t]
        inside &= (v[0] - u[0]) * (p[:, 1] - u[1]) - (v[1] - u[1]) * (p[:, 0] - u[0]) >= 0
        inside &= (p != u).any(axis=1)
    return bool(inside.any())
