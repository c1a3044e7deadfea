"""The check that catches a PVS missing something, and is not taken in by cracks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.errors import InputError
from ptmtools.visibility import Pvs, check_conservative, compute_pvs
from ptmtools.visibility.segments import Blockers, Sampler


def without_portal(cells: Cells, k: int) -> Cells:
    keep = np.arange(cells.portal_count) != k
    sizes = np.diff(cells.portal_start)
    return replace(
        cells,
        portal_leaf=cells.portal_leaf[keep],
        portal_plane=cells.portal_plane[keep],
        portal_point=cells.portal_point[np.repeat(keep, sizes)],
        portal_start=np.concatenate([[0], np.cumsum(sizes[keep])]),
        portal_area=cells.portal_area[keep],
    )


@pytest.mark.parametrize("kept", [True, False])
def test_a_row_of_rooms_passes_and_without_one_portal_fails(room_row, kept):
    scene, cells = room_row(4)
    structural = scene.points[scene.triangles]
    pvs = compute_pvs(cells if kept else without_portal(cells, 1))
    report = check_conservative(structural, cells, pvs, 40_000, 7)
    assert report.tried == 40_000
    assert 5_000 < report.unoccluded < 35_000
    pairs = [miss.cells for miss in report.missed]
    assert pairs == ([] if kept else [(0, 2), (0, 3), (1, 2), (1, 3)])
    for miss in report.missed:
        assert miss.segments > 0
        ends = np.array([miss.start, miss.end])
        assert cells.locate(ends).tolist() == list(miss.cells)
        box = structural.reshape(-1, 3)
        assert not Blockers(structural, box).block(ends[:1], ends[1:])[0]
    assert report.missed_segments == sum(miss.segments for miss in report.missed)


def test_the_same_seed_gives_the_same_report(room_row):
    scene, cells = room_row(3)
    structural = scene.points[scene.triangles]
    alone = Pvs.from_matrix(np.eye(3, dtype=bool))
    one, two, other = (
        check_conservative(structural, cells, alone, 5_000, seed) for seed in (1, 1, 2)
    )
    assert one == two
    assert one != other
    assert one.missed


@pytest.mark.parametrize(("width", "missed"), [(2e-5, False), (2e-2, True)])
def test_a_hairline_crack_is_not_believed_and_a_narrow_slit_is(build_rooms, width, missed):
    doors = {(0, 0, 0, 0): [(0.0, 3.0, 2.0, 2.0 + width)]}
    rooms = build_rooms([0.0, 4.0, 8.0], [0.0, 3.0], [0.0, 4.0], doors)
    alone = Pvs.from_matrix(np.eye(2, dtype=bool))
    report = check_conservative(rooms.triangles, rooms.cells, alone, 20_000)
    assert bool(report.missed) == missed
    assert report.hairlines > 0


def test_samples_fill_the_cells_as_promised(room_row):
    cells = room_row(5)[1]
    start, end = Sampler(cells).segments(np.random.default_rng(0), 40_000)
    assert len(start) == len(end) == 40_000
    quarter = start[:10_000]
    assert (cells.locate(quarter) >= 0).all()
    assert np.abs(np.bincount(cells.locate(quarter), minlength=5) - 2_000).max() < 250
    assert np.abs(quarter.mean(axis=0) - [10, 2, 0]).max() < 0.2
    # Segments through portals: the line from start to end meets a door.
    a, b = start[30_000:], end[30_000:]
    for wall in (4.0, 8.0, 12.0, 16.0):
        t = (wall - a[:, 0]) / (b[:, 0] - a[:, 0])
        at = a + np.clip(t, 0, 1)[:, None] * (b - a)
        crosses = (t > 0) & (t < 1)
        assert crosses.sum() > 1_000
        in_door = (np.abs(at[:, 2]) <= 1) & (at[:, 1] <= 3) & (at[:, 1] >= 0)
        assert in_door[crosses].mean() > 0.5


def test_nothing_to_block_and_nothing_to_sample(room_row, build_rooms):
    scene, cells = room_row(2)
    report = check_conservative(np.zeros((0, 3, 3)), cells, compute_pvs(cells), 1_000)
    assert report.unoccluded == report.tried == 1_000
    empty = replace(
        cells,
        leaf_cell=cells.leaf_cell[:0],
        leaf_point_start=cells.leaf_point_start[:1],
        leaf_face_start=cells.leaf_face_start[:1],
    )
    nobody = Pvs.from_matrix(np.zeros((0, 0), bool))
    assert check_conservative(scene.points[scene.triangles], empty, nobody, 1_000).tried == 0
    one = build_rooms([0, 1], [0, 1], [0, 1], {})
    report = check_conservative(one.triangles, one.cells, compute_pvs(one.cells), 1_000)
    assert (report.tried, report.missed) == (1_000, ())


def test_what_does_not_belong_together_is_an_error(room_row):
    scene, cells = room_row(2)
    structural = scene.points[scene.triangles]
    pvs = compute_pvs(cells)
    other = compute_pvs(room_row(3)[1])
    for triangles, sets in (
        (structural.reshape(-1, 3), pvs),
        (structural * np.nan, pvs),
        (structural, other),
    ):
        with pytest.raises(InputError, match="PTM-I400"):
            check_conservative(triangles, cells, sets, 10)


def test_progress_ends_at_the_total(room_row):
    scene, cells = room_row(2)
    steps = []
    check_conservative(
        scene.points[scene.triangles], cells, compute_pvs(cells), 1_000, 0,
        lambda *step: steps.append(step),
    )  # fmt: skip
    assert steps[-1] == (1_000, 1_000, "segments")
