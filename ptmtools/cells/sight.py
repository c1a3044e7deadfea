"""Visibility between leaves before the portal flow: a lower estimate by lines, an upper bound.

From below, straight lines through every portal, spread evenly over its area and over the directions
by the cosine, are followed to both sides through all portals that they meet; leaves on one line see
each other. The lines are the same for every portal in its own frame, from either side and after
quarter turns of the frame, so they depend neither on the order of portals and corners nor on the
position and rotation of the building. The estimate serves to weigh, never to cull.

From above, the first bound of the portal flow decides which leaves no standing viewer can see.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, cross
from ptmtools.cells.model import Cells
from ptmtools.executor import Executor
from ptmtools.portal_flow.flow import Portals, leaf_matrix, upper_bound

#: Lines over all portals, and the least and the most through one of them.
LINES = 2**20
LEAST_LINES, MOST_LINES = 64, 8192
#: Number of leaves through which a line is followed to either side of its portal.
LONGEST = 512
#: A portal whose normal has a level part smaller than this is a hatch.
LEVEL = 1e-3
#: Fractional parts of 1/g, 1/g², 1/g³, 1/g⁴ in units of 2⁻⁶⁴, where g⁵ = g + 1 (Roberts'
#: sequence): the place in the portal, and the direction.
STEPS = np.array(
    [15802862336838869349, 13537915256980136287, 11597591980405560693, 9935365762805847689],
    dtype=np.uint64,
)


def sampled_sight(portals: Portals) -> Bools:
    """(L, L) symmetric: leaves that some straight line through portals joins. A leaf sees itself
    and those with which it shares a portal."""
    ends = portals.leaf.astype(np.int64)
    seen = np.eye(portals.leaf_count, dtype=np.bool_)
    seen[ends, ends[:, ::-1]] = True
    if len(ends) == 0:
        return seen
    from ptmtools.portal_flow.line_kernels import Openings, sight_lines

    count = min(max(LINES // len(ends), LEAST_LINES), MOST_LINES) // 8 * 8
    share = _even(count)
    origin, along = np.empty((2, len(ends), count, 3))
    for k, normal in enumerate(portals.normal):
        polygon = portals.point[portals.start[k] : portals.start[k + 1]]
        origin[k], along[k] = _lines(polygon, normal, share)
    leaves = ends.reshape(-1)
    order = np.argsort(leaves, kind="stable")
    openings = Openings(
        np.ascontiguousarray(portals.point, dtype=np.float64),
        portals.start.astype(np.int64),
        ends[:, ::-1].reshape(-1),
        np.searchsorted(leaves[order], np.arange(portals.leaf_count + 1)),
        order,
    )
    path = np.empty(2 * LONGEST, np.int64)
    portal = np.repeat(np.arange(len(ends)), count)
    sight_lines(openings, origin.reshape(-1, 3), along.reshape(-1, 3), portal, path, seen)
    return seen


def _even(count: int) -> Floats:
    """(count, 4) points of the unit cube, evenly spread; integer arithmetic, the same on every
    machine. They come in eights: quarter turns of the frame, and those from behind (`_lines`)."""
    fixed = np.arange(1, count // 8 + 1, dtype=np.uint64)[:, None] * STEPS
    turned = [(fixed >> np.uint64(11)).astype(np.float64) * 2.0**-53]
    for _ in range(3):
        up, along, radius, turn = turned[-1].T
        turned.append(np.stack([along, 1 - up, radius, (turn + 0.25) % 1], axis=1))
    front = np.concatenate(turned)
    return np.concatenate([front, [0, 1, 0, 1] + front * [1, -1, 1, -1]])


def _lines(polygon: Floats, normal: Floats, share: Floats) -> tuple[Floats, Floats]:
    """(n, 3) points uniform in a convex polygon, and (n, 3) unit directions ahead of it with a
    density by the cosine, like light.

    ``share`` (n, 4) chooses the height in the polygon, the place at that height, and the direction
    by its angle from the normal and around it. The frame has the polygon's level direction to the
    right, that of a hatch its longest edge; reversing the normal mirrors it, and laying a building
    on its side turns it, so `_even` contains the images of each line.
    """
    right = np.array([normal[2], 0.0, -normal[0]])
    if np.linalg.norm(right) < LEVEL:  # a hatch: no direction is level more than others
        edge = np.roll(polygon, -1, axis=0) - polygon
        right = edge[np.argmax(np.linalg.norm(edge, axis=1))]
    right = right / np.linalg.norm(right)
    upward = cross(normal, right)
    frame = np.stack([right, upward, normal])
    flat = (polygon - polygon[0]) @ frame[:2].T
    height = np.unique(flat[:, 1])
    begins, end = _chords(flat, height)
    width, rise = end - begins, np.diff(height)
    until = np.cumsum((width[:-1] + width[1:]) * rise / 2)
    at = share[:, 0] * until[-1]
    k = np.minimum(np.searchsorted(until, at, "right"), len(rise) - 1)
    # How far up slice k: the root of a quadratic, in the form that cancels nothing.
    part = (at - np.append(0, until)[k]) / rise[k]
    slope = width[k + 1] - width[k]
    root = np.sqrt(np.maximum(width[k] ** 2 + 2 * slope * part, 0.0))
    up = np.clip(2 * part / np.maximum(width[k] + root, np.finfo(np.float64).tiny), 0.0, 1.0)
    begin = begins[k] + up * (begins[k + 1] - begins[k])
    x = begin + share[:, 1] * (width[k] + up * slope)
    origin = polygon[0] + np.stack([x, height[k] + up * rise[k]], axis=1) @ frame[:2]
    radius, turn = np.sqrt(share[:, 2]), 2 * np.pi * share[:, 3]
    along = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - share[:, 2])])
    return origin, along.T @ frame


def _chords(flat: Floats, height: Floats) -> tuple[Floats, Floats]:
    """(n,) least and greatest x of a convex (m, 2) polygon at each height y."""
    a, b = flat, np.roll(flat, -1, axis=0)
    low, high = np.minimum(a[:, 1], b[:, 1]), np.maximum(a[:, 1], b[:, 1])
    meets = (low <= height[:, None]) & (height[:, None] <= high)
    rise = b[:, 1] - a[:, 1]
    share = np.divide(
        height[:, None] - a[:, 1], rise, out=np.zeros(meets.shape), where=rise[None] != 0
    )
    x = a[:, 0] + np.clip(share, 0.0, 1.0) * (b[:, 0] - a[:, 0])
    return (
        np.where(meets, x, np.inf).min(axis=1),
        np.where(meets, x, -np.inf).max(axis=1),
    )


def portals_of(cells: Cells) -> Portals:
    """The portals between the leaves of a subdivision that sight passes."""
    count = cells.sight_count
    start = cells.portal_start[: count + 1]
    return Portals(
        leaf_count=cells.leaf_count,
        leaf=cells.portal_leaf[:count].reshape(-1, 2),
        normal=cells.portal_plane[:count].reshape(-1, 4)[:, :3],
        point=cells.portal_point[: start[-1]].reshape(-1, 3),
        start=start,
        tolerance=cells.tolerance,
    )


def seen_from_places(cells: Cells, executor: Executor) -> Bools:
    """(L,) which leaves may be seen from a standing leaf, themselves included, or have passages.

    The first bound of the flow decides, without its search: of the leaves of five real models the
    search would have dropped two more.
    """
    standing = cells.leaf_standing
    if standing.all():
        return standing.copy()
    portals = portals_of(cells)
    bound = upper_bound(portals, executor)
    seen = np.asarray(leaf_matrix(portals, bound)[standing].any(axis=0))
    seen[cells.portal_leaf[cells.portal_passage]] = True
    return seen


def from_places(sees: Bools, standing: Bools) -> Bools:
    """(L, L) the pairs of (L, L) symmetric sight with a ``standing``, (L,), leaf at one end."""
    return sees & (standing[:, None] | standing)
