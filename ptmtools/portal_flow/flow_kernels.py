"""Compiled loops of the portal flow (see `flow` for the method and its argument).

Conventions. Every undirected portal k has a unit normal and is listed counter-clockwise around it;
the directed portal 2k crosses it along the normal, 2k + 1 against it, so ``q ^ 1`` is the way back.
Rows of bits are little-endian words over directed portals. Of the slots of polygons (see
`clipping_kernels`) frame f of the depth-first search owns 2f (the rest of the source) and 2f + 1
(the rest of the portal passed last).

The pre-pass bounds each portal by planes and floods.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bits, Floats, Ints
from ptmtools.jit import kernel, plain_kernel
from ptmtools.portal_flow.clipping_kernels import (
    CUT,
    EMPTY,
    NEAR_TIE,
    WHOLE,
    clip,
    clip_all,
    copy,
    load,
    reaches_beyond,
    separate,
)
from ptmtools.portal_flow.line_kernels import ONE, ZERO, glance, has, lowest
from ptmtools.portal_flow.storage import PortalArrays, Scratch

#: Operations after which a search glances, which costs about as much again.
GLANCE_AFTER = 12_500


@plain_kernel
def record(s: Scratch, used: int, frame: int, q: int) -> int:
    """Appends the sequence of portals that led into a frame, and q, to the ``used`` words of
    `Scratch.near_tie`, if there is room; returns the words now used."""
    if used + frame + 2 > len(s.near_tie):
        return used
    s.near_tie[used] = frame + 1
    for f in range(1, frame + 1):
        s.near_tie[used + f] = s.via[f]
    s.near_tie[used + frame + 1] = q
    return used + frame + 2


@plain_kernel
def mark(sequence: Ints, first: int, count: int) -> np.uint64:
    """A hash (FNV-1a over words) of ``count`` portals of a sequence."""
    value = np.uint64(0xCBF29CE484222325)
    for i in range(first, first + count):
        value = (value ^ np.uint64(sequence[i])) * np.uint64(0x00000100000001B3)
    return value


@plain_kernel
def settle_status(s: Scratch, opened: Bits, lenient: bool, frame: int, q: int, status: int) -> int:
    """The status of a clip; NEAR_TIE becomes WHOLE if ``lenient``, or if the sequence of portals
    that led into the frame, and q, is among the ``opened`` ones, ascending `mark`s."""
    if status != NEAR_TIE or lenient:
        return WHOLE if status == NEAR_TIE else status
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
    g: PortalArrays, s: Scratch, opened: Bits, lenient: bool, frame: int, seen: Bits, used: int
) -> tuple[bool, int, int, int]:
    """Drops from a frame's possible portals the unseen ones that its separators hide.

    Returns (whether an unseen one is left, portals tested, how many of them by a near tie, words
    of `Scratch.near_tie` used).
    """
    might, plane, count = s.might, s.polygons.plane, s.planes[frame]
    remains = False
    tested = ties = 0
    for w in range(might.shape[1]):
        rest = might[frame, w] & ~seen[w]
        while rest != ZERO:
            q = (w << 6) + lowest(rest)
            tested += 1
            now = reaches_beyond(g, q >> 1, plane, frame, count)
            now = settle_status(s, opened, lenient, frame, q, now)
            if now == WHOLE:
                remains = True
            else:
                might[frame, w] &= ~(ONE << np.uint64(q & 63))
                if now == NEAR_TIE:
                    ties += 1
                    used = record(s, used, frame, q)
            rest &= rest - ONE
    return remains, tested, ties, used


@plain_kernel
def flow(
    g: PortalArrays,
    s: Scratch,
    known: Bits,
    source: int,
    budget: int,
    opened: Bits,
    lenient: bool,
    seen: Bits,
) -> tuple[int, bool, int, int]:
    """All directed portals that a line through ``source`` may cross after it.

    Rejections by near ties stand, except of the sequences with `mark`s in ``opened``, ascending, or
    of all if ``lenient``.

    ``known`` (2K, W) is what each portal may see at most; ``seen`` (W,) the result row,
    zeroed or with what is seen already. A
    search that grows long `glance`s, once: in an open hall nearly all portals are seen at once, and
    few are left to search for. (Glancing first costs more than it saves where walls are many: e1m1
    +30 %. Without it, a hall of 1,344 open portals spends its whole budget.) Returns (operations,
    whether the budget or the depth cut the search short, how many rejections were near ties, see
    `clipping_kernels`, words of `Scratch.near_tie` that list them).
    """
    words = known.shape[1]
    depth = len(s.might)
    c, plane, planes, might, via, at = s.polygons, s.polygons.plane, s.planes, s.might, s.via, s.at
    normal, ball = g.normal, g.ball
    k0 = source >> 1
    s0 = 1.0 if source & 1 == 0 else -1.0
    behind = -g.low[k0] if source & 1 == 0 else g.high[k0]
    n0, n1, n2 = s0 * normal[k0, 0], s0 * normal[k0, 1], s0 * normal[k0, 2]
    facing = (n0, n1, n2, behind)
    load(c, 0, g.point, g.start, k0)
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

        # The rest of the next portal (slot b), then of the source (slot a).
        ops += 1
        k = q >> 1
        sq = 1.0 if q & 1 == 0 else -1.0
        a, b = 2 * child, 2 * child + 1
        load(c, b, g.point, g.start, k)
        now = settle_status(s, opened, lenient, f, q, clip(c, b, facing))
        for i in range(planes[f]):
            if now <= EMPTY:
                break
            n0, n1, n2, d = plane[f, i, 0], plane[f, i, 1], plane[f, i, 2], plane[f, i, 3]
            if n0 * ball[k, 0] + n1 * ball[k, 1] + n2 * ball[k, 2] + d >= ball[k, 3]:
                continue
            ops += 1
            now = settle_status(s, opened, lenient, f, q, clip(c, b, (n0, n1, n2, d)))
        status = now
        if now > EMPTY:
            copy(c, 2 * f, a, c.size[2 * f])
            ops += 1
            n0, n1, n2 = -sq * normal[k, 0], -sq * normal[k, 1], -sq * normal[k, 2]
            before = g.high[k] if q & 1 == 0 else -g.low[k]
            now = settle_status(s, opened, lenient, f, q, clip(c, a, (n0, n1, n2, before)))
            status = now
        if now > EMPTY and f > 0:
            passed, last = 2 * f + 1, via[f]
            if status == CUT:
                n = separate(c, normal, a, source, passed, last ^ 1, depth)
                ops += n + 1
                now = settle_status(s, opened, lenient, f, q, clip_all(c, b, depth, n))
            if now > EMPTY:
                n = separate(c, normal, b, q ^ 1, passed, last, depth)
                ops += n + 1
                now = settle_status(s, opened, lenient, f, q, clip_all(c, a, depth, n))
        if now <= EMPTY:
            if now == NEAR_TIE:
                ties += 1
                used = record(s, used, f, q)
            continue
        seen[word] |= bit
        if not fresh:
            continue

        row = f
        if room:
            row = child
            planes[child] = separate(c, normal, a, source, b, q ^ 1, child)
            via[child] = q
            remains, tested, near, used = thin_out(g, s, opened, lenient, child, seen, used)
            ops += 1 + (tested >> 3)
            ties += near
            if not remains:
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


@plain_kernel
def reaches(g: PortalArrays, k: int, n: Floats, s: float, floor: float) -> bool:
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
def ahead(g: PortalArrays, p: int, q: int) -> bool:
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
def flood(g: PortalArrays, s: Scratch, first: int, last: int, rows: Bits) -> None:
    """Fills ``rows`` (last - first, W), zeroed, with the portals that floods from first … last - 1
    reach.

    From p and each next portal r a flood goes on through portals ahead of p and of the portal
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
            rows[p - first, r >> 6] |= ONE << np.uint64(r & 63)
            load(s.polygons, 0, g.point, g.start, p >> 1)
            load(s.polygons, 1, g.point, g.start, r >> 1)
            count = separate(s.polygons, g.normal, 0, p, 1, r ^ 1, 0)
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
                    visited[q] = wave  # portals that the planes hide are hidden on every path
                    if reaches_beyond(g, q >> 1, s.polygons.plane, 0, count) != EMPTY:
                        rows[p - first, q >> 6] |= ONE << np.uint64(q & 63)
                        stack[top] = q
                        top += 1


@kernel
def tighten(g: PortalArrays, first: int, last: int, known: Bits, tighter: Bits) -> None:
    """Fills rows first … last - 1 of ``tighter``: the portals that p may see by ``known`` and that
    are, or may be seen by, some q behind p's next leaf."""
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
