"""Walls, the large coplanar polygons of a scene, the planes that they propose, and ray tests.

Triangles are gathered into *layers*, sets that lie in one plane within tolerance, largest area
first (cf. Airey 1990). The triangles of a layer are united and split into connected polygons; those
of at least ``wall_area`` are walls. A polygon blocks a portal only where it lies in the portal's
plane within tolerance, so a plane is blocked by every opaque structural triangle there, whatever
its size.

`Surroundings` casts rays from points to test for walls that face them, or away, and for a roof.
Where a solid touches another, two faces lie in one plane, and a ray may meet either. So it is cast
at all triangles moved a little to their fronts, and to their backs; a ray that meets faces of
opposite directions in the two is ignored.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas, normals, sum_by_group
from ptmtools.cells.fabric import Fabric, Facets, Welded
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import Geometry, neighbours, unite
from ptmtools.cells.planes import PlaneFrame, bounds, planes_of
from ptmtools.cells.search import Bins, Nearby, Tries, connect
from ptmtools.embree import ray_tree
from ptmtools.scene.model import Scene
from ptmtools.tolerance import GRAZING_COSINE, TIE_SHARE, Tolerance, rank


@dataclass(frozen=True)
class WallPlane:
    """A plane that may split cells, and the polygons in it, in its coordinates."""

    frame: PlaneFrame
    walls: Geometry  # the polygons that may split
    blocking: Geometry  # everything opaque and structural, which hides
    # What stops visitors: ``blocking`` without the leaves that they pass; None if it has none.
    barring: Geometry | None = None
    curved: bool = False  # whether it is a facet of a curved wall


@dataclass(frozen=True, kw_only=True)
class Structure:
    """The triangles that may bound a leaf, as few as possible, with indices for searches."""

    corners: Floats  # (T, 3, 3) metres
    forced: Bools  # (T,) whether `SubdivideOptions.structural` names them
    planes: Floats  # (T, 4) and
    areas: Floats  # (T,), see `planes_of`
    region: Ints  # (T,) the flat region of each
    nearby: Nearby
    bins: Bins
    tolerance: Tolerance
    source: Ints  # (T,) the triangle of the scene that each is, or the first of its region
    door: Bools  # (T,) whether it belongs to a door leaf, which is no wall but may block

    @staticmethod
    def from_fabric(fabric: Fabric, tolerance: Tolerance, doors: Bools | None = None) -> Structure:
        """The structure of the opaque triangles, in the order of the file, flat regions of many in
        as few as their outlines need; ``doors``: (T,) whether one of the scene's triangles belongs
        to a door leaf."""
        facets, source, detail = fabric.facets, fabric.source, fabric.shaped
        mesh, forced, file = facets.mesh, fabric.forced[source], fabric.scene.tolerance
        door = np.zeros(len(source), dtype=bool) if doors is None else doors[source]
        leaf, rest = np.flatnonzero(door & ~detail), np.flatnonzero(~door)
        if len(rest) < len(door):  # the edge of a leaf must not split the jamb that it touches
            facets = Facets.from_mesh(Welded(mesh.point, mesh.triangle[rest], rest), file)
        parts = [
            facets.reduce(~detail[rest] & (forced[rest] == value), file) for value in (False, True)
        ]
        first = np.concatenate([*(rest[rows] for _, rows in parts), leaf])
        order = np.argsort(first, kind="stable")
        regions = np.arange(len(source)) + len(facets.area)
        regions[rest] = facets.region
        corners = np.concatenate([*(corners for corners, _ in parts), mesh.corners[leaf]])[order]
        planes, areas = planes_of(corners)
        return Structure(
            corners=corners,
            forced=forced[first[order]],
            planes=planes,
            areas=areas,
            region=regions[first[order]],
            nearby=Nearby(corners, tolerance.rounding),
            bins=Bins(planes, tolerance),
            tolerance=tolerance,
            source=source[first[order]],
            door=door[first[order]],
        )

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in vars(self).items() if name != "rays"}

    @cached_property
    def rays(self) -> Surroundings:
        """Rays among the triangles."""
        return Surroundings(self.corners, self.tolerance)

    def lie_in(self, plane: Floats, triangles: Ints) -> Bools:
        """(n,) whether these triangles, by number, lie in a plane."""
        distance = np.abs(self.corners[triangles] @ plane[:3] + plane[3])
        lies: Bools = np.all(distance <= self.tolerance.plane, axis=1)
        return lies

    def find_in(self, plane: Floats) -> Ints:
        """The triangles that lie in a plane, ascending."""
        slack = self.tolerance.plane
        near = self.nearby.find_between(plane, -slack, slack)
        return near[self.lie_in(plane, near)]

    def unite(self, frame: PlaneFrame, triangles: Ints) -> Geometry:
        """The union of these triangles in a plane."""
        return unite(frame.to_plane(self.corners[triangles]), self.tolerance.grid)


def structural_triangles(
    scene: Scene, options: SubdivideOptions, opened: NDArray[np.integer] | None = None
) -> Bools:
    """(T,) which triangles occlude: opaque, detail neither by name, class nor shape, and no door
    leaves that are ``opened`` (see `Cells.opened`), unless these hide. The first of equal triangles
    may stand for all."""
    fabric = Fabric.from_scene(scene, options)
    result = np.zeros(len(scene.triangles), dtype=bool)
    result[fabric.source[~fabric.shaped]] = True
    if opened is not None and options.doors != "pass":
        result[opened] = False
    return result


def find_walls(
    structure: Structure, wall_area: float, facets: bool = True
) -> tuple[list[WallPlane], int]:
    """The planes that may split leaves, heaviest first. Without ``facets``, those of a scanned
    surface are left out, which would divide space by the thousand and enclose nothing: if most of
    very many walls, by area, are neither upright nor level. And the number of these."""
    least = (1 - TIE_SHARE) * wall_area
    seeds = _layers(structure, least)
    planes, size = structure.planes[seeds], structure.areas[seeds]
    rise = np.abs(planes[:, 1])
    leans = (rise >= _STRAIGHT) & (rise <= np.sqrt(1 - _STRAIGHT**2))
    walls, area = np.full(len(seeds), None, dtype=object), np.zeros(len(seeds))
    for i in np.flatnonzero(~leans):
        walls[i], area[i] = _wall_in(structure, planes[i], least)
    # A triangle as large as a wall is one, whatever else is in its plane: so are most of a scan.
    sure = np.where(leans & (size >= wall_area), size, area)
    scanned = not facets and _is_scan(sure, leans)
    if not scanned:
        for i in np.flatnonzero(leans):
            walls[i], area[i] = _wall_in(structure, planes[i], least)
        sure = area
        scanned = not facets and _is_scan(area, leans)
    kept = np.flatnonzero((sure > 0) & ~(scanned & leans))
    planes_kept = _mark_curved(walls[kept][rank(area[kept])].tolist(), structure.tolerance)
    return planes_kept, int(np.count_nonzero(sure)) - len(kept)


def _mark_curved(walls: list[WallPlane], tolerance: Tolerance) -> list[WallPlane]:
    """The walls; upright ones that meet two others at small angles are curved (ducts are not)."""
    if not walls:
        return walls
    points = [w.frame.to_space(shapely.get_coordinates(w.walls)) for w in walls]
    box = np.array([bounds(p) for p in points])
    box += tolerance.plane / 2 * np.array([[-1.0], [1.0]])
    low, high = box[:, 0], box[:, 1]
    plan = shapely.box(low[:, 0], low[:, 2], high[:, 0], high[:, 2])
    i, j = shapely.STRtree(plan).query(plan)
    normal = np.array([w.frame.plane[:3] for w in walls])
    turn = np.abs(np.einsum("ij,ij->i", normal[i], normal[j]))
    meets = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
    upright = np.abs(normal[:, 1]) < _STRAIGHT
    meets &= (turn >= _CURVE) & (turn < tolerance.cosine) & upright[i] & upright[j]
    # Not where only their boxes do.
    line = np.array([shapely.convex_hull(shapely.MultiPoint(p[:, [0, 2]])) for p in points])
    meets[meets] = shapely.dwithin(line[i[meets]], line[j[meets]], tolerance.plane)
    curved = np.bincount(i[meets], minlength=len(walls)) >= 2
    return [replace(w, curved=bool(c)) for w, c in zip(walls, curved, strict=True)]


def _is_scan(area: Floats, leans: Bools) -> bool:
    """Whether walls of (n,) areas, m², 0 for none, are very many, and most of them by area lean."""
    return bool(np.count_nonzero(area) >= _MANY and 2 * area[leans].sum() > area.sum())


def _wall_in(structure: Structure, plane: Floats, least: float) -> tuple[WallPlane | None, float]:
    """The walls in a plane, of connected polygons of an area, m², or more, and their area."""
    tolerance, forced = structure.tolerance, structure.forced
    frame = PlaneFrame.from_plane(plane)
    flat = structure.find_in(plane)
    if not _may_hold_wall(structure, frame, flat, least):
        return None, 0.0
    blocking = structure.unite(frame, flat)
    shapely.prepare(blocking)
    masonry = flat[~structure.door[flat]]
    alone = len(masonry) < len(flat)
    parts = shapely.get_parts(structure.unite(frame, masonry) if alone else blocking)
    group = neighbours(parts, tolerance.hairline)
    large = np.bincount(group, weights=shapely.area(parts))[group] >= least
    if np.any(forced[flat]):
        large |= shapely.intersects(parts, structure.unite(frame, flat[forced[flat]]))
    if not np.any(large):
        return None, 0.0
    walls = shapely.multipolygons(parts[large])
    return WallPlane(frame, walls, blocking), float(shapely.area(walls))


def _may_hold_wall(structure: Structure, frame: PlaneFrame, flat: Ints, least: float) -> bool:
    """Whether these triangles in a plane may hold a wall of an area, m²: not the seats of a hundred
    benches, which are in small clusters by their boxes."""
    if len(flat) > _SEVERAL or structure.forced[flat].any():
        return True
    corner, gap = frame.to_plane(structure.corners[flat]), structure.tolerance.hairline
    low, high = corner.min(axis=1) - gap / 2, corner.max(axis=1) + gap / 2
    boxes = shapely.box(*low.T, *high.T)
    group = connect(len(flat), shapely.STRtree(boxes).query(boxes).T)
    return bool((sum_by_group(group, structure.areas[flat], len(flat)) >= least).any())


def _layers(structure: Structure, wall_area: float) -> Ints:
    """Triangles in whose planes enough coplanar area lies to carry a wall, heaviest first.

    Triangles are compared only within bins of similar normal and offset, and a bin is left as soon
    as its free area falls below ``wall_area``, or too many planes were tried without success: so
    curved detail, slivers and scans do not take quadratic time.
    """
    planes, areas, forced = structure.planes, structure.areas, structure.forced
    bins = structure.bins
    # A bin with a forced triangle is never left for lack of area.
    weights = np.where(structure.door, 0.0, areas + 2 * wall_area * forced)
    waiting = bins.weights(weights)
    start, members_of = bins.members()
    free = (areas > 0) & ~structure.door
    layers: list[tuple[float, int]] = []
    promising = free & (waiting[bins.own] >= wall_area)
    tries = Tries(bins.own, areas)
    for seed in rank(np.where(promising, areas, 0.0))[: np.count_nonzero(promising)]:
        if not (free[seed] and tries.worth[seed]):
            continue
        free[seed] = False
        name = bins.own[seed]
        if waiting[name] < wall_area:
            bins.drop(waiting, seed[None], weights[seed, None])
            continue
        near = members_of[start[name] : start[name + 1]]
        near = near[free[near]]
        members = np.append(near[structure.lie_in(planes[seed], near)], seed)
        free[members] = False
        bins.drop(waiting, members, weights[members])
        weight = float(areas[members].sum())
        if weight >= wall_area or np.any(forced[members]):
            layers.append((weight, int(seed)))
        else:
            tries.fail(seed, near[free[near]], wall_area)
    order = rank(np.array([weight for weight, _ in layers]))
    return np.array([seed for _, seed in layers], dtype=np.int64)[order]


#: Number of triangles in a plane from which all of them count as one cluster.
_SEVERAL = 4096
#: A plane is upright or level if it leans by less than this (sine).
_STRAIGHT = 3e-3
#: Walls of a curve turn by less than 30° at each edge (cosine).
_CURVE = 0.866
#: Number of walls from which a surface may be a scan.
_MANY = 1000


#: Level rays from a point.
_RAYS = 32
#: A point is inside if at least this share of them meets a wall: under eaves half of them do.
INSIDE = 0.75
#: Points are inside a solid if at least this share of the walls around them faces away.
AWAY = 0.9
#: If fewer do, but this share, solids may overlap there: a few points tell, whose rays meet this
#: many faces at most.
_OVERLAP, _FEW, _FACES = 0.25, 4, 16
#: Number of points that look at the walls around.
LOOKS = 16
#: Points whose level rays are shot at a time.
_AT_ONCE = 1 << 14
#: 1/g and 1/g², where g³ = g + 1 (Roberts' sequence): where in a triangle.
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])


def points_in(corners: Floats, number: Ints) -> Floats:
    """(n, 3) points in (n, 3, 3) triangles, those of a ``number``, (n,), in a sequence that fills a
    triangle evenly."""
    share = np.mod((number[:, None] + 0.5) * _STEPS, 1.0)
    share = np.where(share.sum(axis=1, keepdims=True) > 1, 1 - share, share)
    weight = np.column_stack([1 - share.sum(axis=1), share])
    return np.asarray(np.einsum("nc,ncx->nx", weight, corners))


def sample(corners: Floats, count: int) -> Floats:
    """(count, 3) points spread by area over (n, 3, 3) triangles; none without an area."""
    return sample_rows(corners, count)[0]


def sample_rows(corners: Floats, count: int) -> tuple[Floats, Ints]:
    """The points of `sample`, and (count,) the triangle of each."""
    total = np.cumsum(areas(corners))
    number = np.arange(count if len(total) and total[-1] > 0 else 0)
    row = np.searchsorted(total, (number + 0.5) / count * total[-1:])
    return points_in(corners[row], number), row


def spread_over(points: Floats, count: int) -> Floats:
    """About ``count`` of (n, 3) points, evenly taken."""
    return points[:: -(-len(points) // count)] if len(points) else points


class Surroundings:
    """Ray tests on (T, 3, 3) triangles, counter-clockwise as seen from their front."""

    def __init__(self, corners: Floats, tolerance: Tolerance) -> None:
        self._corners = corners
        self._middle = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
        self._scale = 1 / (float(np.ptp(corners.reshape(-1, 3), axis=0).max()) or 1.0)
        front = normals(corners)
        length = np.linalg.norm(front, axis=1, keepdims=True)
        self._front = np.divide(front, length, out=np.zeros_like(front), where=length > 0)
        self._scenes, self._step = [], tolerance.plane
        for step in (tolerance.plane, -tolerance.plane):
            local = (corners + step * self._front[:, None] - self._middle) * self._scale
            self._scenes.append(ray_tree(local))
        angle = 2 * np.pi * (np.arange(_RAYS) + 0.5) / _RAYS
        self._level = np.stack([np.cos(angle), np.zeros(_RAYS), np.sin(angle)], axis=1)

    def solid(self, points: Floats) -> bool:
        """Whether (n, 3) points are inside a solid: nearly all walls that level rays from them meet
        face away."""
        return bool(self.solid_groups(points[None])[0])

    def solid_groups(self, points: Floats) -> Bools:
        """(g,) whether groups of points, (g, n, 3), are each inside a solid; see `solid`."""
        return np.asarray(self.backs(points) >= AWAY)

    def backs(self, points: Floats) -> Floats:
        """(g,) the share of the walls around each group of points, (g, n, 3), that face away; NaN
        without walls. Where solids overlap, such as a tower and the walls that end in it, not the
        first face that a ray meets counts, but whether the ray leaves more solids than it enters.
        """
        sums = np.zeros((len(points), 2), dtype=np.int64)  # of walls that are sure, and face away
        flat, group = points.reshape(-1, 3), np.repeat(np.arange(len(points)), points.shape[1])
        for first in range(0, len(flat), _AT_ONCE):
            some = flat[first : first + _AT_ONCE]
            along = np.tile(self._level, (len(some), 1))
            hit = self._hits(np.repeat(some, _RAYS, axis=0), along)
            away = np.einsum("sij,ij->si", self._front[hit], along) > 0
            sure = (hit >= 0).all(axis=0) & (away[0] == away[1])
            counts = np.stack([sure, sure & away[0]]).reshape(2, -1, _RAYS).sum(axis=2)
            np.add.at(sums, group[first : first + _AT_ONCE], counts.T)
        share = np.where(sums[:, 0] > 0, sums[:, 1] / np.maximum(sums[:, 0], 1), np.nan)
        doubtful = np.flatnonzero((share >= _OVERLAP) & (share < AWAY))
        few = points[:, :: max(1, -(-points.shape[1] // _FEW))]
        for first in range(0, len(doubtful), _AT_ONCE // _FEW):
            rows = doubtful[first : first + _AT_ONCE // _FEW]
            some = few[rows].reshape(-1, 3)
            along = np.tile(self._level[::2], (len(some), 1))
            depth = self._depth(np.repeat(some, _RAYS // 2, axis=0), along)
            inside = (depth > 0).reshape(len(rows), -1).mean(axis=1)
            share[rows] = np.where(inside >= INSIDE, 1.0, share[rows])
        return share

    def _depth(self, points: Floats, along: Floats) -> Ints:
        """(n,) how many more solids rays from (n, 3) points along (n, 3) leave than they enter."""
        depth, live, points = np.zeros(len(points), np.int64), np.arange(len(points)), points.copy()
        for _ in range(_FACES):
            way, facing = self.first(points[live], along[live])
            met = np.isfinite(way)
            live, way = live[met], way[met]
            turn = np.einsum("ij,ij->i", along[live], facing[met])
            depth[live] += np.where(turn > 0, 1, -1)
            # Faces that touch are moved apart: the next ray begins behind the first of them only.
            beyond = self._step * (np.sign(turn) + 0.5) / np.maximum(np.abs(turn), GRAZING_COSINE)
            points[live] += (way + beyond)[:, None] * along[live]
        return depth

    def have_floor(self, points: Floats) -> Bools:
        """(n,) whether the surface straight below each of (n, 3) points faces up."""
        hit = self._hits(points, np.tile([0.0, -1.0, 0.0], (len(points), 1)))
        result: Bools = ((hit >= 0) & (self._front[hit, 1] > 0)).all(axis=0)
        return result

    def cover(self, points: Floats) -> Bools:
        """(n,) whether a surface is straight above each of (n, 3) points."""
        result: Bools = self._hits(points, np.tile([0.0, 1.0, 0.0], (len(points), 1)))[0] >= 0
        return result

    def see_out(self, points: Floats, rises: tuple[float, ...] = (0.0,)) -> Bools:
        """(n,) whether a ray from each of (n, 3) points, upwards or rising by any of ``rises`` for
        a length of 1 in plan, meets nothing, not even the edge of a surface."""
        along = np.concatenate(
            [*(self._level + [0.0, rise, 0.0] for rise in rises), [[0.0, 1.0, 0.0]]]
        )
        hit = self._hits(np.repeat(points, len(along), axis=0), np.tile(along, (len(points), 1)))
        return np.asarray((hit < 0).all(axis=0).reshape(len(points), -1).any(axis=1))

    def free_about(self, points: Floats) -> Floats:
        """(n, r) metres that r level rays from each of (n, 3) points go, infinite without a hit."""
        along = np.tile(self._level, (len(points), 1))
        return self.first(np.repeat(points, _RAYS, axis=0), along)[0].reshape(-1, _RAYS)

    def first(self, points: Floats, along: Floats) -> tuple[Floats, Floats]:
        """The first surfaces that rays from (n, 3) points along (n, 3) unit vectors meet: (n,)
        distances, metres, infinite without a hit, and (n, 3) unit normals."""
        hit = self._hits(points, along)[0]
        distance, facing = np.full(len(points), np.inf), np.zeros((len(points), 3))
        met = np.flatnonzero(hit >= 0)
        normal = self._front[hit[met]]
        to = np.einsum("ij,ij->i", self._corners[hit[met], 0] - points[met], normal)
        turn = np.einsum("ij,ij->i", along[met], normal)
        distance[met] = np.divide(to, turn, out=np.zeros(len(met)), where=turn != 0)
        facing[met] = normal
        return distance, facing

    def enclose(self, points: Floats, roofed: bool = True) -> Bools:
        """(n,) which of (n, 3) points are between walls and, if the building is ``roofed``, under a
        roof."""
        result: Bools = self.cover(points) if roofed else np.ones(len(points), dtype=np.bool_)
        result[result] = self.walls_met(points[result]) >= INSIDE
        return result

    def walls_met(self, points: Floats) -> Floats:
        """(n,) the share of level rays from (n, 3) points that meet a surface."""
        result = np.zeros(len(points))
        for first in range(0, len(points), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            result[part] = np.isfinite(self.free_about(points[part])).mean(axis=1)
        return result

    def _hits(self, points: Floats, along: Floats) -> Ints:
        """(2, n) the first triangle that each ray meets, or -1, with all triangles moved to their
        fronts, and to their backs."""
        origin = np.ascontiguousarray((points - self._middle) * self._scale, dtype=np.float32)
        direction = np.ascontiguousarray(along, dtype=np.float32)
        if not len(origin):
            return np.zeros((2, 0), dtype=np.int64)
        hits = [scene.run(origin, direction, query="INTERSECT") for scene in self._scenes]
        return np.array(hits, dtype=np.int64)
