"""Polygons in a plane: union, difference, intersection, buffers and triangles, which never raise.

Every overlay goes through this module, on a grid (`Tolerance.grid`; snap rounding, exact): GEOS
overlays in floating point occasionally lose a polygon, and a wall lost so opens a room. Where GEOS
gives up, the operation is tried again, alone, on coarser grids, up to what counts as rounding or
above the last digit of the coordinates, and then with its operands repaired. If that fails too, the
result is a safe answer, and `counting` counts it:

============= ==================================================================================
union         the part that could be united, without the smallest of the rest (a wall blocks
              less); with ``more``, the box around all of it (an opening is wider)
difference    the first operand (an opening is wider)
intersection  nothing (a wall proposes no split); with ``more``, the intersection of the operands'
              boxes (an opening is wider)
buffer        the shape itself; with ``more``, the box around it, widened
triangles     none (a piece is drawn as it is)
============= ==================================================================================

Results hold polygons only. Triangulations are the constrained Delaunay ones of GEOS: they use every
corner, also one on a straight edge, since the neighbour beyond that edge has it too, and make none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any

import numpy as np
import shapely

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.search import along_a_curve, connect, distinct, first_alike
from ptmtools.tolerance import GRID_SHARE, ROUNDING_SHARE, Tolerance

#: A shapely geometry, or an array of them.
Geometry = Any

_AREAS, _COLLECTION = (3, 6), 7
#: Number of polygons that are united at a time.
_CHUNK = 256
#: Grids that are tried, in steps of the first: up to the distance that counts as rounding.
_COARSER = tuple(float(step) for step in np.geomspace(1, ROUNDING_SHARE / GRID_SHARE, 3))
#: None is finer than this many times the last digit of the coordinates.
_DIGITS = 4.0

_undecided: ContextVar[Counter[str] | None] = ContextVar("undecided", default=None)


@contextmanager
def counting() -> Iterator[Counter[str]]:
    """Counts the operations that end in a safe answer, by name (``"union"``, …), until the context
    ends; contexts inside it count separately."""
    counts: Counter[str] = Counter()
    token = _undecided.set(counts)
    try:
        yield counts
    finally:
        _undecided.reset(token)


def count(names: Iterable[str] | Mapping[str, int]) -> None:
    """Adds operations, by name, to the counts of the innermost `counting`."""
    if (counter := _undecided.get()) is not None:
        counter.update(names)


def unite(triangles: Floats, grid: float) -> Geometry:
    """Union of (n, 3, 2) triangles of a plane: coplanar overlaps and T-junctions vanish."""
    polygons = shapely.polygons(np.concatenate([triangles, triangles[:, :1]], axis=1))
    return union(_sound(polygons), grid)


def union(shapes: Geometry, grid: float, *, more: bool = False) -> Geometry:
    """Union of an array of polygons, less corners on straight edges.

    Snap rounding takes the square of the corners on one line, so large sets of polygons are united
    by neighbourhoods, each rid of corners on straight edges, and these in turn.
    """
    polygons = _polygons_in(_round_to_grid(shapes, grid))
    before = 2 * len(polygons) + 1
    while _CHUNK < len(polygons) < before / 2:
        before = len(polygons)
        # Halves of a quadrilateral have one box, but centroids a third of its length apart.
        boxes = shapely.bounds(polygons)
        polygons = polygons[along_a_curve((boxes[:, :2] + boxes[:, 2:]) / 2)]
        chunks = np.array_split(polygons, -(-before // _CHUNK))
        united = np.array([_union(chunk, grid, more) for chunk in chunks])
        polygons = _polygons_in(straighten(united, grid))
    return straighten(_union(polygons, grid, more), grid)


def unite_rows(
    row: Ints, shapes: Geometry, grid: float, *, more: bool = False
) -> tuple[Ints, Geometry]:
    """(g,) the distinct rows, (n,), of shapes, ascending, and the union of the shapes of each,
    without empty unions of shapes as narrow as rounding."""
    if not len(shapes):
        return row, shapes
    order = np.argsort(row, kind="stable")
    names, first, count = np.unique(row[order], return_index=True, return_counts=True)
    shapes = shapes[order]
    united = shapes[first]
    for i in np.flatnonzero(count > 1):
        united[i] = _union(shapes[first[i] : first[i] + count[i]], grid, more)
    some = ~shapely.is_empty(united)
    return names[some], united[some]


def intersection(first: Geometry, second: Geometry, grid: float, *, more: bool = False) -> Geometry:
    """Pairwise intersection."""

    def instead(first: Geometry, second: Geometry) -> Geometry:
        return _common_box(first, second) if more else shapely.Polygon()

    return _polygonal(_overlay(shapely.intersection, first, second, grid, instead))


def difference(first: Geometry, second: Geometry, grid: float) -> Geometry:
    """Pairwise difference, ``first`` less ``second``."""
    return _polygonal(_overlay(shapely.difference, first, second, grid, lambda first, _: first))


def buffer(
    shapes: Geometry, distance: float, *, more: bool = False, **style: str | int
) -> Geometry:
    """Shapes widened by a distance, or narrowed if it is negative.

    ``style``: as in `shapely.buffer`.
    """

    def instead(shape: Geometry) -> Geometry:
        wide = np.array([-1, -1, 1, 1]) * max(distance, 0.0)
        return shapely.box(*(shapely.bounds(shape) + wide)) if more else shape

    def widen(shapes: Geometry) -> Geometry:
        return shapely.buffer(shapes, distance, **style)

    repaired = [lambda shape: widen(_repair(shape))]
    return _apply("buffer", widen, (shapes,), repaired, instead)


def straighten(shapes: Geometry, grid: float) -> Geometry:
    """Shapes without corners on straight edges, except where a polygon would then cross itself."""
    simple = simplify(shapes, grid)
    return np.asarray(np.where(shapely.is_valid(simple), simple, shapes))[()]


def simplify(shapes: Geometry, distance: float) -> Geometry:
    """`shapely.simplify`; a shape at which GEOS gives up stays as it is."""
    return _apply(
        "", lambda shapes: shapely.simplify(shapes, distance), (shapes,), [], lambda shape: shape
    )


def neighbours(polygons: Geometry, gap: float) -> Ints:
    """(n,) the group of each of n polygons: those less than ``gap`` apart are in one, so that a
    T-junction whose edge misses the corner by a rounding still joins."""
    pairs = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=gap)
    return connect(len(polygons), pairs.T)


def open_part(region: Geometry, blocking: Geometry, tolerance: Tolerance) -> Geometry:
    """The unblocked part of a region without cracks narrower than a hairline: a crack under a wall
    would stretch the hull of a door along all of it.

    A morphological opening, grown by twice the erosion and clipped, so that the rest does not
    shrink.
    """
    width, grid = tolerance.hairline, tolerance.grid
    opening = difference(region, blocking, grid)
    core = buffer(opening, -width / 2, join_style="mitre")
    grown = buffer(core, width, more=True, join_style="mitre")
    return intersection(opening, grown, grid, more=True)


def build_areas(segments: Floats, owner: Ints) -> Geometry:
    """The areas that (n, 2, 2) segments bound, one for each run of equal numbers in (n,) ``owner``,
    ascending; empty where GEOS recognises none."""
    lines = shapely.multilinestrings(shapely.linestrings(segments), indices=owner)
    return _apply("triangles", shapely.build_area, (lines,), [], lambda _: shapely.Polygon())


def triangulate_polygons(shapes: Geometry) -> tuple[Floats, Ints]:
    """(m, 3, 2) triangles of an array of polygons, and (m,) the polygon of each, ascending: the
    constrained Delaunay triangulation, whose corners are those of the polygon to the last bit.
    Polygons that GEOS cannot divide so, such as some with touching holes, are left out, counted."""
    parts, polygon = shapely.get_parts(delaunay(shapes), return_index=True)
    triangle = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    corner, owner = shapely.get_coordinates(shapes, return_index=True)
    rows = np.column_stack(
        [
            np.append(owner, np.repeat(polygon, 3)).astype(np.float64),
            np.concatenate([corner, triangle.reshape(-1, 2)]),
        ]
    )
    first, row = distinct(rows)
    fresh = first[row[len(corner) :]] >= len(corner)
    kept = ~np.isin(polygon, np.repeat(polygon, 3)[fresh])
    whole = np.isin(np.arange(len(shapes)), polygon[kept]) | shapely.is_empty(shapes)
    count(["triangles"] * np.count_nonzero(~whole))
    return triangle[kept], polygon[kept]


def delaunay(shapes: Geometry) -> Geometry:
    """The constrained Delaunay triangulations of an array of polygons, which may have corners of
    their own where holes touch; empty for those at which GEOS gives up, which are not counted."""
    return _apply(
        "",
        shapely.constrained_delaunay_triangles,
        (shapes,),
        [],
        lambda _: shapely.GeometryCollection(),
    )


def _overlay(
    operation: Callable[..., Geometry],
    first: Geometry,
    second: Geometry,
    grid: float,
    instead: Callable[[Geometry, Geometry], Geometry],
) -> Geometry:
    """An operation on a grid, pair by pair; see the module's head."""
    first, second = np.broadcast_arrays(np.asarray(first, object), np.asarray(second, object))

    def snap_to(step: float) -> Callable[[Geometry, Geometry], Geometry]:
        return lambda first, second: operation(first, second, grid_size=step)

    def retry(times: float, *, repair: bool) -> Callable[[Geometry, Geometry], Geometry]:
        def attempt(first: Geometry, second: Geometry) -> Geometry:
            both = [_repair(shape) if repair else shape for shape in (first, second)]
            return operation(*both, grid_size=times * _step(grid, both))

        return attempt

    attempts = [retry(times, repair=fix) for fix in (False, True) for times in _COARSER]
    return _apply(operation.__name__, snap_to(grid), (first, second), attempts, instead)


