"""Compiled sums of the errors of a frame by object and texture (see `tables`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.jit import plain_kernel
from ptmtools.rendering.kernels import GREY, blend, distance, texel_under
from ptmtools.rendering.records import Pyramids, Sight, Triangles

#: Columns of a table: grey, and each size of a texture.
COLUMNS = 4


class Sizes(NamedTuple):
    """Textures in each size."""

    small: Pyramids
    middle: Pyramids
    large: Pyramids


@plain_kernel
def color_of(
    sight: Sight, i: int, triangles: Triangles, textures: Pyramids, color: Floats, work: Floats
) -> None:
    """Writes the colour of a pixel to ``color`` (3,), 0 to 255; black if the pixel shows nothing.

    ``work`` (4, 3) is scratch memory.
    """
    f = sight.triangle[i]
    if f < 0:
        color[:] = 0.0
        return
    t = triangles.texture[f]
    if t < 0:
        color[:] = 255.0
    else:
        u, v, detail = texel_under(sight, i, triangles, textures, t, work[:3])
        blend(textures, t, detail, u, v, triangles.clamped[f], color, work[3])
    for k in range(3):
        color[k] *= triangles.color[f, k]


@plain_kernel
def add_shown(
    owner: Ints,
    sight: Sight,
    triangles: Triangles,
    sizes: Sizes,
    exact: Floats,
    place: Ints,
    sums: Floats,
    work: Floats,
) -> None:
    """Adds the errors of the pixels of a frame as one kind of mesh shows them.

    Parameters
    ----------
    owner: (n,) object of each pixel, -1 for none.
    exact: (n, 3) colours of the full picture.
    place: (m, T + 1) row of an object and a texture; the last is without texture.
    sums: (rows, `COLUMNS`) of root mean squares over R, G and B.
    work: (5, 3) scratch memory.
    """
    shown = work[4]
    for i in range(len(owner)):
        o = owner[i]
        if o < 0:
            continue
        f = sight.triangle[i]
        t = triangles.texture[f] if f >= 0 else -1
        row = place[o, t]
        shown[:] = GREY
        sums[row, 0] += np.sqrt(distance(shown, exact[i]))
        color_of(sight, i, triangles, sizes.small, shown, work[:4])
        sums[row, 1] += np.sqrt(distance(shown, exact[i]))
        if t >= 0:
            color_of(sight, i, triangles, sizes.middle, shown, work[:4])
        sums[row, 2] += np.sqrt(distance(shown, exact[i]))
        if t >= 0:
            color_of(sight, i, triangles, sizes.large, shown, work[:4])
        sums[row, 3] += np.sqrt(distance(shown, exact[i]))
