"""`ptm path` as a user runs it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ptmtools.cli.main import main
from ptmtools.walk import read_walk
from tests.conftest import files_below

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj"


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of which only scene and cells are there."""
    path = tmp_path_factory.mktemp("walked") / "rooms.db"
    assert main(["-q", "cells", str(TWO_ROOMS), "-o", str(path)]) == 0
    return path


def test_a_walk(db: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = files_below(db)
    files = [tmp_path / name for name in ("a.json", "b.json")]
    for file in files:
        assert main(["path", str(db), "-o", str(file)]) == 0
    printed = capsys.readouterr().out.splitlines()
    walk = read_walk(files[0])
    assert printed[0].startswith(f"{files[0]}: 2 of 2 rooms, {walk.length:.0f} m in ")
    assert files[0].read_bytes() == files[1].read_bytes()
    assert files_below(db) == before


def test_a_walk_that_is_too_short_for_all_rooms(
    db: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["path", str(db), "-o", str(tmp_path / "walk.json"), "--duration", "1"]) == 0
    printed = capsys.readouterr().out
    assert "1 of 2 rooms" in printed
    assert "a longer --duration visits 1 more room\n" in printed


def test_options_and_json(db: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "walk.json"
    asked = ["--seed", "3", "--duration", "12", "--rate", "20", "--speed", "1", "--json"]
    assert main(["path", str(db), "-o", str(file), *asked]) == 0
    reported = json.loads(capsys.readouterr().out)
    walk = read_walk(file)
    assert (
        (reported["samples"], reported["duration"])
        == (241, 12.0)
        == (len(walk.time), walk.duration)
    )
    assert reported["length"] == pytest.approx(walk.length, abs=1e-3)
    assert (reported["rooms"], reported["unreachable"]) == (2, [])
    assert 1 <= len(reported["visited"]) <= 2


def test_what_is_there_is_kept(
    db: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "walk.json"
    file.write_text("mine")
    assert main(["path", str(db), "-o", str(file)]) == 4
    assert "PTM-O001" in capsys.readouterr().err
    assert file.read_text() == "mine"
    assert main(["path", str(db), "-o", str(file), "--force"]) == 0
    assert read_walk(file).duration > 5


@pytest.mark.parametrize(
    ("words", "status", "code"),
    [
        (["--speed", "0"], 3, "PTM-I111"),
        (["--duration", "1e9"], 3, "PTM-I111"),
        (["--rate", "x"], 2, "PTM-U001"),
    ],
)
def test_wrong_options(
    db: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    status: int,
    code: str,
) -> None:
    assert main(["path", str(db), "-o", str(tmp_path / "w.json"), *words]) == status
    assert code in capsys.readouterr().err
    assert not (tmp_path / "w.json").exists()


def test_no_database(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["path", str(tmp_path / "gone.db"), "-o", str(tmp_path / "w.json")]) == 5
    assert "PTM-D001" in capsys.readouterr().err


def test_rooms_that_cannot_be_reached(
    db: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Are told, by number."""
    from ptmtools_lab.path.ground import WalkObstacles

    crossed = WalkObstacles.blocks

    def walled_up(self, start, end):  # type: ignore[no-untyped-def]
        return crossed(self, start, end) | (start[:, 0] * end[:, 0] <= 0)

    monkeypatch.setattr(WalkObstacles, "blocks", walled_up)
    assert main(["path", str(db), "-o", str(tmp_path / "w.json")]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert "1 of 2 rooms" in first
    assert second.startswith("not reachable on foot, at eye height: 1 room, cell ")


def test_a_walk_in_the_plan(db: Path, tmp_path: Path) -> None:
    walk, plain, plan = (tmp_path / name for name in ("w.json", "plain.png", "plan.png"))
    assert main(["-q", "path", str(db), "-o", str(walk)]) == 0
    assert main(["-q", "plot", str(db), "-o", str(plain)]) == 0
    assert main(["-q", "plot", str(db), "-o", str(plan), "--walk", str(walk)]) == 0
    assert plan.read_bytes() != plain.read_bytes()
    assert main(["plot", str(db), "-o", str(plan), "--force", "--walk", str(plain)]) == 3
