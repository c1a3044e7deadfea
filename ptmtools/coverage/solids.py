"""Decides which sample points are usable: those outside solids and clear of surfaces.

*Near* is exact: the distance from the point to the nearest triangle.

*Inside* is defined for closed surfaces only. The scene's triangles are welded by position
and grouped by shared edges; a group is a *solid* if it is closed (every edge is used an even number
of times, so that the parity of the crossings along a ray does not depend on the ray), unless

- most of its area lies in cell boundaries, or it goes around a cell and contains nearly all places
  there: then it is structure, and the subdivision has already decided what lies behind it (the
  mesh of a whole building is often one group), or
- its faces consistently point inwards: a shell that is meant to be seen from within.

Rejected: the parity of all crossings (each open or single sheet inverts it), and the generalised
winding number (wrong wherever faces are oriented at random, as in most OBJ files).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.cells.model import Cells
from ptmtools.cells.planes import bounds
from ptmtools.cells.search import Nearby, connect
from ptmtools.coverage.placement import CellVolume
from ptmtools.scene.model import Scene

#: Directions of the parity rays. Fixed, in no simple relation to each other or to the axes, so
#: that an edge which one of them grazes is missed by the others; the majority counts.
DIRECTIONS = np.array([[0.683, 0.577, 0.448], [-0.371, 0.819, -0.437], [0.291, -0.463, -0.837]])

#: Places in a cell that tell whether it is within a solid, and the share of them inside: another
#: solid may hold the rest.
_TESTS, _MOST = 16, 0.75


def _frames() -> Floats:
    forward = DIRECTIONS / np.sqrt((DIRECTIONS**2).sum(axis=1, keepdims=True))
    right = np.cross(forward, [1.0, 0.0, 0.0])
    right /= np.sqrt((right**2).sum(axis=1, keepdims=True))
    return np.stack([right, np.cross(forward, right), forward], axis=1)


#: (3, 3, 3) for each a rotation, whose rows are the new axes, in which it runs along +z.
FRAMES = _frames()


def solids(scene: Scene, cells: Cells) -> list[Floats]:
    """The (n, 3, 3) corners of each closed surface of a scene that has an inside, in the order of
    their triangles."""
    if len(scene.triangles) == 0:
        return []
    _, weld = np.unique(scene.points + 0.0, axis=0, return_inverse=True)  # -0 is 0
    corner = weld.reshape(-1)[scene.triangles]
    edge, forward = edges(corner)
    group = edge_groups(edge)
    closed, balanced = closed_and_oriented(edge, forward, group)
    all_corners = scene.corners
    count = len(corner)
    area = np.bincount(group, areas(all_corners), count)
    in_boundary = np.bincount(group, boundary_area(scene, cells), count)
    chosen = closed & (2 * in_boundary <= area)
    order = np.argsort(group, kind="stable")
    order = order[chosen[group[order]]]
    result = []
    for members in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        if not len(members):
            continue
        corners = all_corners[members]
        middle = np.mean(bounds(corners), axis=0)
        inwards = balanced[group[members[0]]] and signed_volume(corners - middle) < 0
        if not inwards:
            result.append(corners)
    return result


def edges(corner: Ints) -> tuple[Ints, Bools]:
    """For each of the (T, 3) triangles (T, 3) the numbers of its edges, equal for those that share
    both ends, and whether it runs along them towards the corner with the higher number."""
    ends = np.stack([corner, np.roll(corner, -1, axis=1)], axis=2)
    low, high = ends.min(axis=2), ends.max(axis=2)
    _, edge = np.unique(low * (int(corner.max()) + 1) + high, return_inverse=True)
    return edge.reshape(-1, 3), ends[..., 0] < ends[..., 1]


def edge_groups(edge: Ints) -> Ints:
    """(T,) for each triangle, of the (T, 3) ``edges``, the least index of the triangles connected
    to it through shared edges."""
    order = np.argsort(edge, axis=None, kind="stable")
    same = np.flatnonzero(np.diff(edge.reshape(-1)[order]) == 0)
    first, second = order[same] // 3, order[same + 1] // 3
    return connect(len(edge), np.stack([first, second], axis=1))


def closed_and_oriented(edge: Ints, forward: Bools, group: Ints) -> tuple[Bools, Bools]:
    """(T,) whether the group with each number is closed, and whether it is wound consistently, from
    the (T, 3) ``edges`` and their directions; undefined for numbers of no group."""
    used = np.bincount(edge.ravel())
    turned = np.bincount(edge.ravel(), np.where(forward, 1.0, -1.0).ravel())
    closed, balanced = (np.ones(len(edge), dtype=np.bool_) for _ in range(2))
    closed[group[(used[edge] % 2 > 0).any(axis=1)]] = False
    balanced[group[(turned[edge] != 0).any(axis=1)]] = False
    return closed, balanced


def signed_volume(corners: Floats) -> float:
    """Volume enclosed by a closed surface of (n, 3, 3) corners, positive if wound outwards."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def boundary_area(scene: Scene, cells: Cells) -> Floats:
    """(T,) the area of each of the scene's triangles that lies in boundaries of cells, m²."""
    lying = cells.triangle_cell[:, 0] != cells.triangle_cell[:, 1]
    piece = areas(cells.vertex[cells.triangle[lying]])
    return np.bincount(cells.triangle_source[lying], piece, len(scene.triangles)).astype(float)


