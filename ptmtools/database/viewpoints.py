"""The places from which a walk begins (paper §6: "a set of viewpoints from which the navigation
can start").

The user's own, else the model's cameras, else chosen: in the cells with the largest floor, at eye
height, as far from the walls as the cell allows, looking along the longest view. A browser in
WALK mode drops the viewpoint onto the floor, so it is put there beforehand: at the height of the
eye above the nearest upward-facing surface below.

Views are measured on the horizontal section of the opaque triangles at eye height, each direction
by the mean free distance over a sector, so that a slit between two walls does not win. A
direction that leaves the model counts as blind. (Tried: Embree rays from the cell's centre. They
see down doorways, but the centre of a hall is as often a table.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.database.model import EmitOptions, Vector, Viewpoint
from ptmtools.database.section import area, leaf_section, triangle_section
from ptmtools.errors import InputError
from ptmtools.scene.model import Scene
from ptmtools.tolerance import ROUNDING_SHARE

#: The narrowest field of view that a camera may keep, radians.
_NARROWEST = 1e-2
#: Leaves with the largest volume in which a place to stand is looked for.
_LEAVES = 96
#: Places tried in a leaf, along each axis of its plan.
_GRID = 7
#: Places of a leaf whose view is measured, the freest first.
_TRIES = 24
#: Directions tried at a place, and how many to either side make a sector (±15°).
_DIRECTIONS = 72
_SECTOR = 3
#: A surface is a floor if its normal is at most 45° off the vertical.
_FLOOR_SLOPE = np.cos(np.pi / 4)
#: A floor is within reach if it lies at most this many eye heights below.
_REACH = 2.0
#: VRML97 wants the field of view inside (0, π); wider cameras are narrowed to this.
_WIDEST = 3.0


def place_viewpoints(
    scene: Scene, cells: Cells, options: EmitOptions
) -> tuple[tuple[Viewpoint, ...], tuple[str, ...]]:
    """The viewpoints of a database, and notes on those that were left out.

    Raises
    ------
    InputError: PTM-I600 if a viewpoint that the user gave lies in no cell.
    """
    ground = _Ground(scene)
    notes: list[str] = []
    if options.viewpoints:
        return tuple(_given(scene, cells, ground, options)), ()
    placed: list[Viewpoint] = []
    for camera in scene.cameras:
        position, cell = _standing(cells, ground, np.array(camera.position), options)
        if cell < 0:
            notes.append(f"camera {camera.name!r} lies in no cell and was left out")
            continue
        field = min(max(camera.field_of_view, _NARROWEST), _WIDEST)
        name = camera.name or f"Camera {len(placed) + 1}"
        placed.append(
            _viewpoint(len(placed), name, position, np.array(camera.direction), field, cell)
        )
    if placed:
        return tuple(placed), tuple(notes)
    return tuple(_chosen(scene, cells, ground, options)), tuple(notes)


def orientation(direction: NDArray[np.float64]) -> tuple[float, float, float, float]:
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
    sine = float(np.linalg.norm(v))
    if sine == 0:
        return (0.0, 1.0, 0.0, 0.0)
    axis, angle = v / sine + 0.0, float(2 * np.arctan2(sine, w))
    if angle > np.pi:
        angle -= 2 * np.pi
    return (float(axis[0]), float(axis[1]), float(axis[2]), angle)


class _Ground:
    """Where the floors are."""

    def __init__(self, scene: Scene) -> None:
        corners = scene.corners
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        up, length = normal[:, 1], np.linalg.norm(normal, axis=1)
        floor = np.where(scene.two_sided, abs(up), up) > _FLOOR_SLOPE * length
        self._corners = corners[floor & (length > 0)]
        self._least = self._corners[:, :, [0, 2]].min(axis=1, initial=np.inf)
        self._most = self._corners[:, :, [0, 2]].max(axis=1, initial=-np.inf)

    def below(self, point: NDArray[np.float64]) -> float:
        """Height of the nearest floor at or below a point, or -inf."""
        plan = point[[0, 2]]
        near = np.all((self._least <= plan) & (plan <= self._most), axis=1)
        a, b, c = np.moveaxis(self._corners[near], 1, 0)
        ab, ac, ap = b - a, c - a, point - a
        det = ab[:, 0] * ac[:, 2] - ab[:, 2] * ac[:, 0]
        u = (ap[:, 0] * ac[:, 2] - ap[:, 2] * ac[:, 0]) / det
        v = (ab[:, 0] * ap[:, 2] - ab[:, 2] * ap[:, 0]) / det
        height = a[:, 1] + u * ab[:, 1] + v * ac[:, 1]
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (height <= point[1])
        return float(height[hit].max(initial=-np.inf))


def _viewpoint(
    index: int,
    description: str,
    position: NDArray[np.float64],
    direction: NDArray[np.float64],
    field_of_view: float,
    cell: int,
) -> Viewpoint:
    unit = direction / np.linalg.norm(direction) + 0.0
    return Viewpoint(
        name=f"VP_{index}",
        description=description,
        position=_vector(position),
        direction=_vector(unit),
        orientation=orientation(unit),
        field_of_view=field_of_view,
        cell=cell,
    )


def _vector(v: NDArray[np.float64]) -> Vector:
    return (float(v[0]), float(v[1]), float(v[2]))


def _heading(yaw: float) -> NDArray[np.float64]:
    return np.array([-np.sin(yaw), 0.0, -np.cos(yaw)])


def _standing(
    cells: Cells, ground: _Ground, position: NDArray[np.float64], options: EmitOptions
) -> tuple[NDArray[np.float64], int]:
    """A place and its cell; on the floor below if one is in reach and the eye there is in a
    cell."""
    eye = options.avatar_size[1]
    floor = ground.below(position)
    if position[1] - floor <= _REACH * eye:
        stood = np.array([position[0], floor + eye, position[2]])
        cell = int(cells.locate(stood)[0])
        if cell >= 0:
            return stood, cell
    return position, int(cells.locate(position)[0])


def _given(
    scene: Scene, cells: Cells, ground: _Ground, options: EmitOptions
) -> Sequence[Viewpoint]:
    placed = []
    for i, wanted in enumerate(options.viewpoints):
        position, cell = _standing(cells, ground, np.array(wanted.position), options)
        if cell < 0:
            x, y, z = wanted.position
            raise InputError(
                "PTM-I600",
                f"the viewpoint {x:g},{y:g},{z:g} lies in no cell",
                remedy="give world metres, Y up, with the origin at the centre of the floor",
            )
        if wanted.yaw is None:
            walls = triangle_section(scene.corners[scene.opaque], float(position[1]))
            yaw, _ = _longest_view(position[[0, 2]], walls)
        else:
            yaw = float(np.radians(wanted.yaw))
        placed.append(
            _viewpoint(
                i, f"Viewpoint {i + 1}", position, _heading(yaw), options.field_of_view, cell
            )
        )
    return placed


def _chosen(
    scene: Scene, cells: Cells, ground: _Ground, options: EmitOptions
) -> Sequence[Viewpoint]:
    """In the cells with the largest floors, one each; if nobody can stand anywhere, in the middle
    of the largest leaf."""
    leaves = _largest_leaves(cells)
    opaque = scene.corners[scene.opaque]
    rooms = [room for leaf in leaves if (room := _room(cells, leaf, ground, options)) is not None]
    found: dict[int, tuple[NDArray[np.float64], float]] = {}
    for room in sorted(rooms, key=lambda room: (-area(room.section), room.leaf)):
        cell = int(cells.leaf_cell[room.leaf])
        if len(found) == options.viewpoint_count:
            break
        if cell not in found:
            place = _place_in(room, cells, ground, opaque, options.avatar_size)
            if place is not None:
                found[cell] = place
    if not found:
        middle = cells.leaf_points(leaves[0]).mean(axis=0)
        walls = triangle_section(opaque, float(middle[1]))
        yaw, _ = _longest_view(middle[[0, 2]], walls)
        found[int(cells.leaf_cell[leaves[0]])] = (middle, yaw)
    return [
        _viewpoint(i, f"Cell {cell}", position, _heading(yaw), options.field_of_view, cell)
        for i, (cell, (position, yaw)) in enumerate(found.items())
    ]


def _largest_leaves(cells: Cells) -> list[int]:
    boxes = [np.ptp(cells.leaf_points(i), axis=0).prod() for i in range(cells.leaf_count)]
    return [int(i) for i in np.argsort(-np.array(boxes), kind="stable")[:_LEAVES]]


@dataclass(frozen=True)
class _Room:
    """A leaf in which one can stand: its floor's height, and its section at the eye's."""

    leaf: int
    floor: float
    section: NDArray[np.float64]


def _room(cells: Cells, leaf: int, ground: _Ground, options: EmitOptions) -> _Room | None:
    floor = ground.below(cells.leaf_points(leaf).mean(axis=0))
    if not np.isfinite(floor):
        return None
    section = leaf_section(cells, leaf, floor + options.avatar_size[1])
    return _Room(leaf, floor, section) if len(section) >= 3 else None


def _place_in(
    room: _Room, cells: Cells, ground: _Ground, opaque: NDArray[np.float64], avatar_size: Vector
) -> tuple[NDArray[np.float64], float] | None:
    """(position, yaw) with the longest view among the freest places to stand, or None."""
    keep_off, eye, step = avatar_size
    walls = triangle_section(opaque, room.floor + eye)
    places = _grid(room.section)
    clearance = np.minimum(_distance(places, walls), _distance(places, _sides(room.section)))
    best: tuple[NDArray[np.float64], float] | None = None
    longest, tried = -1.0, 0
    for i in np.argsort(-clearance, kind="stable").tolist():
        floor = ground.below(np.array([places[i, 0], room.floor + eye, places[i, 1]]))
        position = np.array([places[i, 0], floor + eye, places[i, 1]])
        if clearance[i] < keep_off or tried == _TRIES:
            break
        if abs(floor - room.floor) > step or cells.locate_leaf(position)[0] != room.leaf:
            continue
        tried += 1
        yaw, view = _longest_view(places[i], walls)
        if view > longest:
            best, longest = (position, yaw), view
    return best


def _grid(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) points of a regular grid that lie inside a convex counter-clockwise polygon."""
    share = (np.arange(_GRID) + 0.5) / _GRID
    least, most = polygon.min(axis=0), polygon.max(axis=0)
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
    points = least + grid * (most - least)
    a, b = polygon, np.roll(polygon, -1, axis=0)
    edge, to = b - a, points[:, None] - a
    inside = np.all(edge[:, 0] * to[..., 1] - edge[:, 1] * to[..., 0] > 0, axis=1)
    kept: NDArray[np.float64] = points[inside]
    return kept if len(kept) else polygon.mean(axis=0)[None]


