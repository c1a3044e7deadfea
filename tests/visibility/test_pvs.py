"""Visible pairs of hand-made rooms, by the whole of `compute_pvs`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from ptmtools.cells.model import Cells
from ptmtools.errors import InputError
from ptmtools.parallel import Local
from ptmtools.portal_flow.flow import Portals, portal_flow
from ptmtools.visibility import Pvs, PvsOptions, check_conservative, compute_pvs

# Four rooms in a row along x; doors at z 0-1, 3-4, 0-1: a line through the first two rises by at
# least 1/2 and passes x = 12 at z >= 5.
ROW = (np.arange(5) * 4.0, [0.0, 3.0], [0.0, 4.0])
ZIGZAG = {
    (0, 0, 0, 0): [(0.0, 2.0, 0.0, 1.0)],
    (1, 0, 0, 0): [(0.0, 2.0, 3.0, 4.0)],
    (2, 0, 0, 0): [(0.0, 2.0, 0.0, 1.0)],
}
ZIGZAG_SEEN = np.array([[1, 1, 1, 0], [1, 1, 1, 1], [1, 1, 1, 1], [0, 1, 1, 1]], bool)


def seen(cells: Cells, **options: int) -> np.ndarray:
    return compute_pvs(cells, PvsOptions(**options)).to_matrix()


@pytest.mark.parametrize("n", [2, 3, 9])
def test_aligned_doors_show_all_rooms(room_row, n):
    assert seen(room_row(n)[1]).all()


def test_zigzag_doors_hide_the_far_room(build_rooms):
    assert np.array_equal(seen(build_rooms(*ROW, ZIGZAG).cells), ZIGZAG_SEEN)


def test_a_wider_door_shows_the_far_room(build_rooms):
    doors = {**ZIGZAG, (1, 0, 0, 0): [(0.0, 2.0, 1.4, 4.0)]}
    # From (4, z <= 1) through (8, 1.4) the line passes x = 12 at 1.8 at least: still hidden.
    assert np.array_equal(seen(build_rooms(*ROW, doors).cells), ZIGZAG_SEEN)
    doors[1, 0, 0, 0] = [(0.0, 2.0, 0.9, 4.0)]
    assert seen(build_rooms(*ROW, doors).cells).all()


def test_doors_in_one_wall_do_not_show_each_other(build_rooms):
    # A long room at x 4-8 with two small ones at its left, z 0-4 and 4-8, and one at its right.
    xs, ys, zs = [0.0, 4.0, 8.0], [0.0, 3.0], [0.0, 4.0, 8.0]
    whole = [(4.0, 8.0, 0.0, 3.0)]  # the halves of the long room are fully open to each other
    doors = {
        (0, 0, 0, 0): [(0.0, 2.0, 1.0, 3.0)],
        (0, 0, 1, 0): [(0.0, 2.0, 5.0, 7.0)],
        (1, 0, 0, 2): whole,
    }
    rooms = build_rooms(xs, ys, zs, doors)
    matrix = seen(rooms.cells)
    a, b = rooms.index(0, 0, 0), rooms.index(0, 0, 1)
    c, d = rooms.index(1, 0, 0), rooms.index(1, 0, 1)
    assert matrix[a, c]
    assert matrix[a, d]
    assert matrix[b, c]
    assert not matrix[a, b]


def test_two_doors_between_the_same_rooms(build_rooms):
    doors = {**ZIGZAG, (1, 0, 0, 0): [(0.0, 2.0, 3.0, 4.0), (0.0, 2.0, 0.0, 0.5)]}
    assert seen(build_rooms(*ROW, doors).cells).all()


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 0.3048, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("turned", [False, True])
def test_scale_place_and_turn_change_nothing(build_rooms, scale, turned):
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) if turned else np.eye(3)
    for away in (0.0, 100.0):
        rooms = build_rooms(*ROW, ZIGZAG, lambda p, away=away: (p + away) @ turn * scale)
        assert np.array_equal(seen(rooms.cells), ZIGZAG_SEEN)


def test_near_ties_are_counted(build_rooms):
    # The second door begins where all lines through the first two end: at z = 2 of the far wall.
    doors = {**ZIGZAG, (1, 0, 0, 0): [(0.0, 2.0, 1.5, 4.0)]}

    def pvs(top):
        rooms = build_rooms(*ROW, {**doors, (2, 0, 0, 0): [(0.0, 2.0, 0.0, top)]})
        return compute_pvs(rooms.cells)

    beside, touching, overlapping = pvs(1.9), pvs(2.0), pvs(2.1)
    assert [int(p.ties.sum()) for p in (beside, overlapping)] == [0, 0]
    assert touching.ties.sum() > 0
    assert np.array_equal(touching.cell, beside.cell)
    assert len(overlapping.cell) > len(touching.cell)
    assert np.array_equal(Pvs.from_arrays(touching.to_arrays()).ties, touching.ties)


def test_the_result_is_symmetric_and_begins_with_the_cell(build_rooms):
    pvs = compute_pvs(build_rooms(*ROW, ZIGZAG).cells)
    assert np.array_equal(pvs.to_matrix(), pvs.to_matrix().T)
    assert [int(pvs.row(i)[0]) for i in range(4)] == [0, 1, 2, 3]
    again = Pvs.from_arrays(pvs.to_arrays())
    assert np.array_equal(again.cell, pvs.cell)
    assert np.array_equal(again.volume, pvs.volume)


def test_cells_have_the_volume_of_their_leaves(build_rooms):
    cells = build_rooms(*ROW, ZIGZAG).cells
    grouped = replace(cells, leaf_cell=np.array([0, 1, 2, 2], np.int32))
    leaves = cells.leaf_volumes()
    assert compute_pvs(cells).volume == pytest.approx(leaves)
    for options in (PvsOptions(), PvsOptions(method="sampled", lines=100)):
        volume = compute_pvs(grouped, options).volume
        assert volume == pytest.approx([leaves[0], leaves[1], leaves[2] + leaves[3]])


def test_cells_of_several_leaves_see_what_their_leaves_see(build_rooms):
    cells = build_rooms(*ROW, ZIGZAG).cells
    grouped = replace(cells, leaf_cell=np.array([0, 1, 2, 2], np.int32))
    assert seen(grouped).all()
    ends_in_one = replace(cells, leaf_cell=np.array([0, 0, 1, 2], np.int32))
    assert np.array_equal(seen(ends_in_one), np.ones((3, 3), bool))


def test_no_portals(build_rooms):
    cells = build_rooms(*ROW, {}).cells
    assert np.array_equal(seen(cells), np.eye(4, dtype=bool))
    assert np.array_equal(seen(build_rooms([0, 1], [0, 1], [0, 1], {}).cells), [[True]])


def test_a_portal_from_a_leaf_into_itself(build_rooms):
    cells = build_rooms(*ROW, ZIGZAG).cells
    loop = replace(cells, portal_leaf=np.array([[0, 1], [1, 1], [2, 3]], np.int32))
    expected = np.kron(np.eye(2, dtype=bool), np.ones((2, 2), bool))
    assert np.array_equal(seen(loop), expected)


@pytest.mark.parametrize("flat", ["line", "point"])
def test_a_flat_portal_still_joins_its_own_cells(build_rooms, flat):
    cells = build_rooms(*ROW, ZIGZAG).cells
    point = cells.portal_point.copy()
    point[2:4] = point[1] if flat == "line" else point[0]
    point[1] = point[1] if flat == "line" else point[0]
    matrix = seen(replace(cells, portal_point=point))
    assert matrix[0, 1]
    assert matrix[1, 3]
    assert not matrix[0, 3]


def test_the_budget_only_loosens_and_is_reported(build_rooms):
    rng = np.random.default_rng(3)
    rooms = random_grid(build_rooms, rng, (5, 2, 4), 0.8)
    full = compute_pvs(rooms.cells)
    none = compute_pvs(rooms.cells, PvsOptions(budget=0))
    assert full.fallbacks == 0
    assert none.fallbacks > 0
    a, b = full.to_matrix(), none.to_matrix()
    assert not (a & ~b).any()
    assert (b & ~a).any()
    assert np.array_equal(b, b.T)


@pytest.mark.parametrize("budget", [0, 300, 200_000])
def test_the_number_of_workers_changes_nothing(build_rooms, budget):
    rooms = random_grid(build_rooms, np.random.default_rng(5), (5, 3, 4), 0.9)
    one = compute_pvs(rooms.cells, PvsOptions(budget=budget))
    for workers in (2, 5):
        with Local(workers) as local:
            other = compute_pvs(rooms.cells, PvsOptions(budget=budget), executor=local)
        assert np.array_equal(one.start, other.start)
        assert np.array_equal(one.cell, other.cell)
        assert one.fallbacks == other.fallbacks


def test_searches_that_can_save_little_are_left_out(build_rooms, monkeypatch):
    """Random lines leave less open than the gain, of the first bound or of all cells; else the sets
    are those of the searches."""
    rooms = random_grid(build_rooms, np.random.default_rng(3), (5, 2, 4), 0.8)
    searched = compute_pvs(rooms.cells, PvsOptions(gain=0))
    bound = compute_pvs(rooms.cells, PvsOptions(method="fast"))
    assert searched.volume_at_hand[0] < bound.volume_at_hand[0]
    monkeypatch.setattr("ptmtools.visibility.pvs.MANY_PORTALS", 1)
    for gain in (0.0, 0.001):
        again = compute_pvs(rooms.cells, PvsOptions(gain=gain))
        assert np.array_equal(again.cell, searched.cell)
        assert again.spared == 0
    spared = compute_pvs(rooms.cells, PvsOptions(gain=0.2))
    assert np.array_equal(spared.cell, bound.cell)
    assert 1 - searched.volume_at_hand[0] / bound.volume_at_hand[0] <= spared.spared < 0.2
    assert not spared.fallbacks
    assert Pvs.from_arrays(spared.to_arrays()).spared == spared.spared
    most = compute_pvs(rooms.cells, PvsOptions(gain=0.9))
    assert most.to_matrix().all()
    assert 1 - searched.volume_at_hand[0] <= most.spared < 0.9
    with pytest.raises(InputError, match="pvs-gain"):
        PvsOptions(gain=1)


def random_grid(build_rooms, rng, shape, share):
    cuts = [np.concatenate([[0], np.cumsum(rng.uniform(1, 5, n))]) for n in shape]
    doors = {}
    for room in np.ndindex(*shape):
        for axis in range(3):
            if rng.random() > share:
                continue
            door = []
            for a in ((axis + 1) % 3, (axis + 2) % 3):
                low, high = cuts[a][room[a]], cuts[a][room[a] + 1]
                if rng.random() < 0.3:  # from wall to wall: shares edges with others
                    door += [low, high]
                else:
                    door += list(low + (high - low) * np.sort(rng.random(2)))
            doors[(*room, axis)] = [tuple(door)]
    return build_rooms(*cuts, doors)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(1, 5), st.integers(1, 2), st.integers(1, 4)),
    share=st.floats(0.3, 1.0),
    budget=st.sampled_from([0, 50, 200_000]),
)
def test_what_a_ray_sees_is_in_the_pvs(build_rooms, seed, shape, share, budget):
    rooms = random_grid(build_rooms, np.random.default_rng(seed), shape, share)
    pvs = compute_pvs(rooms.cells, PvsOptions(budget=budget))
    report = check_conservative(rooms.triangles, rooms.cells, pvs, 20_000, seed % 1000)
    assert report.missed == ()


def test_broken_input_is_an_error(build_rooms):
    cells = build_rooms(*ROW, ZIGZAG).cells
    wrong = [
        (replace(cells, portal_leaf=cells.portal_leaf + 2), "PTM-I400"),
        (replace(cells, portal_start=cells.portal_start + 1), "PTM-I400"),
        (replace(cells, portal_start=cells.portal_start[:-1]), "PTM-I400"),
        (replace(cells, portal_plane=cells.portal_plane * 0), "PTM-I400"),
        (replace(cells, portal_point=cells.portal_point * np.nan), "PTM-I400"),
        (replace(cells, portal_plane=cells.portal_plane + np.inf), "PTM-I400"),
    ]
    for damaged, code in wrong:
        with pytest.raises(InputError) as caught:
            compute_pvs(damaged)
        assert caught.value.code == code
    for options in ({"budget": -1}, {"lines": 0}):
        with pytest.raises(InputError, match="PTM-I111"):
            PvsOptions(**options)


def test_too_many_portals_is_an_error_before_memory_is_taken():
    n = 100_000
    portals = Portals(
        2,
        np.tile(np.array([[0, 1]], np.int32), (n, 1)),
        np.tile([[1.0, 0, 0]], (n, 1)),
        np.zeros((3 * n, 3)),
        3 * np.arange(n + 1),
    )
    with pytest.raises(InputError, match="PTM-L400"):
        portal_flow(portals, 0)


def test_progress_is_reported(build_rooms):
    steps = []
    compute_pvs(build_rooms(*ROW, ZIGZAG).cells, progress=lambda *step: steps.append(step))
    assert steps[-1] == (6, 6, "portals")
