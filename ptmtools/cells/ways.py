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
    region, middle, weight = _look_points(corners, region)
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


def _look_points(corners: Floats, region: Ints) -> tuple[Ints, Floats, Floats]:
    """(n,) regions, (n, 3) the middles of the largest of their triangles, (n,) m² of these."""
    size = areas(corners)
    order = np.lexsort((-size, region))
    turn = np.arange(len(order)) - np.searchsorted(region[order], region[order])
    some = order[turn < _LOOKS]
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
    plan, slope, stride = places.plan, places.slope, _STRIDE * walker.scale
    first, second = shapely.STRtree(plan).query(plan, "dwithin", distance=stride)
    least, greatest = heights(plan, slope)
    near = first < second
    near &= least[first] <= greatest[second] + walker.step + stride  # of slopes up to 45°
    near &= least[second] <= greatest[first] + walker.step + stride
    first, second = first[near], second[near]
    level = np.abs(least[first] - least[second]) <= walker.step
    steep = np.any(slope[first, :2] != slope[second, :2], axis=1)
    level[steep] = _meet(plan, slope, first[steep], second[steep], walker)
    first, second = first[level], second[level]
    touching = shapely.dwithin(plan[first], plan[second], _TOUCH * walker.scale)
    joins = np.stack([first, second], axis=1)
    group = connect(len(plan), joins[touching])
    # Across a gap, such as an open doorway without a floor: a few lines at the height of the body.
    apart = joins[group[first] != group[second]]
    size = shapely.get_num_coordinates(plan)
    large = size[apart].argmax(axis=1)[:, None]
    to, start = np.take_along_axis(apart, np.hstack([large, 1 - large]), axis=1).T
    point, row = shapely.get_coordinates(plan[start], return_index=True)
    turn = np.arange(len(row)) - np.searchsorted(row, row)
    some = turn % np.maximum(size[start] // _LINES, 1)[row] == 0
    nearest = shapely.get_coordinates(shapely.shortest_line(plan[start], plan[to]))[::2]
    point, row = np.concatenate([nearest, point[some]]), np.append(np.arange(len(to)), row[some])
    free = _free(places, around, walker, point, start[row], to[row])
    return np.concatenate([joins[touching], apart[row[free]]])


def _meet(plan: Geometry, slope: Floats, first: Ints, second: Ints, walker: Walker) -> Bools:
    """(n,) whether regions of different slopes are somewhere no farther apart than a stride, and in
    height than a step: at corners of one or the other, or between two of these."""
    low, high = np.full(len(first), np.inf), np.full(len(first), -np.inf)
    shapely.prepare(plan)
    for start, to in ((first, second), (second, first)):
        point, pair = shapely.get_coordinates(plan[start], return_index=True)
        near = shapely.dwithin(plan[to[pair]], shapely.points(point), _STRIDE * walker.scale)
        point, pair = point[near], pair[near]
        rise = _height(point, slope[second[pair]]) - _height(point, slope[first[pair]])
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
