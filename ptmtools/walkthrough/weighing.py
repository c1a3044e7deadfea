"""From how many pixels want a level to what it is worth.

Three measures, by what a client knows of the textures:

* `by_pixels`: every level counts the same (the paper's view of it);
* `by_rms`: a level counts by its root mean square against the one below;
* `by_error`: a level counts by how much smaller the error gets. A pixel that wants level n and has
  level k is wrong by about √(rms²ₖ₊₁ + … + rms²ₙ), since what levels add is nearly uncorrelated; so
  a coarse level under a fine one that is missing anyway adds little.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.walkthrough.catalogue import Catalogue

#: (T, K) shares of pixels that want each column → (T, K) worth.
Weighing = Callable[[Catalogue, Floats], Floats]


def by_pixels(stock: Catalogue, shares: Floats) -> Floats:
    """See the module."""
    return shares


def by_rms(stock: Catalogue, shares: Floats) -> Floats:
    """See the module."""
    return shares * stock.rms


def by_error(stock: Catalogue, shares: Floats) -> Floats:
    """See the module; ``shares`` do not increase from column to column, but for the first."""
    finest = shares.copy()
    finest[:, :-1] -= shares[:, 1:]
    finest[:, 0] = 0.0
    worth: Floats = np.einsum("tkn,tn->tk", stock.drops, np.maximum(finest, 0.0))
    return worth
