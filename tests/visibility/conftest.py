"""Grids of box rooms with doors of any place and size, as triangles and as cells."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.tolerance import Tolerance

#: A door in the wall of room (i, j, k) towards its neighbour along an axis: (u0, u1, v0, v1) in
#: the coordinates of the two axes that follow it cyclically.
Door = tuple[float, float, float, float]
Doors = Mapping[tuple[int, int, int, int], Sequence[Door]]


@dataclass(frozen=True)
class Rooms:
    triangles: np.ndarray  # (T, 3, 3)
    cells: Cells
    index: Callable[[int, int, int], int]


BuildRooms = Callable[..., Rooms]


@pytest.fixture(scope="session")
def build_rooms() -> BuildRooms:
    """``build_rooms(xs, ys, zs, doors)``: boxes between the planes at ``xs``, ``ys``, ``zs``."""
    return make_rooms


def make_rooms(
    xs: Sequence[float],
    ys: Sequence[float],
    zs: Sequence[float],
    doors: Doors,
    transform: Callable[[np.ndarray], np.ndarray] = lambda p: p,
) -> Rooms:
    """``transform`` maps (n, 3) points; it must be a similarity without reflection."""
    cuts = [np.array(c, dtype=np.float64) for c in (xs, ys, zs)]
    shape = tuple(len(c) - 1 for c in cuts)

    def index(i: int, j: int, k: int) -> int:
        return (i * shape[1] + j) * shape[2] + k

    def place(axis: int, at: float, corners: Sequence[tuple[float, float]]) -> np.ndarray:
        points = np.empty((len(corners), 3))
        points[:, axis] = at
        points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = np.array(corners).T
        return points

    def corners(u0: float, u1: float, v0: float, v1: float) -> list[tuple[float, float]]:
        return [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]  # counter-clockwise about +axis

    quads: list[np.ndarray] = []
    leaf_points, portals, normals, ends = [], [], [], []
    for i, j, k in np.ndindex(*shape):
        room = (i, j, k)
        low = [cuts[a][room[a]] for a in range(3)]
        high = [cuts[a][room[a] + 1] for a in range(3)]
        leaf_points.append([[x, y, z] for x in (low[0], high[0])
                            for y in (low[1], high[1]) for z in (low[2], high[2])])  # fmt: skip
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            wall = (low[u], high[u], low[v], high[v])
            if room[axis] == 0:
                quads.append(place(axis, low[axis], corners(*wall)))
            openings = doors.get((i, j, k, axis), ()) if room[axis] + 1 < shape[axis] else ()
            quads += [place(axis, high[axis], corners(*part)) for part in around(wall, openings)]
            for opening in openings:
                beyond = list(room)
                beyond[axis] += 1
                portals.append(place(axis, high[axis], corners(*opening)))
                normals.append(np.eye(3)[axis])
                ends.append((index(*room), index(*beyond)))

    nodes: list[tuple[np.ndarray, list[int]]] = []

    def split(low: list[int], high: list[int]) -> int:
        axis = int(np.argmax(np.array(high) - low))
        if high[axis] - low[axis] == 1:
            return -2 - index(*low)
        middle = (low[axis] + high[axis]) // 2
        at = len(nodes)
        nodes.append((place(axis, cuts[axis][middle], corners(0, 1, 0, 1)), []))
        children = nodes[at][1]
        children.append(split([middle if a == axis else low[a] for a in range(3)], high))
        children.append(split(low, [middle if a == axis else high[a] for a in range(3)]))
        return at

    split([0, 0, 0], list(shape))
    count = len(leaf_points)
    loops = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    points = transform(np.array(leaf_points, dtype=np.float64).reshape(-1, 3))
    corner = [transform(np.array(q)) for q in quads]
    turn = transform(np.eye(3)) - transform(np.zeros((1, 3)))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)

    def plane(polygon: np.ndarray, normal: np.ndarray) -> np.ndarray:
        unit = normal @ turn
        return np.append(unit, -unit @ transform(polygon)[0])

    node_plane = [plane(p, np.cross(p[1] - p[0], p[2] - p[0])) for p, _ in nodes]
    empty = np.zeros((0, 3))
    cells = Cells(
        node_plane=np.array(node_plane).reshape(-1, 4),
        node_child=np.array([c for _, c in nodes], dtype=np.int32).reshape(-1, 2),
        root_box=np.stack([points.min(axis=0), points.max(axis=0)]),
        leaf_cell=np.arange(count, dtype=np.int32),
        leaf_standing=np.ones(count, dtype=np.bool_),
        leaf_point=points,
        leaf_point_start=8 * np.arange(count + 1),
        face_index=np.concatenate([np.ravel(loops) + 8 * i for i in range(count)]).astype(np.int32),
        face_start=4 * np.arange(6 * count + 1),
        leaf_face_start=6 * np.arange(count + 1),
        portal_leaf=np.array(ends, dtype=np.int32).reshape(-1, 2),
        portal_plane=np.array([plane(p, n) for p, n in zip(portals, normals, strict=True)]).reshape(
            -1, 4
        ),
        portal_point=np.concatenate([transform(p) for p in portals]) if portals else empty,
        portal_start=4 * np.arange(len(portals) + 1),
        portal_area=np.ones(len(portals)),
        portal_passage=np.zeros(len(portals), np.bool_),
        vertex=empty,
        vertex_uv=np.zeros((0, 2)),
        triangle=np.zeros((0, 3), np.int32),
        triangle_source=np.zeros(0, np.int32),
        triangle_cell=np.zeros((0, 2), np.int32),
        tolerance=Tolerance.for_points(points),
    )
    triangles = np.concatenate([q[[[0, 1, 2], [0, 2, 3]]] for q in corner])
    return Rooms(triangles, cells, index)


def around(wall: Door, openings: Sequence[Door]) -> list[Door]:
    """The wall less its openings, in rectangles on the grid of their sides."""
    us = sorted({wall[0], wall[1], *(x for o in openings for x in o[:2])})
    vs = sorted({wall[2], wall[3], *(y for o in openings for y in o[2:])})
    parts = []
    for u0, u1 in pairwise(us):
        for v0, v1 in pairwise(vs):
            u, v = (u0 + u1) / 2, (v0 + v1) / 2
            if not any(o[0] < u < o[1] and o[2] < v < o[3] for o in openings):
                parts.append((u0, u1, v0, v1))
    return parts
