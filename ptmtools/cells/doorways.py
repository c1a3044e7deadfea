"""Slabs, and the rays that decide whether a slab closes an opening in a wall.

Rays across the slab meet a wall beside it and above it in both directions, as far apart as walls
are thick. In front of the slab, or behind it, are the reveals of the opening, below it is floor,
and both sides have standing room. A panel in a wall has no reveals, one between two pillars no wall
above, a cupboard door no wall beside it, a shutter no floor below, and a niche or a door on a wall
has no room behind its back.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, cross, normals, sum_by_group
from ptmtools.cells.planar import unite
from ptmtools.cells.search import ByHeight
from ptmtools.cells.structure import Structure, Surroundings

#: Range of widths of an opening, metres.
OPENING_WIDTH = (0.6, 2.4)
#: Rays look for the wall, or the frame, this far beside the leaf, metres.
_BESIDE = 0.05
#: How far the leaf may project from the wall, and the least depth of the reveals, metres.
_PROUD, _REVEAL = 0.03, 0.02
#: Largest gap to the jambs, the lintel and, on one side, the floor, metres: the other side may have
#: a step, or no ground.
_GAP = 0.05
#: Panels and handles project from a leaf by less than this, and both sides are free as far as this,
#: metres.
RELIEF, _FREE = 0.06, 0.5
#: Places along a side where rays begin, as shares of it, and the share of rays that must agree.
_SHARES, _AGREEING = np.array([0.2, 0.5, 0.8]), 2 / 3
#: A surface is square to a ray if the cosine between its normal and the ray is at least this.
_SQUARE = 0.9
_UP, _ASIDE = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
#: An upright slab leans by less than this (sine), and one that lies by less (cosine).
_LEANS = 0.02
#: Slabs whose axes across have a dot product of at least this are parallel.
_PARALLEL = 0.99
#: Slabs within this height, metres, are compared together.
_STOREY = 1.0
#: Points in each direction on a leaf.
_GRID = 3


@dataclass(frozen=True)
class Slabs:
    """k groups of triangles, each in a box along its own axes: across its flat sides, along, up."""

    axes: Floats  # (k, 3, 3) across, along, up
    low: Floats  # (k, 3) and
    high: Floats  # (k, 3) the box along the axes, metres
    corners: Floats  # (n, 3, 3) their triangles, metres
    group: Ints  # (n,) the group of each, ascending from 0

    @staticmethod
    def from_triangles(corners: Floats, group: Ints) -> Slabs:
        """Of (n, 3, 3) triangles in (n,) groups from 0, none empty."""
        order = np.argsort(group, kind="stable")
        corners, group = corners[order], group[order]
        normal = normals(corners)
        size = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
        parts = (normal[:, :, None] * normal[:, None, :] / size[:, None, None]).reshape(-1, 9)
        count = int(group.max(initial=-1)) + 1
        tensor = np.stack([sum_by_group(group, part, count) for part in parts.T], axis=1)
        across = np.linalg.eigh(tensor.reshape(-1, 3, 3))[1][:, :, 2]
        upright = np.abs(across[:, 1]) <= _LEANS
        across[upright, 1] = 0.0
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        # One sign of the eigenvector, whichever rounding gave.
        across *= np.where(across @ [0.6, 0.5, 0.62] < 0, -1.0, 1.0)[:, None]
        lies = np.abs(across[:, 1]) > 1 - _LEANS
        along = cross(np.where(lies[:, None], _ASIDE, _UP), across)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return Slabs._from_axes(
            np.stack([across, along, cross(across, along)], axis=1), corners, group
        )

    @staticmethod
    def _from_axes(axes: Floats, corners: Floats, group: Ints) -> Slabs:
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
        """(k,) which slabs are upright."""
        return np.asarray(self.axes[:, 0, 1] == 0)

    def only(self, which: Bools) -> Slabs:
        """The slabs ``which``, (k,)."""
        row = np.flatnonzero(which)
        place = np.cumsum(which) - 1
        kept = which[self.group]
        group = place[self.group[kept]]
        return Slabs(self.axes[row], self.low[row], self.high[row], self.corners[kept], group)

    def append(self, slabs: Slabs) -> Slabs:
        """These slabs, then the others."""
        return Slabs(
            np.concatenate([self.axes, slabs.axes]),
            np.concatenate([self.low, slabs.low]),
            np.concatenate([self.high, slabs.high]),
            np.concatenate([self.corners, slabs.corners]),
            np.concatenate([self.group, slabs.group + len(self)]),
        )

    def merge(self, whole: Ints) -> Slabs:
        """One for each of (k,) names, from 0, along the axes of the largest of its slabs."""
        size = self.size
        order = np.lexsort((np.arange(len(self)), -size[:, 1] * size[:, 2], whole))
        first = order[np.unique(whole[order], return_index=True)[1]]
        group = whole[self.group]
        row = np.argsort(group, kind="stable")
        return Slabs._from_axes(self.axes[first], self.corners[row], group[row])

    def find_near_pairs(self, gap: float) -> Ints:
        """(p, 2) pairs, each once, of parallel slabs whose world-aligned boxes in plan, and whose
        heights, are less than a gap apart."""
        if not len(self):
            return np.zeros((0, 2), dtype=np.int64)
        begin = np.searchsorted(self.group, np.arange(len(self)))
        low = np.minimum.reduceat(self.corners.min(axis=1), begin)
        high = np.maximum.reduceat(self.corners.max(axis=1), begin)
        plan = shapely.box(low[:, 0], low[:, 2], high[:, 0], high[:, 2])
        by_height, storey = ByHeight(low[:, 1], high[:, 1]), np.floor(low[:, 1] / _STOREY)
        pairs = []
        for name in np.unique(storey):
            on_storey = np.flatnonzero(storey == name)
            about = by_height.find_between(
                low[on_storey, 1].min() - gap, high[on_storey, 1].max() + gap
            )
            nearby = shapely.STRtree(plan[about])
            first, second = nearby.query(plan[on_storey], "dwithin", distance=gap)
            pairs.append(np.stack([on_storey[first], about[second]], axis=1))
        pair = np.concatenate(pairs)
        pair = np.unique(np.sort(pair[pair[:, 0] != pair[:, 1]], axis=1), axis=0)
        apart = np.maximum(low[pair[:, 0], 1], low[pair[:, 1], 1]) - np.minimum(
            high[pair[:, 0], 1], high[pair[:, 1], 1]
        )
        pair = pair[apart <= gap]
        across = self.axes[pair, 0]
        turn = np.abs(np.einsum("pk,pk->p", across[:, 0], across[:, 1]))
        return np.asarray(pair[turn >= _PARALLEL])

    def overlaps(self, first: Ints, second: Ints) -> Floats:
        """(p, 3) how far the boxes of parallel slabs overlap across, along and up, metres, both in
        the axes of the first; negative where they are apart."""
        bits = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
        ends = np.where(bits[None] == 1, self.high[second, None], self.low[second, None])
        world = np.einsum("pca,pak->pck", ends, self.axes[second])
        local = np.einsum("pck,pak->pca", world, self.axes[first])
        low = np.maximum(local.min(axis=1), self.low[first])
        result: Floats = np.minimum(local.max(axis=1), self.high[first]) - low
        return result

    def filled_share(self, grid: float) -> Floats:
        """(k,) the share of its rectangle, along and up, that each fills, united on a ``grid``."""
        flat = np.einsum("nck,nak->nca", self.corners, self.axes[self.group][:, 1:])
        begin = np.searchsorted(self.group, np.arange(len(self) + 1))
        united = [unite(flat[a:b], grid) for a, b in itertools.pairwise(begin)]
        area = self.size[:, 1] * self.size[:, 2]
        share = np.divide(shapely.area(united), area, out=np.zeros(len(self)), where=area > 0)
        return np.asarray(share)


def close_openings(slabs: Slabs, structure: Structure, wall_thickness: float) -> Bools:
    """(k,) which slabs, each a leaf or a pair of them, close an opening in a wall of at most this
    thickness, metres."""
    slack = structure.tolerance.plane
    wide = slabs.size[:, 1]
    fits = (wide >= OPENING_WIDTH[0] - slack) & (wide <= OPENING_WIDTH[1] + slack)
    result = np.zeros(len(slabs), dtype=bool)
    if fits.any():
        rays = _Rays(slabs.only(fits), structure.rays)
        result[fits] = _closes_by_rays(rays, wall_thickness)
    return result


def free_on_both_sides(slabs: Slabs, structure: Structure) -> Bools:
    """(k,) which slabs have room on both sides, unlike a door on a wall or open against it."""
    if not (len(slabs) and len(structure.corners)):
        return np.ones(len(slabs), dtype=bool)
    return _Rays(slabs, structure.rays).free()


def _closes_by_rays(rays: _Rays, wall_thickness: float) -> Bools:
    """(k,) which slabs have a wall beside and above them, the reveals of an opening on one side,
    a floor on one side and room on both."""
    # (k,) metres from the middle of each slab: to its faces, and, for each of the three sides in
    # `_SIDES`, ahead and back to the faces of the wall there.
    half = rays.size[:, 0] / 2
    walls = [_wall(rays, *side, half, wall_thickness) for side in _SIDES]
    result: Bools = np.all([np.isfinite(ahead) for ahead, _ in walls], axis=0)
    revealed, floors = np.zeros(len(result), dtype=bool), []
    for k, turn in ((0, 1.0), (1, -1.0)):  # ahead, and back
        # The reveals are looked for half way between the slab and the nearer face of the wall.
        depth = np.minimum(walls[0][k], walls[1][k]) - half
        depth = np.where(np.isfinite(depth), depth, 0.0)
        revealed |= (depth >= _REVEAL) & _has_reveals(rays, turn * (half + depth / 2))
        # The floor is measured just outside the wall, from a little above the foot of the slab.
        room = np.maximum(walls[0][k], walls[1][k])
        room = np.where(np.isfinite(room), room, 0.0) + 2 * _GAP
        below = rays.points_at(turn * room, _SHARES, np.zeros(3), above=2 * _GAP)
        floors.append(np.median(rays.meet(below, (0, 0, -1))[0], axis=1) - 2 * _GAP)
    result &= revealed & (np.minimum(*floors) <= _GAP) & rays.free()
    return result


def _wall(
    rays: _Rays, along: Floats, up: Floats, aside: float, above: float, half: Floats, limit: float
) -> tuple[Floats, Floats]:
    """(k,) and (k,): metres from the middle of the leaf ahead and back to the faces of the wall at
    one of its sides; infinite where there is no wall."""
    start = rays.points_at(np.zeros(len(half)), along, up, aside, above)
    (ahead, square), (behind, squared) = (rays.meet(start, (turn, 0, 0)) for turn in (1, -1))
    within = np.minimum(ahead, behind) >= half[:, None] - _PROUD
    wall = within & square & squared & (ahead + behind <= limit)
    stands = wall.mean(axis=1) >= _AGREEING
    first, second = (np.where(wall, distance, 0.0).max(axis=1) for distance in (ahead, behind))
    return np.where(stands, first, np.inf), np.where(stands, second, np.inf)


def _has_reveals(rays: _Rays, depth: Floats) -> Bools:
    """(k,) which leaves have the sides and the top of an opening in front of them, (k,) metres
    from the middle of each."""
    result = np.ones(len(depth), dtype=bool)
    middle = rays.points_at(depth, np.full(3, 0.5), _SHARES)
    for turn in (1, -1):
        distance, square = rays.meet(middle, (0, turn, 0))
        jamb = square & (np.abs(distance - rays.size[:, 1, None] / 2) <= _GAP)
        result &= jamb.mean(axis=1) >= _AGREEING
    top = rays.points_at(depth, _SHARES, np.ones(3), above=-2 * _GAP)
    distance, square = rays.meet(top, (0, 0, 1))
    result &= (square & (distance <= 3 * _GAP)).mean(axis=1) >= _AGREEING
    return result


#: Rays to the wall around a leaf: shares along and up, and metres beyond them.
_SIDES: tuple[tuple[Floats, Floats, float, float], ...] = (
    (np.zeros(3), _SHARES, -_BESIDE, 0.0),
    (np.ones(3), _SHARES, _BESIDE, 0.0),
    (_SHARES, np.ones(3), 0.0, _BESIDE),
)


#: Points all over a leaf: shares along and up.
_SHARES_ALL_OVER = np.repeat(_SHARES, 3), np.tile(_SHARES, 3)


class _Rays:
    """Rays from around slabs, in the axes of each."""

    def __init__(self, slabs: Slabs, around: Surroundings) -> None:
        self._slabs, self._around = slabs, around
        self.size = slabs.size

    def points_at(
        self, depth: Floats, along: Floats, up: Floats, aside: float = 0.0, above: float = 0.0
    ) -> Floats:
        """(k, p, 3) points (k,) metres across from the middle of each slab, at (p,) shares of its
        extents along and up, and metres beyond these."""
        low, size = self._slabs.low[:, None], self.size[:, None]
        across = low[..., 0] + size[..., 0] / 2 + depth[:, None] + 0 * along
        along = low[..., 1] + along * size[..., 1] + aside
        return np.stack([across, along, low[..., 2] + up * size[..., 2] + above], axis=2)

    def free(self) -> Bools:
        """(k,) which slabs have room in front of them and behind."""
        result = np.ones(len(self.size), dtype=bool)
        for turn in (1, -1):
            ahead = self.points_at(turn * (self.size[:, 0] / 2 + RELIEF), *_SHARES_ALL_OVER)
            result &= (self.meet(ahead, (turn, 0, 0))[0] >= _FREE).mean(axis=1) >= _AGREEING
        return result

    def meet(self, start: Floats, to: tuple[float, float, float]) -> tuple[Floats, Bools]:
        """(k, p) metres to the first surface that rays from (k, p, 3) points meet, and whether it
        is square to them."""
        axes = self._slabs.axes
        points = np.einsum("kpa,kac->kpc", start, axes)
        along = np.broadcast_to((np.array(to) @ axes)[:, None], points.shape)
        distance, facing = self._around.first(points.reshape(-1, 3), along.reshape(-1, 3))
        square = np.abs(np.einsum("pc,pc->p", facing, along.reshape(-1, 3))) >= _SQUARE
        return distance.reshape(start.shape[:2]), square.reshape(start.shape[:2])
