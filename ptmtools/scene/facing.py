"""Whether a model can be seen from its inside.

Where faces have no backs, as in glTF, a model whose faces are all turned over, or a shell that was
made to be looked at from outside, is empty to whoever stands in its rooms. The places where sample
lines (`lines`) along all axes meet are asked for the faces around them: in the rooms of a sound
model these are turned to the place. Signed volumes tell nothing here: a box is a room seen from
inside or a block seen from outside, and both are right.

Inside a wall it is the other way round, and of thick walls all faces together are as many as of
rooms. But there is little space to one side of every place in a wall, however long it is, so a
place counts for as much as a cube that fits around it.

Sample lines through a model, parallel to an axis, and where they cross its faces.

What lies between two crossings of an upright line is the free height of a room, of a level one its
width: what a building looks like from its inside, without knowing its rooms. The lines are a grid
whose rows are half evenly spaced and half where the points are, so that a house in the middle of a
wide meadow is met, too. Each line stands for the area around it, by which areas are estimated.

Points are ranked among the rows, and a triangle meets the rows between the ranks of its corners:
one pass over the triangles, and work in proportion to the pairs that overlap. The normals of all
triangles, for exact areas, took four times as long."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.tolerance import PLANE_SHARE

#: Rows of the grid in each direction, evenly spaced and where the points are: 24 × 24 lines.
_EVEN, _DENSE = 12, 12
#: The rows stand off the middle of their shares, where walls stand: by the golden section.
_OFF = (5.0**0.5 - 1) / 2
#: So many points are asked where points are.
_ASKED = 20_000
#: Where more pairs of a line and a triangle than this would be tried along an axis, as in a heap of
#: large triangles, every other row is left out until there are fewer: a few seconds at most.
_MOST = 1 << 22
_PLANES = ((0, 1), (0, 2), (1, 2))
#: Pairs that are tried at once.
_AT_ONCE = 1 << 18


@dataclass(frozen=True)
class Crossings:
    """Where sample lines cross triangles, line by line, and along each from low to high.

    Attributes
    ----------
    line: (n,) which line.
    position: (n,) along the axis.
    triangle: (n,) which triangle.
    section: (n,) the area square to the axis that the line stands for.
    """

    line: Ints
    position: Floats
    triangle: Ints
    section: Floats

    def gaps(self) -> tuple[Ints, Floats]:
        """(g,) the crossings that have another behind them on their line, and how far behind."""
        near = np.flatnonzero(self.line[1:] == self.line[:-1])
        return near, self.position[near + 1] - self.position[near]


class SampleLines:
    """The sample lines through (T, 3) ``triangles`` over (V, 3) finite ``points``."""

    def __init__(self, points: Floats, triangles: NDArray[np.integer]) -> None:
        self._points, self._triangles = points, triangles
        self._rows = [_rows(points[:, k]) for k in range(3)]
        self._first = np.empty((3, len(triangles)), dtype=np.int8)
        self._count = np.empty_like(self._first)
        corners = np.ascontiguousarray(triangles.T)
        self._rank(corners)
        while self._tried() > _MOST and max(map(len, self._rows)) > 1:
            self._rows = [row[::2] for row in self._rows]
            self._rank(corners)

    def _rank(self, corners: NDArray[np.integer]) -> None:
        """Finds the rows that each triangle meets: the first, and how many."""
        for k, row in enumerate(self._rows):
            rank = np.searchsorted(row, self._points[:, k]).astype(np.int8)
            a, b, c = (rank[corner] for corner in corners)
            self._first[k] = np.minimum(np.minimum(a, b), c)
            self._count[k] = np.maximum(np.maximum(a, b), c) - self._first[k]

    def _tried(self) -> int:
        """How many pairs of a line and a triangle are tried, along the axis with most of them."""
        count = self._count.astype(np.int16)
        return max(int((count[i] * count[j]).sum(dtype=np.int64)) for i, j in _PLANES)

    def rows(self, axis: int) -> Floats:
        """Where rows of lines stand along ``axis``; line i · n + j is where row i of the first of
        the other axes and row j of the n of the second meet."""
        return self._rows[axis]

    def along(self, axis: int) -> Crossings:
        """Where the lines along ``axis`` (0, 1 or 2) cross the triangles."""
        u, v = (k for k in range(3) if k != axis)
        width = len(self._rows[v])
        pairs = self._count[u].astype(np.int64) * self._count[v]
        line, position, triangle = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(0, np.int64)]
        for met in _in_parts(pairs):
            which = np.repeat(met, pairs[met])
            rank = np.arange(len(which)) - np.repeat(np.cumsum(pairs[met]) - pairs[met], pairs[met])
            i, j = np.divmod(rank, self._count[v][which])
            i, j = i + self._first[u][which], j + self._first[v][which]
            corner = self._points[self._triangles[which]]
            hit, height = _crossed(
                corner[:, :, u] - self._rows[u][i][:, None],
                corner[:, :, v] - self._rows[v][j][:, None],
                corner[:, :, axis],
            )
            line.append((i * width + j)[hit])
            position.append(height)
            triangle.append(which[hit])
        lines, at = np.concatenate(line), np.concatenate(position)
        faces = np.concatenate(triangle)
        order = np.lexsort((faces, at, lines))
        section = np.outer(self._widths(u), self._widths(v)).ravel()
        return Crossings(lines[order], at[order], faces[order], section[lines[order]])

    def _widths(self, axis: int) -> Floats:
        """How wide a strip of the model each row stands for: up to the middle to the next."""
        row, at = self._rows[axis], self._points[:, axis]
        return np.diff(np.concatenate([[at.min()], (row[1:] + row[:-1]) / 2, [at.max()]]))


def _rows(values: Floats) -> Floats:
    """Where the rows stand in one direction."""
    low, high = values.min(), values.max()
    even = low + (np.arange(_EVEN) + _OFF) / _EVEN * (high - low)
    dense = np.quantile(values[:: 1 + len(values) // _ASKED], (np.arange(_DENSE) + _OFF) / _DENSE)
    return np.unique(np.concatenate([even, dense]))


def _in_parts(pairs: Ints) -> Iterator[Ints]:
    """The triangles that have pairs, so many at a time that they can be tried at once."""
    met = np.flatnonzero(pairs)
    part = np.cumsum(pairs[met]) // _AT_ONCE
    yield from np.split(met, np.flatnonzero(np.diff(part)) + 1) if len(met) else ()


def _crossed(x: Floats, y: Floats, z: Floats) -> tuple[Bools, Floats]:
    """(n,) whether the line along z through the origin meets each triangle, whose corners have the
    coordinates (n, 3); and, of those that it meets, at what z."""
    one, other = [1, 2, 0], [2, 0, 1]
    weight = x[:, one] * y[:, other] - y[:, one] * x[:, other]
    total = weight.sum(axis=1)
    hit = (np.all(weight >= 0, axis=1) | np.all(weight <= 0, axis=1)) & (total != 0)
    return hit, (weight[hit] * z[hit]).sum(axis=1) / total[hit]


#: A place with less space to one side of it, in metres, may lie in a wall or a cupboard.
ROOM = 1.5
#: Above this share of what bounds rooms of which nothing is seen, a model is inside out.
TURNED_AWAY = 0.5


def turned_away(points: Floats, triangles: NDArray[np.integer], backed: Bools) -> float:
    """The share of what bounds rooms whose face is turned away from the room, 0 to 1.

    ``points`` are (V, 3) in metres, ``triangles`` (T, 3), and ``backed`` is (T,), which of them are
    seen from both sides.
    """
    if backed.all():
        return 0.0
    lines = SampleLines(points, triangles)
    around = [_along(lines, axis, points, triangles, backed) for axis in range(3)]
    spaces, turned = (np.array(each) for each in zip(*around, strict=True))
    space, bounded = spaces.min(axis=0), np.isfinite(spaces).sum(axis=0)
    # What has a face on either side along one axis alone may be the space between two houses.
    room = (bounded >= 2) & (space >= ROOM)
    space, bounded = space[room], bounded[room]
    strips = np.array(np.meshgrid(*(_strips(lines.rows(k)) for k in range(3)), indexing="ij"))
    weight = strips[:, room].prod(axis=0) * space**3
    ends = 2 * weight @ bounded
    return float(weight @ turned.sum(axis=0)[room] / ends) if ends else 0.0


def _strips(row: Floats) -> Floats:
    """How wide a strip each place in a row stands for: as far as to the nearer of its neighbours,
    so that one at the edge of a house does not stand for a part of the meadow."""
    if len(row) < 2:
        return np.ones(len(row))
    step = np.diff(row, prepend=2 * row[0] - row[1], append=2 * row[-1] - row[-2])
    return np.asarray(np.minimum(step[1:], step[:-1]))


def _along(
    lines: SampleLines, axis: int, points: Floats, triangles: NDArray[np.integer], backed: Bools
) -> tuple[Floats, Ints]:
    """Of each place, in a grid of three dimensions: how far apart the two surfaces are between
    which it lies along the axis, infinite if it does not, and how many of them are turned away."""
    found = lines.along(axis)
    rows = [lines.rows(k) for k in range(3)]
    width, depth = (len(row) for k, row in enumerate(rows) if k != axis)
    space = np.full((width * depth, len(rows[axis])), np.inf)
    away = np.zeros(space.shape, dtype=np.int64)
    if len(found.line):
        a, b, c = np.moveaxis(points[triangles[found.triangle]], 1, 0)
        u, v = (axis + 1) % 3, (axis + 2) % 3
        one, other = b - a, c - a
        along = one[:, u] * other[:, v] - one[:, v] * other[:, u] > 0
        both = backed[found.triangle]
        # Faces in one place are one surface, which shows what any of them shows.
        near = np.zeros(len(found.line), dtype=bool)
        after, gap = found.gaps()
        near[after + 1] = gap <= PLANE_SHARE * float(np.ptp(points, axis=0).max())
        first = np.flatnonzero(~near)
        hidden_above = ~np.logical_or.reduceat(both | along, first)
        hidden_below = ~np.logical_or.reduceat(both | ~along, first)
        line, at = found.line[first], found.position[first]
        low = np.flatnonzero(line[1:] == line[:-1])
        start, end = (np.searchsorted(rows[axis], at[k]) for k in (low, low + 1))
        met = end - start
        before = np.repeat(low, met)
        place = np.arange(len(before)) - np.repeat(np.cumsum(met) - met - start, met)
        space[line[before], place] = at[before + 1] - at[before]
        away[line[before], place] = hidden_above[before].astype(int) + hidden_below[before + 1]
    shape = (width, depth, -1)
    return np.moveaxis(space.reshape(shape), 2, axis), np.moveaxis(away.reshape(shape), 2, axis)
