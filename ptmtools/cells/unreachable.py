"""Rooms that the flood did not reach: behind a door that is closed, in another building, upstairs.

Leaves that hang together through portals, but with none that is reached, are a group. One that
holds a place is where somebody could be, and is not to be lost; one that holds none is a solid, the
hollow of a wall or a shaft, and so is one whose walls face away. What touches the root box of a
closed model is the outside. Who is under a roof and between walls there is in another building,
with a door or a window open: that cannot be told from the outside, but is told to the user.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, summed
from ptmtools.cells.bsp import Tree
from ptmtools.cells.connectivity import connected
from ptmtools.cells.model import sunk
from ptmtools.cells.options import Walker
from ptmtools.cells.places import Floors, find_places, spread
from ptmtools.cells.portals import Portal
from ptmtools.cells.structure import LOOKS, Structure, Surroundings, spread_over
from ptmtools.tolerance import ranked

#: A group of leaves with less place than this, m², is none that anybody would miss.
LEAST_PLACE = 0.05
#: And outside, where bus shelters are, less than this.
LEAST_INSIDE = 2.0
#: Where walls are looked at from is chosen among so many points.
_CHOICE = 256


@dataclass(frozen=True)
class CutOff:
    """A group of leaves that the flood did not reach, and in which somebody could be."""

    leaves: Ints  # of the tree, ascending
    place: float  # m² where somebody can stand
    eye: tuple[float, float, float]  # a viewpoint in it, metres

    @staticmethod
    def of(leaves: Ints, standing: Standing) -> CutOff:
        """Of leaves and of whoever stands in them."""
        points = standing.points
        away = ((points - points.mean(axis=0)) ** 2).sum(axis=1)
        x, y, z = points[np.argmin(away)].tolist()
        return CutOff(leaves, float(standing.place.sum()), (x, y, z))


@dataclass(frozen=True)
class Standing:
    """Whoever stands in some leaves, spread over all places there."""

    points: Floats  # (n, 3) the middles of their bodies, metres
    place: Floats  # (n,) m² that each stands for
    leaf: Ints  # (n,) where they are

    @staticmethod
    def of(
        tree: Tree, leaves: Bools, floors: Floors, structure: Structure, walker: Walker
    ) -> Standing:
        """Whoever stands in these (L,) leaves."""
        points, place = spread(_floor_about(tree, leaves, floors, structure, walker))
        points = points + [0.0, walker.middle, 0.0]
        inside, leaf = _within(tree, leaves, points)
        return Standing(points[inside], place[inside], leaf[inside])

    def joined(self, other: Standing) -> Standing:
        """These and those."""
        return Standing(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.place, other.place]),
            np.concatenate([self.leaf, other.leaf]),
        )

    def only(self, which: Bools | Ints) -> Standing:
        """Some of them."""
        return Standing(self.points[which], self.place[which], self.leaf[which])


@dataclass(frozen=True)
class Unreached:
    """What the flood did not reach."""

    rooms: list[CutOff]  # the largest first
    outside: CutOff | None = None  # what is outside a closed model, but in a building

    def without(self, reached: Bools, portals: list[Portal]) -> Unreached:
        """What is left of it if the flood gets further, to the (L,) leaves ``reached``, through
        more ``portals``: rooms that now hang together are one."""
        group = groups(len(reached), portals)
        joined: dict[int, list[CutOff]] = {}
        for room in self.rooms:
            if not reached[room.leaves[0]]:
                joined.setdefault(int(group[room.leaves[0]]), []).append(room)
        rooms = [
            CutOff(np.flatnonzero(group == name), sum(room.place for room in parts), parts[0].eye)
            for name, parts in joined.items()
        ]
        return Unreached(sorted(rooms, key=lambda room: -room.place), self.outside)

    def or_kept(self, reached: Bools) -> Bools:
        """(L,) the leaves that are ``reached``, (L,), or in a room that is not."""
        found = reached.copy()
        for room in self.rooms:
            found[room.leaves] = True
        return found


def unreached(
    tree: Tree,
    portals: list[Portal],
    reached: Bools,
    outer: Bools,
    floors: Floors,
    structure: Structure,
    walker: Walker,
    glass: Floats,
) -> Unreached:
    """Where somebody could be that the flood did not reach. ``reached``, ``outer``: (L,) leaves;
    groups with one of the latter are the outside. ``glass``: (n, 3, 3) triangles that are walls
    there, metres."""
    group = groups(len(tree.leaves), portals)
    outside = np.isin(group, group[outer]) & ~reached
    waiting = ~reached & ~outside & ~np.isin(group, group[reached])
    if not ((waiting | outside).any() and len(structure.corners)):
        return Unreached([])
    standing = Standing.of(tree, waiting, floors, structure, walker)
    around = Surroundings(structure.corners, structure.tolerance)
    # The ground may be so large that few who stand there are in a building.
    here = Standing.of(tree, outside & ~outer, floors, structure, walker)
    here = here.joined(Standing.of(tree, outside & outer, floors, structure, walker))
    if len(here.leaf):
        walls = np.concatenate([structure.corners, glass])
        here = here.only(Surroundings(walls, structure.tolerance).inside(here.points))
    found = None
    if here.place.sum() >= LEAST_INSIDE:
        found = CutOff.of(np.unique(here.leaf), here)
    # Of a model whose rooms face away themselves nothing can be said.
    volumes = np.array([body.volume for body in tree.leaves]) * reached
    looks = np.array([tree.leaves[i].points.mean(axis=0) for i in ranked(volumes)[:LOOKS]])
    sound = not around.solid(looks)
    rooms = []
    for room in _rooms(group, standing.only(waiting[standing.leaf])):
        looks = spread_over(room.points, _CHOICE)
        sheltered = looks[around.inside(looks)]  # outside, walls without a back face away
        looks = spread_over(sheltered if len(sheltered) else looks, LOOKS)
        if not (sound and around.solid(looks)):
            rooms.append(CutOff.of(np.flatnonzero(group == group[room.leaf[0]]), room))
    return Unreached(rooms, found)


def floor_of(
    rooms: list[CutOff],
    outside: CutOff | None,
    tree: Tree,
    floors: Floors,
    structure: Structure,
    walker: Walker,
    glass: Floats,
) -> Floats:
    """(n, 3, 3) triangles of floor, metres, on which one can stand in any of these rooms, or what
    is ``outside`` but in a building, at least one; those whose middles are there count whole."""
    leaves = np.zeros(len(tree.leaves), dtype=bool)
    for each in [*rooms, *([outside] if outside else [])]:
        leaves[each.leaves] = True
    found = _floor_about(tree, leaves, floors, structure, walker)
    middle = found.mean(axis=1) + [0.0, walker.middle, 0.0]
    kept, leaf = _within(tree, leaves, middle)
    if outside:
        around = Surroundings(np.concatenate([structure.corners, glass]), structure.tolerance)
        kept &= ~np.isin(leaf, outside.leaves) | around.inside(middle)
    return found[kept]


def _floor_about(
    tree: Tree, leaves: Bools, floors: Floors, structure: Structure, walker: Walker
) -> Floats:
    """(n, 3, 3) triangles of floor on which one can stand, in the boxes around (L,) leaves."""
    bodies = [tree.leaves[leaf].points for leaf in np.flatnonzero(leaves)]
    boxes = np.array([(points.min(axis=0), points.max(axis=0)) for points in bodies])
    boxes = boxes.reshape(-1, 2, 3)
    return find_places(floors, structure, walker, boxes).triangles(structure.tolerance)


def _within(tree: Tree, leaves: Bools, points: Floats) -> tuple[Bools, Ints]:
    """(n,) which of (n, 3) points are in any of the (L,) leaves, and (n,) in which."""
    every = np.concatenate([body.points for body in tree.leaves])
    within = ((points >= every.min(axis=0)) & (points <= every.max(axis=0))).all(axis=1)
    leaf = np.asarray(-2 - sunk(tree.planes, tree.children, points))
    return within & leaves[leaf], leaf


def _rooms(group: Ints, standing: Standing) -> Iterator[Standing]:
    """Whoever stands in each group of leaves that is large enough, the largest first."""
    of = group[standing.leaf]
    order = np.argsort(of, kind="stable")
    start = np.searchsorted(of[order], np.arange(len(group) + 1))
    area = summed(of, standing.place, len(group))
    for name in ranked(area)[: np.count_nonzero(area >= LEAST_PLACE)]:
        yield standing.only(order[start[name] : start[name + 1]])


def groups(leaves: int, portals: list[Portal]) -> Ints:
    """(leaves,) the least leaf that each hangs together with through portals."""
    ends = np.array([portal.leaves for portal in portals], dtype=np.int64).reshape(-1, 2)
    return connected(leaves, np.concatenate(ends.T), np.concatenate(ends[:, ::-1].T))