def _union(polygons: Geometry, grid: float, more: bool) -> Geometry:
    """The union of an array of polygons on a grid; see the module's head."""
    try:
        united = shapely.union_all(polygons, grid_size=grid)
        # `_polygonal` of a single shape takes as long as a small union.
        areas = shapely.get_type_id(united) in _AREAS or shapely.is_empty(united)
        return united if areas else _polygonal(united)
    except shapely.GEOSException:
        pass
    if len(polygons) == 1:
        return polygons[0]
    if len(polygons) > 2:
        half = len(polygons) // 2
        parts = [_union(some, grid, more) for some in (polygons[:half], polygons[half:])]
        return _union(_polygonal(np.array(parts)), grid, more)

    def instead(first: Geometry, second: Geometry) -> Geometry:
        if more:
            return shapely.box(*shapely.total_bounds([first, second]))
        return max(first, second, key=shapely.area)

    return _polygonal(_overlay(shapely.union, polygons[0], polygons[-1], grid, instead))


def _apply(
    name: str,
    operation: Callable[..., Geometry],
    operands: Sequence[Geometry],
    again: list[Callable[..., Geometry]],
    instead: Callable[..., Geometry],
) -> Geometry:
    """An operation on all rows of its operands, arrays of one shape or single geometries, at once;
    of those rows at which GEOS gives up, the first of ``again`` that succeeds, or ``instead``. The
    latter counts if the operation has a ``name``."""
    try:
        return operation(*operands)
    except shapely.GEOSException:
        pass
    operands = [np.asarray(operand, object) for operand in operands]
    if (size := operands[0].size) > 1:
        half = size // 2
        sides = (
            [operand[part] for operand in operands] for part in (slice(half), slice(half, None))
        )
        return np.concatenate([_apply(name, operation, side, again, instead) for side in sides])
    single = [operand.reshape(-1)[0] for operand in operands]
    for attempt in again:
        with suppress(shapely.GEOSException):
            value = attempt(*single)
            break
    else:
        count([name] if name else [])
        value = instead(*single)
    array = np.empty(operands[0].shape, object)
    array[...] = value
    return array[()]