def _sides(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1)


def _distance(points: NDArray[np.float64], segments: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) distance of each (n, 2) point to the nearest of (m, 2, 2) segments; inf if none."""
    if len(segments) == 0:
        return np.full(len(points), np.inf)
    a, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    length = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
    nearest = np.empty(len(points))
    for i, p in enumerate(points):
        share = np.clip(((p - a) * along).sum(axis=1) / length, 0, 1)
        nearest[i] = np.linalg.norm(a + share[:, None] * along - p, axis=1).min()
    return nearest


def _longest_view(place: NDArray[np.float64], walls: NDArray[np.float64]) -> tuple[float, float]:
    """(yaw in radians, mean free distance of its sector in metres)."""
    yaws = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    free = _free(place, yaws, walls)
    sector = np.arange(-_SECTOR, _SECTOR + 1)
    mean = free[(np.arange(_DIRECTIONS)[:, None] + sector) % _DIRECTIONS].mean(axis=1)
    best = int(mean.argmax())
    return float(yaws[best]), float(mean[best])


def _free(
    place: NDArray[np.float64], yaws: NDArray[np.float64], walls: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Metres to the first wall in each direction; 0 where there is none."""
    x, z = -np.sin(yaws)[:, None], -np.cos(yaws)[:, None]
    a, along = walls[:, 0] - place, walls[:, 1] - walls[:, 0]
    det = x * along[:, 1] - z * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (a[:, 0] * along[:, 1] - a[:, 1] * along[:, 0]) / det
        share = (a[:, 0] * z - a[:, 1] * x) / det
    hit = (det != 0) & (distance > 0) & (share >= 0) & (share <= 1)
    nearest = np.where(hit, distance, np.inf).min(axis=1, initial=np.inf)
    return np.where(np.isfinite(nearest), nearest, 0.0)
