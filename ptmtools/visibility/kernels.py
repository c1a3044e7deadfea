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

    point: np.ndarray  # (Q, 3) centred on the scene
    start: np.ndarray  # (K + 1,)
    normal: np.ndarray  # (K, 3)
    low: np.ndarray  # (K,) least and
    high: np.ndarray  # (K,) greatest normal·x over the portal's own points
    centre: np.ndarray  # (K, 3)
    radius: np.ndarray  # (K,)
    leaf: np.ndarray  # (2K,) the leaf that a directed portal leads into
    out_start: np.ndarray  # (L + 1,) CSR over leaves:
    out: np.ndarray  # (2K,) the directed portals that lead out of a leaf
    slack: float  # distances below this are rounding


class Scratch(NamedTuple):
    """Working storage of one worker; `flow.scratch` sizes it."""

    polygon: np.ndarray  # (2D + 3, V, 3)
    size: np.ndarray  # (2D + 3,)
    plane: np.ndarray  # (D + 1, 2V, 4) normal and offset: kept is where n·x >= offset
    planes: np.ndarray  # (D + 1,) how many
    might: np.ndarray  # (D, W) bits
    via: np.ndarray  # (D,) the directed portal that led into the frame
    at: np.ndarray  # (D,) next candidate, index into out
    distance: np.ndarray  # (V,)


@njit(cache=True, nogil=True)
def has(rows, p, q):
    """Whether bit q of row p is set."""
    return (rows[p, q >> 6] >> np.uint64(q & 63)) & ONE != ZERO


@njit(cache=True, nogil=True)
def ahead(g, p, q):
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
def fill_ahead(g, first, last, rows):
    """Sets the bits of `ahead` in rows first … last - 1 of ``rows`` (2K, W)."""
    for p in range(first, last):
        for q in range(len(g.leaf)):
            if ahead(g, p, q):
                rows[p, q >> 6] |= ONE << np.uint64(q & 63)


@njit(cache=True, nogil=True)
def flood(g, front, first, last, rows):
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
def tighten(g, known):
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
def drop_unreturned(known, p):
    """Where p does not see q, the way back from q does not see the way back from p."""
    back = p ^ 1
    w, keep = back >> 6, ~(ONE << np.uint64(back & 63))
    for q in range(len(known)):
        if not has(known, p, q):
            known[q ^ 1, w] &= keep


@njit(cache=True, nogil=True)
def clip(s, slot, n0, n1, n2, c, slack):
    """Keeps what of a polygon lies at n·x >= c, and ``slack`` more; in place.

    EMPTY if nothing reaches beyond c + slack. A polygon that would outgrow its slot stays WHOLE.
    """
    count = s.size[slot]
    low, high = np.inf, -np.inf
    poly = s.polygon[slot]
    for i in range(count):
        d = n0 * poly[i, 0] + n1 * poly[i, 1] + n2 * poly[i, 2] - c
        s.distance[i] = d
        low = min(low, d)
        high = max(high, d)
    if high <= slack:
        return EMPTY
    if low >= -slack or count + 1 > s.polygon.shape[1]:
        return WHOLE
    spare = s.polygon[len(s.polygon) - 1]
    m = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        d, e = s.distance[i] + slack, s.distance[j] + slack
        if d >= 0:
            spare[m] = poly[i]
            m += 1
        if (d > 0 and e < 0) or (d < 0 and e > 0):
            t = d / (d - e)
            for a in range(3):
                spare[m, a] = poly[i, a] + t * (poly[j, a] - poly[i, a])
            m += 1
    for i in range(m):
        poly[i] = spare[i]
    s.size[slot] = m
    return CUT


