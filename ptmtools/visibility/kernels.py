"""Compiled loops of the portal flow (see `flow` for the method and its argument).

Conventions. Every undirected portal k has a unit normal and is listed counter-clockwise around
it; the directed portal 2k crosses it along the normal, 2k + 1 against it, so ``q ^ 1`` is the
way back. Rows of bits are little-endian words over directed portals. Polygons live in numbered
slots of one scratch array; frame f of the depth-first search owns the slots 2f (what is left of
the source) and 2f + 1 (what is left of the portal passed last).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bits = NDArray[np.uint64]

ONE = np.uint64(1)
ZERO = np.uint64(0)
# Index of the lowest set bit: a De Bruijn sequence of order 6 and its inverse.
DE_BRUIJN = np.uint64(0x03F79D71B4CB0A89)
LOW_BIT = np.zeros(64, dtype=np.int64)
for _i in range(64):
    LOW_BIT[((0x03F79D71B4CB0A89 << _i) & 0xFFFFFFFFFFFFFFFF) >> 58] = _i

EMPTY, WHOLE, CUT = 0, 1, 2


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
    via: Ints  # (D,) the directed portal that led into the frame
    at: Ints  # (D,) next candidate, index into out
    distance: Floats  # (V,)


@njit(cache=True, nogil=True)
def has(rows: Bits, p: int, q: int) -> bool:
    """Whether bit q of row p is set."""
    return bool((rows[p, q >> 6] >> np.uint64(q & 63)) & ONE)


@njit(cache=True, nogil=True)
def ahead(g: Geometry, p: int, q: int) -> bool:
    """Whether a straight line may cross directed portal p and then q, by their planes alone."""
    k, j = p >> 1, q >> 1
    if k == j:
        return False
    # Something of q must lie beyond p's plane: max over q of ±n·x > min over p of ±n·x.
    n = g.normal[k]
    s = 1.0 if p & 1 == 0 else -1.0
    floor = (g.low[k] if p & 1 == 0 else -g.high[k]) + g.slack
    found = False
    for i in range(g.start[j], g.start[j + 1]):
        x = g.point[i]
        if s * (n[0] * x[0] + n[1] * x[1] + n[2] * x[2]) > floor:
            found = True
            break
    if not found:
        return False
    # And something of p before q's plane.
    n = g.normal[j]
    s = 1.0 if q & 1 == 0 else -1.0
    ceiling = (g.high[j] if q & 1 == 0 else -g.low[j]) - g.slack
    for i in range(g.start[k], g.start[k + 1]):
        x = g.point[i]
        if s * (n[0] * x[0] + n[1] * x[1] + n[2] * x[2]) < ceiling:
            return True
    return False


@njit(cache=True, nogil=True)
def fill_ahead(g: Geometry, first: int, last: int, rows: Bits) -> None:
    """Sets the bits of `ahead` in rows first … last - 1 of ``rows`` (2K, W)."""
    for p in range(first, last):
        for q in range(len(g.leaf)):
            if ahead(g, p, q):
                rows[p, q >> 6] |= ONE << np.uint64(q & 63)


@njit(cache=True, nogil=True)
def flood(g: Geometry, front: Bits, first: int, last: int, rows: Bits) -> None:
    """Rows first … last - 1 of ``rows`` become what a flood reaches through ``front``.

    A portal is reached when it lies ahead of the source and of the portal before it.
    """
    stack = np.empty(len(g.leaf) + 1, np.int64)
    for p in range(first, last):
        stack[0] = p
        top = 1
        while top > 0:
            top -= 1
            r = stack[top]
            leaf = g.leaf[r]
            for i in range(g.out_start[leaf], g.out_start[leaf + 1]):
                q = g.out[i]
                if has(front, p, q) and (r == p or has(front, r, q)) and not has(rows, p, q):
                    rows[p, q >> 6] |= ONE << np.uint64(q & 63)
                    stack[top] = q
                    top += 1


@njit(cache=True, nogil=True)
def tighten(g: Geometry, known: Bits) -> None:
    """One round of: what p may see, some q behind p's next leaf is or may see; then symmetry."""
    n, words = known.shape
    some = np.empty(words, np.uint64)
    for p in range(n):
        some[:] = ZERO
        leaf = g.leaf[p]
        for i in range(g.out_start[leaf], g.out_start[leaf + 1]):
            q = g.out[i]
            if has(known, p, q):
                for w in range(words):
                    some[w] |= known[q, w]
                some[q >> 6] |= ONE << np.uint64(q & 63)
        for w in range(words):
            known[p, w] &= some[w]
    for p in range(n):
        drop_unreturned(known, p)


