"""Levels of detail of objects: meshes and errors, files, clients and checks."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cli.main import main
from ptmtools.errors import DatabaseError
from ptmtools.output.gltf_reader import ReadGlb, read_glb
from ptmtools.output.mesh_levels import FEWEST, MANY, SHARE
from ptmtools.output.served import read_served
from ptmtools.pipeline.validation import validate
from tests.systems.apo.statues import write_rooms


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two rooms, each with a statue of 40,960 triangles; the first statue has a texture."""
    return write_rooms(tmp_path_factory.mktemp("model") / "rooms", 6)


@pytest.fixture(scope="module")
def build(model: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """A database with more options."""

    def of(*more: str) -> Path:
        database = tmp_path_factory.mktemp("built") / "db"
        options = ["-o", str(database), "-j", "1", "--light", "none", *more]
        assert main(["-q", "build-scene", str(model), *options]) == 0
        return database

    return of


@pytest.fixture(scope="module")
def levels(build: Callable[..., Path]) -> Path:
    return build()


@pytest.fixture(scope="module")
def plain(build: Callable[..., Path]) -> Path:
    return build("--lods", "none")


def meshes_of(database: Path) -> list[dict[str, Any]]:
    index = json.loads((database / "www/hints.json").read_text())
    rows: list[dict[str, Any]] = index.get("meshes", [])
    return rows


def glb(database: Path, url: str) -> ReadGlb:
    return read_glb((database / "www" / url).read_bytes())


def corners(read: ReadGlb, mesh: int | None) -> Floats:
    """(m, 3, 3) of the triangles with this row in the hints."""
    own = [p.point[p.triangle] for p in read.primitives if p.material.mesh == mesh]
    return np.concatenate(own).astype(np.float64)


def in_order(triangles: Floats) -> list[tuple[float, ...]]:
    """Triangles that begin with their least corner, sorted."""
    first = np.array([np.lexsort(t.T[::-1])[0] for t in triangles])
    turn = (first[:, None] + np.arange(3)) % 3
    rows = np.take_along_axis(triangles, turn[:, :, None], axis=1).reshape(-1, 9)
    return sorted(map(tuple, rows.tolist()))


def test_each_level_has_an_eighth_of_the_triangles_and_the_stated_error(levels: Path) -> None:
    rows = meshes_of(levels)
    assert [row["cell"] for row in rows] == [0, 1]
    for mesh, row in enumerate(rows):
        coarsest = corners(glb(levels, f"gltf/c{row['cell']:04d}.glb"), mesh)
        finer = [corners(glb(levels, url), None) for url in row["files"]]
        whole = finer[-1]
        assert len(whole) >= MANY
        assert FEWEST <= len(coarsest) < SHARE * FEWEST
        np.testing.assert_allclose(
            [*whole.reshape(-1, 3).min(axis=0), *whole.reshape(-1, 3).max(axis=0)],
            row["box"], atol=1e-3,
        )  # fmt: skip
        middle = whole.mean(axis=(0, 1))
        for one, error in zip([coarsest, *finer[:-1]], row["errors"], strict=False):
            points = one.mean(axis=1)[:: len(one) // 200] - middle
            away = radii(whole - middle, points) - np.linalg.norm(points, axis=1)
            assert float(np.sqrt((away**2).mean())) < error < 0.02
        counts = [len(each) for each in (coarsest, *finer)]
        for few, many in pairwise(counts):
            assert few <= many / SHARE


def radii(triangles: Floats, directions: Floats) -> Floats:
    """Distances from the origin, along (n, 3) directions, of a surface around it."""
    origin, one, other = triangles[:, 0], *np.moveaxis(triangles[:, 1:] - triangles[:, :1], 1, 0)
    result = []
    for direction in directions / np.linalg.norm(directions, axis=1)[:, None]:
        across = np.cross(direction, other)
        scale = 1 / np.einsum("ij,ij->i", one, across)
        u = -np.einsum("ij,ij->i", origin, across) * scale
        turned = np.cross(-origin, one)
        v = turned @ direction * scale
        hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        result.append(float((np.einsum("ij,ij->i", other, turned) * scale)[hit].max()))
    return np.array(result)


def test_the_last_file_is_the_object_as_modelled(levels: Path, plain: Path) -> None:
    assert meshes_of(plain) == []
    assert not [*plain.glob("www/gltf/m*.glb")]
    for mesh, row in enumerate(meshes_of(levels)):
        name = f"gltf/c{row['cell']:04d}.glb"
        cell, whole, expected = glb(levels, name), glb(levels, row["files"][-1]), glb(plain, name)
        others = corners(cell, None)
        modelled = np.concatenate([others, corners(whole, None)])
        assert in_order(modelled) == in_order(corners(expected, None))
        assert {p.object for p in whole.primitives} == {f"statue_0{mesh + 1}"}
        textures = {p.material.ptm for p in whole.primitives}
        assert textures == {p.material.ptm for p in cell.primitives if p.material.mesh == mesh}
    for part in ("cells", "textures"):
        names = sorted(p.name for p in (plain / "www" / part).iterdir())
        for name in names:
            files = [database / "www" / part / name for database in (levels, plain)]
            assert files[0].read_bytes() == files[1].read_bytes(), name


def test_the_simulator_has_objects_as_modelled(levels: Path, plain: Path) -> None:
    one, other = (read_served(database) for database in (levels, plain))
    assert in_order(one.surfaces.corner) == in_order(other.surfaces.corner)
    assert [len(sizes) for sizes in one.mesh_bytes] == [len(r["files"]) for r in meshes_of(levels)]
    assert (one.geometry_bytes < other.geometry_bytes / 10).all()


def test_a_visit(levels: Path, plain: Path) -> None:
    visit, without = (
        json.loads((database / "manifest.json").read_text())["stages"]["emit"]["counts"]["visit"]
        for database in (levels, plain)
    )
    assert without["simplified"] is None
    assert visit["simplified"] < visit["first_room"] / 10
    assert visit["first_room"] == pytest.approx(without["first_room"], rel=0.1)


def test_octrees_replace_levels(build: Callable[..., Path]) -> None:
    database = build("--apo", "statue_01", "--apo-faces", "5000", "--apo-depth", "4")
    (row,) = meshes_of(database)
    assert row["cell"] == 1


def test_objects_whose_seams_leave_nothing_to_simplify(tmp_path: Path) -> None:
    """A wall of 5,000 loose panes."""
    lines = [(Path("sample_data/two_rooms/two_rooms.obj")).read_text(), "o panes"]
    begin = 1 + sum(line.startswith("v ") for line in lines[0].splitlines())
    for k in range(2500):
        x, y = -3.9 + 0.07 * (k % 50), 0.2 + 0.05 * (k // 50)
        lines += [f"v {x + a:.4f} {y + b:.4f} -1.9" for a, b in ((0, 0), (0.05, 0), (0.05, 0.03))]
        lines += [f"v {x:.4f} {y + 0.03:.4f} -1.9", f"f {begin} {begin + 1} {begin + 2}"]
        lines.append(f"f {begin} {begin + 2} {begin + 3}")
        begin += 4
    shutil.copytree("sample_data/two_rooms", tmp_path / "model")
    file = tmp_path / "model" / "two_rooms.obj"
    file.write_text("\n".join(lines) + "\n")
    database = tmp_path / "db"
    options = ["-o", str(database), "-j", "1", "--light", "none"]
    assert main(["-q", "build-scene", str(file), *options]) == 0
    assert meshes_of(database) == []


DAMAGE: dict[str, tuple[Callable[[Any], None], str, str]] = {
    "cell": (lambda row: row.update(cell=9), "PTM-D700", "out of range"),
    "errors": (lambda row: row["errors"].reverse(), "PTM-D700", "descending"),
    "fewer": (lambda row: row["errors"].pop(0), "PTM-D700", "one error more"),
    "twice": (lambda row: row["files"].append(row["files"][0]), "PTM-D700", "one error more"),
    "other": (lambda row: row.update(cell=1), "PTM-D731", "cell 0"),
    "none": (lambda row: row["files"].__setitem__(0, "gltf/m9999.glb"), "PTM-D699", "missing"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_rows(levels: Path, tmp_path: Path, name: str) -> None:
    change, code, words = DAMAGE[name]
    database = Path(shutil.copytree(levels, tmp_path / "db"))
    file = database / "www/hints.json"
    index = json.loads(file.read_text())
    change(index["meshes"][0])
    file.write_text(json.dumps(index))
    faults = [i for i in validate(database, workers=1).issues if i.code == code]
    assert not code or any(words in issue.message for issue in faults)
    if code == "PTM-D700":
        with pytest.raises(DatabaseError, match=words):
            read_served(database)


def test_exchanged_rows(levels: Path, tmp_path: Path) -> None:
    """The materials then name rows of other cells, and a file belongs to two rows."""
    database = Path(shutil.copytree(levels, tmp_path / "db"))
    file = database / "www/hints.json"
    index = json.loads(file.read_text())
    index["meshes"].reverse()
    file.write_text(json.dumps(index))
    issues = validate(database, workers=1).issues
    assert sum("not that of an object" in issue.message for issue in issues) == 2
    index["meshes"][1]["files"] = index["meshes"][0]["files"]
    file.write_text(json.dumps(index))
    issues = validate(database, workers=1).issues
    assert any("file of another row" in issue.message for issue in issues)


def test_a_coarsest_mesh_without_a_row(levels: Path, tmp_path: Path) -> None:
    database = Path(shutil.copytree(levels, tmp_path / "db"))
    file = database / "www/hints.json"
    index = json.loads(file.read_text())
    del index["meshes"]
    file.write_text(json.dumps(index))
    codes = {issue.code for issue in validate(database, workers=1).issues}
    assert {"PTM-D699", "PTM-D704"} <= codes
