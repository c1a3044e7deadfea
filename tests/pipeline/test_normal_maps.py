"""Normal maps of materials in a database: what is written, read back, and done again."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.required_levels import VisitorScreen, unresolved_levels
from ptmtools.light.options import LightOptions
from ptmtools.output.gltf_reader import ReadPrimitive, read_glb
from ptmtools.output.names import HINTS
from ptmtools.output.options import EmitOptions
from ptmtools.output.served import read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import CELLS, PVS, SCENE
from ptmtools.pipeline.validation import validate
from ptmtools.scene.options import IngestOptions
from ptmtools.store.folder import DatabaseFolder
from tests.output.agreement import disagreements
from tests.pipeline.test_relief import with_materials
from tests.scene.bumpy import write_bumpy

QUICK, DARK = AchOptions(samples=4, backend="embree"), LightOptions("none")
LIGHT = LightOptions(light="bake", light_density=4, light_samples=4)


def built(model: Path, db: Path, *options: Any) -> list[str]:
    """The stages that a build runs; without light, unless asked for."""
    options = options if any(isinstance(k, LightOptions) for k in options) else (DARK, *options)
    report = build_scene(model, db, QUICK, *options, workers=1)
    return [stage.stage for stage in report.stages if stage.ran]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the model and a database of it."""
    folder = tmp_path_factory.mktemp("bumpy")
    built(write_bumpy(folder / "model"), folder / "db")
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "made"))


def index_of(db: Path) -> dict[str, Any]:
    actual: dict[str, Any] = json.loads((db / "www" / HINTS).read_text())
    return actual


def bumps(db: Path) -> list[ReadPrimitive]:
    """The shapes with a normal map."""
    files = sorted((db / "www/gltf").glob("*.glb"))
    shapes = [shape for file in files for shape in read_glb(file.read_bytes()).primitives]
    return [shape for shape in shapes if shape.material.normal is not None]


def names(db: Path, shapes: list[ReadPrimitive]) -> set[tuple[str, int | None]]:
    """The normal map of each shape, and the number of its coordinates."""
    rows = index_of(db)["textures"]
    return {
        (rows[s.material.normal]["file"].partition("/")[2], s.material.coords)
        for s in shapes
        if s.material.normal is not None
    }


def test_the_hints_and_the_cells_name_them(made: Path) -> None:
    db = made / "db"
    assert validate(db).issues == ()
    assert disagreements(db / "www") == []
    rows = index_of(db)["textures"]
    maps = {row["file"] for row in rows if row.get("normals")}
    assert maps == {"textures/waves.ptm", "textures/heights.ptm"}
    expected = {("waves.ptm", 0), ("heights.ptm", 0), ("waves.ptm", 1)}
    assert names(db, bumps(db)) == expected
    numbers = {n for n, row in enumerate(rows) if row.get("normals")}
    for file in (db / "www/hints").glob("c*.json"):
        record = json.loads(file.read_text())
        assert not numbers & {t for used in record["textures"] for t in used}
    scales = {shape.material.scale for shape in bumps(db)}
    assert scales == {0.5, 1}


def test_coordinates_survive_the_cells(made: Path) -> None:
    """Those of ceilings are metres."""
    bumped = read_served(made / "db").surfaces.bump_surfaces
    assert bumped
    rows = index_of(made / "db")["textures"]
    own = bumped.texture == [row["file"] for row in rows].index("textures/waves.ptm")
    own &= (bumped.corner[..., 1] > 2.99).all(axis=1) & (bumped.corner[..., 0].max(axis=1) <= 8.2)
    plain = read_served(made / "db").surfaces.texture[own] < 0
    ceiling = bumped.uv[own][plain]
    place = bumped.corner[own][plain][..., [0, 2]]
    assert len(ceiling)
    # A metre is one repetition, whichever way round.
    edges = np.linalg.norm(np.diff(ceiling, axis=1), axis=2)
    assert np.allclose(edges, np.linalg.norm(np.diff(place, axis=1), axis=2), atol=0.01)


