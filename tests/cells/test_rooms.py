"""Leaves grow into rooms, and rooms are parted again where it pays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.cells.rooms import _in_order
from ptmtools.cells.sight import _even, _lines, join_by_gain, portals_of, sampled_sight
from ptmtools.errors import InputError
from ptmtools.scene import ingest
from ptmtools.scene.model import Scene
from ptmtools.visibility import compute_pvs

BuildScene = Callable[..., Scene]
Faces = Callable[..., list[list[list[float]]]]

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
WHOLE = SubdivideOptions(cells="room", gain=1.0)


@pytest.fixture
def halved(quads: BuildScene, room_faces: Faces, partition: Faces) -> Callable[[float], Scene]:
    """``halved(width)``: a hall of 8 × 4 × 4 m, a wall across it with an opening of full height
    and so many metres of width."""

    def build(width: float) -> Scene:
        hole = (0.0, 4.0, -width / 2, width / 2)
        return quads([*room_faces([-4, 0, -2], [4, 4, 2]), *partition(0.0, hole)])

    return build


def locate(cells: Cells, *points: tuple[float, float, float]) -> list[int]:
    return cells.locate(np.array(points, dtype=np.float64)).tolist()


def test_a_room_ends_at_its_door_and_holds_the_doorway() -> None:
    scene = ingest(SAMPLES / "two_rooms/two_rooms.obj")
    leaves = subdivide(scene, SubdivideOptions(cells="leaf"))
    rooms = subdivide(scene, WHOLE)
    assert leaves.cell_count == 3
    assert rooms.cell_count == 2
    volume = np.bincount(rooms.leaf_cell, rooms.leaf_volumes())
    assert sorted(volume) == pytest.approx([48.0, 48.4])
    assert not any("1 hall" in note for note in rooms.notes)


def test_a_wide_opening_joins_and_a_narrow_one_parts(halved: Callable[[float], Scene]) -> None:
    assert subdivide(halved(3.0), WHOLE).cell_count == 1
    assert subdivide(halved(2.5), WHOLE).cell_count == 2
    assert subdivide(halved(3.0), replace(WHOLE, cells="leaf")).cell_count > 1


def test_two_doors_are_not_one_opening(
    quads: BuildScene, room_faces: Faces, partition: Faces
) -> None:
    """A corridor 2 m wide beside a hall: each of the doors is 1.6 of the corridor's 4 m²."""
    doors = [
        [[0, y0, z0], [0, y1, z0], [0, y1, z1], [0, y0, z1]]
        for y0, y1, z0, z1 in (
            (0, 2, -10, -5),
            (0, 1.6, -4, 4),
            (0, 2, 5, 10),
            (1.6, 2, -5, -4),
            (1.6, 2, -4, 4),
            (1.6, 2, 4, 5),
        )
    ]
    cells = subdivide(quads([*room_faces([-6, 0, -10], [2, 2, 10]), *doors]), WHOLE)
    corridor, hall = locate(cells, (1, 1, 0), (-3, 1, 0))
    assert corridor != hall


def test_cells_are_numbered_by_their_first_leaves_and_own_their_geometry(
    halved: Callable[[float], Scene],
) -> None:
    scene = halved(2.0)
    leaves = subdivide(scene, replace(WHOLE, cells="leaf"))
    rooms = subdivide(scene, WHOLE)
    _, first = np.unique(rooms.leaf_cell, return_index=True)
    assert np.all(np.diff(first) > 0)
    owner = leaves.triangle_cell
    assert np.array_equal(rooms.triangle_cell, np.where(owner >= 0, rooms.leaf_cell[owner], -1))
    for name in ("leaf_point", "portal_point", "node_child", "vertex"):
        assert np.array_equal(getattr(rooms, name), getattr(leaves, name))


def test_the_sets_of_a_room_are_the_union_of_its_leaves(corridor: Scene) -> None:
    leaves = subdivide(corridor, replace(WHOLE, cells="leaf"))
    rooms = subdivide(corridor, replace(WHOLE, gain=0.05))
    room = rooms.leaf_cell
    expected = np.zeros((rooms.cell_count, rooms.cell_count), dtype=bool)
    a, b = np.nonzero(compute_pvs(leaves).to_matrix())
    expected[room[a], room[b]] = True
    assert not expected.all()
    assert np.array_equal(compute_pvs(rooms).to_matrix(), expected)


