"""Compiled walk of straight lines through the portals (see `sight`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.compiled import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: A line is followed through so many leaves to either side of its portal.
LONGEST = 512


@kernel
def sight_lines(
    point: Floats,
    start: Ints,
    leaf: Ints,
    out_start: Ints,
    out: Ints,
    origin: Floats,
    along: Floats,
    portal: Ints,
    seen: NDArray[np.bool_],
) -> None:
    """Marks in ``seen`` (L, L) the leaves that lie on one straight line, for (n,) lines.

    Parameters
    ----------
    point, start: (Q, 3) convex polygons, counter-clockwise around their normals; (K + 1,) CSR over
        portals.
    leaf: (K, 2) the leaves behind and ahead of each portal.
    out_start, out: (L + 1,) CSR over leaves into the (2K,) portals of each leaf.
    origin, along, portal: (n, 3) a point in each line's portal, (n, 3) a direction from behind to
        ahead of it, and (n,) the portal.
    """
    path = np.empty(2 * LONGEST, np.int64)
    for i in range(len(portal)):
        k = portal[i]
        steps = 0
        for side in range(2):
            turn, here = 2.0 * side - 1.0, leaf[k, side]
            steps = _follow(
                point, start, leaf, out_start, out, origin[i], along[i], turn, here, path, steps
            )
        for a in range(steps):
            for b in range(a):
                seen[path[a], path[b]] = True
                seen[path[b], path[a]] = True


@kernel
def _follow(
    point: Floats,
    start: Ints,
    leaf: Ints,
    out_start: Ints,
    out: Ints,
    origin: Floats,
    along: Floats,
    turn: float,
    here: int,
    path: Ints,
    steps: int,
) -> int:
    """Follows the ray ``turn * along`` through the leaf ``here`` and onwards. Adds the leaves to
    ``path`` from ``steps`` on, and returns how many it then has."""
    end = steps + LONGEST
    while steps < end:
        path[steps] = here
        steps += 1
        following = -1
        for i in range(out_start[here], out_start[here + 1]):
            k = out[i]
            side = 0 if leaf[k, 0] == here else 1
            outwards = turn if side == 0 else -turn
            if _surround(point, start[k], start[k + 1], origin, along, outwards):
                following = leaf[k, 1 - side]
                break
        if following < 0:
            break
        here = following
    return steps


@kernel
def _surround(
    point: Floats, begin: int, end: int, origin: Floats, along: Floats, sense: float
) -> bool:
    """Whether a line passes through a convex polygon in the given sense: with its normal, 1, or
    against it, -1. All volumes that the line makes with the edges then have that sign.

    Of the faces of a convex leaf a line leaves through one, so a portal that is passed outwards is
    where the ray goes on, and how far away it is need not be asked."""
    dx, dy, dz = along[0], along[1], along[2]
    ax = point[end - 1, 0] - origin[0]
    ay = point[end - 1, 1] - origin[1]
    az = point[end - 1, 2] - origin[2]
    for i in range(begin, end):
        bx = point[i, 0] - origin[0]
        by = point[i, 1] - origin[1]
        bz = point[i, 2] - origin[2]
        volume = (ay * bz - az * by) * dx + (az * bx - ax * bz) * dy + (ax * by - ay * bx) * dz
        if volume * sense < 0:
            return False
        ax, ay, az = bx, by, bz
    return True
