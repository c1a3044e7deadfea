"""Compiled loops of the sampling: distances of points from triangles, crossings of rays with them
(`solids`), rays through pixel centres, and the tally of the cells that own the pixels (`tally`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.jit import plain_kernel


@plain_kernel
def clearances(
    points: Floats, corners: Floats, first: Ints, end: Ints, enough: float, distances: Floats
) -> None:
    """Lowers ``distances`` (n,) to the distance of each of the (n, 3) points from the nearest of
    the (m, 3, 3) triangles, each tested against the points from its ``first`` to its ``end``
    (m,)."""
    for t in range(len(corners)):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        low_y, high_y = min(a[1], b[1], c[1]) - enough, max(a[1], b[1], c[1]) + enough
        low_z, high_z = min(a[2], b[2], c[2]) - enough, max(a[2], b[2], c[2]) + enough
        for i in range(first[t], end[t]):
            if low_y <= points[i, 1] <= high_y and low_z <= points[i, 2] <= high_z:
                distances[i] = min(distances[i], distance(points[i], corners[t]))


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
def find_solids(
    points: Floats,
    turned: Floats,
    rank: Ints,
    near: Ints,
    boxes: Floats,
    begin: Ints,
    corners: Floats,
    frames: Floats,
    crossed: Ints,
    owner: Ints,
) -> None:
    """Writes to ``owner`` (n,), where it is -1, the first solid that contains a point: most of the
    three rays from there cross it an odd number of times.

    Parameters
    ----------
    points: (n, 3).
    turned: (3, n, 3) in the ``frames``, in the order of their x.
    rank: (3, n) the places of the points in these orders.
    near: the solids.
    boxes, begin: (B, 2, 3) of all solids, and (B + 1,) their triangles in ``corners``.
    corners: (m, 3, 3).
    frames: (3, 3, 3) for each ray a rotation, in which it runs along +z.
    crossed: (3, n) overwritten.
    """
    for s in near:
        counted = False
        for i in range(len(points)):
            if owner[i] >= 0:
                continue
            within = True
            for axis in range(3):
                within &= boxes[s, 0, axis] <= points[i, axis] <= boxes[s, 1, axis]
            if not within:
                continue
            if not counted:
                crossed[:] = 0
                for ray in range(3):
                    for t in range(begin[s], begin[s + 1]):
                        add_crossings(turned[ray], corners[t], frames[ray], crossed[ray])
                counted = True
            odd = 0
            for ray in range(3):
                odd += crossed[ray, rank[ray, i]] % 2
            if odd > 1:
                owner[i] = s


@plain_kernel
def rotate(frame: Floats, p: Floats) -> tuple[float, float, float]:
    """A (3,) point in a frame whose rows are the axes; equal points stay equal."""
    return (
        p[0] * frame[0, 0] + p[1] * frame[0, 1] + p[2] * frame[0, 2],
        p[0] * frame[1, 0] + p[1] * frame[1, 1] + p[2] * frame[1, 2],
        p[0] * frame[2, 0] + p[1] * frame[2, 1] + p[2] * frame[2, 2],
    )


@plain_kernel
def add_crossings(points: Floats, corner: Floats, frame: Floats, crossed: Ints) -> None:
    """Adds 1 to ``crossed`` (n,) of each of the (n, 3) points in a frame, in the order of x, from
    which the ray along +z crosses a (3, 3) triangle."""
    a, b, c = rotate(frame, corner[0]), rotate(frame, corner[1]), rotate(frame, corner[2])
    low, high = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
    west, east, top = min(a[0], b[0], c[0]), max(a[0], b[0], c[0]), max(a[2], b[2], c[2])
    for i in range(np.searchsorted(points[:, 0], west), len(points)):
        p = points[i]
        if p[0] > east:
            break
        if not (low <= p[1] <= high) or p[2] > top:
            continue
        # Of an edge and the edge the other way round exactly opposite.
        u = (b[0] - p[0]) * (c[1] - p[1]) - (b[1] - p[1]) * (c[0] - p[0])
        v = (c[0] - p[0]) * (a[1] - p[1]) - (c[1] - p[1]) * (a[0] - p[0])
        w = (a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0])
        if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
            above = u * (a[2] - p[2]) + v * (b[2] - p[2]) + w * (c[2] - p[2])
            crossed[i] += above * (u + v + w) > 0


@plain_kernel
def cast_rays(
    point: Floats, shift: Floats, face: int, views: Floats, origin: Singles, along: Singles
) -> None:
    """Writes origins and directions (6 K face², 3) of the rays of K sample points, in the order
    (point, view, row, column).

    Parameters
    ----------
    point: (K, 3) the points.
    shift: (K, 2) how far right and up of the pixel centres, in units of half a view.
    views: (6, 3, 3) right, up and forward of each view; a direction has 1 forward.
    """
    at = 0
    for k in range(len(point)):
        x, y, z = np.float32(point[k, 0]), np.float32(point[k, 1]), np.float32(point[k, 2])
        for v in range(len(views)):
            for row in range(face):
                up = (2.0 * row + 1.0) / face - 1.0 + shift[k, 1]
                for column in range(face):
                    right = (2.0 * column + 1.0) / face - 1.0 + shift[k, 0]
                    origin[at, 0], origin[at, 1], origin[at, 2] = x, y, z
                    for c in range(3):
                        along[at, c] = views[v, 2, c] + right * views[v, 0, c] + up * views[v, 1, c]
                    at += 1


@plain_kernel
def add_pixels(
    shows: NDArray[np.int32],
    point: Floats,
    plane: Floats,
    owner: NDArray[np.int32],
    column: NDArray[np.int32],
    weight: Ints,
    at_points: Ints,
    in_views: Ints,
    doubt: Ints,
) -> int:
    """Adds up the pixels of each owner; returns the number of pixels in doubt.

    Parameters
    ----------
    shows: (K, 6, face²) the triangle in each pixel, -1 for none.
    point: (K, 3) the sample points.
    plane: (M, 4) of the triangles, in the coordinates of the points; it is seen from the front
        where the plane's value is above 0.
    owner: (M, 2) the owner of a pixel that shows a triangle from its front or back, or -1.
    column: (S + 1,) the column of each owner, -1 if it is not expected; the last is -1.
    weight: (1 or K, face²) of the pixels.
    at_points, in_views: (K, n) and (6, n) the sums, added to.
    doubt: (m,) filled with the numbers of pixels, from 0 in the order of ``shows``, that show a
        triangle whose owner is not expected; as many as there is room for.
    """
    doubted = 0
    views, size = shows.shape[1], shows.shape[2]
    for k in range(len(shows)):
        x, y, z = point[k, 0], point[k, 1], point[k, 2]
        weights = min(k, len(weight) - 1)
        for v in range(views):
            for i in range(size):
                t = shows[k, v, i]
                if t < 0:
                    continue
                side = plane[t, 0] * x + plane[t, 1] * y + plane[t, 2] * z + plane[t, 3]
                j = column[owner[t, 0] if side > 0 else owner[t, 1]]
                if j >= 0:
                    at_points[k, j] += weight[weights, i]
                    in_views[v, j] += weight[weights, i]
                else:
                    if doubted < len(doubt):
                        doubt[doubted] = (k * views + v) * size + i
                    doubted += 1
    return doubted
