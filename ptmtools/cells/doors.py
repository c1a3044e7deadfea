"""Recognition of door leaves, which fill doorways and are no walls.

A leaf is an upright slab of the size of a door, identified by its name, by the opening that it
closes (`doorways`), by the user or by its class. Candidates are connected pieces of objects with a
door's name, and flat rectangles: the rectangles identify a leaf in one piece with its frame or
handle, the piece one made of planks. Parallel slabs behind one another are one leaf, with all
triangles within it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.cells.doorways import _GRID, RELIEF, Slabs, close_openings, free_on_both_sides
from ptmtools.cells.facets import Facets, Welded
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.roles import Designated, connected_pieces, is_door_name, triangles_named
from ptmtools.cells.search import Nearby, connected, distinct
from ptmtools.cells.structure import Opaque, Structure
from ptmtools.scene.model import Scene

#: A leaf is thinner than this, metres,
THICK = 0.12
#: its width, down to one of a narrow pair, and its height are in these ranges.
WIDE, HIGH = (0.3, 2.4), (1.8, 3.0)
#: It fills this share of its rectangle: a frame fills a fifth, a leaf with a window more.
FILLED = 0.5
#: Leaves of a pair are nearer to one another than this, metres.
PAIR = 0.03


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
    door = connected(len(leaves), np.stack([one, other], axis=1))
    door = np.unique(door, return_inverse=True)[1].reshape(-1)
    closes = close_openings(leaves.merged(door), structure, options.wall_thickness)
    return slabs.only((closes[door] & fits)[leaf])


def _leaf_of_slab(slabs: Slabs, slack: float) -> Ints:
    """(k,) leaves from 0: parallel slabs behind one another are one leaf."""
    pair = slabs.near(THICK)
    one, other = pair.T
    overlap = slabs.overlaps(one, other)
    least = np.minimum(slabs.size[one], slabs.size[other])
    together = slabs.size[one, 0] + slabs.size[other, 0] - overlap[:, 0]
    alike = (together <= THICK + slack) & (overlap[:, 1:] > least[:, 1:] / 2).all(axis=1)
    group = connected(len(slabs), pair[alike])
    return np.unique(group, return_inverse=True)[1].reshape(-1)


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
