"""Visibility between leaves before the portal flow: a lower estimate by lines, an upper bound; and
groups of leaves that grow along portals, by what dividing a room into cells saves.

From below, straight lines through every portal, spread evenly over its area and over the directions
by the cosine, are followed to both sides through all portals that they meet; leaves on one line see
each other. The lines are the same for every portal in its own frame, from either side and after
quarter turns of the frame, so they depend neither on the order of portals and corners nor on the
position and rotation of the building. The estimate serves to weigh, never to cull.

From above, the first bound of the portal flow decides which leaves no standing viewer can see.

A room is one cell, unless dividing it saves its viewers more than `SubdivideOptions.gain` of their
download. With v the volume of a leaf (the frequency of viewers in it), w the area of the surfaces
in it (their cost) and S the leaves that it sees, a group G of leaves costs

    apart     Σ v·w(S) + w·v(S)  over the leaves of G
    together  v(G)·w(∪S) + w(G)·v(∪S)

and the **gain** of dividing it is 1 - apart / together. Groups are joined in the order of the gain
of dividing the two, as long as it is less than the threshold. Leaves without standing room come
last: the pair that adds least to the cost of all groups is joined first, until half of the
threshold has been added.
"""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, cross
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


#: Shares, and gains, are compared in this many significant digits: symmetrical buildings have many
#: equal ones, which rounding must not order, not even that of a sliver far from the origin.
DIGITS = 4


class Groups(ABC):
    """Groups of leaves, each named by one of its leaves, initially of one leaf each.

    Attributes
    ----------
    near: for each group its neighbours, each with the portals between the two.
    """

    def __init__(self, count: int, pairs: NDArray[np.integer]) -> None:
        """``pairs``: (K, 2) the leaves on both sides of each portal."""
        self.near: list[dict[int, list[int]]] = [{} for _ in range(count)]
        self._parent = np.arange(count)
        for k, (a, b) in enumerate(pairs.tolist()):
            if a != b:
                self.near[a].setdefault(b, []).append(k)
                self.near[b][a] = self.near[a][b]

    @abstractmethod
    def cost(self, a: int, b: int) -> float:
        """The cost of joining two adjacent groups, the lower one first; rounded, so that last
        digits do not decide the order."""

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        """Adds b to a; returns the pairs that are new or may cost less than before."""
        self._parent[b] = a
        changed, self.near[b] = self.near[b], {}
        del changed[a], self.near[a][b]
        for c, portals in changed.items():
            del self.near[c][b]
            both = [*self.near[a].get(c, ()), *portals]
            self.near[a][c] = self.near[c][a] = both
        return [(a, c) for c in changed]

    def grow(self, joins: Callable[[float], bool]) -> Ints:
        """(L,) the group of each leaf, once all pairs are joined whose cost ``joins``; equally
        cheap ones in the order of their names."""
        waiting: list[tuple[float, int, int]] = []
        latest: dict[tuple[int, int], float] = {}

        def put(a: int, b: int) -> None:
            pair = (min(a, b), max(a, b))
            latest[pair] = self.cost(*pair)
            heapq.heappush(waiting, (latest[pair], *pair))

        for a, near in enumerate(self.near):
            for b in near:
                if a < b:
                    put(a, b)
        while waiting and joins(waiting[0][0]):
            cost, a, b = heapq.heappop(waiting)
            if b not in self.near[a] or cost != latest[a, b]:
                continue
            if cost != self.cost(a, b):  # one of them has grown meanwhile
                put(a, b)
                continue
            for pair in self.join(a, b):
                put(*pair)
        result = self._parent
        while not np.array_equal(result, result[result]):
            result = result[result]
        return result


#: Joining leaves without viewers may add this share of the threshold to the whole download.
ATTACHED = 0.5


