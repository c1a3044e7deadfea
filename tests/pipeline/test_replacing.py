"""The stage that replaces objects: what it costs, what is done again, what is refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import DatabaseError
from ptmtools.light.options import LightOptions
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.names import HINTS
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import ACH, CELLS, EMIT, SCENE, STAGES
from ptmtools.pipeline.status import database_status, plan_build
from ptmtools.pipeline.validation import validate
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import arrays_of, sha256
from ptmtools_systems.apo.options import ReplaceOptions
from ptmtools_systems.stages.apo import APO, OCTREE_LIST, octree_files
from tests.output.agreement import disagreements
from tests.systems.apo.statues import write_rooms

QUICK = AchOptions(samples=4, backend="embree")
STATUES = ReplaceOptions(apo=("statue_*",), apo_faces=500, apo_error=0.2, apo_depth=6)


def built(model: Path, db: Path, *options: Any) -> list[str]:
    """The stages that a build runs."""
    report = build_scene(model, db, QUICK, LightOptions("none"), *options, workers=1)
    return [stage.stage for stage in report.stages if stage.ran]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the model, a database of it as it is, and one with its statues replaced."""
    folder = tmp_path_factory.mktemp("replaced")
    model = write_rooms(folder / "model", 3)
    assert built(model, folder / "plain.db") == [
        name for name, stage in STAGES.items() if not stage.optional
    ]
    assert built(model, folder / "light.db", STATUES) == [
        name for name, stage in STAGES.items() if stage is APO or not stage.optional
    ]
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "made"))


def contents(db: Path) -> dict[str, bytes]:
    return {f.relative_to(db).as_posix(): f.read_bytes() for f in db.rglob("*") if f.is_file()}


def opened(db: Path) -> Artifacts:
    return Artifacts(DatabaseFolder.open(db))


def index_of(db: Path) -> dict[str, Any]:
    actual: dict[str, Any] = json.loads((db / "www" / HINTS).read_text())
    return actual


def test_without_objects_the_stage_leaves_nothing(made: Path) -> None:
    db = made / "plain.db"
    record = DatabaseFolder.open(db).record(APO.name)
    assert (record.inputs, record.outputs, record.counts) == ({}, {}, {"octrees": 0})
    assert not (db / arrays_of(APO.name)).exists()
    assert not (db / "www/apo").exists()
    assert "octrees" not in index_of(db)
    artifacts = opened(db)
    assert artifacts[APO] is artifacts[SCENE]
    for stage in (CELLS, ACH):
        names = DatabaseFolder.open(db).record(stage.name).inputs
        assert arrays_of(SCENE.name) in names
        assert arrays_of(APO.name) not in names


def test_later_stages_see_the_simplified_meshes(made: Path) -> None:
    db = made / "light.db"
    assert validate(db).issues == ()
    artifacts = opened(db)
    scene, shown = artifacts.original(SCENE), artifacts[SCENE]
    assert len(shown.triangles) < len(scene.triangles) == 40 + 2 * 1280
    cells, ach = artifacts[CELLS], artifacts[ACH]
    assert cells.triangle_source.max() < len(shown.triangles)
    assert np.allclose(np.add.reduceat(ach.value, ach.start[:-1]), 1)
    for stage in (CELLS, ACH, EMIT):
        inputs = DatabaseFolder.open(db).record(stage.name).inputs
        assert {arrays_of(SCENE.name), arrays_of(APO.name)} <= inputs.keys(), stage.name
    rows = index_of(db)["octrees"]
    assert [row["object"] for row in rows] == ["statue_01", "statue_02"]
    for row in rows:
        assert (db / "www" / row["file"]).stat().st_size == row["ends"][-1]
        corner = shown.corners[shown.triangle_object == shown.objects.index(row["object"])]
        q = (corner - row["cube"]["low"]) / row["cube"]["side"]
        assert ((q >= 0) & (q < 1)).all()
    counts = DatabaseFolder.open(db).record(APO.name).counts
    assert counts["source"] == 2560
    assert counts["faces"] <= 1000
    assert counts["triangles"] == len(shown.triangles)
    # A new scene is stored by what is new in it.
    assert (db / arrays_of(APO.name)).stat().st_size < (
        db / arrays_of(SCENE.name)
    ).stat().st_size / 2


