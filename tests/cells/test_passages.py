"""Door leaves that hide what is behind them and let visitors pass (`--doors pass`). The buildings
are those of `doored_rooms`; expectations follow from docs/design/cells.md."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Bools, Floats
from ptmtools.cells import Cells, SubdivideOptions, structural_triangles, subdivide
from ptmtools.scene.model import Material, Scene
from ptmtools.visibility import check_conservative, compute_pvs
from ptmtools.visibility.segments import Blockers
from tests.cells.buildings import BuildingCase, carved, room
from tests.cells.conftest import box, panel
from tests.cells.doored_rooms import (
    HOLE,
    OPEN,
    PAIR,
    PANELS,
    WIDE,
    A,
    B,
    Faces,
    Hole,
    leaf,
    rooms,
    said,
    scene,
    see,
    sheet,
    solid,
    together,
    wall,
)
from tests.scene.buildings import box as solid_box

PASS = SubdivideOptions()
#: The inside of a leaf that begins at x = 4.05.
INSIDE = (4.07, 1.0, 0.1)
C = (11.0, 1.0, 1.2)


def adjacent(cells: Cells, one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether a portal joins the cells of two points."""
    a, b = cells.locate(np.array([one, other])).tolist()
    return b in cells.adjacent()[a]


def three_rooms(*doors: Faces) -> Scene:
    """The rooms A and B, and C behind a doorway from x = 8.2 to 8.4, all in one line."""
    a, b = box((0, 0, -2), (4, 4, 2), "-x +x"), box((4.2, 0, -2), (8.2, 4, 2), "-x +x")
    c = box((8.4, 0, -2), (12.4, 4, 2), "-x")
    walls = [panel(0, None), wall(4, 4.2, HOLE), wall(8.2, 8.4, HOLE)]
    every = {f"door_{i}": door for i, door in enumerate(doors)}
    return scene(a, b, c, *walls, **every)


@pytest.mark.parametrize(
    ("hole", "door"),
    [
        pytest.param(HOLE, leaf(4.05), id="a leaf"),
        pytest.param(HOLE, leaf(4.0), id="flush with one face of the wall"),
        pytest.param(HOLE, sheet(4.1), id="a sheet"),
        pytest.param(HOLE, leaf(4.05) + PANELS, id="with panels"),
        pytest.param(WIDE, PAIR, id="a pair of leaves, 4 mm apart"),
        pytest.param(WIDE, leaf(4.05, WIDE), id="a pair in one piece"),
    ],
)
def test_a_leaf_hides_and_lets_pass(hole: Hole, door: Faces) -> None:
    """What it hides is decided by rays at what is drawn, and whether B is seen by the gap."""
    made = scene(rooms(hole), Door=door)
    cells, opened = subdivide(made), subdivide(made, OPEN)
    assert cells.closed
    assert together(cells, A, B)
    assert adjacent(cells, A, B)
    assert see(cells, A, B) == (door == PAIR)
    np.testing.assert_array_equal(cells.opened, opened.opened)
    assert set(cells.triangle_source[cells.emitted(made.two_sided)[0]]) >= set(cells.opened)
    structural = structural_triangles(made, PASS, cells.opened)
    assert structural[cells.opened].any()
    report = check_conservative(made.corners[structural], cells, compute_pvs(cells), 20_000)
    assert report.unoccluded > 1000
    assert report.missed == ()
    (note,) = said(cells)
    assert "walk through" in note


@pytest.mark.parametrize("gap", [1e-3, 3e-3, 2e-2])
def test_sight_leads_through_the_gap_around_a_leaf(gap: float) -> None:
    """But through no more of the doorway than that: the portals are as small as the gap."""
    made = scene(rooms(), Door=leaf(4.05, gap=gap))
    cells = subdivide(made)
    assert see(cells, A, B)
    assert cells.portal_passage.any()
    structural = structural_triangles(made, PASS, cells.opened)
    report = check_conservative(made.corners[structural], cells, compute_pvs(cells), 20_000)
    assert report.missed == ()
    at = (
        cells.portal_plane[: cells.sight_count, :3]
        @ [1.0, 0, 0]
        * -(cells.portal_plane[: cells.sight_count, 3])
    )
    door = (at > 4.04) & (at < 4.1)
    around = 2 * (1.0 * 2.1 - (1.0 - 2 * gap) * (2.1 - 2 * gap))  # of both faces
    hulls = [polygon_area(cells.portal(k)) for k in np.flatnonzero(door)]
    assert sum(hulls) == pytest.approx(around, rel=1e-3)


def polygon_area(points: Floats) -> float:
    """m² of a convex polygon in space."""
    across = np.cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0)
    return float(np.linalg.norm(across)) / 2


