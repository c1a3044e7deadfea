"""Normal maps of replaced objects in a database: what is written, done again, and refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.names import HINTS
from ptmtools.output.options import EmitOptions
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import SCENE
from ptmtools.pipeline.status import plan_build
from ptmtools.pipeline.validation import validate
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import arrays_of, sha256
from ptmtools_systems.apo.options import ReplaceOptions
from ptmtools_systems.stages.apo import APO
from ptmtools_systems.stages.relief import RELIEF
from tests.output.agreement import disagreements
from tests.systems.apo.statues import write_rooms

QUICK, DARK = AchOptions(samples=4, backend="embree"), LightOptions("none")


def statues(**changed: Any) -> ReplaceOptions:
    given: dict[str, Any] = {"apo": ("statue_*",), "apo_faces": 500, "apo_error": 0.1}
    return ReplaceOptions(**{**given, "relief": "normal-map", **changed})


def built(model: Path, db: Path, *options: Any) -> list[str]:
    """The stages that a build runs; without light, unless asked for."""
    options = options if any(isinstance(k, LightOptions) for k in options) else (DARK, *options)
    report = build_scene(model, db, QUICK, *options, workers=1)
    return [stage.stage for stage in report.stages if stage.ran]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the model and a database of it."""
    folder = tmp_path_factory.mktemp("relieved")
    model = write_rooms(folder / "model", 4)
    assert "relief" in built(model, folder / "db", statues())
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "made"))


def contents(db: Path) -> dict[str, bytes]:
    return {f.relative_to(db).as_posix(): f.read_bytes() for f in db.rglob("*") if f.is_file()}


def index_of(db: Path) -> dict[str, Any]:
    actual: dict[str, Any] = json.loads((db / "www" / HINTS).read_text())
    return actual


def glbs(db: Path) -> list[Path]:
    return sorted((db / "www/gltf").glob("*.glb"))


def test_processes_bake_maps_of_a_stored_scene(folder: Path) -> None:
    """And the same as one process; a rebuild leaves nothing to do."""
    model, db = folder / "model/two_rooms.obj", folder / "db"
    finer = statues(apo_error=0.05)
    report = build_scene(model, db, QUICK, DARK, finer, workers=2)
    assert "relief" in [stage.stage for stage in report.stages if stage.ran]
    assert built(model, folder / "other", finer)
    assert contents(db) == contents(folder / "other")
    build_scene(model, db, QUICK, DARK, finer, workers=1, rebuild=True)
    assert built(model, db, finer) == []


def test_the_hints_and_the_cells_name_them(made: Path) -> None:
    db = made / "db"
    assert validate(db).issues == ()
    assert disagreements(db / "www") == []
    index = index_of(db)
    assert "octrees" not in index
    maps = {n: row["relief"] for n, row in enumerate(index["textures"]) if "relief" in row}
    assert sorted(maps.values()) == ["statue_01", "statue_02"]
    scene = Artifacts(DatabaseFolder.open(db))[SCENE]
    seen = 0
    for cell, file in enumerate(glbs(db)):
        record = json.loads((db / f"www/hints/{file.stem}.json").read_text())
        for shape in read_glb(file.read_bytes()).primitives:
            normal = shape.material.normal
            assert maps.get(normal) == (shape.object if shape.object in maps.values() else None)
            if normal is None:
                continue
            seen += len(shape.triangle)
            assert normal in record["textures"][record["visible"].index(cell)]
            place = next(row for row in record["need"] if row[0] == normal)
            assert 0 < place[2] <= 1
            assert shape.frame is not None
            assert shape.light is not None
            assert ((shape.light >= 0) & (shape.light <= 1)).all()
            name = index["textures"][normal]["fallback"].rpartition("/")[2]
            assert shape.material.normal_map == f"../textures/{name}"
    own = np.isin(np.array(scene.objects)[scene.triangle_object], [*maps.values()])
    assert seen == own.sum()


def test_plain_and_compressed_cells_agree(folder: Path) -> None:
    db = folder / "db"
    packed = [read_glb(file.read_bytes()) for file in glbs(db)]
    built(folder / "model/two_rooms.obj", db, statues(), EmitOptions(plain_gltf=True))
    assert disagreements(db / "www") == []
    for file, other in zip(glbs(db), packed, strict=True):
        plain = read_glb(file.read_bytes())
        for one, two in zip(plain.primitives, other.primitives, strict=True):
            assert (one.frame is None) == (two.frame is None)
            if one.frame is None or two.frame is None or one.light is None or two.light is None:
                continue
            # In another order: by frame and coordinates of the corners.
            rows = [
                np.unique(np.hstack([each.frame, np.round(each.light, 2)]), axis=0)
                for each in (one, two)
            ]
            assert {tuple(r[:7]) for r in rows[0]} == {tuple(r[:7]) for r in rows[1]}


