"""Compiled walk of straight lines from leaf to leaf through the portals (see `sight`).

Rounding can make a line that runs along an edge miss both portals beside it; it then ends there,
which only shortens it.
"""

from __future__ import annotations

from typing import NamedTuple

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.compiled import plain_kernel as kernel


class Openings(NamedTuple):
    """Portals as lines meet them; directed portal 2k crosses portal k along its normal, 2k + 1
    against it."""

    point: Floats  # (Q, 3) convex polygons, counter-clockwise around their normals
    start: Ints  # (K + 1,) CSR over portals
    leaf: Ints  # (2K,) the leaf that a directed portal leads into
    out_start: Ints  # (L + 1,) CSR over leaves:
    out: Ints  # (2K,) the directed portals that lead out of a leaf


@kernel
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


@kernel
def follow(
    openings: Openings, q: int, origin: Floats, along: Floats, turn: float, path: Ints, steps: int
) -> int:
    """Follows the ray ``turn * along`` on through directed portal q. Adds the leaves to ``path``
    from ``steps`` on, at most half of its length, and returns how many it then has."""
    end = steps + len(path) // 2
    while steps < end:
        here = openings.leaf[q]
        path[steps] = here
        steps += 1
        q = -1
        for i in range(openings.out_start[here], openings.out_start[here + 1]):
            if passes(openings.point, openings.start, openings.out[i], origin, along, turn):
                q = openings.out[i]
                break
        if q < 0:
            break
    return steps


@kernel
def passes(point: Floats, start: Ints, q: int, origin: Floats, along: Floats, turn: float) -> bool:
    """Whether the line through ``origin`` along ``turn * along`` passes directed portal q: all
    volumes that it makes with the edges then have one sign.

    Of the faces of a convex leaf a line leaves through one, so a portal that is passed outwards is
    where the ray goes on, and how far away it is need not be asked."""
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