def test_a_hall_is_one_cell_and_says_so(quads: BuildScene, room_faces: Faces) -> None:
    """Screens that part nothing: leaves, but no gain."""
    screens = [[[x, 0, -1], [x, 1, -1], [x, 1, 1], [x, 0, 1]] for x in (-6, -2, 2, 6)]
    scene = quads([*room_faces([-10, 0, -5], [10, 6, 5]), *screens])
    assert subdivide(scene, SubdivideOptions(cells="leaf", wall_area=1)).cell_count > 4
    hall = subdivide(scene, SubdivideOptions(cells="room", wall_area=1))
    assert hall.cell_count == 1
    assert hall.notes[-1] == "visibility culling saves nothing here: the model is a single hall"


@pytest.fixture
def corridor(quads: BuildScene) -> Scene:
    """A stair in plan: 2 × 2 m in section, five straight stretches of 20 m."""
    plan = [(0, 0), (20, 0), (20, 18), (38, 18), (38, 36), (58, 36)]
    plan += [(58, 38), (36, 38), (36, 20), (18, 20), (18, 2), (0, 2)]
    sides = [
        [[a, 0, b], [c, 0, d], [c, 2, d], [a, 2, b]]
        for (a, b), (c, d) in zip(plan, plan[1:] + plan[:1], strict=True)
    ]
    flats = [
        [[a, y, b], [c, y, b], [c, y, d], [a, y, d]]
        for y in (0, 2)
        for a, b, c, d in (
            (0, 0, 20, 2),
            (18, 2, 20, 18),
            (18, 18, 38, 20),
            (36, 20, 38, 36),
            (36, 36, 58, 38),
        )
    ]
    return quads([*sides, *flats])


def test_gain_parts_a_room_where_that_pays(corridor: Scene) -> None:
    def cells(gain: float) -> int:
        return subdivide(corridor, replace(WHOLE, gain=gain)).cell_count

    leaves = subdivide(corridor, replace(WHOLE, cells="leaf")).cell_count
    assert cells(1.0) == 1
    assert 1 < cells(0.2) < leaves
    assert cells(0.0) == leaves
    parted = subdivide(corridor, replace(WHOLE, gain=0.05))
    here, there = locate(parted, (5, 1, 1), (55, 1, 37))
    assert here != there


@pytest.mark.parametrize(("quarters", "scale"), [(1, 1.0), (2, 1.0), (3, 1.0), (0, 1 / 1024)])
def test_the_same_cells_turned_and_in_other_units(
    corridor: Scene, quarters: int, scale: float
) -> None:
    turn = np.linalg.matrix_power(np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0.0]]), quarters) * scale
    options = replace(WHOLE, gain=0.05)
    here = subdivide(corridor, options)
    there = subdivide(
        corridor.with_points(corridor.points @ turn.T),
        replace(options, wall_area=2 * scale**2, wall_thickness=0.5 * scale),
    )
    middle = np.array([here.leaf_points(i).mean(axis=0) for i in range(here.leaf_count)])
    cell = there.locate(middle @ turn.T)
    assert there.cell_count == here.cell_count > 1
    same_here = here.leaf_cell[:, None] == here.leaf_cell
    assert np.array_equal(same_here, cell[:, None] == cell)


def test_lines_are_even_in_a_portal_and_do_not_know_its_first_corner_or_side() -> None:
    polygon = np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 1, 0]], dtype=np.float64)
    share = _even(512)
    origin, along = _lines(polygon, np.array([0.0, 0, 1]), share)
    assert origin.mean(axis=0) == pytest.approx([20 / 9, 7 / 9, 0], abs=0.03)
    assert np.all(origin[:, 1] <= 1 + origin[:, 0] / 4 + 1e-12)
    assert along[:, 2].mean() == pytest.approx(2 / 3, abs=0.01)  # of a density by the cosine
    turned, back = _lines(np.roll(polygon, 1, axis=0)[::-1], np.array([0.0, 0, -1]), share)
    lines, others = np.hstack([origin, along]), np.hstack([turned, -back])
    apart = np.abs(lines[:, None] - others).max(axis=2)
    assert apart.min(axis=1).max() < 1e-12


