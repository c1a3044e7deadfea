"""Walks that are made: where they lead, how fast, and what they look at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from ptmtools.arrays import Bools, Floats
from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.errors import InputError
from ptmtools.scene import Scene, ingest
from ptmtools.walk import Walk, parse_walk, walk_text
from ptmtools_lab.path.ground import GRID, WalkGround, WalkObstacles, grid_points, over_floors
from ptmtools_lab.path.making import Path as Made, make_path
from ptmtools_lab.path.options import PathOptions
from tests.cells.buildings import BuildingCase as Building
from tests.cells.closed_doors import LEAF
from tests.cells.small_buildings import HEIGHTS, TWO_ROOMS
from tests.conftest import RoomRow
from tests.scene.buildings import box

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj"
STAIR = HEIGHTS["two floors with a stair"]
LANDING = HEIGHTS["a stair with a landing, in a well between two floors"]
#: A table across the straight way to the door, and a bench that one can step onto.
EYES = {"a": (1.0, 1.0, 1.6), "b": (9.0, 1.0, 1.6)}
TABLE = (3.0, 0.7, 0.0), (4.0, 4.3, 0.75)
BENCH = (7.0, 1.0, 0.0), (9.0, 2.0, 0.4)
FURNISHED = Building({"building": TWO_ROOMS, "table": box(*TABLE), "bench": box(*BENCH)}, EYES)

Subject = tuple[Scene, Cells]
Subjects = Callable[[str], Subject]


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subjects:
    """A scene and its cells, by name."""
    made = {"stair": STAIR, "landing": LANDING, "furnished": FURNISHED}

    @cache
    def find(name: str) -> Subject:
        if name == "two rooms":
            scene = ingest(SAMPLE)
        else:
            scene = made[name].scene(tmp_path_factory.mktemp("made"))
        return scene, subdivide(
            scene, SubdivideOptions(detail=("table*",) if name == "furnished" else ())
        )

    return find


def crosses(scene: Scene, start: Floats, end: Floats) -> Bools:
    """(n,) whether segments meet any triangle, in double precision, one against all."""
    a, b, c = scene.corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    actual = np.zeros(len(start), dtype=bool)
    for row, (p, q) in enumerate(zip(start, end, strict=True)):
        below = np.einsum("ij,ij->i", p - a, normal)
        above = np.einsum("ij,ij->i", q - a, normal)
        parted = below * above < 0
        share = np.divide(below, below - above, out=np.zeros(len(a)), where=parted)
        at = p + share[:, None] * (q - p)
        inside = parted
        for u, v in pairwise((a, b, c, a)):
            inside = inside & (np.einsum("ij,ij->i", np.cross(v - u, at - u), normal) >= 0)
        actual[row] = inside.any()
    return actual


def turns(walk: Walk) -> Floats:
    """Degrees a second."""
    cosine = (walk.direction[1:] * walk.direction[:-1]).sum(axis=1)
    actual: Floats = np.degrees(np.arccos(np.clip(cosine, -1, 1))) / np.diff(walk.time)
    return actual


def speeds(walk: Walk) -> Floats:
    """Metres a second."""
    actual: Floats = np.linalg.norm(np.diff(walk.eye, axis=0), axis=1) / np.diff(walk.time)
    return actual


def check(made: Made, scene: Scene, cells: Cells, options: PathOptions) -> None:
    """What must hold of any walk."""
    walk = made.walk
    assert cells.eyes.contains(walk.eye).all()
    assert not crosses(scene, walk.eye[:-1], walk.eye[1:]).any()
    assert speeds(walk).max() <= options.speed + 1e-5, "but for the digits of a file"
    assert turns(walk).max() <= 110
    np.testing.assert_allclose(np.diff(walk.time), 1 / options.rate, atol=1e-6)
    seen = np.unique(cells.locate(walk.eye))
    assert made.visited == tuple(seen[(seen >= 0) & cells.standing[seen]])
    assert set(made.visited).isdisjoint(made.unreachable)
    assert made.rooms == cells.standing.sum()


@pytest.mark.parametrize("name", ["two rooms", "stair", "landing", "furnished"])
@pytest.mark.parametrize(
    "options",
    [PathOptions(), PathOptions(seed=2, rate=25), PathOptions(seed=3, speed=2.5, stop=1)],
    ids=["usual", "smooth", "hasty"],
)
def test_every_room_on_foot(subject: Subjects, name: str, options: PathOptions) -> None:
    scene, cells = subject(name)
    made = make_path(scene, cells, options)
    check(made, scene, cells, options)
    assert not made.unreachable
    assert len(made.visited) == made.rooms
    assert speeds(made.walk).max() > 0.8 * options.speed, "rooms are too small to go faster"


@pytest.mark.parametrize(("name", "building"), [("stair", STAIR), ("landing", LANDING)])
def test_stairs_are_walked(subject: Subjects, name: str, building: Building) -> None:
    """From one storey to the other, an eye's height above the floors, and evenly."""
    scene, cells = subject(name)
    walk = make_path(scene, cells, PathOptions(rate=20)).walk
    low, high = (building.in_world(scene, [building.eyes[e]])[0, 1] for e in ("lower", "upper"))
    assert np.ptp(walk.eye[:, 1]) == pytest.approx(high - low, abs=0.02)
    assert np.abs(np.diff(walk.eye[:, 1])).max() < 0.155 / 2, "half a tread: no jumps"


