"""Door leaves: what fills a doorway, and is no wall.

A leaf is an upright slab of the size of a door. It is told by its name, if it has the size; by what
it does, if it closes an opening in a wall (`doorways`); or by the user or its class, whatever its
shape. What is looked at are connected pieces of what is called door, and flat rectangles: of a leaf
that is one piece with its frame or its handle, the rectangles tell, of one made of planks the piece
does. Pieces and rectangles that are the two faces, the edge or the panels of one slab are one leaf,
and so is what lies within it.

A name alone is not enough: a wall of 6 m called `wall_with_door`, a frame, a mat and a hatch in the
floor are no slabs of such a size, and what hangs on a wall or stands open against it parts nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.cells.connectivity import Welded, connected, distinct
from ptmtools.cells.doorways import RELIEF, Slabs, closing, parting
from ptmtools.cells.facets import Facets
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.roles import Designated, called, connected_pieces, says_door
from ptmtools.cells.search import Nearby
from ptmtools.cells.structure import Opaque, Structure
from ptmtools.scene.model import Scene

#: A leaf is thinner than this, metres,
THICK = 0.12
#: so wide, one of a pair with the least, and so high.
WIDE, HIGH = (0.3, 2.4), (1.8, 3.0)
#: So much of its rectangle is filled: a frame fills a fifth, a leaf with a window in it more.
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
        """(n, 3) points spread over the leaf, in front of it by so many metres, and as many
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


#: Points in each direction on a leaf.
_GRID = 3


def find_doors(
    scene: Scene, opaque: Opaque, structure: Structure, options: SubdivideOptions
) -> list[DoorLeaf]:
    """The door leaves of a scene, in the order in which its file begins them."""
    said = Designated.of(scene, options)
    asked = said.door
    free = asked | ~(said.structural | said.detail)
    so_called = called(scene, says_door) & free
    slack = structure.tolerance.plane
    told = _pieces(scene, np.flatnonzero(asked))
    by_name = _called_so(scene, np.flatnonzero(so_called), slack)
    leaf = _one_leaf(by_name, slack)
    by_name = by_name.only(parting(by_name.merged(leaf), structure)[leaf])
    flat = _flat(scene, structure, np.flatnonzero((free & ~asked)[structure.source]))
    by_shape = _closing(flat, structure, options)
    every = told.joined(by_name).joined(by_shape)
    leaf = _one_leaf(every, slack)
    named_so = np.bincount(leaf, np.arange(len(every)) < len(told) + len(by_name)) > 0
    found = _leaves(scene, every.merged(leaf), named_so, free, asked | so_called, opaque, slack)
    return sorted(found, key=lambda leaf: int(leaf.triangles[0]))


def _door_sized(slabs: Slabs, slack: float) -> Bools:
    """(k,) which slabs are upright and of the size of a door leaf."""
    thick, wide, high = slabs.size.T
    found: Bools = (
        slabs.upright
        & (thick <= THICK + slack)
        & (wide >= WIDE[0] - slack)
        & (wide <= WIDE[1] + slack)
        & (high >= HIGH[0] - slack)
        & (high <= HIGH[1] + slack)
    )
    return found


def _pieces(scene: Scene, triangles: Ints) -> Slabs:
    """The connected pieces of objects, of these triangles."""
    mesh = Welded.of(scene.points, scene.triangles[triangles])
    source = triangles[mesh.source]
    return Slabs.of(mesh.corners, _crossed(connected_pieces(mesh), scene.triangle_object[source]))


def _called_so(scene: Scene, triangles: Ints, slack: float) -> Slabs:
    """The pieces and the rectangles of these triangles that are slabs of the size of a door. A
    piece with several rectangles of that size is thicker, unless they are one slab's two faces."""
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
    leaf = _one_leaf(flat, slack)
    faces = np.bincount(leaf)[leaf]
    alone = np.bincount(whole)[whole] == 1 if len(whole) else np.zeros(0, dtype=bool)
    pieces = pieces.only(_door_sized(pieces, slack))
    pieces = pieces.only(pieces.filled(grid) >= FILLED)
    return pieces.joined(flat.only((faces > 1) | alone))