def test_lines_do_not_know_what_is_level() -> None:
    """A doorway laid on its side has the same lines."""
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    polygon = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]], dtype=np.float64)
    share = _even(64)
    upright = np.hstack(_lines(polygon, np.array([0.0, 0, 1]), share))
    origin, along = _lines(polygon @ turn.T, np.array([0.0, 0, 1]), share)
    laid = np.hstack([origin @ turn, along @ turn])
    assert np.abs(upright[:, None] - laid).max(axis=2).min(axis=1).max() < 1e-12


def test_gain_by_hand() -> None:
    """Four leaves in a row that see 3, 3, 4 and 2 leaves; all of one volume and one area."""
    sees = np.array([[1, 1, 1, 0], [1, 1, 1, 0], [1, 1, 1, 1], [0, 0, 1, 1]], dtype=bool)
    pairs = np.array([[0, 1], [1, 2], [2, 3]], dtype=np.int32)
    one = np.ones(4)
    assert join_by_gain(sees, one, one, pairs, 0.0).tolist() == [0, 1, 2, 3]
    assert join_by_gain(sees, one, one, pairs, 1e-5).tolist() == [0, 0, 2, 3]
    # Three leaves that fetch four each: 12; apart 3 + 3 + 4. All four: 16 against 12.
    assert join_by_gain(sees, one, one, pairs, 0.166).tolist() == [0, 0, 2, 3]
    assert join_by_gain(sees, one, one, pairs, 0.167).tolist() == [0, 0, 0, 3]
    assert join_by_gain(sees, one, one, pairs, 0.25).tolist() == [0, 0, 0, 3]
    assert join_by_gain(sees, one, one, pairs, 0.251).tolist() == [0, 0, 0, 0]
    # What holds nothing costs nothing, but only pairs are joined.
    assert join_by_gain(sees, one, np.zeros(4), pairs[2:], 0.1).tolist() == [0, 1, 2, 2]


def test_sampled_sight_is_within_the_flow_and_finds_most_of_it(corridor: Scene) -> None:
    cells = subdivide(corridor, SubdivideOptions(cells="leaf"))
    sees = sampled_sight(portals_of(cells))
    flow = compute_pvs(cells).to_matrix()
    assert np.array_equal(sees, sees.T)
    assert not np.any(sees & ~flow)
    assert sees.sum() > 0.8 * flow.sum()
    assert not flow.all()


def test_any_number_of_lines_comes_in_eights(
    corridor: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    cells = subdivide(corridor, SubdivideOptions(cells="leaf"))
    monkeypatch.setattr("ptmtools.cells.sight.LINES", 128 * cells.portal_count)
    even = sampled_sight(portals_of(cells))
    monkeypatch.setattr("ptmtools.cells.sight.LINES", 135 * cells.portal_count)
    assert np.array_equal(sampled_sight(portals_of(cells)), even)


@pytest.mark.parametrize("gain", [-0.1, 1.1, float("nan")])
def test_a_gain_that_is_no_share_is_refused(halved: Callable[[float], Scene], gain: float) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        subdivide(halved(1.0), SubdivideOptions(gain=gain))


def test_leaves_are_put_in_order_as_their_lists_of_shares_are() -> None:
    random = np.random.default_rng(3)
    for _ in range(200):
        leaves = int(random.integers(1, 8))
        held = random.integers(0, 3, (leaves, 4)) / 2  # many ties, and some that hold nothing
        leaf, source = np.nonzero(held)
        lists = [
            [(s, -held[i, s]) for s in np.flatnonzero(held[i])] + [(99, 0.0)] for i in range(leaves)
        ]
        order = sorted(range(leaves), key=lists.__getitem__)
        rank = _in_order(leaf, source, held[leaf, source], leaves)
        assert np.argsort(rank).tolist() == order
