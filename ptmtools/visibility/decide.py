"""Whether a line can pass a sequence of portals: quickly where that can tell, else in integers.

Nearly all sequences that doubles cannot decide, numbers of twice the length can (`doubled`),
without the interpreter's lock: in a hospital, walls of 0.25 m² and up, 99 of 100. The others go to
`exact`, which takes a hundred times as long; among sequences of twenty portals with hardly any
room, most of the open ones do.
"""

from __future__ import annotations

import math

import numpy as np

from ptmtools.visibility.exact import ExactPortals
from ptmtools.visibility.storage import DoubledPortals, DoubledScratch, Geometry

#: Vertices that clipping may add to a portal before the decision is left to integers.
GROWTH = 72


class Decisions:
    """Decides sequences of portals. Not to be shared between threads.

    Attributes
    ----------
    in_integers: how many sequences only integers could decide.
    """

    def __init__(self, geometry: Geometry) -> None:
        self._exact = ExactPortals(geometry)
        self._portals = DoubledPortals(
            np.zeros((*geometry.point.shape, 2)), geometry.start, geometry.normal
        )
        self._known = np.zeros(len(geometry.start) - 1, dtype=np.bool_)
        _, self._exponent = math.frexp(float(np.abs(geometry.point).max(initial=0.0)))
        vertices = int(np.diff(geometry.start).max(initial=0)) + GROWTH
        self._scratch = DoubledScratch(
            polygon=np.zeros((4, vertices, 3, 2)),
            size=np.zeros(4, np.int64),
            cuts=np.zeros(4, np.int64),
            plane=np.zeros((2, 2 * vertices + 1, 4, 2)),
            side=np.zeros((vertices, 2)),
            vector=np.zeros((2, 3, 2)),
        )
        self.in_integers = 0

    def passes(self, sequence: tuple[int, ...]) -> bool:
        """Whether something is left when a sequence of directed portals is clipped as the flow does
        it; False proves that no line passes the interiors of all of them in turn."""
        from ptmtools.visibility.doubled import kernels

        for q in sequence:
            if not self._known[q >> 1]:
                self._load(q >> 1)
        row = np.array(sequence, np.int64)
        if kernels.left(self._portals, self._scratch, row, True) == kernels.CLOSED:
            return False
        if kernels.left(self._portals, self._scratch, row, False) == kernels.OPEN:
            return True
        self.in_integers += 1
        return self._exact.passes(sequence)

    def _load(self, k: int) -> None:
        """Coordinates of portal k over a power of two, none above 1, rounded to two doubles."""
        first = self._portals.start[k]
        for i, (*point, w) in enumerate(self._exact.vertices(k)):
            for axis, n in enumerate(point):
                high = n / w
                over, under = high.as_integer_ratio()
                low = (n * under - over * w) / (w * under)
                self._portals.point[first + i, axis] = (
                    math.ldexp(high, -self._exponent),
                    math.ldexp(low, -self._exponent),
                )
        self._known[k] = True
