"""Records of the kernels: textures, triangles, and visible surfaces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.output.surfaces import Surfaces
from ptmtools.scene.colors import gradients


class Pyramids(NamedTuple):
    """Mip pyramids; level 0 is the coarsest.

    Attributes
    ----------
    texel: (N,) uint8 RGB, level by level, rows from the top.
    start: (T, L) index of the first texel of each level.
    size: (T, L, 2) int64 width and height; 0 beyond the finest level.
    levels: (T,) number of levels.
    mean: (T, 3) mean of the coarsest level, 0 to 255.
    differences: (T, L) difference of each level to the next coarser one, as defined by
        `ptmtools.texture.detail`; 0 for the coarsest.
    """

    texel: NDArray[np.uint8]
    start: Ints
    size: Ints
    levels: Ints
    mean: Floats
    differences: Floats


class Shows(NamedTuple):
    """Pictures of the columns of textures (`Catalogue`): each the coarsest levels of a pyramid.

    Attributes
    ----------
    pyramids: any number of pyramids.
    row: (T, K) pyramid of each column. held: (T, K) number of its levels.
    last: (T,) last column of each texture; column 0 has no picture.
    mean: (T, 3) colour shown without levels, 0 to 255.
    """

    pyramids: Pyramids
    row: Ints
    held: Ints
    last: Ints
    mean: Floats


def own_levels(pyramids: Pyramids) -> Shows:
    """Returns the columns of textures with one pyramid each: its levels."""
    shape = pyramids.start.shape[0], pyramids.start.shape[1] + 1
    finest = np.minimum(np.arange(shape[1]), pyramids.levels[:, None])
    row = np.repeat(np.arange(shape[0])[:, None], shape[1], axis=1)
    return Shows(pyramids, row, finest, pyramids.levels, pyramids.mean)


def image_of(
    shows: Shows, column: Ints, texture: int, size: tuple[int, int]
) -> NDArray[np.uint8] | None:
    """(height, width, 3) the finest image of a texture in its loaded ``column``; None of another
    ``size`` or without one."""
    at = texture, column[texture]
    row, level = shows.row[at], shows.held[at] - 1
    pyramids = shows.pyramids
    if level < 0 or tuple(pyramids.size[row, level].tolist()) != size:
        return None
    start = pyramids.start[row, level]
    width, height = size
    return pyramids.texel[start : start + 3 * width * height].reshape(height, width, 3)


class Triangles(NamedTuple):
    """Drawn triangles.

    Attributes
    ----------
    corner, uv, cell, texture, color, clamped: see `Surfaces`.
    normal: (m, 3) of any length. gradient: (m, 2, 3) of u and v, per metre.
    """

    corner: Floats
    normal: Floats
    uv: Floats
    gradient: Floats
    cell: NDArray[np.int32]
    texture: NDArray[np.int32]
    color: Floats
    clamped: Bools


class Sight(NamedTuple):
    """Visible triangles of the pixels of a frame.

    Attributes
    ----------
    triangle: (n,) -1 for none.
    ray: (n, 3) with component 1 along the view. axes: (2, 3) right and up. eye: (3,).
    pixel: see `Camera`.
    """

    triangle: Ints
    ray: Floats
    axes: Floats
    eye: Floats
    pixel: float


def triangles_of(surfaces: Surfaces) -> Triangles:
    """Returns the triangles of surfaces, with normals and gradients."""
    corner, uv = surfaces.corner, surfaces.uv
    return Triangles(
        corner, normals(corner), uv, gradients(corner, uv), surfaces.cell, surfaces.texture,
        surfaces.color, surfaces.clamped,
    )  # fmt: skip
