"""Points spread evenly over triangles (paper 2, §3.1: the samples that the octree is built of).

Rows parallel to the longest edge, as far from each other as the points of a row: so thin triangles,
which simplification leaves in flat places, get no more points than their area asks for, and no gaps
along their length. (Tried: the middles of a regular division into n² similar triangles; in thin
ones its points are many times farther apart one way than the other.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ptmtools.arrays import Floats, Ints

#: By so much points are moved apart where they are too many.
_FARTHER = 1.25


class Points(NamedTuple):
    """Points of triangles.

    Attributes
    ----------
    triangle: (n,) which one each lies in, ascending. weight: (n, 3) of its corners; the sum is 1.
    """

    triangle: Ints
    weight: Floats


def areas(corner: Floats) -> Floats:
    """(m,) of (m, 3, 3) triangles."""
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    found: Floats = np.linalg.norm(cross, axis=1) / 2
    return found


def longest_first(corner: Floats) -> Ints:
    """(m,) the corner at which the longest edge of each of (m, 3, 3) triangles begins."""
    edge = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    found: Ints = edge.argmax(axis=1)
    return found


def spacing_for(corner: Floats, count: float) -> float:
    """How far apart ``count`` points of (m, 3, 3) triangles are.

    By area, unless thin triangles, whose points are a row however thin they are, would then have
    more than as many again: then farther.
    """
    area = areas(corner)
    longest = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2).max(axis=1)
    height = np.divide(2 * area, longest, out=np.zeros(len(corner)), where=longest > 0)
    spacing = float(np.sqrt(area.sum() / count))
    if not spacing:
        return spacing
    # At least one in each, so this ends.
    while _points(height, longest, spacing) > 2 * max(count, len(corner)):
        spacing *= _FARTHER
    return spacing


def _points(height: Floats, longest: Floats, spacing: float) -> float:
    """About how many points triangles have."""
    rows = np.maximum(height / spacing, 1)
    return float((rows * np.maximum(longest / (2 * spacing), 1)).sum())


def spread(corner: Floats, spacing: float) -> Points:
    """Points of (m, 3, 3) triangles, about ``spacing`` apart; at least one in each."""
    count = len(corner)
    first = longest_first(corner)
    each = np.arange(count)
    begin, end = (corner[each, (first + k) % 3] for k in range(2))
    longest = np.linalg.norm(end - begin, axis=1)
    height = np.divide(2 * areas(corner), longest, out=np.zeros(count), where=longest > 0)
    rows = np.maximum(np.rint(height / spacing), 1).astype(np.int64)
    row_triangle, row = _counted(rows)
    up = (row + 0.5) / rows[row_triangle]
    width = longest[row_triangle] * (1 - up)
    columns = np.maximum(np.rint(width / spacing), 1).astype(np.int64)
    point_row, column = _counted(columns)
    along = (column + 0.5) / columns[point_row]
    triangle, up = row_triangle[point_row], up[point_row]
    turned = np.stack([(1 - up) * (1 - along), (1 - up) * along, up], axis=1)
    # Back to the order in which the triangles have their corners.
    place = (np.arange(3) - first[triangle][:, None]) % 3
    return Points(triangle, np.take_along_axis(turned, place, axis=1))


def _counted(counts: Ints) -> tuple[Ints, Ints]:
    """Of each of ``counts`` things: (n,) whose it is, and its number among those."""
    whose = np.repeat(np.arange(len(counts)), counts)
    begin = np.cumsum(counts) - counts
    return whose, np.arange(len(whose)) - begin[whose]


def at(values: Floats, points: Points) -> Floats:
    """(n, k) what (m, 3, k) values of corners are at points."""
    found: Floats = np.einsum("ij,ijk->ik", points.weight, values[points.triangle])
    return found