def test_beside_lightmaps(folder: Path) -> None:
    """Coordinates of their own come third there, in plain cells, too."""
    pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")
    db, model = folder / "db", folder / "model/two_rooms.obj"
    built(model, db, LIGHT)
    assert validate(db).issues == ()
    lit = bumps(db)
    assert {coords for _, coords in names(db, lit)} == {0, 2}
    assert all(shape.light is not None for shape in lit)
    built(model, db, LIGHT, EmitOptions(plain_gltf=True))
    assert validate(db).issues == ()
    for plain, packed in zip(bumps(db), lit, strict=True):
        assert plain.normal is not None
        assert packed.normal is not None
        for ends in ("min", "max"):
            one, other = (getattr(each.normal, ends)(axis=0) for each in (plain, packed))
            assert one == pytest.approx(other, abs=1e-3)


def test_none(folder: Path) -> None:
    db, model = folder / "db", folder / "model/two_rooms.obj"
    assert built(model, db) == []
    ran = built(model, db, IngestOptions(normal_maps="none"))
    assert ran[0] == "scene"
    assert "pvs" not in ran
    assert bumps(db) == []
    assert not list((db / "www/textures").glob("waves*"))
    assert validate(db).issues == ()


def test_a_database_of_an_earlier_release(folder: Path) -> None:
    """Its scene has no normal maps; a build reads the model again."""
    db, model = folder / "db", folder / "model/two_rooms.obj"
    built(model, db, IngestOptions(normal_maps="none"))
    manifest = json.loads((db / "manifest.json").read_text())
    scene = manifest["stages"]["scene"]
    assert scene["parameters"].pop("normal_maps") == "none"
    scene["recipe"] = 8
    (db / "manifest.json").write_text(json.dumps(manifest))
    assert {issue.code for issue in validate(db).issues} == {"PTM-D656"}
    assert built(model, db)[0] == "scene"
    assert bumps(db)


def test_trim_keeps_their_levels(made: Path) -> None:
    artifacts = Artifacts(DatabaseFolder.open(made / "db"))
    scene = artifacts[SCENE]
    sizes = [(65536, 65536)] * len(scene.images)
    levels = unresolved_levels(
        scene, artifacts[CELLS], artifacts[PVS], sizes, VisitorScreen(100, 60.0, 0.5)
    )
    of = {image.name: n for image, n in zip(scene.images, levels.tolist(), strict=True)}
    assert of["room_a.png"] > 0
    assert of["waves.png"] == of["heights.png"] == 0


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda m: m["extras"].update(normal=99), "PTM-D704"),
        (lambda m: m["extras"].pop("normal"), "PTM-D731"),
        (lambda m: m["extras"].update(normalCoords=2), "PTM-D731"),
        (lambda m: m["extras"].pop("normalCoords"), "PTM-D731"),
        (lambda m: m["extras"].update(normalScale=7), "PTM-D731"),
        (lambda m: m["extras"].update(normalWrapS=33071), "PTM-D731"),
    ],
    ids=["none", "unnamed", "coordinates", "an object's", "scale", "wrap"],
)
def test_a_wrong_reference_is_found(folder: Path, change: Any, code: str) -> None:
    db = folder / "db"
    with_materials(db, change)
    assert code in {issue.code for issue in validate(db).issues}


def test_a_map_that_is_gone(folder: Path) -> None:
    db = folder / "db"
    (db / "www/textures/waves.ptm").unlink()
    assert {issue.code for issue in validate(db).issues} >= {"PTM-D651"}
    words = ["build-scene", "-q", str(folder / "model/two_rooms.obj"), "-o", str(db)]
    assert main([*words, "--light", "none"]) == 0


def test_normals_that_become_heights(folder: Path) -> None:
    """They are converted, as in a new database."""
    model = folder / "model" / "two_rooms.obj"
    shutil.copy(model.parent / "heights.png", model.parent / "waves.png")
    assert SCENE.name in built(model, folder / "db")
    built(model, folder / "new")
    again, new = (Artifacts(DatabaseFolder.open(folder / name))[SCENE] for name in ("db", "new"))
    assert [image.sha256 for image in again.images] == [image.sha256 for image in new.images]
