"""A campus beside the database of the same model: `ptm simulate --campus`."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from ptmtools import schemas
from ptmtools.cli.main import main
from ptmtools.errors import InputError
from ptmtools.link import Conditions
from ptmtools.output.served import read_served
from ptmtools.scene import IngestOptions
from ptmtools.walk import read_walk
from ptmtools_lab.campus.options import CampusWalkOptions
from ptmtools_lab.campus.simulation import CAMPUS_POLICIES, measure_campus_walk, simulate_campus
from ptmtools_lab.campus.world import CampusWorld, prepare_campus
from ptmtools_lab.schemas import SIMULATION
from ptmtools_lab.world import World
from ptmtools_systems.campus import CampusOptions, make_campus
from tests.lab.test_recording import document, parsed

SLOW = Conditions(64_000.0)


@pytest.fixture(scope="module")
def rooms(two_rooms: Path) -> Path:
    """The two rooms as a campus; not to be changed."""
    made = two_rooms.parent / "campus"
    options = CampusOptions(lightmaps="none", small=0, faces=8)
    make_campus(two_rooms.parent / "model/two_rooms.obj", made, options, IngestOptions())
    return made


@pytest.fixture(scope="module")
def place(rooms: Path, two_rooms: Path, walk_file: Path) -> CampusWorld:
    return prepare_campus(rooms, read_walk(walk_file), read_served(two_rooms))


def test_the_same_walk(place: CampusWorld, world: World) -> None:
    assert np.array_equal(place.time, world.track.time)
    assert np.array_equal(place.eye, world.track.eye)
    run, measures = measure_campus_walk(place, world, CAMPUS_POLICIES["campus-medium"], SLOW, None)
    options = CampusWalkOptions("medium", "64k", lightmaps=False)
    alone = simulate_campus(place, options.qualities[0], options)
    assert np.array_equal(run.error, alone.error)
    assert (measures.e.mean, measures.bytes) == (alone.e, round(alone.body))
    assert measures.requests == alone.requests
    assert np.isnan([measures.rmse.mean, measures.missing.mean, measures.waste]).all()
    assert run.budget == alone.memory.max()


def test_what_presets_and_memory_are_worth(place: CampusWorld, world: World) -> None:
    link = Conditions(4e6)
    whole = {
        n: measure_campus_walk(place, world, p, link, None) for n, p in CAMPUS_POLICIES.items()
    }
    low, ultra, cached = (whole[f"campus-{n}"] for n in ("low", "ultra", "ultra-cached"))
    assert ultra[0].error[-1] < low[0].error[-1]
    assert low[1].bytes < ultra[1].bytes
    assert cached[1].bytes == 0
    assert ultra[1].final[0] is not None
    half = int(ultra[0].memory.max()) // 2
    short, measures = measure_campus_walk(place, world, CAMPUS_POLICIES["campus-ultra"], link, half)
    assert short.memory.max() <= half == short.budget
    assert measures.overruns == 0
    assert measures.e.mean > ultra[1].e.mean


def test_who_has_nothing(place: CampusWorld, world: World) -> None:
    """Over a link that brings nothing e stays what it is of nothing: no share is ever reached."""
    policy = CAMPUS_POLICIES["campus-low"]
    run, measures = measure_campus_walk(place, world, policy, Conditions(1.0), None)
    assert measures.final == (None, None, None)
    assert run.error.min() > 5


def test_the_table(
    two_rooms: Path,
    rooms: Path,
    walk_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    table, plot = tmp_path / "runs.csv", tmp_path / "plot.png"
    asked = ["simulate", str(two_rooms), "--walk", str(walk_file), "--campus", str(rooms)]
    asked += ["--policy", "campus-low,best", "--bandwidth", "512k", "--memory", "inf"]
    assert main([*asked, "--csv", str(table), "--plot", str(plot), "--measure", "rmse"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert any(line.startswith("The fully loaded campus has an e of ") for line in printed)
    best, low = (line.split() for line in printed[-2:])
    # Clients of the database come first.
    assert (best[0], low[0]) == ("best", "campus-low")
    assert low[5:8] == ["–"] * 3
    assert plot.read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader(table.read_text().splitlines()))
    campus = [row for row in rows if row["policy"] == "campus-low"]
    assert len(campus) == len(rows) / 2
    assert {row["rmse"] + row["missing"] + row["quality"] for row in campus} == {""}
    assert all(float(row["e"]) >= 0 for row in campus)

    assert main([*asked, "--json"]) == 0
    reported = schemas.read(capsys.readouterr().out.encode(), SIMULATION)
    best_run, low_run = reported["runs"]
    assert low_run["rmse"] is low_run["waste"] is low_run["details"]["quality"]["mean"] is None
    assert best_run["rmse"] > 0
    assert low_run["e"]["mean"] > 0
    assert f"{low_run['e']['mean']:.2f}" == low[1]


@pytest.mark.parametrize(
    ("words", "campus", "status", "said"),
    [
        (["--policy", "best,campus-low"], False, 2, "needs --campus"),
        (["--policy", "best"], True, 2, "add one to --policy"),
        (["--policy", "campus-low", "--strip", "s.png"], True, 2, "clients of DB"),
        (["--policy", "campus-low", "--lit"], True, 3, "shows nothing lit"),
        (["--policy", "campus-best"], True, 2, "is not one of"),
    ],
)
def test_refused(
    two_rooms: Path,
    rooms: Path,
    walk_file: Path,
    words: list[str],
    campus: bool,
    status: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    named = ["--campus", str(rooms)] if campus else []
    assert main(["simulate", str(two_rooms), "--walk", str(walk_file), *words, *named]) == status
    assert said in capsys.readouterr().err


def test_no_campus_there(
    two_rooms: Path, walk_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["--walk", str(walk_file), "--policy", "campus-low", "--campus", str(two_rooms)]
    assert main(["simulate", str(two_rooms), *asked]) == 3
    assert "PTM-I122" in capsys.readouterr().err


def test_a_recorded_walk(rooms: Path, world: World) -> None:
    with pytest.raises(InputError, match="PTM-I701"):
        prepare_campus(rooms, parsed(document(world.track, 2)))
