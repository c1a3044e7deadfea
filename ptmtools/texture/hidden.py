"""The colours of the texels that alpha hides.

Levels are means of texels, and filters mix neighbours by their distance alone. So the colour under
alpha 0, often white or black, shows at the edges of a cut-out, and from afar all over it. It is of
no other use: the textures of a scene have there the colours of the visible texels around, by a
pyramid of means that alpha weights.

Tried: means of the levels that alpha weights. Then no level is the mean of the next, of which the
coders of differences depend, and edges are wrong in the finest level. Colours multiplied by alpha
lose their low bits, and no ordinary image file has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Singles


def spread_colors(texels: NDArray[Any]) -> NDArray[Any]:
    """(h, w, c) texels, those of alpha 0 in the colours of the visible ones around; the same array
    if alpha hides none, or all, or if they are floats."""
    alpha = texels[..., -1]
    if texels.shape[2] not in (2, 4) or texels.dtype.kind != "u" or alpha.all() or not alpha.any():
        return texels
    return np.concatenate([_fill(texels[..., :-1], alpha), alpha[..., None]], axis=2)


def _fill(color: NDArray[Any], weight: NDArray[Any]) -> NDArray[Any]:
    """(h, w, k) colours, those of (h, w) weight 0 from a quarter of them, the weighted means."""
    if weight.all():
        return color
    height, width = weight.shape
    total = _sums(weight.astype(np.float32))
    below = np.empty((*total.shape, color.shape[2]), color.dtype)
    for k in range(color.shape[2]):
        sums = _sums(np.multiply(color[..., k], weight, dtype=np.float32))
        below[..., k] = np.rint(np.divide(sums, total, out=np.zeros_like(sums), where=total > 0))
    coarse = _fill(below, total).repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
    return np.asarray(np.where(weight[..., None] > 0, color, coarse))


def _sums(values: Singles) -> Singles:
    """Of 2 × 2 values, in one order on all machines; a last odd row or column has no others."""
    even = np.pad(values, [(0, side % 2) for side in values.shape])
    return (even[::2, ::2] + even[::2, 1::2]) + (even[1::2, ::2] + even[1::2, 1::2])
