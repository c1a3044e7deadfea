"""A database whose stages have their files in lists: checked, damaged, rebuilt."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.status import database_status, plan_build
from ptmtools.pipeline.validation import validate
from ptmtools.store import lists
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import LISTS, sha256
from ptmtools.store.lists import FileList, list_file
from tests.conftest import files_below

MODEL = Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj"
QUICK = AchOptions(samples=4, backend="embree")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lists")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lists, "INLINE", 6)
        patch.setattr(lists, "MEAN", 6)
        build_scene(MODEL, folder / "db", QUICK, workers=1)
    return folder / "db"


@pytest.fixture
def db(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(lists, "INLINE", 6)
    monkeypatch.setattr(lists, "MEAN", 6)
    return Path(shutil.copytree(made, tmp_path / "db"))


def list_of(db: Path, stage: str) -> Path:
    return db / min(DatabaseFolder.open(db).record(stage).list_files())


def test_it_is_sound_and_nothing_runs_again(db: Path) -> None:
    assert len(list((db / LISTS).iterdir())) > 4
    report = validate(db)
    assert (report.issues, report.notes) == ((), ())
    assert database_status(db).finished
    before = files_below(db)
    assert not any(stage.ran for stage in build_scene(MODEL, db, QUICK, workers=1).stages)
    assert files_below(db) == before


@pytest.mark.parametrize(
    ("damage", "code"),
    [(Path.unlink, "PTM-D651"), (lambda file: file.write_bytes(b"{}"), "PTM-D652")],
)
def test_a_damaged_list(db: Path, damage: Callable[[Path], object], code: str) -> None:
    before = files_below(db)
    lost = list_of(db, "emit")
    name = lost.relative_to(db).as_posix()
    damage(lost)
    issues = [(issue.code, issue.file) for issue in validate(db).issues]
    assert (code, name) in issues
    assert {file for _, file in issues} == {name}
    states = {stage.stage: (stage.state, stage.why) for stage in database_status(db).stages}
    assert states["emit"] == ("damaged", f"{name} is missing or damaged")
    assert {state for stage, (state, _) in states.items() if stage != "emit"} == {"done"}
    plans = {plan.stage: plan for plan in plan_build(MODEL, db, QUICK)}
    assert plans["emit"].reasons == (f"{name} is missing or damaged",)
    report = build_scene(MODEL, db, QUICK, workers=1)
    assert [stage.stage for stage in report.stages if stage.ran] == ["emit"]
    assert files_below(db) == before


def test_a_list_of_impossible_outputs(db: Path) -> None:
    """With the right digest, it is a finding, and no file outside is read."""
    outputs = DatabaseFolder.open(db).record("emit").outputs
    assert isinstance(outputs, FileList)
    lost = db / list_file(outputs.lists[0])
    document = json.loads(lost.read_text())
    document["files"] = {"../../../etc/hostname": "ab" * 32}
    text = json.dumps(document)
    (lost.parent / f"{sha256(text.encode())}.json").write_text(text)
    manifest = db / "manifest.json"
    manifest.write_text(manifest.read_text().replace(lost.stem, sha256(text.encode())))
    issues = {(issue.code, issue.file) for issue in validate(db).issues}
    assert ("PTM-D650", f"{LISTS}/{sha256(text.encode())}.json") in issues
    assert not any("hostname" in file for _, file in issues)


def test_a_database_without_lists_gets_them(db: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of an earlier release, where one stage runs again."""
    monkeypatch.setattr(lists, "INLINE", 1024)
    build_scene(MODEL, db, QUICK, workers=1, rebuild=True)
    assert not (db / LISTS).exists()
    monkeypatch.setattr(lists, "INLINE", 6)
    (db / "www/root.wrl").unlink()
    build_scene(MODEL, db, QUICK, workers=1)
    assert (db / LISTS).is_dir()
    assert validate(db).issues == ()


def test_an_output_that_the_manifest_lacks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its stage counts as current; the message names the options that repair it."""
    build = ["build-scene", str(MODEL), "-o", str(tmp_path / "db"), "-q", "-j", "1"]
    build += ["--samples", "16", "--backend", "embree"]
    assert main(build) == 0
    file = tmp_path / "db/manifest.json"
    manifest = json.loads(file.read_text())
    whole = manifest["stages"]["textures"]["outputs"]
    manifest["stages"]["textures"]["outputs"] = {n: d for n, d in whole.items() if "-64" not in n}
    file.write_text(json.dumps(manifest))
    assert main([*build, "--force"]) == 5
    assert "with --force --rebuild [PTM-D002]" in capsys.readouterr().err
    assert main([*build, "--force", "--rebuild"]) == 0
    assert json.loads(file.read_text())["stages"]["textures"]["outputs"] == whole