def _step(grid: float, shapes: Geometry) -> float:
    """A grid that is not finer than the coordinates of shapes are."""
    largest = float(np.nanmax(np.abs(shapely.get_coordinates(shapes)), initial=0.0))
    return max(grid, _DIGITS * float(np.spacing(largest)))


def _round_to_grid(shapes: Geometry, grid: float) -> Geometry:
    """Polygons with their corners on a grid, where GEOS can; empty if they have no area there."""
    return _apply(
        "",
        lambda shapes: shapely.set_precision(shapes, grid),
        (shapes,),
        [lambda shape: shapely.set_precision(shape, _step(grid, shape)), _repair],
        lambda shape: shape,
    )


def _sound(shapes: Geometry) -> Geometry:
    """Polygons without crossings of their own outlines, where GEOS can."""
    return _apply("", shapely.make_valid, (shapes,), [], lambda shape: shape)


def _repair(shape: Geometry) -> Geometry:
    """The polygons of a shape without crossings of its own outlines."""
    return _polygonal(shapely.make_valid(shape))


def _common_box(first: Geometry, second: Geometry) -> Geometry:
    """The intersection of the boxes around two shapes."""
    a, b = shapely.bounds(first), shapely.bounds(second)
    low, high = np.maximum(a[:2], b[:2]), np.minimum(a[2:], b[2:])
    return shapely.box(*low, *high) if (low < high).all() else shapely.Polygon()