def test_the_same_seed_is_the_same_walk(subject: Subjects) -> None:
    texts = [
        walk_text(make_path(*subject("two rooms"), PathOptions(seed=s)).walk) for s in (5, 5, 6)
    ]
    assert texts[0] == texts[1] != texts[2]


def test_a_walk_is_what_its_file_holds(subject: Subjects) -> None:
    walk = make_path(*subject("two rooms")).walk
    back = parse_walk(walk_text(walk).encode())
    for name in ("time", "eye", "direction"):
        np.testing.assert_array_equal(getattr(back, name), getattr(walk, name))


def above(box: tuple[Floats, ...], eye: Floats, margin: float = 0.0) -> Bools:
    """(n,) which points are within the plan of a box, or of one so much wider, metres."""
    low, high = np.minimum(*box) - margin, np.maximum(*box) + margin
    actual: Bools = ((eye > low) & (eye < high))[:, [0, 2]].all(axis=1)
    return actual


def test_furniture_is_walked_around(subject: Subjects) -> None:
    """The table is detail, so that there are places within it; nobody walks through it."""
    scene, cells = subject("furnished")
    table = tuple(FURNISHED.in_world(scene, TABLE))
    middle = (table[0] + table[1]) / 2
    assert cells.eyes.contains(middle[None] + [0, 1.2, 0]).all()
    for seed in range(4):
        made = make_path(scene, cells, PathOptions(seed=seed))
        assert len(made.visited) == 2
        assert not above(table, made.walk.eye).any()


def test_the_foot_is_on_what_is_there(subject: Subjects) -> None:
    """The eye region's floor is wider than the bench; beside it he stands on the floor."""
    scene, cells = subject("furnished")
    ground = over_floors(cells, WalkObstacles(scene, cells), 1.6)
    bench = tuple(FURNISHED.in_world(scene, BENCH))
    on, about = above(bench, ground.eye), above(bench, ground.eye, cells.walker.radius)
    low = FURNISHED.in_world(scene, [(0, 0, 0)])[0, 1]
    assert on.sum() > 10
    assert (about & ~on).sum() > 10
    np.testing.assert_allclose(ground.eye[on, 1], low + 2.0, atol=1e-6)
    np.testing.assert_allclose(ground.eye[about & ~on, 1], low + 1.6, atol=1e-6)


