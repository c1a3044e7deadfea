"""`ptm walk-campus` as a user runs it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools import schemas
from ptmtools.cli.main import main
from ptmtools.walk import Walk, walk_text
from ptmtools_lab.schemas import CAMPUS_WALK


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> str:
    eye = np.array([[-20.0, 1.6, 12], [20, 1.6, 12]])
    file = tmp_path_factory.mktemp("walk") / "walk.json"
    look = np.tile([0.0, 0, -1], (2, 1))
    file.write_text(walk_text(Walk(np.array([0.0, 40]), eye, look, 1.0472, 1.7778)))
    return str(file)


def test_all_presets(folder: Path, walk: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["walk-campus", str(folder), "--walk", walk, "--every", "50"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "40 m in 40 s, 4 objects, 4Mbit/s, 100ms"
    assert printed[2] == "|  | Low | Medium | High | Ultra | Ultra cached |"
    assert [line.split(" | ")[0] for line in printed[-2:]] == ["| 30", "| 40"]


def test_some_objects(folder: Path, walk: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["walk-campus", str(folder), "--walk", walk, "--only", "H*", "--every", "0"]) == 0
    assert capsys.readouterr().out.startswith("40 m in 40 s, 2 objects, ")


def test_options_and_json(folder: Path, walk: str, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--preset", "low,ultra-cached", "--bandwidth", "512k", "--nearest", "1", "--memory",
             "1MiB", "--threads", "2", "--no-lightmaps", "--every", "0", "--json"]  # fmt: skip
    assert main(["walk-campus", str(folder), "--walk", walk, *asked]) == 0
    reported = schemas.read(capsys.readouterr().out.encode(), CAMPUS_WALK)
    low, cached = reported["runs"]
    assert (low["preset"], cached["preset"]) == ("Low", "Ultra cached")
    assert (low["bandwidth"], low["e"], cached["bytes"]) == (512_000, None, 0)
    assert low["bytes"] > 0
    assert max(low["memory"]["most"], cached["memory"]["most"]) <= 1 << 20


def test_one_frame_and_more_near_than_there_are(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    eye, look = np.array([[-20.0, 1.6, 12]] * 2), np.array([[0.0, 0, -1]] * 2)
    walk = tmp_path / "walk.json"
    walk.write_text(walk_text(Walk(np.array([0.0, 0.1]), eye, look, 1.0472, 1.7778)))
    asked = ["--walk", str(walk), "--nearest", "9" * 30, "--preset", "low", "--every", "0"]
    assert main(["walk-campus", str(folder), *asked, "--json"]) == 0
    (run,) = schemas.read(capsys.readouterr().out.encode(), CAMPUS_WALK)["runs"]
    assert (run["idle"], run["late"]) == (0, 1)


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        (["--memory", "10%"], "PTM-I111"),
        (["--bandwidth", "fast"], "PTM-I111"),
        (["--only", "Castle"], "PTM-I302"),
        (["--protocol", "h3"], ""),
        (["--preset", "best"], ""),
    ],
)
def test_refused(
    folder: Path, walk: str, asked: list[str], code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["walk-campus", str(folder), "--walk", walk, *asked]) == (3 if code else 2)
    assert code in capsys.readouterr().err


def test_no_campus(walk: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["walk-campus", str(tmp_path), "--walk", walk]) == 3
    assert "PTM-I122" in capsys.readouterr().err
