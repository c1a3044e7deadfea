"""The space of a root box: its convex leaves and their portals, what a flood through these reaches,
and the walkable floor that it does not reach.

Leaves that portals connect, but not with the start, are a group. A group with walkable floor is an
*unreachable room*, unless it is a solid. Groups that touch the root box of a closed model are the
outside; floor under a roof and between walls there is reported.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, sum_by_group
from ptmtools.cells.bsp import SplitPlanes, Tree, build_tree
from ptmtools.cells.building import Building, points_beside
from ptmtools.cells.doors import THICK, open_doors
from ptmtools.cells.floors import ROOFED, ceiling_plane
from ptmtools.cells.model import descend
from ptmtools.cells.named_rooms import split_at
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.places import spread
from ptmtools.cells.planar import counting
from ptmtools.cells.planes import Polyhedron, bounds
from ptmtools.cells.portals import (
    Portal,
    at_box,
    ends_of,
    find_portals,
    flood,
    largest_leaf,
    rejoin_caps,
    update_portals,
)
from ptmtools.cells.search import connect
from ptmtools.cells.structure import LOOKS, sample_rows, spread_over
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.tolerance import Tolerance, rank

#: A group of leaves with less walkable floor than this, m², is dropped without a note,
LEAST_PLACE = 0.05
#: and outside, where bus shelters are, with less than this.
LEAST_INSIDE = 2.0
#: Number of points from which the ones that test the walls are chosen.
_CHOICE = 256
#: The walled ground around a building, such as a garden, has up to this many times its floor.
_GARDEN = 4.0
#: A model of solids has less walled floor around them than this many times that inside of them.
_PLATE = 0.5
#: Points of floor from which lines of sight tell whether a building is open, and the share of those
#: of a region from which on rays that leave do not merely pass cracks.
_SIGHTS, _SEES_OUT = 4096, 0.05
#: A void is hardly the building if less than this share of the model's surfaces bounds it.
_HARDLY = 0.1


@dataclass(frozen=True)
class UnreachedRoom:
    """A group of leaves with walkable floor that the flood did not reach."""

    leaves: Ints  # of the tree, ascending
    place: float  # m² of walkable floor
    eye: tuple[float, float, float]  # a viewpoint in it, metres

    @staticmethod
    def from_bodies(leaves: Ints, standing: Standing) -> UnreachedRoom:
        """The room of (n,) leaves and the bodies that stand in them."""
        points = standing.points
        away = ((points - points.mean(axis=0)) ** 2).sum(axis=1)
        x, y, z = points[np.argmin(away)].tolist()
        return UnreachedRoom(leaves, float(standing.place.sum()), (x, y, z))


@dataclass(frozen=True)
class Standing:
    """Bodies that stand in some leaves, spread over all walkable floor."""

    points: Floats  # (n, 3) the middles of the bodies, metres
    place: Floats  # (n,) m² of floor that each represents
    leaf: Ints  # (n,) the leaf of each

    @staticmethod
    def from_tree(tree: Tree, leaves: Bools, building: Building) -> Standing:
        """Bodies in these (L,) leaves."""
        points, place = spread(_floor_about(tree, leaves, building))
        points = points + [0.0, building.walker.middle, 0.0]
        inside, leaf = _locate_within(tree, leaves, points)
        return Standing(points, place, leaf).only(inside)

    def append(self, bodies: Standing) -> Standing:
        """These bodies, then the others."""
        pairs = zip(vars(self).values(), vars(bodies).values(), strict=True)
        return Standing(*map(np.concatenate, pairs))

    def only(self, rows: Bools | Ints) -> Standing:
        """The bodies of some rows."""
        return Standing(self.points[rows], self.place[rows], self.leaf[rows])


@dataclass(frozen=True)
class Unreached:
    """Walkable space that the flood did not reach."""

    rooms: list[UnreachedRoom]  # the largest first
    outside: UnreachedRoom | None = None  # in a building, but outside the closed model
    low: tuple[UnreachedRoom, ...] = ()  # to which no way leads, such as plenums; left out

    def remove_reached(self, reached: Bools, portals: list[Portal]) -> Unreached:
        """The rest once the flood reaches the (L,) leaves ``reached`` through more ``portals``;
        rooms that these connect are one."""
        group = groups(len(reached), portals)
        connected_rooms: dict[int, list[UnreachedRoom]] = {}
        for room in self.rooms:
            if not reached[room.leaves[0]]:
                connected_rooms.setdefault(int(group[room.leaves[0]]), []).append(room)
        rooms = [
            UnreachedRoom(
                np.flatnonzero(group == name), sum(room.place for room in parts), parts[0].eye
            )
            for name, parts in connected_rooms.items()
        ]
        return replace(self, rooms=sorted(rooms, key=lambda room: -room.place))

    def add_to(self, reached: Bools) -> Bools:
        """(L,) the ``reached`` leaves, (L,), and those of unreachable rooms."""
        result = reached.copy()
        for room in self.rooms:
            result[room.leaves] = True
        return result


def find_unreached(
    tree: Tree, portals: list[Portal], reached: Bools, outer: Bools, building: Building
) -> Unreached:
    """Walkable space outside the (L,) ``reached`` leaves; groups with one of the (L,) ``outer``
    leaves are the outside."""
    group, structure = groups(len(tree.leaves), portals), building.structure
    outside = np.isin(group, group[outer]) & ~reached
    waiting = ~reached & ~outside & ~np.isin(group, group[reached])
    if not ((waiting | outside).any() and len(structure.corners)):
        return Unreached([])
    standing = Standing.from_tree(tree, waiting, building)
    reachable = replace(building, places=building.places.only(building.has_way))
    with_way = Standing.from_tree(tree, waiting, reachable)
    place = sum_by_group(group[with_way.leaf], with_way.place, len(group))
    around = structure.rays
    # Apart, since the ground may be so large that few samples on it are in a building.
    sheltered = Standing.from_tree(tree, outside & ~outer, building)
    sheltered = sheltered.append(Standing.from_tree(tree, outside & outer, building))
    if len(sheltered.leaf):
        sheltered = sheltered.only(building.doors.with_glass(structure).enclose(sheltered.points))
    outside_room = None
    if sheltered.place.sum() >= LEAST_INSIDE:
        outside_room = UnreachedRoom.from_bodies(np.unique(sheltered.leaf), sheltered)
    # In a model whose room faces point outwards, solids cannot be recognised.
    volumes = np.array([body.volume for body in tree.leaves]) * reached
    middles = np.array([tree.leaves[i].points.mean(axis=0) for i in rank(volumes)[:LOOKS]])
    recognisable = not around.solid(middles)
    rooms: list[UnreachedRoom] = []
    low: list[UnreachedRoom] = []
    roofed = building.doors.floor.roof_share >= ROOFED
    for room in _rooms(group, standing.only(waiting[standing.leaf])):
        points = spread_over(room.points, _CHOICE)
        # Outside, walls without a back face away; where rooms have no roof, a roof is furniture.
        indoors = points[around.enclose(points, roofed)]
        points = spread_over(indoors if len(indoors) else points, LOOKS)
        leaves = np.flatnonzero(group == group[room.leaf[0]])
        # The inside of a shut door leaf is no room.
        thin = max(tree.leaves[leaf].width for leaf in leaves) <= THICK + structure.tolerance.plane
        if not (thin or (recognisable and around.solid(points))):
            kind = rooms if place[group[room.leaf[0]]] >= LEAST_PLACE else low
            kind.append(UnreachedRoom.from_bodies(leaves, room))
    return Unreached(rooms, outside_room, tuple(low))


def floor_of(
    rooms: list[UnreachedRoom], outside: UnreachedRoom | None, tree: Tree, building: Building
) -> Floats:
    """(n, 3, 3) walkable triangles of floor, metres, whose middles are in any of these rooms or, in
    a building, in ``outside``."""
    leaves = np.zeros(len(tree.leaves), dtype=bool)
    for room in [*rooms, *([outside] if outside else [])]:
        leaves[room.leaves] = True
    floor = _floor_about(tree, leaves, building)
    middle = floor.mean(axis=1) + [0.0, building.walker.middle, 0.0]
    kept, leaf = _locate_within(tree, leaves, middle)
    if outside:
        around = building.doors.with_glass(building.structure)
        kept &= ~np.isin(leaf, outside.leaves) | around.enclose(middle)
    return floor[kept]


def _floor_about(tree: Tree, leaves: Bools, building: Building) -> Floats:
    """(n, 3, 3) walkable triangles of floor, those about (L,) leaves among them."""
    boxes = np.array([bounds(tree.leaves[leaf].points) for leaf in np.flatnonzero(leaves)])
    places, middle = building.places, building.walker.middle
    near = places.find_near(boxes.reshape(-1, 2, 3) - [0, middle, 0])
    return places.only(near & places.front).triangles(building.structure.tolerance)


def _locate_within(tree: Tree, leaves: Bools, points: Floats) -> tuple[Bools, Ints]:
    """(n,) whether each of (n, 3) points is in one of the (L,) leaves, and (n,) its leaf."""
    low, high = bounds(np.concatenate([body.points for body in tree.leaves]))
    leaf = np.asarray(-2 - descend(tree.planes, tree.children, points))
    return ((points >= low) & (points <= high)).all(axis=1) & leaves[leaf], leaf


def _rooms(group: Ints, standing: Standing) -> Iterator[Standing]:
    """The bodies in each group of leaves with enough floor, the largest first."""
    group_of_body = group[standing.leaf]
    order = np.argsort(group_of_body, kind="stable")
    start = np.searchsorted(group_of_body[order], np.arange(len(group) + 1))
    area = sum_by_group(group_of_body, standing.place, len(group))
    for name in rank(area)[: np.count_nonzero(area >= LEAST_PLACE)]:
        yield standing.only(order[start[name] : start[name + 1]])


def groups(leaves: int, portals: list[Portal]) -> Ints:
    """(leaves,) the least leaf to which portals connect each."""
    return connect(leaves, ends_of(portals))


@dataclass(frozen=True, kw_only=True)
class DividedSpace:
    """A divided root box; ``box``: (2, 3) its bounding box."""

    box: Floats
    tree: Tree
    portals: list[Portal]
    reached: Bools  # (L,) which leaves are reachable
    closed: bool  # whether these do not touch the root box; false for a clipped one
    doors: Bools  # (d,) which door leaves are open
    # Unreachable rooms; their leaves are in ``reached`` under `--reach all`.
    beyond: Unreached = field(default_factory=lambda: Unreached([]))
    # `Cells.left_out`
    left_out: Floats = field(default_factory=lambda: np.zeros((0, 3, 3)))
    ceiling: float | None = None  # `Cells.ceiling`
    place: float = 0.0  # m² of walkable floor in ``reached``, if some floor is left out
    # Operations in a plane that ended in a safe answer, by name (`planar.counting`).
    undecided: Counter[str] = field(default_factory=Counter)


def closed_share(building: Building) -> float | None:
    """The share of the floor that sees nothing of the outside, if lines of sight alone show what a
    division of the first root box would: visitors walk on open ground between walls, several times
    as much as any void can hold; see `_is_elsewhere`. None if they do not.

    Where no door leaf is in the way, a region of floor is open from end to end if some of it is.
    """
    structure = building.structure
    corners, region = building.places.only(building.places.front).triangles_by_region(
        structure.tolerance
    )
    points, row = sample_rows(corners, _SIGHTS)
    if not (len(points) and len(structure.corners)):
        return None
    points += [0.0, building.walker.middle, 0.0]
    around = structure.rays
    sees_out = around.see_out(points)
    if not structure.door.any() and not structure.tolerance.step:
        count = np.bincount(region[row])
        share = sum_by_group(region[row], sees_out, len(count)) / np.maximum(count, 1)
        sees_out |= share[region[row]] >= _SEES_OUT
    walled = np.count_nonzero(sees_out & around.enclose(points, roofed=False))
    shows = walled > _GARDEN * np.count_nonzero(~sees_out)
    return float(1 - sees_out.mean()) if shows else None


def divide_inside(building: Building, box: Floats, progress: Progress = silent) -> DividedSpace:
    """Subdivide the box between two corners, (2, 3); leaves at its sides count as inside."""
    return replace(divide(building, Polyhedron.box(*box), progress, inside=True), closed=False)


def divide(
    building: Building, root: Polyhedron, progress: Progress = silent, inside: bool = False
) -> DividedSpace:
    """Subdivide a root box and flood it.

    Raises
    ------
    InputError: PTM-I111 if a viewpoint lies outside the box.
    """
    with counting() as undecided:
        space = _divide(building, root, progress, inside)
    return replace(space, undecided=undecided)


def _divide(building: Building, root: Polyhedron, progress: Progress, inside: bool) -> DividedSpace:
    structure, options = building.structure, building.options
    box, top, ceiling = np.stack(bounds(root.points)), building.ceiling, None
    if inside and top is not None:
        ceiling = ceiling_plane(top, structure, root, structure.tolerance)
    planes = SplitPlanes(
        ceiling=ceiling,
        walls=building.walls,
        reveals=building.reveals,
        doors=building.doors.planes,
        structure=structure,
    )
    # A closed building is closed only when all walls around it divide.
    cost = building.cost if inside else None
    tree = build_tree(root, planes, options, progress, cost)
    portals = find_portals(tree, structure.tolerance)
    outer = at_box(tree)
    start, solid = _viewpoint_leaves(tree, box, options), False
    if not start:
        start, solid = largest_leaf(tree, outer <= inside, structure, building.walker)
    reached = flood(len(tree.leaves), portals, start)
    closed = bool(start) and not bool(np.any(reached & outer))
    if closed and not inside and _is_elsewhere(tree, portals, reached, outer, building, solid):
        closed, reached = False, np.zeros_like(reached)
    shut = np.zeros(len(building.doors.leaves), dtype=bool)
    space = DividedSpace(
        box=box,
        tree=tree,
        portals=portals,
        reached=reached,
        closed=closed,
        doors=shut,
        ceiling=top if ceiling else None,
    )
    if inside or closed:
        space = _complete(building, space, outer & (not inside))
    if inside or space.closed:
        space = _rejoin_caps(space, structure.tolerance)
        tree, portals, reached = split_at(
            building.contacts, space.tree, space.portals, space.reached, structure, options
        )
        space = replace(space, tree=tree, portals=portals, reached=reached)
    return space


def _is_elsewhere(
    tree: Tree,
    portals: list[Portal],
    reached: Bools,
    outer: Bools,
    building: Building,
    solid: bool,
) -> bool:
    """Whether the building is not in the (L,) leaves ``reached``, a void that the model closes, but
    around it: visitors walk between walls, under the sky, on much more floor than there, or on half
    as much if the void is a ``solid``; or that is hardly bounded by surfaces of the model.
    ``outer``: (L,) which leaves are at the box."""
    structure = building.structure
    around = structure.rays
    if not solid:
        largest = rank(np.array([body.volume for body in tree.leaves]) * reached)[:LOOKS]
        middle = [tree.leaves[leaf].points.mean(axis=0) for leaf in largest if reached[leaf]]
        solid = around.solid(np.array(middle))
    seeds = tuple(np.flatnonzero(outer).tolist())
    outside = flood(len(tree.leaves), portals, seeds)
    there = Standing.from_tree(tree, outside, building)
    within = float(Standing.from_tree(tree, reached, building).place.sum())
    some = spread_over(there.points, _CHOICE**2)
    walled = around.enclose(some, roofed=False).mean() if len(some) else 0.0
    if walled * there.place.sum() > (_PLATE if solid else _GARDEN) * within:
        return True
    points, area = points_beside(structure.corners, 2 * structure.tolerance.plane)
    bound = float(area @ _locate_within(tree, reached, points)[0])
    return solid and bound < _HARDLY * float(area.sum()) / 2


def _complete(building: Building, space: DividedSpace, outer: Bools) -> DividedSpace:
    """The space with its doors open and its unreachable rooms. ``outer``: (L,) the leaves at the
    box around a closed model, which proves to be open if a door leads into open rooms."""
    structure, options = building.structure, building.options
    tree, portals, reached, doors = space.tree, space.portals, space.reached, space.doors
    beyond = find_unreached(tree, portals, reached, outer, building)
    if options.doors != "closed":
        within = beyond.add_to(reached)
        outside = flood(len(tree.leaves), portals, tuple(np.flatnonzero(outer).tolist()))
        if building.doors.lead_to_open_rooms(structure, tree, within, outside):
            return replace(space, closed=False)
        hiding = options.doors == "pass"
        opened = open_doors(building.doors, structure, tree, portals, within, outer, hiding)
        if opened:
            doors, tree, portals = opened
            seeds = tuple(np.flatnonzero(reached).tolist())
            reached = flood(len(tree.leaves), portals, seeds)
            beyond = beyond.remove_reached(reached, portals)
    if options.reach == "all":
        reached = beyond.add_to(reached)
    space = replace(space, tree=tree, portals=portals, reached=reached, doors=doors, beyond=beyond)
    rooms = [] if options.reach == "all" else beyond.rooms
    if (rooms or beyond.outside) and reached.any():
        left_out = floor_of(rooms, beyond.outside, tree, building)
        place = float(Standing.from_tree(tree, reached, building).place.sum())
        space = replace(space, left_out=left_out, place=place)
    return space


def _rejoin_caps(space: DividedSpace, tolerance: Tolerance) -> DividedSpace:
    """The space without the splits by caps and doors that separate nothing."""
    tree, portals = space.tree, space.portals
    if not tree.capped:
        return space
    group = np.where(space.reached, groups(len(tree.leaves), portals), -1)
    joint = rejoin_caps(tree, group)
    portals = update_portals(portals, tree, joint, tolerance)
    reached = np.bincount(joint.leaf, space.reached) > 0
    return replace(space, tree=joint.tree, portals=portals, reached=reached)


def _viewpoint_leaves(tree: Tree, box: Floats, options: SubdivideOptions) -> tuple[int, ...]:
    if not options.viewpoints:
        return ()
    places = np.array(options.viewpoints, dtype=np.float64)
    outside = np.flatnonzero(~np.all((places >= box[0]) & (places <= box[1]), axis=1))
    if len(outside):
        x, y, z = places[outside[0]]
        raise InputError(
            "PTM-I111",
            f"viewpoint {x:g},{y:g},{z:g} lies outside the model, which spans "
            + " to ".join(",".join(f"{c:.2f}" for c in corner) for corner in box),
            remedy="viewpoints are in metres, Y up, with the middle of the floor at 0,0,0",
        )
    return tuple(dict.fromkeys((-2 - descend(tree.planes, tree.children, places)).tolist()))