def test_pictures_are_looked_at(subject: Subjects) -> None:
    """Who stands faces an image, as far away as one does; but for when he turns to go on."""
    scene, cells = subject("two rooms")
    made = make_path(scene, cells, PathOptions(rate=20))
    walk = made.walk
    assert made.stops >= 2
    still = np.append(speeds(walk), 0) + np.radians(np.append(turns(walk), 0)) < 1e-3
    still[-1] = False
    assert still.sum() / 20 > 3 * made.stops, "seconds"
    met, far = WalkObstacles(scene, cells).first(walk.eye[still], walk.direction[still])
    image = np.array([material.image for material in scene.materials])
    assert (image[scene.triangle_material[met]] >= 0).all()
    assert ((far > 0.7) & (far < 3.3)).mean() > 0.9
    front = np.cross(*(scene.corners[met, k] - scene.corners[met, 0] for k in (1, 2)))
    faced = np.einsum("ij,ij->i", front, walk.direction[still]) / np.linalg.norm(front, axis=1)
    assert (np.abs(faced) > 0.7).mean() > 0.9


def test_glances_to_both_sides(subject: Subjects) -> None:
    walk = make_path(*subject("stair"), PathOptions(duration=120, stop=0)).walk
    heading = np.diff(walk.eye, axis=0)
    quick = np.hypot(heading[:, 0], heading[:, 2]) > 0.09
    yaw = np.arctan2(heading[:, 2], heading[:, 0])
    gaze = np.arctan2(walk.direction[:-1, 2], walk.direction[:-1, 0])
    aside = np.degrees(np.remainder(gaze - yaw + np.pi, 2 * np.pi) - np.pi)[quick]
    assert (aside > 20).any()
    assert (aside < -20).any()
    assert np.median(np.abs(aside)) < 20


def test_a_shorter_walk_is_cut(subject: Subjects) -> None:
    scene, cells = subject("two rooms")
    whole, cut = (make_path(scene, cells, PathOptions(duration=d)) for d in (None, 7.0))
    assert cut.walk.duration == 7.0
    np.testing.assert_array_equal(cut.walk.eye, whole.walk.eye[: len(cut.walk.eye)])
    assert cut.stops < whole.stops


def test_a_longer_walk_goes_round_again(subject: Subjects) -> None:
    scene, cells = subject("two rooms")
    once = make_path(scene, cells)
    length = round(4 * once.walk.duration)
    options = PathOptions(duration=length)
    again = make_path(scene, cells, options)
    assert again.walk.duration == length
    assert again.stops > once.stops
    check(again, scene, cells, options)
    half = again.walk.time > length / 2
    assert set(cells.locate(again.walk.eye[half])) == set(again.visited)


def with_leaf_in_doorway(row: Scene) -> Scene:
    """The rooms, and a sheet that fills the first doorway."""
    corners = np.array([[4.0, 0, -1], [4.0, 3, -1], [4.0, 3, 1], [4.0, 0, 1]])
    count = len(row.points)
    loop = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return replace(
        row,
        points=np.concatenate([row.points, corners]),
        triangles=np.concatenate([row.triangles, loop + count]),
        uv=np.concatenate([row.uv, np.zeros((2, 3, 2))]),
        triangle_object=np.append(row.triangle_object, [0, 0]).astype(np.int32),
        triangle_material=np.append(row.triangle_material, [0, 0]).astype(np.int32),
        two_sided=np.append(row.two_sided, [True, True]),
    )


def test_open_leaves_are_walked_through_and_others_are_not(room_row: RoomRow) -> None:
    row, cells = room_row(4)
    scene = with_leaf_in_doorway(row)
    leaf = np.arange(len(row.triangles), len(scene.triangles), dtype=np.int32)
    shut = make_path(scene, cells)
    assert (shut.visited, shut.unreachable) == ((1, 2, 3), (0,))
    assert not crosses(scene, shut.walk.eye[:-1], shut.walk.eye[1:]).any()
    opened = make_path(scene, replace(cells, opened=leaf))
    assert (opened.visited, opened.unreachable) == ((0, 1, 2, 3), ())
    assert crosses(scene, opened.walk.eye[:-1], opened.walk.eye[1:]).any()


