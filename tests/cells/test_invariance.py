"""The same building in another unit, elsewhere or turned: the same cells and the same PVS.

Leaves may be numbered otherwise; they are matched by where they lie and how large they are, and
compared as graphs. The PVS may differ where lines touch and no more: in at most as many pairs as
the flow has counted near-ties. Rooms must hold the same leaves.

Rooms are distinguished from doors in plan, so up must be where it was, or be given (``--up``, as
``--unit``). Laid on its side without ``--up``, a building has the same leaves and the same PVS, but
other rooms; upside down it has the same rooms. One stands elsewhere as well, so these are compared
with ``--standing anywhere``.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
import shapely

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.cells.planar import intersection, neighbours, union
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.orientation.main_axes import main_axes
from ptmtools.tolerance import rank
from ptmtools.visibility import Pvs, compute_pvs

ROOT = Path(__file__).resolve().parents[2]
ROOMS = SubdivideOptions(ceiling="none")  # another one, where what is up is unknown
ANYWHERE = SubdivideOptions(standing="anywhere", ceiling="none")
#: Share of the extent by which matched cells may differ in place and in the side of a cube of
#: their size; three times that in the input's own digits are lost to a move by 1e6 extents, and
#: walls that meet under a flat angle multiply it.
PLACE = 1e-6
FAR_PLACE = 1e-4

Map = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Model:
    """A model as it is: its cells are rooms, its PVS is that of the leaves."""

    path: Path
    scene: Scene
    cells: Cells
    pvs: Pvs

    @property
    def extent(self) -> float:
        return self.scene.tolerance.extent

    @cached_property
    def flown_through(self) -> Model:
        """The same for cameras that fly."""
        cells = subdivide(self.scene, ANYWHERE)
        return replace(self, cells=cells, pvs=leaf_pvs(cells))


METRES = IngestOptions(unit="m", up="y")


def read(path: Path, options: IngestOptions = METRES) -> Model:
    scene = ingest(path, options)
    cells = subdivide(scene, ROOMS)
    return Model(path, scene, cells, leaf_pvs(cells))


def scaled(scale: float) -> SubdivideOptions:
    """For a building so many times as large, the metric options with it."""
    radius, step, height = ROOMS.walker
    return replace(
        ROOMS,
        wall_area=ROOMS.wall_area * scale**2,
        wall_thickness=ROOMS.wall_thickness * scale,
        walker=(radius * scale, step * scale, height * scale),
    )


def leaf_pvs(cells: Cells) -> Pvs:
    """Which leaf sees which; that of a room is the union of its leaves'."""
    return compute_pvs(replace(cells, leaf_cell=np.arange(cells.leaf_count, dtype=np.int32)))


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Model]:
    museum = tmp_path_factory.mktemp("museum") / "model"
    how = ["--size", "16", "--rooms", "5", "--no-windows"]
    command = [sys.executable, "-m", "ptmtools", "sample", "museum", "-o", museum, *how]
    subprocess.run(command, check=True)
    return {
        "two_rooms": read(ROOT / "sample_data/two_rooms/two_rooms.obj"),
        "museum": read(museum / "museum.obj"),
    }


