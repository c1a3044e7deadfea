"""Subdivision of a scene into convex cells, portals and cut geometry (paper §3).

1. Walls propose planes (`structure`), which split the root box into convex leaves (`bsp`); the
   parts of the leaves' boundaries that no wall covers are portals (`portals`).
2. A flood through the portals finds the reachable leaves (`space`). If it meets the first root
   box, which is wider than the model, the model is open, and its bounding box is divided instead,
   as it is at once if sight shows that.
3. The geometry is cut to the leaves, and each piece gets its owners (`ownership`).
4. Leaves that no standing viewer sees are left out (`sight`), the others grouped (`rooms`).
5. Pieces of geometry with the same owners are joined again (`joining`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.cells.building import Building
from ptmtools.cells.diagnostics import (
    NO_PLACES,
    building_notes,
    leaf_notes,
    space_notes,
    triangle_notes,
    undecided_notes,
    viewpoint_notes,
    way_notes,
)
from ptmtools.cells.doors import THICK
from ptmtools.cells.fabric import matches
from ptmtools.cells.floors import ROOFED
from ptmtools.cells.joining import join_pieces
from ptmtools.cells.model import OUTSIDE, Cells, descend
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.ownership import Pieces, cut_to_leaves
from ptmtools.cells.places import eye_region, meets
from ptmtools.cells.planar import count, counting
from ptmtools.cells.planes import Polyhedron, bounds, boxes_meet
from ptmtools.cells.portals import ends_of
from ptmtools.cells.rooms import group_cells
from ptmtools.cells.sight import seen_from_places
from ptmtools.cells.space import DividedSpace, closed_share, divide, divide_inside
from ptmtools.cells.structure import LOOKS, spread_over
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.executor import Executor
from ptmtools.portal_flow.flow import MOST_PORTALS
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance

#: Number of triangles that take as long to subdivide as two processes take to start.
LARGE = 4000


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
    InputError: PTM-I111 if an option is out of range or a viewpoint lies in no leaf, PTM-I302
        if a name pattern matches nothing, PTM-I247 if the scene is a single triangle, PTM-I304 if
        no face would be visible, PTM-I305 if much is left out under ``strict``.
    """
    options, executor = options or SubdivideOptions(), executor or Executor()
    _check(scene, options)
    with counting() as undecided:
        building = Building.from_scene(scene, options, executor)
        space, notes = _divide_building(
            building, progress, executor, large=len(scene.triangles) >= LARGE
        )
        cells = _cut_and_group(scene, building, space, notes, executor)
    check_seen(scene, cells)
    return replace(cells, notes=(*cells.notes, *undecided_notes(undecided)))


def _divide_building(
    building: Building, progress: Progress, executor: Executor, *, large: bool
) -> tuple[DividedSpace, list[str]]:
    """The divided space of a building, the first root box if that is closed, else the second; and
    notes on it. ``large``: whether the division takes long."""
    wide, tight, notes = building.wide, building.tight, [*building_notes(building)]
    if (closed := closed_share(building)) is not None:
        # A task that is not long runs in this thread, and frees the others for textures.
        inside = executor.submit(
            partial(divide_inside, progress=progress), building, tight, long=False
        )
        space, no_room = inside.result(), closed == 0
    else:
        clipped = executor.submit(divide_inside, building, tight, long=large)
        try:
            space = divide(building, wide, progress)
            no_room = not space.reached.any()
            if not space.closed:
                space = clipped.result()
        finally:
            clipped.cancel()
    if not space.closed:
        notes.append(_open_note(no_room, building.doors.floor.roof_share, tight, space.ceiling))
    limit, many = building.options.max_leaves, _portal_count(space) > MOST_PORTALS
    while _portal_count(space) > MOST_PORTALS:
        limit = len(space.tree.leaves) // 2
        fewer = replace(building, options=replace(building.options, max_leaves=limit))
        again = divide(fewer, wide) if space.closed else space
        space = again if again.closed else divide_inside(fewer, tight)
    notes += space_notes(building, space)
    if space.tree.unsplit:
        notes.append(_limit_note(space.tree.unsplit, limit, many))
    if space.tree.ended:
        notes.append(
            f"division ended at {len(space.tree.leaves):,} leaves: more would save visitors less "
            f"than {building.options.gain:.0%}, since sight goes around the walls or over them "
            "(--gain changes that)"
        )
    return space, notes