def test_a_door_of_the_subdivision(tmp_path: Path) -> None:
    """A leaf that the subdivision opened; closed, there is no way."""
    scene = Building({"building": TWO_ROOMS, "door": LEAF}, EYES).scene(tmp_path)
    cells = subdivide(scene)
    assert len(cells.opened)
    assert make_path(scene, cells).visited == tuple(np.flatnonzero(cells.standing))
    shut = make_path(scene, replace(cells, opened=cells.opened[:0]))
    assert shut.unreachable


def test_a_child(subject: Subjects) -> None:
    scene, cells = subject("stair")
    floor = STAIR.in_world(scene, [(0, 0, 0)])[0, 1]
    options = PathOptions(eye=1.1)
    made = make_path(scene, cells, options)
    check(made, scene, cells, options)
    assert made.walk.eye[:, 1].min() == pytest.approx(floor + 1.1, abs=1e-3)
    for eye in (0.4, 2.3):
        with pytest.raises(InputError, match="PTM-I111"):
            make_path(scene, cells, PathOptions(eye=eye))


def test_the_gallery(shared: Path) -> None:
    """A real one: a hall, and what stands in it."""
    scene = ingest(shared / "scenes/gallery/gallery.obj")
    cells = subdivide(scene)
    options = PathOptions(duration=120)
    made = make_path(scene, cells, options)
    check(made, scene, cells, options)
    assert made.stops > 5


def test_where_eyes_may_be_anywhere(room_row: RoomRow) -> None:
    """From portal to portal, at the height of eyes."""
    scene, cells = room_row(5)
    options = PathOptions(seed=4)
    made = make_path(scene, cells, options)
    check(made, scene, cells, options)
    assert len(made.visited) == 5
    np.testing.assert_allclose(made.walk.eye[:, 1], 0.94 * 1.7, atol=0.01)


def test_seeds_begin_at_the_viewpoints_that_can_be_walked_to(subject: Subjects) -> None:
    """In turn, and look as they do; one in the air and one in the wrong cell are none of them."""
    scene, cells = subject("two rooms")
    places = np.array([[-2.0, 1.6, 0.5], [2.5, 1.6, -0.5]])
    looks = np.array([[-0.6, 0.0, 0.8], [0.0, 0.6, -0.8]])
    one, other = cells.locate(places).tolist()
    high, wrong = (places[0] + [0, 9, 0]).tolist(), places[1].tolist()
    viewpoints = [
        (one, high, [1.0, 0.0, 0.0]),
        (one, places[0].tolist(), looks[0].tolist()),
        (one, wrong, [1.0, 0.0, 0.0]),
        (other, places[1].tolist(), looks[1].tolist()),
    ]
    for seed, number in ((1, 0), (2, 1), (3, 0)):
        walk = make_path(scene, cells, PathOptions(seed=seed), viewpoints).walk
        still = walk.time < 3  # at least, before he goes on
        away = np.linalg.norm(walk.eye[still] - places[number], axis=1)
        assert away.max() < 0.5
        np.testing.assert_allclose(walk.direction[still], looks[[number]].repeat(still.sum(), 0))
    assert walk_text(make_path(scene, cells).walk) == walk_text(
        make_path(scene, cells, viewpoints=[viewpoints[0], viewpoints[2]]).walk
    )


@pytest.mark.parametrize(("duration", "samples"), [(None, 2), (5.0, 51)])
def test_a_single_bare_room(room_row: RoomRow, duration: float | None, samples: int) -> None:
    """There is nowhere to go."""
    scene, cells = room_row(1)
    made = make_path(scene, cells, PathOptions(duration=duration))
    assert len(made.walk.time) == samples
    assert made.visited == (0,)
    assert made.walk.length == 0


def test_nobody_can_walk(room_row: RoomRow) -> None:
    scene, cells = room_row(2)
    above = np.array([[[0, 9, 0], [1, 9, 0], [0, 9, 1]]], dtype=np.float64)
    with pytest.raises(InputError, match="PTM-I247"):
        make_path(scene, replace(cells, eye_floor=above))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", -1),
        ("duration", 0.5),
        ("duration", float("nan")),
        ("speed", 0.0),
        ("rate", 0.5),
        ("rate", 1e9),
        ("stop", -1.0),
        ("field_of_view", 3.2),
        ("aspect", 0.0),
    ],
)
def test_options_out_of_range(name: str, value: float) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        PathOptions(**{name: value})  # type: ignore[arg-type]


