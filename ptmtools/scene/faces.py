"""Cleans the faces of a model: welds points, drops stray, degenerate and duplicate faces.

Points are welded if their coordinates are equal, not if they are near: nearness is decided by the
planes of the cells. A face is degenerate if its height is below the rounding of the coordinates.
Duplicates have the same three points and winding, in any rotation.

Two walls of opposite winding in one place are paired by their polygons, because a file or a reader
may cut one along the other diagonal: triangles are joined over the edges that one side alone has,
and what then has the same outline, the other way round, is a pair.

A face is a stray if a corner lies a thousand sizes of the model beyond it. All tolerances are
shares of the extent, so one stray at 100 km would take the doorways from a house of 10 m. (Kept as
distant objects with the tolerances of the rest, strays would lie beyond what float32 and the grid
of polygons resolve.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, normals, units
from ptmtools.tolerance import PLANE_SHARE, ROUNDING_SHARE, TIE_SHARE

#: A face is a stray beyond this many sizes of the faces around the middle of the model,
_REACH = 1000.0
#: which come from the corners of this many faces.
_SAMPLE = 1 << 16


@dataclass(frozen=True)
class KeptFaces:
    """The cleaned faces.

    Attributes
    ----------
    points: (V, 3) float64 distinct points in the order of first use, each used.
    triangles: (T, 3) int64 into `points`.
    source: (T,) int64 number of each face before cleaning, increasing.
    paired: (T,) bool, the face, or a flat polygon of which it is a part, has an opposite with the
        same outline and the other winding.
    keeper: (N,) int64 for every face before cleaning: the face kept in its place, or -1 if it was
        dropped as degenerate, stray or not finite.
    not_finite, degenerate: numbers of dropped faces.
    strays: (n,) int64 numbers of the faces dropped as strays, increasing.
    """

    points: Floats
    triangles: Ints
    source: Ints
    paired: Bools
    keeper: Ints
    not_finite: int
    degenerate: int
    strays: Ints


def keep_faces(points: Floats, triangles: Ints) -> KeptFaces:
    """Cleans (T, 3) triangles over (P, 3) points; every index is in range."""
    finite_point = np.asarray(np.isfinite(points).all(axis=1))
    finite = finite_point[triangles].all(axis=1)
    source = np.flatnonzero(finite)
    stray = stray_faces(points, triangles[source])
    strays, source = source[stray], source[~stray]
    welded, index = _weld(points, triangles[source])

    thin = _degenerate(welded, index)
    source, index = source[~thin], index[~thin]
    keeper = np.full(len(triangles), -1, dtype=np.int64)

    # Rotated so that the smallest point is first, two faces differ only by their winding.
    turn = index.argmin(axis=1)[:, None]
    rotated = np.take_along_axis(index, (turn + np.arange(3)) % 3, axis=1)
    ordered = np.sort(index, axis=1)
    winding = rotated[:, 1] > rotated[:, 2]
    order = np.lexsort((winding, ordered[:, 2], ordered[:, 1], ordered[:, 0]))
    same_points = (ordered[order][1:] == ordered[order][:-1]).all(axis=1)
    same_face = same_points & (winding[order][1:] == winding[order][:-1])
    first = np.concatenate([[True], ~same_face])[: len(order)]
    first_equal = order[np.maximum.accumulate(np.where(first, np.arange(len(order)), 0))]
    keeper[source[order]] = source[first_equal]
    # At most two faces with the same points are kept, and they are adjacent in the order.
    kept = order[first]
    pair = (ordered[kept][1:] == ordered[kept][:-1]).all(axis=1)
    paired = np.zeros(len(index), dtype=bool)
    paired[kept[1:][pair]] = True
    paired[kept[:-1][pair]] = True

    kept = np.sort(kept)
    points, index = _compact(welded, index[kept])
    paired = paired[kept]
    alone = np.flatnonzero(~paired)
    paired[alone] = opposite_polygons(points, index[alone])
    return KeptFaces(
        points=points,
        triangles=index,
        source=source[kept],
        paired=paired,
        keeper=keeper,
        not_finite=int((~finite).sum()),
        degenerate=int(thin.sum()),
        strays=strays,
    )


def opposite_polygons(points: Floats, triangles: Ints) -> Bools:
    """(T,) which of (T, 3) triangles over (P, 3) finite points are in a flat polygon with an
    opposite."""
    if len(triangles) < 2:
        return np.zeros(len(triangles), dtype=bool)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    third = np.roll(triangles, 1, axis=1).ravel()
    edge = np.minimum(start, end) * len(points) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    change = np.flatnonzero(np.append(True, edge[order][1:] != edge[order][:-1]))
    two = change[np.diff(np.append(change, len(order))) == 2]
    first, second = order[two], order[two + 1]
    with np.errstate(all="ignore"):  # relative to the extent, as in `_degenerate`
        low = points.min(axis=0)
        extent = float((points.max(axis=0) - low).max())
        local = (points - low) / extent
        normal = normals(local[triangles])
        height = units(normal)[first // 3] * (local[third[second]] - local[start[first]])
        flat = np.abs(height.sum(axis=1)) <= PLANE_SHARE
        flat &= (normal[first // 3] * normal[second // 3]).sum(axis=1) > 0
    inner = flat & (start[first] == end[second])
    first, second = first[inner], second[inner]
    polygon = _groups(len(triangles), first // 3, second // 3)
    outline = np.ones(len(start), dtype=bool)
    outline[first] = outline[second] = False
    # The sum of a mark of each edge of an outline tells it from others, and from its reverse.
    count = int(polygon.max()) + 1
    sums = np.zeros((2, count), dtype=np.uint64)
    owner = np.repeat(polygon, 3)[outline]
    for row, ends in enumerate(((start, end), (end, start))):
        np.add.at(sums[row], owner, _marks(ends[0][outline], ends[1][outline]))
    area = np.zeros((count, 3))
    np.add.at(area, polygon, normal)
    by_outline = np.argsort(sums[0], kind="stable")
    place = np.searchsorted(sums[0], sums[1], sorter=by_outline)
    match = by_outline[np.minimum(place, count - 1)]
    same = np.linalg.norm(area + area[match], axis=1) <= TIE_SHARE * np.linalg.norm(area, axis=1)
    return np.asarray(((sums[0][match] == sums[1]) & same)[polygon])


def _groups(count: int, first: Ints, second: Ints) -> Ints:
    """(count,) a number from 0 for each of the items that pairs join."""
    label = np.arange(count)
    while (label[first] != label[second]).any():
        least = np.minimum(label[first], label[second])
        for side in (first, second):
            np.minimum.at(label, label[side], least)
        label = label[label]
    while (label != label[label]).any():
        label = label[label]
    return np.asarray(np.unique(label, return_inverse=True)[1])


def _marks(start: Ints, end: Ints) -> NDArray[np.uint64]:
    """A number of 64 bits for each directed edge, as if drawn at random (Steele et al. 2014)."""
    mark = start.astype(np.uint64) << np.uint64(32) | end.astype(np.uint64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mark = (mark ^ mark >> np.uint64(shift)) * np.uint64(factor)
    return mark ^ mark >> np.uint64(31)


def stray_faces(points: Floats, triangles: Ints) -> Bools:
    """(T,) which of (T, 3) triangles over (P, 3) points, finite where used, are strays: those
    beyond the first gap of `_REACH` sizes that leaves most triangles on its inner side."""
    none = np.zeros(len(triangles), dtype=bool)
    if not len(triangles):
        return none
    sample = triangles[:: -(-len(triangles) // _SAMPLE)].reshape(-1)
    middle = np.median(points[sample], axis=0)
    with np.errstate(over="ignore", invalid="ignore"):  # of points that no triangle uses, too
        # By the longest coordinate, since the square of 1e308 is infinite.
        radius = np.abs(points - middle).max(axis=1)[triangles].max(axis=1)
        half = len(radius) // 2
        inner = float(np.partition(radius, half)[half])
        if not radius.max() / _REACH > 2 * inner > 0:
            return none
        ordered = np.sort(radius)[half:]
        gap = np.flatnonzero(ordered[1:] / _REACH > 2 * ordered[:-1])
    return radius > ordered[gap[0]] if len(gap) else none


def _weld(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """The distinct used points, and the triangles over them."""
    used, index = _compact(points, triangles)
    if not len(used):
        return used, index
    used = used + 0.0  # -0 is 0
    order = np.lexsort(used.T[::-1])
    distinct = np.concatenate([[True], (used[order][1:] != used[order][:-1]).any(axis=1)])
    number = np.empty(len(used), dtype=np.int64)
    number[order] = np.cumsum(distinct) - 1
    return used[order][distinct], number[index]


def _compact(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """The used points in the order of first use, and the triangles over them."""
    flat = triangles.reshape(-1)
    first = np.full(len(points), len(flat), dtype=np.int64)
    np.minimum.at(first, flat, np.arange(len(flat)))
    used = np.flatnonzero(first < len(flat))
    used = used[np.argsort(first[used])]
    number = np.zeros(len(points), dtype=np.int64)
    number[used] = np.arange(len(used))
    return points[used], number[triangles]


def _degenerate(points: Floats, triangles: Ints) -> Bools:
    """(T,) whether a triangle's height is below the rounding of its coordinates."""
    if not len(triangles):
        return np.zeros(0, dtype=bool)
    low = points.min(axis=0)
    with np.errstate(over="ignore"):
        extent = float((points.max(axis=0) - low).max())
    if not (np.isfinite(extent) and extent > 0):
        # No extent, or one beyond float64, which the caller reports.
        return np.full(len(triangles), not extent > 0)
    # Relative to the extent, so that products of tiny or huge coordinates stay in range.
    local = ((points - low) / extent)[triangles]
    rounding = max(ROUNDING_SHARE, 4 * float(np.spacing(np.abs(points).max())) / extent)
    edge = np.roll(local, -1, axis=1) - local
    longest = np.linalg.norm(edge, axis=2).max(axis=1)
    twice_area = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    thin: Bools = twice_area <= rounding * longest
    return thin
