"""Compiled loops of the portal flow (see `flow` for the method and its argument).

Conventions. Every undirected portal k has a unit normal and is listed counter-clockwise around
it; the directed portal 2k crosses it along the normal, 2k + 1 against it, so ``q ^ 1`` is the
way back. Rows of bits are little-endian words over directed portals. Of the slots of polygons
(see `winding`) frame f of the depth-first search owns 2f (what is left of the source) and 2f + 1
(what is left of the portal passed last).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.compiled import kernel, plain_kernel
from ptmtools.visibility.winding.kernels import (
    CUT,
    EMPTY,
    GRAZED,
    WHOLE,
    beyond,
    clip,
    clip_all,
    copy,
    load,
    separate,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bits = NDArray[np.uint64]

ONE = np.uint64(1)
ZERO = np.uint64(0)
#: Operations after which a search glances, which costs about as much again.
GLANCE_AFTER = 12_500
# Index of the lowest set bit: a De Bruijn sequence of order 6 and its inverse.
DE_BRUIJN = np.uint64(0x03F79D71B4CB0A89)
LOW_BIT = np.zeros(64, dtype=np.int64)
for _i in range(64):
    LOW_BIT[((0x03F79D71B4CB0A89 << _i) & 0xFFFFFFFFFFFFFFFF) >> 58] = _i


class Geometry(NamedTuple):
    """Portals ready for the kernels; `flow.geometry` fills it."""

    point: Floats  # (Q, 3) centred on the scene
    start: Ints  # (K + 1,)
    normal: Floats  # (K, 3)
    low: Floats  # (K,) least and
    high: Floats  # (K,) greatest normal·x over the portal's own points
    ball: Floats  # (K, 4) centre and radius of a ball around it
    leaf: Ints  # (2K,) the leaf that a directed portal leads into
    out_start: Ints  # (L + 1,) CSR over leaves:
    out: Ints  # (2K,) the directed portals that lead out of a leaf
    slack: float  # distances below this are rounding


class Scratch(NamedTuple):
    """Working storage of one worker; `flow.scratch` sizes it."""

    polygon: Floats  # (2D + 3, V, 3)
    size: Ints  # (2D + 3,)
    plane: Floats  # (D + 1, 2V, 4) normal and offset: kept is where n·x >= offset
    planes: Ints  # (D + 1,) how many
    might: Bits  # (D, W) bits
    via: Ints  # (D + 1,) the directed portal that led into the frame
    at: Ints  # (D,) next candidate, index into out
    distance: Floats  # (V,)
    line: Floats  # (2, 3) a point and a direction
    hair: Ints  # (H,) sequences rejected by a hair, each after its length


@plain_kernel
def has(rows: Bits, p: int, q: int) -> bool:
    """Whether bit q of row p is set."""
    return bool((rows[p, q >> 6] >> np.uint64(q & 63)) & ONE)


@plain_kernel
def reaches(g: Geometry, k: int, n: Floats, s: float, floor: float) -> bool:
    """Whether portal k has a point with s · n·x > floor."""
    ball = g.ball
    middle = s * (n[0] * ball[k, 0] + n[1] * ball[k, 1] + n[2] * ball[k, 2])
    if middle > floor:
        return True
    if middle + ball[k, 3] <= floor:
        return False
    for i in range(g.start[k], g.start[k + 1]):
        if s * (n[0] * g.point[i, 0] + n[1] * g.point[i, 1] + n[2] * g.point[i, 2]) > floor:
            return True
    return False


@plain_kernel
def ahead(g: Geometry, p: int, q: int) -> bool:
    """Whether a straight line may cross directed portal p and then q, by their planes alone:
    something of q lies beyond p's plane, and something of p before q's."""
    k, j = p >> 1, q >> 1
    if k == j:
        return False
    s = 1.0 if p & 1 == 0 else -1.0
    floor = (g.low[k] if p & 1 == 0 else -g.high[k]) + g.slack
    if not reaches(g, j, g.normal[k], s, floor):
        return False
    s = -1.0 if q & 1 == 0 else 1.0
    floor = (-g.high[j] if q & 1 == 0 else g.low[j]) + g.slack
    return reaches(g, k, g.normal[j], s, floor)


@kernel
def flood(g: Geometry, s: Scratch, first: int, last: int, rows: Bits) -> None:
    """Rows first … last - 1 of ``rows`` (2K, W) become what floods from them reach.

    From p and each next portal r a flood goes on through what lies ahead of p and of the portal
    before it, and beyond the planes that separate p from r.
    """
    stack = np.empty(len(g.leaf) + 1, np.int64)
    visited = np.zeros(len(g.leaf), np.int64)
    facing = np.zeros(len(g.leaf), np.int64)  # ± (p + 1): whether a portal is ahead of p, if known
    wave = 0
    for p in range(first, last):
        leaf = g.leaf[p]
        for i in range(g.out_start[leaf], g.out_start[leaf + 1]):
            r = g.out[i]
            if not ahead(g, p, r):
                continue
            rows[p, r >> 6] |= ONE << np.uint64(r & 63)
            load(g.point, g.start, p >> 1, s.polygon, s.size, 0)
            load(g.point, g.start, r >> 1, s.polygon, s.size, 1)
            a, b = (1.0 if p & 1 == 0 else -1.0), (-1.0 if r & 1 == 0 else 1.0)
            count = separate(
                s.polygon, s.size, 0, p >> 1, a, 1, r >> 1, b, g.normal, s.plane, 0, g.slack
            )
            wave += 1
            stack[0] = r
            top = 1
            while top > 0:
                top -= 1
                before = stack[top]
                inside = g.leaf[before]
                for j in range(g.out_start[inside], g.out_start[inside + 1]):
                    q = g.out[j]
                    if visited[q] == wave:
                        continue
                    if abs(facing[q]) != p + 1:
                        facing[q] = p + 1 if ahead(g, p, q) else -p - 1
                    if facing[q] < 0 or not ahead(g, before, q):
                        continue
                    visited[q] = wave  # what the planes hide, they hide from wherever it is reached
                    now = beyond(g.point, g.start, g.ball, q >> 1, s.plane, 0, count, g.slack)
                    if now != EMPTY:
                        rows[p, q >> 6] |= ONE << np.uint64(q & 63)
                        stack[top] = q
                        top += 1


@kernel
def tighten(g: Geometry, _: Scratch, first: int, last: int, known: Bits, tighter: Bits) -> None:
    """Rows first … last - 1 of ``tighter``: what p may see by ``known``, if some q behind p's next
    leaf is it or may see it."""
    words = known.shape[1]
    some = np.empty(words, np.uint64)
    for p in range(first, last):
        some[:] = ZERO
        leaf = g.leaf[p]
        for i in range(g.out_start[leaf], g.out_start[leaf + 1]):
            q = g.out[i]
            if has(known, p, q):
                for w in range(words):
                    some[w] |= known[q, w]
                some[q >> 6] |= ONE << np.uint64(q & 63)
        for w in range(words):
            tighter[p, w] = known[p, w] & some[w]


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
def return_sight(g: Geometry, _: Scratch, first: int, last: int, known: Bits) -> None:
    """Rows of the blocks first … last - 1 of 64: p sees q only if the way back from q sees that
    from p. Rows may change meanwhile: what they lose so, p loses here anyway.
    """
    count, words = len(g.leaf), known.shape[1]
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
    """Where p sees q no longer, ``dropped`` (W,), the way back from q does not see that from p."""
    back = p ^ 1
    w, keep = back >> 6, ~(ONE << np.uint64(back & 63))
    for v in range(len(dropped)):
        rest = dropped[v]
        while rest != ZERO:
            low = rest & (~rest + ONE)
            rest &= ~low
            q = (v << 6) + LOW_BIT[(low * DE_BRUIJN) >> np.uint64(58)]
            known[q ^ 1, w] &= keep


@plain_kernel
def record(s: Scratch, used: int, frame: int, q: int) -> int:
    """Appends the sequence of portals that led into a frame, and q, to the ``used`` words of
    `Scratch.hair`, if there is room; returns the words now used."""
    if used + frame + 2 > len(s.hair):
        return used
    s.hair[used] = frame + 1
    for f in range(1, frame + 1):
        s.hair[used + f] = s.via[f]
    s.hair[used + frame + 1] = q
    return used + frame + 2


@plain_kernel
def mark(sequence: Ints, first: int, count: int) -> np.uint64:
    """A hash (FNV-1a over words) of ``count`` portals of a sequence."""
    value = np.uint64(0xCBF29CE484222325)
    for i in range(first, first + count):
        value = (value ^ np.uint64(sequence[i])) * np.uint64(0x00000100000001B3)
    return value


@plain_kernel
def settled(s: Scratch, opened: Bits, lenient: bool, frame: int, q: int, status: int) -> int:
    """The status of a clip; GRAZED becomes WHOLE if ``lenient``, or if the sequence of portals that
    led into the frame, and q, is among the ``opened`` ones, ascending `mark`s."""
    if status != GRAZED or lenient:
        return WHOLE if status == GRAZED else status
    if len(opened) == 0:
        return status
    before = s.via[frame + 1]
    s.via[frame + 1] = q
    value = mark(s.via, 1, frame + 1)
    s.via[frame + 1] = before
    low, high = 0, len(opened)
    while low < high:
        middle = (low + high) >> 1
        if opened[middle] < value:
            low = middle + 1
        else:
            high = middle
    return WHOLE if low < len(opened) and opened[low] == value else status


@plain_kernel
def thin_out(
    g: Geometry, s: Scratch, opened: Bits, lenient: bool, frame: int, seen: Bits, used: int
) -> tuple[bool, int, int, int]:
    """Drops from a frame's possible portals the unseen ones that its separators hide.

    Returns (whether an unseen one is left, portals tested, how many were dropped by a hair, words
    of `Scratch.hair` used).
    """
    might, plane, count = s.might, s.plane, s.planes[frame]
    left = False
    tested = ties = 0
    for w in range(might.shape[1]):
        rest = might[frame, w] & ~seen[w]
        while rest != ZERO:
            low = rest & (~rest + ONE)
            q = (w << 6) + LOW_BIT[(low * DE_BRUIJN) >> np.uint64(58)]
            tested += 1
            now = beyond(g.point, g.start, g.ball, q >> 1, plane, frame, count, g.slack)
            now = settled(s, opened, lenient, frame, q, now)
            if now == WHOLE:
                left = True
            else:
                might[frame, w] &= ~low
                if now == GRAZED:
                    ties += 1
                    used = record(s, used, frame, q)
            rest &= ~low
    return left, tested, ties, used


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
            low = rest & (~rest + ONE)
            rest &= ~low
            if seen[w] & low != ZERO:
                continue
            target = (w << 6) + LOW_BIT[(low * DE_BRUIJN) >> np.uint64(58)]
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


@plain_kernel
def flow(
    g: Geometry,
    s: Scratch,
    known: Bits,
    source: int,
    budget: int,
    opened: Bits,
    lenient: bool,
    seen: Bits,
) -> tuple[int, bool, int, int]:
    """All directed portals that a line through ``source`` may cross after it.

    Rejections by a hair stand, except of the sequences with `mark`s in ``opened``, ascending, or
    of all if ``lenient``.

    ``known`` (2K, W) is what each portal may see at most; ``seen`` (W,) the result row,
    zeroed or with what is seen already. A
    search that grows long `glance`s, once: in an open hall nearly all is seen at once, and what is
    left to look out for is little. (Glancing first costs more than it saves where walls are many:
    e1m1 +30 %. Without it, a hall of 1,344 open portals spends its whole budget.)
    Returns (operations, whether the budget or the depth cut the search short, ties: how many
    rejections were by a hair, see `winding`, words of `Scratch.hair` that tell which).
    """
    words = known.shape[1]
    depth = len(s.might)
    polygon, size, plane, planes, distance = s.polygon, s.size, s.plane, s.planes, s.distance
    might, via, at = s.might, s.via, s.at
    normal, ball, slack = g.normal, g.ball, g.slack
    k0 = source >> 1
    s0 = 1.0 if source & 1 == 0 else -1.0
    floor = g.low[k0] if source & 1 == 0 else -g.high[k0]
    load(g.point, g.start, k0, polygon, size, 0)
    for w in range(words):
        might[0, w] = known[source, w]
    via[0] = source
    at[0] = g.out_start[g.leaf[source]]
    planes[0] = 0
    f = 0
    ops = ties = used = 0
    cut = False
    looked = False
    while f >= 0:
        if not looked and GLANCE_AFTER <= ops < budget:
            ops += glance(g, known, source, seen, s.line)
            looked = True
        if at[f] == g.out_start[g.leaf[via[f]] + 1]:
            f -= 1
            continue
        q = g.out[at[f]]
        at[f] += 1
        if not has(might, f, q):
            continue
        word, bit = q >> 6, ONE << np.uint64(q & 63)
        child = f + 1
        room = child < depth
        fresh = not room
        if room:
            for w in range(words):
                m = might[f, w] & known[q, w]
                might[child, w] = m
                fresh |= m & ~seen[w] != ZERO
        if not fresh and seen[word] & bit != ZERO:
            continue

        # What is left of the next portal (slot b), then of the source (slot a).
        ops += 1
        k = q >> 1
        sq = 1.0 if q & 1 == 0 else -1.0
        a, b = 2 * child, 2 * child + 1
        load(g.point, g.start, k, polygon, size, b)
        n0, n1, n2 = s0 * normal[k0, 0], s0 * normal[k0, 1], s0 * normal[k0, 2]
        now = clip(polygon, size, b, distance, n0, n1, n2, floor, slack)
        now = settled(s, opened, lenient, f, q, now)
        for i in range(planes[f]):
            if now <= EMPTY:
                break
            n0, n1, n2, c = plane[f, i, 0], plane[f, i, 1], plane[f, i, 2], plane[f, i, 3]
            if n0 * ball[k, 0] + n1 * ball[k, 1] + n2 * ball[k, 2] - c >= ball[k, 3]:
                continue
            ops += 1
            now = clip(polygon, size, b, distance, n0, n1, n2, c, slack)
            now = settled(s, opened, lenient, f, q, now)
        status = now
        if now > EMPTY:
            copy(polygon, size, 2 * f, a, size[2 * f])
            ops += 1
            n0, n1, n2 = -sq * normal[k, 0], -sq * normal[k, 1], -sq * normal[k, 2]
            ceiling = g.high[k] if q & 1 == 0 else -g.low[k]
            now = clip(polygon, size, a, distance, n0, n1, n2, -ceiling, slack)
            now = status = settled(s, opened, lenient, f, q, now)
        if now > EMPTY and f > 0:
            passed, last = 2 * f + 1, via[f]
            sp = 1.0 if last & 1 == 0 else -1.0
            last >>= 1
            if status == CUT:
                n = separate(
                    polygon, size, a, k0, s0, passed, last, -sp, normal, plane, depth, slack
                )
                ops += n + 1
                now = clip_all(polygon, size, b, distance, plane, depth, n, slack)
                now = settled(s, opened, lenient, f, q, now)
            if now > EMPTY:
                n = separate(
                    polygon, size, b, k, -sq, passed, last, sp, normal, plane, depth, slack
                )
                ops += n + 1
                now = clip_all(polygon, size, a, distance, plane, depth, n, slack)
                now = settled(s, opened, lenient, f, q, now)
        if now <= EMPTY:
            if now == GRAZED:
                ties += 1
                used = record(s, used, f, q)
            continue
        seen[word] |= bit
        if not fresh:
            continue

        row = f
        if room:
            row = child
            planes[child] = separate(
                polygon, size, a, k0, s0, b, k, -sq, normal, plane, child, slack
            )
            via[child] = q
            left, tested, grazed, used = thin_out(g, s, opened, lenient, child, seen, used)
            ops += 1 + (tested >> 3)
            ties += grazed
            if not left:
                continue
        if not room or ops >= budget:
            # Without room the frame's own set stands in for the child's.
            for w in range(words):
                seen[w] |= might[row, w]
            cut = True
            continue
        at[child] = g.out_start[g.leaf[q]]
        f = child
    return ops, cut, ties, used