@njit(cache=True, nogil=True)
def drop_unreturned(known: Bits, p: int) -> None:
    """Where p does not see q, the way back from q does not see the way back from p."""
    back = p ^ 1
    w, keep = back >> 6, ~(ONE << np.uint64(back & 63))
    for q in range(len(known)):
        if not has(known, p, q):
            known[q ^ 1, w] &= keep


@njit(cache=True, nogil=True)
def clip(
    polygon: Floats,
    size: Ints,
    slot: int,
    distance: Floats,
    n0: float,
    n1: float,
    n2: float,
    c: float,
    slack: float,
) -> int:
    """Keeps what of a polygon lies at n·x >= c, and ``slack`` more; in place.

    EMPTY if nothing reaches beyond c + slack. A polygon that would outgrow its slot stays WHOLE.
    """
    count = size[slot]
    low, high = np.inf, -np.inf
    for i in range(count):
        d = n0 * polygon[slot, i, 0] + n1 * polygon[slot, i, 1] + n2 * polygon[slot, i, 2] - c
        distance[i] = d
        low = min(low, d)
        high = max(high, d)
    if high <= slack:
        return EMPTY
    if low >= -slack:
        return WHOLE
    spare = len(polygon) - 1
    m = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        if m + 2 > polygon.shape[1]:
            return WHOLE
        d, e = distance[i] + slack, distance[j] + slack
        if d >= 0:
            for a in range(3):
                polygon[spare, m, a] = polygon[slot, i, a]
            m += 1
        if (d > 0 and e < 0) or (d < 0 and e > 0):
            t = d / (d - e)
            for a in range(3):
                x = polygon[slot, i, a]
                polygon[spare, m, a] = x + t * (polygon[slot, j, a] - x)
            m += 1
    copy(polygon, size, spare, slot, m)
    return CUT


@njit(cache=True, nogil=True)
def copy(polygon: Floats, size: Ints, source: int, target: int, count: int) -> None:
    """Puts the first ``count`` vertices of one slot into another."""
    for i in range(count):
        for a in range(3):
            polygon[target, i, a] = polygon[source, i, a]
    size[target] = count


@njit(cache=True, nogil=True)
def load(point: Floats, start: Ints, k: int, polygon: Floats, size: Ints, slot: int) -> None:
    """Puts the winding of portal k into a slot."""
    first = start[k]
    count = start[k + 1] - first
    for i in range(count):
        for a in range(3):
            polygon[slot, i, a] = point[first + i, a]
    size[slot] = count


