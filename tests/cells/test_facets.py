"""Flat regions and the fewer triangles that they become."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely

from ptmtools.arrays import areas
from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.cells.fabric import Fabric, Facets, Welded
from ptmtools.cells.planar import counting
from ptmtools.cells.structure import Structure, find_walls
from ptmtools.scene import ingest
from ptmtools.tolerance import Tolerance
from tests.conftest import scene_of, subdivided

TOLERANCE = Tolerance.for_extent(10.0)


def facets_of(corners: np.ndarray) -> Facets:
    mesh = Welded.from_triangles(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    return Facets.from_mesh(mesh, TOLERANCE)


def fewer(facets: Facets) -> tuple[np.ndarray, np.ndarray]:
    return facets.reduce(np.ones(len(facets.region), dtype=bool), TOLERANCE)


def grid(n: int, hole: tuple[int, int] | None = None, turn: float = 0.0) -> np.ndarray:
    """2n² triangles of a wall of 10 m, less the squares from ``hole[0]`` to ``hole[1]`` both
    ways; turned about two axes."""
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(n)))
    if hole:
        low, high = hole
        outside = ~((i >= low) & (i < high) & (j >= low) & (j < high))
        i, j = i[outside], j[outside]
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)
    quads = (np.stack([i, j, 0 * i], axis=1)[:, None] + square) * 10 / n
    c, s = np.cos(turn), np.sin(turn)
    quads = quads @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]).T
    quads = quads @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]).T
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3).astype(np.float32).astype(float)


@pytest.mark.parametrize("turn", [0.0, 0.4])
@pytest.mark.parametrize(("hole", "triangles"), [(None, 2), ((3, 9), 8)])
def test_a_wall_is_as_few_triangles_as_its_outline_needs(
    turn: float, hole: tuple[int, int] | None, triangles: int
) -> None:
    corners = grid(16, hole, turn)
    actual, source = fewer(facets_of(corners))
    assert len(actual) == triangles
    assert np.all(source == 0)
    assert areas(actual).sum() == pytest.approx(areas(corners).sum(), rel=1e-6)
    # Every corner is one that was there, to the last bit.
    known = {tuple(point) for point in corners.reshape(-1, 3).tolist()}
    assert all(tuple(point) in known for point in actual.reshape(-1, 3).tolist())
    if not turn:
        unions = [shapely.union_all(shapely.polygons(c[:, :, :2])) for c in (corners, actual)]
        assert shapely.area(shapely.symmetric_difference(*unions)) < 1e-9


def test_walls_that_meet_in_a_corner_stay_two() -> None:
    wall = grid(8)
    facets = facets_of(np.concatenate([wall, wall[:, :, [2, 0, 1]]]))
    assert len(facets.area) == 2
    actual, source = fewer(facets)
    assert sorted(source.tolist()) == [0, 0, len(wall), len(wall)]
    assert areas(actual).sum() == pytest.approx(200)


def test_what_is_curved_stays_as_it_is() -> None:
    wall = grid(24)
    wall[:, :, 2] = 0.2 * np.sin(wall[:, :, 0]) * np.cos(wall[:, :, 1])
    actual, source = fewer(facets_of(wall))
    assert np.array_equal(actual, wall)
    assert np.array_equal(source, np.arange(len(wall)))


def test_a_bend_far_below_the_tolerance_does_not_add_up() -> None:
    # Each row of a wide arch lies in the plane of the one before, but the last not in the first's.
    wall = grid(64)
    wall[:, :, 2] = 2e-3 * (wall[:, :, 0] - 5) ** 2
    facets = facets_of(wall)
    assert 1 < len(facets.area) < len(wall)
    actual, _ = fewer(facets)
    for corners in actual:
        middle = corners.mean(axis=0)
        assert abs(middle[2] - 2e-3 * (middle[0] - 5) ** 2) <= TOLERANCE.plane


def test_a_triangulation_with_a_corner_of_its_own_is_not_taken() -> None:
    facets = facets_of(grid(4))
    space = np.array([[[0, 0, 1], [4, 0, 1]], [[4, 0, 1], [0, 4, 1]], [[0, 4, 1], [0, 0, 1.0]]])
    space = np.concatenate([space, space])
    flat, of = space[:, :, :2], np.repeat([3, 5], 3)
    rings = np.array([[[0, 0], [4, 0], [0, 4]], [[0, 0], [4, 0], [2, 2]], [[0, 0], [2, 2], [0, 4]]])
    with counting() as undecided:
        actual, which = facets._lift(rings.astype(float), np.array([3, 5, 5]), flat, of, space)
    assert np.array_equal(actual, space[None, :3, 0])
    assert which.tolist() == [3]
    assert undecided == {"triangles": 1}


def test_a_compressed_model_whose_outlines_cross_has_its_walls(shared: Path) -> None:
    """At 14 bits, corners of furniture come to lie beyond the edges beside them."""
    scene = ingest(shared / "scenes/apartment_gallery/gallery.glb")
    with counting() as undecided:
        structure = Structure.from_fabric(
            Fabric.from_scene(scene, SubdivideOptions()), scene.tolerance
        )
    assert undecided["triangles"] > 0
    opaque = scene.corners[scene.opaque]
    assert areas(structure.corners).sum() == pytest.approx(areas(opaque).sum(), rel=0.05)


def test_two_triangles_stay_two() -> None:
    corners = grid(1)
    actual, source = fewer(facets_of(corners))
    assert np.array_equal(actual, corners)
    assert source.tolist() == [0, 1]


def test_a_crossing_wall_leaves_the_floor_in_two_parts() -> None:
    # Three triangles meet in the edges of its foot: the floor is not one region; nothing is lost.
    floor = grid(8)
    wall = grid(8)[:, :, [2, 0, 1]] + [5.0, 0, 0]
    actual, _ = fewer(facets_of(np.concatenate([floor, wall])))
    assert areas(actual).sum() == pytest.approx(200)
    assert len(actual) == 6


@pytest.mark.parametrize("times", [5, 12])
def test_subdivided_walls_divide_the_building_as_whole_ones_do(room_row, times: int) -> None:
    scene = room_row(2)[0]
    dense = subdivided(scene, times)
    assert len(dense.triangles) == times**2 * len(scene.triangles)
    few, many = (subdivide(s, SubdivideOptions(cells="leaf")) for s in (scene, dense))
    assert few.cell_count == many.cell_count == 2
    assert np.allclose(few.portal_area, many.portal_area)
    assert np.allclose(np.sort(few.leaf_volumes()), np.sort(many.leaf_volumes()))


def test_structural_names_hold_for_their_own_triangles_alone(quads) -> None:
    # One flat region, half of it named: the halves are not mixed.
    halves = [grid(8) * [0.5, 1, 1], grid(8) * [0.5, 1, 1] + [5, 0, 0]]
    faces = np.concatenate(halves)
    scene = scene_of(faces, objects=["a"] * 128 + ["b"] * 128)
    options = SubdivideOptions(structural=("b",))
    structure = Structure.from_fabric(Fabric.from_scene(scene, options), scene.tolerance)
    assert len(structure.corners) == 4
    right = structure.corners.reshape(4, 9)[:, ::3].mean(axis=1) > 5
    assert np.array_equal(structure.forced, right)


def test_a_flat_wall_is_found_among_a_scan_without_trying_every_triangle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # The scan's triangles are larger, so they are tried first; all have similar planes. Those of
    # the wall overlap but share no corners, and are no facet.
    random = np.random.default_rng(5)
    scan = grid(40) + random.normal(0, 2e-3, (3200, 3, 3))
    wall = grid(24) * 0.4 + [3, 3, 0.02]
    middle = wall.mean(axis=1, keepdims=True)
    wall = middle + 1.05 * (wall - middle)
    scene = scene_of(np.concatenate([scan, wall]))
    tried = []
    lie_in = Structure.lie_in
    monkeypatch.setattr(
        Structure, "lie_in", lambda *arguments: tried.append(1) or lie_in(*arguments)
    )
    walls, _ = find_walls(
        Structure.from_fabric(Fabric.from_scene(scene, SubdivideOptions()), scene.tolerance), 2.0
    )
    assert len(tried) < len(scene.triangles) / 2
    assert any(abs(w.frame.plane[3] + 0.02) < 1e-4 and w.blocking.area > 10 for w in walls)


@pytest.mark.parametrize(("axis", "curved"), [(1, 20), (0, 0)])
def test_facets_of_a_tower_are_curved_walls_and_those_of_a_duct_are_not(
    axis: int, curved: int
) -> None:
    turn = 2 * np.pi * np.arange(20) / 20
    ring = np.column_stack([4 * np.cos(turn), np.zeros(20), 4 * np.sin(turn)])
    after, up = np.roll(ring, -1, axis=0), np.array([0.0, 6.0, 0.0])
    parts = [(ring, after + up, after), (ring, ring + up, after + up)]
    parts += [(0 * ring, after, ring), (0 * ring + up, ring + up, after + up)]
    corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    corners = np.roll(corners, axis - 1, axis=2)
    fabric = Fabric.from_scene(scene_of(corners), SubdivideOptions())
    tolerance = Tolerance.for_points(corners.reshape(-1, 3))
    walls, _ = find_walls(Structure.from_fabric(fabric, tolerance), 1.0)
    assert len(walls) == 22
    assert sum(wall.curved for wall in walls) == curved


def test_flat_walls_beside_others_are_not_curved() -> None:
    """Parallel partitions in the box of a skewed wall, which they do not touch, and a roof that
    leans towards a facade of two faces."""

    def upright(*ends: float, lean: float = 0.0) -> np.ndarray:
        x0, z0, x1, z1 = ends
        a, b = np.array([x0, 0, z0]), np.array([x1, 0, z1])
        up = np.array([0.0, 3.0, lean])
        return np.array([[a, b, b + up], [a, b + up, a + up]])

    skew = [upright(0, 0, 10, 3.6), upright(6, 0.3, 9, 0.3), upright(6, 0.9, 9, 0.9)]
    mansard = [upright(20, z, 30, z) for z in (0.0, 0.3)]
    mansard += [upright(20, z, 30, z, lean=1.0) + [0, 3, 0] for z in (0.0, 0.3)]
    corners = np.concatenate(skew + mansard)
    fabric = Fabric.from_scene(scene_of(corners), SubdivideOptions())
    tolerance = Tolerance.for_points(corners.reshape(-1, 3))
    walls, _ = find_walls(Structure.from_fabric(fabric, tolerance), 1.0)
    assert len(walls) >= 5
    assert not any(wall.curved for wall in walls)


def test_rings_around_a_well_are_rooms_each() -> None:
    """Tangents of the well do not cut the room of another storey, nor each other's more than
    convex parts need."""
    turn = 2 * np.pi * np.arange(24) / 24
    around = np.column_stack([np.cos(turn), np.zeros(24), np.sin(turn)])
    triangles = []
    for low in (0.0, 3.3):
        ring = {
            (radius, height): radius * around + [0.0, low + height, 0.0]
            for radius in (1.5, 6.0)
            for height in (0.0, 3.0)
        }
        for corners in (
            [(6.0, 0.0), (6.0, 3.0)],
            [(1.5, 3.0), (1.5, 0.0)],
            [(1.5, 0.0), (6.0, 0.0)],
            [(6.0, 3.0), (1.5, 3.0)],
        ):
            a, b = (ring[corner] for corner in corners)
            c, d = np.roll(b, -1, axis=0), np.roll(a, -1, axis=0)
            triangles += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    cells = subdivide(scene_of(np.concatenate(triangles)))
    assert cells.cell_count == 2
    assert cells.leaf_count <= 30