def join_by_gain(
    sees: Bools,
    volume: Floats,
    area: Floats,
    pairs: NDArray[np.integer],
    gain: float,
    above: NDArray[np.integer] | None = None,
) -> Ints:
    """(L,) for each leaf the leaf that stands for its group.

    Parameters
    ----------
    sees: (L, L) symmetric, visibility between leaves.
    volume, area: (L,) of a leaf, m³ in which viewers are, and of the surfaces in it, m².
    pairs: (n, 2) leaves through whose portals groups may grow.
    gain: threshold, 0 to 1, of the gain of dividing a group.
    above: (m, 2) leaves through whose portals only groups with viewers may grow.
    """
    every = np.stack([volume, area], axis=1)
    more = pairs if above is None else np.concatenate([pairs, above])
    parted = _Parted(sees.copy(), every.copy(), every, more)
    group = parted.grow(lambda gained: gained < gain)
    attached = _Attached(parted.sees, parted.own, every, group[pairs])
    return attached.grow_by(ATTACHED * gain)[group]


class _Costs(Groups):
    """Groups and their costs."""

    def __init__(
        self, sees: Bools, sums: Floats, every: Floats, pairs: NDArray[np.integer]
    ) -> None:
        """``sees``: (L, L) which leaves a group sees; ``sums``: (L, 2) its volume and area,
        ``every``: those of the leaves. The first two change as groups grow, and a group that
        has joined another has nothing."""
        super().__init__(len(sees), pairs)
        self.sees, self.own, self.every = sees, sums, every
        self.before = [
            cost(row, sum_of_group, every) for row, sum_of_group in zip(sees, sums, strict=True)
        ]

    def joint_cost(self, a: int, b: int) -> float:
        """The cost of two groups joined."""
        return cost(self.sees[a] | self.sees[b], self.own[a] + self.own[b], self.every)

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self.sees[a] |= self.sees[b]
        self.own[a] += self.own[b]
        self.own[b] = 0.0
        super().join(a, b)
        return [(a, c) for c in self.near[a]]


class _Parted(_Costs):
    """Groups with viewers; the cost of a pair is the gain of dividing it."""

    def cost(self, a: int, b: int) -> float:
        if not (self.own[a][0] and self.own[b][0]):
            return np.inf
        together = self.joint_cost(a, b)
        gain = 1 - (self.before[a] + self.before[b]) / together if together > 0 else 0.0
        return round(gain, DIGITS)

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self.before[a] += self.before[b]  # of all its leaves apart
        return super().join(a, b)


class _Attached(_Costs):
    """Pairs of groups, one without viewers; the cost is the share that joining adds to all
    costs."""

    def __init__(
        self, sees: Bools, sums: Floats, every: Floats, pairs: NDArray[np.integer]
    ) -> None:
        super().__init__(sees, sums, every, pairs)
        self._all = sum(self.before)
        self._added = 0.0

    def grow_by(self, share: float) -> Ints:
        """(L,) the groups, before joining has added ``share``; none is joined for 0."""
        return self.grow(lambda added: self._added + added < share)

    def cost(self, a: int, b: int) -> float:
        if self.own[a][0] and self.own[b][0]:
            return np.inf
        added = self.joint_cost(a, b) - self.before[a] - self.before[b]
        return round(added / self._all, 2 * DIGITS) if self._all else 0.0

    def join(self, a: int, b: int) -> list[tuple[int, int]]:
        self._added += self.cost(a, b)
        self.before[a] = self.joint_cost(a, b)
        return super().join(a, b)


def cost(seen: Bools, sums: Floats, every: Floats) -> float:
    """The cost of a group that sees leaves, (L,), and has a volume and an area, (2,); ``every``:
    (L, 2) those of the leaves."""
    volume, area = every[seen].sum(axis=0)
    return float(sums[0] * area + sums[1] * volume)


def gain_of(sees: Bools, every: Floats, group: Ints) -> float:
    """The gain of dividing everything into groups, (L,), of leaves that see, (L, L), one another;
    ``every``: (L, 2) their volumes and areas."""

    def cost_of(members: Bools) -> float:
        seen = np.asarray(sees[members].any(axis=0))
        return cost(seen, every[members].sum(axis=0), every)

    together = cost_of(np.ones(len(group), dtype=np.bool_))
    apart = sum(cost_of(group == name) for name in np.unique(group))
    return 1 - apart / together if together > 0 else 0.0