def test_only_what_changed_is_done_again(folder: Path) -> None:
    model, db = folder / "model/two_rooms.obj", folder / "db"
    before = contents(db)
    assert built(model, db, statues()) == []
    finer = statues(apo_error=0.01)
    plan = {p.stage: p.plan for p in plan_build(model, db, QUICK, finer)}
    assert (plan["apo"], plan["relief"]) == ("run", "run")
    assert built(model, db, finer) == ["apo", "relief", "emit"]
    after = contents(db)
    assert after[arrays_of(APO.name)] == before[arrays_of(APO.name)]
    assert len(after["www/textures/relief~statue_01.ptm"]) > len(
        before["www/textures/relief~statue_01.ptm"]
    )
    assert built(model, db, statues(relief="octree", apo_depth=6)) == ["apo", "relief", "emit"]
    octrees = contents(db)
    assert not [name for name in octrees if "relief" in name]
    assert "www/apo/statue_01.bin" in octrees
    assert validate(db).issues == ()
    assert built(model, db, statues()) == ["apo", "relief", "emit"]
    assert contents(db) == before
    assert {"apo", "relief", "emit"} <= set(built(model, db))
    assert not [name for name in contents(db) if "relief" in name]


def test_they_take_the_light_at_vertices(folder: Path) -> None:
    model, db = folder / "model/two_rooms.obj", folder / "db"
    light = LightOptions(light="bake", light_density=2, light_samples=4)
    assert {"light", "emit"} <= set(built(model, db, statues(), light))
    assert validate(db).issues == ()
    shapes = [s for file in glbs(db) for s in read_glb(file.read_bytes()).primitives]
    own = [shape for shape in shapes if shape.material.normal is not None]
    assert len(own) == 2
    for shape in own:
        assert shape.material.light is None
        assert shape.color is not None
        assert shape.color.min() < 1
    assert all(s.material.light is not None for s in shapes if s.material.normal is None)


def test_a_stage_of_its_own(folder: Path) -> None:
    db = folder / "db"
    before = contents(db)
    for stage in ("relief", "emit"):
        assert main([stage, "-q", str(db), "-j", "1"]) == 0
    assert contents(db) == before


@pytest.mark.parametrize("array", ["objects", "side", "uv", "frame"])
def test_damaged_arrays(folder: Path, array: str) -> None:
    db, name = folder / "db", arrays_of(RELIEF.name)
    arrays = dict(unpack_arrays((db / name).read_bytes(), file=name))
    arrays[array] = arrays[array][:-1]
    sealed(db, name, pack_arrays(arrays))
    assert {(i.code, i.file) for i in validate(db).issues} == {("PTM-D720", name)}


def sealed(db: Path, name: str, data: bytes) -> None:
    """Another file of the database, and the manifest says that it is the right one."""
    manifest = db / "manifest.json"
    before = sha256((db / name).read_bytes())
    manifest.write_text(manifest.read_text().replace(before, sha256(data)))
    (db / name).write_bytes(data)


def with_materials(db: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Other extras of the materials with normal maps."""
    for file in glbs(db):
        document, binary = unpack(file.read_bytes())
        for material in document["materials"]:
            if "normal" in material.get("extras", {}):
                change(material)
        sealed(db, f"www/gltf/{file.name}", pack(document, binary))


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda m: m["extras"].update(normal=99), "PTM-D704"),
        (lambda m: m["extras"].update(normal=0), "PTM-D731"),
        (lambda m: m["extras"].update(normal=9 - m["extras"]["normal"]), "PTM-D731"),
        (lambda m: m["extras"].pop("normal"), "PTM-D731"),
        (lambda m: m["normalTexture"].update(index=99), "PTM-D731"),
    ],
    ids=["none", "image", "other", "unnamed", "no texture"],
)
def test_a_wrong_reference_is_found(
    folder: Path, change: Callable[[dict[str, Any]], object], code: str
) -> None:
    db = folder / "db"
    names = [row.get("relief") for row in index_of(db)["textures"]]
    assert names[4:] == ["statue_01", "statue_02"]  # 9 - number is the other one
    with_materials(db, change)
    assert {issue.code for issue in validate(db).issues} == {code}


def test_attributes_that_are_missing(folder: Path) -> None:
    db = folder / "db"
    for name in ("NORMAL", "TANGENT", "TEXCOORD_1"):
        file = glbs(db)[0]
        document, binary = unpack(file.read_bytes())
        for mesh in document["meshes"]:
            for primitive in mesh["primitives"]:
                primitive["attributes"].pop(name, None)
        damaged = pack(document, binary)
        other = Path(shutil.copytree(db, folder / name))
        sealed(other, f"www/gltf/{file.name}", damaged)
        assert {issue.code for issue in validate(other).issues} == {"PTM-D731"}, name


def test_a_map_that_is_gone(folder: Path) -> None:
    db = folder / "db"
    (db / "www/textures/relief~statue_01.ptm").unlink()
    assert {i.code for i in validate(db).issues} == {"PTM-D651", "PTM-D671"}
    assert built(folder / "model/two_rooms.obj", db, statues()) == ["relief"]
    assert validate(db).issues == ()


def test_without_objects(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = write_rooms(tmp_path / "model", 2)
    options = ["-o", str(tmp_path / "db"), "--samples", "4", "-j", "1", "--relief", "normal-map"]
    assert main(["build-scene", str(model), *options]) == 3
    assert "--relief does nothing without --apo" in capsys.readouterr().err
