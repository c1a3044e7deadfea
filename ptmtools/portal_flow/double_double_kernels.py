"""Sequences of portals in double-double arithmetic, compiled.

A number is the unevaluated sum of two doubles, kept as the parts of a complex number: the real one
is the sum, rounded, and the imaginary one the rest; 106 bits. Only the sign of such a number is
changed by complex arithmetic. Sums and products are built from error-free transformations (Dekker,
Numer. Math. 18, 1971; Knuth, TAOCP 2, 4.2.2). Coordinates are at most 1, so that results computed
from them are right to `ERROR`.

The clipping is that of the flow, with polygons and half-spaces too large by more than all errors
together, so that an empty result is certain. Planes are a unit normal n and an offset d; kept is
n·x + d >= 0.

Proof. A vertex newly cut is computed somewhere on an edge, wrong by less than `ERROR`; the point at
the same share of the true edge is off by as much as the ends are. So after k cuts a vertex is off
by less than (k + 1) · `ERROR` <= `WRONG` from that of a polygon Q, convex and in the portal's
plane. Sides are computed to far less than `WRONG`. Q contains the true remainder: an accepted plane
has a gap of at least SLACK / 2 between computed polygons, so of SLACK / 2 - 4 WRONG >= 0 between
the true ones, and does separate them. It is moved by SLACK, so the part cut off Q is outside the
true half-space by SLACK - 4 WRONG > 0. A polygon that would take too much room is left uncut.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.jit import plain_kernel as kernel
from ptmtools.portal_flow.storage import DDPortals, DDScratch

#: Bound of the error of a product of vectors and of a vertex newly cut.
ERROR = 2.0**-99
#: Most cuts of a polygon.
CUTS = 255
#: Bound of the error of a vertex after `CUTS` cuts of points rounded once.
WRONG = (CUTS + 1) * ERROR
#: Margin by which polygons and half-spaces are too large. A plane is accepted if it leaves half of
#: this between two polygons, each wrong by `WRONG` and measured with that error.
SLACK = 8 * WRONG
#: A value below the greatest by this share in doubles is certainly less.
ROUGHLY = 2.0**-24
#: Slots: the rest of the source, of the portal passed last and of the next; spare.
SOURCE, PASSED, NEXT, SPARE = 0, 1, 2, 3
#: Rows of planes: those that bound all lines so far, and others.
BOUNDS, OTHERS = 0, 1

_SPLITTER = 2.0**27 + 1.0


@kernel
def two_sum(a: float, b: float) -> complex:
    """a + b, exactly."""
    s = a + b
    t = s - a
    return complex(s, (a - (s - t)) + (b - t))


@kernel
def two_product(a: float, b: float) -> complex:
    """a · b, exactly."""
    p = a * b
    t = _SPLITTER * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLITTER * b
    b1 = t - (t - b)
    b2 = b - b1
    return complex(p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2)


@kernel
def add(a: complex, b: complex) -> complex:
    """a + b, to 2⁻¹⁰⁴ of |a| + |b|."""
    s, t = two_sum(a.real, b.real), two_sum(a.imag, b.imag)
    s = two_sum(s.real, s.imag + t.real)
    return two_sum(s.real, s.imag + t.imag)


@kernel
def less(a: complex, b: complex) -> complex:
    """a - b."""
    return add(a, -b)


@kernel
def times(a: complex, b: complex) -> complex:
    """a · b, to 2⁻¹⁰² of it."""
    p = two_product(a.real, b.real)
    return two_sum(p.real, p.imag + (a.real * b.imag + a.imag * b.real))


@kernel
def scale_by(a: complex, b: float) -> complex:
    """a · b, to 2⁻¹⁰² of it."""
    return times(a, complex(b, 0.0))


@kernel
def divide(a: complex, b: complex) -> complex:
    """a / b, to 2⁻¹⁰⁰ of it."""
    first = a.real / b.real
    rest = less(a, scale_by(b, first))
    second = rest.real / b.real
    rest = less(rest, scale_by(b, second))
    s = two_sum(first, second)
    return two_sum(s.real, s.imag + rest.real / b.real)


@kernel
def greater(a: complex, b: complex) -> bool:
    """a > b."""
    return a.real > b.real or (a.real == b.real and a.imag > b.imag)


@kernel
def side(s: DDScratch, row: int, i: int, slot: int, k: int) -> complex:
    """n·x + d of plane i of a row and vertex k of a polygon."""
    total: complex = s.plane[row, i, 3]
    for a in range(3):
        total = add(total, times(s.plane[row, i, a], s.polygon[slot, k, a]))
    return total


@kernel
def clip(s: DDScratch, row: int, count: int, slot: int) -> bool:
    """Keeps the part of a polygon in all half-spaces of a row, in place; returns whether it is not
    empty."""
    polygon = s.polygon
    for i in range(count):
        size = s.size[slot]
        low, high = np.inf, -np.inf
        for k in range(size):
            d = s.side[k] = side(s, row, i, slot, k)
            low, high = min(low, d.real), max(high, d.real)
        if high <= 0:
            return False
        if low >= 0 or size + 2 > polygon.shape[1] or s.cuts[slot] == CUTS:
            continue
        s.cuts[slot] += 1
        m = 0
        for k in range(size):
            j = k + 1 if k + 1 < size else 0
            d, e = s.side[k], s.side[j]
            if d.real >= 0:
                for a in range(3):
                    polygon[SPARE, m, a] = polygon[slot, k, a]
                m += 1
            if (d.real > 0 and e.real < 0) or (d.real < 0 and e.real > 0):
                share = divide(d, less(d, e))
                for a in range(3):
                    x = polygon[slot, k, a]
                    polygon[SPARE, m, a] = add(x, times(share, less(polygon[slot, j, a], x)))
                m += 1
        move(s, SPARE, slot, m)
    return True


@kernel
def move(s: DDScratch, source: int, target: int, count: int) -> None:
    """Puts the first vertices of one polygon into the place of another."""
    for i in range(count):
        for a in range(3):
            s.polygon[target, i, a] = s.polygon[source, i, a]
    s.size[target] = count


@kernel
def load(g: DDPortals, s: DDScratch, k: int, slot: int) -> None:
    """Puts the polygon of portal k into a slot."""
    first = g.start[k]
    s.size[slot], s.cuts[slot] = g.start[k + 1] - first, 0
    for i in range(s.size[slot]):
        for a in range(3):
            s.polygon[slot, i, a] = g.point[first + i, a]


@kernel
def separators_through(
    g: DDPortals, s: DDScratch, a: int, q: int, b: int, flip: bool, row: int, count: int
) -> int:
    """Appends to a row the planes that separate polygons ``a`` and ``b`` through the edges of a.

    Polygon a is the rest of directed portal q, which leads towards b. The plane through an edge
    turns about it, outwards in a's plane + t · normal: the least t that has all of b beyond, and a
    little more. It is accepted by measuring both polygons. With ``flip`` the kept side is a's, else
    b's. Returns the planes in the row.
    """
    polygon, plane, edge, outward = s.polygon, s.plane, s.vector[0], s.vector[1]
    k, sign = q >> 1, 1.0 if q & 1 == 0 else -1.0
    for i in range(s.size[a]):
        if count == plane.shape[1]:
            break
        j = i + 1 if i + 1 < s.size[a] else 0
        length = 0.0
        for c in range(3):
            edge[c] = less(polygon[a, j, c], polygon[a, i, c])
            length += edge[c].real * edge[c].real
        length = np.sqrt(length)
        if length <= ERROR:
            continue
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            x = scale_by(edge[c1], g.normal[k, c2] / length)
            outward[c] = less(x, scale_by(edge[c2], g.normal[k, c1] / length))
        turn = complex(-np.inf, 0.0)
        for m in range(s.size[b]):
            u = v = complex(0.0, 0.0)
            for c in range(3):
                r = less(polygon[b, m, c], polygon[a, i, c])
                u = add(u, times(outward[c], r))
                v = add(v, scale_by(r, sign * g.normal[k, c]))
            if v.real > ERROR:
                rough = -u.real / v.real
                if rough + ROUGHLY * (1.0 + abs(rough)) < turn.real:
                    continue
                # Moved further, so that the vertex is SLACK beyond the plane.
                more = SLACK * np.sqrt(1.0 + rough * rough) / v.real
                t = add(divide(-u, v), complex(more, 0.0))
                if greater(t, turn):
                    turn = t
        if turn.real == -np.inf:
            continue
        scale = 1.0 / np.sqrt(1.0 + turn.real * turn.real)
        for c in range(3):
            x = add(outward[c], scale_by(turn, sign * g.normal[k, c]))
            plane[row, count, c] = scale_by(x, scale)
        plane[row, count, 3] = 0.0
        before, beyond = complex(-np.inf, 0.0), complex(np.inf, 0.0)
        for m in range(s.size[a]):
            d = side(s, row, count, a, m)
            if greater(d, before):
                before = d
        for m in range(s.size[b]):
            d = side(s, row, count, b, m)
            if greater(beyond, d):
                beyond = d
        if less(beyond, before).real < SLACK / 2:
            continue
        offset = -beyond
        if flip:
            for c in range(3):
                plane[row, count, c] = -plane[row, count, c]
            offset = before
        plane[row, count, 3] = add(offset, complex(SLACK, 0.0))
        count += 1
    return count


@kernel
def own_plane(g: DDPortals, s: DDScratch, q: int, row: int) -> None:
    """The first plane of a row := that of directed portal q; kept is what lies beyond it, and
    SLACK more."""
    k, sign = q >> 1, 1.0 if q & 1 == 0 else -1.0
    offset = complex(SLACK, 0.0)
    for a in range(3):
        n = complex(sign * g.normal[k, a], 0.0)
        s.plane[row, 0, a] = n
        offset = less(offset, times(n, g.point[g.start[k], a]))
    s.plane[row, 0, 3] = offset


@kernel
def something_left(g: DDPortals, s: DDScratch, sequence: Ints) -> bool:
    """Whether any part of a sequence of directed portals remains after clipping; False is certain.

    The next portal is clipped by all planes so far, the source by the next, the next by those that
    separate source and passed, the source by those of next and passed; the planes that separate
    source and next bound all lines further on.
    """
    first = sequence[0]
    load(g, s, first >> 1, SOURCE)
    own_plane(g, s, first, BOUNDS)
    bounds = 1
    for i in range(1, len(sequence)):
        q, last = sequence[i], sequence[i - 1]
        load(g, s, q >> 1, NEXT)
        own_plane(g, s, q ^ 1, OTHERS)
        if not clip(s, BOUNDS, bounds, NEXT) or not clip(s, OTHERS, 1, SOURCE):
            return False
        if i > 1:
            count = separate(g, s, SOURCE, first, PASSED, last ^ 1, OTHERS, 0)
            if not clip(s, OTHERS, count, NEXT):
                return False
            count = separate(g, s, NEXT, q ^ 1, PASSED, last, OTHERS, 0)
            if not clip(s, OTHERS, count, SOURCE):
                return False
        bounds = separate(g, s, SOURCE, first, NEXT, q ^ 1, BOUNDS, 1)
        move(s, NEXT, PASSED, s.size[NEXT])
        s.cuts[PASSED] = s.cuts[NEXT]
    return True


@kernel
def separate(
    g: DDPortals, s: DDScratch, a: int, p: int, b: int, q: int, row: int, count: int
) -> int:
    """Row ``row`` from plane ``count`` on := all planes that separate polygon a, left of directed
    portal p, from b, left of q; p and q lead towards each other. Kept is the side of b, and beyond.
    Returns the planes in the row."""
    count = separators_through(g, s, a, p, b, False, row, count)
    return separators_through(g, s, b, q, a, True, row, count)