def _limit_note(unsplit: int, limit: int, many: bool) -> str:
    """``many``: whether visible sets could not hold the portals of more leaves."""
    kind = "leaves for visible sets" if many else "leaves"
    remedy = "name furniture with --detail" if many else "raise --max-leaves"
    return Warned(
        f"the limit of {limit:,} {kind} was reached: {unsplit:,} of them contain walls that do not "
        f"divide them, so the space behind these walls counts as visible; {remedy}"
    )


def _cut_and_group(
    scene: Scene, building: Building, space: DividedSpace, notes: list[str], executor: Executor
) -> Cells:
    """The geometry of a scene cut to the leaves of a space, and these grouped into cells."""
    options, tolerance = building.options, building.structure.tolerance
    opened = building.doors.triangles(space.doors)
    pieces = cut_to_leaves(scene, space.tree, tolerance)
    owner = compact_numbers(space.reached)[pieces.leaf]
    cells = assemble_cells(scene, building, space, pieces, owner, notes)
    name = np.append(compact_numbers(seen_from_places(cells, executor)), np.int32(-1))
    cells = replace(cells, leaf_cell=name[:-1], triangle_cell=name[cells.triangle_cell])
    outside = triangle_notes(scene, pieces, name[owner], building)
    dropped = [*leaf_notes(cells, space.reached), *outside]
    cells = group_cells(replace(cells, notes=(*cells.notes, *dropped)), options, building.volumes)
    owner = np.append(cells.leaf_cell, np.int32(-1))[owner]
    if options.doors == "hidden":
        owner[np.isin(pieces.source, opened)] = -1
    count(space.undecided)
    return replace(cells, **vars(join_pieces(scene, pieces, owner, tolerance)), opened=opened)


def _portal_count(space: DividedSpace) -> int:
    """The number of portals between reached leaves."""
    return int(np.count_nonzero(space.reached[ends_of(space.portals)].all(axis=1)))


def _check(scene: Scene, options: SubdivideOptions) -> None:
    if len(scene.triangles) < 2:
        raise InputError(
            "PTM-I247",
            "a single triangle is not a room",
            remedy="use a model with floors and walls",
        )
    names = (*scene.objects, *(material.name for material in scene.materials))
    for pattern in (*options.structural, *options.detail, *options.door):
        if not any(matches(name, (pattern,)) for name in names):
            raise InputError(
                "PTM-I302",
                f"no object or material is called {pattern!r}",
                remedy="patterns may contain * and ?, and are case-sensitive",
            )


def _open_note(no_room: bool, roofed: float, box: Floats, ceiling: float | None) -> str:
    roofless = roofed < ROOFED or ceiling is not None
    if roofless:
        state = f"open at the top: {1 - roofed:.0%} of the floor has no ceiling"
    elif no_room:
        state = "open: no room is closed off from the outside"
    else:
        state = "open: the outside can be reached from the rooms (windows, doors or gaps)"
    size = " × ".join(f"{s:.2f}" for s in box[1] - box[0])
    note = f"the model is {state}; cells end at the bounding box of its walls, {size} m"
    if ceiling is not None:
        note += f", and rooms at the tops of their walls, at {ceiling:.2f} m (see --ceiling)"
    return Warned(note) if roofless else note