@njit(cache=True, nogil=True)
def separators_through(s, a, normal, sign, b, flip, row, slack):
    """Appends to plane row ``row`` the separating planes through the edges of polygon ``a``.

    ``normal`` is a's own, counter-clockwise; ``sign·normal`` points towards polygon ``b``. The
    plane through an edge turns about it: outward in a's plane + t · towards b. The least t that
    has all of b on the far side gives the tightest separator. It is accepted by measuring both
    polygons against it, so a badly conditioned edge can only cost tightness. With ``flip`` the
    kept side is a's (a is the nearer to the target), else b's.
    """
    pa, pb = s.polygon[a], s.polygon[b]
    na, nb = s.size[a], s.size[b]
    count = s.planes[row]
    for i in range(na):
        if count == s.plane.shape[1]:
            break
        j = i + 1 if i + 1 < na else 0
        e0, e1, e2 = pa[j, 0] - pa[i, 0], pa[j, 1] - pa[i, 1], pa[j, 2] - pa[i, 2]
        w0 = e1 * normal[2] - e2 * normal[1]
        w1 = e2 * normal[0] - e0 * normal[2]
        w2 = e0 * normal[1] - e1 * normal[0]
        length = np.sqrt(w0 * w0 + w1 * w1 + w2 * w2)
        if length <= 0.0:
            continue
        w0, w1, w2 = w0 / length, w1 / length, w2 / length
        t = -np.inf
        for k in range(nb):
            r0, r1, r2 = pb[k, 0] - pa[i, 0], pb[k, 1] - pa[i, 1], pb[k, 2] - pa[i, 2]
            u = w0 * r0 + w1 * r1 + w2 * r2
            v = sign * (normal[0] * r0 + normal[1] * r1 + normal[2] * r2)
            if v > slack:
                t = max(t, -u / v)
            elif u < -slack:
                t = np.inf
                break
        if not np.isfinite(t):
            continue
        scale = 1.0 / np.sqrt(1.0 + t * t)
        t *= sign
        m0 = (w0 + t * normal[0]) * scale
        m1 = (w1 + t * normal[1]) * scale
        m2 = (w2 + t * normal[2]) * scale
        near, far = -np.inf, np.inf
        for k in range(na):
            near = max(near, m0 * pa[k, 0] + m1 * pa[k, 1] + m2 * pa[k, 2])
        for k in range(nb):
            far = min(far, m0 * pb[k, 0] + m1 * pb[k, 1] + m2 * pb[k, 2])
        if near > far + slack:
            continue
        out = s.plane[row, count]
        if flip:
            out[0], out[1], out[2], out[3] = -m0, -m1, -m2, -near
        else:
            out[0], out[1], out[2], out[3] = m0, m1, m2, far
        count += 1
    s.planes[row] = count


@njit(cache=True, nogil=True)
def separate(s, a, normal_a, sign_a, b, normal_b, sign_b, row, slack):
    """Plane row ``row`` := all planes that separate a from b; kept is the side of b, and beyond.

    ``sign_a·normal_a`` points towards b, ``sign_b·normal_b`` towards a.
    """
    s.planes[row] = 0
    separators_through(s, a, normal_a, sign_a, b, False, row, slack)
    separators_through(s, b, normal_b, sign_b, a, True, row, slack)


@njit(cache=True, nogil=True)
def clip_all(s, slot, row, slack):
    """Clips a polygon by every plane of a row; returns (status, planes tried)."""
    status = WHOLE
    for i in range(s.planes[row]):
        m = s.plane[row, i]
        now = clip(s, slot, m[0], m[1], m[2], m[3], slack)
        if now == EMPTY:
            return EMPTY, i + 1
        if now == CUT:
            status = CUT
    return status, s.planes[row]


@njit(cache=True, nogil=True)
def load(g, s, slot, k):
    """Puts the winding of portal k into a slot."""
    count = g.start[k + 1] - g.start[k]
    for i in range(count):
        s.polygon[slot, i] = g.point[g.start[k] + i]
    s.size[slot] = count


@njit(cache=True, nogil=True)
def beyond(g, s, row, k):
    """Whether portal k reaches beyond every plane of a row."""
    c = g.centre[k]
    for i in range(s.planes[row]):
        m = s.plane[row, i]
        d = m[0] * c[0] + m[1] * c[1] + m[2] * c[2] - m[3]
        if d > g.slack:
            continue
        if d + g.radius[k] <= g.slack:
            return False
        found = False
        for j in range(g.start[k], g.start[k + 1]):
            x = g.point[j]
            if m[0] * x[0] + m[1] * x[1] + m[2] * x[2] - m[3] > g.slack:
                found = True
                break
        if not found:
            return False
    return True


