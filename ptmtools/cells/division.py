"""A root box divided into convex leaves by what of a model may split it, and flooded.

The leaves that are reached, as cells: geometry, portals, and where somebody can stand.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.bsp import Tree, build_tree
from ptmtools.cells.diagnostics import NO_PLACES, of_viewpoints
from ptmtools.cells.entrances import Doors, open_doors
from ptmtools.cells.model import OUTSIDE, Cells, sunk
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.ownership import Pieces
from ptmtools.cells.places import Floors, detail_of, eye_region, find_places, meets
from ptmtools.cells.planar import counting
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.portals import (
    Portal,
    at_box,
    find_portals,
    flood,
    largest_leaf,
    portals_rejoined,
    rejoined,
)
from ptmtools.cells.split_planes import Reveals
from ptmtools.cells.structure import (
    LOOKS,
    Opaque,
    Structure,
    Surroundings,
    WallPlane,
    find_walls,
    spread_over,
)
from ptmtools.cells.unreachable import Standing, Unreached, floor_of, groups, unreached
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
            "PTM-I111",
            f"viewpoint {x:g},{y:g},{z:g} lies outside the model, which spans "
            + " to ".join(",".join(f"{c:.2f}" for c in corner) for corner in box),
            remedy="viewpoints are in metres, Y up, with the middle of the floor at 0,0,0",
        )
    return tuple(dict.fromkeys((-2 - sunk(tree.planes, tree.children, places)).tolist()))


def bounds(corners: Floats) -> tuple[Floats, Floats]:
    """(3,) and (3,): the least and the greatest coordinates of points, (…, 3)."""
    points = corners.reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


def assembled(
    scene: Scene,
    building: Building,
    space: Space,
    pieces: Pieces,
    owner: NDArray[np.int32],
    notes: list[str],
) -> Cells:
    """Cells that are single leaves, with the pieces of the geometry as they were cut."""
    tree = space.tree
    keep = space.reached
    rename = kept_names(keep)
    bodies = [tree.leaves[i] for i in np.flatnonzero(keep)]
    standing, eye_floor = _standing(building, bodies, space.doors)
    if not standing.any():
        standing[:], eye_floor = True, eye_floor[:0]
        notes = [*notes, NO_PLACES]
    asked, cameras = (
        np.array(points, dtype=np.float64).reshape(-1, 3)
        for points in (building.options.viewpoints, [camera.position for camera in scene.cameras])
    )
    leaf = _leaf_at(space, rename, asked)
    notes = [*notes, *of_viewpoints(_buried(building, asked, eye_floor))]
    # From where somebody wants to look, somebody looks.
    leaf = np.append(leaf, _leaf_at(space, rename, cameras))
    standing[leaf[leaf >= 0]] = True
    portals = [portal for portal in space.portals if keep[[*portal.leaves]].all()]
    ends = np.array([portal.leaves for portal in portals], dtype=np.int64).reshape(-1, 2)
    children = tree.children.copy()
    is_leaf = children <= -2
    leaf = rename[-2 - children[is_leaf]]
    children[is_leaf] = np.where(leaf >= 0, -2 - leaf, OUTSIDE)

    owned = np.any(owner >= 0, axis=1)
    corners = scene.corners[pieces.source]
    corners[pieces.cut] = pieces.corner[..., :3]
    vertex = corners[owned].reshape(-1, 3)

    point_start = _starts(len(b.points) for b in bodies)
    loops = [loop + point_start[i] for i, b in enumerate(bodies) for loop in b.faces]
    return Cells(
        node_plane=tree.planes,
        node_child=children,
        root_box=space.box,
        leaf_cell=np.arange(len(bodies), dtype=np.int32),
        leaf_standing=standing,
        leaf_point=np.concatenate([b.points for b in bodies]),
        leaf_point_start=point_start,
        face_index=np.concatenate(loops).astype(np.int32),
        face_start=_starts(map(len, loops)),
        leaf_face_start=_starts(len(b.faces) for b in bodies),
        portal_leaf=rename[ends],
        portal_plane=tree.planes[[portal.node for portal in portals]].reshape(-1, 4),
        portal_point=np.concatenate([np.zeros((0, 3)), *(portal.polygon for portal in portals)]),
        portal_start=_starts(len(portal.polygon) for portal in portals),
        portal_area=np.array([portal.area for portal in portals]),
        vertex=vertex,
        vertex_uv=np.zeros((len(vertex), 2)),
        triangle=np.arange(len(vertex), dtype=np.int32).reshape(-1, 3),
        triangle_source=pieces.source[owned].astype(np.int32),
        triangle_cell=owner[owned],
        tolerance=scene.tolerance,
        eye_floor=eye_floor,
        left_out=space.left_out,
        walker=Walker(*building.options.walker),
        closed=space.closed,
        notes=tuple(notes),
    )


def kept_names(keep: Bools) -> NDArray[np.int32]:
    """(L,) the new names of the leaves that are kept, -1 for the others."""
    return np.where(keep, np.cumsum(keep) - 1, -1).astype(np.int32)


def _standing(building: Building, bodies: list[Polyhedron], opened: Bools) -> tuple[Bools, Floats]:
    """(L,) in which leaves somebody can stand, and `Cells.eye_floor`; ``opened``: (d,) doors."""
    walker, tolerance = Walker(*building.options.walker), building.structure.tolerance
    if building.options.standing == "anywhere":
        return np.ones(len(bodies), dtype=np.bool_), np.zeros((0, 3, 3))
    boxes = np.array([bounds(body.points) for body in bodies]).reshape(-1, 2, 3)
    in_the_way = ~np.append(opened, False)[building.doors.of]
    structure = replace(building.structure, corners=building.structure.corners[in_the_way])
    places = find_places(building.footing, structure, walker, boxes)
    eyes = eye_region(places, walker, tolerance)
    return meets(eyes, bodies, walker, tolerance), eyes.triangles(tolerance)


def _leaf_at(space: Space, rename: NDArray[np.int32], points: Floats) -> NDArray[np.int32]:
    """(n,) the leaf, renamed, that each of (n, 3) points is in, or -1."""
    leaf = rename[-2 - sunk(space.tree.planes, space.tree.children, points)]
    inside = ((points >= space.box[0]) & (points <= space.box[1])).all(axis=1)
    return np.where(inside, leaf, -1).astype(np.int32)


def _buried(building: Building, points: Floats, eye_floor: Floats) -> Floats:
    """Those of (n, 3) points that are inside of something solid, if those who stand on the
    ``eye_floor`` are not: of a model whose rooms face away nothing can be said."""
    structure = building.structure
    if not (len(points) and len(eye_floor)):
        return points[:0]
    around = Surroundings(structure.corners, structure.tolerance)
    body = eye_floor.mean(axis=1) + [0.0, Walker(*building.options.walker).middle, 0.0]
    if around.solid(spread_over(body, LOOKS)):
        return points[:0]
    return points[[around.solid(point[None]) for point in points]]


def _starts(lengths: Iterable[int]) -> Ints:
    """(n + 1,) where the rows of a CSR begin."""
    return np.cumsum([0, *lengths], dtype=np.int64)
