"""The database folder: who may write in it, and that it never is in between two states."""

from __future__ import annotations

from pathlib import Path

import pytest

from ptmtools.errors import DatabaseError, OutputError
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import MANIFEST
from ptmtools.store.manifest import SCHEMA, StageRecord
from ptmtools.store.writer import DatabaseWriter
from tests.conftest import files_below


def write(db: Path, files: dict[str, bytes], stage: str = "cells", model: str = "m.obj") -> None:
    with DatabaseWriter.open_for_model(db, model, force=True) as writer:
        staged = writer.begin("some")
        for name, data in files.items():
            staged.put(name, data)
        staged.commit({stage: StageRecord(1, {}, {}, staged.pending())})


def test_commits_and_reads_back(tmp_path: Path) -> None:
    write(tmp_path / "a" / "db", {"stages/x": b"1", "www/y": b"2"})
    db = DatabaseFolder.open(tmp_path / "a" / "db")
    outputs = db.record("cells").outputs
    assert db.read("stages/x", outputs["stages/x"]) == b"1"
    assert db.first_damage(outputs) is None
    assert set(files_below(db.path)) == {MANIFEST, "stages/x", "www/y"}


def test_what_a_stage_no_longer_makes_goes_and_what_is_foreign_stays(tmp_path: Path) -> None:
    write(tmp_path, {"www/old/a": b"1", "www/keep": b"2"})
    (tmp_path / "www" / "mine.txt").write_text("mine")
    write(tmp_path, {"www/keep": b"3"})
    assert set(files_below(tmp_path)) == {MANIFEST, "www/keep", "www/mine.txt"}
    assert not (tmp_path / "www" / "old").exists()


def test_without_a_commit_it_stays_what_it_was(tmp_path: Path) -> None:
    write(tmp_path, {"www/a": b"1"})
    before = files_below(tmp_path)

    def update() -> None:
        with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
            writer.begin("some").put("www/a", b"2")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        update()
    assert files_below(tmp_path) == before


def test_a_new_folder_goes_again_if_nothing_was_committed(tmp_path: Path) -> None:
    with DatabaseWriter.open_for_model(tmp_path / "a" / "db", "m.obj") as writer:
        writer.begin("some").put("www/a", b"2")
    assert not list(tmp_path.iterdir())


def test_two_writers_do_not_meet(tmp_path: Path) -> None:
    with (
        DatabaseWriter.open_for_model(tmp_path, "m.obj"),
        pytest.raises(DatabaseError, match="PTM-D007"),
    ):
        DatabaseWriter.open_for_model(tmp_path, "m.obj")


def test_force_guards_what_is_not_ours(tmp_path: Path) -> None:
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "mine.txt").write_text("mine")
    with pytest.raises(OutputError, match="PTM-O010"):
        DatabaseWriter.open_for_model(foreign, "m.obj")
    write(foreign, {"www/a": b"1"})
    assert (foreign / "mine.txt").read_text() == "mine"

    with pytest.raises(OutputError, match="PTM-O010"):
        DatabaseWriter.open_for_model(foreign, "other.obj")
    write(foreign, {"www/b": b"1"}, "pvs", model="other.obj")
    assert set(files_below(foreign)) == {MANIFEST, "www/b", "mine.txt"}

    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(OutputError, match="PTM-O001"):
        DatabaseWriter.open_for_model(file, "m.obj", force=True)


@pytest.mark.parametrize("schema", [SCHEMA - 1, SCHEMA + 1])
def test_a_database_of_another_schema_is_refused(tmp_path: Path, schema: int) -> None:
    write(tmp_path, {"www/a": b"1"})
    manifest = tmp_path / MANIFEST
    manifest.write_text(manifest.read_text().replace(f'"schema": {SCHEMA}', f'"schema": {schema}'))
    with pytest.raises(DatabaseError, match="PTM-D003"):
        DatabaseWriter.open_for_model(tmp_path, "m.obj")
    with pytest.raises(DatabaseError, match="PTM-D003") as fault:
        DatabaseFolder.open(tmp_path)
    assert "--force" in fault.value.remedy


def test_says_what_is_missing_or_damaged(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="PTM-D001"):
        DatabaseFolder.open(tmp_path)
    write(tmp_path, {"stages/cells.npz": b"no archive", "www/a": b"1"})
    db = DatabaseFolder.open(tmp_path)
    with pytest.raises(DatabaseError, match="PTM-D004"):
        db.record("pvs")
    with pytest.raises(DatabaseError, match="PTM-D006"):
        db.read_arrays("cells")
    (tmp_path / "www/a").write_bytes(b"2")
    with pytest.raises(DatabaseError, match="PTM-D006"):
        db.read("www/a", db.record("cells").outputs["www/a"])
    (tmp_path / "www/a").unlink()
    with pytest.raises(DatabaseError, match="PTM-D005"):
        db.read("www/a", db.record("cells").outputs["www/a"])
    assert db.first_damage(db.record("cells").outputs) == "www/a"
