"""In which leaves one can stand, and the fate of the others, as docs/design/cells.md defines it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, structural_triangles, subdivide
from ptmtools.cells.model import EyeRegion
from ptmtools.cells.options import WALKER
from ptmtools.cells.sight import join_by_gain
from ptmtools.coverage.placement import CellVolume
from ptmtools.diagnostics import Warned
from ptmtools.scene.model import Camera, Scene
from ptmtools.visibility import check_conservative, compute_pvs
from ptmtools.visibility.segments import _Eyes
from tests.cells.test_places import floor_of

LEAVES = SubdivideOptions(cells="leaf")
RAMP = np.array([[[0.0, 0, 0], [0, 0, 4], [8, 4, 4]], [[0.0, 0, 0], [8, 4, 4], [8, 4, 0]]])


def level(x0: float, x1: float, z0: float, z1: float, y: float) -> list:
    return floor_of(x0, x1, z0, z1, y)


@pytest.fixture
def attic(quads, room_faces) -> Scene:
    """A hall of 20 × 8 × 4 m; a ceiling at 3 m with a hole of 2 × 8 m; above it, to the right, a
    hatch into a chamber, and at its far end one upwards into another that no line reaches from
    below. Nobody fits into the chambers."""
    hall = room_faces((0, 0, -4), (20, 4, 4), "+y")
    ceiling = [level(0, 9, -4, 4, 3), level(11, 20, -4, 4, 3)]
    top = [level(0, 18, -4, 4, 4), level(18, 20, -4, -2, 4), level(18, 20, 2, 4, 4)]
    upper = room_faces((10, 4, -2), (20, 4.6, 2), "-y +y") + [level(12, 20, -2, 2, 4.6)]
    last = room_faces((10, 4.6, -2), (12, 5.4, 2), "-y")
    return quads(hall + ceiling + top + upper + last)


def leaf_at(cells: Cells, *point: float) -> int:
    (leaf,) = cells.locate_leaf(np.array([point])).tolist()
    assert leaf >= 0
    return int(leaf)


def test_the_eye_region_is_above_its_floor_and_no_higher_than_eyes_are() -> None:
    region = EyeRegion(RAMP, WALKER)
    points = [(4, 2.0, 2), (4, 1.9, 2), (4, 4.1, 2), (4, 4.3, 2), (9, 5, 2), (0, 0, 0), (2, 2, -1)]
    assert region.contains(np.array(points, dtype=np.float64)).tolist() == [
        *(True, False, True, False, False, True, False)
    ]
    assert not region.everywhere
    everywhere = EyeRegion(np.zeros((0, 3, 3)), WALKER)
    assert everywhere.everywhere
    assert everywhere.contains(np.ones((2, 3))).all()
    assert region.contains(np.zeros((0, 3))).tolist() == []


def test_above_a_ceiling_one_does_not_stand_and_what_is_seen_stays(attic: Scene) -> None:
    cells = subdivide(attic, LEAVES)
    hall, plenum = leaf_at(cells, 5, 1, 0), leaf_at(cells, 5, 3.5, 0)
    assert cells.leaf_standing[hall]
    assert not cells.leaf_standing[plenum]
    assert cells.leaf_cell[plenum] >= 0
    standing = cells.standing
    assert standing[cells.leaf_cell[hall]]
    assert not standing[cells.leaf_cell[plenum]]


def test_what_nobody_sees_is_dropped_and_counted(attic: Scene) -> None:
    cells = subdivide(attic, LEAVES)
    dropped = leaf_at(cells, 11, 5, 0)
    assert not cells.leaf_standing[dropped]
    assert cells.leaf_cell[dropped] == -1
    assert cells.locate(np.array([[11, 5, 0]])).tolist() == [-1]
    assert any("cannot be seen from walkable floor" in note for note in cells.notes)
    assert not (cells.triangle_cell.max(axis=1) < 0).any()
    pvs = compute_pvs(cells)
    assert pvs.cell_count == cells.cell_count
    everywhere = subdivide(attic, replace(LEAVES, standing="anywhere"))
    assert everywhere.leaf_standing.all()
    assert (everywhere.leaf_cell >= 0).all()
    assert not len(everywhere.eye_floor)


def test_only_what_somebody_stands_at_one_end_of_is_promised(attic: Scene) -> None:
    cells = subdivide(attic, LEAVES)
    seen = compute_pvs(cells).to_matrix()
    every = compute_pvs(replace(cells, leaf_standing=np.ones_like(cells.leaf_standing))).to_matrix()
    beside = np.zeros_like(seen)
    for cell, others in enumerate(cells.adjacent()):
        beside[cell, others] = True
    standing = cells.standing
    promised = every & (standing[:, None] | standing)
    assert (seen == (promised | beside | np.eye(len(seen), dtype=bool))).all()
    assert (seen == seen.T).all()


@pytest.mark.parametrize("viewpoints", [(), ((10.0, 1.0, 0.0),)])
def test_without_floors_one_may_be_anywhere_and_is_told(quads, room_faces, viewpoints) -> None:
    rooms = []
    for x in (0, 20, 40):
        rooms += room_faces((x, 0, -4), (x + 18, 4, 4), "-y")
    cells = subdivide(quads(rooms), SubdivideOptions(viewpoints=viewpoints))
    assert cells.leaf_standing.all()
    assert (cells.leaf_cell >= 0).all()
    assert not len(cells.eye_floor)
    (printed,) = [note for note in cells.notes if "fits on no floor" in note]
    assert isinstance(printed, Warned)


@pytest.mark.parametrize("two_sided", [True, False])
def test_a_floor_that_faces_down_is_stood_on_where_one_can_come(
    quads, room_faces, two_sided: bool
) -> None:
    scene = quads([*room_faces((0, 0, -4), (20, 4, 4), "-y"), level(0, 20, -4, 4, 0)[::-1]])
    scene = replace(scene, two_sided=np.full(len(scene.triangles), two_sided))
    cells = subdivide(scene)
    assert cells.closed
    assert cells.eyes.contains(np.array([[10, 1.6, 0], [10, 3, 0]])).tolist() == [True, False]


def test_where_the_model_has_a_camera_one_stands(attic: Scene) -> None:
    camera = Camera("above", (5.0, 3.5, 0.0), (1.0, 0.0, 0.0), 1.0)
    cells = subdivide(replace(attic, cameras=(camera,)), LEAVES)
    assert cells.leaf_standing[leaf_at(cells, 5, 3.5, 0)]


def test_where_a_viewpoint_was_asked_for_one_stands(attic: Scene) -> None:
    options = replace(LEAVES, viewpoints=((5.0, 3.5, 0.0),))
    cells = subdivide(attic, options)
    assert cells.leaf_standing[leaf_at(cells, 5, 3.5, 0)]


def test_hints_are_sampled_where_eyes_are(quads, room_faces) -> None:
    tower = quads(room_faces((0, 0, -4), (8, 30, 4)))
    (volume,) = CellVolume.of_cells(subdivide(tower))
    for points in (
        volume.sobol(0, 4096, 0),
        volume.random(0, 4096, 0),
        np.concatenate(volume.parts(8, 0)),
    ):
        assert len(points) > 100
        assert points[:, 1].max() <= 2.2
        assert points[:, 1].max() > 2.0
    assert len(volume.sobol(0, 4096, 0)) > 3000  # and not one in fifteen
    assert volume.anywhere().sobol(0, 4096, 0)[:, 1].max() > 29


def test_the_check_begins_where_eyes_are_and_misses_what_was_dropped(attic: Scene) -> None:
    cells = subdivide(attic, LEAVES)
    pvs = compute_pvs(cells)
    walls = attic.corners[structural_triangles(attic, LEAVES)]
    report = check_conservative(walls, cells, pvs, 50_000)
    assert report.tried == 50_000
    assert report.missed == ()
    plenum = leaf_at(cells, 5, 3.5, 0)
    poorer = cells.leaf_cell.copy()
    poorer[plenum] = -1
    (first, *_) = check_conservative(walls, replace(cells, leaf_cell=poorer), pvs, 50_000).missed
    assert first.cells[0] == -1
    leaf = cells.locate_leaf(np.array([first.start, first.end]))
    assert leaf[0] == plenum
    assert cells.leaf_standing[leaf[1]]
    assert cells.eyes.contains(np.array([first.end])).all()


def test_the_check_finds_a_leaf_that_is_wrongly_said_not_to_stand(attic: Scene) -> None:
    cells = subdivide(attic, LEAVES)
    walls = attic.corners[structural_triangles(attic, LEAVES)]
    wrong = replace(cells, leaf_standing=np.zeros_like(cells.leaf_standing))
    assert len(cells.eye_floor)
    pvs = compute_pvs(wrong)
    assert (pvs.to_matrix() < compute_pvs(cells).to_matrix()).any()
    assert check_conservative(walls, wrong, pvs, 50_000).missed


def test_slivers_join_and_what_many_see_stays_apart() -> None:
    # Leaves 0 and 1 see each other; 2, a sliver beside 0, is seen by 0 and 1; 3, large, beside 0,
    # is seen by 1 to 9, which are far away.
    count = 10
    sees = np.eye(count, dtype=np.bool_)
    for a, b in [(0, 1), (0, 2), (1, 2), *((3, i) for i in range(1, count))]:
        sees[a, b] = sees[b, a] = True
    volume = np.array([50.0, 50, 0, 0, *[50.0] * 6])
    area = np.array([100.0, 100, 1, 80, *[100.0] * 6])
    group = join_by_gain(sees, volume, area, np.array([[0, 2], [0, 3], [0, 1]], np.int32), 0.1)
    assert group[2] == group[0]
    assert group[3] != group[0]
    assert join_by_gain(sees, volume, area, np.array([[0, 3]], np.int32), 1.0)[3] == 0


def test_a_gain_of_nothing_keeps_slivers_apart_even_if_they_cost_nothing() -> None:
    sees, pairs = np.eye(3, dtype=np.bool_), np.array([[0, 1], [1, 2]], np.int32)
    volume, area = np.array([50.0, 0, 0]), np.array([100.0, 0, 0])
    assert join_by_gain(sees, volume, area, pairs, 0.0).tolist() == [0, 1, 2]
    assert len(set(join_by_gain(sees, volume, area, pairs, 0.1).tolist())) == 1


@pytest.mark.parametrize("camera", [True, False])
def test_the_check_begins_where_a_camera_makes_a_leaf_stand(quads, room_faces, camera) -> None:
    rooms = room_faces((0, 0, -4), (20, 4, 4)) + room_faces((30, 0, -2), (34, 4, 2))
    cells = subdivide(quads(rooms))
    there = np.array([[32.0, 3.9, 0.0]])  # above all eyes
    leaf = cells.locate_leaf(there)
    standing = cells.leaf_standing.copy()
    standing[leaf] = camera
    here = cells.eye_floor[cells.eye_floor[:, :, 0].max(axis=1) < 25]
    cells = replace(cells, eye_floor=here, leaf_standing=standing)
    assert _Eyes(cells).may_be_at(there, leaf).tolist() == [camera]
