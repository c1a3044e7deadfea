"""How much there is to see in an image: a painting much, bare plaster next to nothing.

Measured on a coarse level, of which a few kB of the file are read. What is finer than its texels is
grain, which plaster and carpet have as much of as a painting; from where one looks at a painting,
it is not seen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.reader import open as open_ptm
from ptmtools.texture.samples import KINDS
from ptmtools.texture.sources import Source

#: The level measured is the finest whose shorter side has at most this many texels…
_SIDE = 64
#: …against the means of its squares of this side.
_SQUARE = 4


def detail(source: Source) -> float:
    """Root mean square by which the colours of a `.ptm` differ from their surroundings, a
    sixteenth of the picture wide, as a share of the range of its samples; alpha does not count.

    Raises what `ptmtools.texture.open` and `PtmReader.level` raise.
    """
    with open_ptm(source) as reader:
        header = reader.header
        fits = [n for n, x in enumerate(header.levels) if min(x.width, x.height) <= _SIDE]
        texels = reader.level(max(fits, default=0)).astype(np.float64)
    colors = texels[..., : header.components - (header.components in (2, 4))]
    if KINDS[header.kind].is_float:
        colors = np.nan_to_num(colors, posinf=0.0, neginf=0.0)
        top = float(abs(colors).max())
    else:
        top = float(KINDS[header.kind].top)
    squares = _squares(_squares(colors, 0), 2)
    off = squares - squares.mean(axis=(1, 3), keepdims=True)
    return float(np.sqrt((off**2).mean())) / top if top else 0.0


def _squares(texels: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """An axis cut into two, of squares and of what one has; the rest that makes no square is left
    out."""
    size = texels.shape[axis]
    side = min(size, _SQUARE)
    whole = texels.take(range(size // side * side), axis)
    shape = (*texels.shape[:axis], size // side, side, *texels.shape[axis + 1 :])
    return whole.reshape(shape)
