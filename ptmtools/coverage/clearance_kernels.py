"""Compiled distances of points from triangles, and crossings of rays with them (`solids`)."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.compiled import plain_kernel


@plain_kernel
def clearances(
    points: Floats, corners: Floats, first: Ints, end: Ints, enough: float, found: Floats
) -> None:
    """Lowers ``found`` (n,) to the distance of each of the (n, 3) points from the nearest of the
    (m, 3, 3) triangles, each held against the points from its ``first`` to its ``end`` (m,)."""
    for t in range(len(corners)):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        low_y, high_y = min(a[1], b[1], c[1]) - enough, max(a[1], b[1], c[1]) + enough
        low_z, high_z = min(a[2], b[2], c[2]) - enough, max(a[2], b[2], c[2]) + enough
        for i in range(first[t], end[t]):
            if low_y <= points[i, 1] <= high_y and low_z <= points[i, 2] <= high_z:
                found[i] = min(found[i], distance(points[i], corners[t]))


@plain_kernel
def distance(p: Floats, corner: Floats) -> float:
    """Distance of a (3,) point from a (3, 3) triangle, a sliver or a point included."""
    o = corner[0]
    ux, uy, uz = corner[1, 0] - o[0], corner[1, 1] - o[1], corner[1, 2] - o[2]
    vx, vy, vz = corner[2, 0] - o[0], corner[2, 1] - o[1], corner[2, 2] - o[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    nearest = np.inf
    over = length > 0
    for i in range(3):
        a, b = corner[i], corner[(i + 1) % 3]
        ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        wx, wy, wz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
        square = ex * ex + ey * ey + ez * ez
        t = (wx * ex + wy * ey + wz * ez) / square if square > 0 else 0.0
        t = min(max(t, 0.0), 1.0)
        fx, fy, fz = wx - t * ex, wy - t * ey, wz - t * ez
        nearest = min(nearest, np.sqrt(fx * fx + fy * fy + fz * fz))
        cx, cy, cz = ey * wz - ez * wy, ez * wx - ex * wz, ex * wy - ey * wx
        over = over and cx * nx + cy * ny + cz * nz >= 0
    if over:
        height = abs((p[0] - o[0]) * nx + (p[1] - o[1]) * ny + (p[2] - o[2]) * nz)
        nearest = min(nearest, height / length)
    return nearest


@plain_kernel
def crossings(points: Floats, corners: Floats, first: Ints, end: Ints, crossed: Ints) -> None:
    """Adds to ``crossed`` (n,) how many of the (m, 3, 3) triangles the ray along +z from each of
    the (n, 3) points crosses: those that its line passes through ahead of it. Each triangle is held
    against the points from its ``first`` to its ``end`` (m,)."""
    for t in range(len(corners)):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        low, high = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        top = max(a[2], b[2], c[2])
        for i in range(first[t], end[t]):
            p = points[i]
            if not (low <= p[1] <= high) or p[2] > top:
                continue
            # Of an edge and the edge the other way round exactly opposite.
            u = (b[0] - p[0]) * (c[1] - p[1]) - (b[1] - p[1]) * (c[0] - p[0])
            v = (c[0] - p[0]) * (a[1] - p[1]) - (c[1] - p[1]) * (a[0] - p[0])
            w = (a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0])
            if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
                above = u * (a[2] - p[2]) + v * (b[2] - p[2]) + w * (c[2] - p[2])
                crossed[i] += above * (u + v + w) > 0