def test_only_what_changed_is_done_again(folder: Path) -> None:
    model, db = folder / "model/two_rooms.obj", folder / "light.db"
    before = contents(db)
    assert built(model, db, STATUES) == []
    finer = ReplaceOptions(apo=("statue_*",), apo_faces=500, apo_error=0.1, apo_depth=6)
    plan = {p.stage: p.plan for p in plan_build(model, db, QUICK, finer)}
    assert (plan["apo"], plan["cells"], plan["textures"]) == ("run", "maybe", "current")
    # The octrees are finer, the meshes are the same.
    assert built(model, db, finer) == ["apo", "emit"]
    after = contents(db)
    assert after[arrays_of(APO.name)] == before[arrays_of(APO.name)]
    assert after["www/apo/statue_01.bin"] != before["www/apo/statue_01.bin"]
    assert built(model, db, STATUES) == ["apo", "emit"]
    assert contents(db) == before
    # What is painted on them is none of its business.
    file = model.with_name("room_a.png")
    with Image.open(file) as image:
        texels = np.asarray(image.convert("RGB"))
    Image.fromarray(255 - texels).save(file)
    assert built(model, db, STATUES) == ["scene", "textures", "emit"]
    (db / "www/apo/statue_02.bin").unlink()
    assert built(model, db, STATUES) == ["apo"]
    assert validate(db).issues == ()


def test_with_and_without_by_turns(folder: Path) -> None:
    model, db = folder / "model/two_rooms.obj", folder / "plain.db"
    assert {"apo", "cells", "emit"} <= set(built(model, db, STATUES))
    assert contents(db) == contents(folder / "light.db")
    plans = {p.stage: p for p in plan_build(model, db, QUICK)}
    assert (plans["apo"].plan, plans["cells"].plan) == ("run", "maybe")
    # That it does not read the scene any more follows from the option.
    assert plans["apo"].reasons[0] == "apo: ['statue_*'] → none"
    assert not any("removed" in reason for reason in plans["apo"].reasons)
    assert {"apo", "cells", "emit"} <= set(built(model, db))
    assert not (db / "www/apo").exists()
    model.write_text(model.read_text().replace("v 4 2 1.5", "v 4 2.1 1.5"))
    assert built(model, db)[:2] == ["scene", "cells"]  # there is nothing to do in between
    assert built(model, db) == []


