"""`ptm simulate`, from a database to its table, documents and pictures."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from ptmtools import schemas
from ptmtools.link import Conditions
from ptmtools.walk import Walk, walk_text
from ptmtools_lab.comparing import SimulateOptions, play
from ptmtools_lab.forms import PTM
from ptmtools_lab.policies import POLICIES, PolicyEntry
from ptmtools_lab.report import COLUMNS, table
from ptmtools_lab.schemas import SIMULATION
from ptmtools_lab.simulation import simulate
from ptmtools_lab.world import World
from tests.lab.conftest import Ptm

ALL = [p for p in POLICIES.values() if p.needs is None and p.form == PTM]


def test_json_and_csv(ptm: Ptm, two_rooms: Path, walk_file: Path, tmp_path: Path) -> None:
    words = [
        *("simulate", two_rooms, "--walk", walk_file, "--policy", "paper,ach,oracle"),
        *("--bandwidth", "56k,inf", "--memory", "10%,inf", "--json", "--csv"),
    ]
    done = ptm(*words, tmp_path / "frames.csv")
    assert (done.status, done.err) == (0, "")
    document = schemas.read(done.out.encode(), SIMULATION)
    runs = document["runs"]
    assert len(runs) == 3 * 2 * 2
    assert [run["policy"] for run in runs[:3]] == ["paper", "ach", "oracle"]
    assert [run["bandwidth"] for run in runs] == [56000] * 6 + [None] * 6
    whole = document["textureMemory"]
    assert {run["memory"] for run in runs} == {whole // 10, whole}
    assert not any(run["overruns"] for run in runs)
    assert max(run["e"]["mean"] for run in runs) > 1

    with (tmp_path / "frames.csv").open() as stream:
        header, *rows = csv.reader(stream)
    assert tuple(header) == COLUMNS
    frames = document["walks"][0]["frames"]
    assert len(rows) == frames * len(runs)
    e = defaultdict(list)
    for row in rows:
        entry = dict(zip(header, row, strict=True))
        e[entry["policy"], entry["bandwidth"], entry["memory"]].append(float(entry["e"]))
    for run in runs:
        rate = "" if run["bandwidth"] is None else f"{run['bandwidth']:g}"
        mean = np.mean(e[run["policy"], rate, str(run["memory"])])
        assert mean == pytest.approx(run["e"]["mean"], rel=1e-4, abs=1e-5)

    again = ptm(*words, tmp_path / "again.csv")
    assert again.out == done.out
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "frames.csv").read_bytes()


def test_the_table(ptm: Ptm, two_rooms: Path, walk_file: Path, tmp_path: Path) -> None:
    words = ["simulate", two_rooms, "--bandwidth", "56k,4M", "--memory", "10%", "--policy"]
    pictures = ["--frames", tmp_path / "f", "--every", "20"]
    pictures += ["--strip", tmp_path / "s.png", "--plot", tmp_path / "p.png"]
    done = ptm(*words, "paper,screen", "--walk", walk_file, *pictures)
    assert (done.status, done.err) == (0, "")
    lines = done.out.splitlines()
    assert [line.split()[0] for line in lines if line.startswith("  ")] == [
        *("policy", "paper", "screen")
    ] * 2
    assert sum("kbit/s" in line or "Mbit/s" in line for line in lines) == 2
    assert "of walks" not in done.out
    assert sorted(file.name for file in (tmp_path / "f").iterdir()) == [
        "00000.0.png",
        "00020.0.png",
    ]
    for picture in ("s.png", "p.png"):
        assert (tmp_path / picture).read_bytes().startswith(b"\x89PNG")


def test_walks_are_made_by_seed(ptm: Ptm, two_rooms: Path) -> None:
    words = ["simulate", two_rooms, "--bandwidth", "56k", "--memory", "10%", "--policy", "ach"]
    document = json.loads(ptm(*words, "--seed", "1", "--seed", "2", "--json").out)
    assert [walk["name"] for walk in document["walks"]] == ["seed 1", "seed 2"]
    assert [walk["seconds"] for walk in document["walks"]] == [150, 150]
    e = [run["e"]["mean"] for run in document["runs"]]
    assert e[0] != e[1]


def test_means_over_walks_come_with_their_spread(world: World) -> None:
    worlds = {"walking": world, "standing": world.standing(9)}
    options = SimulateOptions(policy="ach,oracle", bandwidth="56k", memory="inf")
    played = play(worlds, options)
    rows = [line.split() for line in table(played, worlds)[-2:]]
    for row, (walking, standing) in zip(rows, [played[:2], played[2:]], strict=True):
        assert (walking.walk, standing.walk) == ("walking", "standing")
        e = [p.measures.e.mean for p in (walking, standing)]
        assert row[0] == walking.run.policy == standing.run.policy
        assert row[1:3] == [f"{np.mean(e):.2f}", f"{min(e):.2f}–{max(e):.2f}"]


def test_the_same_twice_is_run_once(world: World) -> None:
    """However it is written: two rows of a table would else be taken for two walks."""
    options = SimulateOptions(policy="ach,ach", bandwidth="4M,4000k,4.0M,inf", memory="10%,10%")
    assert [c.bandwidth for c in options.links()] == [4_000_000, None]
    assert len(play({"": world}, options)) == 2


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--policy", "paper,psychic"], "PTM-U001"),
        (["--bandwidth", "56x"], "PTM-I111"),
        (["--memory", "0"], "PTM-I111"),
        (["--latency", "soon"], "PTM-I111"),
        (["--overhead", "-1"], "PTM-I111"),
        (["--policy", "ach-texture"], "PTM-I701"),
        (["--policy", "gpuii"], "PTM-I701"),
        (["--walk", "nowhere.json"], "PTM-I122"),
        (["--trace", "nowhere.json"], "PTM-I122"),
        (["--csv", "nowhere/frames.csv"], "PTM-O002"),
        (["--walk", "walk.json", "--seed", "2"], "PTM-U001"),
        (["--csv", "both", "--plot", "./both"], "PTM-U001"),
    ],
)
def test_what_is_wrong_is_said(ptm: Ptm, two_rooms: Path, words: list[str], code: str) -> None:
    done = ptm("simulate", two_rooms, *words)
    assert done.status != 0
    assert (done.out, done.err.count("\n")) == ("", 1)
    assert f"[{code}]" in done.err


def test_a_served_folder_needs_a_walk(ptm: Ptm, two_rooms: Path, walk_file: Path) -> None:
    bare = ptm("simulate", two_rooms / "www")
    assert bare.status == 3
    assert "--walk" in bare.err
    assert "[PTM-I701]" in bare.err
    words = ["--policy", "ach", "--bandwidth", "4M", "--memory", "inf", "--json"]
    with_walk = [
        json.loads(ptm("simulate", folder, "--walk", walk_file, *words).out)["runs"]
        for folder in (two_rooms, two_rooms / "www")
    ]
    assert with_walk[0] == with_walk[1]


def test_a_walk_of_another_model(
    ptm: Ptm, two_rooms: Path, elsewhere: Walk, tmp_path: Path
) -> None:
    file = tmp_path / "walk.json"
    file.write_text(walk_text(elsewhere))
    done = ptm("simulate", two_rooms, "--walk", file)
    assert done.status == 3
    assert "[PTM-I700]" in done.err


def test_nothing_is_overwritten(ptm: Ptm, two_rooms: Path, walk_file: Path, tmp_path: Path) -> None:
    words = ["simulate", two_rooms, "--walk", walk_file, "--policy", "ach", "--memory", "inf"]
    file = tmp_path / "frames.csv"
    file.write_text("mine")
    assert "[PTM-O001]" in ptm(*words, "--csv", file).err
    assert "[PTM-O001]" in ptm(*words, "--frames", tmp_path).err
    for folder in (file, file / "frames"):
        refused = ptm("simulate", "nowhere", "--frames", folder).err
        assert "frames.csv is not a folder" in refused
    assert file.read_text() == "mine"
    assert ptm(*words, "--csv", file, "--force").status == 0
    assert file.read_text().startswith("policy,")


def test_the_link_may_change(ptm: Ptm, two_rooms: Path, walk_file: Path, tmp_path: Path) -> None:
    trace = tmp_path / "trace.csv"
    trace.write_text("seconds,bandwidth\n15,0\n60,\n")
    words = ["simulate", two_rooms, "--walk", walk_file, "--policy", "ach", "--bandwidth", "4M"]
    words += ["--memory", "inf", "--json"]
    free, held_up = (
        json.loads(ptm(*words, *more).out)["runs"][0] for more in ([], ["--trace", trace])
    )
    assert (free["traced"], held_up["traced"]) == (False, True)
    assert held_up["stalled"] > 14 > free["stalled"]


def test_the_paper_counts_three_bytes(ptm: Ptm, two_rooms: Path, walk_file: Path) -> None:
    words = ["simulate", two_rooms, "--walk", walk_file, "--policy", "ach", "--bandwidth", "inf"]
    words += ["--memory", "50%", "--json"]
    ours, papers = (
        json.loads(ptm(*words, *more).out)["textureMemory"] for more in ([], ["--paper-bytes"])
    )
    assert papers == pytest.approx(ours * 3 / 4)


@pytest.mark.parametrize("policy", ALL, ids=[policy.name for policy in ALL])
def test_without_limits_all_ends_well(world: World, policy: PolicyEntry) -> None:
    stays = world.standing(20)
    # The paper's client shares memory out by coverage: it takes more than all textures.
    run = simulate(stays, policy, Conditions(None), 100 * stays.catalogue.whole)
    assert run.error[0] > 1
    assert run.error[-1] == 0
    assert run.missing[-1] == 0


def test_the_parameters_of_the_paper(two_rooms: Path, walk_file: Path, ptm: Ptm) -> None:
    words = ["simulate", two_rooms, "--walk", walk_file, "--policy", "paper", "--bandwidth", "1M"]
    plain = json.loads(ptm(*words, "--memory", "20%", "--json").out)
    assert plain["paper"] == {
        "deltaT": 0.5,
        "deltaTStatic": 20,
        "staticMemory": None,
        "staticAfter": 1,
    }
    given = ["--delta-t", "0", "--delta-t-static", "0", "--static-memory", "inf"]
    own = schemas.read(ptm(*words, "--memory", "20%", *given, "--json").out.encode(), SIMULATION)
    assert own["paper"]["staticMemory"] == "inf"
    (first,), (second,) = plain["runs"], own["runs"]
    assert first["uploadedBytes"] > second["uploadedBytes"] == 0
    assert second["overruns"] == 0
    assert ptm(*words, *given).out.startswith("policy paper with --delta-t 0 --delta-t-static 0 ")
    assert "[PTM-U001]" in ptm(*words, "--policy", "best", "--delta-t", "1").err
    assert "[PTM-I111]" in ptm(*words, "--static-after", "-1").err
    assert "[PTM-I111]" in ptm(*words, "--static-memory", "much").err
