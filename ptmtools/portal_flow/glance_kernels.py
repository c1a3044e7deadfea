"""A few straight lines, compiled: what they cross need not be searched for."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bits, Floats
from ptmtools.compiled import plain_kernel as kernel
from ptmtools.portal_flow.bit_kernels import ONE, ZERO, has, lowest
from ptmtools.portal_flow.line_kernels import passes
from ptmtools.portal_flow.storage import Geometry


@kernel
def draw(state: np.uint64) -> tuple[np.uint64, float]:
    """The next state of a 64-bit xorshift generator (not 0), and a number in [0, 1) from it."""
    x = np.uint64(state)
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    return x, np.float64(x >> np.uint64(11)) * 2.0**-53


@kernel
def place_in(g: Geometry, k: int, state: np.uint64, at: Floats) -> np.uint64:
    """Puts a random point of portal k into ``at`` (3,); returns the generator's next state."""
    first, count = g.start[k], g.start[k + 1] - g.start[k]
    state, r = draw(state)
    i = first + 1 + int(r * max(count - 2, 1))
    j = min(i + 1, first + count - 1)
    i = min(i, first + count - 1)
    state, u = draw(state)
    state, v = draw(state)
    u = np.sqrt(u)
    for a in range(3):
        o = g.point[first, a]
        at[a] = o + u * (g.point[i, a] - o + v * (g.point[j, a] - g.point[i, a]))
    return state


@kernel
def glance(g: Geometry, known: Bits, source: int, seen: Bits, line: Floats) -> int:
    """Marks in ``seen`` (W,) what one random line to each possible portal crosses on its way.

    A portal so marked is seen beyond doubt, so the search need not look out for it; a line that
    goes astray by rounding only marks what is possible anyway. ``line`` (2, 3) is overwritten.
    Returns the leaves walked.
    """
    origin, along = line[0], line[1]
    state = np.uint64(source + 1) * np.uint64(0x9E3779B97F4A7C15)
    walked = 0
    for w in range(known.shape[1]):
        rest = known[source, w]
        while rest != ZERO:
            target = (w << 6) + lowest(rest)
            rest &= rest - ONE
            if seen[w] & (ONE << np.uint64(target & 63)) != ZERO:
                continue
            state = place_in(g, source >> 1, state, origin)
            state = place_in(g, target >> 1, state, along)
            for a in range(3):
                along[a] -= origin[a]
            leaf = g.leaf[source]
            at = g.out_start[leaf]
            steps = 0
            while at < g.out_start[leaf + 1] and steps < len(g.out_start):
                q = g.out[at]
                at += 1
                if has(known, source, q) and passes(g.point, g.start, q, origin, along, 1.0):
                    seen[q >> 6] |= ONE << np.uint64(q & 63)
                    leaf = g.leaf[q]
                    at = g.out_start[leaf]
                    steps += 1
            walked += steps + 1
    return walked