def measures(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """(L, 3) centroids and (L,) volumes of the leaves."""
    centre, volume = np.zeros((cells.leaf_count, 3)), np.zeros(cells.leaf_count)
    for leaf in range(cells.leaf_count):
        middle = cells.leaf_points(leaf).mean(axis=0)
        first, last = cells.leaf_face_start[leaf : leaf + 2]
        rings = np.split(cells.face_index, cells.face_start[1:-1])[first:last]
        fans = [(r[0], *r[i : i + 2]) for r in rings for i in range(1, len(r) - 1)]
        corners = cells.leaf_point[np.array(fans)] - middle
        part = np.linalg.det(corners) / 6
        volume[leaf] = part.sum()
        centre[leaf] = middle + part @ corners.sum(axis=1) / (4 * volume[leaf])
    return centre, volume


def assert_same(
    model: Model,
    cells: Cells,
    there: Map,
    scale: float = 1.0,
    place: float = PLACE,
    upright: bool = True,
) -> None:
    """The cells of a model, taken elsewhere by ``there``, are ``cells``, and see the same; those
    that are not ``upright`` may be other rooms of the same leaves."""
    before, after = measures(model.cells), measures(cells)
    assert model.cells.leaf_count == cells.leaf_count
    assert model.cells.closed == cells.closed
    one = np.column_stack([there(before[0]), scale * np.cbrt(before[1])])
    other = np.column_stack([after[0], np.cbrt(after[1])])
    apart = np.linalg.norm(one[:, None] - other[None], axis=2) / (scale * model.extent)
    match = np.argmin(apart, axis=1)
    assert np.all(apart[np.arange(len(match)), match] < place)
    assert len(np.unique(match)) == len(match)

    ends = np.sort(match[model.cells.portal_leaf.reshape(-1, 2)], axis=1)
    assert sorted(map(tuple, ends)) == sorted(
        map(tuple, np.sort(cells.portal_leaf.reshape(-1, 2), axis=1))
    )
    areas = [np.sort(model.cells.portal_area) * scale**2, np.sort(cells.portal_area)]
    assert np.allclose(*areas, rtol=place, atol=place * (scale * model.extent) ** 2)

    stands = model.cells.leaf_standing, cells.leaf_standing[match]
    assert np.array_equal(*stands)
    if upright:
        room, other_room = model.cells.leaf_cell, cells.leaf_cell[match]
        assert np.array_equal(room[:, None] == room, other_room[:, None] == other_room)

    pvs = leaf_pvs(cells)
    seen = pvs.to_matrix()[np.ix_(match, match)]
    different = np.count_nonzero(model.pvs.to_matrix() != seen) // 2
    assert different <= max(int(model.pvs.ties.sum()), int(pvs.ties.sum()))
    assert different <= 0.01 * np.count_nonzero(seen)


def rewritten(model: Model, folder: Path, change: Map) -> Path:
    """The model's file with its vertices changed, written in full."""
    lines = model.path.read_text().splitlines()
    at = [i for i, line in enumerate(lines) if line.startswith("v ")]
    points = change(np.array([[float(x) for x in lines[i].split()[1:4]] for i in at]))
    for i, p in zip(at, points, strict=True):
        lines[i] = "v " + " ".join(repr(float(x)) for x in p)
    (folder / "model.obj").write_text("\n".join(lines))
    for other in model.path.parent.iterdir():
        if other != model.path and other.is_file():
            (folder / other.name).write_bytes(other.read_bytes())
    return folder / "model.obj"


@pytest.mark.parametrize("name", ["two_rooms", "museum"])
@pytest.mark.parametrize("factor", [1e-6, 0.3048, 1e6])
def test_another_unit(models: dict[str, Model], tmp_path: Path, name: str, factor: float) -> None:
    """Numbers in the file times ``factor``, and the unit to match: the building is as large."""
    model = models[name]
    path = rewritten(model, tmp_path, lambda p: p * factor)
    scene = ingest(path, IngestOptions(unit=1 / factor, up="y"))
    assert_same(model, subdivide(scene, ROOMS), lambda p: p)


@pytest.mark.parametrize("name", ["two_rooms", "museum"])
@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_another_size(models: dict[str, Model], name: str, scale: float) -> None:
    """The building so many times as large, and the metric knobs with it."""
    model = models[name]
    scene = model.scene.with_points(model.scene.points * scale)
    assert_same(model, subdivide(scene, scaled(scale)), lambda p: p * scale, scale)


@pytest.mark.parametrize("name", ["two_rooms", "museum"])
@pytest.mark.parametrize("extents", [1e3, 1e6])
def test_elsewhere(models: dict[str, Model], tmp_path: Path, name: str, extents: float) -> None:
    model = models[name]
    shift = extents * model.extent * np.array([1.0, 0.9, -1.1])
    path = rewritten(model, tmp_path, lambda p: p + shift)
    scene = ingest(path, METRES)
    # What is lost is what the file's own float64 could not hold, and twice that for the origin.
    digits = np.spacing(1.1 * extents * model.extent)
    back = scene.points - model.scene.points[: len(scene.points)]
    assert np.abs(back).max() <= 2 * digits
    assert_same(model, subdivide(scene, ROOMS), lambda p: p, place=FAR_PLACE)


def quarter_turns(axis: int, turns: int) -> np.ndarray:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    quarter = np.zeros((3, 3))
    quarter[axis, axis] = quarter[j, i] = 1
    quarter[i, j] = -1
    return np.linalg.matrix_power(quarter, turns)


@pytest.mark.parametrize("name", ["two_rooms", "museum"])
@pytest.mark.parametrize(("axis", "turns"), [(0, 1), (0, 2), (1, 1), (1, 2), (2, 1)])
def test_quarter_turns(models: dict[str, Model], name: str, axis: int, turns: int) -> None:
    turned(models[name], quarter_turns(axis, turns), axis == 1, upright=axis == 1 or turns == 2)


@pytest.mark.parametrize("name", ["two_rooms", "museum"])
def test_laid_on_its_side_and_told_so(models: dict[str, Model], tmp_path: Path, name: str) -> None:
    path = rewritten(models[name], tmp_path, lambda p: p @ quarter_turns(0, 1).T)
    scene = ingest(path, IngestOptions(unit="m", up="z"))
    assert np.array_equal(scene.triangles, models[name].scene.triangles)
    assert np.allclose(scene.points, models[name].scene.points, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["two_rooms", "museum"])
@pytest.mark.parametrize("angle", [0.1, np.pi / 4])
def test_closed_models_about_the_vertical(
    models: dict[str, Model], name: str, angle: float
) -> None:
    c, s = np.cos(angle), np.sin(angle)
    turned(models[name], np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), True)


