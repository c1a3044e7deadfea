"""The leaves that are reached, as cells: geometry, portals, and where somebody can stand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.division import Building, Space, bounds
from ptmtools.cells.model import OUTSIDE, Cells, sunk
from ptmtools.cells.options import Walker
from ptmtools.cells.ownership import Pieces
from ptmtools.cells.places import find_places
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.remarks import NO_PLACES, of_viewpoints
from ptmtools.cells.standing import eye_region, meets
from ptmtools.cells.surroundings import LOOKS, Surroundings, spread_over
from ptmtools.scene.model import Scene


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
