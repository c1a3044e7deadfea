"""The viewpoints of a database, where a walk may start (paper §6: "a set of viewpoints from which
the navigation can start").

They are the user's, else the model's cameras; then one in each of the rooms without one that are
best to begin in (`visits`, `standpoints`, `views`), with the name that the model gives the room, if
any. A browser that ignores cells lists them in its menu and leads from one to the next in the order
of the file, so the next one should be next door. The shortest ways from the first room form a tree
(Dijkstra, over leaves and portals); the rooms are in the order of a walk around that tree, the
shortest branch first, one storey after the other, and on each the rooms before places outdoors. A
browser in WALK mode drops the viewpoint onto the floor, so it is put there beforehand: at the
height of the eye above the nearest upward-facing surface below.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from heapq import heappop, heappush

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.model import Cells
from ptmtools.errors import InputError
from ptmtools.output.model import TextureRecord, Viewpoint, WriterOptions
from ptmtools.output.standpoints import FloorFinder, places
from ptmtools.output.storeys import storey_names
from ptmtools.output.views import Outlook
from ptmtools.scene.model import Scene
from ptmtools.tolerance import ROUNDING_SHARE

#: Factor of the length of a way through an opening that is too low to walk through.
_CLIMB = 10.0
#: A portal with a normal this near to the vertical leads up or down, and has no height.
_LEVEL = np.cos(np.pi / 4)


def walk(cells: Cells, start: int, stops: Sequence[int], tall: float) -> list[int]:
    """The order in which a walk from the leaf ``start`` meets the leaves ``stops``, as indices into
    ``stops``; unreachable leaves come last.

    Parameters
    ----------
    tall: openings of at least this height are walked through, metres.
    """
    length, before = _ways(cells, start, tall)
    reach: dict[int, float] = {}
    onwards: dict[int, set[int]] = {}
    stops_of: dict[int, list[int]] = {}
    for i, stop in enumerate(stops):
        if stop != start and before[stop] < 0:
            continue
        stops_of.setdefault(stop, []).append(i)
        leaf, distance = stop, length[stop]
        while leaf >= 0:
            reach[leaf] = max(reach.get(leaf, 0.0), distance)
            if before[leaf] >= 0:
                onwards.setdefault(before[leaf], set()).add(leaf)
            leaf = before[leaf]
    order: list[int] = []
    waiting = [start]
    while waiting:
        leaf = waiting.pop()
        order += stops_of.get(leaf, [])
        waiting += sorted(onwards.get(leaf, ()), key=lambda leaf: (-reach[leaf], -leaf))
    return order + sorted(set(range(len(stops))) - set(order))


def _ways(cells: Cells, start: int, tall: float) -> tuple[list[float], list[int]]:
    """For each leaf its distance from ``start``, and the previous leaf on the way, -1 for none."""
    edges: list[list[tuple[int, float]]] = [[] for _ in range(cells.leaf_count)]
    if cells.portal_count:
        middle, door = (
            np.add.reduceat(point, start[:-1]) / np.diff(start)[:, None]
            for point, start in (
                (cells.leaf_point, cells.leaf_point_start),
                (cells.portal_point, cells.portal_start),
            )
        )
        up, begin = cells.portal_point[:, 1], cells.portal_start[:-1]
        rise = np.maximum.reduceat(up, begin) - np.minimum.reduceat(up, begin)
        way = np.linalg.norm(middle[cells.portal_leaf] - door[:, None], axis=2).sum(axis=1)
        way[(abs(cells.portal_plane[:, 1]) < _LEVEL) & (rise < tall)] *= _CLIMB
        for (a, b), distance in zip(cells.portal_leaf.tolist(), way.tolist(), strict=True):
            edges[a].append((b, distance))
            edges[b].append((a, distance))
    length, before = [np.inf] * cells.leaf_count, [-1] * cells.leaf_count
    length[start] = 0.0
    waiting = [(0.0, start)]
    while waiting:
        distance, leaf = heappop(waiting)
        if distance > length[leaf]:
            continue
        for neighbour, way in edges[leaf]:
            if distance + way < length[neighbour]:
                length[neighbour], before[neighbour] = distance + way, leaf
                heappush(waiting, (distance + way, neighbour))
    return length, before


#: The narrowest field of view that a camera may keep, radians.
_NARROWEST = 1e-2
#: A floor is within reach if it lies at most this many eye heights below.
_REACH = 2.0
#: VRML97 requires a field of view inside (0, π); wider cameras are narrowed to this.
_WIDEST = 3.0


def place_viewpoints(
    scene: Scene, cells: Cells, options: WriterOptions, textures: Sequence[TextureRecord] = ()
) -> tuple[tuple[Viewpoint, ...], tuple[str, ...]]:
    """The viewpoints of a database, the default one first, and notes on omitted ones. They face
    ``textures``; other textures are ignored.

    Raises InputError: PTM-I111 if a viewpoint that the user gave lies in no cell.
    """
    ground, outlook = FloorFinder(scene), Outlook(scene, textures)
    notes: list[str] = []
    if options.viewpoints:
        initial = _given_viewpoints(cells, ground, outlook, options)
    else:
        initial = _cameras(scene, cells, ground, options, notes)
    if options.viewpoint_count or not initial:
        initial += _touring(scene, cells, ground, outlook, options, initial, notes)
    return tuple(replace(v, name=f"VP_{i}") for i, v in enumerate(initial)), tuple(notes)


def orientation(direction: Floats) -> tuple[float, float, float, float]:
    """(x, y, z, angle): the rotation that turns -Z to ``direction`` and keeps Y as far up as it
    can; a vertical direction keeps X to the right."""
    back = -direction / np.linalg.norm(direction)
    right = np.cross([0.0, 1.0, 0.0], back)
    length = np.linalg.norm(right)
    right = right / length if length > ROUNDING_SHARE else np.array([1.0, 0.0, 0.0])
    m = np.stack([right, np.cross(back, right), back], axis=1)
    # The largest of the quaternion's components first: no cancellation at any angle.
    t = np.array([m[0, 0], m[1, 1], m[2, 2], np.trace(m)])
    i = int(t.argmax())
    if i == 3:
        v = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
        w = 1 + t[3]
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        v = np.zeros(3)
        v[[i, j, k]] = 1 + 2 * t[i] - t[3], m[j, i] + m[i, j], m[k, i] + m[i, k]
        w = m[k, j] - m[j, k]
    largest = float(abs(v).max())
    if largest == 0:
        return (0.0, 1.0, 0.0, 0.0)
    axis = v / largest  # so that its square does not underflow
    size = float(np.linalg.norm(axis))
    axis, angle = axis / size + 0.0, float(2 * np.arctan2(largest * size, w))
    if angle > np.pi:
        angle -= 2 * np.pi
    x, y, z = axis.tolist()
    return (x, y, z, angle)


def _viewpoint(
    description: str,
    position: Floats,
    direction: Floats,
    field_of_view: float,
    cell: int,
) -> Viewpoint:
    """A viewpoint without a name."""
    unit = direction / np.linalg.norm(direction) + 0.0
    x, y, z = position.tolist()
    dx, dy, dz = unit.tolist()
    turn = orientation(unit)
    return Viewpoint("", description, (x, y, z), (dx, dy, dz), turn, field_of_view, cell)


def _heading(yaw: float) -> Floats:
    return np.array([-np.sin(yaw), 0.0, -np.cos(yaw)])


def _standing(
    cells: Cells, ground: FloorFinder, position: Floats, options: WriterOptions
) -> tuple[Floats, int]:
    """A place to stand at a position, and its cell, -1 for none; on the floor below if that is
    within reach."""
    eye = options.avatar(cells.walker)[1]
    floor = float(ground.floor_below(position[None])[0])
    if position[1] - floor <= _REACH * eye:
        on_floor = np.array([position[0], floor + eye, position[2]])
        cell = _cell_to_stand_in(cells, on_floor)
        if cell >= 0:
            return on_floor, cell
    return position, _cell_to_stand_in(cells, position)


def _cell_to_stand_in(cells: Cells, position: Floats) -> int:
    """The cell of the standing leaf at a position, -1 for none."""
    leaf = int(cells.locate_leaf(position)[0])
    return int(cells.leaf_cell[leaf]) if leaf >= 0 and cells.leaf_standing[leaf] else -1


def _cameras(
    scene: Scene, cells: Cells, ground: FloorFinder, options: WriterOptions, notes: list[str]
) -> list[Viewpoint]:
    placed: list[Viewpoint] = []
    for camera in scene.cameras:
        position, cell = _standing(cells, ground, np.array(camera.position), options)
        if cell < 0:
            notes.append(f"camera {camera.name!r} lies in no cell and was left out")
            continue
        field = min(max(camera.field_of_view, _NARROWEST), _WIDEST)
        name = camera.name or f"Camera {len(placed) + 1}"
        placed.append(_viewpoint(name, position, np.array(camera.direction), field, cell))
    return placed


def _given_viewpoints(
    cells: Cells, ground: FloorFinder, outlook: Outlook, options: WriterOptions
) -> list[Viewpoint]:
    placed = []
    for i, given in enumerate(options.viewpoints):
        position, cell = _standing(cells, ground, np.array(given.position), options)
        if cell < 0:
            x, y, z = given.position
            fault, remedy = "not inside any cell", "with the origin at the centre of the floor"
            if cells.locate_leaf(np.array(given.position))[0] >= 0:
                fault = "in a cell without a place to stand"
                remedy = "or divide the model again with this --viewpoint"
            raise InputError(
                "PTM-I111",
                f"the viewpoint {x:g},{y:g},{z:g} is {fault}",
                remedy=f"use world metres, Y up, {remedy}",
            )
        if given.yaw is None:
            yaw = outlook.best(position[None], float(position[1])).yaw
        else:
            yaw = float(np.radians(given.yaw))
        name, field = f"Viewpoint {i + 1}", options.field_of_view
        placed.append(_viewpoint(name, position, _heading(yaw), field, cell))
    return placed


def _touring(
    scene: Scene,
    cells: Cells,
    ground: FloorFinder,
    outlook: Outlook,
    options: WriterOptions,
    initial: Sequence[Viewpoint],
    notes: list[str],
) -> list[Viewpoint]:
    """A viewpoint for each room without one, in the order of a walk from the first."""
    numbers = cells.room_numbers.tolist()
    taken = {numbers[v.cell] for v in initial}
    count = max(options.viewpoint_count, not initial)
    size = options.avatar(cells.walker)
    rooms, rest = places(scene, cells, ground, outlook, size, count, taken)
    if rest:
        notes.append(f"rooms without a viewpoint: {rest}; --viewpoint-count adds some")
    if not rooms:
        return [] if initial else [_anywhere(cells, outlook, options)]
    leaf = cells.locate_leaf(np.array([place.position for place in rooms])).tolist()
    start = int(cells.locate_leaf(np.array(initial[0].position))[0]) if initial else leaf[0]
    order = walk(cells, start, leaf, size[1])
    height = [place.storey for place in rooms]
    first = list(dict.fromkeys(height))
    order.sort(key=lambda i: (first.index(height[i]), not rooms[i].indoors))
    names = dict(zip(sorted(first), storey_names(scene, sorted(first)), strict=True))
    number: Counter[tuple[str, str]] = Counter()
    views: list[Viewpoint] = []
    for i in order:
        place, field = rooms[i], options.field_of_view
        level = names[height[i]] if len(first) > 1 else ""
        name = _name(cells.room_name(place.cell), level, number)
        views.append(_viewpoint(name, place.position, _heading(place.yaw), field, place.cell))
    return views


def _name(room: str, level: str, number: Counter[tuple[str, str]]) -> str:
    """The name of a viewpoint in a room, "" for one without a name, on a storey, "" for the only
    one; counts the viewpoints of equal rooms in ``number``."""
    number[level, room] += 1
    count = number[level, room]
    if not room:
        return f"{level}, room {count}" if level else f"Room {count}"
    name = f"{level}, {room}" if level else room
    return f"{name} ({count})" if count > 1 else name


def _anywhere(cells: Cells, outlook: Outlook, options: WriterOptions) -> Viewpoint:
    """A viewpoint in the middle of the largest leaf."""
    leaf = int(np.where(cells.leaf_standing, cells.leaf_volumes(), -1.0).argmax())
    middle = cells.leaf_points(leaf).mean(axis=0)
    view, cell = outlook.best(middle[None], float(middle[1])), int(cells.leaf_cell[leaf])
    return _viewpoint("Room 1", middle, _heading(view.yaw), options.field_of_view, cell)
