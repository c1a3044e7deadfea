"""Surfaces that hang on a wall or lie before it, such as pictures, screens, boards, radiators and
rugs: they are drawn and occlude, but divide nothing, since no body fits behind them.

A **front** is a polygon before another, larger wall that covers it from nearby and faces it, as the
other side of the same wall does not. Linings and the leaves of cavity walls are as near to another
wall, and so is a floor to the ground below, but large surfaces meet them: walls, floors, ceilings.
Nothing large meets a front, and its edges are free for the most part: beside them the wall behind
it is to be seen from before it. Polygons between a front and its wall are backs, which hang, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.cells.places import shadows
from ptmtools.cells.planar import Geometry, buffer, intersection
from ptmtools.cells.planes import PlaneFrame
from ptmtools.cells.structure import Structure, Surroundings, WallPlane
from ptmtools.tolerance import Tolerance

#: Greatest distance of a hanging from its wall, as a share of the greatest thickness of walls.
_OFF = 0.5
#: A hanging has at most this share of the wall's area, of which this share of its own is before it.
_SMALLER, _COVERED = 0.9, 0.9
#: Planes are parallel to this cosine.
_PARALLEL = 0.9998
#: A triangle is large from this share of the least area of walls on.
_LARGE = 0.25
#: Points along the edge, so far from it, as a share of the greatest distance; at least this share
#: of them see the wall behind, and on the other side nothing nearer than `_ROOM` times it.
_POINTS, _BESIDE, _FREE, _ROOM = 32, 0.2, 0.55, 1.0


@dataclass(frozen=True)
class _Surfaces:
    """The polygons of walls."""

    wall: Ints  # (p,) the number of the plane
    frame: list[PlaneFrame]  # of each
    shape: Geometry  # (p,) in it
    area: Floats  # (p,) m²
    plane: Floats  # (p, 4)

    @staticmethod
    def of_walls(walls: list[WallPlane]) -> _Surfaces:
        shapes = np.array([wall.walls for wall in walls], dtype=object)
        shape, number = shapely.get_parts(shapes, return_index=True)
        frame = [walls[i].frame for i in number]
        plane = np.array([f.plane for f in frame]).reshape(-1, 4)
        return _Surfaces(number, frame, shape, shapely.area(shape), plane)

    def candidates(self, number: int, distance: float) -> Ints:
        """The larger ones in planes parallel to that of one, no farther than a distance."""
        plane, turn = self.plane[number], self.plane[:, :3] @ self.plane[number, :3]
        gap = np.abs(plane[3] - np.sign(turn) * self.plane[:, 3])
        near = (np.abs(turn) > _PARALLEL) & (gap <= 2 * distance)
        near &= (self.area[number] <= _SMALLER * self.area) & (self.wall != self.wall[number])
        return np.flatnonzero(near)

    def outline(self, number: int) -> Floats:
        """(n, 3) the corners of the outer ring of one."""
        ring = shapely.get_exterior_ring(self.shape[number])
        return self.frame[number].to_space(shapely.get_coordinates(ring))

    def way(self, number: int, behind: int) -> tuple[Floats, float]:
        """(3,) the unit vector from one to the plane of another, and the greatest distance, metres;
        0 if it is on both sides of that plane."""
        plane = self.plane[behind]
        height = self.outline(number) @ plane[:3] + plane[3]
        gap = 0.0 if np.ptp(np.sign(height)) else float(np.abs(height).max())
        return -np.sign(height[0]) * plane[:3], gap

    def covers(self, number: int, covered: int, tolerance: Tolerance) -> bool:
        """Whether one is before or behind most of another, without an opening there."""
        flat = shapely.polygons(self.frame[number].to_plane(self.outline(covered)))
        hull = shapely.convex_hull(self.shape[number])
        common, within = (
            float(shapely.area(intersection(flat, shape, tolerance.grid)))
            for shape in (self.shape[number], hull)
        )
        closed = within - common <= tolerance.hairline**2
        return closed and common >= _COVERED * float(shapely.area(flat))

    def meets_large(self, structure: Structure, number: int, least: float, distance: float) -> bool:
        """Whether a triangle of at least this area, m², that reaches farther than a distance from
        the plane of one meets it there."""
        slack, plane = structure.tolerance.plane, self.plane[number]
        near = structure.nearby.find_between(plane, -slack, slack)
        corners = structure.corners[near[structure.areas[near] >= least]]
        height = corners @ plane[:3] + plane[3]
        reaching = np.abs(height).max(axis=1) > distance
        corners, height = corners[reaching], height[reaching]
        rows, points = shadows(
            self.frame[number].to_plane(corners), height, (-slack, slack), np.arange(len(corners))
        )
        return bool(len(rows)) and bool(shapely.dwithin(self.shape[number], points, slack).any())

    def facing(self, structure: Structure, number: int) -> Floats:
        """(3,) the normal of most triangles in one; 0 if they face both ways."""
        flat = structure.corners[structure.find_in(self.plane[number])]
        middle = self.frame[number].to_plane(flat.mean(axis=1))
        facing = normals(flat[shapely.intersects_xy(self.shape[number], *middle.T)])
        total: Floats = facing.sum(axis=0)
        one_way = 2 * np.linalg.norm(total) > np.linalg.norm(facing, axis=1).sum()
        return total if one_way else np.zeros(3)

    def edge_points(self, number: int, distance: float) -> Floats:
        """(n, 3) points spread along the edge of one, at a distance outside."""
        hull = shapely.convex_hull(self.shape[number])
        ring = shapely.get_exterior_ring(buffer(hull, distance, quad_segs=1))
        shares = (np.arange(_POINTS) + 0.5) / _POINTS
        points = shapely.line_interpolate_point(ring, shares, normalized=True)
        return self.frame[number].to_space(shapely.get_coordinates(points))


def without_hangings(
    walls: list[WallPlane], structure: Structure, wall_area: float, wall_thickness: float
) -> tuple[list[WallPlane], int]:
    """The walls without the polygons that hang on others, and the number of these; see the module's
    head."""
    surfaces, distance = _Surfaces.of_walls(walls), _OFF * wall_thickness
    backs: list[tuple[int, int]] = []
    fronts: dict[int, list[int]] = {}  # of hangings, by the wall that they are before
    for number in range(len(surfaces.wall)):
        for behind in surfaces.candidates(number, distance).tolist():
            toward, gap = surfaces.way(number, behind)
            if not 0 < gap <= distance or not surfaces.covers(behind, number, structure.tolerance):
                continue
            if surfaces.facing(structure, behind) @ toward >= 0:
                continue
            if surfaces.facing(structure, number) @ toward > 0:
                backs.append((number, behind))
                continue
            beside = surfaces.edge_points(number, _BESIDE * distance)
            if not surfaces.meets_large(
                structure, number, _LARGE * wall_area, distance
            ) and _is_free(structure.rays, beside, toward, gap, distance):
                fronts.setdefault(behind, []).append(number)
    hanging = np.zeros(len(surfaces.wall), dtype=np.bool_)
    hanging[[number for numbers in fronts.values() for number in numbers]] = True
    for number, behind in backs:
        gap = surfaces.way(number, behind)[1]
        hanging[number] |= any(
            surfaces.way(front, behind)[1] > gap
            and surfaces.covers(front, number, structure.tolerance)
            for front in fronts.get(behind, ())
        )
    return _leave_out(walls, surfaces, hanging), int(hanging.sum())


def _is_free(
    around: Surroundings, points: Floats, toward: Floats, gap: float, distance: float
) -> bool:
    """Whether most of (n, 3) points see the front of a wall behind, ``toward`` it at a ``gap``, and
    nothing near on the other side."""
    along = np.tile(toward, (len(points), 1))
    (back, facing), front = around.first(points, along), around.first(points, -along)[0]
    free: Bools = (back >= 0.5 * gap) & (back <= gap + 0.1 * distance) & (front >= _ROOM * distance)
    free &= facing @ toward < 0
    return bool(free.mean() >= _FREE)


def _leave_out(walls: list[WallPlane], surfaces: _Surfaces, hanging: Bools) -> list[WallPlane]:
    """The walls without some polygons; those that hold no more are left out."""
    result = []
    touched = set(surfaces.wall[hanging].tolist())
    for number, wall in enumerate(walls):
        if number not in touched:
            result.append(wall)
            continue
        kept = surfaces.shape[(surfaces.wall == number) & ~hanging]
        if len(kept):
            result.append(replace(wall, walls=shapely.multipolygons(kept)))
    return result
