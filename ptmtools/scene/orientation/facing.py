"""Crosses a model with sample lines, and computes the share of room surfaces that face away.

**Sample lines** are parallel to an axis. The distance between two crossings is the free height of a
room on a vertical line, and its width on a level one: the shape of the interior without knowledge
of the rooms. The lines form a grid whose rows are half evenly spaced and half distributed like the
points, so that they also hit a house in the middle of a wide meadow. Each line represents the area
around it, which gives estimates of areas. Points are ranked among the rows, and a triangle meets
the rows between the ranks of its corners: one pass over the triangles, and work in proportion to
the overlapping pairs. Exact areas from the normals of all triangles took four times as long.

**Facing.** With one-sided faces, as in glTF, a model with inverted faces, or a shell modelled to be
viewed from outside, is invisible from its rooms. `share_turned_away` examines the faces around each
intersection of sample lines along all axes: in the rooms of a correct model they are turned towards
it. Signed volumes do not help: a box is a room seen from inside or a block seen from outside, and
both are valid.

Inside a wall the faces are turned away, and thick walls have as many faces as rooms. But any place
in a wall has little space to one side, so a place is weighted with the cube that fits around it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.tolerance import PLANE_SHARE

#: Rows of the grid in each direction, evenly spaced and where the points are: 24 × 24 lines.
_EVEN, _DENSE = 12, 12
#: Position of a row in its interval: the golden section, because walls often stand in the middle.
_OFFSET = (5.0**0.5 - 1) / 2
#: Number of points that determine the distribution of the dense rows.
_SAMPLE = 20_000
#: Largest number of pairs of a line and a triangle along an axis. Above it, as in a heap of large
#: triangles, every second row is removed until there are fewer: a few seconds at most.
_MOST_PAIRS = 1 << 22
_PLANES = ((0, 1), (0, 2), (1, 2))
#: Pairs of one batch.
_BATCH = 1 << 18


@dataclass(frozen=True)
class Crossings:
    """The crossings of sample lines and triangles, by line and by position.

    Attributes
    ----------
    line: (n,) number of the line.
    position: (n,) coordinate along the axis.
    triangle: (n,) number of the triangle.
    section: (n,) area perpendicular to the axis that the line represents.
    """

    line: Ints
    position: Floats
    triangle: Ints
    section: Floats

    def gaps(self) -> tuple[Ints, Floats]:
        """(g,) the crossings with a next one on their line, and the distances to it."""
        before = np.flatnonzero(self.line[1:] == self.line[:-1])
        return before, self.position[before + 1] - self.position[before]


class SampleLines:
    """The sample lines through (T, 3) ``triangles`` over (V, 3) finite ``points``."""

    def __init__(self, points: Floats, triangles: NDArray[np.integer]) -> None:
        self._points, self._triangles = points, triangles
        self._rows = [_rows(points[:, k]) for k in range(3)]
        self._first = np.empty((3, len(triangles)), dtype=np.int8)
        self._count = np.empty_like(self._first)
        corners = np.ascontiguousarray(triangles.T)
        self._rank(corners)
        while self._pairs() > _MOST_PAIRS and max(map(len, self._rows)) > 1:
            self._rows = [row[::2] for row in self._rows]
            self._rank(corners)

    def _rank(self, corners: NDArray[np.integer]) -> None:
        """Computes the first row and the number of rows that each triangle meets."""
        for k, row in enumerate(self._rows):
            rank = np.searchsorted(row, self._points[:, k]).astype(np.int8)
            a, b, c = (rank[corner] for corner in corners)
            self._first[k] = np.minimum(np.minimum(a, b), c)
            self._count[k] = np.maximum(np.maximum(a, b), c) - self._first[k]

    def _pairs(self) -> int:
        """The number of pairs of a line and a triangle, along the axis with most of them."""
        count = self._count.astype(np.int16)
        return max(int((count[i] * count[j]).sum(dtype=np.int64)) for i, j in _PLANES)

    def rows(self, axis: int) -> Floats:
        """The coordinates of the rows along ``axis``. Line i · n + j along the third axis is the
        intersection of row i of the first other axis and row j of the n of the second."""
        return self._rows[axis]

    def crossings(self, axis: int) -> Crossings:
        """The crossings of the lines along ``axis`` (0, 1 or 2)."""
        u, v = (k for k in range(3) if k != axis)
        width = len(self._rows[v])
        pairs = self._count[u].astype(np.int64) * self._count[v]
        line, position, triangle = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(0, np.int64)]
        for batch in _batches(pairs):
            count = pairs[batch]
            face = np.repeat(batch, count)
            rank = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
            i, j = np.divmod(rank, self._count[v][face])
            i, j = i + self._first[u][face], j + self._first[v][face]
            corner = self._points[self._triangles[face]]
            hit, height = _cross_triangles(
                corner[:, :, u] - self._rows[u][i][:, None],
                corner[:, :, v] - self._rows[v][j][:, None],
                corner[:, :, axis],
            )
            line.append((i * width + j)[hit])
            position.append(height)
            triangle.append(face[hit])
        lines, at = np.concatenate(line), np.concatenate(position)
        faces = np.concatenate(triangle)
        order = np.lexsort((faces, at, lines))
        section = np.outer(self._widths(u), self._widths(v)).ravel()
        return Crossings(lines[order], at[order], faces[order], section[lines[order]])

    def _widths(self, axis: int) -> Floats:
        """The width of the strip that each row represents, up to halfway to the next row."""
        row, at = self._rows[axis], self._points[:, axis]
        return np.diff(np.concatenate([[at.min()], (row[1:] + row[:-1]) / 2, [at.max()]]))


def _rows(values: Floats) -> Floats:
    """The coordinates of the rows in one direction."""
    low, high = values.min(), values.max()
    shares = np.arange(_EVEN) + _OFFSET, np.arange(_DENSE) + _OFFSET
    even = low + shares[0] / _EVEN * (high - low)
    dense = np.quantile(values[:: 1 + len(values) // _SAMPLE], shares[1] / _DENSE)
    return np.unique(np.concatenate([even, dense]))


def _batches(pairs: Ints) -> Iterator[Ints]:
    """The triangles with pairs, in batches."""
    faces = np.flatnonzero(pairs)
    batch = np.cumsum(pairs[faces]) // _BATCH
    yield from np.split(faces, np.flatnonzero(np.diff(batch)) + 1) if len(faces) else ()


def _cross_triangles(x: Floats, y: Floats, z: Floats) -> tuple[Bools, Floats]:
    """(n,) whether the line along z through the origin crosses each triangle, whose corners have
    the coordinates (n, 3); and z of the crossings."""
    after, before = [1, 2, 0], [2, 0, 1]
    weight = x[:, after] * y[:, before] - y[:, after] * x[:, before]
    total = weight.sum(axis=1)
    hit = (np.all(weight >= 0, axis=1) | np.all(weight <= 0, axis=1)) & (total != 0)
    return hit, (weight[hit] * z[hit]).sum(axis=1) / total[hit]


#: Smallest space of a room, metres: a place with less may lie in a wall or a cupboard.
ROOM = 1.5
#: Share of room surfaces facing away from which on a model is inside out.
TURNED_AWAY = 0.5


def share_turned_away(points: Floats, triangles: NDArray[np.integer], two_sided: Bools) -> float:
    """The share of the surfaces around rooms that face away from the room, 0 to 1.

    ``points`` are (V, 3) in metres, ``triangles`` (T, 3), and ``two_sided`` is (T,).
    """
    if two_sided.all():
        return 0.0
    lines = SampleLines(points, triangles)
    parts = [_places(lines, axis, points, triangles, two_sided) for axis in range(3)]
    spaces, turned = (np.array(part) for part in zip(*parts, strict=True))
    space, bounded = spaces.min(axis=0), np.isfinite(spaces).sum(axis=0)
    # A place between faces along one axis only may lie between two houses.
    room = (bounded >= 2) & (space >= ROOM)
    space, bounded = space[room], bounded[room]
    widths = np.array(np.meshgrid(*(strips(lines.rows(k)) for k in range(3)), indexing="ij"))
    weight = widths[:, room].prod(axis=0) * space**3
    ends = 2 * weight @ bounded
    return float(weight @ turned.sum(axis=0)[room] / ends) if ends else 0.0


def strips(row: Floats) -> Floats:
    """The width that each place of a row represents: the distance to the nearer neighbour, so that
    a place at the edge of a house does not represent a part of the meadow."""
    if len(row) < 2:
        return np.ones(len(row))
    step = np.diff(row, prepend=2 * row[0] - row[1], append=2 * row[-1] - row[-2])
    return np.asarray(np.minimum(step[1:], step[:-1]))


def _places(
    lines: SampleLines, axis: int, points: Floats, triangles: NDArray[np.integer], two_sided: Bools
) -> tuple[Floats, Ints]:
    """For each place of the grid in three dimensions: the distance of the two surfaces that enclose
    it along the axis, infinite without them, and the number of these that face away from it."""
    crossings = lines.crossings(axis)
    rows = [lines.rows(k) for k in range(3)]
    width, depth = (len(row) for k, row in enumerate(rows) if k != axis)
    space = np.full((width * depth, len(rows[axis])), np.inf)
    away = np.zeros(space.shape, dtype=np.int64)
    if len(crossings.line):
        a, b, c = np.moveaxis(points[triangles[crossings.triangle]], 1, 0)
        u, v = (axis + 1) % 3, (axis + 2) % 3
        ab, ac = b - a, c - a
        upward = ab[:, u] * ac[:, v] - ab[:, v] * ac[:, u] > 0
        both = two_sided[crossings.triangle]
        # Coincident faces are one surface, visible from every side from which one of them is.
        near = np.zeros(len(crossings.line), dtype=bool)
        previous, gap = crossings.gaps()
        near[previous + 1] = gap <= PLANE_SHARE * float(np.ptp(points, axis=0).max())
        first = np.flatnonzero(~near)
        hidden_above = ~np.logical_or.reduceat(both | upward, first)
        hidden_below = ~np.logical_or.reduceat(both | ~upward, first)
        line, at = crossings.line[first], crossings.position[first]
        low = np.flatnonzero(line[1:] == line[:-1])
        start, end = (np.searchsorted(rows[axis], at[k]) for k in (low, low + 1))
        count = end - start
        before = np.repeat(low, count)
        place = np.arange(len(before)) - np.repeat(np.cumsum(count) - count - start, count)
        space[line[before], place] = at[before + 1] - at[before]
        away[line[before], place] = hidden_above[before].astype(int) + hidden_below[before + 1]
    shape = (width, depth, -1)
    return np.moveaxis(space.reshape(shape), 2, axis), np.moveaxis(away.reshape(shape), 2, axis)
