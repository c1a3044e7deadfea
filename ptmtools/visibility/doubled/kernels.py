"""Sequences of portals in numbers of twice the length of a double, compiled.

A number is the unevaluated sum of two doubles, (high, low), the last axis of arrays; ``high`` is
the sum, rounded: 106 bits. Sums and products are built from error-free transformations (Dekker,
Numer. Math. 18, 1971; Knuth, TAOCP 2, 4.2.2). Coordinates are at most 1, so that what is computed
of them is right to `ERROR`.

The clipping is that of `exact`, twice: once *outside*, with polygons and half-spaces too large by
more than all errors together, so that what it finds empty is so; once *inside*, with both too
small. Planes are a unit normal n and an offset c; kept is n·x >= c.

Why that is certain. A vertex newly cut is computed somewhere on an edge, wrong by less than
`ERROR`; the same share of the true edge is off by what the ends are. So after k cuts a vertex is
off by less than e = (k + 1) · `ERROR` <= `WRONG` from that of a polygon Q, convex and in the
portal's plane. Sides are computed to far less than `WRONG`.

*Outside* Q contains what is truly left. A plane accepted has a gap of at least SLACK / 2 between
computed polygons, so of SLACK / 2 - 4 WRONG >= 0 between the true ones: it does separate them. It
is moved by SLACK, so what is cut off of Q is off the true half-space by SLACK - 4 WRONG > 0.

*Inside* Q lies in what is truly left, and smaller polygons are separated by more planes. The plane
through an edge and a vertex, all wrong by e, is off by less than 32 e / h elsewhere, where h is
the least height of the triangle between them: coordinates are at most 1, so a point of the plane
is (1 + 14 / h) times as wrong as the corners, and h, of which the third side is not looked at, may
be half of what is taken for it. Planes are moved by that and by SLACK, more than what is clipped
is wrong by; h is the least of all vertices that the true plane might touch (`least_height`). Where
an edge is too short or a vertex too near to a plane to be sure, it cannot be told.
"""

from __future__ import annotations

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.visibility.storage import DoubledPortals, DoubledScratch, Floats, Ints

Double = tuple[float, float]

#: What is left of a sequence: nothing, something; or it cannot be told.
CLOSED, OPEN, UNSURE = 0, 1, 2
#: More than a product of vectors and a vertex newly cut may be wrong by.
ERROR = 2.0**-99
#: How often a polygon is cut, at most.
CUTS = 255
#: More than a vertex of a polygon is wrong by, after so many cuts of points rounded once.
WRONG = (CUTS + 1) * ERROR
#: By how much polygons and half-spaces are larger outside and smaller inside. A plane is accepted
#: if it leaves half of this between two polygons, each wrong by `WRONG`, measured as well as that.
SLACK = 8 * WRONG
#: What is less than the greatest by this share in doubles is less, ...
ROUGHLY = 2.0**-24
#: Inside, edges and distances shorter than this decide nothing: wrong by `WRONG`, the angle of a
#: plane would be off by more than a 64th of `ROUGHLY`.
FLAT = 64 * WRONG / ROUGHLY
#: What of the source, of the portal passed last and of the next is left; spare.
SOURCE, PASSED, NEXT, SPARE = 0, 1, 2, 3
#: Rows of planes: those that bound all lines so far, and others.
BOUNDS, OTHERS = 0, 1

_SPLITTER = 2.0**27 + 1.0


