"""Rooms without a ceiling end at the tops of their walls. The expectations follow from
docs/design/cells.md: a straight line that leaves a room above its walls enters none."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats, normals
from ptmtools.cells import Cells, SubdivideOptions, structural_triangles, subdivide
from ptmtools.cells.doors import enclosure
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.orientation.space import to_world
from ptmtools.visibility import check_conservative, compute_pvs
from tests.cells.buildings import carved, room, write
from tests.cells.strangers import Parts, office, serpentine
from tests.scene.buildings import box, house, meadow, sheet

NONE = SubdivideOptions(ceiling="none")


def scene_of_parts(parts: Parts, folder: Path) -> Scene:
    return ingest(write(folder / "model.obj", parts.items()), IngestOptions(unit="m", up="z"))


def middles(scene: Scene, points: list[tuple[float, float, float]]) -> Floats:
    """Points of the model in world coordinates."""
    return np.asarray(to_world(np.array(points), scene.space))


def halls(scene: Scene, cells: Cells, count: int = 4) -> list[int]:
    """The cells in the middle of each hall."""
    at = middles(scene, [(8.3 * k + 4.3, 6.0, 1.6) for k in range(count)])
    return cells.locate(at).tolist()


def sees(cells: Cells, one: int, other: int) -> bool:
    return bool(compute_pvs(cells).to_matrix()[one, other])


@pytest.mark.parametrize("apart", [0.0, 0.01, 0.03, 0.1])
def test_halls_without_a_ceiling_see_through_doorways_only(apart: float, tmp_path: Path) -> None:
    scene = scene_of_parts(serpentine(apart=apart), tmp_path)
    cells = subdivide(scene)
    a, b, c, d = halls(scene, cells)
    assert len({a, b, c, d}) == 4
    assert sees(cells, a, b)
    assert sees(cells, b, c)
    assert sees(cells, a, c)  # from one doorway to the next
    assert not sees(cells, a, d)
    structural = scene.corners[structural_triangles(scene, SubdivideOptions())]
    report = check_conservative(structural, cells, compute_pvs(cells), 50_000)
    assert report.unoccluded > 1000
    assert report.missed == ()
    (note,) = [note for note in cells.notes if "open at the top" in note]
    assert isinstance(note, Warned)
    assert (apart > 0) == ("tops of their walls" in note) == (cells.ceiling is not None)


def test_without_it_all_halls_see_one_another(tmp_path: Path) -> None:
    scene = scene_of_parts(serpentine(), tmp_path)
    cells = subdivide(scene, NONE)
    assert cells.ceiling is None
    a, b, c, d = halls(scene, cells)
    assert all(sees(cells, one, other) for one, other in ((a, c), (b, d), (a, d)))


def test_what_towers_over_the_walls_is_seen_from_afar(tmp_path: Path) -> None:
    """A pillar of 9 m in the last hall: its upper part belongs to a cell that the first one sees,
    that is view-only, and its lower part is hidden."""
    parts = serpentine() | {"pillar": box((29.5, 2, 0), (29.8, 2.3, 9))}
    scene = scene_of_parts(parts, tmp_path)
    cells = subdivide(scene)
    first, *_, last = halls(scene, cells)
    high, low = cells.locate(middles(scene, [(29, 2, 8), (29, 2, 1)])).tolist()
    assert sees(cells, first, high)
    assert not sees(cells, first, low)
    assert not sees(cells, first, last)
    assert not cells.standing[high]
    structural = scene.corners[structural_triangles(scene, SubdivideOptions())]
    assert check_conservative(structural, cells, compute_pvs(cells), 50_000).missed == ()


def test_the_inside_of_a_pillar_is_no_room(tmp_path: Path) -> None:
    """It is the largest leaf that does not touch the box around the model, and has a floor."""
    parts = serpentine() | {"pillar": box((29.5, 2, 0), (31, 3.5, 9))}
    scene = scene_of_parts(parts, tmp_path)
    cells = subdivide(scene)
    assert not cells.closed
    assert cells.locate(middles(scene, [(30, 2.5, 1)])).tolist() == [-1]
    assert len(set(halls(scene, cells)) - {-1}) == 4


def test_space_above_one_room_belongs_to_it(tmp_path: Path) -> None:
    """A hall whose walls are not quite of one height is one cell, with what is above."""
    walls = [
        box((0, 0, -0.2), (8, 12, 0)),
        box((0, 0, 0), (0.3, 12, 4)),
        box((7.7, 0, 0), (8, 12, 4.03)),
        box((0.3, 0, 0), (7.7, 0.3, 4.06)),
        box((0.3, 11.7, 0), (7.7, 12, 4.03)),
    ]
    cells = subdivide(scene_of_parts({"hall": np.concatenate(walls)}, tmp_path))
    assert cells.ceiling is not None
    lower, upper = cells.leaf_cell[cells.portal_leaf[cells.in_ceiling]].T
    assert len(lower) > 0
    assert (lower == upper).all()


def test_nothing_that_can_be_seen_is_lost(tmp_path: Path) -> None:
    """Upright surfaces are drawn to the same area with a ceiling and without."""
    scene = scene_of_parts(serpentine(), tmp_path)
    drawn = []
    for cells in (subdivide(scene), subdivide(scene, NONE)):
        pieces, _ = cells.emitted(np.zeros(len(scene.triangles), dtype=np.bool_))
        corners = cells.vertex[cells.triangle[np.unique(pieces)]]
        across = normals(corners)
        upright = np.abs(across[:, 1]) < 1e-6 * np.linalg.norm(across, axis=1)
        drawn.append(np.linalg.norm(across[upright], axis=1).sum() / 2)
    assert drawn[0] == pytest.approx(drawn[1])


def test_a_building_with_ceilings_stays_as_it_is(tmp_path: Path) -> None:
    scene = scene_of_parts(office(4), tmp_path)
    cells, without = subdivide(scene), subdivide(scene, NONE)
    assert cells.ceiling is None
    np.testing.assert_array_equal(cells.node_plane, without.node_plane)


def test_walls_of_all_heights_have_no_ceiling(tmp_path: Path) -> None:
    """Towers of 3 to 30 m on a square: none of their heights is a room's."""
    towers = {
        f"tower {k}": box(
            (10 * k, 10 * (k * 7 % 5), 0), (10 * k + 6, 10 * (k * 7 % 5) + 6, 3 + 3 * k)
        )
        for k in range(10)
    }
    scene = scene_of_parts({"ground": box((-5, -5, -1), (105, 55, 0)), **towers}, tmp_path)
    assert subdivide(scene).ceiling is None


