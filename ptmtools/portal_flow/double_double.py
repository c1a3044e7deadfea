"""Whether a line can pass a sequence of portals, in double-double arithmetic.

Decides what the flow, in doubles, cannot tell (`near_ties`). Portals are made truly plane first, by
moving their vertices along one axis, and drawn in by `Tolerance.noise`: the last digits of
coordinates are noise, and in a building that is turned the edges of doors that meet in a line no
longer do, by 1e-16 of its extent.

Tried and dropped: integers of any length for what double-double cannot tell, which were asked for
one sequence in a hundred and changed no set of any model (docs/design/visibility.md).
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from ptmtools.portal_flow.storage import DoubleDoublePortals, DoubleDoubleScratch, Geometry
from ptmtools.tolerance import Tolerance

#: Vertices that clipping may add to a portal before it is left unclipped.
GROWTH = 72


class SequenceTest:
    """Tests sequences of portals. Not to be shared between threads."""

    def __init__(self, geometry: Geometry) -> None:
        self._geometry = geometry
        self._portals = DoubleDoublePortals(
            np.zeros(geometry.point.shape, complex), geometry.start, geometry.normal
        )
        self._loaded = np.zeros(len(geometry.start) - 1, dtype=np.bool_)
        _, self._exponent = math.frexp(float(np.abs(geometry.point).max(initial=0.0)))
        self._noise = Tolerance.for_points(geometry.point).noise
        vertices = int(np.diff(geometry.start).max(initial=0)) + GROWTH
        self._scratch = DoubleDoubleScratch(
            polygon=np.zeros((4, vertices, 3), complex),
            size=np.zeros(4, np.int64),
            cuts=np.zeros(4, np.int64),
            plane=np.zeros((2, 2 * vertices + 1, 4), complex),
            side=np.zeros(vertices, complex),
            vector=np.zeros((2, 3), complex),
        )

    def passes(self, sequence: tuple[int, ...]) -> bool:
        """Whether something is left when a sequence of directed portals is clipped as the flow does
        it; False proves that no line passes the interiors of all of them in turn."""
        from ptmtools.portal_flow.double_double_kernels import something_left

        for q in sequence:
            if not self._loaded[q >> 1]:
                self._load(q >> 1)
        return something_left(self._portals, self._scratch, np.array(sequence, np.int64))

    def _load(self, k: int) -> None:
        """Coordinates of portal k over a power of two, none above 1, rounded to double-double."""
        g = self._geometry
        span = slice(g.start[k], g.start[k + 1])
        inward = g.ball[k, :3] - g.point[span]
        length = np.linalg.norm(inward, axis=1, keepdims=True)
        share = np.divide(self._noise, length, out=np.ones_like(length), where=length > 0)
        drawn_in = g.point[span] + np.minimum(share, 1.0) * inward
        normal = [Fraction(n) for n in g.normal[k].tolist()]
        axis = max(range(3), key=lambda a: abs(normal[a]))
        points = [[Fraction(x) for x in row] for row in drawn_in.tolist()]
        first = points[0]
        for i, point in enumerate(points):
            above = sum(n * (x - o) for n, x, o in zip(normal, point, first, strict=True))
            for a, x in enumerate(point):
                exact = x - above / normal[axis] if a == axis else x
                high = float(exact)
                low = float(exact - Fraction(high))
                self._portals.point[span.start + i, a] = complex(
                    math.ldexp(high, -self._exponent),
                    math.ldexp(low, -self._exponent),
                )
        self._loaded[k] = True
