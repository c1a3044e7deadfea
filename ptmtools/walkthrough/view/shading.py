"""Compiled colours of pixels, by the levels that are there; sampled as `kernels` samples for its
errors."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.compiled import kernel
from ptmtools.walkthrough.view.kernels import GREY, blend, texel_under
from ptmtools.walkthrough.view.records import Shows, Sight, Triangles


@kernel
def shade(
    sight: Sight,
    triangles: Triangles,
    shows: Shows,
    there: Bools,
    column: Ints,
    shown: Floats,
) -> None:
    """Writes to ``shown`` (n, 3) what the pixels of one frame show, 0 to 255: grey where the
    geometry is not there, the mean colour of textures of which nothing is, black where nothing is.

    ``there`` (C,) geometry, and ``column`` (T,) of each texture.
    """
    work, coarse = np.zeros((3, 3)), np.zeros(3)
    for i in range(len(sight.triangle)):
        f, pixel = sight.triangle[i], shown[i]
        if f < 0:
            pixel[:] = 0.0
            continue
        if not there[triangles.cell[f]]:
            pixel[:] = GREY
            continue
        t = triangles.texture[f]
        held = column[t] if t >= 0 else 0
        if held > 0:
            textures, row = shows.pyramids, shows.row[t, held]
            u, v, detail = texel_under(sight, i, triangles, textures, row, work)
            # The finest level that is there bounds the level of detail from below.
            detail = max(detail, float(textures.levels[row] - shows.held[t, held]))
            blend(textures, row, detail, u, v, triangles.clamped[f], pixel, coarse)
        else:
            for k in range(3):
                pixel[k] = shows.mean[t, k] if t >= 0 else 255.0
        for k in range(3):
            pixel[k] *= triangles.color[f, k]
