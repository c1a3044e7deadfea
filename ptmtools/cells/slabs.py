"""Triangles in groups, each in a box along its own axes: across what is flat in it, along, up."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.by_height import ByHeight
from ptmtools.cells.vectors import cross, normals, summed

_UP = np.array([0.0, 1.0, 0.0])
_ASIDE = np.array([1.0, 0.0, 0.0])
#: An upright slab leans by less than this (sine), and one that lies by less (cosine).
_LEANS = 0.02
#: Slabs whose axes across have a dot product of at least this are parallel.
_PARALLEL = 0.99
#: Slabs so near to each other in height, metres, are looked at together.
_STOREY = 1.0


@dataclass(frozen=True)
class Slabs:
    """k groups of triangles. Axes are unit vectors."""

    axes: Floats  # (k, 3, 3) across, along, up
    low: Floats  # (k, 3) and
    high: Floats  # (k, 3) the box along the axes, metres
    corners: Floats  # (n, 3, 3) their triangles, metres
    group: Ints  # (n,) whose they are, ascending from 0

    @staticmethod
    def of(corners: Floats, group: Ints) -> Slabs:
        """Of (n, 3, 3) triangles in (n,) groups from 0, none empty."""
        order = np.argsort(group, kind="stable")
        corners, group = corners[order], group[order]
        normal = normals(corners)
        size = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
        parts = (normal[:, :, None] * normal[:, None, :] / size[:, None, None]).reshape(-1, 9)
        count = int(group.max(initial=-1)) + 1
        tensor = np.stack([summed(group, part, count) for part in parts.T], axis=1)
        across = np.linalg.eigh(tensor.reshape(-1, 3, 3))[1][:, :, 2]
        upright = np.abs(across[:, 1]) <= _LEANS
        across[upright, 1] = 0.0
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        # One of the two directions, whichever rounding gave.
        across *= np.where(across @ [0.6, 0.5, 0.62] < 0, -1.0, 1.0)[:, None]
        lies = np.abs(across[:, 1]) > 1 - _LEANS
        along = cross(np.where(lies[:, None], _ASIDE, _UP), across)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return Slabs._along(np.stack([across, along, cross(across, along)], axis=1), corners, group)

    @staticmethod
    def _along(axes: Floats, corners: Floats, group: Ints) -> Slabs:
        local = np.einsum("nck,nak->nca", corners, axes[group])
        begin = np.searchsorted(group, np.arange(len(axes)))
        if not len(begin):
            return Slabs(axes, np.zeros((0, 3)), np.zeros((0, 3)), corners, group)
        low = np.minimum.reduceat(local.min(axis=1), begin)
        high = np.maximum.reduceat(local.max(axis=1), begin)
        return Slabs(axes, low, high, corners, group)

    def __len__(self) -> int:
        return len(self.axes)

    @property
    def size(self) -> Floats:
        """(k, 3) metres across, along and up."""
        return self.high - self.low

    @property
    def upright(self) -> Bools:
        """(k,) which of them stand."""
        return np.asarray(self.axes[:, 0, 1] == 0)

    def only(self, which: Bools) -> Slabs:
        """Those of (k,)."""
        row = np.flatnonzero(which)
        place = np.cumsum(which) - 1
        kept = which[self.group]
        group = place[self.group[kept]]
        return Slabs(self.axes[row], self.low[row], self.high[row], self.corners[kept], group)

    def joined(self, other: Slabs) -> Slabs:
        """These, then those."""
        return Slabs(
            np.concatenate([self.axes, other.axes]),
            np.concatenate([self.low, other.low]),
            np.concatenate([self.high, other.high]),
            np.concatenate([self.corners, other.corners]),
            np.concatenate([self.group, other.group + len(self)]),
        )

    def merged(self, whole: Ints) -> Slabs:
        """One for each of (k,) names, from 0, along the axes of the largest of its slabs."""
        size = self.size
        order = np.lexsort((np.arange(len(self)), -size[:, 1] * size[:, 2], whole))
        first = order[np.unique(whole[order], return_index=True)[1]]
        group = whole[self.group]
        row = np.argsort(group, kind="stable")
        return Slabs._along(self.axes[first], self.corners[row], group[row])

    def near(self, gap: float) -> Ints:
        """(p, 2) pairs, each once, of parallel slabs whose boxes in plan, which stand along the
        axes of the world, and whose heights, are less than a gap apart."""
        if not len(self):
            return np.zeros((0, 2), dtype=np.int64)
        begin = np.searchsorted(self.group, np.arange(len(self)))
        low = np.minimum.reduceat(self.corners.min(axis=1), begin)
        high = np.maximum.reduceat(self.corners.max(axis=1), begin)
        plan = shapely.box(low[:, 0], low[:, 2], high[:, 0], high[:, 2])
        by_height, storey = ByHeight(low[:, 1], high[:, 1]), np.floor(low[:, 1] / _STOREY)
        pairs = []
        for name in np.unique(storey):
            here = np.flatnonzero(storey == name)
            about = by_height.between(low[here, 1].min() - gap, high[here, 1].max() + gap)
            one, other = shapely.STRtree(plan[about]).query(plan[here], "dwithin", distance=gap)
            pairs.append(np.stack([here[one], about[other]], axis=1))
        pair = np.concatenate(pairs)
        pair = np.unique(np.sort(pair[pair[:, 0] != pair[:, 1]], axis=1), axis=0)
        apart = np.maximum(low[pair[:, 0], 1], low[pair[:, 1], 1]) - np.minimum(
            high[pair[:, 0], 1], high[pair[:, 1], 1]
        )
        pair = pair[apart <= gap]
        across = self.axes[pair, 0]
        turn = np.abs(np.einsum("pk,pk->p", across[:, 0], across[:, 1]))
        return np.asarray(pair[turn >= _PARALLEL])

    def overlaps(self, one: Ints, other: Ints) -> Floats:
        """(p, 3) how far the boxes of parallel slabs overlap across, along and up, metres, both in
        the axes of the first; negative where they are apart."""
        bits = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
        ends = np.where(bits[None] == 1, self.high[other, None], self.low[other, None])
        world = np.einsum("pca,pak->pck", ends, self.axes[other])
        local = np.einsum("pck,pak->pca", world, self.axes[one])
        low = np.maximum(local.min(axis=1), self.low[one])
        found: Floats = np.minimum(local.max(axis=1), self.high[one]) - low
        return found

    def filled(self) -> Floats:
        """(k,) the share of its rectangle, along and up, that each fills."""
        flat = np.einsum("nck,nak->nca", self.corners, self.axes[self.group][:, 1:])
        shapes = shapely.polygons(flat)
        solid = shapely.area(shapes) > 0
        shapes, group = shapes[solid], self.group[solid]
        begin = np.searchsorted(group, np.arange(len(self) + 1))
        united = [shapely.union_all(shapes[a:b]) for a, b in itertools.pairwise(begin)]
        area = self.size[:, 1] * self.size[:, 2]
        share = np.divide(shapely.area(united), area, out=np.zeros(len(self)), where=area > 0)
        return np.asarray(share)
