"""Portals: the part of the boundary between two leaves that no wall covers.

For every BSP plane the opening is the plane's cross-section less everything opaque that lies in
it. Cracks, parts of the opening narrower than the hairline tolerance, are no openings; whatever is
wider is kept, down to the square millimetre. The faces that leaves in front of the plane
and leaves behind it have in that plane are intersected pairwise and with the opening; each
connected piece is a portal, replaced by its convex hull where it is not convex. A portal is never
shrunk: what is missing from a PVS is a bug, what is too much is a cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.bsp import Tree
from ptmtools.cells.planar import Geometry, difference, intersection, union, without_cracks
from ptmtools.cells.rejoin import Rejoined
from ptmtools.cells.structure import WallPlane
from ptmtools.tolerance import Tolerance


@dataclass(frozen=True)
class Portals:
    """Openings between leaves of a `Tree`.

    Attributes
    ----------
    nodes: (K,) the node whose plane it lies in, ascending.
    leaves: (K, 2) the leaf behind and the leaf in front of the plane.
    planes: (K, 4), normals pointing into ``leaves[:, 1]``.
    polygons: (n, 3) each, convex, counter-clockwise seen against the normal.
    areas: (K,) m² open, before hulls.
    """

    nodes: NDArray[np.int64]
    leaves: NDArray[np.int32]
    planes: NDArray[np.float64]
    polygons: tuple[NDArray[np.float64], ...]
    areas: NDArray[np.float64]

    def among(self, keep: NDArray[np.bool_], rename: NDArray[np.int32]) -> Portals:
        """Only the portals between kept leaves, with leaves renamed."""
        kept = np.flatnonzero(keep[self.leaves[:, 0]] & keep[self.leaves[:, 1]])
        return Portals(
            self.nodes[kept],
            rename[self.leaves[kept]].astype(np.int32).reshape(-1, 2),
            self.planes[kept].reshape(-1, 4),
            tuple(self.polygons[k] for k in kept),
            self.areas[kept],
        )


def find_portals(
    tree: Tree, tolerance: Tolerance, within: NDArray[np.bool_] | None = None
) -> Portals:
    """All openings between the leaves of a tree, in the order of its nodes; only those in nodes of
    which ``within``, (N,), is true if it is given."""
    faces = _faces_by_node(tree)
    nodes: list[int] = []
    leaves: list[tuple[int, int]] = []
    planes: list[NDArray[np.float64]] = []
    polygons: list[NDArray[np.float64]] = []
    areas: list[float] = []
    for node, wall in enumerate(tree.walls):
        if within is not None and not within[node]:
            continue
        for back, front, flat, area in _open_pieces(faces[node], wall, tolerance):
            nodes.append(node)
            leaves.append((back, front))
            planes.append(tree.planes[node])
            polygons.append(wall.frame.to_space(flat))
            areas.append(area)
    return Portals(
        np.array(nodes, dtype=np.int64),
        np.array(leaves, dtype=np.int32).reshape(-1, 2),
        np.array(planes).reshape(-1, 4),
        tuple(polygons),
        np.array(areas),
    )


def portals_rejoined(
    portals: Portals, before: Tree, joint: Rejoined, tolerance: Tolerance
) -> Portals:
    """`find_portals` of a rejoined tree, with the ``portals`` of the tree ``before`` in every plane
    in which no leaf has changed."""
    changed = np.bincount(joint.leaf)[joint.leaf] > 1
    stale = joint.node < 0
    for leaf in np.flatnonzero(changed).tolist():
        stale[[tag for tag in before.leaves[leaf].tags if tag >= 0]] = True
    again = np.zeros(len(joint.tree.planes), dtype=bool)
    again[joint.node[stale & (joint.node >= 0)]] = True
    fresh = find_portals(joint.tree, tolerance, again)
    kept = np.flatnonzero(~stale[portals.nodes])
    nodes = np.concatenate([joint.node[portals.nodes[kept]], fresh.nodes])
    order = np.argsort(nodes, kind="stable")
    polygons = [portals.polygons[k] for k in kept] + list(fresh.polygons)
    return Portals(
        nodes[order],
        np.concatenate([joint.leaf[portals.leaves[kept]], fresh.leaves])[order].astype(np.int32),
        np.concatenate([portals.planes[kept], fresh.planes])[order],
        tuple(polygons[k] for k in order),
        np.concatenate([portals.areas[kept], fresh.areas])[order],
    )


_Face = tuple[int, NDArray[np.float64]]


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


def _open_pieces(
    faces: tuple[list[_Face], list[_Face]], wall: WallPlane, tolerance: Tolerance
) -> list[tuple[int, int, NDArray[np.float64], float]]:
    """(back leaf, front leaf, hull polygon in the plane, open area) of one node's openings."""
    import shapely

    if not faces[0] or not faces[1]:
        return []
    ahead = shapely.polygons([shapely.linearrings(wall.frame.to_plane(p)) for _, p in faces[0]])
    behind = shapely.polygons([shapely.linearrings(wall.frame.to_plane(p)) for _, p in faces[1]])
    tree = shapely.STRtree(ahead)
    j, i = tree.query(behind, predicate="intersects")
    order = np.lexsort((i, j))
    j, i = j[order], i[order]
    shared = intersection(ahead[i], behind[j], tolerance.grid)
    wide = shapely.area(shared) > 0
    i, j, shared = i[wide], j[wide], shared[wide]
    if len(shared) == 0:
        return []
    opening = without_cracks(
        difference(union(shared, tolerance.grid), wall.blocking, tolerance.grid),
        tolerance.hairline,
        tolerance.grid,
    )
    if shapely.is_empty(opening):
        return []
    pieces = intersection(shared, opening, tolerance.grid)
    found = []
    for a, b, piece in zip(i.tolist(), j.tolist(), pieces, strict=True):
        for part in shapely.get_parts(piece):
            if not _wider_than(part, tolerance.plane):
                continue
            hull = shapely.orient_polygons(shapely.convex_hull(part))
            hull = shapely.get_coordinates(hull)[:-1]
            found.append((faces[1][b][0], faces[0][a][0], hull, float(shapely.area(part))))
    return found


def _wider_than(part: Geometry, width: float) -> bool:
    """Whether a disc of the given diameter fits into a polygon somewhere."""
    import shapely

    return not shapely.is_empty(shapely.buffer(part, -width / 2, join_style="mitre"))
