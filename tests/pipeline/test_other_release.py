"""A database of another release is out of date, not damaged; and one may be built anew as asked."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from ptmtools.cli.main import main
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import CELLS, EMIT, PVS, SCENE, STAGES, TEXTURES
from ptmtools.pipeline.status import database_status

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
    (db / "manifest.json").write_text(json.dumps(manifest))
    states = {stage.stage: stage.state for stage in database_status(db).stages}
    assert states == dict.fromkeys(STAGES, "done") | {CELLS.name: "stale"}
    assert main(["pvs", str(db)]) == 5
    assert "PTM-D008" in capsys.readouterr().err
    assert main(["validate", str(db)]) == 8
    printed = capsys.readouterr()
    assert "PTM-D656" in printed.out
    assert "PTM-D720" not in printed.out
    assert "--max-leaves 99 --samples 8 --backend embree" in printed.err
    build_scene(db.parent / "two_rooms.obj", db, until=PVS)
    assert database_status(db).stages[1].state == "done"


@pytest.mark.parametrize("command", ["textures", "light"])
def test_images_of_an_earlier_list(
    db: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before recipe 10 the list of images had no sizes; it is not damaged."""
    manifest = json.loads((db / "manifest.json").read_bytes())
    manifest["stages"][SCENE.name]["recipe"] = 9
    (db / "manifest.json").write_text(json.dumps(manifest))
    images = json.loads((db / "stages/images.json").read_bytes())
    for row in images["images"]:
        del row["bytes"]
    (db / "stages/images.json").write_text(json.dumps(images))
    assert main([command, str(db)]) == 5
    assert "PTM-D008" in capsys.readouterr().err


def test_a_plan_without_an_image(db: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = db.parent / "two_rooms.obj"
    (model.parent / "room_a.png").unlink()
    assert main(["build-scene", str(model), "--dry-run"]) == 0
    assert "room_a.png removed" in capsys.readouterr().out


def aged(db: Path) -> None:
    """As another release left it: hints of schema 1, VRML alone, other recipes."""
    manifest = json.loads((db / "manifest.json").read_bytes())
    stages = manifest["stages"]
    for stage in (SCENE, PVS, EMIT):
        stages[stage.name]["recipe"] -= 1
    for name in ("model_bytes", "image_bytes"):
        del stages[SCENE.name]["counts"][name]
    emitted = stages[EMIT.name]
    emitted |= {"recipe": 4}
    del emitted["counts"]["visit"]
    for path in [p for p in emitted["outputs"] if p.startswith(("www/hints/", "www/gltf/"))]:
        del emitted["outputs"][path]
    for folder in ("hints", "gltf"):
        shutil.rmtree(db / "www" / folder)
    hints = b'{"format": "ptmtools hints", "schema": 1, "cells": []}\n'
    (db / "www/hints.json").write_bytes(hints)
    emitted["outputs"]["www/hints.json"] = hashlib.sha256(hints).hexdigest()
    (db / "manifest.json").write_text(json.dumps(manifest))


COMMAND = "ptm build-scene two_rooms.obj -o"
OPTIONS = "--max-leaves 99 --samples 8 --backend embree"


@pytest.mark.parametrize(
    ("command", "status"),
    [
        ("info", 0),
        ("info --json", 0),
        ("status", 0),
        ("validate", 8),
        ("plot -o plan.png", 5),
        ("ach", 5),
        ("emit", 5),
    ],
)
def test_every_command_names_what_brings_it_up_to_date(
    db: Path, capsys: pytest.CaptureFixture[str], monkeypatch, command: str, status: int
) -> None:
    monkeypatch.chdir(db.parent)
    aged(db)
    name, *options = command.split()
    assert main([name, str(db), *options]) == status
    printed = capsys.readouterr()
    whole = f"`{COMMAND} {db} {OPTIONS}"
    assert any(f"{whole}{end}" in printed.out + printed.err for end in ("`", " --rebuild`"))
    assert "invalid counts" not in printed.out


def test_so_do_errors_of_what_is_missing(db: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (db / "stages/cells.npz").unlink()
    assert main(["ach", str(db)]) == 5
    err = capsys.readouterr().err
    assert "PTM-D005" in err
    assert f"run `{COMMAND} {db} {OPTIONS}` again" in err
    manifest = json.loads((db / "manifest.json").read_bytes())
    del manifest["stages"][PVS.name]
    (db / "manifest.json").write_text(json.dumps(manifest))
    assert main(["ach", str(db)]) == 5
    err = capsys.readouterr().err
    assert "PTM-D004" in err
    assert f"run `{COMMAND} {db} {OPTIONS}` first" in err


def test_the_first_build_says_what_is_rebuilt_and_why(
    db: Path, built: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    aged(db)
    build = ["build-scene", str(db.parent / "two_rooms.obj"), "--samples", "8"]
    build += ["--backend", "embree", "--max-leaves", "99"]
    assert main(build) == 0
    printed = capsys.readouterr().out
    for before in (SCENE.recipe - 1, PVS.recipe - 1, 4):
        assert f"because this release computes it differently (recipe {before}" in printed
    assert EMIT.changed in printed
    names = ("manifest.json", "www/hints.json", "www/hints/c0000.json", "www/gltf/c0000.glb")
    assert all((db / name).read_bytes() == (built / name).read_bytes() for name in names)
    assert main(["validate", str(db), "--strict"]) == 0


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
