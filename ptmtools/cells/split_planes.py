"""Split planes beside those of walls: reveals, door leaves and caps.

**Reveals** are the jambs, lintels and sills that close a wall's thickness around an opening: flat
regions that bridge the slab between two near, parallel walls from face to face, whatever their
area. Without them solids that are not capped would join rooms to the outside.

**Door planes** split after walls and reveals, whatever the size of the leaf: as a wall, a leaf
would cut the thickness of the wall in which it hangs, and no jamb would bridge it.

**Caps** are polygons of any area that close the whole cross-section of a leaf. The planes of walls
extend behind them and cut the solids of floors and walls into wedges, which only such polygons
separate from free space. A cap costs one leaf and never a portal; those that separate nothing are
removed (`portals`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.planar import Geometry, open_part
from ptmtools.cells.planes import (
    BOX_FACE,
    PlaneFrame,
    Polyhedron,
    bounds,
    parallel_gap,
    plane_axes,
    section,
)
from ptmtools.cells.search import Tries
from ptmtools.cells.structure import Structure, WallPlane
from ptmtools.tolerance import TIE_SHARE, rank


class Reveals:
    """The reveals in the thickness of walls, computed once for every pair of wall faces."""

    def __init__(self, structure: Structure, wall_thickness: float) -> None:
        self._structure = structure
        self._limit = wall_thickness
        self._tolerance = structure.tolerance
        self._known: dict[bytes, list[WallPlane]] = {}

    def __getstate__(self) -> dict[str, object]:
        return {**vars(self), "_known": {}}  # another thread may be adding to it

    def select(self, body: Polyhedron, walls: list[WallPlane]) -> list[WallPlane]:
        """The reveals of the slab that a body lies in; none if it lies in no wall.

        ``walls`` are those of the BSP nodes that the tags of the body's faces name.
        """
        slab = self._slab(_bounds(body, walls))
        if slab is None:
            return []
        key = slab[0].tobytes() + slab[1].tobytes()
        if key not in self._known:
            self._known[key] = self._bridges(*slab)
        return self._known[key]

    def _slab(self, bounds: list[Floats]) -> tuple[Floats, Floats] | None:
        """The nearest pair of parallel planes within the wall thickness."""
        nearest, pair = (1 + TIE_SHARE) * self._limit, None
        for i, a in enumerate(bounds):
            for b in bounds[i + 1 :]:
                gap = parallel_gap(a, b, self._tolerance)
                if gap <= nearest:
                    nearest, pair = gap - self._tolerance.rounding, (a, b)
        return pair

    def _bridges(self, first: Floats, second: Floats) -> list[WallPlane]:
        slack = self._tolerance.hairline
        turn = float(np.sign(first[:3] @ second[:3]))
        width = abs(float(first[3]) - turn * float(second[3]))
        inward = float(np.sign(float(first[3]) - turn * float(second[3]))) or 1.0
        structure, areas = self._structure, self._structure.areas
        near = structure.nearby.find_between(
            first, *sorted((inward * slack, inward * (width - slack)))
        )
        depth = inward * (structure.corners[near] @ first[:3] + first[3])
        low, high = depth.min(axis=1), depth.max(axis=1)
        within = (high > slack) & (low < width - slack) & (areas[near] > 0)
        inside, low, high = near[within], low[within], high[within]
        spans = self._span(inside, low, high, width)
        bridging = inside[spans]
        result: list[WallPlane] = []
        for seed in bridging[rank(areas[bridging])]:
            plane = structure.planes[seed]
            apart = (parallel_gap(plane, w.frame.plane, self._tolerance) for w in result)
            if min(apart, default=self._limit) < self._tolerance.thin:
                continue
            frame, lies = PlaneFrame.from_plane(plane), structure.lie_in(plane, inside)
            walls, blocking = inside[lies & spans], inside[lies]
            result.append(
                WallPlane(frame, structure.unite(frame, walls), structure.unite(frame, blocking))
            )
        return result

    def _span(self, triangles: Ints, low: Floats, high: Floats, width: float) -> Bools:
        """(n,) which triangles, ``low`` and ``high`` deep in a slab, belong to a flat region that
        reaches from one of its faces to the other."""
        slack = self._tolerance.hairline
        between = np.flatnonzero((low >= -slack) & (high <= width + slack))
        names, region = np.unique(self._structure.region[triangles[between]], return_inverse=True)
        least, greatest = np.full(len(names), np.inf), np.full(len(names), -np.inf)
        np.minimum.at(least, region, low[between])
        np.maximum.at(greatest, region, high[between])
        spans = np.zeros(len(triangles), dtype=bool)
        spans[between] = ((least <= slack) & (greatest >= width - slack))[region]
        return spans


def _bounds(body: Polyhedron, walls: list[WallPlane]) -> list[Floats]:
    """The planes of a body's faces: those of the BSP, and those of the root box, in which the
    outer faces of a building lie when the box is clipped to it."""
    bounds = [
        walls[tag].frame.plane for tag in sorted({tag for tag in body.tags if tag != BOX_FACE})
    ]
    return bounds + [p for p, tag in zip(body.planes, body.tags, strict=True) if tag == BOX_FACE]


#: A plane of a leaf holds at least this share of the leaf's largest area in one plane.
_SHARE = 0.5
#: It lies square across the leaf to this cosine.
_SQUARE = 0.99


@dataclass(frozen=True)
class DoorPlanes:
    """The planes of door leaves, and the boxes, metres, of the triangles in them."""

    structure: Structure
    planes: tuple[tuple[PlaneFrame, Geometry], ...]  # with the polygons of the leaf in each
    low: Floats  # (p, 3) and
    high: Floats  # (p, 3) least and greatest corner

    @staticmethod
    def from_structure(structure: Structure, leaf: Ints, across: Floats) -> DoorPlanes:
        """The planes of d leaves across their (d, 3) directions; ``leaf``: (T,) the leaf of each
        triangle of a structure, -1 for none."""
        rows = np.flatnonzero(leaf >= 0)
        turn = np.einsum("ij,ij->i", structure.planes[rows, :3], across[leaf[rows]])
        rows = rows[np.abs(turn) >= _SQUARE]
        order = rows[np.argsort(leaf[rows], kind="stable")]
        bounds = np.searchsorted(leaf[order], np.arange(len(across) + 1))
        layers: list[tuple[PlaneFrame, Ints]] = []
        for first, last in itertools.pairwise(bounds):
            layers += _planes(structure, order[first:last])
        boxes = [structure.corners[flat].reshape(-1, 3) for _, flat in layers]
        low = np.array([points.min(axis=0) for points in boxes]).reshape(-1, 3)
        high = np.array([points.max(axis=0) for points in boxes]).reshape(-1, 3)
        planes = tuple((frame, structure.unite(frame, flat)) for frame, flat in layers)
        return DoorPlanes(structure, planes, low, high)

    def select(self, body: Polyhedron) -> list[WallPlane]:
        """The planes whose boxes meet that of a body, with what blocks there: all that lies in the
        plane of a leaf may be hundreds of leaves."""
        low, high = bounds(body.points)
        meets = np.flatnonzero(((self.low <= high) & (self.high >= low)).all(axis=1))
        near = self.structure.nearby.meeting(low, high) if len(meets) else meets
        result = []
        for frame, walls in (self.planes[i] for i in meets):
            flat = near[self.structure.lie_in(frame.plane, near)]
            result.append(WallPlane(frame, walls, self.structure.unite(frame, flat)))
        return result


def _planes(structure: Structure, triangles: Ints) -> list[tuple[PlaneFrame, Ints]]:
    """The planes of one leaf, and its ``triangles`` in each."""
    layers: list[tuple[float, Floats, Ints]] = []
    waiting = triangles
    while len(waiting):
        plane = structure.planes[waiting[rank(structure.areas[waiting])[0]]]
        flat = structure.lie_in(plane, waiting)
        layers.append((float(structure.areas[waiting[flat]].sum()), plane, waiting[flat]))
        waiting = waiting[~flat] if flat.any() else waiting[1:]
    least = _SHARE * max((area for area, *_ in layers), default=0.0)
    return [
        (PlaneFrame.from_plane(plane), members) for area, plane, members in layers if area >= least
    ]


#: Margin, as a share, of the comparison of areas that precedes that of polygons.
_SPARE = 1e-3
#: Number of planes that are cut with a leaf at a time.
_CHUNK = 4096


def find_caps(
    structure: Structure, body: Polyhedron, known: Sequence[WallPlane] = ()
) -> list[WallPlane]:
    """The planes whose polygons leave no opening between two parts of a body, in the order of the
    model's triangles: many are equally good, and areas of strips some centimetres wide keep few
    digits far from the origin. ``known``: those of a body around it."""
    low, high = bounds(body.points)
    near = structure.nearby.meeting(low, high)
    slack, corners = structure.tolerance.plane, structure.corners[near]
    apart = (corners.min(axis=1) > high + slack) | (corners.max(axis=1) < low - slack)
    near = near[~apart.any(axis=1)]
    inside = _reaching_into(body, structure, near)
    areas, planes = structure.areas[inside], structure.planes[inside]
    nearby = structure.bins.own_sums(inside, areas)
    needed = _section_areas(body, planes) * (1 - _SPARE)
    free = needed <= nearby
    home = structure.bins.own[inside]
    caps: list[tuple[int, WallPlane]] = []
    for wall in known:
        members = np.flatnonzero(structure.lie_in(wall.frame.plane, inside))
        if free[members].any():
            free[members] = False
            caps.append((int(inside[members[0]]), wall))
    tries = Tries(np.unique(home, return_inverse=True)[1].reshape(-1), areas)
    for seed in rank(np.where(free, areas, 0.0))[: np.count_nonzero(free)]:
        if not (free[seed] and tries.worth[seed]):
            continue
        mates = np.flatnonzero(structure.bins.holds(home[seed], inside))
        members = mates[structure.lie_in(planes[seed], inside[mates])]
        free[members] = False
        free[seed] = False
        if areas[members].sum() >= needed[seed]:
            cap = _cap(body, planes[seed], structure, near)
            caps += [(int(inside[members[0]]), cap)] if cap else []
        else:
            tries.fail(seed, mates[free[mates]], float(needed[seed]))
    return [cap for _, cap in sorted(caps, key=lambda cap_with_seed: cap_with_seed[0])]


def _reaching_into(body: Polyhedron, structure: Structure, triangles: Ints) -> Ints:
    """The triangles with a point inside each face of the body by more than the tolerance: all that
    have a part inside, and few others."""
    result = triangles[structure.areas[triangles] > 0]
    for plane in body.planes:
        height = structure.corners[result] @ plane[:3] + plane[3]
        result = result[height.min(axis=1) < -structure.tolerance.plane]
    return result


def _cap(body: Polyhedron, plane: Floats, structure: Structure, near: Ints) -> WallPlane | None:
    """The polygons in a plane, if they leave no opening in a body's section with it."""
    tolerance = structure.tolerance
    outline = section(body, plane, tolerance.rounding)
    if len(outline) < 3:
        return None
    frame = PlaneFrame.from_plane(plane)
    lies = near[structure.lie_in(plane, near)]
    flat = frame.to_plane(structure.corners[lies])
    if _see_through(frame.to_plane(outline), flat, tolerance.hairline):
        return None
    blocking = structure.unite(frame, lies)
    opening = open_part(shapely.polygons(frame.to_plane(outline)), blocking, tolerance)
    return WallPlane(frame, blocking, blocking) if shapely.is_empty(opening) else None


