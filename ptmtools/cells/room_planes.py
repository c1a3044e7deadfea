"""Splits leaves where two named rooms touch without a wall: in an open plan, a kitchen and the
living room are two rooms of one leaf.

A *contact* is the part that a face of one volume and a face of another share: they face each other
and are no farther apart, or overlap no deeper, than a wall is thick. Its plane, half way between
the two, splits the leaves around it, once all other splits and the flood are done, so that no wall
depends on it. Nothing blocks in it but the structure that lies in it, so it becomes a portal.

Volumes often end in the middle of walls, where a contact would split the wall's inside and every
doorway. So both parts of a leaf must be deeper than a wall may be, and the part of the contact in
the leaf wider than a visitor: volumes overlap their neighbours by some centimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, normals
from ptmtools.cells.bsp import Tree
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import Geometry, buffer, intersection, unite
from ptmtools.cells.planes import Frame, bounds
from ptmtools.cells.polyhedron import Polyhedron, cut, section
from ptmtools.cells.portals import Portal, find_portals
from ptmtools.cells.room_volumes import Volume
from ptmtools.cells.structure import Structure, WallPlane
from ptmtools.tolerance import TIE_SHARE, Tolerance, rank

#: Contacts are compared by the share of the leaf's section that they cover, in this many digits.
_DIGITS = 4


@dataclass(frozen=True)
class Contact:
    """The plane between two volumes, the part of it in which they touch, and its box in space."""

    frame: Frame
    shape: Geometry
    low: Floats
    high: Floats


def contacts(
    rooms: Sequence[Volume], options: SubdivideOptions, tolerance: Tolerance
) -> tuple[Contact, ...]:
    """The contacts of volumes with the area of a wall, in the order of the volumes."""
    gap = options.wall_thickness + tolerance.plane
    boxes = np.array([room.box for room in rooms]).reshape(-1, 2, 3)
    layers: dict[int, list[tuple[Floats, Floats]]] = {}
    result = []
    for i, box in enumerate(boxes):
        later = boxes[i + 1 :]
        near = ((later[:, 0] <= box[1] + gap) & (later[:, 1] >= box[0] - gap)).all(axis=1)
        for j in (i + 1 + np.flatnonzero(near)).tolist():
            for k in {i, j} - layers.keys():
                layers[k] = _layers(rooms[k].corners, options.wall_area, tolerance)
            for plane, faces in layers[i]:
                for other, others in layers[j]:
                    contact = _contact(
                        plane, faces, other, others, gap, options.wall_area, tolerance
                    )
                    result += [contact] if contact else []
    return tuple(result)


def _layers(corners: Floats, least: float, tolerance: Tolerance) -> list[tuple[Floats, Floats]]:
    """The planes, (4,) facing outwards, in which a mesh has an area of at least ``least`` m², and
    its triangles there."""
    size = areas(corners)
    left = rank(size)[: np.count_nonzero(size > 0)]
    result = []
    while len(left):
        normal = normals(corners[left[:1]])[0]
        normal = normal / np.linalg.norm(normal)
        plane = np.append(normal, -normal @ corners[left[0], 0])
        own = _lie_in(plane, corners[left], tolerance)
        own[0] = True
        if size[left[own]].sum() >= (1 - TIE_SHARE) * least:
            result.append((plane, corners[left[own]]))
        left = left[~own]
    return result


def _lie_in(plane: Floats, corners: Floats, tolerance: Tolerance) -> Bools:
    """(n,) which triangles lie in a plane and face the same side."""
    within = (np.abs(corners @ plane[:3] + plane[3]) <= tolerance.plane).all(axis=1)
    return np.asarray(within & (normals(corners) @ plane[:3] > 0))


def _contact(
    plane: Floats,
    faces: Floats,
    other: Floats,
    others: Floats,
    gap: float,
    least: float,
    tolerance: Tolerance,
) -> Contact | None:
    """The contact of the ``faces`` of one volume in a plane with those of another volume; None if
    they do not face each other, are more than ``gap`` metres apart or share less than ``least``
    m²."""
    if plane[:3] @ other[:3] > -tolerance.cosine:
        return None
    apart = plane[3] + other[3]
    if abs(apart) > gap:
        return None
    between = plane.copy()
    between[3] -= apart / 2
    frame = Frame.of(between)
    one, two = (unite(frame.to_plane(part), tolerance.grid) for part in (faces, others))
    shape = intersection(np.array([one]), np.array([two]), tolerance.grid)[0]
    if not shapely.area(shape) >= (1 - TIE_SHARE) * least:
        return None
    points = frame.to_space(shapely.get_coordinates(shape))
    return Contact(frame, shape, *bounds(points))


def split_at(
    contacts: Sequence[Contact],
    tree: Tree,
    portals: list[Portal],
    reached: Bools,
    structure: Structure,
    options: SubdivideOptions,
) -> tuple[Tree, list[Portal], Bools]:
    """A tree, its portals and its (L,) reached leaves, with those leaves split at the contacts."""
    tolerance = structure.tolerance
    boxes = np.array([(contact.low, contact.high) for contact in contacts]).reshape(-1, 2, 3)
    leaves, walls = list(tree.leaves), list(tree.walls)
    children = [row.tolist() for row in tree.children]
    parent = {-2 - c: (n, side) for n, row in enumerate(children) for side, c in enumerate(row)}
    waiting = np.flatnonzero(reached).tolist()[::-1] if contacts else []
    stale: set[int] = set()
    while waiting and len(leaves) < options.max_leaves:
        leaf = waiting.pop()
        body = leaves[leaf]
        low, high = bounds(body.points)
        near = ((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(axis=1)
        around = [contacts[k] for k in np.flatnonzero(near).tolist()]
        contact = _best(around, body, options, tolerance)
        if contact is None:
            continue
        node, back = len(walls), len(leaves)
        parts = cut(body, contact.frame.plane, node, tolerance.rounding)
        if parts[0] is None or parts[1] is None:
            raise AssertionError("a split that was accepted has two sides")
        if leaf in parent:
            at, side = parent[leaf]
            children[at][side] = node
        children.append([-2 - leaf, -2 - back])
        parent[leaf], parent[back] = (node, 0), (node, 1)
        walls.append(_plane(contact, structure))
        leaves[leaf] = parts[0]
        leaves.append(parts[1])
        stale.update([node, *(tag for tag in body.tags if tag >= 0)])
        waiting += [back, leaf]
    if not stale:
        return tree, portals, reached
    tree = replace(
        tree,
        walls=tuple(walls),
        children=np.array(children, dtype=np.int32).reshape(-1, 2),
        leaves=tuple(leaves),
    )
    kept = [portal for portal in portals if portal.node not in stale]
    kept += find_portals(tree, tolerance, sorted(stale))
    added = np.ones(len(leaves) - len(reached), dtype=np.bool_)
    return tree, sorted(kept, key=lambda portal: portal.node), np.append(reached, added)


def _best(
    contacts: Sequence[Contact], body: Polyhedron, options: SubdivideOptions, tolerance: Tolerance
) -> Contact | None:
    """The contact that covers the largest share of a body's section, None if none splits it."""
    deep, radius = max(options.wall_thickness, tolerance.thin), options.walker[0]
    best, most = None, 0.0
    for contact in contacts:
        plane = contact.frame.plane
        reach = body.points @ plane[:3] + plane[3]
        if min(reach.max(), -reach.min()) < deep:
            continue
        outline = section(body, plane, tolerance.rounding)
        if len(outline) < 3:
            continue
        region = shapely.polygons(contact.frame.to_plane(outline))
        shape = intersection(np.array([contact.shape]), np.array([region]), tolerance.grid)[0]
        share = round(float(shapely.area(shape) / shapely.area(region)), _DIGITS)
        if share > most and not shapely.is_empty(buffer(shape, -radius, join_style="mitre")):
            best, most = contact, share
    return best


def _plane(contact: Contact, structure: Structure) -> WallPlane:
    """The plane of a contact, and the structure that blocks in it."""
    plane = contact.frame.plane
    near: Ints = structure.nearby.between(
        plane, -structure.tolerance.plane, structure.tolerance.plane
    )
    blocking = structure.united(contact.frame, near[structure.lie_in(plane, near)])
    return WallPlane(contact.frame, contact.shape, blocking)