@kernel
def two_sum(a: float, b: float) -> Double:
    """a + b, exactly."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@kernel
def two_product(a: float, b: float) -> Double:
    """a · b, exactly."""
    p = a * b
    t = _SPLITTER * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLITTER * b
    b1 = t - (t - b)
    b2 = b - b1
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


@kernel
def added(a: Double, b: Double) -> Double:
    """a + b, to 2⁻¹⁰⁴ of |a| + |b|."""
    s, e = two_sum(a[0], b[0])
    t, f = two_sum(a[1], b[1])
    s, e = two_sum(s, e + t)
    return two_sum(s, e + f)


@kernel
def less(a: Double, b: Double) -> Double:
    """a - b."""
    return added(a, (-b[0], -b[1]))


@kernel
def times(a: Double, b: Double) -> Double:
    """a · b, to 2⁻¹⁰² of it."""
    p, e = two_product(a[0], b[0])
    return two_sum(p, e + (a[0] * b[1] + a[1] * b[0]))


@kernel
def over(a: Double, b: Double) -> Double:
    """a / b, to 2⁻¹⁰⁰ of it."""
    first = a[0] / b[0]
    rest = less(a, times(b, (first, 0.0)))
    second = rest[0] / b[0]
    rest = less(rest, times(b, (second, 0.0)))
    s, e = two_sum(first, second)
    return two_sum(s, e + rest[0] / b[0])


@kernel
def greater(a: Double, b: Double) -> bool:
    """a > b."""
    return a[0] > b[0] or (a[0] == b[0] and a[1] > b[1])


@kernel
def side(s: DoubledScratch, row: int, i: int, slot: int, k: int) -> Double:
    """n·x - c of plane i of a row and vertex k of a polygon."""
    n, x = s.plane, s.polygon
    total = (-n[row, i, 3, 0], -n[row, i, 3, 1])
    for a in range(3):
        product = times((n[row, i, a, 0], n[row, i, a, 1]), (x[slot, k, a, 0], x[slot, k, a, 1]))
        total = added(total, product)
    return total


@kernel
def clip(s: DoubledScratch, row: int, count: int, slot: int, outside: bool) -> int:
    """Keeps what of a polygon lies in all half-spaces of a row, in place. CLOSED if a plane has
    nothing of it beyond, UNSURE if it outgrows its slot or is cut too often, else OPEN. Inside,
    vertices nearer than `FLAT` to the one before them are left out, which only makes it smaller."""
    polygon = s.polygon
    for i in range(count):
        size = s.size[slot]
        low, high = np.inf, -np.inf
        for k in range(size):
            d = side(s, row, i, slot, k)
            s.side[k, 0], s.side[k, 1] = d
            low, high = min(low, d[0]), max(high, d[0])
        if high <= 0:
            return CLOSED
        if low >= 0:
            continue
        s.cuts[slot] += 1
        if size + 2 > polygon.shape[1] or s.cuts[slot] > CUTS:
            return UNSURE
        m = 0
        for k in range(size):
            j = k + 1 if k + 1 < size else 0
            d, e = (s.side[k, 0], s.side[k, 1]), (s.side[j, 0], s.side[j, 1])
            if d[0] >= 0:
                for a in range(3):
                    polygon[SPARE, m, a, 0] = polygon[slot, k, a, 0]
                    polygon[SPARE, m, a, 1] = polygon[slot, k, a, 1]
                m += 1
            if (d[0] > 0 and e[0] < 0) or (d[0] < 0 and e[0] > 0):
                share = over(d, less(d, e))
                for a in range(3):
                    x = (polygon[slot, k, a, 0], polygon[slot, k, a, 1])
                    along = less((polygon[slot, j, a, 0], polygon[slot, j, a, 1]), x)
                    x = added(x, times(share, along))
                    polygon[SPARE, m, a, 0], polygon[SPARE, m, a, 1] = x
                m += 1
        move(s, SPARE, slot, m)
        if not outside:
            thin_out(s, slot)
            if s.size[slot] < 3:
                return UNSURE
    return OPEN


@kernel
def thin_out(s: DoubledScratch, slot: int) -> None:
    """Drops vertices of a polygon nearer than 2 · `FLAT` to the one before them."""
    x = s.polygon[slot]
    m = 0
    for k in range(s.size[slot]):
        if m > 0 and close(x, k, m - 1):
            continue
        for a in range(3):
            x[m, a, 0], x[m, a, 1] = x[k, a, 0], x[k, a, 1]
        m += 1
    while m > 1 and close(x, m - 1, 0):
        m -= 1
    s.size[slot] = m


@kernel
def close(x: Floats, i: int, j: int) -> bool:
    """Whether two vertices (V, 3, 2) are nearer than 2 · `FLAT` along every axis."""
    for a in range(3):
        if abs(x[i, a, 0] - x[j, a, 0] + (x[i, a, 1] - x[j, a, 1])) > 2 * FLAT:
            return False
    return True


@kernel
def move(s: DoubledScratch, source: int, target: int, count: int) -> None:
    """Puts the first vertices of one polygon into the place of another."""
    for i in range(count):
        for a in range(3):
            s.polygon[target, i, a, 0] = s.polygon[source, i, a, 0]
            s.polygon[target, i, a, 1] = s.polygon[source, i, a, 1]
    s.size[target] = count


@kernel
def load(g: DoubledPortals, s: DoubledScratch, k: int, slot: int) -> None:
    """Puts the winding of portal k into a slot."""
    first = g.start[k]
    s.size[slot], s.cuts[slot] = g.start[k + 1] - first, 0
    for i in range(s.size[slot]):
        for a in range(3):
            s.polygon[slot, i, a, 0] = g.point[first + i, a, 0]
            s.polygon[slot, i, a, 1] = g.point[first + i, a, 1]


@kernel
def beside(
    g: DoubledPortals,
    s: DoubledScratch,
    a: int,
    q: int,
    b: int,
    flip: bool,
    outside: bool,
    row: int,
    count: int,
) -> int:
    """Appends to a row the planes that separate polygons ``a`` and ``b`` through the edges of a.

    Polygon a is what is left of directed portal q, which leads towards b. The plane through an edge
    turns about it, outwards in a's plane + t · normal: the least t that has all of b beyond. With
    ``flip`` the kept side is a's, else b's. Outside, planes are turned a little further and
    accepted by measuring both polygons; inside, the kept side is drawn in by what the plane may be
    wrong by, and where that cannot be told the answer is -1. Returns the planes in the row.
    """
    wrong = ERROR * (1 + max(s.cuts[a], s.cuts[b]))
    polygon, plane, edge, outward = s.polygon, s.plane, s.vector[0], s.vector[1]
    k, sign = q >> 1, 1.0 if q & 1 == 0 else -1.0
    for i in range(s.size[a]):
        j = i + 1 if i + 1 < s.size[a] else 0
        length = 0.0
        for c in range(3):
            along = less(
                (polygon[a, j, c, 0], polygon[a, j, c, 1]),
                (polygon[a, i, c, 0], polygon[a, i, c, 1]),
            )
            edge[c, 0], edge[c, 1] = along
            length += along[0] * along[0]
        length = np.sqrt(length)
        if outside and length <= ERROR:
            continue
        if not outside and length < FLAT:
            return -1
        if count == plane.shape[1]:
            return -1
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            x = times((edge[c1, 0], edge[c1, 1]), (g.normal[k, c2] / length, 0.0))
            y = times((edge[c2, 0], edge[c2, 1]), (g.normal[k, c1] / length, 0.0))
            outward[c, 0], outward[c, 1] = less(x, y)
        turn: Double = (-np.inf, 0.0)
        left_out = False
        for m in range(s.size[b]):
            u: Double = (0.0, 0.0)
            v: Double = (0.0, 0.0)
            far = 0.0
            for c in range(3):
                r = less(
                    (polygon[b, m, c, 0], polygon[b, m, c, 1]),
                    (polygon[a, i, c, 0], polygon[a, i, c, 1]),
                )
                u = added(u, times((outward[c, 0], outward[c, 1]), r))
                v = added(v, times((sign * g.normal[k, c], 0.0), r))
                far += r[0] * r[0]
            if v[0] > ERROR:
                rough = -u[0] / v[0]
                if not outside:
                    high = np.sqrt(u[0] * u[0] + v[0] * v[0])
                    high *= min(1.0, length / max(length, np.sqrt(far)))
                    s.side[m, 0], s.side[m, 1] = rough, max(high, ERROR)
                if rough + ROUGHLY * (1.0 + abs(rough)) < turn[0]:
                    continue
                t = over((-u[0], -u[1]), v)
                if outside:  # by as much as has the vertex SLACK beyond the plane
                    t = added(t, (SLACK * np.sqrt(1.0 + t[0] * t[0]) / v[0], 0.0))
                if greater(t, turn):
                    turn = t
            elif not outside:
                if v[0] >= -wrong - ERROR and u[0] <= FLAT:
                    return -1
                s.side[m, 0], s.side[m, 1] = -np.inf, 1.0
                left_out = True
        if outside and turn[0] == -np.inf:
            continue
        if turn[0] == -np.inf or (left_out and turn[0] < -1 / ROUGHLY):
            return -1
        scale = 1.0 / np.sqrt(1.0 + turn[0] * turn[0])
        for c in range(3):
            x = times(turn, (sign * g.normal[k, c], 0.0))
            x = times(added((outward[c, 0], outward[c, 1]), x), (scale, 0.0))
            plane[row, count, c, 0], plane[row, count, c, 1] = x
        plane[row, count, 3, 0] = plane[row, count, 3, 1] = 0.0
        before: Double = (-np.inf, 0.0)
        beyond: Double = (np.inf, 0.0)
        for m in range(s.size[a]):
            d = side(s, row, count, a, m)
            if greater(d, before):
                before = d
        for m in range(s.size[b]):
            d = side(s, row, count, b, m)
            if greater(beyond, d):
                beyond = d
        between = less(beyond, before)[0]
        if outside:
            if between < SLACK / 2:
                continue
            shift = -SLACK
        else:
            height = least_height(s, s.size[b], turn[0], 32 * wrong)
            shift = SLACK + 32 * wrong / height
            if between < -shift:
                continue
        if flip:
            for c in range(3):
                plane[row, count, c, 0] *= -1.0
                plane[row, count, c, 1] *= -1.0
            beyond = (-before[0], -before[1])
        plane[row, count, 3, 0], plane[row, count, 3, 1] = added(beyond, (shift, 0.0))
        count += 1
    return count


@kernel
def least_height(s: DoubledScratch, count: int, turn: float, wrong: float) -> float:
    """Of the vertices, each with its t and height in ``side``, that may have the greatest t, if the
    angle of each is wrong by ``wrong`` over its height: the least height."""
    least = np.inf
    for m in range(count):
        t, height = s.side[m, 0], s.side[m, 1]
        angle = wrong / height
        if t == -np.inf or height >= least:
            continue
        more = ROUGHLY * (1.0 + abs(t)) + 2.0 * (1.0 + t * t) * angle
        if angle * (1.0 + abs(t)) > 0.25 or t + more >= turn:
            least = height
    return least


@kernel
def own(g: DoubledPortals, s: DoubledScratch, q: int, shift: float, row: int) -> None:
    """The first plane of a row := that of directed portal q; kept is what lies beyond it and
    ``shift``."""
    k, sign = q >> 1, 1.0 if q & 1 == 0 else -1.0
    offset: Double = (shift, 0.0)
    for a in range(3):
        n = (sign * g.normal[k, a], 0.0)
        x = (g.point[g.start[k], a, 0], g.point[g.start[k], a, 1])
        s.plane[row, 0, a, 0], s.plane[row, 0, a, 1] = n
        offset = added(offset, times(n, x))
    s.plane[row, 0, 3, 0], s.plane[row, 0, 3, 1] = offset


@kernel
def left(g: DoubledPortals, s: DoubledScratch, sequence: Ints, outside: bool) -> int:
    """What is left when a sequence of directed portals is clipped: CLOSED, nothing, which is
    certain if ``outside``; OPEN, something, which is certain if not; or UNSURE."""
    shift = -SLACK if outside else 2 * FLAT
    first = sequence[0]
    load(g, s, first >> 1, SOURCE)
    own(g, s, first, shift, BOUNDS)
    bounds = 1
    for i in range(1, len(sequence)):
        q, last = sequence[i], sequence[i - 1]
        load(g, s, q >> 1, NEXT)
        own(g, s, q ^ 1, shift, OTHERS)
        # By what is left of which polygons what is clipped: the next portal by all planes so far,
        # the source by the next, the next by source and passed, the source by next and passed; and
        # last the planes that bound all lines through source and next.
        for step in range(5):
            target = SOURCE if step & 1 else NEXT
            row, count = OTHERS, 1
            if step == 0:
                row, count = BOUNDS, bounds
            elif step > 1:
                if i == 1 and step < 4:
                    continue
                near, near_q = (NEXT, q ^ 1) if step == 3 else (SOURCE, first)
                beyond, beyond_q = PASSED, last if step == 3 else last ^ 1
                count = 0
                if step == 4:
                    beyond, beyond_q, row, count = NEXT, q ^ 1, BOUNDS, 1
                for flip in range(2):
                    a, b = (beyond, near) if flip else (near, beyond)
                    p = beyond_q if flip else near_q
                    count = beside(g, s, a, p, b, flip == 1, outside, row, count)
                    if count < 0:
                        return UNSURE
                if step == 4:
                    bounds = count
                    continue
            now = clip(s, row, count, target, outside)
            if now != OPEN:
                return now
        move(s, NEXT, PASSED, s.size[NEXT])
        s.cuts[PASSED] = s.cuts[NEXT]
    return OPEN