#: Points of a section that are tried for an opening: on the way from its middle to its corners.
_TRIED = np.array([0.3, 0.6, 0.9])


def _see_through(outline: Floats, triangles: Floats, width: float) -> bool:
    """Whether a disc of this ``width`` in a convex polygon, (k, 2), between (n, 3, 2) triangles of
    its plane is met by trying few: a test in no time that most sections with an opening pass."""
    middle = outline.mean(axis=0)
    points = np.concatenate([[middle], *(middle + t * (outline - middle) for t in _TRIED)])
    inside = -_overhangs(points, outline[None])[:, 0] >= width
    return bool((_overhangs(points[inside], triangles) >= width).all(axis=1).any())


def _overhangs(points: Floats, polygons: Floats) -> Floats:
    """(p, n) how far (p, 2) points are beyond the edges of convex polygons, (n, k, 2), in any
    sense: no more than the distance outside, and no less than minus the one inside."""
    along = np.roll(polygons, -1, axis=1) - polygons
    across = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    across = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    turn = np.sign(np.einsum("nkc,nkc->n", across, polygons - polygons.mean(axis=1, keepdims=True)))
    height = np.einsum("pc,nkc->pnk", points, across) - np.einsum("nkc,nkc->nk", across, polygons)
    result: Floats = (turn[:, None] * height).max(axis=2, initial=-np.inf)
    return result


