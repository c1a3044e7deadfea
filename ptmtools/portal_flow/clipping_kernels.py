"""Clipping and separating convex polygons in space, compiled.

A directed portal 2k crosses portal k along its normal, 2k + 1 against it. Kept is the side in front
of a plane, n·x + d >= 0.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.jit import inlined_kernel, plain_kernel as kernel
from ptmtools.portal_flow.storage import Polygons, PortalArrays

#: A unit normal and an offset.
Plane = tuple[float, float, float, float]
#: Results of clipping. NEAR_TIE is EMPTY, but the polygon ends within `NEAR` slacks of where it
#: would have been kept.
NEAR_TIE, EMPTY, WHOLE, CUT = -1, 0, 1, 2
#: Slacks that make a near tie.
NEAR = 16.0
#: Edges shorter than this many slacks are left over from clipping; their direction is noise.
SHORTEST_EDGE = 16.0


@kernel
def clip(c: Polygons, slot: int, plane: Plane) -> int:
    """Keeps the part of a polygon in front of a plane, and the slack more; in place.

    EMPTY or NEAR_TIE if nothing reaches further in front than the slack. A polygon that would
    outgrow its slot stays WHOLE.
    """
    polygon, distance, slack = c.vertex, c.distance, c.slack
    n0, n1, n2, offset = plane
    count = c.size[slot]
    low, high = np.inf, -np.inf
    for i in range(count):
        d = n0 * polygon[slot, i, 0] + n1 * polygon[slot, i, 1] + n2 * polygon[slot, i, 2] + offset
        distance[i] = d
        low = min(low, d)
        high = max(high, d)
    if high <= slack:
        return EMPTY if high <= slack - NEAR * slack else NEAR_TIE
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
    copy(c, spare, slot, m)
    return CUT


@kernel
def copy(c: Polygons, source: int, target: int, count: int) -> None:
    """Puts the first ``count`` vertices of one slot into another."""
    for i in range(count):
        for a in range(3):
            c.vertex[target, i, a] = c.vertex[source, i, a]
    c.size[target] = count


@kernel
def load(c: Polygons, slot: int, point: Floats, start: Ints, k: int) -> None:
    """Puts the polygon of portal k into a slot."""
    first = start[k]
    count = start[k + 1] - first
    for i in range(count):
        for a in range(3):
            c.vertex[slot, i, a] = point[first + i, a]
    c.size[slot] = count


@kernel
def separators_through(
    c: Polygons, normal: Floats, a: int, q: int, b: int, flip: bool, row: int, count: int
) -> int:
    """Appends to a row the planes that separate polygons ``a`` and ``b`` through the edges of a.

    Polygon a is the rest of directed portal q, which leads towards b. The plane through an edge
    turns about it: outward in a's plane + t · towards b. The least t that has all of b on the far
    side gives the tightest separator. It is accepted by measuring both polygons against it, so a
    badly conditioned edge can only cost tightness. With ``flip`` the kept side is a's (a is the
    nearer to the target), else b's. Returns the number of planes in the row.
    """
    polygon, plane, slack = c.vertex, c.plane, c.slack
    size_a, size_b = c.size[a], c.size[b]
    n0, n1, n2 = normal[q >> 1, 0], normal[q >> 1, 1], normal[q >> 1, 2]
    sign = 1.0 if q & 1 == 0 else -1.0
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
        if length <= SHORTEST_EDGE * slack:
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
        high, low = -np.inf, np.inf
        for k in range(size_a):
            high = max(high, m0 * polygon[a, k, 0] + m1 * polygon[a, k, 1] + m2 * polygon[a, k, 2])
        for k in range(size_b):
            low = min(low, m0 * polygon[b, k, 0] + m1 * polygon[b, k, 1] + m2 * polygon[b, k, 2])
        if high > low + slack:
            continue
        offset = -low
        if flip:
            m0, m1, m2, offset = -m0, -m1, -m2, high
        plane[row, count, 0] = m0
        plane[row, count, 1] = m1
        plane[row, count, 2] = m2
        plane[row, count, 3] = offset
        count += 1
    return count


@kernel
def separate(c: Polygons, normal: Floats, a: int, p: int, b: int, q: int, row: int) -> int:
    """Plane row ``row`` := all planes that separate a from b; kept is the side of b, and beyond.

    Polygon a is left of directed portal p, which leads towards b, and b of q, which leads towards
    a. Returns the number of planes.
    """
    count = separators_through(c, normal, a, p, b, False, row, 0)
    return separators_through(c, normal, b, q, a, True, row, count)


@kernel
def clip_all(c: Polygons, slot: int, row: int, count: int) -> int:
    """Clips a polygon by the planes of a row; the status of `clip`."""
    plane, status = c.plane, WHOLE
    for i in range(count):
        now = clip(
            c, slot, (plane[row, i, 0], plane[row, i, 1], plane[row, i, 2], plane[row, i, 3])
        )
        if now <= EMPTY:
            return now
        if now == CUT:
            status = CUT
    return status


@inlined_kernel
def reaches_beyond(g: PortalArrays, k: int, plane: Floats, row: int, count: int) -> int:
    """WHOLE if portal k reaches beyond every plane of a row, else EMPTY or NEAR_TIE."""
    point, slack = g.point, g.slack
    c0, c1, c2, radius = g.ball[k, 0], g.ball[k, 1], g.ball[k, 2], g.ball[k, 3]
    for i in range(count):
        n0, n1, n2 = plane[row, i, 0], plane[row, i, 1], plane[row, i, 2]
        d = n0 * c0 + n1 * c1 + n2 * c2 + plane[row, i, 3]
        if d > slack:
            continue
        if d + radius <= slack - NEAR * slack:
            return EMPTY
        high = -np.inf
        for j in range(g.start[k], g.start[k + 1]):
            d = n0 * point[j, 0] + n1 * point[j, 1] + n2 * point[j, 2] + plane[row, i, 3]
            high = max(high, d)
            if high > slack:
                break
        if high <= slack:
            return EMPTY if high <= slack - NEAR * slack else NEAR_TIE
    return WHOLE
