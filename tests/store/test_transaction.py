"""A commit that is killed at any change of a name on the disk leaves the old state or the new."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from ptmtools.errors import OutputError
from ptmtools.store import lists
from ptmtools.store.layout import LISTS, MANIFEST, STAGING
from ptmtools.store.manifest import StageRecord
from ptmtools.store.transaction import finished_tasks
from ptmtools.store.writer import DatabaseWriter
from tests.conftest import files_below

ROOT = Path(__file__).resolve().parents[2]
#: Replaces the outputs of one stage: one stays as it is, one changes, one goes, one is new. Each
#: database is a copy; its process is a fork of one that has imported everything.
UPDATE = """
import os, shutil, sys
from pathlib import Path
sys.path.insert(0, {benchmarks!r})
from kills import dying
from ptmtools.store import lists
from ptmtools.store.manifest import StageRecord
from ptmtools.store.writer import DatabaseWriter

lists.INLINE, lists.MEAN = {limits!r}

for n in range(1, 100):
    db = shutil.copytree({db!r}, f"{{{db!r}}}-{{n}}")
    child = os.fork()
    if not child:
        dying(n, Path(db))
        with DatabaseWriter.open_for_model(db, "m.obj") as writer:
            staged = writer.begin("some")
            for name, data in {files!r}.items():
                staged.put(name, data)
            staged.commit({{"cells": StageRecord(2, {{}}, {{}}, staged.pending())}})
        break
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(status, flush=True)
    if status == 0:
        break
"""
BEFORE = {"www/same": b"0", "www/a": b"1", "www/gone/x": b"1"}
AFTER = {"www/same": b"0", "www/a": b"2", "www/deep/new": b"2"}


def write(db: Path, files: dict[str, bytes], recipe: int) -> None:
    with DatabaseWriter.open_for_model(db, "m.obj") as writer:
        staged = writer.begin("some")
        for name, data in files.items():
            staged.put(name, data)
        staged.commit({"cells": StageRecord(recipe, {}, {}, staged.pending())})


def stamp(file: Path) -> tuple[int, int]:
    """Which file it is, and when it was last changed; looking at it changes neither."""
    actual = file.stat()
    return actual.st_ino, actual.st_ctime_ns


def without(files: dict[str, bytes]) -> dict[str, bytes]:
    return {n: data for n, data in files.items() if n != MANIFEST and not n.startswith(LISTS)}


@pytest.mark.parametrize("limits", [(lists.INLINE, lists.MEAN), (0, 2), (2, 1)])
def test_killed_at_any_change_of_a_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limits: tuple[int, int]
) -> None:
    """With the outputs in the manifest, in lists of several files, and of one each."""
    for name, value in zip(("INLINE", "MEAN"), limits, strict=True):
        monkeypatch.setattr(lists, name, value)
    first, second = tmp_path / "first", tmp_path / "second"
    write(first, BEFORE, 1)
    write(second, BEFORE, 1)
    write(second, AFTER, 2)
    before, after = files_below(first), files_below(second)
    assert without(after) == AFTER
    assert bool(list(second.glob("stages/lists/*"))) == (limits[0] < len(AFTER))
    template = tmp_path / "db"
    write(template, BEFORE, 1)
    (template / "www/mine.txt").write_text("mine")
    script = UPDATE.format(
        benchmarks=str(ROOT / "benchmarks"), db=str(template), files=AFTER, limits=limits
    )
    command = [sys.executable, "-c", script]
    printed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    *killed, end = map(int, printed.split())
    assert set(killed) == {-signal.SIGKILL}
    assert end == 0, "it never came to its end"
    outcomes = []
    for n in range(1, len(killed) + 1):
        db = tmp_path / f"db-{n}"
        with DatabaseWriter.open_for_model(db, "m.obj"):
            pass
        actual = files_below(db)
        assert actual.pop("www/mine.txt") == b"mine"
        assert actual in (before, after), n
        outcomes.append(actual == after)
        write(db, AFTER, 2)
        assert files_below(db) == {**after, "www/mine.txt": b"mine"}, n
    # First the old state, from the commit on the new one.
    assert outcomes == sorted(outcomes)
    assert False in outcomes
    assert True in outcomes


def test_finished_tasks_are_taken_over(tmp_path: Path) -> None:
    write(tmp_path, BEFORE, 1)

    def stopped() -> None:
        with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
            staged = writer.begin("textures")
            for name in ("www/x", "www/y"):
                staged.put(name, name.encode())
            staged.finish("x", ["www/x"])
            staged.finish("y", ["www/y"])
            staged.put("www/z", b"z")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    with (tmp_path / STAGING / "textures/journal").open("a") as journal:
        journal.write('{"task": "z", "outp')
    (tmp_path / STAGING / "textures/www/y").write_bytes(b"changed")
    assert finished_tasks(tmp_path) == 2

    with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
        staged = writer.begin("textures")
        assert staged.resume("x")
        assert not staged.resume("y")
        assert not staged.resume("z")
        staged.commit({"textures": StageRecord(1, {}, {}, staged.pending())})
    assert not (tmp_path / STAGING).exists()
    assert (tmp_path / "www/x").read_bytes() == b"www/x"
    assert not (tmp_path / "www/z").exists()


def test_what_stands_is_not_written_again(tmp_path: Path) -> None:
    write(tmp_path, BEFORE, 1)
    before = stamp(tmp_path / "www/same")
    write(tmp_path, {**AFTER, "www/adopted": b"3"}, 2)
    assert stamp(tmp_path / "www/same") == before
    with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
        before = stamp(tmp_path / "www/adopted")
        staged = writer.begin("some")
        (staged.folder / "www").mkdir(parents=True)
        (staged.folder / "www/adopted").write_bytes(b"3")
        staged.take("www/adopted", staged.folder / "www/adopted")
        staged.commit({"cells": StageRecord(3, {}, {}, staged.pending())})
    assert stamp(tmp_path / "www/adopted") == before


def test_a_commit_leaves_the_folder_of_those_that_are_beginning(tmp_path: Path) -> None:
    with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
        staged = writer.begin("one")
        staged.put("www/a", b"1")
        staged.commit({"cells": StageRecord(1, {}, {}, staged.pending())})
        assert (tmp_path / STAGING).is_dir()
    assert not (tmp_path / STAGING).exists()


@pytest.mark.parametrize("link", ["www", "stages", STAGING])
def test_links_are_not_followed(tmp_path: Path, link: str) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    db = tmp_path / "db"
    db.mkdir()
    (db / link).symlink_to(elsewhere)
    with pytest.raises(OutputError, match="PTM-O005"):
        write_anyhow(db)
    assert list(elsewhere.iterdir()) == []


def write_anyhow(db: Path) -> None:
    with DatabaseWriter.open_for_model(db, "m.obj", force=True) as writer:
        staged = writer.begin("some")
        staged.put("www/a", b"1")
        staged.put("stages/b", b"1")
        staged.commit({"cells": StageRecord(1, {}, {}, staged.pending())})
