"""Which sample points are usable: not inside solid matter, not against a surface.

A point too near to a surface sees hardly anything else, and one inside a statue sees the
statue's inside; either would spoil the average (paper §5 leaves it open).

*Near* is exact: the distance from the point to the nearest triangle.

*Inside* is a question about closed surfaces only. The scene's triangles are welded by position
and grouped by shared edges; a group is a *body* if it is closed (every edge is used an even number
of times, so that the parity of the crossings along a ray does not depend on the ray), unless

- most of its area lies in cell boundaries: then it is structure, and the subdivision has already
  decided what is behind it (the mesh of a whole building is one group as often as not), or
- it is wound consistently inwards: a shell that is meant to be seen from within.

A point is in matter if it is inside a body. So winding need not be right for a statue, a table
top or a leaf of paper has no inside, a wall modelled twice with opposite winding is closed and
empty, and an open surface bounds nothing. Rejected: the parity of all crossings (each open or
single sheet turns it over), and the generalised winding number (wrong wherever faces are wound
at random, as in most OBJ files).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.cells.nearby import Nearby
from ptmtools.scene.model import Scene

#: Directions of the parity rays. Fixed, in no simple relation to each other or to the axes, so
#: that an edge which one of them grazes is missed by the others; the majority counts.
DIRECTIONS = np.array([[0.683, 0.577, 0.448], [-0.371, 0.819, -0.437], [0.291, -0.463, -0.837]])


@dataclass(frozen=True)
class Body:
    """A closed surface with an inside: its (n, 3, 3) corners and (2, 3) bounding box, metres."""

    corners: NDArray[np.float64]
    box: NDArray[np.float64]

    def contains(self, point: NDArray[np.float64]) -> bool:
        """Whether a (3,) point in the box is inside: odd crossings along most of the rays."""
        from ptmtools.coverage.clearance.kernels import crossings

        odd = sum(crossings(point, self.corners, d) % 2 for d in DIRECTIONS)
        return 2 * odd > len(DIRECTIONS)


def bodies(scene: Scene, cells: Cells) -> list[Body]:
    """The closed surfaces of a scene that have an inside, in the order of their triangles."""
    if len(scene.triangles) == 0:
        return []
    _, weld = np.unique(scene.points + 0.0, axis=0, return_inverse=True)  # -0 is 0
    corner = weld.reshape(-1)[scene.triangles]
    group = edge_groups(corner)
    all_corners = scene.corners
    area = areas(all_corners)
    in_boundary = boundary_area(scene, cells)
    order = np.argsort(group, kind="stable")
    found = []
    for members in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        balance = winding_balance(corner[members])
        if balance is None or 2 * in_boundary[members].sum() > area[members].sum():
            continue
        corners = all_corners[members]
        box = np.array([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))])
        inwards = balance and signed_volume(corners - box.mean(axis=0)) < 0
        if not inwards:
            found.append(Body(corners, box))
    return found


def edge_groups(corner: NDArray[np.int64]) -> NDArray[np.int64]:
    """(T,) for each (T, 3) triangle the least index of the triangles that it hangs together with
    through shared edges."""
    count = len(corner)
    edges = np.sort(corner[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    owner = np.repeat(np.arange(count), 3)
    group = np.arange(count)
    while True:
        least = np.full(int(edge.max()) + 1, count)
        np.minimum.at(least, edge, group[owner])
        better = np.minimum(group, least[edge].reshape(-1, 3).min(axis=1))
        better = better[better]  # pointer jumping: long strips need few rounds
        if np.array_equal(better, group):
            return group
        group = better


def winding_balance(corner: NDArray[np.int64]) -> bool | None:
    """Whether a group of (n, 3) triangles is consistently wound; None if it is not closed."""
    directed = corner[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    forward = directed[:, 0] < directed[:, 1]
    _, edge = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    if np.any(np.bincount(edge) % 2):
        return None
    return bool(np.all(np.bincount(edge, weights=np.where(forward, 1.0, -1.0)) == 0))


def signed_volume(corners: NDArray[np.float64]) -> float:
    """Volume enclosed by a closed surface of (n, 3, 3) corners, positive if wound outwards."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) areas of (n, 3, 3) triangles, m²."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(normal, axis=1) / 2)


def boundary_area(scene: Scene, cells: Cells) -> NDArray[np.float64]:
    """(T,) the area of each of the scene's triangles that lies in boundaries of cells, m²."""
    lying = cells.triangle_cell[:, 0] != cells.triangle_cell[:, 1]
    piece = areas(cells.vertex[cells.triangle[lying]])
    total = np.zeros(len(scene.triangles))
    np.add.at(total, cells.triangle_source[lying], piece)
    return total


@dataclass(frozen=True)
class Surroundings:
    """What a sample point has to keep clear of.

    Attributes
    ----------
    corners: (T, 3, 3) all surfaces, metres.
    nearby: finds those near a box.
    bodies: the closed ones with an inside.
    boxes: (B, 2, 3) the bounding boxes of the bodies.
    """

    corners: NDArray[np.float64]
    nearby: Nearby
    bodies: tuple[Body, ...]
    boxes: NDArray[np.float64]

    @staticmethod
    def of(scene: Scene, cells: Cells) -> Surroundings:
        """The surroundings in a subdivided scene."""
        corners = scene.corners
        found = tuple(bodies(scene, cells))
        boxes = np.array([body.box for body in found]).reshape(-1, 2, 3)
        return Surroundings(corners, Nearby(corners, 0.0), found, boxes)

    def in_matter(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(n,) whether each of the (n, 3) points is inside a body."""
        inside = np.zeros(len(points), dtype=np.bool_)
        if len(points) == 0:
            return inside
        low, high = points.min(axis=0), points.max(axis=0)
        near = np.all((self.boxes[:, 0] <= high) & (low <= self.boxes[:, 1]), axis=1)
        for body in np.flatnonzero(near):
            lower, upper = self.boxes[body]
            boxed = ~inside & np.all((lower <= points) & (points <= upper), axis=1)
            for i in np.flatnonzero(boxed):
                inside[i] = self.bodies[body].contains(points[i])
        return inside

    def clearance(self, points: NDArray[np.float64], enough: float) -> NDArray[np.float64]:
        """(n,) distance in metres from each of the (n, 3) points to the nearest surface, at most
        ``enough``."""
        from ptmtools.coverage.clearance.kernels import clearances

        found = np.full(len(points), enough)
        if len(points):
            low, high = points.min(axis=0) - enough, points.max(axis=0) + enough
            near = self.corners[self.nearby.meeting(low, high)]
            order = np.argsort(points[:, 0], kind="stable")
            ascending = np.full(len(points), enough)
            clearances(np.ascontiguousarray(points[order]), near, enough, ascending)
            found[order] = ascending
        return found
