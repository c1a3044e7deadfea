"""The texture coordinates of the pixels of a view, and how far these move from pixel to pixel."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.rendering.records import Sight, Triangles


def footprints(sight: Sight, pixel: Ints, triangles: Triangles) -> tuple[Floats, Floats]:
    """For some pixels, which show a triangle: (n, 2) texture coordinates, and (n, 2, 2) their
    movement to the next pixel, u and v in the rows, across the screen and up it in the columns."""
    triangle, ray = sight.triangle[pixel], sight.ray[pixel]
    normal, gradient = triangles.normal[triangle], triangles.gradient[triangle]
    facing = np.einsum("ij,ij->i", normal, ray)
    facing = np.where(facing == 0, 1e-300, facing)
    offset = triangles.corner[triangle, 0] - sight.eye
    depth = np.einsum("ij,ij->i", normal, offset) / facing
    at = ray * depth[:, None] - offset
    uv = triangles.uv[triangle, 0] + np.einsum("ikj,ij->ik", gradient, at)
    slope = np.einsum("ij,kj->ik", normal, sight.axes) / facing[:, None]
    move = sight.axes[None] - slope[:, :, None] * ray[:, None]
    each = np.einsum("ikj,icj->ikc", gradient, move)
    return uv, each * (np.abs(depth) * sight.pixel)[:, None, None]


def detail_of_pixels(moves: Floats, width: int, height: int) -> Floats:
    """(n,) the level of detail λ, 0 for the finest level of ``width`` × ``height`` texels or finer:
    log2 of the texels by which the texture moves from a pixel to the next, in the direction in
    which it moves more, as in OpenGL; ``moves`` as `footprints` returns them."""
    texels = np.linalg.norm(moves * np.array([width, height])[:, None], axis=1).max(axis=1)
    return np.asarray(np.log2(np.maximum(texels, 1.0)))
