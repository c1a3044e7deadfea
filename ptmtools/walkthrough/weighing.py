"""From how many pixels want a level to what it is worth.

Two measures, by what a client knows of the textures:

* `by_pixels`: every level counts the same (the paper's view of it);
* `by_difference`: a level counts by its difference to the one below. A pixel that wants level n and
  has level k is wrong by about the sum of the differences between them.

(Tried: the root mean square over the texels of a level in place of the mean. At 0.5 Mbit/s with
10 % and 30 % of the texture memory, the error of the picture is 1.90 and 1.67 then, and 1.83 and
1.62 so. What the missing levels make together, so that a coarse one under a missing fine one counts
little: no better.)
"""

from __future__ import annotations

from collections.abc import Callable

from ptmtools.arrays import Floats
from ptmtools.walkthrough.catalogue import Catalogue

#: (T, K) shares of pixels that want each column → (T, K) worth.
Weighing = Callable[[Catalogue, Floats], Floats]


def by_pixels(stock: Catalogue, shares: Floats) -> Floats:
    """See the module."""
    return shares


def by_difference(stock: Catalogue, shares: Floats) -> Floats:
    """See the module."""
    return shares * stock.differences