def test_the_ceiling_is_stored(tmp_path: Path) -> None:
    cells = subdivide(scene_of_parts(serpentine(), tmp_path))
    assert cells.ceiling == pytest.approx(4.2)  # above the bottom of the floor
    assert Cells.from_arrays(cells.to_arrays()).ceiling == cells.ceiling
    assert cells.in_ceiling.any()
    np.testing.assert_allclose(
        np.concatenate([cells.portal(k) for k in np.flatnonzero(cells.in_ceiling)])[:, 1], 4.2
    )


def hall(holes: list[tuple[float, float, float, float]]) -> Floats:
    """A hall of 12 × 12 m, 3 m high, whose floor is two triangles, with rectangular holes in its
    ceiling."""
    lines = [np.unique([0.0, 12.0, *(e for hole in holes for e in hole[k::2])]) for k in (0, 1)]
    parts = [
        sheet((0, 0, 0), (12, 0, 0), (12, 12, 0), (0, 12, 0)),
        sheet((0, 0, 0), (0, 0, 3), (12, 0, 3), (12, 0, 0)),
        sheet((0, 12, 0), (12, 12, 0), (12, 12, 3), (0, 12, 3)),
        sheet((0, 0, 0), (0, 12, 0), (0, 12, 3), (0, 0, 3)),
        sheet((12, 0, 0), (12, 0, 3), (12, 12, 3), (12, 12, 0)),
    ]
    for x0, x1 in pairwise(lines[0].tolist()):
        for y0, y1 in pairwise(lines[1].tolist()):
            if not any(a <= x0 and x1 <= c and b <= y0 and y1 <= d for a, b, c, d in holes):
                parts.append(sheet((x0, y0, 3), (x0, y1, 3), (x1, y1, 3), (x1, y0, 3)))
    return np.concatenate(parts)


