"""A database of another release is out of date, not damaged; and one may be built anew as asked."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from ptmtools.cli.main import main
from ptmtools.pipeline import build_scene, database_status
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import CELLS, EMIT, PVS, STAGES, TEXTURES

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    model = Path(shutil.copytree(TWO_ROOMS, tmp_path_factory.mktemp("built") / "model"))
    options = ["--samples", "8", "--backend", "embree", "--max-leaves", "99"]
    assert main(["-q", "build-scene", str(model / "two_rooms.obj"), *options]) == 0
    return model / "two_rooms.db"


@pytest.fixture
def db(built: Path, tmp_path: Path) -> Path:
    """A copy of it, the model beside it."""
    shutil.copytree(built.parent, tmp_path / "model")
    return tmp_path / "model" / built.name


def test_another_recipe_is_out_of_date(db: Path, capsys: pytest.CaptureFixture[str]) -> None:
    manifest = json.loads((db / "manifest.json").read_bytes())
    record = manifest["stages"][CELLS.name]
    record["recipe"] -= 1
    record["parameters"]["max_cells"] = record["parameters"].pop("max_leaves")
    (db / "manifest.json").write_text(json.dumps(manifest))
    states = {stage.stage: stage.state for stage in database_status(db).stages}
    assert states == dict.fromkeys(STAGES, "done") | {CELLS.name: "stale"}
    assert main(["pvs", str(db)]) == 5
    assert "PTM-D008" in capsys.readouterr().err
    assert main(["validate", str(db)]) == 8
    said = capsys.readouterr()
    assert "PTM-D656" in said.out
    assert "PTM-D720" not in said.out
    assert "--max-leaves 99 --samples 8 --backend embree" in said.err
    build_scene(db.parent / "two_rooms.obj", db, until=PVS)
    assert database_status(db).stages[1].state == "done"


@pytest.mark.parametrize(
    ("stage", "option", "value"),
    [
        (TEXTURES, "profile", "shiny"),
        (TEXTURES, "tile", 7),
        (TEXTURES, "fallback", "no"),
        (EMIT, "format", "shiny"),
        (PVS, "method", "shiny"),
    ],
)
def test_recorded_options_that_are_impossible(
    db: Path, stage: Stage[Any], option: str, value: object, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = json.loads((db / "manifest.json").read_bytes())
    manifest["stages"][stage.name]["parameters"][option] = value
    (db / "manifest.json").write_text(json.dumps(manifest))
    assert main(["validate", str(db), "--json"]) == 8
    (issue,) = json.loads(capsys.readouterr().out)["issues"]
    assert (issue["code"], issue["place"]) == ("PTM-D650", f"stages.{stage.name}.parameters")
    assert str(value) in issue["message"]


def test_rebuild_runs_all_and_gives_the_same_bytes(db: Path, built: Path) -> None:
    before = {f.relative_to(db): f.read_bytes() for f in db.rglob("*") if f.is_file()}
    manifest = json.loads((db / "manifest.json").read_bytes())
    manifest["stages"][CELLS.name]["counts"]["cells"] = 77
    (db / "manifest.json").write_text(json.dumps(manifest))
    options = ["--samples", "8", "--backend", "embree", "--max-leaves", "99"]
    model = str(db.parent / "two_rooms.obj")
    assert main(["-q", "build-scene", model, *options, "--rebuild"]) == 0
    after = {f.relative_to(db): f.read_bytes() for f in db.rglob("*") if f.is_file()}
    assert after == before
