"""The texture coordinates of the pixels of a view, how far these move from pixel to pixel, and the
colours of vertices there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, cross
from ptmtools.rendering.records import Sight, Triangles

#: Takes the place of 0 for the component of a ray along the normal of a plane seen edge-on.
_EDGE_ON = 1e-300


def footprints(sight: Sight, pixel: Ints, triangles: Triangles) -> tuple[Floats, Floats]:
    """For some pixels, which show a triangle: (n, 2) texture coordinates, and (n, 2, 2) their
    movement to the next pixel, u and v in the rows, across the screen and up it in the columns.

    Both are ratios of linear functions of the ray, whose coefficients are computed once for a
    triangle: products of (n, 3, 3) arrays take six times as long.
    """
    shown = np.zeros(len(triangles.corner), np.bool_)
    shown[sight.triangle[pixel]] = True
    which = np.flatnonzero(shown)
    place = np.empty(len(shown), np.int64)
    place[which] = np.arange(len(which))
    row, (x, y, z) = place[sight.triangle[pixel]], sight.ray[pixel].T
    normal, gradient = triangles.normal[which], triangles.gradient[which]
    offset = triangles.corner[which, 0] - sight.eye

    def project(vectors: Floats) -> Floats:
        """(n,) products of (t, 3) vectors of the triangles and the rays."""
        a, b, c = (part.take(row) for part in vectors.T)
        return np.asarray(a * x + b * y + c * z)

    facing = project(normal)
    facing[facing == 0] = _EDGE_ON
    depth = np.einsum("ij,ij->i", normal, offset).take(row) / facing
    slope = [part.take(row) / facing for part in (normal @ sight.axes.T).T]
    uv, moves = np.empty((len(pixel), 2)), np.empty((len(pixel), 2, 2))
    size = np.abs(depth) * sight.pixel
    for k in range(2):
        start = triangles.uv[which, 0, k] - np.einsum("ij,ij->i", gradient[:, k], offset)
        growth, turns = project(gradient[:, k]), gradient[:, k] @ sight.axes.T
        uv[:, k] = start.take(row) + growth * depth
        for c in range(2):
            moves[:, k, c] = (turns[:, c].take(row) - slope[c] * growth) * size
    return uv, moves


def detail_of_pixels(moves: Floats, width: int, height: int) -> Floats:
    """(n,) the level of detail λ, 0 for the finest level of ``width`` × ``height`` texels or finer:
    log2 of the texels by which the texture moves from a pixel to the next, in the direction in
    which it moves more, as in OpenGL; ``moves`` as `footprints` returns them."""
    square = (moves[:, 0] * width) ** 2 + (moves[:, 1] * height) ** 2
    return np.asarray(np.log2(np.maximum(np.maximum(*square.T), 1.0)) / 2)


def show_colors(
    sight: Sight, triangles: Triangles, vertex_colors: Floats | None, shown: Floats
) -> None:
    """Multiplies pixels ``shown`` (n, 3) by the colours between those of the corners of their
    triangles, ``vertex_colors`` (T, 3, 3), instead of the means of these."""
    if vertex_colors is None:
        return
    uneven = (vertex_colors != vertex_colors[:, :1]).any(axis=(1, 2))
    pixel = np.flatnonzero((sight.triangle >= 0) & uneven[sight.triangle])
    mean = vertex_colors[sight.triangle[pixel]].mean(axis=1)
    interpolated = _interpolate(sight, pixel, triangles, vertex_colors)
    shown[pixel] *= np.divide(interpolated, mean, out=np.zeros_like(interpolated), where=mean > 0)


def corner_values(
    sight: Sight, pixel: Ints, triangles: Triangles, values: NDArray[np.floating]
) -> Floats:
    """(n, 3) between the ``values`` (T, 3, 3) of the corners of the triangles that some pixels
    show."""
    shown = values[sight.triangle[pixel]]
    result = shown[:, 0].astype(np.float64)
    rows = np.flatnonzero((shown != shown[:, :1]).any(axis=(1, 2)))
    result[rows] = _interpolate(sight, pixel[rows], triangles, values)
    return result


def _interpolate(
    sight: Sight, pixel: Ints, triangles: Triangles, values: NDArray[np.floating]
) -> Floats:
    """(n, 3) of pixels between the (T, 3, 3) values of corners; of a triangle without area that of
    its first corner."""
    triangle = sight.triangle[pixel]
    corner, normal = triangles.corner[triangle], triangles.normal[triangle]
    _, _, at = _intersections(sight, pixel, triangles)
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    whole = np.einsum("ij,ij->i", normal, normal)
    weight = np.zeros((len(pixel), 3))
    for k, sides in (1, (at, second)), (2, (first, at)):
        part = np.einsum("ij,ij->i", cross(*sides), normal)
        np.divide(part, whole, out=weight[:, k], where=whole > 0)
    np.clip(weight, 0, 1, out=weight)
    weight[:, 0] = 1 - weight[:, 1] - weight[:, 2]
    return np.asarray(np.einsum("nk,nkj->nj", weight, values[triangle]))


def _intersections(
    sight: Sight, pixel: Ints, triangles: Triangles
) -> tuple[Floats, Floats, Floats]:
    """Of some pixels, which show a triangle: (n,) component of the ray along its normal, (n,) depth
    of its plane, and (n, 3) where the ray meets that, from the first corner."""
    triangle, ray = sight.triangle[pixel], sight.ray[pixel]
    normal = triangles.normal[triangle]
    facing = np.einsum("ij,ij->i", normal, ray)
    facing = np.where(facing == 0, _EDGE_ON, facing)
    offset = triangles.corner[triangle, 0] - sight.eye
    depth = np.einsum("ij,ij->i", normal, offset) / facing
    return facing, depth, ray * depth[:, None] - offset
