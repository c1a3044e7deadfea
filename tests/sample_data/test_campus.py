"""The sample campus: what is written, its geometry, and the way through it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image
from ptmtools_samples.files import write

from ptmtools.errors import OutputError
from ptmtools.scene import IngestOptions, ingest
from ptmtools.walk import read_walk

#: One building of each third of the way.
FEW = ["--buildings", "3", "--length", "100", "--texture", "32"]


@pytest.fixture(scope="module")
def campus() -> ModuleType:
    from ptmtools_samples.campus import model

    return model


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ptmtools", "sample", "campus", *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("few") / "campus"
    done = run("-o", str(made), *FEW)
    assert done.returncode == 0, done.stderr
    return made


@pytest.fixture(scope="module")
def few(folder: Path, read: Callable[..., Any]) -> Any:
    return read((folder / "campus.obj").read_text().splitlines())


def open_edges(corners: Any) -> int:
    """0 if every directed edge has as many opposite ones: closed, and wound one way."""
    _, numbers = np.unique(
        np.rint(corners.reshape(-1, 3) * 1e4).astype(np.int64), axis=0, return_inverse=True
    )
    triangles = numbers.reshape(-1, 3)
    ahead = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    codes, back = (
        np.sort(e[:, 0] * (numbers.max() + 1) + e[:, 1]) for e in (ahead, ahead[:, ::-1])
    )
    return int(np.count_nonzero(codes != back))


def test_same_seed_same_bytes(folder: Path, tmp_path: Path) -> None:
    features = "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL"
    environment = {
        "PYTHONHASHSEED": "12345",
        "NPY_DISABLE_CPU_FEATURES": features,
        "PYTHONWARNINGS": "ignore",
    }
    done = run("-o", str(tmp_path / "again"), *FEW, **environment)
    assert done.returncode == 0, done.stderr
    assert files(tmp_path / "again") == files(folder)


def test_other_seed_other_bytes(campus: ModuleType, folder: Path) -> None:
    options = campus.StreetOptions(buildings=3, length=100, seed=2, texture=32)
    other = dict(campus.make_campus(options))
    assert set(other) == set(files(folder))
    for name in ("campus.obj", "textures/brick_red.png"):
        assert other[name]() != (folder / name).read_bytes()


def test_forty_buildings_and_no_wall_twice_in_the_first_third(campus: ModuleType) -> None:
    recipes = campus.choose_recipes(campus.StreetOptions().buildings)
    assert len(recipes) == 40
    assert len({r.name for r in recipes}) == 40
    walls = [r.look.wall for r in recipes]
    assert len(set(walls[:13])) == 13
    assert len(set(walls[26:])) == 2
    street = campus.Street(40, 1000)
    assert len(street.plots) == 40
    assert [p.number for p in street.plots] == list(range(40))


def test_every_recipe_is_a_closed_building_that_faces_outwards(campus: ModuleType) -> None:
    from ptmtools_samples.campus.facade import walls_of

    for k, recipe in enumerate(campus.RECIPES[:29]):  # further halls of residence are as these
        built = campus.build(recipe, campus.generator(1, 1, k))
        corners = np.array(
            [
                (f.points[0], *f.points[i : i + 2])
                for f in built.faces
                for i in range(1, len(f.points) - 1)
            ]
        )
        assert open_edges(corners) == 0, recipe.name
        a, b, c = corners.transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        volume = np.einsum("ij,ij->", a, normals) / 6
        (ring, *courts) = built.rings
        x, z = np.array(ring).T
        ground = abs(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z)) / 2
        for court in courts:
            x, z = np.ptp(np.array(court), axis=0)
            ground -= x * z
        assert 0.8 * ground * recipe.look.top < volume < 2.2 * ground * recipe.look.top, recipe.name
        assert 3000 < len(corners) < 40_000, recipe.name
        # From where one stands before the front, walls face who looks.
        front = np.abs(a[:, 2] - b[:, 2]) + np.abs(b[:, 2] - c[:, 2]) < 1e-9
        low = walls_of(ring)[recipe.door_wall].start[1]
        plane = front & (np.abs(a[:, 2] - low) < 1e-9)
        assert (normals[plane, 2] > 0).all(), recipe.name


def test_no_face_is_degenerate_and_every_coordinate_is_finite(few: Any) -> None:
    assert (np.linalg.norm(few.normals, axis=1) > 1e-5).all()
    assert np.isfinite(few.corners).all()
    assert np.isfinite(few.uv).all()
    assert few.corners[..., 1].min() == 0


def test_ground_faces_up_and_buildings_are_closed(few: Any) -> None:
    ground = few.where(np.char.startswith(few.objects, "ground_"))
    level = np.ptp(ground.corners[..., 1], axis=1) == 0
    assert (ground.normals[level, 1] > 0).all()
    assert level.mean() > 0.8
    names = {n for n in few.objects if n.startswith("building_")}
    assert names == {"building_01_rectorate", "building_02_mathematics", "building_03_residence_a"}
    for name in names:
        building = few.where(few.objects == name)
        assert open_edges(building.corners) == 0
        assert building.volume() > 1000
        assert open_edges(building.where(np.arange(len(building.corners)) > 0).corners) > 0


@pytest.mark.parametrize("material", ["sandstone", "brick_red", "concrete"])
def test_walls_have_metric_coordinates_without_mirrors(
    campus: ModuleType, few: Any, material: str
) -> None:
    walls = few.where((few.materials == material) & (np.abs(few.normals[:, 1]) < 1e-9))
    tile = campus.MATERIALS[material].tile
    edges = walls.corners[:, 1:] - walls.corners[:, :1]
    change = (walls.uv[:, 1:] - walls.uv[:, :1]) * tile
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    flat = change[:, 0, 0] * change[:, 1, 1] - change[:, 0, 1] * change[:, 1, 0]
    large = areas > 0.05
    assert large.sum() > 50
    assert np.abs(flat[large]) == pytest.approx(areas[large], rel=0.02)


def test_every_material_has_its_images(folder: Path, few: Any) -> None:
    blocks = (folder / "campus.mtl").read_text().split("newmtl ")[1:]
    named: set[str] = set()
    channels: Counter[str] = Counter()
    for block in blocks:
        lines = block.splitlines()
        maps = [line.split() for line in lines if line.startswith("map_")]
        assert maps[0][0] == "map_Kd"
        for key, *_, image in maps:
            channels[key] += 1
            named.add(image)
            with Image.open(folder / image) as picture:
                assert picture.size == (32, 32)
                assert picture.mode == ("RGB" if key == "map_Kd" else "L")
                levels = len(np.unique(np.asarray(picture)))
                assert levels == 2 if key == "map_d" else levels > 20, image
    assert {block.split()[0] for block in blocks} == set(few.materials)
    assert named == {name for name in files(folder) if name.endswith(".png")}
    assert channels["map_Ks"] >= 5
    assert channels["map_d"] >= 1


def test_the_way_is_a_kilometre_in_the_street_and_through_nothing(
    campus: ModuleType, folder: Path, few: Any
) -> None:
    walk = read_walk(folder / "campus_way.json")
    assert walk.length == pytest.approx(100, abs=1)
    assert walk.duration == pytest.approx(100 * 3.6 / 11, abs=0.5)
    rows = np.array(json.loads((folder / "campus_way.json").read_text())["samples"])
    eyes, looks = rows[:, 1:4], rows[:, 4:]
    assert np.allclose(np.linalg.norm(looks, axis=1), 1, atol=1e-3)
    down = np.tile([0.0, -1.0, 0.0], (len(eyes), 1))
    assert few.distances(eyes, down) == pytest.approx(1.6, abs=0.03)
    street = few.where(np.isin(few.materials, ["asphalt", "marking"]))
    assert street.distances(eyes, down) == pytest.approx(1.6, abs=0.03)
    steps = np.diff(eyes, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    assert lengths == pytest.approx(11 / 3.6 / campus_rate(campus), rel=0.01)
    free = few.distances(eyes[:-1], steps / lengths[:, None])
    assert (free > lengths).all()
    # The shoulders' width to either side, and before the eyes.
    side = np.cross(steps, [0.0, 1.0, 0.0]) / lengths[:, None]
    for turned in (side, -side):
        assert (few.distances(eyes[:-1], turned) > 2).all()


def campus_rate(campus: ModuleType) -> int:
    from ptmtools_samples.campus.way import RATE

    return RATE


def test_the_whole_way_bends_with_the_street(campus: ModuleType) -> None:
    from ptmtools_samples.campus.layout import KERB
    from ptmtools_samples.campus.way import way_points

    street = campus.Street(40, 1000)
    points = np.array(way_points(street, 1000.0))
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert lengths.sum() == pytest.approx(1000, abs=1)
    line = np.array(street.line())
    beginnings, along = line[:-1], np.diff(line, axis=0)
    away = points[:, None] - beginnings
    share = np.clip((away * along).sum(2) / (along**2).sum(1), 0, 1)
    nearest = np.linalg.norm(away - share[..., None] * along, axis=2).min(axis=1)
    assert nearest.max() < KERB / 2
    turns = np.abs(np.diff(np.unwrap(np.arctan2(*np.diff(points, axis=0).T))))
    assert turns.max() < np.radians(2)


def test_ingests_without_a_miss(folder: Path, few: Any) -> None:
    scene = ingest(folder / "campus.obj", IngestOptions(unit="m", up="y"))
    # OBJ keeps colours and opacities apart, here they become one image; and it names no unit,
    # which must be said: streets have no rooms to guess it by.
    assert {note.code for note in scene.notes} == {"PTM-N215"}
    assert len(scene.triangles) == len(few.corners)
    assert np.abs(scene.space.origin).max() < 1e-3  # the way is in the world's metres
    names = {material.name for material in scene.materials if material.transparent}
    assert "tree_broad" in names
    assert not any(name.startswith("glass_dark") for name in names)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--buildings", "0"],
        ["--texture", "big"],
        ["--buildings", "40", "--length", "500"],
    ],
)
def test_bad_arguments_are_one_line_and_leave_nothing(arguments: list[str], tmp_path: Path) -> None:
    done = run("-o", str(tmp_path / "c"), *arguments)
    assert done.returncode in (2, 3)
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("ptm: ")
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "c").exists()


def test_writes_over_a_campus_and_over_nothing_else(campus: ModuleType, tmp_path: Path) -> None:
    tiny = list(campus.make_campus(campus.StreetOptions(1, 50, 1, 8)))
    for _ in range(2):
        write(tmp_path / "c", tiny, force=False)
    (tmp_path / "c" / "campus.obj").write_text("v 0 0 0\n")
    with pytest.raises(OutputError, match="PTM-O001"):
        write(tmp_path / "c", tiny, force=False)