def _section_areas(body: Polyhedron, planes: Floats) -> Floats:
    """(n,) areas (m²) of a body's sections with (n, 4) planes, but for rounding; infinite where a
    plane does not cut it."""
    start, end = body.edges.T
    areas = np.full(len(planes), np.inf)
    for first in range(0, len(planes), _CHUNK):
        plane = planes[first : first + _CHUNK]
        height = plane[:, :3] @ body.points.T + plane[:, 3:]
        crosses = (height[:, start] > 0) != (height[:, end] > 0)
        cut = np.flatnonzero(crosses.any(axis=1))
        a, b, crosses = height[cut][:, start], height[cut][:, end], crosses[cut]
        t = np.divide(a, a - b, out=np.zeros(a.shape), where=crosses)[..., None]
        points = body.points[start] * (1 - t) + body.points[end] * t
        # An edge that is not cut repeats a corner, and adds nothing.
        corner = points[np.arange(len(cut)), crosses.argmax(axis=1)][:, None]
        points = np.where(crosses[..., None], points, corner) - corner
        centre = points.mean(axis=1, keepdims=True)
        areas[first + cut] = _polygon_areas(points - centre, plane[cut, :3])
    return areas


def _polygon_areas(points: Floats, normals: Floats) -> Floats:
    """(n,) areas of the convex polygons with corners (n, k, 3), in any order, about 0."""
    u, v = plane_axes(normals)
    x, y = np.einsum("nki,ni->nk", points, u), np.einsum("nki,ni->nk", points, v)
    order = np.argsort(np.arctan2(y, x), axis=1)
    x, y = np.take_along_axis(x, order, 1), np.take_along_axis(y, order, 1)
    twice: Floats = (x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)).sum(axis=1)
    return twice / 2
