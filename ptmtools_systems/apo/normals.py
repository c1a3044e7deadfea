"""Normals at the corners of a mesh's triangles, smoothed where the surface bends gently.

A corner's normal is the mean of the normals of the triangles around its point that deviate from its
own triangle's by no more than a crease angle, each weighted by its angle at the point (Thürmer and
Wüthrich 1998): weights by area favour long triangles, Max's (1999) tiny ones. Angles come from a
polynomial in the cosine, so that bytes derived from the normals are the same on every machine.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.jit import kernel, plain_kernel

#: Largest angle between smoothed triangles, degrees.
CREASE = 40.0
#: At a point with more triangles than this all are smoothed: comparing all pairs takes the square
#: of their number, and such a fan is a disc or the pole of a sphere.
FAN = 1000
#: arccos x = √(1 − x) · polynomial for 0 ≤ x ≤ 1, within 2e-4 (Abramowitz and Stegun 4.4.45, but
#: continuous at right angles).
ARCCOS = (math.pi / 2, -0.2121144, 0.0742610, -0.0187293)


def corner_normals(
    points: Floats, triangles: NDArray[np.integer], crease: float = CREASE
) -> Floats:
    """Unit normals (T, 3, 3) of the corners of (T, 3) triangles between (P, 3) points, smoothed
    over deviations of ``crease`` degrees at most.

    Coincident points are different points: weld them first. A triangle without area has the normals
    of its neighbours, or (0, 0, 1) without any.
    """
    triangle = np.ascontiguousarray(triangles, dtype=np.int64)
    out = np.empty((len(triangle), 3, 3))
    at = corners_by_point(triangle, len(points))
    least = least_cosine(crease)
    _corner_normals(np.ascontiguousarray(points, dtype=np.float64), triangle, *at, least, out)
    return out


def corners_by_point(triangle: Ints, points: int) -> tuple[Ints, Ints]:
    """The corners, 3 t + k, of (T, 3) triangles in the order of their points, and (P + 1,) the
    first corner of each point."""
    order = np.argsort(triangle.ravel(), kind="stable")
    count = np.bincount(triangle.ravel(), minlength=points)
    return order, np.concatenate([[0], np.cumsum(count)])


def least_cosine(crease: float) -> float:
    return math.cos(math.radians(min(max(crease, 0.0), 180.0))) if crease < 180 else -2.0


@plain_kernel
def _angle(cosine: float) -> float:
    x = min(abs(cosine), 1.0)
    a, b, c, d = ARCCOS
    angle = math.sqrt(1 - x) * (a + x * (b + x * (c + x * d)))
    return math.pi - angle if cosine < 0 else angle


@kernel
def _corner_normals(
    point: Floats, triangle: Ints, order: Ints, start: Ints, least: float, out: Floats
) -> None:
    count = len(triangle)
    normal = np.zeros((count, 3))
    weight = np.zeros((count, 3))
    edge = np.zeros((3, 3))
    for t in range(count):
        for k in range(3):
            a, b = triangle[t, k], triangle[t, (k + 1) % 3]
            x, y, z = (
                point[b, 0] - point[a, 0],
                point[b, 1] - point[a, 1],
                point[b, 2] - point[a, 2],
            )
            length = math.sqrt(x * x + y * y + z * z)
            if length > 0:
                edge[k, 0], edge[k, 1], edge[k, 2] = x / length, y / length, z / length
            else:
                edge[k] = 0
        x = edge[0, 2] * edge[2, 1] - edge[0, 1] * edge[2, 2]
        y = edge[0, 0] * edge[2, 2] - edge[0, 2] * edge[2, 0]
        z = edge[0, 1] * edge[2, 0] - edge[0, 0] * edge[2, 1]
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0:
            normal[t, 0], normal[t, 1], normal[t, 2] = x / length, y / length, z / length
            for k in range(3):
                e, f = edge[k], edge[(k + 2) % 3]
                weight[t, k] = _angle(-(e[0] * f[0] + e[1] * f[1] + e[2] * f[2]))
    whole = np.zeros(3)
    for p in range(len(start) - 1):
        first, last = start[p], start[p + 1]
        fan = last - first > FAN
        if fan:
            whole[:] = 0.0
            for j in range(first, last):
                s, turn = order[j] // 3, order[j] % 3
                for c in range(3):
                    whole[c] += weight[s, turn] * normal[s, c]
        for i in range(first, last):
            t, k = order[i] // 3, order[i] % 3
            n = normal[t]
            flat = n[0] == 0 and n[1] == 0 and n[2] == 0
            x, y, z = whole[0], whole[1], whole[2]
            if not fan:
                x = y = z = 0.0
            for j in range(first, first if fan else last):
                s, turn = order[j] // 3, order[j] % 3
                m = normal[s]
                near = m[0] * n[0] + m[1] * n[1] + m[2] * n[2] >= least
                if near or flat or s == t:
                    w = weight[s, turn]
                    x, y, z = x + w * m[0], y + w * m[1], z + w * m[2]
            length = math.sqrt(x * x + y * y + z * z)
            if length > 0:
                out[t, k, 0], out[t, k, 1], out[t, k, 2] = x / length, y / length, z / length
            elif flat:
                out[t, k, 0], out[t, k, 1], out[t, k, 2] = 0.0, 0.0, 1.0
            else:
                out[t, k, 0], out[t, k, 1], out[t, k, 2] = n[0], n[1], n[2]