@njit(cache=True, nogil=True)
def thin_out(g, s, frame, seen):
    """Drops from a frame's possible portals the unseen ones that its separators hide.

    Returns (whether an unseen one is left, portals tested).
    """
    left = False
    tested = 0
    might = s.might[frame]
    for w in range(len(might)):
        rest = might[w] & ~seen[w]
        while rest != ZERO:
            low = rest & (~rest + ONE)
            q = (w << 6) + LOW_BIT[(low * DE_BRUIJN) >> np.uint64(58)]
            tested += 1
            if beyond(g, s, frame, q >> 1):
                left = True
            else:
                might[w] &= ~low
            rest &= ~low
    return left, tested


@njit(cache=True, nogil=True)
def flow(g, s, known, source, budget, seen):
    """All directed portals that a line through ``source`` may cross after it.

    ``known`` (2K, W) is what each portal may see at most; ``seen`` (W,) the zeroed result row.
    Returns (operations, whether the budget or the depth cut the search short).
    """
    words = known.shape[1]
    depth = len(s.might)
    spare_row = depth
    slack = g.slack
    k0 = source >> 1
    n0 = g.normal[k0]
    s0 = 1.0 if source & 1 == 0 else -1.0
    floor = g.low[k0] if source & 1 == 0 else -g.high[k0]
    load(g, s, 0, k0)
    s.might[0] = known[source]
    s.via[0] = source
    s.at[0] = g.out_start[g.leaf[source]]
    s.planes[0] = 0
    f = 0
    ops = 0
    cut = False
    while f >= 0:
        leaf = g.leaf[s.via[f]]
        if s.at[f] == g.out_start[leaf + 1]:
            f -= 1
            continue
        q = g.out[s.at[f]]
        s.at[f] += 1
        word, bit = q >> 6, ONE << np.uint64(q & 63)
        if not has(s.might, f, q):
            continue
        child = f + 1
        room = child < depth
        row = child if room else f  # without room the frame's own set stands in for the child's
        fresh = False
        if room:
            for w in range(words):
                m = s.might[f, w] & known[q, w]
                s.might[child, w] = m
                if m & ~seen[w] != ZERO:
                    fresh = True
        else:
            fresh = True
        if not fresh and seen[word] & bit != ZERO:
            continue

        k = q >> 1
        sq = 1.0 if q & 1 == 0 else -1.0
        a, b = 2 * child, 2 * child + 1
        load(g, s, b, k)
        ops += 1
        if clip(s, b, s0 * n0[0], s0 * n0[1], s0 * n0[2], floor, slack) == EMPTY:
            continue
        if f > 0:
            status, tried = clip_all(s, b, f, slack)
            ops += tried
            if status == EMPTY:
                continue
        count = s.size[2 * f]
        for i in range(count):
            s.polygon[a, i] = s.polygon[2 * f, i]
        s.size[a] = count
        nq = g.normal[k]
        ceiling = g.high[k] if q & 1 == 0 else -g.low[k]
        ops += 1
        status = clip(s, a, -sq * nq[0], -sq * nq[1], -sq * nq[2], -ceiling, slack)
        if status == EMPTY:
            continue
        if f > 0:
            last = s.via[f]
            np_ = g.normal[last >> 1]
            sp = 1.0 if last & 1 == 0 else -1.0
            if status == CUT:
                separate(s, a, n0, s0, 2 * f + 1, np_, -sp, spare_row, slack)
                status, tried = clip_all(s, b, spare_row, slack)
                ops += tried + 1
                if status == EMPTY:
                    continue
            separate(s, b, nq, -sq, 2 * f + 1, np_, sp, spare_row, slack)
            status, tried = clip_all(s, a, spare_row, slack)
            ops += tried + 1
            if status == EMPTY:
                continue
        seen[word] |= bit
        if not fresh:
            continue
        if room:
            separate(s, a, n0, s0, b, nq, -sq, child, slack)
            left, tested = thin_out(g, s, child, seen)
            ops += 1 + (tested >> 3)
            if not left:
                continue
        if not room or ops >= budget:
            for w in range(words):
                seen[w] |= s.might[row, w]
            cut = True
            continue
        s.via[child] = q
        s.at[child] = g.out_start[g.leaf[q]]
        f = child
    return ops, cut
