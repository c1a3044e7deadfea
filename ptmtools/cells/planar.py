"""Polygons in a plane: union, intersection and difference that rounding cannot lead astray.

GEOS overlays in floating point find their own way out of rounding, and now and then the wrong one:
of two rectangles 1.3 × 2.6 and 1.3 × 2.4 that share three sides, one of them but for 4e-16, GEOS
3.14 gives a point as the intersection. A wall lost so opens a room, an opening lost so hides one.
On a grid (snap rounding, exact) this cannot happen; ours is `Tolerance.grid`, a thousandth of what
counts as rounding. Results hold polygons only: lines and points in which operands touch are
dropped.

Polygons with holes into as few triangles as they have, and these as plump as possible.

The constrained Delaunay triangulation of GEOS: it uses every corner, also one on a straight edge
(the neighbour beyond that edge has it too), and makes none. Of 2,000 turned polygons with many such
corners it divided all without a sliver."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.connectivity import connected, first_alike
from ptmtools.cells.search import along_a_curve
from ptmtools.tolerance import Tolerance

#: A shapely geometry, or an array of them.
Geometry = Any

_COLLECTION = 7
#: So many polygons are united at a time.
_CHUNK = 256


def unite(triangles: Floats, grid: float) -> Geometry:
    """Union of (n, 3, 2) triangles of a plane: coplanar overlaps and T-junctions vanish."""
    polygons = shapely.polygons(np.concatenate([triangles, triangles[:, :1]], axis=1))
    return union(shapely.make_valid(polygons), grid)


def union(shapes: Geometry, grid: float) -> Geometry:
    """Union of an array of polygons, less corners on straight edges.

    Here only the operands are brought to the grid: what would be lost is a wall, which shows too
    much, never too little, and snap rounding takes the square of the corners on one line (10,000
    slivers across a wall: 34 s instead of 6 s). For the same reason many polygons are united by
    neighbourhoods, each rid of corners on straight edges, and these in turn.
    """
    polygons = _polygons_in(shapely.set_precision(shapes, grid))
    before = 2 * len(polygons) + 1
    while _CHUNK < len(polygons) < before / 2:
        before = len(polygons)
        # Halves of a quadrilateral have one box, but centroids a third of its length apart.
        boxes = shapely.bounds(polygons)
        polygons = polygons[along_a_curve((boxes[:, :2] + boxes[:, 2:]) / 2)]
        chunks = np.array_split(polygons, -(-before // _CHUNK))
        united = [shapely.union_all(chunk) for chunk in chunks]
        polygons = _polygons_in(shapely.simplify(united, grid))
    return shapely.simplify(shapely.union_all(polygons), grid)


def intersection(one: Geometry, other: Geometry, grid: float) -> Geometry:
    """Pairwise intersection."""
    return _polygonal(shapely.intersection(one, other, grid_size=grid))


def difference(one: Geometry, other: Geometry, grid: float) -> Geometry:
    """Pairwise difference, ``one`` less ``other``."""
    return _polygonal(shapely.difference(one, other, grid_size=grid))


def neighbours(polygons: Geometry, gap: float) -> Ints:
    """(n,) the group of each of n polygons: those less than ``gap`` apart are in one, so that a
    T-junction whose edge misses the corner by a rounding joins what it was meant to join."""
    tree = shapely.STRtree(polygons)
    one, other = tree.query(polygons, predicate="dwithin", distance=gap)
    return connected(len(polygons), one, other)


def left_open(region: Geometry, blocking: Geometry, tolerance: Tolerance) -> Geometry:
    """What of a region is not blocked, less cracks, what is narrower than a hairline: a crack under
    a wall would stretch the hull of a door along all of it.

    A morphological opening, grown by twice what was eroded and clipped, so that what stays is not
    shrunk.
    """
    width, grid = tolerance.hairline, tolerance.grid
    opening = difference(region, blocking, grid)
    core = shapely.buffer(opening, -width / 2, join_style="mitre")
    grown = shapely.buffer(core, width, join_style="mitre")
    return intersection(opening, grown, grid)


def delaunay(shapes: Geometry) -> Geometry:
    """The constrained Delaunay triangulations of an array of polygons; empty for those at which
    GEOS gives up, such as some whose holes touch."""
    try:
        return shapely.constrained_delaunay_triangles(shapes)
    except shapely.GEOSException:
        if len(shapes) == 1:
            return np.array([shapely.GeometryCollection()])
        half = len(shapes) // 2
        return np.concatenate([delaunay(shapes[:half]), delaunay(shapes[half:])])


def _polygons_in(shapes: Geometry) -> Geometry:
    """The polygons among the parts of shapes."""
    parts = shapely.get_parts(shapely.get_parts(shapes))
    return parts[shapely.get_dimensions(parts) == 2]


def _polygonal(shapes: Geometry) -> Geometry:
    """The same without points and lines."""
    every = np.array(shapes, dtype=object).reshape(-1)
    flat = shapely.get_dimensions(every) < 2
    if flat.any():
        every[flat] = shapely.Polygon()
    for i in np.flatnonzero((shapely.get_type_id(every) == _COLLECTION) & ~flat):
        every[i] = shapely.multipolygons(_polygons_in(every[i]))
    return every if np.ndim(shapes) else every[0]


def triangulated(corner: Floats, start: Ints, polygon: Ints) -> tuple[Ints, Ints]:
    """Triangles of polygons that are given as rings: the outer one, counter-clockwise, then holes.

    ``corner``: (n, 2) corners of all rings; ``start``: (r + 1,) CSR of the rings; ``polygon``: (r,)
    ascending, the polygon of each, counted from 0. Rings of a polygon may touch in corners.

    Returns (m, 3) rows of ``corner``, counter-clockwise, and (m,) the polygon of each, ascending.
    A polygon that cannot be divided using all corners is left out.
    """
    size = np.diff(start)
    count = int(polygon.max(initial=-1)) + 1
    corners = np.bincount(polygon, size, count).astype(np.int64)
    rings = np.bincount(polygon, minlength=count)
    whose = np.repeat(polygon, size)
    ready = (corners == 3)[whose]
    rows, others = np.flatnonzero(ready), np.flatnonzero(~ready)
    found, of = _delaunay(corner[others], np.repeat(np.arange(len(size)), size)[others], polygon)
    # A corner in which two rings touch is one corner; the joint takes the place of a bridge.
    same = first_alike(np.column_stack([whose[others], corner[others]]))
    found = same[found]
    touching = np.bincount(whose[others][same != np.arange(len(same))], minlength=count)
    triangle = np.concatenate([rows.reshape(-1, 3), others[found]])
    of = np.concatenate([whose[rows[::3]], of])
    a, b, c = corner[triangle].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    twice = ux * vy - uy * vx
    triangle[twice < 0] = triangle[twice < 0, ::-1]
    sound = np.bincount(of, minlength=count) == corners + 2 * rings - 4 - 2 * touching
    sound[of[twice == 0]] = False
    kept = np.flatnonzero(sound[of])
    kept = kept[np.argsort(of[kept], kind="stable")]
    return triangle[kept], of[kept]


def _delaunay(corner: Floats, ring: Ints, polygon: Ints) -> tuple[Ints, Ints]:
    """(m, 3) rows of ``corner`` and (m,) the polygon of each, of all polygons that GEOS accepts;
    ``ring``: (n,) the ring of each corner, ``polygon``: the polygon of each ring."""
    if not len(corner):
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    named, ring = np.unique(ring, return_inverse=True)
    owner, place = np.unique(polygon[named], return_inverse=True)
    rings = shapely.linearrings(corner, indices=ring)  # it closes them
    shapes = shapely.polygons(rings, indices=place)
    sound = np.flatnonzero(shapely.is_valid(shapes))
    parts, of = shapely.get_parts(delaunay(shapes[sound]), return_index=True)
    points = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    of = sound[of]
    # Which corner of its polygon a point is: they are the same to the last bit.
    whose = np.concatenate([place[ring], np.repeat(of, 3)])
    same = first_alike(np.column_stack([whose, np.concatenate([corner, points])]))
    return same[len(corner) :].reshape(-1, 3), owner[of]
