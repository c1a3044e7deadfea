"""Compiled colours of pixels, by the levels that are there; sampled as `kernels` samples for its
errors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.compiled import kernel
from ptmtools.walkthrough.view.kernels import GREY, sample, texel_under


@kernel
def shade(
    triangle: Ints,
    ray: Floats,
    axes: Floats,
    eye: Floats,
    pixel: float,
    corner: Floats,
    normal: Floats,
    gradient: Floats,
    uv: Floats,
    cell: NDArray[np.int32],
    texture: NDArray[np.int32],
    color: Floats,
    clamped: Bools,
    texel: NDArray[np.uint8],
    start: Ints,
    size: Ints,
    count: Ints,
    mean: Floats,
    there: Bools,
    column: Ints,
    shown: Floats,
) -> None:
    """Writes to ``shown`` (n, 3) what the pixels of one frame show, 0 to 255: grey where the
    geometry is not there, the mean colour of textures of which nothing is, black where nothing is.

    Parameters
    ----------
    triangle, ray, axes, eye, pixel, corner, normal, gradient, uv, color, clamped: see
        `kernels.add_frame`. cell, texture: (m,).
    texel, start, size, count, mean: see `Pyramids`.
    there: (C,) geometry. column: (T,) how many levels of each texture.
    """
    offset, scaled, fine, coarse = np.zeros(3), np.zeros((2, 3)), np.zeros(3), np.zeros(3)
    for i in range(len(triangle)):
        f = triangle[i]
        if f < 0:
            shown[i] = 0.0
            continue
        if not there[cell[f]]:
            shown[i] = GREY
            continue
        t = texture[f]
        held = column[t] if t >= 0 else 0
        if held == 0:
            for k in range(3):
                shown[i, k] = color[f, k] * (mean[t, k] if t >= 0 else 255.0)
            continue
        finest = count[t] - 1
        u, v, detail = texel_under(
            ray[i], axes, eye, pixel, corner[f, 0], normal[f], gradient[f], uv[f, 0],
            size[t, finest], offset, scaled,
        )  # fmt: skip
        # The finest level that is there bounds the level of detail from below.
        detail = min(max(detail, float(finest - held + 1)), float(finest))
        whole = int(detail)
        part = detail - whole
        sharp = finest - whole
        below = max(sharp - 1, 0)
        sample(
            texel, start[t, sharp], size[t, sharp, 0], size[t, sharp, 1], u, v, clamped[f, 0],
            clamped[f, 1], fine,
        )  # fmt: skip
        sample(
            texel, start[t, below], size[t, below, 0], size[t, below, 1], u, v, clamped[f, 0],
            clamped[f, 1], coarse,
        )  # fmt: skip
        for k in range(3):
            shown[i, k] = color[f, k] * (fine[k] + part * (coarse[k] - fine[k]))