def test_points_of_a_grid_over_triangles() -> None:
    """Against every point of the grid, one by one."""
    random = np.random.default_rng(7)
    floor = random.uniform(-3, 3, (40, 3, 3))
    column, point = grid_points(floor, GRID)
    least, most = column.min() - 2, column.max() + 3
    at = np.stack(np.meshgrid(*[np.arange(least, most)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    shift = point[0, [0, 2]] - GRID * column[0]
    plan = shapely.points(GRID * at + shift)
    expected = []
    for triangle in floor:
        inside = shapely.intersects(shapely.Polygon(triangle[:, [0, 2]]), plan)
        weight = np.linalg.solve(
            np.vstack([triangle[:, [0, 2]].T, np.ones(3)]),
            np.column_stack([GRID * at[inside] + shift, np.ones(inside.sum())]).T,
        )
        expected.append(np.column_stack([at[inside], triangle[:, 1] @ weight]))
    wanted, actual = np.concatenate(expected), np.column_stack([column, point[:, 1]])
    for rows in (wanted, actual):
        rows[:] = rows[np.lexsort(rows.T.round(6))]
    np.testing.assert_allclose(actual, wanted, atol=1e-9)
    np.testing.assert_allclose(point[:, [0, 2]], GRID * column + shift, atol=1e-12)


def random_ground(seed: int, count: int = 60) -> tuple[WalkGround, Floats]:
    """A graph in two parts or more, and its (n, n) matrix of costs."""
    random = np.random.default_rng(seed)
    one, other = np.triu_indices(count, 1)
    some = (random.random(len(one)) < 0.05) & ((one < count // 3) == (other < count // 3))
    steps = np.column_stack([one[some], other[some]])
    cost = random.uniform(1, 5, len(steps))
    matrix = np.full((count, count), np.inf)
    matrix[steps[:, 0], steps[:, 1]] = matrix[steps[:, 1], steps[:, 0]] = cost
    np.fill_diagonal(matrix, 0)
    cell = np.arange(count) % 7
    return WalkGround.from_steps(np.zeros((count, 3)), cell, np.ones(count), steps, cost), matrix


@pytest.mark.parametrize("seed", range(10))
def test_the_nearest_goal(seed: int) -> None:
    """Against all shortest ways, by Floyd and Warshall."""
    ground, matrix = random_ground(seed)
    least = matrix.copy()
    for k in range(len(least)):
        least = np.minimum(least, least[:, [k]] + least[[k]])
    goal = np.random.default_rng(seed).random(len(least)) < 0.1
    for source in range(len(least)):
        way = ground.way_to_nearest(source, goal)
        nearest = least[source, goal].min(initial=np.inf)
        if len(way) == 0:
            assert nearest == np.inf
            continue
        assert way[0] == source
        assert goal[way[-1]]
        assert matrix[way[:-1], way[1:]].sum() == pytest.approx(nearest)


def test_the_main_part() -> None:
    """Most cells count before most places."""
    eye = np.arange(15.0).reshape(5, 3)
    steps = np.array([[0, 2], [2, 4], [1, 3]])
    cell = np.array([0, 1, 0, 2, 0])
    ground = WalkGround.from_steps(eye, cell, np.ones(5), steps, np.array([1.0, 2.0, 3.0]))
    main = ground.main_part(np.array([True, True, True]))
    np.testing.assert_array_equal(main.eye, eye[[1, 3]])
    np.testing.assert_array_equal(main.target, [1, 0])
    np.testing.assert_array_equal(main.cost, [3, 3])
    larger = ground.main_part(np.array([True, False, True]))
    np.testing.assert_array_equal(larger.eye, eye[[0, 2, 4]])
