"""Measures the rooms of a model: their clear heights, and how tall a visitor fits into them.

The body of a visitor is a cylinder: it fits at a place if the free height and the free width there
suffice. Places are the intersections of the sample lines along all three axes (`facing`), weighted
by volume. A place is *in a room* if the next face below is level and upright faces enclose it on
both sides along at least one level axis: rooms with or without a ceiling, courts and streets, but
neither a roof nor the folds of a statue. Without any face below, as in blocks of a city without a
ground, the next face above must be level, and upright faces enclose the place along both axes:
there is no room under a table. Without a ceiling or a floor a room is as high as its walls.

The interior of a wall is too slender for a room: without this condition, walls without floors,
19 × 11.4 × 3 m, count as rooms for visitors of at most 0.68 m. In all made and real
buildings of the tests, read in their own unit, the default visitor fits at 60 % of the places or
more; the rest lies in furniture and slabs. The free width along the sample lines is an upper bound
of that in other directions.

Tried and rejected: the height of the whole model as that of rooms without a ceiling, which a belfry
determines; the heights of all places instead of those with a ceiling, which in a city are mostly
those of its streets.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.scene.orientation.facing import Crossings, SampleLines, strips

#: Radius and height of a visitor in metres: the default of ``--walker``.
RADIUS, HEIGHT = 0.25, 1.7
#: Smallest share of places in rooms among all enclosed places; with fewer, the model has no rooms
#: to judge by. The made and real buildings of the tests have 52 % or more, a table has 29 %.
_ROOMS = 0.4
#: Smallest share of places with a ceiling from which on only their heights count: blocks in a city
#: and houses around a court have storeys, streets and courts have none.
_ROOFED = 0.3
#: Greatest height of a room as a multiple of its width, and greatest width as a multiple of its
#: height: a slenderer space lies inside a wall, a flatter one inside a slab.
_SLENDER, _FLAT = 5.0, 100.0
#: Number of quantiles of a distribution.
QUANTILES = 20
#: Largest relative difference of heights that count as equal.
_SAME = 0.1


def enclosing(lines: SampleLines, crossings: Crossings, axis: int) -> tuple[Ints, Ints]:
    """For each place of the grid in three dimensions, the crossings before and after it on its line
    along ``axis``; -1 without one."""
    rows = [lines.rows(k) for k in range(3)]
    u, v = (k for k in range(3) if k != axis)
    count = len(rows[u]) * len(rows[v])
    shape = (len(rows[u]), len(rows[v]), len(rows[axis]))
    below = np.full((count, shape[2]), -1, dtype=np.int64)
    above = below.copy()
    if len(crossings.line):
        # One sorted key for line and position, by rank among the rows: exact at any size.
        rank = np.searchsorted(rows[axis], crossings.position)
        key = crossings.line * (shape[2] + 1) + rank
        place = np.arange(count)[:, None] * (shape[2] + 1) + np.arange(shape[2])
        after = np.searchsorted(key, place, "right")
        number = np.arange(count)[:, None]
        last, first = after - 1, np.minimum(after, len(key) - 1)
        below = np.where((last >= 0) & (crossings.line[last] == number), last, -1)
        above = np.where((after < len(key)) & (crossings.line[first] == number), first, -1)
    return (
        np.moveaxis(below.reshape(shape), 2, axis),
        np.moveaxis(above.reshape(shape), 2, axis),
    )


@dataclass(frozen=True)
class RoomSizes:
    """The size of the rooms of a model with one axis up, in units of its points.

    Attributes
    ----------
    visitors: heights of the tallest visitor at the places in rooms: `QUANTILES` quantiles by
        volume, ascending; none if the model has no rooms.
    heights: quantiles of the clear heights, of the places with a ceiling if ``roofed``.
    roofed: whether at least `_ROOFED` of the rooms have a ceiling.
    """

    visitors: tuple[float, ...] = ()
    heights: tuple[float, ...] = ()
    roofed: bool = False

    @property
    def storey(self) -> tuple[float, float]:
        """The clear height of most rooms, and the share of rooms that have it; 0 without rooms."""
        heights = self.heights
        equal = [sum(h <= height <= h * (1 + _SAME) for height in heights) for h in heights]
        usual = max(range(len(heights)), key=lambda k: equal[k] * heights[k], default=-1)
        return (heights[usual], equal[usual] / len(heights)) if heights else (0.0, 0.0)

    def share(self, height: float) -> float:
        """The share of places at which a visitor of this height fits; 1 without rooms."""
        fitting = len(self.visitors) - bisect_left(self.visitors, height)
        return fitting / len(self.visitors) if self.visitors else 1.0

    def times(self, scale: float) -> RoomSizes:
        """The same in units ``scale`` times as small."""
        return RoomSizes(
            tuple(height * scale for height in self.visitors),
            tuple(height * scale for height in self.heights),
            self.roofed,
        )


NO_ROOMS = RoomSizes()


def room_sizes(
    lines: SampleLines,
    crossings: Sequence[Crossings],
    level: Bools,
    upright: Sequence[Bools],
    axis: int,
) -> RoomSizes:
    """The size of the rooms with ``axis`` up.

    ``crossings`` are those along each axis; ``upright`` is (n,) for each, whether the face crossed
    is upright, and ``level`` is (n,) for ``axis``.
    """
    if not all(len(crossing.position) for crossing in crossings):
        return NO_ROOMS
    enclosed = [enclosing(lines, crossings[k], k) for k in range(3)]
    before, after = enclosed[axis]
    at = crossings[axis].position
    floored, roofed = before >= 0, after >= 0
    closed = floored & roofed
    width, walls = np.full(before.shape, np.inf), np.zeros(before.shape, dtype=np.int64)
    for k in range(3):
        if k == axis:
            continue
        low, high = enclosed[k]
        both = (low >= 0) & (high >= 0)
        walls += both & upright[k][low] & upright[k][high]
        position = crossings[k].position
        width = np.minimum(width, np.where(both, position[high] - position[low], np.inf))
        closed |= both & (floored | roofed)
    rooms = np.where(floored, level[before] & (walls > 0), roofed & level[after] & (walls == 2))
    # Without a ceiling or a floor, a room ends where its walls end.
    row = lines.rows(axis)
    ends = np.concatenate(
        [[min(row[0], at.min())], (row[1:] + row[:-1]) / 2, [max(row[-1], at.max())]]
    )
    shape = [1, 1, 1]
    shape[axis] = -1
    lower, upper = ends[:-1].reshape(shape), ends[1:].reshape(shape)
    bottom = np.where(rooms & ~floored, lower, np.inf).min(axis, keepdims=True)
    top = np.where(rooms & ~roofed, upper, -np.inf).max(axis, keepdims=True)
    bottom, top = np.where(floored, at[before], bottom), np.where(roofed, at[after], top)
    height = np.where(rooms, top, 0.0) - np.where(rooms, bottom, 0.0)
    rooms &= (width < height * _FLAT) & (height < width * _SLENDER)
    volume = np.einsum("i,j,k->ijk", *(strips(lines.rows(k)) for k in range(3)))
    total = volume[rooms].sum()
    if not total > _ROOMS * volume[closed].sum():
        return NO_ROOMS
    body = np.minimum(height, width * (HEIGHT / (2 * RADIUS)))
    ceiling = bool(volume[rooms & roofed].sum() >= _ROOFED * total)
    counted = rooms & roofed if ceiling else rooms
    return RoomSizes(
        _quantiles(body[rooms], volume[rooms]),
        _quantiles(height[counted], volume[counted]),
        ceiling,
    )


def _quantiles(values: Floats, weights: Floats) -> tuple[float, ...]:
    order = np.argsort(values, kind="stable")
    share = np.cumsum(weights[order])
    wanted = (np.arange(QUANTILES) + 0.5) / QUANTILES * share[-1]
    chosen = np.minimum(np.searchsorted(share, wanted), len(order) - 1)
    return tuple(values[order[chosen]].tolist())
