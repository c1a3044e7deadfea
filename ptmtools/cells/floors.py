"""Floors, which visitors may walk on, and ceilings, where rooms without one end.

**Floors** are the flat regions of nearly level triangles, seen from above. A scanned floor has a
region for every triangle, which takes as long to search as a room. Where very many regions are
smaller than a body can tell apart, those of one cube of space are a **patch**: the hull of their
plans, in a plane of their mean slope that none of them rises above.

**Ceilings.** Cells of a model without ceilings would end at its top, and a visitor of one room
would see all others through the gap above walls whose heights differ by centimetres. So a level
plane, the **ceiling**, at the lowest top of the walls around the open floor splits the building
first. It hides nothing. But a straight line that leads up through it never leads down again, so
rooms see one another through their doorways only; space above it belongs to cells of its own, and
what is there is seen from wherever a line leads to it.

Lowering the top of the model to that plane was rejected: what is above would be visible past every
portal. So was a plane for each room: walls of one height, but for centimetres, are the usual case.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, normals, ranges, sum_by_group
from ptmtools.cells.fabric import Fabric, facets_of
from ptmtools.cells.options import Walker
from ptmtools.cells.planar import Geometry, unite_rows
from ptmtools.cells.planes import PLAN, PlaneFrame, Polyhedron, bounds, section
from ptmtools.cells.portals import FLOOR_COSINE
from ptmtools.cells.search import distinct
from ptmtools.cells.structure import INSIDE, Structure, WallPlane, sample
from ptmtools.tolerance import Tolerance

#: Number of small regions from which a floor is a scan.
_SCAN = 20_000


@dataclass(frozen=True)
class Floors:
    """The flat regions of all nearly level triangles that are no detail, and patches."""

    corners: Floats  # (n, 3, 3) metres
    region: Ints  # (n,) ascending from 0
    front: Bools  # (r,) whether a part of the region is seen from above, not a back only
    slope: Floats  # (r, 3): the height is a·x + b·z + c
    patch: Bools  # (r,) whether it is one

    @staticmethod
    def from_fabric(fabric: Fabric, grain: float = 0.0) -> Floors:
        """``grain``: side of a patch, metres, none for 0."""
        scene = fabric.scene
        normal = normals(scene.corners)
        steep = np.abs(normal[:, 1]) <= FLOOR_COSINE * np.linalg.norm(normal, axis=1)
        level = np.flatnonzero(~(steep | fabric.find_detail()))
        facets, level = facets_of(scene, level)
        corners, source = facets.reduce(np.ones(len(level), dtype=bool), scene.tolerance)
        above = (scene.two_sided | (normal[:, 1] > 0))[level]
        above = np.bincount(facets.region, above, len(facets.area)) > 0
        region, front = facets.region[source], above[facets.region[source]]
        patch = _small(corners, region, grain) if grain else np.zeros(len(region), dtype=bool)
        if np.count_nonzero(patch) < _SCAN:
            patch[:] = False
        cube = np.floor(corners[patch].mean(axis=1) / max(grain, np.finfo(float).tiny))
        _, patch_number = distinct(np.column_stack([cube, front[patch]]))
        region = np.where(patch, 0, region + 1 + len(patch_number))
        region[patch] = patch_number
        order = np.argsort(region, kind="stable")
        first, region = np.unique(region[order], return_index=True, return_inverse=True)[1:]
        corners, region = corners[order], region.reshape(-1)
        patch, front = patch[order][first], front[order][first]
        return Floors(corners, region, front, _slopes(corners, region, patch), patch)

    @cached_property
    def _start(self) -> Ints:
        return np.searchsorted(self.region, np.arange(len(self.slope) + 1))

    def plan(self, regions: Ints, grid: float) -> Geometry:
        """(k,) the polygons of (k,) regions, seen from above."""
        count = self._start[regions + 1] - self._start[regions]
        rows = ranges(self._start[regions], count)
        owner = np.repeat(np.arange(len(regions)), count)
        flat = self.corners[rows][:, :, PLAN]
        result = np.full(len(regions), shapely.Polygon(), dtype=object)
        patch = self.patch[regions]
        some = ~patch[owner]
        names, united = unite_rows(owner[some], shapely.polygons(flat[some]), grid, more=True)
        result[names] = united
        if patch.any():
            points, place = flat[~some].reshape(-1, 2), np.cumsum(patch) - 1
            clouds = shapely.multipoints(points, indices=np.repeat(place[owner[~some]], 3))
            result[patch] = shapely.convex_hull(clouds)
        return result


def _small(corners: Floats, region: Ints, grain: float) -> Bools:
    """(n,) which of (n, 3, 3) triangles are in regions no larger than a patch in any direction."""
    low, high = np.full((2, int(region.max(initial=-1)) + 1, 3), [[[np.inf]], [[-np.inf]]])
    np.minimum.at(low, region, corners.min(axis=1))
    np.maximum.at(high, region, corners.max(axis=1))
    result: Bools = ((high - low) <= grain).all(axis=1)[region]
    return result


def _slopes(corners: Floats, region: Ints, patch: Bools) -> Floats:
    """(r, 3) the slope of each region, by its largest triangle, or the mean of a patch and the
    highest corner."""
    size = areas(corners)
    order = np.lexsort((-size, region))
    largest = order[np.unique(region[order], return_index=True)[1]]
    normal = normals(corners)
    normal *= np.where(normal[:, 1] < 0, -1.0, 1.0)[:, None]
    mean = np.stack([sum_by_group(region, column, len(patch)) for column in normal.T], axis=1)
    normal = np.where(patch[:, None], mean, normal[largest])
    slope = -normal[:, PLAN] / normal[:, 1:2]
    at = corners[largest].mean(axis=1)
    level = at[:, 1] - np.einsum("ij,ij->i", slope, at[:, PLAN])
    rise = corners[..., 1] - np.einsum("ncx,nx->nc", corners[..., PLAN], slope[region])
    top = np.full(len(patch), -np.inf)
    np.maximum.at(top, region, rise.max(axis=1))
    return np.column_stack([slope, np.where(patch, top, level)])


#: Points that represent the floor.
_POINTS = 4096
#: Parts of it are smaller than the area among walls divided by this number.
_PARTS = 256
#: Surfaces nearer to one another than head room, metres, or this share of the model's height, are
#: the two sides of a slab, or furniture.
HEAD_ROOM, SLAB_SHARE = 1.5, 1 / 3
#: A building is open above if less than this share of its floor has a surface above it.
ROOFED = 0.5
#: Heights of floors, metres, that are compared together.
_STOREY = 0.5
#: This share of the length of walls may end below the ceiling,
_LOWER = 0.02
#: and at least this one ends at most so far above it, metres: else nothing is a room's height.
_ALIKE, _SPREAD = 0.25, 0.5
#: This share of the floor with ceilings may lie above it.
_ABOVE = 0.1
#: A wall leans by less than this (sine).
_LEANS = 0.02


@dataclass(frozen=True)
class SampledFloor:
    """Points spread by area over the level surfaces between walls: no roofs, and no land around a
    building. (Tried: the middles of the largest triangles, all of which may be under skylights.)"""

    height: Floats  # (n,) metres
    covered: Bools  # (n,) whether a surface is above head room over each

    @staticmethod
    def from_structure(structure: Structure, radius: float) -> SampledFloor:
        """``radius``: of a body that fits, metres, unlike in a wall."""
        corners = structure.corners
        level = np.abs(structure.planes[:, 1]) >= FLOOR_COSINE
        low, high = corners.min(axis=1), corners.max(axis=1)
        apart = min(HEAD_ROOM, SLAB_SHARE * float(np.ptp(corners[:, :, 1]))) if len(corners) else 0
        tall = ~level & (high[:, 1] - low[:, 1] >= apart)
        if not (tall.any() and level.any()):
            return SampledFloor(np.zeros(0), np.zeros(0, dtype=bool))
        among = low[tall].min(axis=0)[PLAN], high[tall].max(axis=0)[PLAN]
        eyes = sample(_parts_in(corners[level], *among), _POINTS) + [0.0, apart, 0.0]
        around = structure.rays
        wide = around.free_about(eyes)
        eyes = eyes[(np.isfinite(wide).mean(axis=1) >= INSIDE) & (wide.min(axis=1) >= radius)]
        return SampledFloor(eyes[:, 1] - apart, around.cover(eyes))

    @property
    def roof_share(self) -> float:
        """The share that has a surface above it; 1 without any floor."""
        return float(self.covered.mean()) if len(self.covered) else 1.0


def _parts_in(corners: Floats, low: Floats, high: Floats) -> Floats:
    """The small parts of triangles, (n, 3, 3), that meet a rectangle in plan: a floor may be that
    of a wide meadow."""
    while True:
        flat = corners[:, :, PLAN]
        corners = corners[((flat.min(axis=1) <= high) & (flat.max(axis=1) >= low)).all(axis=1)]
        large = areas(corners) > np.prod(high - low) / _PARTS
        if not large.any():
            return corners
        a, b, c = corners[large].transpose(1, 0, 2)
        d, e, f = (b + c) / 2, (c + a) / 2, (a + b) / 2
        quarters = [np.stack(part, axis=1) for part in ((a, f, e), (f, b, d), (e, d, c), (d, e, f))]
        corners = np.concatenate([corners[~large], *quarters])


def ceiling_height(floor: SampledFloor, walls: list[WallPlane], walker: Walker) -> float | None:
    """The height, metres in world coordinates, at which rooms of a building end whose storey with
    most open floor is mostly open, with those above; None where walls have no common height, or if
    it would cut through storeys with ceilings, as those of a house in a garden."""
    storey = np.floor(floor.height / _STOREY)
    names, number = np.unique(storey[~floor.covered], return_counts=True)
    main = names[number.argmax()] if len(names) else np.inf
    if not len(names) or floor.covered[storey >= main].mean() >= ROOFED:
        return None
    eyes = float(floor.height[(storey == main) & ~floor.covered].max()) + walker.reach
    top, length = _tops(walls, eyes)
    if not length.sum():
        return None
    lower = np.cumsum(length) - length
    height = top[np.flatnonzero(lower <= _LOWER * length.sum())[-1]]
    alike = (top >= height) & (top <= height + _SPREAD)
    common = length[alike].sum() >= _ALIKE * length.sum()
    above = floor.covered & (floor.height > height)
    return float(height) if common and above.sum() <= _ABOVE * floor.covered.sum() else None


def _tops(walls: list[WallPlane], eyes: float) -> tuple[Floats, Floats]:
    """(n,) tops, ascending, and (n,) lengths of the upright walls that reach from below the height
    of ``eyes`` to above it, metres."""
    rows = [(eyes, 0.0)]
    for wall in walls:
        if abs(wall.frame.plane[1]) < _LEANS:
            for part in shapely.get_parts(wall.walls):
                points = wall.frame.to_space(shapely.get_coordinates(part))
                low, high = bounds(points)
                if low[1] <= eyes < high[1]:
                    rows.append((float(high[1]), float(np.hypot(*(high - low)[[0, 2]]))))
    top, length = np.array(sorted(rows)).T
    return top, length


def ceiling_plane(
    height: float, structure: Structure, body: Polyhedron, tolerance: Tolerance
) -> WallPlane | None:
    """The level plane at a height, whose fragment is all of a body's section, and what blocks in
    it; None if it leaves no room above or below."""
    low, high = body.points[:, 1].min(), body.points[:, 1].max()
    if min(height - low, high - height) < tolerance.thin:
        return None
    frame = PlaneFrame.from_plane(np.array([0.0, 1.0, 0.0, -height]))
    blocking = structure.unite(frame, structure.find_in(frame.plane))
    outline = section(body, frame.plane, tolerance.rounding)
    return WallPlane(frame, shapely.Polygon(frame.to_plane(outline)), blocking)