@njit(cache=True, nogil=True)
def separators_through(
    polygon: Floats,
    size: Ints,
    a: int,
    n0: float,
    n1: float,
    n2: float,
    sign: float,
    b: int,
    flip: bool,
    plane: Floats,
    row: int,
    count: int,
    slack: float,
) -> int:
    """Appends to plane row ``row`` the separating planes through the edges of polygon ``a``.

    (n0, n1, n2) is a's own normal, counter-clockwise; times ``sign`` it points towards polygon
    ``b``. The plane through an edge turns about it: outward in a's plane + t · towards b. The
    least t that has all of b on the far side gives the tightest separator. It is accepted by
    measuring both polygons against it, so a badly conditioned edge can only cost tightness. With
    ``flip`` the kept side is a's (a is the nearer to the target), else b's. Returns the number of
    planes in the row.
    """
    size_a, size_b = size[a], size[b]
    for i in range(size_a):
        if count == plane.shape[1]:
            break
        j = i + 1 if i + 1 < size_a else 0
        a0, a1, a2 = polygon[a, i, 0], polygon[a, i, 1], polygon[a, i, 2]
        e0, e1, e2 = polygon[a, j, 0] - a0, polygon[a, j, 1] - a1, polygon[a, j, 2] - a2
        w0 = e1 * n2 - e2 * n1
        w1 = e2 * n0 - e0 * n2
        w2 = e0 * n1 - e1 * n0
        length = np.sqrt(w0 * w0 + w1 * w1 + w2 * w2)
        if length <= 0.0:
            continue
        length = 1.0 / length
        w0, w1, w2 = w0 * length, w1 * length, w2 * length
        t = -np.inf
        for k in range(size_b):
            r0, r1, r2 = polygon[b, k, 0] - a0, polygon[b, k, 1] - a1, polygon[b, k, 2] - a2
            u = w0 * r0 + w1 * r1 + w2 * r2
            v = sign * (n0 * r0 + n1 * r1 + n2 * r2)
            if v > slack:
                t = max(t, -u / v)
            elif u < -slack:
                t = np.inf
                break
        if not np.isfinite(t):
            continue
        scale = 1.0 / np.sqrt(1.0 + t * t)
        t *= sign
        m0, m1, m2 = (w0 + t * n0) * scale, (w1 + t * n1) * scale, (w2 + t * n2) * scale
        near, far = -np.inf, np.inf
        for k in range(size_a):
            near = max(near, m0 * polygon[a, k, 0] + m1 * polygon[a, k, 1] + m2 * polygon[a, k, 2])
        for k in range(size_b):
            far = min(far, m0 * polygon[b, k, 0] + m1 * polygon[b, k, 1] + m2 * polygon[b, k, 2])
        if near > far + slack:
            continue
        if flip:
            m0, m1, m2, far = -m0, -m1, -m2, -near
        plane[row, count, 0] = m0
        plane[row, count, 1] = m1
        plane[row, count, 2] = m2
        plane[row, count, 3] = far
        count += 1
    return count


@njit(cache=True, nogil=True)
def separate(
    polygon: Floats,
    size: Ints,
    a: int,
    k: int,
    sign_a: float,
    b: int,
    j: int,
    sign_b: float,
    normal: Floats,
    plane: Floats,
    row: int,
    slack: float,
) -> int:
    """Plane row ``row`` := all planes that separate a from b; kept is the side of b, and beyond.

    Polygon a lies in portal k and b in portal j; ``sign_a`` times k's normal points towards b,
    ``sign_b`` times j's towards a. Returns the number of planes.
    """
    n0, n1, n2 = normal[k, 0], normal[k, 1], normal[k, 2]
    count = separators_through(polygon, size, a, n0, n1, n2, sign_a, b, False, plane, row, 0, slack)
    n0, n1, n2 = normal[j, 0], normal[j, 1], normal[j, 2]
    return separators_through(
        polygon, size, b, n0, n1, n2, sign_b, a, True, plane, row, count, slack
    )


@njit(cache=True, nogil=True)
def clip_all(
    polygon: Floats,
    size: Ints,
    slot: int,
    distance: Floats,
    plane: Floats,
    row: int,
    count: int,
    slack: float,
) -> int:
    """Clips a polygon by the planes of a row; the status of `clip`."""
    status = WHOLE
    for i in range(count):
        n0, n1, n2 = plane[row, i, 0], plane[row, i, 1], plane[row, i, 2]
        now = clip(polygon, size, slot, distance, n0, n1, n2, plane[row, i, 3], slack)
        if now == EMPTY:
            return EMPTY
        if now == CUT:
            status = CUT
    return status


