"""Where an eye can be on a walk, as a graph: places, and steps between them.

A step costs metres, and more of them where it is narrow or steep, or leads over furniture, so that
the cheapest way is the one that somebody would take.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints


@dataclass(frozen=True)
class Ground:
    """The places of an eye, and the steps between them.

    Attributes
    ----------
    eye: (n, 3) metres.
    cell: (n,) the cell that each is in, or -1.
    space: (n,) metres to what stands about, at most `footing.ABOUT`; 0 where the foot is
        on nothing.
    start, target, cost: steps as CSR over places: (n + 1,), (m,) where each leads to, and (m,)
        what it costs.
    """

    eye: Floats
    cell: Ints
    space: Floats
    start: Ints
    target: Ints
    cost: Floats

    @staticmethod
    def of(eye: Floats, cell: Ints, space: Floats, steps: Ints, cost: Floats) -> Ground:
        """From (k, 2) steps, each of which can be taken both ways, at (k,) costs."""
        both = np.concatenate([steps, steps[:, ::-1]])
        order = np.lexsort((both[:, 1], both[:, 0]))
        start = np.searchsorted(both[order, 0], np.arange(len(eye) + 1))
        return Ground(eye, cell, space, start, both[order, 1], np.tile(cost, 2)[order])

    def main_part(self, standing: Bools) -> Ground:
        """What hangs together and reaches most of the (C,) cells that ``standing`` marks; of parts
        that reach as many, the one with most places."""
        from ptmtools.walkthrough.path.ground_kernels import spread_parts

        if not len(self.eye):
            return self
        part = np.full(len(self.eye), -1, dtype=np.int64)
        parts = spread_parts(self.start, self.target, part)
        known = self.cell >= 0
        known[known] = standing[self.cell[known]]
        reached = np.unique(np.column_stack([part[known], self.cell[known]]), axis=0)[:, 0]
        cells, places = np.bincount(reached, minlength=parts), np.bincount(part)
        return self._kept(part == np.lexsort((-places, -cells))[0])

    def _kept(self, kept: Bools) -> Ground:
        name = np.cumsum(kept) - 1
        source = np.repeat(np.arange(len(self.eye)), np.diff(self.start))
        held = kept[source] & kept[self.target]
        start = np.searchsorted(name[source[held]], np.arange(int(kept.sum()) + 1))
        target, cost = name[self.target[held]], self.cost[held]
        return Ground(self.eye[kept], self.cell[kept], self.space[kept], start, target, cost)

    def way_to_nearest(self, source: int, goal: Bools) -> Ints:
        """The places on the cheapest way from one to the nearest of those that (n,) ``goal`` marks,
        both ends included; none if no way leads to one."""
        from ptmtools.walkthrough.path.ground_kernels import nearest_goal

        return np.asarray(nearest_goal(self.start, self.target, self.cost, source, goal))
