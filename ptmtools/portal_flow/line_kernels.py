"""Compiled straight lines from leaf to leaf through the portals, and the bits of portals that see
each other.

Rounding can make a line that runs along an edge miss both portals beside it; it then ends there,
which only shortens it.

Matrices of bits are (2K, W) little-endian words over directed portals: row p holds the portals that
p sees.

The way back through portal q is ``q ^ 1``; p sees q if and only if the way back from q sees that
from p.

A few lines before the search (`glance`) find portals that need no search.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ptmtools.arrays import Bits, Bools, Floats, Ints
from ptmtools.jit import kernel, plain_kernel
from ptmtools.portal_flow.storage import PortalArrays


class Openings(NamedTuple):
    """Portals in the form that lines are traced through; directed portal 2k crosses portal k along
    its normal, 2k + 1 against it."""

    point: Floats  # (Q, 3) convex polygons, counter-clockwise around their normals
    start: Ints  # (K + 1,) CSR over portals
    leaf: Ints  # (2K,) the leaf that a directed portal leads into
    out_start: Ints  # (L + 1,) CSR over leaves:
    out: Ints  # (2K,) the directed portals that lead out of a leaf


@plain_kernel
def sight_lines(
    openings: Openings, origin: Floats, along: Floats, portal: Ints, path: Ints, seen: Bools
) -> None:
    """Marks in ``seen`` (L, L) the leaves that lie on one straight line, for (n,) lines.

    Parameters
    ----------
    origin, along, portal: (n, 3) a point in each line's portal, (n, 3) a direction from behind to
        ahead of it, and (n,) the portal.
    path: (2M,) storage; a line is followed through M leaves to either side of its portal.
    """
    for i in range(len(portal)):
        steps = 0
        for side in range(2):  # ahead of the portal, behind it
            q = 2 * portal[i] + side
            steps = follow(openings, q, origin[i], along[i], 1.0 - 2.0 * side, path, steps)
        for a in range(steps):
            for b in range(a):
                seen[path[a], path[b]] = True
                seen[path[b], path[a]] = True


@plain_kernel
def follow(
    openings: Openings, q: int, origin: Floats, along: Floats, turn: float, path: Ints, steps: int
) -> int:
    """Follows the ray ``turn * along`` on through directed portal q. Adds the leaves to ``path``
    from ``steps`` on, at most half of its length, and returns how many it then has."""
    end = steps + len(path) // 2
    while steps < end:
        leaf = openings.leaf[q]
        path[steps] = leaf
        steps += 1
        q = -1
        for i in range(openings.out_start[leaf], openings.out_start[leaf + 1]):
            if passes(openings.point, openings.start, openings.out[i], origin, along, turn):
                q = openings.out[i]
                break
        if q < 0:
            break
    return steps


@plain_kernel
def passes(point: Floats, start: Ints, q: int, origin: Floats, along: Floats, turn: float) -> bool:
    """Whether the line through ``origin`` along ``turn * along`` passes directed portal q: all
    volumes that it makes with the edges then have one sign.

    A line leaves a convex leaf through one face, so the ray goes on through the portal that it
    passes outwards, and no distance is compared."""
    begin, end = start[q >> 1], start[(q >> 1) + 1]
    sense = turn if q & 1 == 0 else -turn
    dx, dy, dz = along[0], along[1], along[2]
    ax = point[end - 1, 0] - origin[0]
    ay = point[end - 1, 1] - origin[1]
    az = point[end - 1, 2] - origin[2]
    across = False  # a line in the portal's plane makes no volume
    for i in range(begin, end):
        bx = point[i, 0] - origin[0]
        by = point[i, 1] - origin[1]
        bz = point[i, 2] - origin[2]
        volume = (ay * bz - az * by) * dx + (az * bx - ax * bz) * dy + (ax * by - ay * bx) * dz
        if volume * sense < 0:
            return False
        across |= volume != 0
        ax, ay, az = bx, by, bz
    return across


ONE = np.uint64(1)
ZERO = np.uint64(0)
# Index of the lowest set bit: a De Bruijn sequence of order 6 and its inverse.
DE_BRUIJN = np.uint64(0x03F79D71B4CB0A89)
LOW_BIT = np.zeros(64, dtype=np.int64)
for _i in range(64):
    LOW_BIT[((0x03F79D71B4CB0A89 << _i) & 0xFFFFFFFFFFFFFFFF) >> 58] = _i


@plain_kernel
def has(rows: Bits, p: int, q: int) -> bool:
    """Whether bit q of row p is set."""
    return bool((rows[p, q >> 6] >> np.uint64(q & 63)) & ONE)


@plain_kernel
def lowest(row: np.uint64) -> int:
    """The index of the lowest bit of a word, not 0."""
    return int(LOW_BIT[((row & (~row + ONE)) * DE_BRUIJN) >> np.uint64(58)])


@plain_kernel
def transpose(square: Bits) -> None:
    """A square of 64 × 64 bits (64,), turned about its diagonal in place: halves change places,
    then the halves of halves (Warren, Hacker's Delight, 7-3)."""
    step, mask = 32, np.uint64(0x00000000FFFFFFFF)
    while step > 0:
        shift = np.uint64(step)
        i = 0
        while i < 64:
            moved = ((square[i] >> shift) ^ square[i | step]) & mask
            square[i] ^= moved << shift
            square[i | step] ^= moved
            i = ((i | step) + 1) & ~step
        step >>= 1
        mask ^= mask << np.uint64(step)


@kernel
def return_sight(known: Bits, first: int, last: int) -> None:
    """Rows of the blocks first … last - 1 of 64: p sees q only if the way back from q sees that
    from p. Rows may change meanwhile: bits that they lose are lost by p here anyway.
    """
    count, words = known.shape
    square = np.empty(64, np.uint64)
    odd = np.uint64(0xAAAAAAAAAAAAAAAA)
    for block in range(first, last):
        for w in range(words):
            for i in range(64):
                back = (w << 6) + i ^ 1
                row = known[back, block] if back < count else ZERO
                square[i] = (row & odd) >> ONE | (row & ~odd) << ONE
            transpose(square)
            for i in range(min(64, count - (block << 6))):
                known[(block << 6) + i, w] &= square[i]


@plain_kernel
def drop_unreturned(known: Bits, p: int, dropped: Bits) -> None:
    """Clears the way back from p in the rows of the ways back from ``dropped`` (W,), the portals
    that p no longer sees."""
    back = p ^ 1
    w, keep = back >> 6, ~(ONE << np.uint64(back & 63))
    for v in range(len(dropped)):
        rest = dropped[v]
        while rest != ZERO:
            known[((v << 6) + lowest(rest)) ^ 1, w] &= keep
            rest &= rest - ONE


@plain_kernel
def draw(state: np.uint64) -> tuple[np.uint64, float]:
    """The next state of a 64-bit xorshift generator (not 0), and a number in [0, 1) from it."""
    x = np.uint64(state)
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    return x, np.float64(x >> np.uint64(11)) * 2.0**-53


@plain_kernel
def place_in(g: PortalArrays, k: int, state: np.uint64, at: Floats) -> np.uint64:
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


@plain_kernel
def glance(g: PortalArrays, known: Bits, source: int, seen: Bits, line: Floats) -> int:
    """Marks in ``seen`` (W,) the portals that one random line to each possible portal crosses.

    A marked portal is certainly seen, so the search need not test it; a line that rounding leads
    astray only marks possible portals. ``line`` (2, 3) is overwritten. Returns the leaves walked.
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