@pytest.mark.parametrize("name", ["two_rooms", "museum"])
@pytest.mark.parametrize("seed", [0])
def test_closed_models_by_any_angle(models: dict[str, Model], name: str, seed: int) -> None:
    axes, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    turned(models[name], axes * np.linalg.det(axes), False, upright=False)


def turned(model: Model, turn: np.ndarray, level: bool, upright: bool = True) -> None:
    """A model turned about the vertical, ``level``, or otherwise."""

    def there(points: np.ndarray) -> np.ndarray:
        return points @ turn.T

    scene = model.scene.with_points(there(model.scene.points))
    if not level:
        model = model.flown_through
    cells = subdivide(scene, ROOMS if level else ANYWHERE)
    assert_same(model, cells, there, upright=upright)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("hospital", "unit"),
        ("hospital", "far"),
        ("hospital", "y 2"),
        ("gallery", "unit"),
        ("gallery", "far"),
        ("gallery", "x 1"),
        ("gallery", "x 2"),
        ("gallery", "y 1"),
        ("gallery", "z 1"),
    ],
)
def test_a_real_model_that_is_open(shared: Path, name: str, change: str) -> None:
    model = real(shared / f"scenes/{name}/{name}.obj")
    assert not model.cells.closed
    points = model.scene.points
    if change == "unit":
        scale = 1e-6 if name == "hospital" else 0.3048
        scene = model.scene.with_points(points * scale)
        assert_same(model, subdivide(scene, scaled(scale)), lambda p: p * scale, scale)
    elif change == "far":
        shift = 1e6 * model.extent * np.array([1.0, 0.9, -1.1])
        scene = model.scene.with_points((points + shift) - shift)
        assert_same(model, subdivide(scene, ROOMS), lambda p: p, place=FAR_PLACE)
    else:
        axis, turns = change.split()
        turn = quarter_turns("xyz".index(axis), int(turns))
        turned(model, turn, axis == "y", upright=axis == "y" or turns == "2")


_REAL: dict[Path, Model] = {}


def real(path: Path) -> Model:
    if path not in _REAL:
        _REAL[path] = read(path, IngestOptions())
    return _REAL[path]


def test_equal_values_go_by_index() -> None:
    rng = np.random.default_rng(0)
    values = np.repeat([4.0, 4.0 + 1e-5, 1.0, 0.0], 5)[rng.permutation(20)]
    noisy = values * (1 + 1e-8 * rng.uniform(-1, 1, 20))
    expected = np.lexsort((np.arange(20), -values))
    assert np.array_equal(rank(noisy), expected)
    assert len(rank(np.zeros(0))) == 0


def test_an_intersection_that_floating_point_loses() -> None:
    """Found in the museum in feet: GEOS 3.14 without a grid makes a point of it."""
    high = [[-1.3716, -4.05097488], [-0.09144, -4.05097488], [-0.09144, -1.423416]]
    low = [[-1.3716000000000002, -1.4234160000000005], [-0.09144, -1.423416]]
    for offset in np.spacing(1.4) * np.arange(-3, 4):
        one = shapely.Polygon([*high, [-1.3716, -1.423416 + offset]])
        other = shapely.Polygon([*low, [-0.09144, -3.861816], [-1.3716000000000002, -3.861816]])
        assert intersection(one, other, 1e-12).area == pytest.approx(3.121542144)


def test_polygons_are_grouped_by_the_gap_between_them() -> None:
    boxes = shapely.box([0, 1.05, 3, 2.06, 9], 0, [1, 2.05, 4, 2.95, 10], 1)
    group = neighbours(boxes, 0.1)
    assert len({*group[:4]}) == 1
    assert group[4] != group[0]
    assert len(np.unique(neighbours(boxes, 0.01))) == 5


def test_a_union_of_many_strips_has_the_corners_of_one() -> None:
    edge = np.linspace(0, 4, 3001)
    strips = shapely.box(edge[:-1], 0, edge[1:], 3)
    whole = union(strips, 1e-12)
    assert whole.area == pytest.approx(12)
    assert shapely.get_num_coordinates(whole) == 5


def test_axes_are_the_buildings_own(room_row) -> None:
    scene, _ = room_row(3)
    assert np.array_equal(main_axes(scene.corners), np.eye(3))
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    axes = main_axes(scene.corners @ turn.T)
    assert np.allclose(axes @ axes.T, np.eye(3))
    assert np.allclose(np.sort(np.abs(axes @ turn), axis=1), [0, 0, 1])
    turned = scene.with_points(scene.points @ turn.T)
    assert turned.tolerance.extent == pytest.approx(scene.tolerance.extent)
    assert np.array_equal(main_axes(scene.corners[:2]), np.eye(3))  # one floor: no second axis
    assert np.array_equal(main_axes(np.zeros((0, 3, 3))), np.eye(3))