def assemble_cells(
    scene: Scene,
    building: Building,
    space: DividedSpace,
    pieces: Pieces,
    owner: NDArray[np.int32],
    notes: list[str],
) -> Cells:
    """Cells that are single leaves, with the pieces of the geometry as they were cut; ``owner``:
    (M, 2) the new numbers of the leaves on both sides of each piece."""
    tree, keep = space.tree, space.reached
    rename = compact_numbers(keep)
    bodies = [tree.leaves[i] for i in np.flatnonzero(keep)]
    portals = [portal for portal in space.portals if keep[[*portal.leaves]].all()]
    portals = sorted(portals, key=lambda portal: portal.passage)
    ends = ends_of(portals)
    passage = np.array([portal.passage for portal in portals], dtype=np.bool_)
    standing, eye_floor, standing_notes = _viewers(building, space, bodies, rename)
    # The inside of a door leaf is no place.
    standing &= ~_in_door_leaves(bodies, rename[ends[passage]], building.structure.tolerance)
    owned = np.any(owner >= 0, axis=1)
    corners = scene.corners[pieces.source]
    corners[pieces.cut] = pieces.corner[..., :3]
    vertex = corners[owned].reshape(-1, 3)

    point_start = _starts(len(b.points) for b in bodies)
    loops = [loop + point_start[i] for i, b in enumerate(bodies) for loop in b.faces]
    return Cells(
        node_plane=tree.planes,
        node_child=_rename_children(tree.children, rename),
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
        portal_passage=passage,
        vertex=vertex,
        vertex_uv=np.zeros((len(vertex), 2)),
        triangle=np.arange(len(vertex), dtype=np.int32).reshape(-1, 3),
        triangle_source=pieces.source[owned].astype(np.int32),
        triangle_cell=owner[owned],
        tolerance=scene.tolerance,
        eye_floor=eye_floor,
        left_out=space.left_out,
        walker=building.walker,
        ceiling=space.ceiling,
        closed=space.closed,
        notes=(*notes, *standing_notes),
    )


def _rename_children(children: NDArray[np.int32], rename: NDArray[np.int32]) -> NDArray[np.int32]:
    """(N, 2) `Cells.node_child` of a tree whose leaves have new numbers, -1 for none."""
    leaf = rename[-2 - np.minimum(children, -2)]
    return np.where(children > -2, children, np.where(leaf >= 0, -2 - leaf, OUTSIDE))


def _viewers(
    building: Building, space: DividedSpace, bodies: list[Polyhedron], rename: NDArray[np.int32]
) -> tuple[Bools, Floats, list[str]]:
    """(L,) which leaves stand, `Cells.eye_floor`, and notes; ``rename``: the new number of each
    leaf of the tree."""
    standing, eye_floor = _standing(building, bodies, space)
    boxes = np.array([bounds(body.points) for body in bodies]).reshape(-1, 2, 3)
    notes = way_notes(building, boxes)
    if not standing.any():
        standing[:], eye_floor = True, eye_floor[:0]
        notes.append(NO_PLACES)
    viewpoints = np.array(building.options.viewpoints, dtype=np.float64).reshape(-1, 3)
    leaf = _leaf_at(space, rename, viewpoints)
    notes += viewpoint_notes(_find_buried(building, viewpoints, eye_floor))
    # Viewers stand at requested viewpoints, whatever the floor there.
    leaf = np.append(leaf, _leaf_at(space, rename, building.cameras))
    standing[leaf[leaf >= 0]] = True
    return standing, eye_floor, notes


def _in_door_leaves(
    bodies: list[Polyhedron], passages: NDArray[np.int32], tolerance: Tolerance
) -> Bools:
    """(L,) which leaves are inside a door leaf: thin, with passages, (n, 2), to both sides."""
    count = np.bincount(passages.reshape(-1), minlength=len(bodies))
    limit = THICK + tolerance.plane
    return np.array([n > 1 and body.width <= limit for n, body in zip(count, bodies, strict=True)])


def compact_numbers(keep: Bools) -> NDArray[np.int32]:
    """(L,) the new numbers of the leaves that are kept, -1 for the others."""
    return np.where(keep, np.cumsum(keep) - 1, -1).astype(np.int32)


