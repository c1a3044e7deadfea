"""The hints of whole models: sums, alignment, missed mass, rejected points, backends, errors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ptmtools.coverage.ach import compute_ach, shares
from ptmtools.coverage.backend import open_renderer, rasterising_pays
from ptmtools.coverage.item_buffer import Surfaces
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sampling import TRIES
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.visibility.model import Pvs


def all_visible(n):
    return Pvs.from_matrix(np.ones((n, n), dtype=bool))


def assert_same(one: Ach, other: Ach) -> None:
    for name, array in one.to_arrays().items():
        assert np.array_equal(array, other.to_arrays()[name]), name


@pytest.fixture
def no_gl(monkeypatch):
    """A machine without OpenGL."""
    import moderngl

    def fail(*_args, **_settings):
        raise OSError("libEGL.so: cannot open shared object file")

    monkeypatch.setattr(moderngl, "create_context", fail)


def test_rows_are_aligned_and_sum_to_1(room_row, backend):
    scene, cells = room_row(4)
    pvs = all_visible(4)
    ach = compute_ach(scene, cells, pvs, AchOptions(backend=backend, face=32))
    assert np.array_equal(ach.start, pvs.start)
    assert ach.value.shape == ach.pixels.shape == pvs.cell.shape
    for i in range(4):
        assert abs(math.fsum(ach.row(i)) - 1) <= 2.0**-53
        assert pvs.row(i)[np.argmax(ach.row(i))] == (i if i == 0 else pvs.row(i)[0])
        nearer_first = ach.row(i)[np.argsort(np.abs(pvs.row(i) - i), kind="stable")]
        assert nearer_first[0] == ach.row(i).max()
    assert (ach.missed == 0).all()
    assert (ach.samples == 8).all()
    assert (ach.rejected == 0).all()
    assert (ach.pixels.sum()) == 4 * 8 * 6 * 32**2
    assert ach.backend == backend
    assert ach.renderer


def test_what_the_pvs_lacks_is_missed(room_row):
    scene, cells = room_row(3)
    options = AchOptions(backend="embree", face=32)
    full = compute_ach(scene, cells, all_visible(3), options)
    lacking = np.ones((3, 3), dtype=bool)
    lacking[0, 2] = lacking[2, 0] = False
    pvs = Pvs.from_matrix(lacking)
    ach = compute_ach(scene, cells, pvs, options)
    assert ach.missed[0] == pytest.approx(full.row(0)[2])
    assert ach.missed[0] > 0
    assert ach.missed[1] == 0
    assert math.fsum(ach.row(0)) == pytest.approx(1, abs=1e-15)
    assert ach.row(0)[0] == pytest.approx(full.row(0)[0] / (1 - full.row(0)[2]))


def test_what_belongs_to_no_cell_is_missed(room_row):
    scene, cells = room_row(1)
    owner = cells.triangle_cell.copy()
    owner[:2] = -1  # the floor
    ach = compute_ach(
        scene,
        replace(cells, triangle_cell=owner),
        all_visible(1),
        AchOptions(backend="embree", face=32),
    )
    assert ach.missed[0] == pytest.approx(1 / 6, abs=0.02)
    assert ach.row(0).tolist() == [1.0]


def test_a_cell_that_sees_nothing_has_1_for_itself(room_row, backend):
    scene, cells = room_row(2)
    bare = replace(
        cells,
        triangle=cells.triangle[:0],
        triangle_source=cells.triangle_source[:0],
        triangle_cell=cells.triangle_cell[:0],
    )
    ach = compute_ach(scene, bare, all_visible(2), AchOptions(backend=backend))
    assert ach.value.tolist() == [1, 0, 1, 0]
    assert ach.pixels.tolist() == [0, 0, 0, 0]
    assert ach.missed.tolist() == [0, 0]


def test_no_cells_at_all(room_row):
    scene, cells = room_row(1)
    none = replace(
        cells,
        leaf_cell=np.zeros(0, np.int32),
        leaf_point_start=np.zeros(1, np.int64),
        leaf_face_start=np.zeros(1, np.int64),
        triangle_cell=np.full_like(cells.triangle_cell, -1),
    )
    pvs = Pvs(np.zeros(1, np.int64), np.zeros(0, np.int32))
    assert len(compute_ach(scene, none, pvs).value) == 0


@given(
    counts=st.lists(
        st.lists(st.integers(0, 2**40), min_size=1, max_size=50), min_size=1, max_size=8
    )
)
def test_shares_sum_to_1_for_any_counts(counts):
    start = np.cumsum([0, *map(len, counts)]).astype(np.int64)
    value = shares(start, np.concatenate(counts).astype(np.int64))
    for i, row in enumerate(counts):
        found = value[start[i] : start[i + 1]]
        assert abs(math.fsum(found) - 1) <= 2.0**-52
        assert ((found >= 0) & (found <= 1)).all()
        if not any(row):
            assert found[0] == 1


def test_workers_change_nothing(room_row):
    scene, cells = room_row(5)
    calls: list[tuple[int, int, str]] = []
    runs = [
        compute_ach(
            scene,
            cells,
            all_visible(5),
            AchOptions(backend="embree", face=16, workers=n),
            lambda *call: calls.append(call),
        )
        for n in (1, 2, 5)
    ]
    assert_same(runs[0], runs[1])
    assert_same(runs[0], runs[2])
    assert calls == [(i, 5, "coverage") for i in range(1, 6)] * 3
    assert AchOptions(workers=1) == AchOptions(workers=2)


def test_again_is_the_same(room_row, backend):
    scene, cells = room_row(2)
    options = AchOptions(backend=backend, face=32, samples=5)
    first = compute_ach(scene, cells, all_visible(2), options)
    assert_same(first, compute_ach(scene, cells, all_visible(2), options))
    other = compute_ach(scene, cells, all_visible(2), replace(options, seed=1))
    assert not np.array_equal(first.pixels, other.pixels)


def test_round_trip(room_row):
    scene, cells = room_row(2)
    ach = compute_ach(scene, cells, all_visible(2), AchOptions(face=16))
    assert_same(ach, Ach.from_arrays(ach.to_arrays()))


@pytest.mark.parametrize(
    ("offset", "power"), [((1e6, 1e6, -1e6), 0), ((0, 0, 0), -20), ((0, 0, 0), 20)]
)
def test_neither_place_nor_unit_matters(room_row, elsewhere, backend, offset, power):
    scene, cells = room_row(3)
    options = AchOptions(backend=backend, face=32)
    there = elsewhere(scene, cells, np.array(offset, dtype=float), 2.0**power)
    expected = compute_ach(scene, cells, all_visible(3), options)
    assert_same(expected, compute_ach(*there, all_visible(3), options))


def column(low, high):
    (x, z), (X, Z) = low, high
    return [
        [[x, 0, z], [x, 0, Z], [x, 4, Z], [x, 4, z]],
        [[X, 0, z], [X, 4, z], [X, 4, Z], [X, 0, Z]],
        [[x, 0, z], [x, 4, z], [X, 4, z], [X, 0, z]],
        [[x, 0, Z], [X, 0, Z], [X, 4, Z], [x, 4, Z]],
        [[x, 0, z], [X, 0, z], [X, 0, Z], [x, 0, Z]],
        [[x, 4, z], [x, 4, Z], [X, 4, Z], [X, 4, z]],
    ]


def test_points_inside_a_column_are_replaced(room_row, furnish):
    """A column fills one eighth of the room, around what would be a sample point."""
    scene, cells = room_row(2)
    quads = column((0.3, 0.3), (1.7, 1.7))
    filled = furnish(scene, cells, quads, [(0, 0)] * 6)
    ach = compute_ach(*filled, all_visible(2), AchOptions(backend="embree", face=16))
    assert ach.rejected[0] >= 2
    assert ach.rejected[1] == 0
    assert ach.samples.tolist() == [8, 8]
    open_space = compute_ach(scene, cells, all_visible(2), AchOptions(backend="embree", face=16))
    assert abs(ach.row(0)[1] - open_space.row(0)[1]) < 0.05


def test_a_part_full_of_matter_gives_no_sample(room_row, furnish):
    scene, cells = room_row(2)
    filled = furnish(scene, cells, column((1e-4, -0.3), (2.3, 2 - 1e-4)), [(0, 0)] * 6)
    ach = compute_ach(*filled, all_visible(2), AchOptions(backend="embree", face=16))
    assert ach.samples[0] == 6
    assert ach.rejected[0] >= 2 * TRIES


def test_a_cell_without_any_usable_point_is_still_looked_at(room_row, furnish, backend):
    scene, cells = room_row(2)
    filled = furnish(scene, cells, column((1e-4, 1e-4 - 2), (4 - 1e-4, 2 - 1e-4)), [(0, 0)] * 6)
    ach = compute_ach(*filled, all_visible(2), AchOptions(backend=backend, face=16))
    assert ach.samples.tolist() == [1, 8]
    assert ach.rejected[0] == 8 * TRIES
    assert ach.row(0).tolist() == [1, 0]


def test_clearance_keeps_points_off_the_walls(room_row):
    scene, cells = room_row(1)
    options = AchOptions(backend="embree", face=16, clearance=1.2)
    ach = compute_ach(scene, cells, all_visible(1), options)
    assert ach.rejected[0] > 0
    far = compute_ach(scene, cells, all_visible(1), replace(options, clearance=0.5))
    assert far.rejected[0] == 0


@pytest.mark.parametrize(
    "wrong",
    [
        {"samples": 0},
        {"face": 0},
        {"face": 4096},
        {"seed": -1},
        {"workers": 0},
        {"backend": "vulkan"},
        {"clearance": 0.0},
        {"clearance": float("nan")},
    ],
)
def test_options_that_make_no_sense(wrong):
    with pytest.raises(InputError, match="PTM-I500"):
        AchOptions(**wrong)


def test_inputs_that_do_not_belong_together(room_row):
    scene, cells = room_row(2)
    with pytest.raises(InputError, match="PTM-I501"):
        compute_ach(scene, cells, all_visible(3))
    with pytest.raises(InputError, match="PTM-I501"):
        compute_ach(room_row(1)[0], cells, all_visible(2))


def test_gl_without_opengl_says_what_to_install(room_row, no_gl):
    scene, cells = room_row(1)
    with pytest.raises(MissingComponentError, match="PTM-M500") as raised:
        compute_ach(scene, cells, all_visible(1), AchOptions(backend="gl"))
    assert "apt install libegl1" in str(raised.value)
    assert "\n" not in str(raised.value)


def test_auto_without_opengl_casts_rays(room_row, no_gl):
    scene, cells = room_row(2)
    ach = compute_ach(scene, cells, all_visible(2), AchOptions(face=16))
    assert ach.backend == "embree"
    assert ach.renderer.startswith("Embree")
    asked = compute_ach(scene, cells, all_visible(2), AchOptions(face=16, backend="embree"))
    assert_same(ach, asked)


def test_auto_goes_by_the_size_of_the_task(room_row, has_gl, require):
    assert rasterising_pays(1000, 64)
    assert not rasterising_pays(100_000, 64)
    assert rasterising_pays(100_000, 512)
    if not has_gl:
        require("OpenGL", "apt install libegl1 libgl1 libgl1-mesa-dri")
    surfaces = Surfaces.of(*room_row(1))
    renderer = open_renderer(surfaces, AchOptions())
    assert renderer.backend == "gl"
    renderer.close()


def test_hints_of_a_room_are_the_mean_of_its_leaves_by_volume(room_row):
    """Three rooms in a row, of which the first two become one cell of unequal leaves."""
    scene, cells = room_row(3)
    point = cells.leaf_point.copy()
    plane = cells.node_plane.copy()
    point[np.isclose(point[:, 0], 4.0), 0] = 1.0  # 1 m and 7 m long instead of 4 m and 4 m
    plane[np.isclose(plane[:, 3], -4.0), 3] = -1.0
    cells = replace(cells, leaf_point=point, node_plane=plane)
    options = AchOptions(backend="embree", face=32, samples=256)
    alone = compute_ach(scene, cells, all_visible(3), options)
    owner = np.array([0, 0, 1], dtype=np.int32)
    joined = replace(
        cells,
        leaf_cell=owner,
        triangle_cell=np.where(cells.triangle_cell >= 0, owner[cells.triangle_cell], -1).astype(
            np.int32
        ),
    )
    room = compute_ach(scene, joined, all_visible(2), options)
    of_third = [alone.row(leaf)[all_visible(3).row(leaf).tolist().index(2)] for leaf in (0, 1)]
    assert of_third[1] > 1.5 * of_third[0]
    by_volume = (1 * of_third[0] + 7 * of_third[1]) / 8
    assert room.row(0)[1] == pytest.approx(by_volume, rel=0.03)
    assert abs(by_volume - np.mean(of_third)) > 0.1 * by_volume, "a plain mean is something else"
