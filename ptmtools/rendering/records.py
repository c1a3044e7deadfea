"""Records of the kernels: textures, triangles, and the surfaces that a camera sees."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.output.served import Surfaces
from ptmtools.scene.colors import gradients


class Pyramids(NamedTuple):
    """Levels count from the coarsest, 0.

    Attributes
    ----------
    texel: (N,) uint8 RGB, level by level, rows from the top.
    start: (T, L) where each level begins in it.
    size: (T, L, 2) int64 width and height; 0 beyond the finest.
    levels: (T,) how many each texture has.
    mean: (T, 3) the mean of the coarsest level, 0 to 255.
    differences: (T, L) of a level to the level below it, as `ptmtools.texture.detail` has them, of
        what is shown; 0 for the coarsest.
    """

    texel: NDArray[np.uint8]
    start: Ints
    size: Ints
    levels: Ints
    mean: Floats
    differences: Floats


class Shows(NamedTuple):
    """What the columns of textures show (`Catalogue`): each the coarsest levels of a pyramid.

    Attributes
    ----------
    pyramids: any number of them.
    row: (T, K) which of them each column shows. held: (T, K) how many of its levels.
    last: (T,) column of each texture; the first is nothing.
    mean: (T, 3) what is shown where nothing is there, 0 to 255.
    """

    pyramids: Pyramids
    row: Ints
    held: Ints
    last: Ints
    mean: Floats


def own_levels(pyramids: Pyramids) -> Shows:
    """Of textures with a pyramid each, whose columns are its levels."""
    shape = pyramids.start.shape[0], pyramids.start.shape[1] + 1
    held = np.minimum(np.arange(shape[1]), pyramids.levels[:, None])
    row = np.repeat(np.arange(shape[0])[:, None], shape[1], axis=1)
    return Shows(pyramids, row, held, pyramids.levels, pyramids.mean)


class Triangles(NamedTuple):
    """All that are drawn.

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
    """What the pixels of a frame show.

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
    """All of them."""
    corner, uv = surfaces.corner, surfaces.uv
    return Triangles(
        corner, normals(corner), uv, gradients(corner, uv), surfaces.cell, surfaces.texture,
        surfaces.color, surfaces.clamped,
    )  # fmt: skip
