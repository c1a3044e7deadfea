"""Solids that only a polygon smaller than a wall closes, and what is not closed."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from ptmtools.cells import Cells, subdivide
from ptmtools.cells.planar import open_part, unite
from ptmtools.cells.planes import Polyhedron, parallel_gap
from ptmtools.cells.split_planes import _see_through, find_caps
from ptmtools.cells.structure import Structure, WallPlane
from ptmtools.scene import IngestOptions, ingest
from ptmtools.tolerance import Tolerance
from tests.cells.buildings import AXES, write
from tests.cells.strangers import office
from tests.scene.buildings import box


def ramp(x0: float, x1: float) -> list[list[float]]:
    y0, y1 = 0.75 + 0.6 * x0, 0.75 + 0.6 * x1
    return [[x0, y0, -2], [x1, y1, -2], [x1, y1, 2], [x0, y0, 2]]


def upright(x: float, low: float, high: float, z0: float = -2, z1: float = 2) -> list[list[float]]:
    return [[x, low, z0], [x, high, z0], [x, high, z1], [x, low, z1]]


def hall(room_faces, edge: list) -> list:
    """Two storeys, between them a slab of 0.3 m from x = 4 on, which ``edge`` closes there. The
    plane of two ramps meets the edge in the middle: over it the slab has no underside."""
    shell = room_faces((0, 0, -2), (10, 7, 2))
    slab = [[[4, y, -2], [10, y, -2], [10, y, 2], [4, y, 2]] for y in (3.0, 3.3)]
    return [*shell, *slab, *edge, ramp(0.2, 3.6), ramp(4.4, 9.5)]


def leaf_at(cells: Cells, point: list[float]) -> int:
    """The leaf that holds a point, or -1."""
    return int(cells.locate_leaf(np.array([point]))[0])


IN_THE_SLAB = [[4.1, 3.25, 0], [4.5, 3.1, 1], [9, 3.15, -1]]


def test_the_edge_of_a_slab_closes_it_beside_a_slope(quads, room_faces) -> None:
    cells = subdivide(quads(hall(room_faces, [upright(4, 3, 3.3)])))
    assert cells.closed
    assert [leaf_at(cells, p) for p in IN_THE_SLAB] == [-1, -1, -1]
    for air in ([3.9, 3.25, 0], [3.9, 3.05, 0], [8, 1, 0], [8, 5, 0], [1, 0.5, 0], [1, 6, 0]):
        assert leaf_at(cells, air) >= 0


@pytest.mark.parametrize("gap", [0.001, 0.1])
def test_an_edge_with_a_gap_is_no_cap(quads, room_faces, gap: float) -> None:
    scene = quads(hall(room_faces, [upright(4, 3, 3.3, -2, 1), upright(4, 3, 3.3, 1 + gap, 2)]))
    assert gap > scene.tolerance.hairline
    assert all(leaf_at(subdivide(scene), p) >= 0 for p in IN_THE_SLAB)


def with_duct(room_faces, boards: list[float]) -> list:
    """Two rooms, a door and beside it a duct of 1 m², from the one into the other, 3 m long, with
    boards across it."""
    wall = [(0, 4, -2, -1.5), (3, 4, -1.5, -0.5), (0, 4, -0.5, 0.5), (0, 4, 1.5, 2)]
    wall += [(0, 1, 0.5, 1.5), (2, 4, 0.5, 1.5)]
    level = [[[4, y, 0.5], [7, y, 0.5], [7, y, 1.5], [4, y, 1.5]] for y in (1, 2)]
    sides = [[[4, 1, z], [7, 1, z], [7, 2, z], [4, 2, z]] for z in (0.5, 1.5)]
    parts = [upright(4, *p) for p in wall] + [upright(x, 1, 2, 0.5, 1.5) for x in boards]
    return [*room_faces((0, 0, -2), (8, 4, 2)), *parts, *level, *sides]


def test_a_cap_that_cuts_nothing_off_is_taken_back(quads, room_faces) -> None:
    plain = subdivide(quads(with_duct(room_faces, [])))
    parted = subdivide(quads(with_duct(room_faces, [5.5])))
    assert np.allclose(np.sort(parted.leaf_volumes()), np.sort(plain.leaf_volumes()))
    assert np.allclose(np.sort(parted.portal_area), np.sort(plain.portal_area))


def test_caps_that_seal_a_void_stay(quads, room_faces) -> None:
    plain = subdivide(quads(with_duct(room_faces, [])))
    sealed = subdivide(quads(with_duct(room_faces, [5, 6.5])))
    x = [leaf_at(sealed, [x, 1.5, 1]) for x in (4.5, 5.5, 6, 7.5)]
    assert (x[0] >= 0, x[1:3], x[3] >= 0) == (True, [-1, -1], True)
    assert x[0] != x[3]
    assert sealed.leaf_count == plain.leaf_count + 1
    assert np.isclose(plain.leaf_volumes().sum() - sealed.leaf_volumes().sum(), 1.5)


def test_caps_of_a_body_are_those_of_its_parts(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Those that are kept from one split to the next are all that a search finds anew."""
    inherited = []

    def search(structure: Structure, body: Polyhedron, known: Any = ()) -> list[WallPlane]:
        kept, fresh = find_caps(structure, body, known), find_caps(structure, body)
        planes = [[cap.frame.plane for cap in caps] for caps in (kept, fresh)]
        for plane, others in [*product(planes[0], planes[1:]), *product(planes[1], planes[:1])]:
            gaps = [parallel_gap(plane, candidate, structure.tolerance) for candidate in others]
            assert min(gaps) <= structure.tolerance.thin
        inherited.append(bool(known) and bool(kept))
        return kept

    monkeypatch.setattr("ptmtools.cells.bsp.find_caps", search)
    mullions = [box((0.6 * k, -6, 0), (0.6 * k + 0.06, -5.9, 3)) for k in range(35)]
    rails = [box((0, -6, z), (21, -5.9, z + 0.06)) for z in (0, 0.8, 1.6, 2.4)]
    ground = box((-9, -9, -0.3), (30, 15, -0.25))
    parts = office(4) | {"facade": np.concatenate([*mullions, *rails, ground])}
    subdivide(ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES)))
    assert sum(inherited) > 10


def test_few_points_see_through_openings_only() -> None:
    tolerance = Tolerance.for_extent(10.0)
    angle = np.linspace(0, 2 * np.pi, 7)[:-1]
    outline = np.stack([2 * np.cos(angle), np.sin(angle)], axis=1)
    generator = np.random.default_rng(5)
    seen = 0
    for count in range(1, 120):
        triangles = generator.uniform(-2.5, 2.5, (count % 40, 3, 2))
        if not _see_through(outline, triangles, tolerance.hairline):
            continue
        opening = open_part(shapely.polygons(outline), unite(triangles, tolerance.grid), tolerance)
        assert not shapely.is_empty(opening)
        seen += 1
    assert 40 < seen < 119
