"""The hints of whole models: sums, alignment, missed mass, rejected points, backends, errors."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ptmtools.coverage.ach import choose, compute_ach, triangles_of_a_pvs
from ptmtools.coverage.backends import BACKENDS, Backend
from ptmtools.coverage.backends.embree import EmbreeRenderer
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.placement import TRIES
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.lazy import Lazy
from ptmtools.parallel import Local
from ptmtools.visibility.model import Pvs

#: Eight points, at the middles of equal parts.
EIGHT = AchOptions(samples=8, face=32, placement="kd")


def all_visible(n):
    return Pvs.from_matrix(np.ones((n, n), dtype=bool))


def assert_same(one: Ach, other: Ach) -> None:
    for name, array in one.to_arrays().items():
        other_array = other.to_arrays()[name]
        assert np.array_equal(array, other_array, equal_nan=array.dtype.kind == "f"), name


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
    ach = compute_ach(scene, cells, pvs, replace(EIGHT, backend=backend))
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
    options = replace(EIGHT, backend="embree")
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


def test_what_lies_in_no_cell_is_missed(room_row, furnish):
    """Seen where a wall is left out: something beyond the room that no cell contains."""
    scene, cells = room_row(1)
    options = replace(EIGHT, backend="embree")
    kept = np.flatnonzero(cells.vertex[cells.triangle][:, :, 1].min(axis=1) < 4)
    open_above = replace(
        cells,
        triangle=cells.triangle[kept],
        triangle_source=cells.triangle_source[kept],
        triangle_cell=cells.triangle_cell[kept],
    )
    sky = [[[-9, 5, -9], [9, 5, -9], [9, 5, 9], [-9, 5, 9]]]
    ach = compute_ach(*furnish(scene, open_above, sky, [(-1, -1)]), all_visible(1), options)
    assert ach.missed[0] == pytest.approx(1 / 6, abs=0.02)
    assert ach.row(0).tolist() == [1.0]


def test_what_lies_in_a_cell_counts_for_it_whoever_owns_it(room_row):
    scene, cells = room_row(1)
    owner = cells.triangle_cell.copy()
    owner[:2] = -1  # the floor
    unowned = replace(cells, triangle_cell=owner)
    options = replace(EIGHT, backend="embree")
    ach = compute_ach(scene, unowned, all_visible(1), options)
    assert ach.missed[0] == 0
    assert ach.pixels[0] == 8 * 6 * 32**2


@pytest.mark.parametrize("tolerance", [None, 0.05])
def test_a_cell_that_sees_nothing_has_1_for_itself(room_row, backend, tolerance):
    scene, cells = room_row(2)
    bare = replace(
        cells,
        triangle=cells.triangle[:0],
        triangle_source=cells.triangle_source[:0],
        triangle_cell=cells.triangle_cell[:0],
    )
    options = AchOptions(backend=backend, tolerance=tolerance, per_texture=True)
    ach = compute_ach(scene, bare, all_visible(2), options)
    assert ach.value.tolist() == [1, 0, 1, 0]
    assert ach.pixels.tolist() == ach.seen.tolist() == [0, 0, 0, 0]
    assert (ach.texture.tolist(), ach.texture_value.tolist()) == ([-1, -1], [1, 1])
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


@pytest.mark.parametrize("knobs", [{"preset": "fast"}, {"tolerance": 0.02, "face": 4}])
def test_workers_change_nothing(room_row, monkeypatch, knobs):
    """However small the task: here two cells are worth two processes."""
    monkeypatch.setattr("ptmtools.coverage.ach.WORTH_A_PROCESS", 1.0)
    scene, cells = room_row(5)
    calls: list[tuple[int, int, str]] = []
    options = AchOptions(backend="embree", per_texture=True, **knobs)
    given = scene, cells, all_visible(5), options, lambda *call: calls.append(call)
    with Local(2) as local:
        runs = [compute_ach(*given), compute_ach(*given, local)]
    assert_same(runs[0], runs[1])
    assert calls == [(i, 5, "coverage") for i in range(1, 6)] * 2


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
    ("offset", "power"),
    [((1e6, 1e6, -1e6), 0), *(((0, 0, 0), power) for power in (-60, -20, 20, 60))],
)
def test_neither_place_nor_unit_matters(room_row, elsewhere, backend, offset, power):
    """Not a bit, where the unit is a power of two."""
    scene, cells = room_row(3)
    there = elsewhere(scene, cells, np.array(offset, dtype=float), 2.0**power)
    for options in (EIGHT, AchOptions(samples=16, face=4)):
        asked = all_visible(3), replace(options, backend=backend)
        assert_same(compute_ach(scene, cells, *asked), compute_ach(*there, *asked))


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
    ach = compute_ach(*filled, all_visible(2), replace(EIGHT, backend="embree", face=16))
    assert ach.rejected[0] >= 2
    assert ach.rejected[1] == 0
    assert ach.samples.tolist() == [8, 8]
    open_space = compute_ach(
        scene, cells, all_visible(2), replace(EIGHT, backend="embree", face=16)
    )
    assert abs(ach.row(0)[1] - open_space.row(0)[1]) < 0.05


def test_a_part_inside_a_solid_gives_no_sample(room_row, furnish):
    scene, cells = room_row(2)
    filled = furnish(scene, cells, column((1e-4, -0.3), (2.3, 2 - 1e-4)), [(0, 0)] * 6)
    ach = compute_ach(*filled, all_visible(2), replace(EIGHT, backend="embree", face=16))
    assert ach.samples[0] == 6
    assert ach.rejected[0] >= 2 * TRIES


def test_a_cell_without_any_usable_point_has_hints_all_the_same(room_row, furnish, backend):
    scene, cells = room_row(2)
    filled = furnish(scene, cells, column((1e-4, 1e-4 - 2), (4 - 1e-4, 2 - 1e-4)), [(0, 0)] * 6)
    ach = compute_ach(*filled, all_visible(2), replace(EIGHT, backend=backend, face=16))
    assert ach.samples.tolist() == [1, 8]
    assert ach.rejected[0] == 8 * TRIES
    assert ach.row(0).tolist() == [1, 0]


def test_clearance_keeps_points_off_the_walls(room_row):
    scene, cells = room_row(1)
    options = replace(EIGHT, backend="embree", face=16, clearance=1.2)
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
        {"backend": "vulkan"},
        {"preset": "best"},
        {"placement": "grid"},
        {"weighting": "area"},
        {"gpu": -1},
        {"tolerance": 0.0},
        {"tolerance": float("nan")},
        {"tolerance": 1.0},
        {"tolerance": 0.01, "placement": "kd"},
        {"clearance": 0.0},
        {"clearance": float("nan")},
    ],
)
def test_options_that_make_no_sense(wrong):
    with pytest.raises(InputError, match="PTM-I111"):
        AchOptions(**wrong)


def test_inputs_that_do_not_belong_together(room_row):
    scene, cells = room_row(2)
    with pytest.raises(InputError, match="PTM-I400"):
        compute_ach(scene, cells, all_visible(3))
    with pytest.raises(InputError, match="PTM-I400"):
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


def test_who_names_a_device_wants_that_one(room_row, no_gl):
    scene, cells = room_row(1)
    with pytest.raises(MissingComponentError, match="on device 3"):
        compute_ach(scene, cells, all_visible(1), AchOptions(gpu=3))


def test_any_seed_will_do_with_a_tolerance(room_row):
    scene, cells = room_row(2)
    options = AchOptions(tolerance=0.2, backend="embree", seed=2**32 - 1, samples=64)
    actual = compute_ach(scene, cells, all_visible(2), options)
    other = compute_ach(scene, cells, all_visible(2), replace(options, seed=2**32 - 2))
    assert (actual.samples == 64).all()
    assert not np.array_equal(actual.pixels, other.pixels)


@pytest.mark.parametrize(
    ("device", "triangles", "face", "expected"),
    [
        ("llvmpipe (LLVM 15)", 1000, 64, "gl"),
        ("llvmpipe (LLVM 15)", 100_000, 64, "embree"),
        ("llvmpipe (LLVM 15)", 100_000, 512, "gl"),
        ("llvmpipe (LLVM 15)", 40, 2, "embree"),
        ("NVIDIA", 40, 2, "embree"),
        ("NVIDIA", 100_000, 64, "embree"),
        ("NVIDIA", 5000, 64, "gl"),
        ("NVIDIA", 100_000, 512, "gl"),
    ],
)
def test_auto_goes_by_the_device_and_the_size_of_the_task(
    room_row, monkeypatch, device, triangles, face, expected
):
    context = SimpleNamespace(info={"GL_RENDERER": device}, release=lambda: None)
    monkeypatch.setattr("ptmtools.coverage.backends.opengl.create_context", lambda gpu: context)
    where = "ptmtools.coverage.ach.triangles_of_a_pvs"
    monkeypatch.setattr(where, lambda cells, pvs: float(triangles))
    _, cells = room_row(2)
    assert choose(cells, all_visible(2), AchOptions(face=face)).name == expected


@pytest.mark.parametrize(("face", "expected"), [(256, "gl"), (2, "embree")])
def test_auto_on_this_machine(room_row, gl, face, expected):
    scene, cells = room_row(2)
    assert triangles_of_a_pvs(cells, all_visible(2)) > len(cells.triangle)
    options = AchOptions(face=face, samples=1)
    assert compute_ach(scene, cells, all_visible(2), options).backend == expected


class Toy(EmbreeRenderer):
    """Rays that take every surface for the first triangle."""

    name = "toy 1.0"

    def show(self, points, needed=None):
        return np.minimum(super().show(points, needed), 0)


def open_toy(surfaces, face, gpu):
    return Toy(surfaces, face)


def cost_of_toy(triangles, pixels, gpu):
    return -1.0


@pytest.fixture
def toy(monkeypatch):
    """A backend more: one declaration, one line in the table."""
    opener, coster = Lazy(f"{__name__}:open_toy"), Lazy(f"{__name__}:cost_of_toy")
    declared = Backend("toy", "sees one thing", opener, coster)
    monkeypatch.setitem(BACKENDS, "toy", declared)


@pytest.mark.parametrize("backend", ["toy", "auto"])
def test_a_backend_is_added_by_one_line(room_row, toy, backend):
    """It is the cheapest too, so auto takes it."""
    ach = compute_ach(*room_row(3), all_visible(3), AchOptions(backend=backend, preset="fast"))
    assert (ach.backend, ach.renderer) == ("toy", "toy 1.0")
    assert [ach.row(0)[0], ach.row(1)[1], ach.row(2)[1]] == [1, 1, 1], "the floor of room 0"


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
