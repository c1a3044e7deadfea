"""Polygons in a plane: union, intersection and difference that rounding cannot lead astray.

GEOS overlays in floating point find their own way out of rounding, and now and then the wrong one:
of two rectangles 1.3 × 2.6 and 1.3 × 2.4 that share three sides, one of them but for 4e-16, GEOS
3.14 gives a point as the intersection. A wall lost so opens a room, an opening lost so hides one.
On a grid (snap rounding, exact) this cannot happen; ours is `Tolerance.grid`, a thousandth of what
counts as rounding. Results hold polygons only: lines and points in which operands touch are
dropped.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.merging import connected
from ptmtools.cells.nearby import along_a_curve
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
