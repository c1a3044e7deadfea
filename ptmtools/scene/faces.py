"""Which faces of a model are kept: welding, degenerate faces, duplicates.

Points are welded where their coordinates are equal, not where they are near: what is near is for
the planes of the cells to judge. A face is degenerate where its height is below the rounding of
the coordinates themselves. Duplicates are found by their three points, whichever comes first and
whichever way round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.tolerance import ROUNDING_SHARE


@dataclass(frozen=True)
class KeptFaces:
    """The faces that remain.

    Attributes
    ----------
    points: (V, 3) float64 distinct points in the order of first use, each used.
    triangles: (T, 3) int64 into `points`.
    source: (T,) int64 the kept faces' numbers before, increasing.
    paired: (T,) bool, another kept face has the same points and the opposite winding.
    also: (N,) int64 for every face before: the face kept in its place (itself, if it is kept), or
        -1 where it was dropped as degenerate or not finite.
    not_finite, degenerate: numbers of dropped faces.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    source: NDArray[np.int64]
    paired: NDArray[np.bool_]
    also: NDArray[np.int64]
    not_finite: int
    degenerate: int


def keep_faces(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> KeptFaces:
    """Clean (T, 3) triangles over (P, 3) points; every index is in range."""
    finite_point = np.asarray(np.isfinite(points).all(axis=1))
    finite = finite_point[triangles].all(axis=1)
    source = np.flatnonzero(finite)
    welded, index = _weld(points, triangles[source])

    thin = _degenerate(welded, index)
    source, index = source[~thin], index[~thin]
    also = np.full(len(triangles), -1, dtype=np.int64)

    # Rotated so that the smallest point is first, two faces differ only by their winding.
    turn = index.argmin(axis=1)[:, None]
    rotated = np.take_along_axis(index, (turn + np.arange(3)) % 3, axis=1)
    ordered = np.sort(index, axis=1)
    winding = rotated[:, 1] > rotated[:, 2]
    order = np.lexsort((winding, ordered[:, 2], ordered[:, 1], ordered[:, 0]))
    same_points = (ordered[order][1:] == ordered[order][:-1]).all(axis=1)
    same_face = same_points & (winding[order][1:] == winding[order][:-1])
    first = np.concatenate([[True], ~same_face])[: len(order)]
    keeper = order[np.maximum.accumulate(np.where(first, np.arange(len(order)), 0))]
    also[source[order]] = source[keeper]
    # Of faces with the same points at most two are kept, and they stand next to one another.
    kept = order[first]
    pair = (ordered[kept][1:] == ordered[kept][:-1]).all(axis=1)
    paired = np.zeros(len(index), dtype=bool)
    paired[kept[1:][pair]] = True
    paired[kept[:-1][pair]] = True

    kept = np.sort(kept)
    points, index = _compact(welded, index[kept])
    return KeptFaces(
        points=points,
        triangles=index,
        source=source[kept],
        paired=paired[kept],
        also=also,
        not_finite=int((~finite).sum()),
        degenerate=int(thin.sum()),
    )


def _weld(
    points: NDArray[np.float64], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Distinct used points, and the triangles over them."""
    used, index = _compact(points, triangles)
    if not len(used):
        return used, index
    used = used + 0.0  # -0 is 0
    order = np.lexsort(used.T[::-1])
    distinct = np.concatenate([[True], (used[order][1:] != used[order][:-1]).any(axis=1)])
    number = np.empty(len(used), dtype=np.int64)
    number[order] = np.cumsum(distinct) - 1
    return used[order][distinct], number[index]


def _compact(
    points: NDArray[np.float64], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Only the points in use, in the order of first use."""
    flat = triangles.reshape(-1)
    first = np.full(len(points), len(flat), dtype=np.int64)
    np.minimum.at(first, flat, np.arange(len(flat)))
    used = np.flatnonzero(first < len(flat))
    used = used[np.argsort(first[used])]
    number = np.zeros(len(points), dtype=np.int64)
    number[used] = np.arange(len(used))
    return points[used], number[triangles]


def _degenerate(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(T,) whether a triangle's height is below the rounding of its coordinates."""
    if not len(triangles):
        return np.zeros(0, dtype=bool)
    low = points.min(axis=0)
    with np.errstate(over="ignore"):
        extent = float((points.max(axis=0) - low).max())
    if not (np.isfinite(extent) and extent > 0):
        # No size, or one beyond float64: for the caller to report.
        return np.full(len(triangles), not extent > 0)
    # In shares of the extent, so that neither tiny nor huge coordinates leave float64's range.
    local = ((points - low) / extent)[triangles]
    rounding = max(ROUNDING_SHARE, 4 * float(np.spacing(np.abs(points).max())) / extent)
    edge = np.roll(local, -1, axis=1) - local
    longest = np.linalg.norm(edge, axis=2).max(axis=1)
    twice_area = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    thin: NDArray[np.bool_] = twice_area <= rounding * longest
    return thin
