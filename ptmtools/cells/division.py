"""Division of a root box into convex leaves, their portals, and the space that a flood reaches."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.bsp import Tree, build_tree
from ptmtools.cells.building import Building
from ptmtools.cells.ceilings import ceiling_plane
from ptmtools.cells.model import descend
from ptmtools.cells.open_doors import open_doors
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import counting
from ptmtools.cells.polyhedron import Polyhedron, bounds
from ptmtools.cells.portals import (
    Portal,
    at_box,
    find_portals,
    flood,
    largest_leaf,
    portals_rejoined,
    rejoined,
)
from ptmtools.cells.room_planes import split_at
from ptmtools.cells.structure import Surroundings
from ptmtools.cells.unreached import Standing, Unreached, floor_of, groups, unreached
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.tolerance import Tolerance


@dataclass(frozen=True)
class Space:
    """A divided root box; ``box``: (2, 3) its bounding box."""

    box: Floats
    tree: Tree
    portals: list[Portal]
    reached: Bools  # (L,) which leaves are reachable
    closed: bool  # whether these do not touch the root box; meaningless for a clipped one
    doors: Bools  # (d,) which door leaves are open
    # Unreachable rooms; their leaves are in ``reached`` under `--reach all`.
    beyond: Unreached = field(default_factory=lambda: Unreached([]))
    # `Cells.left_out`
    left_out: Floats = field(default_factory=lambda: np.zeros((0, 3, 3)))
    ceiling: float | None = None  # `Cells.ceiling`
    place: float = 0.0  # m² of walkable floor in ``reached``, if some floor is left out
    # Operations in a plane that ended in a safe answer, by name (`planar.counting`).
    undecided: Counter[str] = field(default_factory=Counter)


def divide_inside(building: Building, box: Floats) -> Space:
    """Subdivide the box between two corners, (2, 3); leaves at its sides count as inside."""
    return divide(building, Polyhedron.box(*box), inside=True)


def divide(
    building: Building, root: Polyhedron, progress: Progress = silent, inside: bool = False
) -> Space:
    """Subdivide a root box and flood it.

    Raises
    ------
    InputError: PTM-I111 if a viewpoint lies outside the box.
    """
    with counting() as undecided:
        space = _divided(building, root, progress, inside)
    return replace(space, undecided=undecided)


def _divided(building: Building, root: Polyhedron, progress: Progress, inside: bool) -> Space:
    structure, options = building.structure, building.options
    box = np.stack(bounds(root.points))
    planes, top = building.doors.planes, building.ceiling
    ceiling = None
    if inside and top is not None:
        ceiling = ceiling_plane(top, structure, root, structure.tolerance)
    # A closed building is closed only when all walls around it divide.
    cost = building.cost if inside else None
    tree = build_tree(
        root, structure, building.walls, building.reveals, planes, options, progress, ceiling, cost
    )
    portals = find_portals(tree, structure.tolerance)
    outer = at_box(tree)
    start, solid = _viewpoint_leaves(tree, box, options), False
    if not start:
        start, solid = largest_leaf(tree, outer <= inside, structure, building.walker)
    reached = flood(len(tree.leaves), portals, start)
    closed = bool(start) and not bool(np.any(reached & outer))
    if closed and solid and not inside and _stands_elsewhere(tree, reached, building):
        closed, reached = False, np.zeros_like(reached)
    shut = np.zeros(len(building.doors.leaves), dtype=bool)
    space = Space(box, tree, portals, reached, closed, shut, ceiling=top if ceiling else None)
    if inside or closed:
        space = _complete(building, space, outer & (not inside))
    if inside or space.closed:
        space = _rejoined(space, structure.tolerance)
        tree, portals, reached = split_at(
            building.contacts, space.tree, space.portals, space.reached, structure, options
        )
        space = replace(space, tree=tree, portals=portals, reached=reached)
    return space


def _stands_elsewhere(tree: Tree, reached: Bools, building: Building) -> bool:
    """Whether more floor is walkable between walls elsewhere than in the (L,) leaves ``reached``,
    which may be the inside of a pillar."""
    structure = building.structure
    there = Standing.of(tree, ~reached, building)
    walled = Surroundings(structure.corners, structure.tolerance).inside(there.points, roofed=False)
    here = float(Standing.of(tree, reached, building).place.sum())
    return float(there.place[walled].sum()) > here


def _complete(building: Building, space: Space, outer: Bools) -> Space:
    """The space with its doors open and its unreachable rooms. ``outer``: (L,) the leaves at the
    box around a closed model, which proves to be open if a door leads into open rooms."""
    structure, options = building.structure, building.options
    tree, portals, reached, doors = space.tree, space.portals, space.reached, space.doors
    beyond = unreached(tree, portals, reached, outer, building)
    if options.doors != "closed":
        within = beyond.added_to(reached)
        outside = flood(len(tree.leaves), portals, tuple(np.flatnonzero(outer).tolist()))
        if building.doors.lead_to_open_rooms(structure, tree, within, outside):
            return replace(space, closed=False)
        hiding = options.doors == "pass"
        opened = open_doors(building.doors, structure, tree, portals, within, outer, hiding)
        if opened:
            doors, tree, portals = opened
            seeds = tuple(np.flatnonzero(reached).tolist())
            reached = flood(len(tree.leaves), portals, seeds)
            beyond = beyond.without(reached, portals)
    if options.reach == "all":
        reached = beyond.added_to(reached)
    space = replace(space, tree=tree, portals=portals, reached=reached, doors=doors, beyond=beyond)
    rooms = [] if options.reach == "all" else beyond.rooms
    if (rooms or beyond.outside) and reached.any():
        left_out = floor_of(rooms, beyond.outside, tree, building)
        place = float(Standing.of(tree, reached, building).place.sum())
        space = replace(space, left_out=left_out, place=place)
    return space


def _rejoined(space: Space, tolerance: Tolerance) -> Space:
    """The space without the splits by caps and doors that separate nothing."""
    tree, portals = space.tree, space.portals
    if not tree.capped:
        return space
    group = np.where(space.reached, groups(len(tree.leaves), portals), -1)
    joint = rejoined(tree, group)
    portals = portals_rejoined(portals, tree, joint, tolerance)
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
