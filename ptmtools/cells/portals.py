"""Portals, the parts of the boundaries between leaves that no wall covers, and their flood.

A **passage** is a portal that a drawn door leaf covers: visitors pass, sight does not.

For every BSP plane the opening is the plane's cross-section less everything opaque that lies in it,
without cracks narrower than a hairline. The faces that leaves on both sides have in that plane are
intersected pairwise and with the opening; each connected piece is a portal, replaced by its convex
hull where it is not convex, and divided into triangles where the hull would be mostly door leaf, as
the gap around one. A portal is never shrunk: a cell missing from a PVS is a bug, an extra one
is a cost.

The flood starts from the viewpoints, else from the largest leaf with floor that is no solid and
does not touch the root box. Caps that separate nothing after the flood are removed; a rejoined leaf
is reached as a whole or not at all, so the flood need not run again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import NamedTuple

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, cross, normals
from ptmtools.cells.bsp import Tree
from ptmtools.cells.options import Walker
from ptmtools.cells.planar import (
    Geometry,
    buffer,
    delaunay,
    difference,
    intersection,
    open_part,
    union,
)
from ptmtools.cells.planes import BOX_FACE, Polyhedron
from ptmtools.cells.structure import Structure
from ptmtools.tolerance import TIE_SHARE, Tolerance, rank


@dataclass(frozen=True)
class Rejoined:
    """A tree without caps that separate nothing, and the new numbers of its leaves and nodes."""

    tree: Tree
    leaf: Ints  # (L,) the new leaf that each is or is part of; ascending but for parts
    node: Ints  # (N,) the new node that each is, or -1


def rejoin_caps(tree: Tree, group: Ints) -> Rejoined:
    """The tree without the caps that separate nothing; ``group``: (L,) the connected group of each
    leaf that is kept, -1 for others. Planes of `Tree.hung` leaves hide, and stay."""
    bodies, children = list(tree.leaves), tree.children.copy()
    part_of = np.arange(len(bodies))
    kept = np.ones(len(children), dtype=bool)
    for node in sorted(tree.capped.keys() - tree.hung, reverse=True):  # parts before wholes
        first, second = sorted(-2 - children[node])
        if first >= 0 and group[first] == group[second]:
            bodies[first] = tree.capped[node]
            part_of[part_of == second] = first
            children[children == node] = -2 - first
            kept[node] = False
    wholes, leaf = np.unique(part_of, return_inverse=True)
    renumber = np.where(kept, np.cumsum(kept) - 1, -1)
    children = children[kept]
    inner, outer = np.maximum(children, 0), -2 - np.minimum(children, -2)
    return Rejoined(
        replace(
            tree,
            walls=tuple(wall for wall, keeps in zip(tree.walls, kept, strict=True) if keeps),
            children=np.where(children >= 0, renumber[inner], -2 - leaf[outer]).astype(np.int32),
            leaves=tuple(_rename_tags(bodies[whole], renumber) for whole in wholes),
            capped={int(renumber[n]): body for n, body in tree.capped.items() if kept[n]},
            hung=frozenset(renumber[sorted(tree.hung)].tolist()),
        ),
        leaf,
        renumber,
    )


def _rename_tags(body: Polyhedron, renumber: Ints) -> Polyhedron:
    return replace(body, tags=tuple(int(renumber[t]) if t >= 0 else t for t in body.tags))


class Portal(NamedTuple):
    """An opening between two leaves of a `Tree`."""

    node: int  # the node in whose plane it lies
    leaves: tuple[int, int]  # behind and in front of the plane
    polygon: Floats  # (n, 3) convex, counter-clockwise seen against the normal
    area: float  # m² open, of the piece before its hull
    passage: bool = False  # whether a door leaf covers it


def ends_of(portals: Sequence[Portal]) -> Ints:
    """(n, 2) the leaves of portals."""
    return np.array([portal.leaves for portal in portals], dtype=np.int64).reshape(-1, 2)


def find_portals(
    tree: Tree, tolerance: Tolerance, nodes: Iterable[int] | None = None
) -> list[Portal]:
    """All openings between the leaves of a tree, in the order of its nodes, or of ``nodes``."""
    faces = _faces_by_node(tree)
    nodes = range(len(faces)) if nodes is None else nodes
    return [portal for node in nodes for portal in _openings(node, *faces[node], tree, tolerance)]


def update_portals(
    portals: list[Portal], before: Tree, joint: Rejoined, tolerance: Tolerance
) -> list[Portal]:
    """`find_portals` of a rejoined tree; planes in which no leaf changed keep the ``portals`` of
    the tree ``before``."""
    leaf, node = joint.leaf.tolist(), joint.node.tolist()
    changed = np.flatnonzero(np.bincount(joint.leaf)[joint.leaf] > 1)
    stale = {tag for whole in changed for tag in before.leaves[whole].tags if tag >= 0}
    kept = [
        portal._replace(
            node=node[portal.node], leaves=(leaf[portal.leaves[0]], leaf[portal.leaves[1]])
        )
        for portal in portals
        if portal.node not in stale and node[portal.node] >= 0
    ]
    fresh = find_portals(joint.tree, tolerance, sorted({node[number] for number in stale} - {-1}))
    return sorted(kept + fresh, key=lambda portal: portal.node)


_Face = tuple[int, Floats]


def _faces_by_node(tree: Tree) -> list[tuple[list[_Face], list[_Face]]]:
    """For every node the faces (leaf, points) in its plane: of leaves in front, and behind."""
    result: list[tuple[list[_Face], list[_Face]]] = [([], []) for _ in tree.planes]
    for leaf, body in enumerate(tree.leaves):
        centre = body.points.mean(axis=0)
        for loop, tag in zip(body.faces, body.tags, strict=True):
            if tag >= 0:
                plane = tree.planes[tag]
                side = 0 if centre @ plane[:3] + plane[3] > 0 else 1
                result[tag][side].append((leaf, body.points[loop]))
    return result


def _openings(
    node: int, ahead: list[_Face], behind: list[_Face], tree: Tree, tolerance: Tolerance
) -> Iterator[Portal]:
    """The portals in the plane of one node, between faces ahead of it and behind it."""
    if not ahead or not behind:
        return
    wall = tree.walls[node]
    hung = node in tree.hung or wall.barring is not None
    front_faces, back_faces = (
        shapely.polygons([shapely.linearrings(wall.frame.to_plane(points)) for _, points in faces])
        for faces in (ahead, behind)
    )
    j, i = shapely.STRtree(front_faces).query(back_faces, predicate="intersects")
    order = np.lexsort((i, j))
    j, i = j[order], i[order]
    shared = intersection(front_faces[i], back_faces[j], tolerance.grid, more=True)
    wide = shapely.area(shared) > 0
    i, j, shared = i[wide], j[wide], shared[wide]
    if len(shared) == 0:
        return
    every = shared[0] if len(shared) == 1 else union(shared, tolerance.grid, more=True)
    if wall.barring is None and shapely.covered_by(every, wall.blocking):
        return
    free = shapely.disjoint(wall.blocking, every) and _wider_than(every, tolerance.hairline)
    opening = every if free else open_part(every, wall.blocking, tolerance)
    openings = [(opening, False)]
    if wall.barring is not None:
        way = open_part(every, wall.barring, tolerance)
        openings.append((difference(way, opening, tolerance.grid), True))
    for shape, passage in openings:
        if shapely.is_empty(shape):
            continue
        pieces = shared
        if len(shared) > 1:
            pieces = intersection(shared, shape, tolerance.grid, more=True)
        elif shape is not every:
            pieces = [shape]
        for a, b, piece in zip(i.tolist(), j.tolist(), pieces, strict=True):
            for part in shapely.get_parts(piece):
                if not _wider_than(part, tolerance.plane):
                    continue
                leaves = behind[b][0], ahead[a][0]
                for hull, area in _hulls(part, hung and not passage):
                    polygon = wall.frame.to_space(shapely.get_coordinates(hull)[:-1])
                    yield Portal(node, leaves, polygon, area, passage)


#: An opening beside a door leaf is divided if it is less than this share of its convex hull.
_SPARSE = 0.25


def _hulls(part: Geometry, hung: bool) -> Iterator[tuple[Geometry, float]]:
    """Convex polygons, counter-clockwise, that cover an opening, in the plane of a door leaf if it
    is ``hung``, and the open area of each, m²."""
    hull, area = shapely.orient_polygons(shapely.convex_hull(part)), float(shapely.area(part))
    triangles = np.array([], dtype=object)
    if hung and area < _SPARSE * float(shapely.area(hull)):
        triangles = shapely.get_parts(delaunay(np.array([part], dtype=object)))
    if shapely.area(triangles).sum() < (1 - TIE_SHARE) * area:
        yield hull, area
        return
    for triangle in shapely.orient_polygons(triangles):
        yield triangle, float(shapely.area(triangle))


def _wider_than(part: Geometry, width: float) -> bool:
    """Whether a disc of the given diameter fits into a polygon somewhere."""
    return not shapely.is_empty(buffer(part, -width / 2, join_style="mitre"))


#: A surface whose normal leans less than this from the vertical is walkable (cosine of 45°).
FLOOR_COSINE = 0.7


def flood(leaves: int, portals: list[Portal], start: tuple[int, ...]) -> Bools:
    """(L,) which of L = ``leaves`` are reached through the portals from the leaves ``start``."""
    ends, reached, count = ends_of(portals), np.zeros(leaves, dtype=bool), 0
    reached[list(start)] = True
    while count < (count := int(reached.sum())):
        reached[ends[reached[ends].any(axis=1)]] = True
    return reached


def at_box(tree: Tree) -> Bools:
    """(L,) which leaves touch the root box."""
    return np.array([BOX_FACE in body.tags for body in tree.leaves], dtype=bool)


def largest_leaf(
    tree: Tree, allowed: Bools, structure: Structure, walker: Walker
) -> tuple[tuple[int, ...], bool]:
    """The largest of the (L,) allowed leaves that has floor below its middle, else the largest, as
    a tuple of one, and whether it may be the inside of a solid; () if none is allowed. Leaves too
    thin for a walker, such as the hollow of a wall, count only if all are. Where faces are turned
    out of solids, leaves whose walls and floor face into them come first, which excludes the inside
    of the ground or of a thick wall."""
    corners = structure.corners
    roomy = np.array([body.width >= 2 * walker.radius for body in tree.leaves])
    choice = np.flatnonzero(allowed & roomy if roomy.any() else allowed)
    order = choice[rank(np.array([tree.leaves[leaf].volume for leaf in choice]))].tolist()
    middle = {leaf: tree.leaves[leaf].points.mean(axis=0) for leaf in order}
    hollow: Iterable[int] = ()
    outwards = bool(order) and _outwards(corners)
    if outwards:
        around = structure.rays
        floored = around.have_floor(np.array(list(middle.values())))
        hollow = (leaf for leaf in compress(order, floored) if not around.solid(middle[leaf][None]))
    for leaves, solid in ((hollow, False), (order, outwards)):
        for leaf in leaves:
            if np.any(plumb(middle[leaf], corners) < 0):
                return (leaf,), solid
    return tuple(order[:1]), outwards


def _outwards(corners: Floats) -> bool:
    """Whether (T, 3, 3) triangles face out of the enclosed volume: those of solids do, those of
    walls without thickness face into the rooms."""
    if not len(corners):
        return False
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    return bool(np.einsum("ij,ij->", a, cross(b, c)) > 0)


def plumb(eye: Floats, corners: Floats) -> Floats:
    """Heights above ``eye`` (metres) at which a plumb line meets walkable triangles."""
    flat = corners[:, :, [0, 2]] - eye[[0, 2]]
    turn = flat[:, [1, 2, 0]]
    side = flat[:, :, 0] * turn[:, :, 1] - flat[:, :, 1] * turn[:, :, 0]
    hit = np.flatnonzero(np.all(side >= 0, axis=1) | np.all(side <= 0, axis=1))
    p = corners[hit]
    normal = normals(p)
    level = np.abs(normal[:, 1]) >= FLOOR_COSINE * np.linalg.norm(normal, axis=1)
    level &= normal[:, 1] != 0
    p, normal = p[level], normal[level]
    heights: Floats = np.einsum("ij,ij->i", normal, p[:, 0] - eye) / normal[:, 1]
    return heights
