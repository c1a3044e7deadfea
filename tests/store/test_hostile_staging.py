"""Foreign content of a database before a write: no link is followed to read, write or remove.

Each case puts something in the place of a folder or file of a database, or of what an interrupted
run left, and opens it to write. Nothing outside may change, and nothing there may be opened.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from ptmtools.cli.main import main
from ptmtools.errors import PtmError
from ptmtools.store.layout import sha256
from ptmtools.store.manifest import Manifest, StageRecord
from ptmtools.store.writer import DatabaseWriter
from tests.conftest import files_below

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"
OLD, NEW, SECRET = b"old", b"new", b"secret"
NAME = "www/textures/a.ptm"


def record(*names: str, data: bytes = OLD) -> StageRecord:
    return StageRecord(1, {}, {}, {name: sha256(data) for name in names}, {}, [])


@pytest.fixture
def db(tmp_path: Path) -> Path:
    """A database of one texture, of which an interrupted commit holds another; beside it a folder
    that is none of its own."""
    folder = tmp_path / "db"
    for at, data in ((folder, OLD), (folder / ".ptm-new/textures", NEW)):
        (at / NAME).parent.mkdir(parents=True)
        (at / NAME).write_bytes(data)
        manifest = Manifest("a.obj", {"textures": record(NAME, "www/gone", data=data)})
        (at / "manifest.json").write_bytes(manifest.to_bytes())
    (folder / "www/gone").write_bytes(OLD)
    (tmp_path / "outside/textures").mkdir(parents=True)
    for name in ("a.ptm", "textures/a.ptm", "gone", "manifest.json", "journal"):
        (tmp_path / "outside" / name).write_bytes(SECRET)
    return folder


def written(db: Path, name: str = "www/textures/b.ptm") -> None:
    """Opens the database, which completes what was begun, and puts a file into it."""
    with DatabaseWriter.open_for_stage(db) as writer:
        transaction = writer.begin("textures")
        transaction.put(name, NEW)
        transaction.finish("ab" * 32, [name])
        transaction.commit({"textures": record(name, data=NEW)})


def replaced(db: Path, place: str, by: Callable[[Path], object]) -> None:
    at = db / place
    if at.is_dir() and not at.is_symlink():
        shutil.rmtree(at)
    elif os.path.lexists(at):
        at.unlink()
    at.parent.mkdir(parents=True, exist_ok=True)
    by(at)


def attempted(db: Path) -> bool:
    """Whether the database was written; if not, it was refused for a reason that fits."""
    try:
        written(db)
    except PtmError as error:
        if error.code not in ("PTM-O002", "PTM-O005", "PTM-D001", "PTM-D002", "PTM-D007"):
            raise
        return False
    return True


def test_a_commit_that_was_interrupted_is_completed(db: Path) -> None:
    written(db)
    assert (db / "www/textures/b.ptm").read_bytes() == NEW
    assert not (db / NAME).exists()
    assert not (db / ".ptm-new").exists()


#: Places of folders and files, in the database and in what is staged.
PLACES = [
    *("www", "www/textures", NAME, "www/gone"),
    *(".ptm-new", ".ptm-new/textures", ".ptm-new/textures/www", f".ptm-new/textures/{NAME}"),
    *(".ptm-new/textures/manifest.json", ".ptm-new/textures/journal", ".ptm-new/other"),
    ".ptm-lock",
]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("to", ["", "textures", "a.ptm", "nothing"])
def test_links(db: Path, place: str, to: str) -> None:
    outside = db.parent / "outside"
    before = files_below(outside)
    replaced(db, place, lambda at: at.symlink_to(outside / to))
    if attempted(db):
        for file in db.rglob("*"):
            assert not file.is_symlink() or file == db / place
    assert files_below(outside) == before


@pytest.mark.parametrize("place", PLACES)
def test_pipes(db: Path, place: str) -> None:
    """Opened for reading or writing, a pipe would be waited for without end."""
    replaced(db, place, lambda at: os.mkfifo(at))
    attempted(db)


@pytest.mark.parametrize(
    "name",
    ["../outside/a.ptm", "www/../../outside/a.ptm", "www/fifo", "/etc/passwd", "a\0b", "www"],
)
def test_a_journal_that_names_what_it_may_not(db: Path, name: str) -> None:
    shutil.rmtree(db / ".ptm-new/textures")
    (db / ".ptm-new/textures/www").mkdir(parents=True)
    os.mkfifo(db / ".ptm-new/textures/www/fifo")
    line = {"task": "ab" * 32, "outputs": {name: sha256(SECRET)}}
    (db / ".ptm-new/textures/journal").write_text(json.dumps(line) + "\n")
    with DatabaseWriter.open_for_stage(db) as writer:
        assert not writer.begin("textures").resume("ab" * 32)


@pytest.mark.parametrize(
    "name",
    ["../b.ptm", "/b.ptm", "www/../../b.ptm", "C:b.ptm", "www\\b.ptm", "www/" + "a/" * 70 + "b"],
)
def test_names_of_outputs(db: Path, name: str) -> None:
    before = sorted(db.parent.rglob("*"))
    with pytest.raises(PtmError, match=r"PTM-(O002|D002)"):
        written(db, name)
    assert {p for p in db.parent.rglob("*") if db not in p.parents} == {
        p for p in before if db not in p.parents
    }


QUICK = ("--backend", "embree", "-j", "1", "--light", "none")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a model and its database."""
    folder = tmp_path_factory.mktemp("built")
    shutil.copytree(TWO_ROOMS, folder / "model")
    build = ["-q", "build-scene", str(folder / "model/two_rooms.obj"), "-o", str(folder / "db")]
    assert main([*build, *QUICK, "--samples", "16"]) == 0
    return folder


@pytest.mark.parametrize("inner", ["www", "www/cells", "www/gltf", "www/hints"])
def test_links_where_cells_are_to_be_written(built: Path, tmp_path: Path, inner: str) -> None:
    """What an interrupted run has finished is kept, and with it whatever lies beside it."""
    shutil.copytree(built, tmp_path, dirs_exist_ok=True)
    begun = tmp_path / "db/.ptm-new/emit"
    begun.mkdir(parents=True)
    task = {"task": "ab" * 32, "outputs": {"www/x": "ab" * 32}}
    (begun / "journal").write_text(json.dumps(task) + "\n")
    (tmp_path / "outside").mkdir()
    (begun / inner).parent.mkdir(parents=True, exist_ok=True)
    (begun / inner).symlink_to(tmp_path / "outside")
    build = ["-q", "build-scene", str(tmp_path / "model/two_rooms.obj"), "-o", str(tmp_path / "db")]
    assert main([*build, *QUICK, "--samples", "32"]) == 4
    assert not list((tmp_path / "outside").iterdir())


def test_the_database_itself_may_be_reached_through_a_link(db: Path) -> None:
    link = db.parent / "link"
    link.symlink_to(db)
    written(link)
    assert (db / "www/textures/b.ptm").read_bytes() == NEW
