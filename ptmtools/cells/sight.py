"""Which leaves surely see each other: an estimate of visibility from below, without the flow.

Straight lines through every portal, spread evenly over its area and over the directions, are
followed to both sides through all portals that they meet. Leaves on one line see each other. Unlike
a potentially visible set this leaves out what no line happened to find; it serves to weigh, never
to cull. Two thirds to nine tenths of what the portal flow finds are found in a second or two.

The lines are the same for every portal, in its own plane and from its own first edge, so they
depend neither on the order of the portals nor on where the building stands.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells

#: Lines over all portals, and the least and the most through one of them.
LINES = 2**19
LEAST_LINES, MOST_LINES = 64, 512
#: Fractional parts of 1/g, 1/g², 1/g³, 1/g⁴ in units of 2⁻⁶⁴, where g⁵ = g + 1 (Roberts'
#: sequence): the place in the portal, and the direction.
STEPS = np.array(
    [15802862336838869349, 13537915256980136287, 11597591980405560693, 9935365762805847689],
    dtype=np.uint64,
)


def sampled_sight(cells: Cells) -> NDArray[np.bool_]:
    """(L, L) symmetric: leaves that some straight line through portals joins. A leaf sees itself
    and those with which it shares a portal."""
    ends = cells.portal_leaf.reshape(-1, 2).astype(np.int64)
    seen = np.eye(cells.leaf_count, dtype=np.bool_)
    seen[ends, ends[:, ::-1]] = True
    if len(ends) == 0:
        return seen
    from ptmtools.cells.kernels import sight_lines

    count = min(max(LINES // len(ends), LEAST_LINES), MOST_LINES)
    share = _even(count)
    origin, along = np.empty((2, len(ends), count, 3))
    for k in range(len(ends)):
        origin[k], along[k] = _lines(cells.portal(k), cells.portal_plane[k, :3], share)
    order = np.argsort(ends.reshape(-1), kind="stable")
    sight_lines(
        np.ascontiguousarray(cells.portal_point, dtype=np.float64),
        cells.portal_start.astype(np.int64),
        ends,
        np.searchsorted(ends.reshape(-1)[order], np.arange(cells.leaf_count + 1)),
        order // 2,
        origin.reshape(-1, 3),
        along.reshape(-1, 3),
        np.repeat(np.arange(len(ends)), count),
        seen,
    )
    return seen


def _even(count: int) -> NDArray[np.float64]:
    """(count, 4) points of the unit cube, evenly spread; integer arithmetic, the same anywhere."""
    fixed = np.arange(1, count + 1, dtype=np.uint64)[:, None] * STEPS
    return np.asarray((fixed >> np.uint64(11)).astype(np.float64) * 2.0**-53)


def _lines(
    polygon: NDArray[np.float64], normal: NDArray[np.float64], share: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 3) points uniform in a convex polygon, and (n, 3) unit directions ahead of it with a
    density by the cosine, as light would pass."""
    u, v = polygon[1:-1] - polygon[0], polygon[2:] - polygon[0]
    area = np.linalg.norm(np.cross(u, v), axis=1)
    until = np.cumsum(area)
    left = share[:, 0] * until[-1]
    which = np.minimum(np.searchsorted(until, left, "right"), len(area) - 1)
    within = np.sqrt(np.clip((left - (until - area)[which]) / area[which], 0.0, 1.0))
    across = (within * share[:, 1])[:, None]
    origin = polygon[0] + (within[:, None] - across) * u[which] + across * v[which]
    right = u[0] / np.linalg.norm(u[0])
    radius, turn = np.sqrt(share[:, 2]), 2 * np.pi * share[:, 3]
    frame = np.stack([right, np.cross(normal, right), normal])
    aside = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - share[:, 2])])
    return origin, aside.T @ frame
