"""A root box divided into convex leaves by what of a model may split it, and flooded."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.bsp import Tree, build_tree
from ptmtools.cells.cut_off import Standing, Unreached, floor_of, groups, unreached
from ptmtools.cells.entrances import Doors, open_doors
from ptmtools.cells.model import sunk
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.places import Floors, detail_of
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.portals import Portal, find_portals, portals_rejoined
from ptmtools.cells.reach import at_box, flood, largest_leaf
from ptmtools.cells.rejoin import rejoined
from ptmtools.cells.reveals import Reveals
from ptmtools.cells.structure import Opaque, Structure, WallPlane, find_walls
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance


@dataclass(frozen=True)
class Building:
    """What is subdivided, and what may split it."""

    structure: Structure
    walls: list[WallPlane]
    reveals: Reveals
    floors: Floors  # from their fronts
    footing: Floors  # from either side: in space that is reached, one may stand on both
    doors: Doors
    options: SubdivideOptions

    @staticmethod
    def of(scene: Scene, options: SubdivideOptions) -> Building:
        tolerance = scene.tolerance.for_walls(options.wall_thickness)
        opaque = Opaque.of(scene, options)
        structure = Structure.made(opaque, tolerance)
        doors, structure = Doors.found(scene, opaque, structure, options)
        walls = find_walls(structure, options.wall_area)
        reveals = Reveals(structure, options.wall_thickness)
        detail = detail_of(scene, structure, options)
        floors = Floors.of(scene, detail)
        footing = floors
        if not scene.two_sided.all():
            footing = Floors.of(scene, detail, backs=True)
        return Building(structure, walls, reveals, floors, footing, doors, options)


@dataclass(frozen=True)
class Space:
    """One subdivision of one root box, of which ``box``, (2, 3), is the bounding box."""

    box: Floats
    tree: Tree
    portals: list[Portal]
    reached: Bools  # (L,) which leaves somebody can reach
    closed: bool  # whether they do not touch the root box; nobody knows of one that is clipped
    doors: Bools  # (d,) which door leaves are open
    # Where the flood did not come to; reached all the same if asked for.
    beyond: Unreached = field(default_factory=lambda: Unreached([]))
    # `Cells.left_out`
    left_out: Floats = field(default_factory=lambda: np.zeros((0, 3, 3)))
    place: float = 0.0  # m² to stand on in all that is reached, known if something is left out


def divide_inside(building: Building, box: Floats) -> Space:
    """Subdivide the box between two corners, (2, 3); leaves at its sides count as inside."""
    return divide(building, Polyhedron.box(*box), inside=True)


def divide(
    building: Building, root: Polyhedron, progress: Progress = silent, inside: bool = False
) -> Space:
    """Subdivide a root box and flood it.

    Raises
    ------
    InputError: PTM-I301 if a viewpoint lies outside the box.
    """
    structure, options = building.structure, building.options
    box = np.stack(bounds(root.points))
    planes = building.doors.planes
    tree = build_tree(root, structure, building.walls, building.reveals, planes, options, progress)
    portals = find_portals(tree, structure.tolerance)
    outer = at_box(tree)
    start = _viewpoint_leaves(tree, box, options)
    start = start or largest_leaf(tree, outer <= inside, structure, Walker(*options.walker))
    reached = flood(len(tree.leaves), portals, start)
    closed = bool(start) and not bool(np.any(reached & outer))
    shut = np.zeros(len(building.doors.leaves), dtype=bool)
    space = Space(box, tree, portals, reached, closed, shut)
    if inside or closed:
        space = _complete(building, space, outer & (not inside))
    if inside or space.closed:
        space = _rejoined(space, structure.tolerance)
    return space


def _complete(building: Building, space: Space, outer: Bools) -> Space:
    """With doors open, and what the flood did not come to. ``outer``: (L,) the leaves at the box
    around a closed model, which proves to be open if a door leads into rooms that are."""
    structure, options = building.structure, building.options
    tree, portals, reached, doors = space.tree, space.portals, space.reached, space.doors
    surfaces = building.floors, structure, Walker(*options.walker)
    beyond = unreached(tree, portals, reached, outer, *surfaces, building.doors.glass)
    if options.doors != "closed":
        within = beyond.or_kept(reached)
        outside = flood(len(tree.leaves), portals, tuple(np.flatnonzero(outer).tolist()))
        if building.doors.lead_to_open_rooms(structure, tree, within, outside):
            return replace(space, closed=False)
        way = open_doors(building.doors, structure, tree, portals, within, outer)
        if way:
            doors, tree, portals = way.doors, way.tree, way.portals
            seeds = tuple(np.flatnonzero(reached).tolist())
            reached = flood(len(tree.leaves), portals, seeds)
            beyond = beyond.without(reached, portals)
    if options.reach == "all":
        reached = beyond.or_kept(reached)
    space = replace(space, tree=tree, portals=portals, reached=reached, doors=doors, beyond=beyond)
    rooms = [] if options.reach == "all" else beyond.rooms
    if (rooms or beyond.outside) and reached.any():
        left_out = floor_of(rooms, beyond.outside, tree, *surfaces, building.doors.glass)
        place = float(Standing.of(tree, reached, *surfaces).place.sum())
        space = replace(space, left_out=left_out, place=place)
    return space


def _rejoined(space: Space, tolerance: Tolerance) -> Space:
    """With the leaves together that caps and doors split for nothing."""
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
            "PTM-I301",
            f"viewpoint {x:g},{y:g},{z:g} lies outside the model, which spans "
            + " to ".join(",".join(f"{c:.2f}" for c in corner) for corner in box),
            remedy="viewpoints are in metres, Y up, with the middle of the floor at 0,0,0",
        )
    return tuple(dict.fromkeys((-2 - sunk(tree.planes, tree.children, places)).tolist()))


def bounds(corners: Floats) -> tuple[Floats, Floats]:
    """(3,) and (3,): the least and the greatest coordinates of points, (…, 3)."""
    points = corners.reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)