@pytest.mark.parametrize(
    ("building", "roofed"),
    [
        (hall([(3.5, 3.5, 4.5, 4.5), (7.5, 7.5, 8.5, 8.5)]), 1 - 2 / 144),  # over the middles
        (hall([(0, 0, 7, 12), (9, 0, 12, 12)]), 2 / 12),
        (meadow(house()), 1.0),
        (meadow(house(roof=False)), 0.0),
    ],
    ids=["skylights", "a strip", "land around it", "land and no ceiling"],
)
def test_the_floor_is_measured_by_area(building: Floats, roofed: float, tmp_path: Path) -> None:
    around = enclosure(scene_of_parts({"building": building}, tmp_path))
    assert around.roofed == pytest.approx(roofed, abs=0.015)


def test_two_skylights_are_no_open_top(tmp_path: Path) -> None:
    holes = [(3.5, 3.5, 4.5, 4.5), (7.5, 7.5, 8.5, 8.5)]
    cells = subdivide(scene_of_parts({"hall": hall(holes)}, tmp_path))
    assert not any("open at the top" in note for note in cells.notes)


def test_a_storey_without_a_ceiling_has_one_over_others_that_have(tmp_path: Path) -> None:
    """Halls that are open above, on a storey of as much floor."""
    raised = {name: part + [0, 0, 3] for name, part in serpentine(2).items()}
    ground = house(16.9, 12.6, 2.8, roof=False) + [0, -0.3, 0]
    scene = scene_of_parts({**raised, "ground": ground}, tmp_path)
    cells = subdivide(scene)
    assert cells.ceiling == pytest.approx(7.3)
    a, b = cells.locate(middles(scene, [(4.3, 6, 4.6), (12.6, 6, 4.6)])).tolist()
    assert a != b
    assert any("open at the top" in note for note in cells.notes)


def test_a_house_in_a_garden_keeps_its_storeys(tmp_path: Path) -> None:
    """Most of what lies among walls, a fence, is open, but rooms above them have ceilings."""
    rooms = [room(x, 0, x + 4, 5, z, z + 2.8) for z in (0, 3) for x in (0, 4.2)]
    holes = [((4, 2, z), (4.2, 3, z + 2.1)) for z in (0, 3)] + [((1, -0.2, 0), (2, 0, 2.1))]
    walls = [((-16, y), (24, y + 0.1)) for y in (-16, 20.9)]
    walls += [((x, -16), (x + 0.1, 21)) for x in (-16, 23.9)]
    fence = [box((*low, -0.2), (*high, 1.6)) for low, high in walls]
    parts = {"house": carved(rooms, holes), "fence": np.concatenate(fence)}
    parts["garden"] = box((-16, -16, -0.5), (24, 21, -0.2))
    scene = scene_of_parts(parts, tmp_path)
    cells = subdivide(scene)
    assert cells.ceiling is None
    places = [(x, 2.5, z + 1.0) for z in (0, 3) for x in (2, 6)]
    assert len(set(cells.locate(middles(scene, places)).tolist())) == 4


def test_an_unknown_ceiling_is_an_error() -> None:
    with pytest.raises(InputError, match="auto or none"):
        SubdivideOptions(ceiling="flat")  # type: ignore[arg-type]