def _flat(scene: Scene, structure: Structure, which: Ints) -> Slabs:
    """The flat regions of door size of the structure, apart by object and material."""
    source = structure.source[which]
    group = _crossed(
        structure.region[which], scene.triangle_object[source], scene.triangle_material[source]
    )
    slabs = Slabs.of(structure.corners[which], group)
    return slabs.only(_door_sized(slabs, structure.tolerance.plane))


def _crossed(*names: NDArray[np.integer]) -> Ints:
    """(n,) from 0, one for each combination of (n,) names."""
    found = np.zeros(len(names[0]), dtype=np.int64)
    for name in names:
        key = found * (int(name.max(initial=0)) + 1) + name
        found = np.unique(key, return_inverse=True)[1].reshape(-1)
    return found


def _closing(slabs: Slabs, structure: Structure, options: SubdivideOptions) -> Slabs:
    """Those that close an opening in a wall, alone or as a pair."""
    if not len(slabs):
        return slabs
    leaf = _one_leaf(slabs, structure.tolerance.plane)
    leaves = slabs.merged(leaf)
    fits = _door_sized(leaves, structure.tolerance.plane)
    pair = leaves.near(PAIR)
    one, other = pair.T
    thick, wide, high = np.moveaxis(leaves.overlaps(one, other), -1, 0)
    beside = fits[one] & fits[other] & (np.abs(wide) <= PAIR)
    beside &= (thick >= -structure.tolerance.plane) & (high >= 0.9 * leaves.size[one, 2])
    one, other = one[beside], other[beside]
    door = connected(len(leaves), *_both_ways(one, other))
    door = np.unique(door, return_inverse=True)[1].reshape(-1)
    closes = closing(leaves.merged(door), structure, options.wall_thickness)
    return slabs.only((closes[door] & fits)[leaf])


def _one_leaf(slabs: Slabs, slack: float) -> Ints:
    """(k,) from 0: slabs parallel and behind one another are one leaf."""
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
    named_so: Bools,
    free: Bools,
    so_called: Bools,
    opaque: Opaque,
    slack: float,
) -> Iterator[DoorLeaf]:
    """The leaves that fill slabs, of those triangles of the scene that are ``free``, (T,).

    Flat regions are of a leaf that lie wholly within it. ``named_so``: (k,) which slabs a name
    tells, and ``so_called``: (T,) which triangles; these may stand off the slab, as handles do.
    Others in the rim of a slab that a name tells are the jambs of a wall as thin as the leaf.
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
    for axes, low, high, told in zip(slabs.axes, slabs.low, slabs.high, named_so, strict=True):
        ends = np.stack([low - reach, high + reach])[:, :, None] * axes
        about = nearby.meeting(ends.min(axis=0).sum(axis=0), ends.max(axis=0).sum(axis=0))
        local = corners[about] @ axes.T
        off = np.maximum(low - local, local - high).max(axis=1)
        inside = (off <= reach).all(axis=1) & free[about]
        about, local, off = about[inside], local[inside], off[inside]
        sides = [np.abs(local - side).max(axis=1)[:, 1:] <= slack for side in (low, high)]
        mine = (off[:, 0] <= slack) & ~(told & np.any(sides, axis=(0, 2)))
        mine |= so_called[about]
        names, count = np.unique(region[about[mine]], return_counts=True)
        whole = names[(count == size[names]) | (names == 0)]  # 0: what is of no region
        mine &= np.isin(region[about], whole)
        mine[mine] = ~_repeated(corners[about], mine)
        triangles = about[mine]
        if len(triangles):
            largest = triangles[np.argmax(areas(corners[triangles]))]
            name = scene.objects[scene.triangle_object[largest]]
            yield DoorLeaf(name, axes, low, high, triangles)


def _repeated(corners: Floats, which: Bools) -> Bools:
    """For each of some of (n, 3, 3) triangles whether one of the others is the same."""
    _, point = distinct(corners.reshape(-1, 3))
    _, row = distinct(np.sort(point.reshape(-1, 3), axis=1))
    return np.isin(row[which], row[~which])