def test_a_database_of_an_earlier_release(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It has no record of the stage, and needs nothing but that."""
    model, db = folder / "model/two_rooms.obj", folder / "plain.db"
    before = contents(db)
    manifest = json.loads(before["manifest.json"])
    del manifest["stages"][APO.name]
    (db / "manifest.json").write_text(json.dumps(manifest))
    assert {s.stage: s.state for s in database_status(db).stages} == dict.fromkeys(STAGES, "done")
    assert validate(db).issues == ()
    for command in ("info", "plot -o plan.png --force", "path -o walk.json --force"):
        name, *options = command.split()
        assert main([name, str(db), *(str(db / o) if "." in o else o for o in options)]) == 0
    assert "PTM-" not in capsys.readouterr().err
    assert [p.plan for p in plan_build(model, db, QUICK, LightOptions("none"))] == [
        "run" if name == APO.name else "current" for name in STAGES
    ]
    assert built(model, db) == []
    (db / "plan.png").unlink()
    (db / "walk.json").unlink()
    assert contents(db) == before


def test_stages_run_alone(folder: Path) -> None:
    db = folder / "light.db"
    before = contents(db)
    for stage in ("pvs", "textures", "emit"):
        assert main([stage, "-q", str(db), "-j", "1"]) == 0
    assert contents(db) == before
    assert validate(db).issues == ()


def sealed(db: Path, name: str, data: bytes) -> None:
    """Another file of the database, and the manifest says that it is the right one."""
    manifest = db / "manifest.json"
    before = sha256((db / name).read_bytes())
    manifest.write_text(manifest.read_text().replace(before, sha256(data)))
    (db / name).write_bytes(data)


@pytest.mark.parametrize("array", ["objects", "points", "triangles", "source", "uv"])
def test_damaged_arrays(folder: Path, array: str) -> None:
    db, name = folder / "light.db", arrays_of(APO.name)
    arrays = dict(unpack_arrays((db / name).read_bytes(), file=name))
    arrays[array] = arrays[array][:-1]
    sealed(db, name, pack_arrays(arrays))
    with pytest.raises(DatabaseError, match=r"stages/apo\.npz: damaged.*PTM-D006"):
        opened(db)[APO]
    assert {(i.code, i.file) for i in validate(db).issues} == {("PTM-D720", name)}


@pytest.mark.parametrize(
    "change",
    [
        lambda rows: rows.clear(),
        lambda rows: rows.append(rows[0]),
        lambda rows: rows[0].update(file="../../etc/passwd"),
        lambda rows: rows[0].update(file=5),
        lambda rows: rows[0].update(object=None),
        lambda rows: rows[0].update(low=[1, 2]),
        lambda rows: rows[0].update(side="wide"),
        lambda rows: rows[0].update(side=float("nan")),
        lambda rows: rows[0]["ends"].pop(),
        lambda rows: rows[0].pop("crc32"),
        lambda rows: rows.__setitem__(0, 7),
    ],
)
def test_a_damaged_list(folder: Path, change: Any) -> None:
    db = folder / "light.db"
    document = json.loads((db / OCTREE_LIST).read_text())
    change(document["octrees"])
    sealed(db, OCTREE_LIST, json.dumps(document).encode())
    assert "PTM-D720" in {i.code for i in validate(db).issues}
    assert main(["emit", "-q", str(db), "--title", "other"]) == 5


def test_a_list_that_names_another_file(folder: Path) -> None:
    db = folder / "light.db"
    text = (db / OCTREE_LIST).read_text().replace("apo/statue_02.bin", "apo/statue_03.bin")
    sealed(db, OCTREE_LIST, text.encode())
    (issue,) = validate(db).issues
    assert (issue.code, issue.file, issue.place) == ("PTM-D720", OCTREE_LIST, "statue_02")


def glb_nodes(db: Path) -> dict[str, int]:
    """The octree that each object has, by all GLBs."""
    actual = {}
    for file in sorted((db / "www/gltf").glob("*.glb")):
        for node in unpack(file.read_bytes())[0].get("nodes", []):
            if "extras" in node:
                actual[node["name"]] = node["extras"]["octree"]
    return actual


def renumbered(db: Path, change: Callable[[int], int]) -> None:
    """Other octrees for the nodes of all GLBs."""
    for file in (db / "www/gltf").glob("*.glb"):
        document, binary = unpack(file.read_bytes())
        for node in document.get("nodes", []):
            if "extras" in node:
                node["extras"]["octree"] = change(node["extras"]["octree"])
        sealed(db, f"www/gltf/{file.name}", pack(document, binary))


def moved(db: Path, by: float, larger: float = 1.0) -> None:
    """The cube of the first octree elsewhere, by a share of its side."""
    index = index_of(db)
    cube = index["octrees"][0]["cube"]
    cube["low"] = [value + by * cube["side"] for value in cube["low"]]
    cube["side"] *= larger
    sealed(db, f"www/{HINTS}", json.dumps(index).encode())


def test_nodes_say_which_octree_is_theirs(made: Path) -> None:
    names = [row["object"] for row in index_of(made / "light.db")["octrees"]]
    assert glb_nodes(made / "light.db") == {name: k for k, name in enumerate(names)}
    assert glb_nodes(made / "plain.db") == {}


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (lambda db: renumbered(db, lambda k: 1 - k), "another object"),
        (lambda db: moved(db, 0.2), "leaves the cube"),
        (lambda db: moved(db, -0.5, 2.0), "have no texel"),
    ],
    ids=["swapped", "cube elsewhere", "cube larger"],
)
def test_octrees_of_other_objects(
    folder: Path, damage: Callable[[Path], None], expected: str
) -> None:
    db = folder / "light.db"
    damage(db)
    lines = disagreements(db / "www")
    assert lines
    assert all(line.startswith("octree: ") and expected in line for line in lines)


def test_an_octree_that_does_not_exist(folder: Path) -> None:
    db = folder / "light.db"
    renumbered(db, lambda k: k + 2)
    assert {i.code for i in validate(db).issues} == {"PTM-D704"}


def test_an_octree_of_nobody(folder: Path) -> None:
    db = folder / "light.db"
    renumbered(db, lambda k: 0)
    assert any("no GLB has" in line for line in disagreements(db / "www"))


def test_names_of_files() -> None:
    names = ["Büste 1", "buste_1", "BUSTE_1", "../../x", "", "像", "a" * 99, "."]
    assert octree_files(names) == [
        "apo/Buste_1.bin",
        "apo/buste_1_2.bin",
        "apo/BUSTE_1_3.bin",
        "apo/x.bin",
        "apo/object.bin",
        "apo/object_2.bin",
        f"apo/{'a' * 48}.bin",
        "apo/object_3.bin",
    ]


def test_nothing_fits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = write_rooms(tmp_path / "model", 2, ("Büste 1", "buste 1"))
    options = ["-o", str(tmp_path / "db"), "--samples", "4", "-j", "1"]
    assert main(["build-scene", str(model), *options, "--apo", "b*", "--apo", "statue*"]) == 0
    printed = capsys.readouterr().out
    assert "warning: --apo: no object is called 'statue*'" in printed
    assert "warning: 1 object of --apo has no more triangles than --apo-faces 2,000" in printed
    assert main(["build-scene", str(model), *options, "--apo-faces", "2"]) == 3
    assert "--apo-faces 2 is not possible" in capsys.readouterr().err
    assert main(["build-scene", str(model), *options, "--apo-error", "0.1"]) == 3
    assert "--apo-error does nothing without --apo" in capsys.readouterr().err
    assert main(["build-scene", str(model), *options, "--apo", "[bB]*", "--apo-faces", "99"]) == 0
    assert sorted(p.name for p in (tmp_path / "db/www/apo").iterdir()) == [
        "Buste_1.bin",
        "buste_1_2.bin",
    ]
    assert validate(tmp_path / "db").issues == ()
    assert "2 objects of 640 triangles" in capsys.readouterr().out
    assert main(["info", str(tmp_path / "db")]) == 0
    printed = capsys.readouterr().out
    assert "options: --apo '[bB]*' --apo-faces 99" in printed
