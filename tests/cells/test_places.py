"""Places where a visitor can stand, none of which is lost.

Expectations follow from the definitions in docs/design/cells.md and precede the first run."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from ptmtools.arrays import areas
from ptmtools.cells import Cells, SubdivideOptions, places as places_module, subdivide
from ptmtools.cells.fabric import Fabric
from ptmtools.cells.floors import Floors
from ptmtools.cells.options import Walker
from ptmtools.cells.places import find_places
from ptmtools.cells.structure import Structure
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.parallel import Local
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.model import Scene
from tests.cells.buildings import write
from tests.cells.strangers import office
from tests.conftest import scene_of, subdivided

WALKER = Walker(0.25, 0.5, 1.7)
SLACK = 0.02  # m², for circles that are polygons


def place_area(scene: Scene, options: SubdivideOptions = SubdivideOptions()) -> float:  # noqa: B008
    fabric = Fabric.from_scene(scene, options)
    structure = Structure.from_fabric(fabric, scene.tolerance)
    floors = Floors.from_fabric(fabric)
    places = find_places(floors, structure.corners, Walker(*options.walker), scene.tolerance)
    return float(areas(places.only(places.front).triangles(scene.tolerance)).sum())


def floor_of(x0: float, x1: float, z0: float, z1: float, y: float = 0.0, rise: float = 0.0) -> list:
    return [[x0, y, z0], [x0, y, z1], [x1, y + rise, z1], [x1, y + rise, z0]]


def wall_at(x: float, low: float, high: float, z0: float = -2.0, z1: float = 2.0) -> list:
    return [[x, low, z0], [x, low, z1], [x, high, z1], [x, high, z0]]


@pytest.mark.parametrize(
    ("faces", "expected"),
    [
        pytest.param([floor_of(0, 8, -2, 2)], 32.0, id="nothing stands on it"),
        pytest.param([floor_of(0, 8, -2, 2), wall_at(4, 0, 3)], 32 - 0.5 * 4, id="a wall"),
        pytest.param(
            [floor_of(0, 8, -2, 2), wall_at(4, 0, 0.45)], 32.0, id="a sill one steps over"
        ),
        pytest.param([floor_of(0, 8, -2, 2), wall_at(4, 1.8, 3)], 32.0, id="a lintel overhead"),
        pytest.param([floor_of(0, 8, -2, 2), wall_at(4, 1.6, 3)], 30.0, id="a lintel at the head"),
        pytest.param(
            [floor_of(0, 8, -2, 2), floor_of(0, 8, -2, 2, 1.5)], 32.0, id="above a low ceiling only"
        ),
        pytest.param(
            [floor_of(0, 8, -2, 2), wall_at(4, 0, 3, -2, 0)],
            32 - 0.5 * 2 - np.pi * 0.25**2 / 2,
            id="round the end of a wall",
        ),
        pytest.param([floor_of(0, 8, -2, 2, 0, 6)], 4 * 10.0, id="a ramp of 37 degrees"),
        pytest.param([floor_of(0, 8, -2, 2, 0, 9)], 0.0, id="a roof of 48 degrees"),
    ],
)
@pytest.mark.parametrize("times", [1, 5])
def test_where_a_body_fits(faces: list, expected: float, times: int) -> None:
    scene = subdivided(scene_of(faces), times)
    assert place_area(scene) == pytest.approx(expected, abs=SLACK)


def test_a_ramp_under_a_sloping_ceiling_has_its_head_room_along_the_slope() -> None:
    ramp = floor_of(0, 8, -2, 2, 0, 4)
    for above, area in ((1.6, 0.0), (1.8, 4 * np.hypot(8, 4))):
        ceiling = floor_of(0, 8, -2, 2, above, 4)
        options = SubdivideOptions()
        scene = scene_of([ramp, ceiling])
        fabric = Fabric.from_scene(scene, options)
        structure = Structure.from_fabric(fabric, scene.tolerance)
        floors = Floors.from_fabric(fabric)
        places = find_places(floors, structure.corners, WALKER, scene.tolerance)
        actual = places.only(places.front).triangles(scene.tolerance)
        below = actual[:, :, 1].mean(axis=1) < actual[:, :, 0].mean(axis=1) / 2 + above / 2
        assert areas(actual[below]).sum() == pytest.approx(area, abs=0.3)


def test_stairs_are_places_from_step_to_step() -> None:
    steps = []
    for i in range(12):
        steps.append(floor_of(0.28 * i, 0.28 * (i + 1), -1, 1, 0.17 * (i + 1)))
        steps.append(wall_at(0.28 * i, 0.17 * i, 0.17 * (i + 1), -1, 1))
    assert place_area(scene_of(steps)) == pytest.approx(12 * 0.28 * 2, abs=SLACK)


def test_a_larger_body_has_fewer_places() -> None:
    scene = scene_of([floor_of(0, 8, -2, 2), wall_at(4, 0, 3)])
    wide = SubdivideOptions(walker=(0.5, 0.5, 2))
    assert place_area(scene, wide) == pytest.approx(32 - 4, abs=SLACK)


@pytest.mark.parametrize(
    "walker", [(0.0, 0.5, 1.7), (0.25, 1.7, 1.7), (0.25, 0.0, 1.7), (0.25, 0.5)]
)
def test_nobody_is_like_that(walker: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="radius, step and height"):
        SubdivideOptions(walker=walker)


def located(cells: Cells, *points: tuple[float, float, float]) -> list[bool]:
    return (cells.locate(np.array(points, dtype=np.float64)) >= 0).tolist()


HALL = (10.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("other", "point", "kept", "share"),
    [
        pytest.param(((30, 0, -2), (34, 4, 2)), (32, 1, 0), True, 0.08, id="another building"),
        pytest.param(
            ((0, 4.3, -4), (20, 8, 4)), (10, 6, 0), True, 0.5, id="upstairs, without stairs"
        ),
        pytest.param(((20.2, 0, -4), (26, 4, 4)), (23, 1, 0), True, 0.2, id="behind a wall"),
        pytest.param(
            ((20.05, 0, -4), (20.35, 4, 4)), (20.2, 1, 0), False, 0.0, id="a wall's hollow"
        ),
        pytest.param(((20.2, 0, 0), (20.6, 4, 0.4)), (20.4, 1, 0.2), False, 0.0, id="a shaft"),
        pytest.param(((0, 4.1, -4), (20, 5.2, 4)), (10, 4.6, 0), False, 0.0, id="above a ceiling"),
    ],
)
def test_what_the_flood_does_not_reach(
    quads, room_faces, other, point, kept: bool, share: float
) -> None:
    scene = quads(room_faces((0, 0, -4), (20, 4, 4)) + room_faces(*other))
    cells = subdivide(scene)
    assert cells.closed
    assert located(cells, HALL, point) == [True, kept]
    printed = [note for note in cells.notes if "of floor around" in note]
    assert [isinstance(note, Warned) for note in printed] == [share > 0.1] * kept
    main = subdivide(scene, SubdivideOptions(reach="main"))
    assert located(main, HALL, point) == [True, False]
    left_out = [note for note in main.notes if "is left out; --reach all" in note]
    assert [isinstance(note, Warned) for note in left_out] == [True] * (kept and share > 0.1)
    assert not len(cells.left_out)
    width, _, depth = np.subtract(other[1], other[0]) - 2 * WALKER.radius
    assert areas(main.left_out).sum() == pytest.approx(kept * width * depth)
    # Half of the triangles bound the other space.
    lost = [note for note in main.notes if note.startswith("50% of the triangles bound space")]
    assert [isinstance(note, Warned) for note in lost] == [True] * kept
    with pytest.raises(InputError, match="PTM-I305") if kept else nullcontext():
        subdivide(scene, SubdivideOptions(reach="main", strict=True))
    for note in printed + lost:  # the viewpoint that is named leads there
        there = tuple(float(c) for c in note.split("--viewpoint ")[1].split(" ")[0].split(","))
        options = SubdivideOptions(reach="main", viewpoints=(there,))  # type: ignore[arg-type]
        assert located(subdivide(scene, options), HALL, point) == [False, True]


@pytest.mark.parametrize("two_sided", [True, False])
def test_a_solid_is_no_room_but_a_cabin_is(quads, room_faces, two_sided: bool) -> None:
    # A column on the floor, all of whose sides face outwards, and a cabin with walls of 10 cm.
    column = [face[::-1] for face in room_faces((2, 0, -1), (4, 3, 1), "-y")]
    cabin = [face[::-1] for face in room_faces((9.9, 0, -1.1), (14.1, 3.1, 1.1), "-y")]
    cabin += room_faces((10, 0, -1), (14, 3, 1), "-y")
    scene = quads([*room_faces((0, 0, -4), (20, 4, 4)), *column, *cabin])
    scene = replace(scene, two_sided=np.full(len(scene.triangles), two_sided))
    cells = subdivide(scene)
    assert located(cells, (7, 1, 0), (3, 1, 0), (12, 1, 0)) == [True, False, True]
    # Of a model wound the other way nothing can be said.
    if two_sided:
        turned = replace(scene, triangles=scene.triangles[:, ::-1])
        assert located(subdivide(turned), (7, 1, 0), (3, 1, 0)) == [True, True]


def test_a_house_that_is_open_beside_a_closed_one_is_told(quads, room_faces) -> None:
    hall = room_faces((0, 0, -4), (20, 4, 4))
    door = [(0, 4, -4, -1), (0, 4, 1, 4), (3, 4, -1, 1)]
    house = room_faces((30, 0, -4), (40, 4, 4), "-x")
    house += [[[30, y0, z0], [30, y1, z0], [30, y1, z1], [30, y0, z1]] for y0, y1, z0, z1 in door]
    cells = subdivide(quads(hall + house))
    assert cells.closed
    assert located(cells, HALL, (35, 1, 0)) == [True, False]
    (reported,) = [note for note in cells.notes if "open to the outside" in note]
    assert isinstance(reported, Warned)
    there = tuple(float(c) for c in reported.split("--viewpoint ")[1].split(" ")[0].split(","))
    both = subdivide(quads(hall + house), SubdivideOptions(viewpoints=(there,)))  # type: ignore[arg-type]
    assert located(both, HALL, (35, 1, 0)) == [True, True]
    assert areas(cells.left_out).sum() == pytest.approx(9.5 * 7.5, abs=1), "and half the doorway"
    # It is a third of all.
    assert any(note.startswith("33% of the walkable floor") for note in cells.notes)
    with pytest.raises(InputError, match=r"--viewpoint.*without --strict.*PTM-I305"):
        subdivide(quads(hall + house), SubdivideOptions(strict=True))


def test_a_house_on_the_ground_is_a_part_of_all_places(quads, room_faces) -> None:
    # The ground is its floor; what is left out is a share of all places, not of none.
    hall = room_faces((0, 0, -4), (20, 4, 4))
    house = room_faces((30, -0.3, -2), (33, 4, 2), "-x -y")
    door = [(-0.3, 4, -2, -0.6), (-0.3, 4, 0.6, 2), (2, 4, -0.6, 0.6)]
    house += [[[30, y0, z0], [30, y1, z0], [30, y1, z1], [30, y0, z1]] for y0, y1, z0, z1 in door]
    ground = floor_of(-20, 60, -20, 20, -0.3)
    scene = quads([*hall, *house, ground])
    cells = subdivide(scene)
    assert cells.closed
    (reported,) = [note for note in cells.notes if "open to the outside" in note]
    assert 5 < float(reported.split(" ")[0]) < 12
    assert not any("of the walkable floor" in note for note in cells.notes)
    # But half of the triangles are.
    with pytest.raises(InputError, match=r"of the triangles bound space.*PTM-I305"):
        subdivide(scene, SubdivideOptions(strict=True))


def test_the_outside_of_a_closed_building_is_no_loss(tmp_path: Path) -> None:
    """Three quarters of its triangles, in walls as thick as carved, are never seen."""
    model = write(tmp_path / "model.obj", office(4).items())
    scene = ingest(model, IngestOptions(unit="m", up="z"))
    cells = subdivide(scene, SubdivideOptions(strict=True))
    lost = next(int(n.split(" ")[0]) for n in cells.notes if "lie outside all cells" in n)
    assert lost > len(scene.triangles) / 3
    assert not any(isinstance(note, Warned) for note in cells.notes)


def test_a_floor_of_many_facets_is_a_place(quads, room_faces) -> None:
    # Each triangle of the gravel is a region of its own, smaller than a foot.
    rooms = room_faces((0, 0, -4), (20, 4, 4)) + room_faces((30, 0, -2), (34, 4, 2))
    gravel = subdivided(quads([floor_of(30, 34, -2, 2, 0.02)]), 60).corners
    gravel[..., 1] += 0.003 * np.random.default_rng(1).random(gravel.shape[:2])
    cells = subdivide(scene_of(np.concatenate([quads(rooms).corners, gravel])))
    assert located(cells, HALL, (32, 1, 0)) == [True, True]
    (printed,) = [note for note in cells.notes if "of floor around" in note]
    assert float(printed.split(" ")[0]) == pytest.approx(3.5 * 3.5, abs=0.5)


def test_the_ground_costs_nothing_however_large(quads, room_faces) -> None:
    ground = floor_of(-2e3, 2e3, -2e3, 2e3, -0.3)
    rooms = room_faces((0, 0, -4), (20, 4, 4)) + room_faces((30, 0, -2), (34, 4, 2))
    cells = subdivide(quads([*rooms, ground]))
    assert located(cells, HALL, (32, 1, 0)) == [True, True]
    (printed,) = [note for note in cells.notes if "of floor around" in note]
    assert float(printed.split(" ")[0]) == pytest.approx(3.5 * 3.5, abs=0.3)


def test_the_outside_of_a_closed_building_is_not_kept(quads, room_faces) -> None:
    # One can stand on the roof and on the ground around it.
    ground = floor_of(-20, 40, -20, 20, -0.3)
    roof = floor_of(-0.3, 20.3, -4.3, 4.3, 4.3)
    scene = quads([*room_faces((0, 0, -4), (20, 4, 4)), ground, roof])
    cells = subdivide(scene)
    assert cells.closed
    assert located(cells, HALL, (10, 6, 0), (30, 1, 0)) == [True, False, False]
    assert not any("of floor around" in note for note in cells.notes)


def test_many_rooms_are_counted_after_the_largest(quads, room_faces) -> None:
    faces = room_faces((0, 0, -4), (20, 4, 4))
    for i in range(5):
        faces += room_faces((30 + 10 * i, 0, -1 - i), (34 + 10 * i, 4, 1 + i))
    cells = subdivide(quads(faces))
    printed = [note for note in cells.notes if "of floor around" in note]
    assert len(printed) == 3
    size = [float(note.split(" ")[0]) for note in printed]
    assert size == pytest.approx([33.25, 26.25, 19.25], abs=0.06)
    assert any("2 more such areas" in note for note in cells.notes)


def rough_floor(step: float) -> list:
    """A floor of 4 × 3 m in triangles of a step, none of which lies in the plane of another."""
    rng = np.random.default_rng(4)
    x, z = np.meshgrid(np.arange(0, 4 + step / 2, step), np.arange(0, 3 + step / 2, step))
    points = np.stack([x, rng.normal(0, step / 20, x.shape), z], axis=2)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.stack([a, b, c, d], axis=2).reshape(-1, 4, 3).tolist()


def test_a_scanned_floor_is_searched_in_patches() -> None:
    faces = [*rough_floor(0.03), wall_at(2, 0.2, 3, 0, 3)]
    scene, options = scene_of(faces), SubdivideOptions()
    fabric = Fabric.from_scene(scene, options)
    structure = Structure.from_fabric(fabric, scene.tolerance)
    floors = Floors.from_fabric(fabric, grain=0.125)
    assert floors.patch.all()
    assert len(floors.slope) < len(Floors.from_fabric(fabric).slope) / 10
    places = find_places(floors, structure.corners, WALKER, scene.tolerance)
    # Patches overlap at their rims.
    covered = shapely.union_all(places.plan)
    assert covered.area == pytest.approx(4 * 3 - 0.5 * 3, abs=0.1)


def test_workers_find_the_same_places(monkeypatch: pytest.MonkeyPatch) -> None:
    faces = [*rough_floor(0.2), wall_at(2, 0.2, 3, 0, 3)]
    scene, options = scene_of(faces), SubdivideOptions()
    fabric = Fabric.from_scene(scene, options)
    structure = Structure.from_fabric(fabric, scene.tolerance)
    floors = Floors.from_fabric(fabric)
    monkeypatch.setattr(places_module, "_BLOCK", 50)
    monkeypatch.setattr(places_module, "_MANY_BLOCKS", 2)
    here = find_places(floors, structure.corners, WALKER, scene.tolerance)
    with Local(2, threads=False) as executor:
        there = find_places(floors, structure.corners, WALKER, scene.tolerance, executor)
    assert shapely.equals_exact(here.plan, there.plan).all()
    assert np.array_equal(here.slope, there.slope)
