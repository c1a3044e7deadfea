"""The pre-pass of the portal flow: planes and floods (see `flow`)."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bits, Floats
from ptmtools.compiled import kernel, plain_kernel
from ptmtools.portal_flow.bit_kernels import ONE, ZERO, has
from ptmtools.portal_flow.clipping_kernels import EMPTY, beyond, load, separate
from ptmtools.portal_flow.storage import Geometry, Scratch


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
    """``rows`` (last - first, W), zeroed, become what floods from first … last - 1 reach.

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
            rows[p - first, r >> 6] |= ONE << np.uint64(r & 63)
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
                        rows[p - first, q >> 6] |= ONE << np.uint64(q & 63)
                        stack[top] = q
                        top += 1


@kernel
def tighten(g: Geometry, first: int, last: int, known: Bits, tighter: Bits) -> None:
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