def _polygons_in(shapes: Geometry) -> Geometry:
    """The polygons among the parts of shapes."""
    parts = shapely.get_parts(shapely.get_parts(shapes))
    return parts[shapely.get_dimensions(parts) == 2]


def _polygonal(shapes: Geometry) -> Geometry:
    """Shapes without points and lines."""
    every = np.array(shapes, dtype=object).reshape(-1)
    flat = shapely.get_dimensions(every) < 2
    if flat.any():
        every[flat] = shapely.Polygon()
    for i in np.flatnonzero((shapely.get_type_id(every) == _COLLECTION) & ~flat):
        every[i] = shapely.multipolygons(_polygons_in(every[i]))
    return every if np.ndim(shapes) else every[0]


def triangulate_rings(corner: Floats, start: Ints, polygon: Ints) -> tuple[Ints, Ints]:
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
    owner = np.repeat(polygon, size)
    ready = (corners == 3)[owner]
    rows, others = np.flatnonzero(ready), np.flatnonzero(~ready)
    ring = np.repeat(np.arange(len(size)), size)
    index, parent = _delaunay(corner[others], ring[others], polygon)
    # A corner in which two rings touch is one corner; the joint takes the place of a bridge.
    same = first_alike(np.column_stack([owner[others], corner[others]]))
    index = same[index]
    touching = np.bincount(owner[others][same != np.arange(len(same))], minlength=count)
    triangle = np.concatenate([rows.reshape(-1, 3), others[index]])
    parent = np.concatenate([owner[rows[::3]], parent])
    a, b, c = corner[triangle].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    twice = ux * vy - uy * vx
    triangle[twice < 0] = triangle[twice < 0, ::-1]
    sound = np.bincount(parent, minlength=count) == corners + 2 * rings - 4 - 2 * touching
    sound[parent[twice == 0]] = False
    kept = np.flatnonzero(sound[parent])
    kept = kept[np.argsort(parent[kept], kind="stable")]
    return triangle[kept], parent[kept]


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
    triangles, parent = triangulate_polygons(shapes[sound])
    points, parent = triangles.reshape(-1, 2), sound[parent]
    # The corner of its polygon that each point equals, to the last bit.
    shape = np.concatenate([place[ring], np.repeat(parent, 3)])
    same = first_alike(np.column_stack([shape, np.concatenate([corner, points])]))
    return same[len(corner) :].reshape(-1, 3), owner[parent]