def _standing(
    building: Building, bodies: list[Polyhedron], space: DividedSpace
) -> tuple[Bools, Floats]:
    """(L,) whether a viewer can stand in a leaf, and `Cells.eye_floor`."""
    walker, tolerance = building.walker, building.structure.tolerance
    if building.options.standing == "anywhere":
        return np.ones(len(bodies), dtype=np.bool_), np.zeros((0, 3, 3))
    boxes = np.array([bounds(body.points) for body in bodies]).reshape(-1, 2, 3)
    places = building.places.only(building.has_way)
    places = places.only(places.find_near(boxes - [0, walker.middle, 0]))
    if space.ceiling is not None:
        places = places.without_tops(space.ceiling - tolerance.plane, walker.radius)
    eyes = eye_region(places, walker, tolerance)
    floor = eyes.triangles(tolerance)
    reach = [0.0, walker.reach, 0.0]
    near = boxes_meet(floor.min(axis=1), floor.max(axis=1) + reach, boxes)
    return meets(eyes, bodies, walker, tolerance), floor[near]


def _leaf_at(space: DividedSpace, rename: NDArray[np.int32], points: Floats) -> NDArray[np.int32]:
    """(n,) the new number of the leaf that contains each of (n, 3) points, or -1."""
    leaf = rename[-2 - descend(space.tree.planes, space.tree.children, points)]
    inside = ((points >= space.box[0]) & (points <= space.box[1])).all(axis=1)
    return np.where(inside, leaf, -1).astype(np.int32)


def _find_buried(building: Building, points: Floats, eye_floor: Floats) -> Floats:
    """The (n, 3) points that lie inside a solid, unless bodies on the ``eye_floor`` do so
    too: in a model whose room faces point outwards, solids cannot be recognised."""
    structure = building.structure
    if not (len(points) and len(eye_floor)):
        return points[:0]
    around = structure.rays
    body = eye_floor.mean(axis=1) + [0.0, building.walker.middle, 0.0]
    if around.solid(spread_over(body, LOOKS)):
        return points[:0]
    return points[[around.solid(point[None]) for point in points]]


def _starts(lengths: Iterable[int]) -> Ints:
    """(n + 1,) where the rows of a CSR begin."""
    return np.cumsum([0, *lengths], dtype=np.int64)


def check_seen(scene: Scene, cells: Cells) -> None:
    """Raises InputError PTM-I304 if no face of the scene is visible from any cell."""
    if _any_face_seen(scene, cells):
        return
    if scene.two_sided.all():
        raise InputError(
            "PTM-I304",
            "no face of the model lies in or around a cell",
            remedy="use --viewpoint X,Y,Z with a point inside a room",
        )
    raise InputError(
        "PTM-I304",
        "no part of the model is visible from inside: no face around its cells is two-sided or "
        "faces them",
        remedy="use --two-sided to draw both sides of every face, or flip the normals",
    )


def _any_face_seen(scene: Scene, cells: Cells) -> bool:
    """Whether some face is two-sided or faces the box around its cell. In doubt it does: a face in
    a side of the root box is emitted with the adjacent cell, whichever way it is turned."""
    piece, cell = cells.emitted(scene.two_sided)
    if not len(piece) or scene.two_sided[cells.triangle_source[piece]].any():
        return len(piece) > 0
    low, high = np.full((2, cells.cell_count, 3), [[[np.inf]], [[-np.inf]]])
    starts = cells.leaf_point_start[:-1]
    kept = cells.leaf_cell >= 0
    leaf_cell = cells.leaf_cell[kept]
    np.minimum.at(low, leaf_cell, np.minimum.reduceat(cells.leaf_point, starts)[kept])
    np.maximum.at(high, leaf_cell, np.maximum.reduceat(cells.leaf_point, starts)[kept])
    corners = cells.vertex[cells.triangle[piece]]
    facing = normals(corners)
    furthest = np.where(facing > 0, high[cell], low[cell])
    ahead = np.einsum("nk,nk->n", furthest - corners[:, 0], facing)
    return bool((ahead > cells.tolerance.thin * np.linalg.norm(facing, axis=1)).any())
