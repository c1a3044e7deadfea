"""Compiled rays through pixel centres, and the tally of whom the pixels belong to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.compiled import plain_kernel


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
    """Adds up whom the pixels belong to; returns how many are in doubt.

    Parameters
    ----------
    shows: (K, 6, face²) the triangle in each pixel, -1 for none.
    point: (K, 3) the sample points.
    plane: (M, 4) of the triangles, in the coordinates of the points; it is seen from the front
        where the plane's value is above 0.
    owner: (M, 2) to whom a pixel counts that shows a triangle from its front or back, or -1.
    column: (S + 1,) the column of each owner, -1 if it is not expected; the last is -1.
    weight: (1 or K, face²) of the pixels.
    at_points, in_views: (K, n) and (6, n) what is added to.
    doubt: (m,) filled with the numbers of pixels, from 0 in the order of ``shows``, that show a
        triangle whose owner is not expected; as many as there is room for.
    """
    doubted = 0
    views, size = shows.shape[1], shows.shape[2]
    for k in range(len(shows)):
        x, y, z = point[k, 0], point[k, 1], point[k, 2]
        of = min(k, len(weight) - 1)
        for v in range(views):
            for i in range(size):
                t = shows[k, v, i]
                if t < 0:
                    continue
                side = plane[t, 0] * x + plane[t, 1] * y + plane[t, 2] * z + plane[t, 3]
                j = column[owner[t, 0] if side > 0 else owner[t, 1]]
                if j >= 0:
                    at_points[k, j] += weight[of, i]
                    in_views[v, j] += weight[of, i]
                else:
                    if doubted < len(doubt):
                        doubt[doubted] = (k * views + v) * size + i
                    doubted += 1
    return doubted