def test_a_leaf_of_bars_is_passed_as_a_whole() -> None:
    """Visitors are not stopped by a rail between two openings of the leaf: each of its faces has
    one passage, as large as the doorway. Sight passes between the bars."""
    y0, y1, z0, z1 = HOLE
    bars = [(y0, y1, z0, z0 + 0.1), (y0, y1, z1 - 0.1, z1), (y0, 0.1, z0, z1)]
    bars += [(y1 - 0.1, y1, z0, z1), (1.0, 1.1, z0, z1)]
    door = [face for a, b, c, d in bars for face in solid((4.05, a, c), (4.09, b, d))]
    cells = subdivide(scene(rooms(), Door=door), SubdivideOptions(door=("Door",)))
    assert see(cells, A, B)
    passages = np.flatnonzero(cells.portal_passage)
    assert len(passages) == 2
    for k in passages:
        assert polygon_area(cells.portal(k)) == pytest.approx(2.1)


def test_a_room_behind_two_leaves_is_no_neighbour() -> None:
    made = three_rooms(leaf(4.05), leaf(8.25))
    cells = subdivide(made)
    assert adjacent(cells, A, B)
    assert adjacent(cells, B, C)
    assert not adjacent(cells, A, C)
    assert compute_pvs(cells).to_matrix().sum() == cells.cell_count == 3
    assert see(subdivide(made, OPEN), A, C)


def test_one_leaf_hides_where_another_doorway_is_open() -> None:
    """C is seen from B, through the open doorway, and A from neither."""
    cells = subdivide(three_rooms(leaf(4.05)))
    assert see(cells, B, C)
    assert not see(cells, A, B)
    assert not see(cells, A, C)
    assert together(cells, A, B, C)


def test_a_leaf_hides_beside_another_way(tmp_path: Path) -> None:
    """A and B are also joined by a corridor behind them, through which neither sees the other: the
    leaf between them divides space that is connected anyway."""
    spaces = [room(0, 0, 3, 4), room(3.2, 0, 6.2, 4), room(0, 4.2, 6.2, 6)]
    ways = [(0, 4, 1, 4.2), (5.2, 4, 6.2, 4.2), (3, 1, 3.2, 2)]
    doorways = [((x0, y0, 0.0), (x1, y1, 2.1)) for x0, y0, x1, y1 in ways]
    door = solid_box((3.05, 1, 0), (3.1, 2, 2.1))
    made = BuildingCase({"building": carved(spaces, doorways), "Door": door}, {})
    scene = made.scene(tmp_path)
    one, other, behind = made.in_world(scene, [(2.5, 1.5, 1), (3.7, 1.5, 1), (3.1, 5, 1)])
    cells = {state: subdivide(scene, SubdivideOptions(doors=state)) for state in ("pass", "open")}
    assert see(cells["open"], one, other)
    assert not see(cells["pass"], one, other)
    assert see(cells["pass"], one, behind)
    assert adjacent(cells["pass"], one, other)


@pytest.mark.parametrize(
    "door", [leaf(4.05), leaf(4.0), leaf(4.16)], ids=["inside", "flush", "flush with the other"]
)
def test_an_eye_inside_a_leaf_belongs_to_the_cells_on_both_sides(door: Faces) -> None:
    """Faces that are seen from behind are not drawn, so from there it sees both rooms, and beyond:
    all of it is in the set of one of the two cells."""
    made = three_rooms(door)
    cells = subdivide(made)
    x = [point[0] for face in door for point in face]
    rng = np.random.default_rng(5)
    low, high = np.array([min(x), 0.01, -0.49]), np.array([max(x), 2.09, 0.49])
    eyes = rng.uniform(low, high, (4000, 3))
    own = cells.locate(eyes)
    both = cells.locate(np.array([A, B]))
    assert np.isin(own, both).all()
    masonry = structural_triangles(made, OPEN, cells.opened)
    ends = rng.uniform([0, 0, -2], [12.4, 4, 2], eyes.shape)
    clear = ~Blockers(made.corners[masonry], cells.root_box).block(eyes, ends)
    there = cells.locate(ends)
    clear &= there >= 0
    sets: Bools = compute_pvs(cells).to_matrix()[both].any(axis=0)
    assert clear.sum() > 1000
    assert sets[there[clear]].all()
    assert len(set(there[clear].tolist())) == 3


def test_nobody_stands_inside_a_leaf() -> None:
    cells = subdivide(scene(rooms(), Door=leaf(4.05)))
    inside = cells.locate_leaf(np.array([INSIDE]))[0]
    assert inside >= 0
    assert not cells.leaf_standing[inside]
    assert cells.leaf_standing[cells.locate_leaf(np.array([A, B]))].all()


def test_a_leaf_of_glass_hides_nothing() -> None:
    made = scene(rooms(), Door=leaf(4.05))
    glass = Material("glass", opacity=0.4, transparent=True)
    door = (made.triangle_object == made.objects.index("Door")).astype(np.int32)
    made = replace(made, materials=(*made.materials[:1], glass), triangle_material=door)
    assert see(subdivide(made), A, B)


def test_passages_are_stored() -> None:
    cells = subdivide(scene(rooms(), Door=leaf(4.05)))
    assert cells.portal_passage.sum() == 2
    assert cells.sight_count == cells.portal_count - 2
    arrays = cells.to_arrays()
    np.testing.assert_array_equal(Cells.from_arrays(arrays).portal_passage, cells.portal_passage)
    with pytest.raises(ValueError, match="ascend"):
        Cells.from_arrays(arrays | {"portal_passage": cells.portal_passage[::-1].copy()})
