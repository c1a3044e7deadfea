"""A complex of 5,184 leaves: what must hold of every complex holds there too, in seconds.

A floor of square rooms, walls without thickness, each with a door to each of its neighbours, is
written down as cells at once, since cutting it takes most of a minute; a smaller one is cut as well
and must come out the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.cells.planes import Polyhedron
from ptmtools.tolerance import Tolerance
from ptmtools.visibility import PvsOptions, compute_pvs
from ptmtools.visibility.segments import check_conservative
from tests.conftest import scene_of

#: Rooms along each side, and in the floor that is cut as well.
MANY, FEW = 72, 9
#: Metres: a room and its door.
WIDTH, HEIGHT, DOOR, LINTEL = 4.0, 3.0, 1.0, 2.0


def doors(side: int) -> NDArray[np.float64]:
    """(2, side + 1, side) where the door begins in a wall across x or z: line, place along it."""
    share = np.random.default_rng(5).uniform(0.1, 0.6, (2, MANY + 1, MANY))
    return (np.arange(side) + share[:, : side + 1, :side]) * WIDTH


def upright(
    across: int, at: float, low: float, high: float, bottom: float, top: float
) -> list[tuple[float, float, float]]:
    """A rectangle in a wall across x (0) or z (1), counter-clockwise about that axis."""
    loop = [(low, bottom), (low, top), (high, top), (high, bottom)]
    return [(u, y, at) for u, y in loop] if across else [(at, y, u) for u, y in loop[::-1]]


def shell(side: int) -> NDArray[np.float64]:
    """(n, 4, 3) the walls around the doors, the floor and the ceiling."""
    whole, start, faces = side * WIDTH, doors(side), []
    for across in (0, 1):
        for line in range(side + 1):
            for k in range(side):
                at, low, high = line * WIDTH, k * WIDTH, (k + 1) * WIDTH
                left = start[across, line, k] if 0 < line < side else high
                faces.append(upright(across, at, low, left, 0, HEIGHT))
                if left < high:
                    faces.append(upright(across, at, left, left + DOOR, LINTEL, HEIGHT))
                    faces.append(upright(across, at, left + DOOR, high, 0, HEIGHT))
    faces += [[(0, y, 0), (0, y, whole), (whole, y, whole), (whole, y, 0)] for y in (0, HEIGHT)]
    return np.array(faces, dtype=np.float64)


def as_cells(side: int) -> Cells:
    """Room (i, j), at i along x and j along z, is leaf and cell i · side + j."""
    planes: list[tuple[float, float, float, float]] = []
    children: list[list[int]] = []

    def part(i0: int, i1: int, j0: int, j1: int) -> int:
        if (i1 - i0, j1 - j0) == (1, 1):
            return -2 - (i0 * side + j0)
        node = len(planes)
        children.append([])
        if i1 - i0 >= j1 - j0:
            middle = (i0 + i1) // 2
            planes.append((1.0, 0.0, 0.0, -middle * WIDTH))
            children[node] = [part(middle, i1, j0, j1), part(i0, middle, j0, j1)]
        else:
            middle = (j0 + j1) // 2
            planes.append((0.0, 0.0, 1.0, -middle * WIDTH))
            children[node] = [part(i0, i1, middle, j1), part(i0, i1, j0, middle)]
        return node

    part(0, side, 0, side)
    count = side * side
    room = np.arange(count).reshape(side, side)
    corner = np.array([[i * WIDTH, 0.0, j * WIDTH] for i in range(side) for j in range(side)])
    box = Polyhedron.box(np.zeros(3), np.array([WIDTH, HEIGHT, WIDTH]))
    start = doors(side)
    leaf, plane, polygon = [], [], []
    for across in (0, 1):
        for line in range(1, side):
            for k in range(side):
                one, other = (line - 1, k), (line, k)
                pair = (one, other) if across == 0 else (one[::-1], other[::-1])
                leaf.append([room[pair[0]], room[pair[1]]])
                normal = (1.0, 0.0, 0.0) if across == 0 else (0.0, 0.0, 1.0)
                plane.append((*normal, -line * WIDTH))
                low = start[across, line, k]
                polygon.append(upright(across, line * WIDTH, low, low + DOOR, 0, LINTEL))
    loops = np.array(box.faces)
    empty = np.zeros((0, 3))
    return Cells(
        node_plane=np.array(planes),
        node_child=np.array(children, dtype=np.int32),
        root_box=np.array([[0, 0, 0], [side * WIDTH, HEIGHT, side * WIDTH]]),
        leaf_cell=np.arange(count, dtype=np.int32),
        leaf_standing=np.ones(count, dtype=np.bool_),
        leaf_point=(corner[:, None] + box.points).reshape(-1, 3),
        leaf_point_start=8 * np.arange(count + 1),
        face_index=(8 * np.arange(count)[:, None] + loops.ravel()).ravel().astype(np.int32),
        face_start=4 * np.arange(6 * count + 1),
        leaf_face_start=6 * np.arange(count + 1),
        portal_leaf=np.array(leaf, dtype=np.int32),
        portal_plane=np.array(plane),
        portal_point=np.array(polygon).reshape(-1, 3),
        portal_start=4 * np.arange(len(leaf) + 1),
        portal_area=np.full(len(leaf), DOOR * LINTEL),
        portal_passage=np.zeros(len(leaf), np.bool_),
        vertex=empty,
        vertex_uv=empty[:, :2],
        triangle=empty.astype(np.int32),
        triangle_source=np.zeros(0, dtype=np.int32),
        triangle_cell=np.zeros((0, 2), dtype=np.int32),
        tolerance=Tolerance.for_extent(side * WIDTH),
    )


def test_five_thousand_leaves() -> None:
    many = as_cells(MANY)
    assert many.leaf_count == MANY**2 > 5000
    pvs = compute_pvs(many, PvsOptions(budget=1000))
    visible = pvs.to_matrix()
    assert np.array_equal(visible, visible.T)
    assert visible.diagonal().all()
    ends = many.portal_leaf
    assert visible[ends[:, 0], ends[:, 1]].all()
    assert visible.mean() < 0.05
    corners = scene_of(shell(MANY)).corners
    report = check_conservative(corners, many, pvs, segments=100_000)
    assert report.tried == 100_000
    assert report.unoccluded > 1000
    assert report.missed == ()


def test_cut_they_come_out_the_same() -> None:
    given = as_cells(FEW)
    cut = subdivide(scene_of(shell(FEW)), SubdivideOptions(cells="leaf"))
    assert cut.closed
    assert cut.leaf_count == given.leaf_count
    middles = np.array([given.leaf_points(k).mean(axis=0) for k in range(given.leaf_count)])
    leaf = cut.locate_leaf(middles)
    assert sorted(leaf.tolist()) == list(range(cut.leaf_count))
    pairs = np.sort(leaf[given.portal_leaf], axis=1)
    assert sorted(pairs.tolist()) == sorted(np.sort(cut.portal_leaf, axis=1).tolist())
    here, there = compute_pvs(given).to_matrix(), compute_pvs(cut).to_matrix()
    assert np.array_equal(here, there[np.ix_(leaf, leaf)])


def test_a_limit_that_was_reached_is_said() -> None:
    scene = scene_of(shell(4))
    whole = subdivide(scene, SubdivideOptions(cells="leaf"))
    assert not any("limit" in note for note in whole.notes)
    cut = subdivide(scene, SubdivideOptions(cells="leaf", max_leaves=10))
    (printed,) = [note for note in cut.notes if "limit" in note]
    assert printed.startswith("the limit of 10 leaves was reached: ")
    assert "--max-leaves" in printed
