"""Straight lines through the portals: what one of them crosses sees each other beyond doubt.

A line is walked from leaf to leaf by the portal that it leaves through, without regard to what the
flow knows. Rounding can make a line that runs along an edge miss both portals beside it; it then
ends there, which only shortens it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.compiled import kernel, plain_kernel
from ptmtools.visibility.bits.kernels import ONE, ZERO, has, lowest
from ptmtools.visibility.storage import Bits, Floats, Geometry, Ints


@plain_kernel
def draw(state: np.uint64) -> tuple[np.uint64, float]:
    """The next state of a 64-bit xorshift generator (not 0), and a number in [0, 1) from it."""
    x = np.uint64(state)
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    return x, np.float64(x >> np.uint64(11)) * 2.0**-53


@plain_kernel
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


@plain_kernel
def crosses(g: Geometry, q: int, origin: Floats, along: Floats) -> bool:
    """Whether a line crosses directed portal q in its direction."""
    k = q >> 1
    n0, n1, n2 = g.normal[k, 0], g.normal[k, 1], g.normal[k, 2]
    speed = n0 * along[0] + n1 * along[1] + n2 * along[2]
    if (speed if q & 1 == 0 else -speed) <= g.slack:
        return False
    t = (g.low[k] - n0 * origin[0] - n1 * origin[1] - n2 * origin[2]) / speed
    x0, x1, x2 = origin[0] + t * along[0], origin[1] + t * along[1], origin[2] + t * along[2]
    j = g.start[k + 1] - 1
    for i in range(g.start[k], g.start[k + 1]):
        p0, p1, p2 = g.point[j, 0], g.point[j, 1], g.point[j, 2]
        e0, e1, e2 = g.point[i, 0] - p0, g.point[i, 1] - p1, g.point[i, 2] - p2
        r0, r1, r2 = x0 - p0, x1 - p1, x2 - p2
        turn = (e1 * r2 - e2 * r1) * n0 + (e2 * r0 - e0 * r2) * n1 + (e0 * r1 - e1 * r0) * n2
        if turn < 0.0:
            return False
        j = i
    return True


@plain_kernel
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
                if has(known, source, q) and crosses(g, q, origin, along):
                    seen[q >> 6] |= ONE << np.uint64(q & 63)
                    leaf = g.leaf[q]
                    at = g.out_start[leaf]
                    steps += 1
            walked += steps + 1
    return walked


@kernel
def walk(g: Geometry, portal: int, origin: Floats, along: Floats, leaves: Ints, count: int) -> int:
    """Appends the leaves that a line enters from directed portal ``portal`` on; their number."""
    at_portal = portal
    while count < len(leaves):
        leaf = g.leaf[at_portal]
        leaves[count] = leaf
        count += 1
        onward = -1
        for i in range(g.out_start[leaf], g.out_start[leaf + 1]):
            q = g.out[i]
            if q >> 1 != at_portal >> 1 and crosses(g, q, origin, along):
                onward = q
                break
        if onward < 0:
            break
        at_portal = onward
    return count


@kernel
def _aim(g: Geometry, portal: int, state: np.uint64, origin: Floats, along: Floats) -> np.uint64:
    """A random point of a portal and a direction: to a random point of another, or any."""
    state = place_in(g, portal, state, origin)
    state, r = draw(state)
    count = len(g.normal)
    if r < 0.5 and count > 1:
        other = min(int(2.0 * r * count), count - 1)
        state = place_in(g, other, state, along)
        for a in range(3):
            along[a] -= origin[a]
        return state
    # Uniform in a ball, without functions that differ between machines.
    while True:
        square = 0.0
        for a in range(3):
            state, u = draw(state)
            along[a] = 2.0 * u - 1.0
            square += along[a] * along[a]
        if 1e-3 < square <= 1.0:
            return state


@kernel
def shoot(g: Geometry, first: int, last: int, lines: int, seed: int, sees: Bits) -> int:
    """Marks in ``sees`` (L, W) the pairs of leaves on ``lines`` lines through each portal.

    Of the portals first … last - 1; rows of bits over leaves. A line is drawn from ``seed``, the
    portal and its own number, so that who shoots it does not matter. Returns the lines that were
    not level with the portal.
    """
    origin, along = np.empty(3), np.empty(3)
    forward = np.empty(len(g.out_start), np.int64)
    back = np.empty(len(g.out_start), np.int64)
    shot = 0
    for k in range(first, last):
        for i in range(lines):
            state = np.uint64(seed + 1) * np.uint64(0xD1342543DE82EF95)
            state ^= np.uint64(k * lines + i + 1) * np.uint64(0x9E3779B97F4A7C15)
            state ^= state >> np.uint64(29)
            if state == np.uint64(0):
                state = ONE
            for _warm in range(2):
                state, _ = draw(state)
            state = _aim(g, k, state, origin, along)
            speed = 0.0
            for a in range(3):
                speed += g.normal[k, a] * along[a]
            if abs(speed) <= g.slack:
                continue
            shot += 1
            p = 2 * k if speed > 0.0 else 2 * k + 1
            ahead = walk(g, p, origin, along, forward, 0)
            for a in range(3):
                along[a] = -along[a]
            behind = walk(g, p ^ 1, origin, along, back, 0)
            mark(forward, ahead, back, behind, sees)
    return shot


@kernel
def mark(forward: Ints, ahead: int, back: Ints, behind: int, sees: Bits) -> None:
    """Every leaf of a line sees every other: those ahead, those behind, those across."""
    for i in range(ahead + behind):
        a = forward[i] if i < ahead else back[i - ahead]
        for j in range(ahead + behind):
            b = forward[j] if j < ahead else back[j - ahead]
            sees[a, b >> 6] |= ONE << np.uint64(b & 63)


@kernel
def confirm(
    g: Geometry, pairs: NDArray[np.int32], first: int, last: int, tries: int, hit: Ints
) -> None:
    """Tries to show that leaves see each other, by lines from a portal of one to one of the other.

    pairs: (n, 2), of which those from ``first`` to ``last`` - 1 are tried. hit: (n,) zeros; becomes
    the number of the line that showed it, from 1 on, or stays 0 after ``tries`` lines.
    """
    origin, along = np.empty(3), np.empty(3)
    leaves = np.empty(len(g.out_start), np.int64)
    for i in range(first, last):
        a, b = pairs[i, 0], pairs[i, 1]
        of_a, of_b = g.out_start[a + 1] - g.out_start[a], g.out_start[b + 1] - g.out_start[b]
        if of_a == 0 or of_b == 0:
            continue
        state = np.uint64(i + 1) * np.uint64(0x9E3779B97F4A7C15)
        for n in range(tries):
            state, u = draw(state)
            state, v = draw(state)
            p = g.out[g.out_start[a] + min(int(u * of_a), of_a - 1)]
            q = g.out[g.out_start[b] + min(int(v * of_b), of_b - 1)]
            state = place_in(g, p >> 1, state, origin)
            state = place_in(g, q >> 1, state, along)
            speed = 0.0
            for c in range(3):
                along[c] -= origin[c]
                speed += g.normal[p >> 1, c] * along[c]
            if (speed if p & 1 == 0 else -speed) <= g.slack:
                continue
            count = walk(g, p, origin, along, leaves, 0)
            for j in range(count):
                if leaves[j] == b:
                    hit[i] = n + 1
            if hit[i] > 0:
                break
