"""From a scene to convex cells, portals and cut geometry (paper §3).

1. Walls propose planes (`structure`), the planes split the root box into convex leaves (`bsp`),
   what no wall covers between two leaves is a portal (`portals`).
2. A flood through the portals finds what somebody can reach (`reach`). The first root box is wider
   than the model: if the flood never meets it, the model is closed and everything else is dropped.
   If it does, the model is open; the root box is then clipped to the walls and the subdivision done
   again, so that the open space over low walls does not join everything to everything.
3. The geometry is cut to the leaves, and each piece gets its owners (`ownership`).
4. What cannot be seen from where one can stand (`standing`) is left out (`seen`). Each of the
   other leaves is a cell, or the leaves of a room are (`grouping`).
5. Pieces of the geometry with the same owners are joined again (`joining`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.bsp import Tree, build_tree
from ptmtools.cells.cut_off import Standing, Unreached, floor_of, groups, unreached
from ptmtools.cells.emptiness import check_seen
from ptmtools.cells.entrances import Doors, open_doors
from ptmtools.cells.grouping import grouped
from ptmtools.cells.joining import joined
from ptmtools.cells.model import OUTSIDE, Cells, sunk
from ptmtools.cells.naming import matches
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.ownership import Pieces, cut_to_leaves
from ptmtools.cells.places import Floors, find_places
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.portals import Portal, find_portals, portals_rejoined
from ptmtools.cells.reach import ROOFED, at_box, flood, largest_leaf, roofed_share
from ptmtools.cells.rejoin import rejoined
from ptmtools.cells.remarks import (
    NO_PLACES,
    of_detail,
    of_doors,
    of_leaves,
    of_triangles,
    of_unreached,
)
from ptmtools.cells.reveals import Reveals
from ptmtools.cells.seen import seen_from_places
from ptmtools.cells.standing import eye_region, meets
from ptmtools.cells.structure import Opaque, Structure, WallPlane, find_walls
from ptmtools.errors import InputError
from ptmtools.executors.model import Executor
from ptmtools.executors.serial import Serial
from ptmtools.notes import Warned
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.scene.orientation import main_axes
from ptmtools.tolerance import Tolerance

#: How far the first root box stands off the model, as a share of the model's extent.
BOX_MARGIN = 0.01
#: So many triangles take as long to subdivide as two processes to start.
LARGE = 4000


@dataclass(frozen=True)
class _Model:
    """What is subdivided, and what may split it."""

    structure: Structure
    walls: list[WallPlane]
    reveals: Reveals
    floors: Floors  # from their fronts
    footing: Floors  # from either side: in space that is reached, one may stand on both
    doors: Doors
    options: SubdivideOptions

    @staticmethod
    def of(scene: Scene, options: SubdivideOptions) -> _Model:
        tolerance = scene.tolerance.for_walls(options.wall_thickness)
        opaque = Opaque.of(scene, options)
        structure = Structure.made(opaque, tolerance)
        doors, structure = Doors.found(scene, opaque, structure, options)
        walls = find_walls(structure, options.wall_area)
        reveals = Reveals(structure, options.wall_thickness)
        floors = Floors.of(scene, structure, options)
        footing = floors
        if not scene.two_sided.all():
            footing = Floors.of(scene, structure, options, backs=True)
        return _Model(structure, walls, reveals, floors, footing, doors, options)


@dataclass(frozen=True)
class _Space:
    """One subdivision of one root box, of which ``box``, (2, 3), is the bounding box."""

    box: Floats
    tree: Tree
    portals: list[Portal]
    reached: Bools  # (L,) which leaves somebody can reach
    closed: bool  # whether they do not touch the root box
    beyond: Unreached  # where the flood did not come to; reached all the same if asked for
    left_out: Floats  # `Cells.left_out`
    place: float  # m² to stand on in all that is reached, known if something is left out
    doors: Bools  # (d,) which door leaves are open


def subdivide(
    scene: Scene,
    options: SubdivideOptions | None = None,
    progress: Progress = silent,
    executor: Executor | None = None,
) -> Cells:
    """Subdivide a scene into convex leaves, and those into cells.

    An ``executor`` subdivides the second root box in the background while the first is subdivided
    here; without one it is done after the first, if the model proves to be open.

    Raises
    ------
    InputError: PTM-I300 if an option is out of range, PTM-I301 if a viewpoint lies in no leaf,
        PTM-I302 if a name pattern matches nothing, PTM-I303 if the scene is a single triangle,
        PTM-I304 if nothing of it would be seen, PTM-I305 if much is left out and must not be.
    """
    options = options or SubdivideOptions()
    _check(scene, options)
    axes = main_axes(scene.corners)
    model = _Model.of(scene, options)
    corners, tolerance = model.structure.corners, model.structure.tolerance
    low, high = _bounds(scene.corners @ axes.T)
    margin = BOX_MARGIN * tolerance.extent
    wide = Polyhedron.box(low - margin, high + margin)
    wide = replace(wide, points=wide.points @ axes)
    tight = _thickened(*_bounds(corners if len(corners) else scene.corners), tolerance)
    notes = of_detail(scene, model.structure.detail)
    executor = executor or Serial()
    clipped = executor.submit(_divide_inside, model, tight, long=len(scene.triangles) >= LARGE)
    try:
        space = _divide(model, wide, progress)
        if not space.closed:
            roofed = roofed_share(corners, options.wall_area)
            notes.append(_open_note(space, roofed, tight))
            space = clipped.result()
    finally:
        clipped.cancel()
    opened = model.doors.triangles(space.doors)
    if options.doors != "closed":
        notes += of_doors(model.doors.leaves, space.doors)
    notes += of_unreached(space.beyond, options.reach == "all", space.place, options.strict)
    if space.tree.unsplit:
        notes.append(
            Warned(
                f"the limit of {options.max_leaves:,} leaves was reached: {space.tree.unsplit:,} "
                "of them contain walls that do not divide them, so what is behind these walls "
                "counts as visible; raise --max-leaves"
            )
        )
    pieces = cut_to_leaves(scene, space.tree, tolerance)
    owner = _named(space.reached)[pieces.leaf]
    cells = _assemble(scene, model, space, pieces, owner, notes)
    name = np.append(_named(seen_from_places(cells, executor)), np.int32(-1))
    cells = replace(cells, leaf_cell=name[:-1], triangle_cell=name[cells.triangle_cell])
    said = [*of_leaves(cells, space.reached), *of_triangles(scene, pieces, name[owner])]
    cells = grouped(replace(cells, notes=(*cells.notes, *said)), options)
    owner = np.append(cells.leaf_cell, np.int32(-1))[owner]
    if options.doors == "hidden":
        owner[np.isin(pieces.source, opened)] = -1
    cells = replace(cells, **vars(joined(scene, pieces, owner, tolerance)), opened=opened)
    check_seen(scene, cells)
    return cells


def _check(scene: Scene, options: SubdivideOptions) -> None:
    if len(scene.triangles) < 2:
        raise InputError(
            "PTM-I303",
            "a single triangle makes no room",
            remedy="give a model with floors and walls",
        )
    names = (*scene.objects, *(material.name for material in scene.materials))
    for pattern in (*options.structural, *options.detail, *options.door):
        if not any(matches(name, (pattern,)) for name in names):
            raise InputError(
                "PTM-I302",
                f"no object or material is called {pattern!r}",
                remedy="names are matched with * and ?, upper and lower case distinct",
            )


def _divide_inside(model: _Model, bounds: Floats) -> _Space:
    """Subdivide the box between two corners, (2, 3); leaves at its sides count as inside."""
    return _divide(model, Polyhedron.box(*bounds), inside=True)


def _divide(
    model: _Model, root: Polyhedron, progress: Progress = silent, inside: bool = False
) -> _Space:
    """Subdivide a root box and flood it."""
    structure, options = model.structure, model.options
    box = np.stack(_bounds(root.points))
    planes = model.doors.planes
    tree = build_tree(root, structure, model.walls, model.reveals, planes, options, progress)
    portals = find_portals(tree, structure.tolerance)
    outer = at_box(tree)
    start = _viewpoint_leaves(tree, box, options)
    walker = Walker(*options.walker)
    start = start or largest_leaf(tree, outer <= inside, structure, walker)
    reached = flood(len(tree.leaves), portals, start)
    closed = bool(start) and not bool(np.any(reached & outer))
    beyond, left_out, place = Unreached([]), np.zeros((0, 3, 3)), 0.0
    doors = np.zeros(len(model.doors.leaves), dtype=bool)
    if inside or closed:  # else it is thrown away
        surfaces, outside = (model.floors, structure, walker), outer & (not inside)
        beyond = unreached(tree, portals, reached, outside, *surfaces)
        way = None
        if options.doors != "closed":
            way = open_doors(model.doors, structure, tree, portals, start, beyond, outside)
        if way:
            doors, tree, portals = way.doors, way.tree, way.portals
            reached = flood(len(tree.leaves), portals, start)
            beyond = beyond.without(reached, portals)
        if options.reach == "all":
            for room in beyond.rooms:
                reached[room.leaves] = True
        if (left := beyond.left_out(options.reach == "all")) and reached.any():
            left_out = floor_of(left, tree, *surfaces)
            place = float(Standing.of(tree, reached, *surfaces).place.sum())
    if tree.capped and (inside or closed):
        group = np.where(reached, groups(len(tree.leaves), portals), -1)
        joint = rejoined(tree, group)
        portals = portals_rejoined(portals, tree, joint, structure.tolerance)
        tree, reached = joint.tree, np.bincount(joint.leaf, reached) > 0
    return _Space(box, tree, portals, reached, closed, beyond, left_out, place, doors)


def _viewpoint_leaves(tree: Tree, box: Floats, options: SubdivideOptions) -> tuple[int, ...]:
    if not options.viewpoints:
        return ()
    places = np.array(options.viewpoints, dtype=np.float64)
    outside = np.flatnonzero(np.any((places < box[0]) | (places > box[1]), axis=1))
    if len(outside):
        x, y, z = places[outside[0]]
        raise InputError(
            "PTM-I301",
            f"viewpoint {x:g},{y:g},{z:g} lies outside the model, which spans "
            + " to ".join(",".join(f"{c:.2f}" for c in corner) for corner in box),
            remedy="viewpoints are in metres, Y up, with the middle of the floor at 0,0,0",
        )
    return tuple(dict.fromkeys((-2 - sunk(tree.planes, tree.children, places)).tolist()))


def _bounds(corners: Floats) -> tuple[Floats, Floats]:
    points = corners.reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


def _thickened(low: Floats, high: Floats, tolerance: Tolerance) -> Floats:
    """A box that is flat nowhere: a scene that is only a floor still has one cell above it."""
    flat = high - low < tolerance.thin
    return np.array([low, np.where(flat, low + BOX_MARGIN * tolerance.extent, high)])


def _open_note(space: _Space, roofed: float, box: Floats) -> str:
    if roofed < ROOFED:
        what = f"open above: {1 - roofed:.0%} of the floor has no ceiling"
    elif not space.reached.any():
        what = "open: no room is closed off from the outside"
    else:
        what = "open: the outside can be reached from the rooms (windows, doors or gaps)"
    size = " × ".join(f"{s:.2f}" for s in box[1] - box[0])
    note = f"the model is {what}; cells end at the bounding box of its walls, {size} m"
    return Warned(note) if roofed < ROOFED else note


def _named(keep: Bools) -> NDArray[np.int32]:
    """(L,) the new names of the leaves that are kept, -1 for the others."""
    return np.where(keep, np.cumsum(keep) - 1, -1).astype(np.int32)


def _standing(model: _Model, bodies: list[Polyhedron], opened: Bools) -> tuple[Bools, Floats]:
    """(L,) in which leaves somebody can stand, and `Cells.eye_floor`; ``opened``: (d,) doors."""
    walker, tolerance = Walker(*model.options.walker), model.structure.tolerance
    if model.options.standing == "anywhere":
        return np.ones(len(bodies), dtype=np.bool_), np.zeros((0, 3, 3))
    boxes = np.array([_bounds(body.points) for body in bodies]).reshape(-1, 2, 3)
    in_the_way = ~np.append(opened, False)[model.doors.of]
    structure = replace(model.structure, corners=model.structure.corners[in_the_way])
    places = find_places(model.footing, structure, walker, boxes)
    eyes = eye_region(places, walker, tolerance)
    return meets(eyes, bodies, walker, tolerance), eyes.triangles()


def _with_a_view(
    scene: Scene, model: _Model, space: _Space, rename: NDArray[np.int32]
) -> NDArray[np.int32]:
    """The leaves, renamed, in which there is a viewpoint that was asked for, or a camera."""
    eyes = np.array([*model.options.viewpoints, *(camera.position for camera in scene.cameras)])
    eyes = eyes.reshape(-1, 3)
    eyes = eyes[((eyes >= space.box[0]) & (eyes <= space.box[1])).all(axis=1)]
    leaf: NDArray[np.int32] = rename[-2 - sunk(space.tree.planes, space.tree.children, eyes)]
    return leaf[leaf >= 0]


def _assemble(
    scene: Scene,
    model: _Model,
    space: _Space,
    pieces: Pieces,
    owner: NDArray[np.int32],
    notes: list[str],
) -> Cells:
    """Cells that are single leaves, with the pieces of the geometry as they were cut."""
    tree = space.tree
    keep = space.reached
    rename = _named(keep)
    bodies = [tree.leaves[i] for i in np.flatnonzero(keep)]
    standing, eye_floor = _standing(model, bodies, space.doors)
    if not standing.any():
        standing[:], eye_floor = True, eye_floor[:0]
        notes = [*notes, NO_PLACES]
    standing[_with_a_view(scene, model, space, rename)] = True
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
        walker=Walker(*model.options.walker),
        closed=space.closed,
        notes=tuple(notes),
    )


def _starts(lengths: Iterable[int]) -> Ints:
    """(n + 1,) where the rows of a CSR begin."""
    return np.cumsum([0, *lengths], dtype=np.int64)
