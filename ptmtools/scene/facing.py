"""Whether a model can be seen from its inside.

Where faces have no backs, as in glTF, a model whose faces are all turned over, or a shell that was
made to be looked at from outside, is empty to whoever stands in its rooms. The places where sample
lines (`lines`) along all axes meet are asked for the faces around them: in the rooms of a sound
model these are turned to the place. Signed volumes tell nothing here: a box is a room seen from
inside or a block seen from outside, and both are right.

Inside a wall it is the other way round, and of thick walls all faces together are as many as of
rooms. But there is little space to one side of every place in a wall, however long it is, so a
place counts for as much as a cube that fits around it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.scene.lines import SampleLines
from ptmtools.tolerance import PLANE_SHARE

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