@njit(cache=True, nogil=True)
def beyond(
    point: Floats,
    start: Ints,
    ball: Floats,
    k: int,
    plane: Floats,
    row: int,
    count: int,
    slack: float,
) -> bool:
    """Whether portal k reaches beyond every plane of a row."""
    c0, c1, c2, radius = ball[k, 0], ball[k, 1], ball[k, 2], ball[k, 3]
    for i in range(count):
        n0, n1, n2 = plane[row, i, 0], plane[row, i, 1], plane[row, i, 2]
        d = n0 * c0 + n1 * c1 + n2 * c2 - plane[row, i, 3]
        if d > slack:
            continue
        if d + radius <= slack:
            return False
        floor = plane[row, i, 3] + slack
        found = False
        for j in range(start[k], start[k + 1]):
            if n0 * point[j, 0] + n1 * point[j, 1] + n2 * point[j, 2] > floor:
                found = True
                break
        if not found:
            return False
    return True


@njit(cache=True, nogil=True)
def thin_out(
    g: Geometry, might: Bits, frame: int, seen: Bits, plane: Floats, count: int
) -> tuple[bool, int]:
    """Drops from a frame's possible portals the unseen ones that its separators hide.

    Returns (whether an unseen one is left, portals tested).
    """
    left = False
    tested = 0
    for w in range(might.shape[1]):
        rest = might[frame, w] & ~seen[w]
        while rest != ZERO:
            low = rest & (~rest + ONE)
            q = (w << 6) + LOW_BIT[(low * DE_BRUIJN) >> np.uint64(58)]
            tested += 1
            if beyond(g.point, g.start, g.ball, q >> 1, plane, frame, count, g.slack):
                left = True
            else:
                might[frame, w] &= ~low
            rest &= ~low
    return left, tested


@njit(cache=True, nogil=True)
def flow(
    g: Geometry, s: Scratch, known: Bits, source: int, budget: int, seen: Bits
) -> tuple[int, bool]:
    """All directed portals that a line through ``source`` may cross after it.

    ``known`` (2K, W) is what each portal may see at most; ``seen`` (W,) the zeroed result row.
    Returns (operations, whether the budget or the depth cut the search short).
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
    ops = 0
    cut = False
    while f >= 0:
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
        if clip(polygon, size, b, distance, n0, n1, n2, floor, slack) == EMPTY:
            continue
        hidden = False
        for i in range(planes[f]):
            n0, n1, n2, c = plane[f, i, 0], plane[f, i, 1], plane[f, i, 2], plane[f, i, 3]
            if n0 * ball[k, 0] + n1 * ball[k, 1] + n2 * ball[k, 2] - c >= ball[k, 3]:
                continue
            ops += 1
            if clip(polygon, size, b, distance, n0, n1, n2, c, slack) == EMPTY:
                hidden = True
                break
        if hidden:
            continue
        copy(polygon, size, 2 * f, a, size[2 * f])
        ops += 1
        n0, n1, n2 = -sq * normal[k, 0], -sq * normal[k, 1], -sq * normal[k, 2]
        ceiling = g.high[k] if q & 1 == 0 else -g.low[k]
        status = clip(polygon, size, a, distance, n0, n1, n2, -ceiling, slack)
        if status == EMPTY:
            continue
        if f > 0:
            passed, last = 2 * f + 1, via[f]
            sp = 1.0 if last & 1 == 0 else -1.0
            last >>= 1
            if status == CUT:
                n = separate(
                    polygon, size, a, k0, s0, passed, last, -sp, normal, plane, depth, slack
                )
                ops += n + 1
                if clip_all(polygon, size, b, distance, plane, depth, n, slack) == EMPTY:
                    continue
            n = separate(polygon, size, b, k, -sq, passed, last, sp, normal, plane, depth, slack)
            ops += n + 1
            if clip_all(polygon, size, a, distance, plane, depth, n, slack) == EMPTY:
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
            left, tested = thin_out(g, might, child, seen, plane, planes[child])
            ops += 1 + (tested >> 3)
            if not left:
                continue
        if not room or ops >= budget:
            # Without room the frame's own set stands in for the child's.
            for w in range(words):
                seen[w] |= might[row, w]
            cut = True
            continue
        via[child] = q
        at[child] = g.out_start[g.leaf[q]]
        f = child
    return ops, cut