@dataclass(frozen=True)
class SampleObstacles:
    """The surfaces and solids that a sample point has to keep clear of."""

    corners: Floats  # (T, 3, 3) all surfaces, metres
    nearby: Nearby
    solids: tuple[Floats, ...]  # (n, 3, 3) corners of each closed one with an inside

    @staticmethod
    def from_scene(
        scene: Scene, cells: Cells, volumes: Sequence[CellVolume] | None = None
    ) -> SampleObstacles:
        """The obstacles of a subdivided scene; ``volumes`` are those of its cells."""
        corners, rest = scene.corners, tuple(solids(scene, cells))
        nearby, slack = Nearby(corners, 0.0), scene.tolerance.noise
        outer = np.array([bounds(body) for body in rest]).reshape(-1, 2, 3) + [[-slack], [slack]]
        tests = [
            (points, low, high)
            for volume in volumes or CellVolume.of_cells(cells)
            for low, high in ([] if volume.empty else [bounds(volume.tetrahedra)])
            if ((outer[:, 0] <= low) & (high <= outer[:, 1])).all(axis=1).any()
            and len(points := volume.sobol(0, 4 * _TESTS, 0)[:_TESTS, :3]) == _TESTS
        ]
        while True:
            obstacles = SampleObstacles(corners, nearby, rest)
            shells = set[int]()
            for points, low, high in tests:
                owner = obstacles.solid_of(points)
                solid = int(np.sort(owner)[_TESTS // 2])
                if solid >= 0 and (owner == solid).mean() >= _MOST:
                    least, greatest = bounds(rest[solid])
                    if (least <= low + slack).all() and (high <= greatest + slack).all():
                        shells.add(solid)
            if not shells:
                return obstacles
            rest = tuple(body for n, body in enumerate(rest) if n not in shells)

    def in_solid(self, points: Floats) -> Bools:
        """(n,) whether each of the (n, 3) points is inside a solid."""
        return self.solid_of(points) >= 0

    def solid_of(self, points: Floats) -> Ints:
        """(n,) the first of the solids that contains each of the (n, 3) points, -1 for none."""
        from ptmtools.coverage.kernels import find_solids

        owner = np.full(len(points), -1)
        if self.solids and len(points):
            boxes, begin, corners = self._bodies
            low, high = bounds(points)
            near = np.all((boxes[:, 0] <= high) & (low <= boxes[:, 1]), axis=1)
            turned = np.einsum("ij,fkj->fik", points, FRAMES)
            order = np.argsort(turned[..., 0], axis=1, kind="stable")
            turned = np.take_along_axis(turned, order[..., None], axis=1)
            crossed, rank = np.zeros_like(order), np.argsort(order, axis=1)
            find_solids(
                points, turned, rank, np.flatnonzero(near), boxes, begin, corners, FRAMES, crossed,
                owner,
            )  # fmt: skip
        return owner

    @cached_property
    def _bodies(self) -> tuple[Floats, Ints, Floats]:
        """The boxes of the solids, their first triangles and all corners: see `find_solids`."""
        boxes = np.array([bounds(corners) for corners in self.solids])
        return boxes, np.cumsum([0, *map(len, self.solids)]), np.concatenate(self.solids)

    def clearance(self, points: Floats, enough: float) -> Floats:
        """(n,) distance in metres from each of the (n, 3) points to the nearest surface, at most
        ``enough``."""
        from ptmtools.coverage.kernels import clearances

        result = np.full(len(points), enough)
        if len(points):
            low, high = points.min(axis=0) - enough, points.max(axis=0) + enough
            near = self.corners[self.nearby.meeting(low, high)]
            order, first, end = by_x(points, near, enough)
            ascending = np.full(len(points), enough)
            clearances(points[order], near, first, end, enough, ascending)
            result[order] = ascending
        return result


def by_x(points: Floats, corners: Floats, margin: float) -> tuple[Ints, Ints, Ints]:
    """The order of the (n, 3) points by x, and for each of the (m, 3, 3) triangles the begin and
    end, in that order, of the points within ``margin`` of its extent along x."""
    order = np.argsort(points[:, 0], kind="stable")
    x, along = points[order, 0], corners[:, :, 0]
    first = np.searchsorted(x, along.min(axis=1) - margin)
    return order, first, np.searchsorted(x, along.max(axis=1) + margin, side="right")
