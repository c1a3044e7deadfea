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

from ptmtools.arrays import fill_gaps


def spread_colors(texels: NDArray[Any]) -> NDArray[Any]:
    """(h, w, c) texels, those of alpha 0 in the colours of the visible ones around; the same array
    if alpha hides none, or all, or if they are floats."""
    alpha = texels[..., -1]
    if texels.shape[2] not in (2, 4) or texels.dtype.kind != "u" or alpha.all() or not alpha.any():
        return texels
    return np.concatenate([fill_gaps(texels[..., :-1], alpha), alpha[..., None]], axis=2)
