"""Floors to which a way leads from a room: the places of a building without roofs, plenums, terrain
and the hollows of walls.

Two regions of floor are **joined** if a visitor steps from one to the other: somewhere they are no
farther apart in plan than a stride, and in height than a step, and nothing solid is between the
bodies there. Door leaves are no obstacle (`find_places`). Regions that joins connect with a room
are kept. A room is a region of which most points are between walls and under a ceiling
(`room_kinds`), a region in a space that the model names, or one below a camera or a viewpoint.

Where the model has no such region, all floors stay. Where ways lead to a small part of the floors
only and the model names no spaces, as in a town with a kiosk, open ground and roofs stay, too.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, sum_by_group
from ptmtools.cells.named_rooms import Volume
from ptmtools.cells.options import Walker
from ptmtools.cells.places import Places, heights, heights_above
from ptmtools.cells.planar import Geometry
from ptmtools.cells.planes import PLAN
from ptmtools.cells.room_kinds import SpaceKind, space_kinds
from ptmtools.cells.search import connect
from ptmtools.cells.structure import Surroundings
from ptmtools.tolerance import Tolerance

#: Greatest distance of regions that are joined, metres for the default visitor (`Walker.scale`);
#: below the second, nothing is between them.
_STRIDE, _TOUCH = 0.5, 0.02
#: Points of a region that tell whether it is a room, and lines tried between two regions.
_LOOKS, _LINES = 9, 8
#: Joined regions smaller than this, m², are no room: tops of tables, hollows.
_LEAST = 0.5
#: Without named spaces, ways lead to at least this share of all floor, or open ground stays, too.
_SHARE = 0.25


def floors_with_ways(
    places: Places,
    around: Surroundings,
    walker: Walker,
    tolerance: Tolerance,
    rooms: tuple[Volume, ...],
    eyes: Floats,
    roofless: bool,
) -> Bools:
    """(r,) which of the regions of ``places`` visitors reach from a room; all if none is a room.

    Parameters
    ----------
    around: what is solid.
    rooms: the spaces that the model names.
    eyes: (n, 3) cameras and viewpoints, metres.
    roofless: whether rooms end at the top of their walls, so that courts stay beside rooms.
    """
    count = len(places.plan)
    every = np.ones(count, dtype=np.bool_)
    corners, region = places.triangles_by_region(tolerance)
    if count < 2 or not len(corners):
        return every
    size = sum_by_group(region, areas(corners), count)
    region, middle, weight = _look_points(corners, region, walker.radius**2)
    middle[:, 1] += walker.middle
    named = np.zeros(count, dtype=np.bool_)
    for room in rooms:
        named[region[room.contains(middle)]] = True
    group = connect(count, _joins(places, around, walker))
    height = np.full(len(middle), walker.middle)
    kind = space_kinds(around, middle[:, None], height, weight, walker.scale)
    for_most = partial(_for_most, region=region, weight=weight, count=count)
    enclosed, ground = for_most(kind <= SpaceKind.HALL), for_most(kind <= SpaceKind.OPEN)
    enclosed &= sum_by_group(group, size * enclosed, count)[group] >= _LEAST * walker.scale**2
    seeds = named | enclosed | _regions_below(places, eyes, walker)
    if not seeds.any():
        return every
    if roofless:
        seeds |= for_most(kind == SpaceKind.COURT)
    kept: Bools = np.isin(group, group[seeds])
    if not named.any() and size[kept].sum() < _SHARE * size.sum():
        kept = np.isin(group, group[seeds | ground])
    return kept


def _look_points(corners: Floats, region: Ints, body: float) -> tuple[Ints, Floats, Floats]:
    """(n,) regions, (n, 3) the middles of the largest of their triangles, (n,) m² of these; one for
    every ``body``, m², or part of it, in a region: all points of a patch of a scan see the same."""
    size = areas(corners)
    order = np.lexsort((-size, region))
    turn = np.arange(len(order)) - np.searchsorted(region[order], region[order])
    bodies = np.ceil(np.bincount(region, size) / body)
    some = order[turn < np.clip(bodies, 1, _LOOKS)[region[order]]]
    return region[some], corners[some].mean(axis=1), size[some]


def _regions_below(places: Places, eyes: Floats, walker: Walker) -> Bools:
    """(r,) which regions are below one of (n, 3) eyes, by no more than these may be high."""
    result = np.zeros(len(places.plan), dtype=np.bool_)
    point, region = shapely.STRtree(places.plan).query(
        shapely.points(eyes[:, PLAN]), "dwithin", distance=walker.radius
    )
    above = heights_above(eyes[point, None], places.slope[region])[:, 0]
    result[region[(above >= 0) & (above <= walker.reach)]] = True
    return result


def _for_most(is_kind: Bools, region: Ints, weight: Floats, count: int) -> Bools:
    """(count,) which regions are of a kind at most of their (n,) points by ``weight``."""
    votes = sum_by_group(region, weight * is_kind, count)
    return np.asarray(2 * votes > sum_by_group(region, weight, count))


def _joins(places: Places, around: Surroundings, walker: Walker) -> Ints:
    """(p, 2) pairs of regions that are joined, as many as connect all that are."""
    plan, slope = places.plan, places.slope
    joins = _corner_pairs(places, walker)
    pairs = _near_pairs(places, walker, _TOUCH, connect(len(plan), joins))
    steep = np.flatnonzero(np.any(slope[pairs[:, 0], :2] != slope[pairs[:, 1], :2], axis=1))
    meet = _meet(places, pairs[steep], walker)
    joins = np.concatenate([joins, np.delete(pairs, steep[~meet], axis=0)])
    # Across a gap, such as an open doorway without a floor: a few lines at the height of the body.
    group = connect(len(plan), joins)
    pairs = _near_pairs(places, walker, _STRIDE, group)
    for count in (1, _LINES):
        pairs = pairs[group[pairs[:, 0]] != group[pairs[:, 1]]]
        points, row = _ends_of_lines(plan, pairs, count)
        free = _free(places, around, walker, points, *pairs[row].T)
        joins = np.concatenate([joins, pairs[row[free]]])
        group = connect(len(plan), joins)
    return joins


def _ends_of_lines(plan: Geometry, pairs: Ints, count: int) -> tuple[Floats, Ints]:
    """(m, 2) points of the first of each of (p, 2) ``pairs`` of regions, and (m,) its row: the one
    nearest to the second if ``count`` is 1, else about that number of its corners."""
    start, to = plan[pairs].T
    if count == 1:
        return shapely.get_coordinates(shapely.shortest_line(start, to))[::2], np.arange(len(pairs))
    point, row = shapely.get_coordinates(start, return_index=True)
    turn = np.arange(len(row)) - np.searchsorted(row, row)
    some = turn % np.maximum(shapely.get_num_coordinates(start) // count, 1)[row] == 0
    return point[some], row[some]


def _corner_pairs(places: Places, walker: Walker) -> Ints:
    """(p, 2) pairs of regions with corners in one place, not a step apart: most of a scan."""
    point, region = shapely.get_coordinates(places.plan, return_index=True)
    height = _height(point, places.slope[region])
    side = _TOUCH * walker.scale / 2
    square = np.unique(np.floor(point / side), axis=0, return_inverse=True)[1].reshape(-1)
    order = np.lexsort((height, square))
    first, second = order[:-1], order[1:]
    level = (square[first] == square[second]) & (height[second] - height[first] <= walker.step)
    return np.asarray(region[np.stack([first, second], axis=1)[level]])


def _near_pairs(places: Places, walker: Walker, distance: float, group: Ints) -> Ints:
    """(p, 2) pairs of regions of different groups, (r,) ``group``, that are no farther apart than a
    distance, metres for the default visitor, and, if level, than a step in height; those of fewer
    corners first."""
    plan, slope, distance = places.plan, places.slope, distance * walker.scale
    least, greatest = heights(plan, slope)
    box = shapely.bounds(plan) + np.array([-distance, -distance, distance, distance]) / 2
    box = shapely.box(*box.T)
    # One of two groups is not the largest, to which most regions of a scan belong.
    largest = group == np.bincount(group, minlength=1).argmax()
    others = np.flatnonzero(~largest)
    first, second = shapely.STRtree(box).query(box[others])
    first = others[first]
    rise = walker.step + _STRIDE * walker.scale  # of slopes up to 45°
    near = ((first < second) | largest[second]) & (group[first] != group[second])
    near &= least[first] <= greatest[second] + rise
    near &= least[second] <= greatest[first] + rise
    first, second = first[near], second[near]
    near = np.any(slope[first, :2] != slope[second, :2], axis=1)
    near |= np.abs(least[first] - least[second]) <= walker.step
    near[near] = shapely.dwithin(plan[first[near]], plan[second[near]], distance)
    pairs = np.sort(np.stack([first[near], second[near]], axis=1), axis=1)
    size = shapely.get_num_coordinates(plan)[pairs]
    return np.take_along_axis(pairs, size.argsort(axis=1, kind="stable"), axis=1)


def _meet(places: Places, pairs: Ints, walker: Walker) -> Bools:
    """(p,) whether (p, 2) pairs of regions of different slopes are somewhere no farther apart than
    a stride, and in height than a step: at corners of one or the other, or between two of these."""
    plan, slope = places.plan, places.slope
    low, high = np.full(len(pairs), np.inf), np.full(len(pairs), -np.inf)
    shapely.prepare(plan)
    for start, to in (pairs.T, pairs[:, ::-1].T):
        point, pair = shapely.get_coordinates(plan[start], return_index=True)
        near = shapely.dwithin(plan[to[pair]], shapely.points(point), _STRIDE * walker.scale)
        point, pair = point[near], pair[near]
        first, second = pairs[pair].T
        rise = _height(point, slope[second]) - _height(point, slope[first])
        np.minimum.at(low, pair, rise)
        np.maximum.at(high, pair, rise)
    return np.asarray((low <= walker.step) & (high >= -walker.step))


def _height(point: Floats, slope: Floats) -> Floats:
    """(n,) heights of the planes of slopes, (n, 3), at points in plan, (n, 2)."""
    result: Floats = (point * slope[:, :2]).sum(axis=1) + slope[:, 2]
    return result


def _free(
    places: Places, around: Surroundings, walker: Walker, point: Floats, start: Ints, to: Ints
) -> Bools:
    """(n,) whether a visitor steps from (n, 2) points in plan of regions ``start`` to the nearest
    points of regions ``to``: no farther than a stride, no higher than a step, and past nothing."""
    line = shapely.shortest_line(shapely.points(point), places.plan[to])
    end = shapely.get_coordinates(line)[1::2]
    floor, next_floor = _height(point, places.slope[start]), _height(end, places.slope[to])
    length = np.linalg.norm(end - point, axis=1)
    result: Bools = (length <= _STRIDE * walker.scale) & (np.abs(next_floor - floor) <= walker.step)
    some = np.flatnonzero(result)
    along = np.zeros((len(some), 3))
    along[:, PLAN] = (end - point)[some] / np.maximum(length[some], _TOUCH * walker.scale)[:, None]
    floor = np.maximum(floor, next_floor)[some] + walker.step
    for share in (0.05, 0.5, 0.95):
        eye = np.insert(point[some], 1, floor + share * (walker.height - walker.step), 1)
        result[some] &= around.first(eye, along)[0] > length[some]
    return result
