"""Recognition of door leaves, which fill doorways and are no walls.

A leaf is an upright slab of the size of a door. Its name identifies it, if the size fits; so does
its place, if it closes an opening in a wall; and so does the user or its class, whatever its shape.
Candidates are connected pieces of objects with a door's name, and flat rectangles: the rectangles
identify a leaf in one piece with its frame or its handle, the piece one made of planks. Pieces and
rectangles that are the two faces, the edge or the panels of one slab are one leaf, with all
triangles within it.

A name alone is not enough: a wall of 6 m called `wall_with_door`, a frame, a mat and a hatch in the
floor are no slabs of that size, and a panel on a wall or a door open against it separates nothing.

Rays from around a slab decide whether it closes an opening. Rays across the leaf meet a wall beside
it and above it in both directions, as far apart as walls are thick. In front of the leaf, or behind
it, are the reveals of the opening, below it is floor, and both sides have standing room. A panel in
a wall has no reveals, one between two pillars no wall above, a cupboard door no wall beside it, a
shutter no floor below, and a niche or a door on a wall has no room behind its back.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas, cross, normals, summed
from ptmtools.cells.facets import Facets, Welded
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import unite
from ptmtools.cells.roles import Designated, connected_pieces, is_door_name, triangles_named
from ptmtools.cells.search import ByHeight, Nearby, connected, distinct
from ptmtools.cells.structure import Opaque, Structure, Surroundings
from ptmtools.scene.model import Scene

#: A leaf is thinner than this, metres,
THICK = 0.12
#: its width, down to one of a narrow pair, and its height are in these ranges.
WIDE, HIGH = (0.3, 2.4), (1.8, 3.0)
#: It fills this share of its rectangle: a frame fills a fifth, a leaf with a window more.
FILLED = 0.5
#: Leaves of a pair are nearer to one another than this, metres.
PAIR = 0.03
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
class DoorLeaf:
    """One leaf of a door."""

    name: str
    axes: Floats  # (3, 3) unit vectors: across, along, and up
    low: Floats  # (3,) and
    high: Floats  # (3,) its box along these axes, metres
    triangles: Ints  # of the scene, ascending

    @property
    def middle(self) -> Floats:
        """(3,) metres."""
        return np.asarray((self.low + self.high) / 2 @ self.axes)

    def grid(self, beyond: float) -> tuple[Floats, Floats]:
        """(n, 3) points spread over the leaf, ``beyond`` metres in front of it, and as many
        behind."""
        share = (np.arange(_GRID) + 0.5) / _GRID
        along, up = (a.ravel() for a in np.meshgrid(share, share, indexing="ij"))
        size = self.high - self.low
        rest = np.stack([self.low[1] + along * size[1], self.low[2] + up * size[2]], axis=1)
        front, back = (
            np.column_stack([np.full(len(rest), depth), rest]) @ self.axes
            for depth in (self.high[0] + beyond, self.low[0] - beyond)
        )
        return front, back


@dataclass(frozen=True)
class Slabs:
    """k groups of triangles, each in a box along its own axes: across its flat sides, along, up."""

    axes: Floats  # (k, 3, 3) across, along, up
    low: Floats  # (k, 3) and
    high: Floats  # (k, 3) the box along the axes, metres
    corners: Floats  # (n, 3, 3) their triangles, metres
    group: Ints  # (n,) the group of each, ascending from 0

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
        # One sign of the eigenvector, whichever rounding gave.
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
        """(k,) which slabs are upright."""
        return np.asarray(self.axes[:, 0, 1] == 0)

    def only(self, which: Bools) -> Slabs:
        """The slabs ``which``, (k,)."""
        row = np.flatnonzero(which)
        place = np.cumsum(which) - 1
        kept = which[self.group]
        group = place[self.group[kept]]
        return Slabs(self.axes[row], self.low[row], self.high[row], self.corners[kept], group)

    def joined(self, other: Slabs) -> Slabs:
        """These slabs, then the others."""
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
        result: Floats = np.minimum(local.max(axis=1), self.high[one]) - low
        return result

    def filled(self, grid: float) -> Floats:
        """(k,) the share of its rectangle, along and up, that each fills, united on a ``grid``."""
        flat = np.einsum("nck,nak->nca", self.corners, self.axes[self.group][:, 1:])
        begin = np.searchsorted(self.group, np.arange(len(self) + 1))
        united = [unite(flat[a:b], grid) for a, b in itertools.pairwise(begin)]
        area = self.size[:, 1] * self.size[:, 2]
        share = np.divide(shapely.area(united), area, out=np.zeros(len(self)), where=area > 0)
        return np.asarray(share)


def find_doors(
    scene: Scene, opaque: Opaque, structure: Structure, options: SubdivideOptions
) -> list[DoorLeaf]:
    """The door leaves of a scene, in the order of their first triangles in the file."""
    roles = Designated.of(scene, options)
    is_door = roles.door
    free = is_door | ~(roles.structural | roles.detail)
    named = triangles_named(scene, is_door_name) & free
    slack = structure.tolerance.plane
    designated = _pieces(scene, np.flatnonzero(is_door))
    by_name = _named_slabs(scene, np.flatnonzero(named), slack)
    leaf = _leaf_of_slab(by_name, slack)
    by_name = by_name.only(free_on_both_sides(by_name.merged(leaf), structure)[leaf])
    flat = _flat(scene, structure, np.flatnonzero((free & ~is_door)[structure.source]))
    by_shape = _closing(flat, structure, options)
    slabs = designated.joined(by_name).joined(by_shape)
    leaf = _leaf_of_slab(slabs, slack)
    slab_named = np.bincount(leaf, np.arange(len(slabs)) < len(designated) + len(by_name)) > 0
    leaves = _leaves(scene, slabs.merged(leaf), slab_named, free, is_door | named, opaque, slack)
    return sorted(leaves, key=lambda leaf: int(leaf.triangles[0]))


def _door_sized(slabs: Slabs, slack: float) -> Bools:
    """(k,) which slabs are upright and of the size of a door leaf."""
    thick, wide, high = slabs.size.T
    result: Bools = (
        slabs.upright
        & (thick <= THICK + slack)
        & (wide >= WIDE[0] - slack)
        & (wide <= WIDE[1] + slack)
        & (high >= HIGH[0] - slack)
        & (high <= HIGH[1] + slack)
    )
    return result


def _pieces(scene: Scene, triangles: Ints) -> Slabs:
    """The connected pieces of objects, of these triangles."""
    mesh = Welded.of(scene.points, scene.triangles[triangles])
    source = triangles[mesh.source]
    return Slabs.of(mesh.corners, _crossed(connected_pieces(mesh), scene.triangle_object[source]))


def _named_slabs(scene: Scene, triangles: Ints, slack: float) -> Slabs:
    """The pieces and the rectangles of these triangles that have the size of a door. A piece with
    several rectangles of that size is no leaf, unless they are the two faces of one slab."""
    mesh = Welded.of(scene.points, scene.triangles[triangles])
    owner = scene.triangle_object[triangles[mesh.source]]
    piece = _crossed(connected_pieces(mesh), owner)
    region = _crossed(Facets.of(mesh, scene.tolerance).region, owner)
    pieces, flat = Slabs.of(mesh.corners, piece), Slabs.of(mesh.corners, region)
    whole = np.zeros(len(flat), dtype=np.int64)
    whole[region] = piece
    fits = _door_sized(flat, slack)
    flat, whole = flat.only(fits), whole[fits]
    grid = scene.tolerance.grid
    filled = flat.filled(grid) >= FILLED
    flat, whole = flat.only(filled), whole[filled]
    leaf = _leaf_of_slab(flat, slack)
    faces = np.bincount(leaf)[leaf]
    alone = np.bincount(whole)[whole] == 1 if len(whole) else np.zeros(0, dtype=bool)
    pieces = pieces.only(_door_sized(pieces, slack))
    pieces = pieces.only(pieces.filled(grid) >= FILLED)
    return pieces.joined(flat.only((faces > 1) | alone))


def _flat(scene: Scene, structure: Structure, which: Ints) -> Slabs:
    """The flat regions of the structure of the size of a door, separated by object and material."""
    source = structure.source[which]
    group = _crossed(
        structure.region[which], scene.triangle_object[source], scene.triangle_material[source]
    )
    slabs = Slabs.of(structure.corners[which], group)
    return slabs.only(_door_sized(slabs, structure.tolerance.plane))


def _crossed(*names: NDArray[np.integer]) -> Ints:
    """(n,) numbers from 0, one for each combination of (n,) names."""
    result = np.zeros(len(names[0]), dtype=np.int64)
    for name in names:
        key = result * (int(name.max(initial=0)) + 1) + name
        result = np.unique(key, return_inverse=True)[1].reshape(-1)
    return result


def _closing(slabs: Slabs, structure: Structure, options: SubdivideOptions) -> Slabs:
    """The slabs that close an opening in a wall, alone or as a pair."""
    if not len(slabs):
        return slabs
    leaf = _leaf_of_slab(slabs, structure.tolerance.plane)
    leaves = slabs.merged(leaf)
    fits = _door_sized(leaves, structure.tolerance.plane)
    pair = leaves.near(PAIR)
    one, other = pair.T
    thick, wide, high = np.moveaxis(leaves.overlaps(one, other), -1, 0)
    paired = fits[one] & fits[other] & (np.abs(wide) <= PAIR)
    paired &= (thick >= -structure.tolerance.plane) & (high >= 0.9 * leaves.size[one, 2])
    one, other = one[paired], other[paired]
    door = connected(len(leaves), *_both_ways(one, other))
    door = np.unique(door, return_inverse=True)[1].reshape(-1)
    closes = close_openings(leaves.merged(door), structure, options.wall_thickness)
    return slabs.only((closes[door] & fits)[leaf])


def _leaf_of_slab(slabs: Slabs, slack: float) -> Ints:
    """(k,) leaves from 0: parallel slabs behind one another are one leaf."""
    one, other = slabs.near(THICK).T
    overlap = slabs.overlaps(one, other)
    least = np.minimum(slabs.size[one], slabs.size[other])
    together = slabs.size[one, 0] + slabs.size[other, 0] - overlap[:, 0]
    alike = (together <= THICK + slack) & (overlap[:, 1:] > least[:, 1:] / 2).all(axis=1)
    group = connected(len(slabs), *_both_ways(one[alike], other[alike]))
    return np.unique(group, return_inverse=True)[1].reshape(-1)


def _both_ways(one: Ints, other: Ints) -> tuple[Ints, Ints]:
    return np.concatenate([one, other]), np.concatenate([other, one])


def _leaves(
    scene: Scene,
    slabs: Slabs,
    slab_named: Bools,
    free: Bools,
    named: Bools,
    opaque: Opaque,
    slack: float,
) -> Iterator[DoorLeaf]:
    """The leaves that fill slabs, from those triangles of the scene that are ``free``, (T,).

    A flat region belongs to a leaf if it lies wholly within it. ``slab_named``: (k,) which slabs
    have a door's name, ``named``: (T,) which triangles have; these may project from the slab, like
    handles. Other triangles in the rim of a named slab are the jambs of a wall as thin as the leaf.
    """
    if not len(slabs):
        return
    corners, of = scene.corners, opaque.source
    region = np.zeros(len(corners), dtype=np.int64)
    owner = scene.triangle_object[of], scene.triangle_material[of]
    region[of] = 1 + _crossed(opaque.facets.region, *owner)
    size = np.bincount(region)
    nearby = Nearby(corners, slack)
    reach = np.array([RELIEF, slack, slack])
    for axes, low, high, is_named in zip(
        slabs.axes, slabs.low, slabs.high, slab_named, strict=True
    ):
        ends = np.stack([low - reach, high + reach])[:, :, None] * axes
        about = nearby.meeting(ends.min(axis=0).sum(axis=0), ends.max(axis=0).sum(axis=0))
        local = corners[about] @ axes.T
        off = np.maximum(low - local, local - high).max(axis=1)
        inside = (off <= reach).all(axis=1) & free[about]
        about, local, off = about[inside], local[inside], off[inside]
        sides = [np.abs(local - side).max(axis=1)[:, 1:] <= slack for side in (low, high)]
        own = (off[:, 0] <= slack) & ~(is_named & np.any(sides, axis=(0, 2)))
        own |= named[about]
        names, count = np.unique(region[about[own]], return_counts=True)
        whole = names[(count == size[names]) | (names == 0)]  # 0: outside all regions
        own &= np.isin(region[about], whole)
        own[own] = ~_repeated(corners[about], own)
        triangles = about[own]
        if len(triangles):
            largest = triangles[np.argmax(areas(corners[triangles]))]
            name = scene.objects[scene.triangle_object[largest]]
            yield DoorLeaf(name, axes, low, high, triangles)


def _repeated(corners: Floats, which: Bools) -> Bools:
    """For each triangle ``which``, (n,), of (n, 3, 3), whether one of the others is the same."""
    _, point = distinct(corners.reshape(-1, 3))
    _, row = distinct(np.sort(point.reshape(-1, 3), axis=1))
    return np.isin(row[which], row[~which])


def close_openings(slabs: Slabs, structure: Structure, wall_thickness: float) -> Bools:
    """(k,) which slabs, each a leaf or a pair of them, close an opening in a wall of at most this
    thickness, metres."""
    slack = structure.tolerance.plane
    wide = slabs.size[:, 1]
    fits = (wide >= OPENING_WIDTH[0] - slack) & (wide <= OPENING_WIDTH[1] + slack)
    result = np.zeros(len(slabs), dtype=bool)
    if fits.any():
        rays = _Rays(slabs.only(fits), Surroundings(structure.corners, structure.tolerance))
        result[fits] = _closes_by_rays(rays, wall_thickness)
    return result


def free_on_both_sides(slabs: Slabs, structure: Structure) -> Bools:
    """(k,) which slabs have room on both sides, unlike a door on a wall or open against it."""
    if not (len(slabs) and len(structure.corners)):
        return np.ones(len(slabs), dtype=bool)
    return _Rays(slabs, Surroundings(structure.corners, structure.tolerance)).free()


def _closes_by_rays(rays: _Rays, wall_thickness: float) -> Bools:
    half = rays.size[:, 0] / 2
    walls = [_wall(rays, *side, half, wall_thickness) for side in _SIDES]
    result: Bools = np.all([np.isfinite(ahead) for ahead, _ in walls], axis=0)
    revealed, floors = np.zeros(len(result), dtype=bool), []
    for k, turn in ((0, 1.0), (1, -1.0)):
        depth = np.minimum(walls[0][k], walls[1][k]) - half
        depth = np.where(np.isfinite(depth), depth, 0.0)
        revealed |= (depth >= _REVEAL) & _revealed(rays, turn * (half + depth / 2))
        room = np.maximum(walls[0][k], walls[1][k])
        room = np.where(np.isfinite(room), room, 0.0) + 2 * _GAP
        below = rays.at(turn * room, _SHARES, np.zeros(3), above=2 * _GAP)
        floors.append(np.median(rays.meet(below, (0, 0, -1))[0], axis=1) - 2 * _GAP)
    result &= revealed & (np.minimum(*floors) <= _GAP) & rays.free()
    return result


def _wall(
    rays: _Rays, along: Floats, up: Floats, aside: float, above: float, half: Floats, limit: float
) -> tuple[Floats, Floats]:
    """(k,) and (k,): metres from the middle of the leaf ahead and back to the faces of the wall at
    one of its sides; infinite where there is no wall."""
    start = rays.at(np.zeros(len(half)), along, up, aside, above)
    (ahead, square), (behind, squared) = (rays.meet(start, (turn, 0, 0)) for turn in (1, -1))
    within = np.minimum(ahead, behind) >= half[:, None] - _PROUD
    wall = within & square & squared & (ahead + behind <= limit)
    stands = wall.mean(axis=1) >= _AGREEING
    first, second = (np.where(wall, far, 0.0).max(axis=1) for far in (ahead, behind))
    return np.where(stands, first, np.inf), np.where(stands, second, np.inf)


def _revealed(rays: _Rays, depth: Floats) -> Bools:
    """(k,) which leaves have the sides and the top of an opening in front of them, (k,) metres
    from the middle of each."""
    result = np.ones(len(depth), dtype=bool)
    middle = rays.at(depth, np.full(3, 0.5), _SHARES)
    for turn in (1, -1):
        far, square = rays.meet(middle, (0, turn, 0))
        jamb = square & (np.abs(far - rays.size[:, 1, None] / 2) <= _GAP)
        result &= jamb.mean(axis=1) >= _AGREEING
    top = rays.at(depth, _SHARES, np.ones(3), above=-2 * _GAP)
    far, square = rays.meet(top, (0, 0, 1))
    result &= (square & (far <= 3 * _GAP)).mean(axis=1) >= _AGREEING
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

    def at(
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
            ahead = self.at(turn * (self.size[:, 0] / 2 + RELIEF), *_SHARES_ALL_OVER)
            result &= (self.meet(ahead, (turn, 0, 0))[0] >= _FREE).mean(axis=1) >= _AGREEING
        return result

    def meet(self, start: Floats, to: tuple[float, float, float]) -> tuple[Floats, Bools]:
        """(k, p) metres to the first surface that rays from (k, p, 3) points meet, and whether it
        is square to them."""
        axes = self._slabs.axes
        points = np.einsum("kpa,kac->kpc", start, axes)
        along = np.broadcast_to((np.array(to) @ axes)[:, None], points.shape)
        far, facing = self._around.first(points.reshape(-1, 3), along.reshape(-1, 3))
        square = np.abs(np.einsum("pc,pc->p", facing, along.reshape(-1, 3))) >= _SQUARE
        return far.reshape(start.shape[:2]), square.reshape(start.shape[:2])
