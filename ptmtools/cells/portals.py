"""Portals: the part of the boundary between two leaves that no wall covers.

For every BSP plane the opening is the plane's cross-section less everything opaque that lies in
it. Cracks, parts of the opening narrower than the hairline tolerance, are no openings; whatever is
wider is kept, down to the square millimetre. The faces that leaves in front of the plane
and leaves behind it have in that plane are intersected pairwise and with the opening; each
connected piece is a portal, replaced by its convex hull where it is not convex. A portal is never
shrunk: what is missing from a PVS is a bug, what is too much is a cost.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import shapely

from ptmtools.arrays import Floats
from ptmtools.cells.bsp import Tree
from ptmtools.cells.planar import Geometry, intersection, left_open, union
from ptmtools.cells.rejoin import Rejoined
from ptmtools.tolerance import Tolerance


class Portal(NamedTuple):
    """An opening between two leaves of a `Tree`."""

    node: int  # whose plane it lies in
    leaves: tuple[int, int]  # behind and in front of the plane
    polygon: Floats  # (n, 3) convex, counter-clockwise seen against the normal
    area: float  # m² open, before its hull was taken


def find_portals(
    tree: Tree, tolerance: Tolerance, nodes: Iterable[int] | None = None
) -> list[Portal]:
    """All openings between the leaves of a tree, in the order of its nodes, or of these ``nodes``
    if they are given."""
    faces = _faces_by_node(tree)
    nodes = range(len(faces)) if nodes is None else nodes
    return [portal for node in nodes for portal in _openings(node, *faces[node], tree, tolerance)]


def portals_rejoined(
    portals: list[Portal], before: Tree, joint: Rejoined, tolerance: Tolerance
) -> list[Portal]:
    """`find_portals` of a rejoined tree, with the ``portals`` of the tree ``before`` in every plane
    in which no leaf has changed."""
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
    fresh = find_portals(joint.tree, tolerance, sorted({node[one] for one in stale} - {-1}))
    return sorted(kept + fresh, key=lambda portal: portal.node)


_Face = tuple[int, Floats]


def _faces_by_node(tree: Tree) -> list[tuple[list[_Face], list[_Face]]]:
    """For every node the faces (leaf, points) in its plane: of leaves in front, and behind."""
    found: list[tuple[list[_Face], list[_Face]]] = [([], []) for _ in tree.planes]
    for leaf, body in enumerate(tree.leaves):
        centre = body.points.mean(axis=0)
        for loop, tag in zip(body.faces, body.tags, strict=True):
            if tag >= 0:
                plane = tree.planes[tag]
                side = 0 if centre @ plane[:3] + plane[3] > 0 else 1
                found[tag][side].append((leaf, body.points[loop]))
    return found


def _openings(
    node: int, ahead: list[_Face], behind: list[_Face], tree: Tree, tolerance: Tolerance
) -> Iterator[Portal]:
    """The portals in the plane of one node, between faces ahead of it and behind it."""
    if not ahead or not behind:
        return
    wall = tree.walls[node]
    one, other = (
        shapely.polygons([shapely.linearrings(wall.frame.to_plane(points)) for _, points in faces])
        for faces in (ahead, behind)
    )
    j, i = shapely.STRtree(one).query(other, predicate="intersects")
    order = np.lexsort((i, j))
    j, i = j[order], i[order]
    shared = intersection(one[i], other[j], tolerance.grid)
    wide = shapely.area(shared) > 0
    i, j, shared = i[wide], j[wide], shared[wide]
    if len(shared) == 0:
        return
    opening = left_open(union(shared, tolerance.grid), wall.blocking, tolerance)
    if shapely.is_empty(opening):
        return
    pieces = intersection(shared, opening, tolerance.grid)
    for a, b, piece in zip(i.tolist(), j.tolist(), pieces, strict=True):
        for part in shapely.get_parts(piece):
            if _wider_than(part, tolerance.plane):
                hull = shapely.orient_polygons(shapely.convex_hull(part))
                polygon = wall.frame.to_space(shapely.get_coordinates(hull)[:-1])
                leaves = behind[b][0], ahead[a][0]
                yield Portal(node, leaves, polygon, float(shapely.area(part)))


def _wider_than(part: Geometry, width: float) -> bool:
    """Whether a disc of the given diameter fits into a polygon somewhere."""
    return not shapely.is_empty(shapely.buffer(part, -width / 2, join_style="mitre"))
