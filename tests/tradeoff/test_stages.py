"""The experiments of real stages, through the command, on the two rooms."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.pipeline import BuildOptions, build_scene
from ptmtools.tradeoff.experiment import Setting
from ptmtools.tradeoff.hints import CoverageTrade
from ptmtools.tradeoff.visibility import VisibilityTrade
from ptmtools.visibility.pvs import PvsOptions, compute_pvs

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj"
LITTLE = ("--cells-tried", "2", "--reference", "64")


@pytest.fixture(scope="module")
def db(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("trade") / "rooms.db"
    build_scene(TWO_ROOMS, path, BuildOptions(ach=AchOptions(preset="fast", backend="embree")))
    return path


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_all_stages(db, tmp_path, capsys) -> None:
    """One table for the whole pipeline; the database is as it was."""
    before = contents(db)
    table, plot = tmp_path / "t.csv", tmp_path / "t.png"
    asked = ["tradeoff", str(db), *LITTLE, "--csv", str(table), "--plot", str(plot)]
    assert main([*asked, "--error", "0.05"]) == 0
    told = capsys.readouterr().out
    for stage in ("cells:", "pvs:", "ach:", "textures:"):
        assert told.count(stage) == 1
    assert told.count("cheapest for an error of at most 0.05") == 4
    assert contents(db) == before
    rows = table.read_text().splitlines()
    assert {row.split(",")[0] for row in rows[1:]} == {"cells", "pvs", "ach", "textures"}
    with Image.open(plot) as picture:
        assert picture.width > 400
    assert main(asked) == 4, "what is there is not written over"


def test_one_stage_as_json(db, capsys) -> None:
    assert main(["tradeoff", str(db), "--stage", "pvs", "--json"]) == 0
    (trade,) = json.loads(capsys.readouterr().out)
    assert trade["stage"] == "pvs"
    full = [t for t in trade["trials"] if "full" in t["setting"]["name"]]
    assert full
    assert full[-1]["measured"]["error"] == 0


def test_a_database_without_a_stage_says_which(tmp_path, capsys) -> None:
    assert main(["cells", str(TWO_ROOMS), "-o", str(tmp_path / "a.db")]) == 0
    assert main(["tradeoff", str(tmp_path / "a.db"), "--stage", "ach"]) == 5
    assert "PTM-D004" in capsys.readouterr().err


def test_hints_by_more_points_are_nearer_to_the_reference(room_row) -> None:
    scene, cells = room_row(4)
    pvs = compute_pvs(cells)
    trade = CoverageTrade(scene, cells, pvs, AchOptions(backend="embree"), 3, 2048)
    assert trade.tried.tolist() == [0, 1, 3]
    few, many = (
        trade.measure(Setting("", {"samples": n, "face": 8, "placement": "sobol"}))
        for n in (8, 512)
    )
    assert many.error < few.error / 4
    assert many.work == 64 * few.work == 512 * 6 * 64
    assert few.error <= few.more["p95"] <= few.worst
    assert 0 < trade.reference_error < 0.01


def test_sampled_visibility_lacks_pairs_and_is_never_the_best(room_row) -> None:
    _, cells = room_row(6)
    trade = VisibilityTrade(cells, PvsOptions())
    settings = {s.name: s for s in trade.settings()}
    sampled = [s for name, s in settings.items() if "sampled" in name]
    assert sampled
    assert not any(s.sound for s in sampled)
    exact = trade.measure(settings["--pvs full --pvs-budget 200000"])
    assert exact.error == exact.more["missing"] == 0
    loose = trade.measure(Setting("", {"method": "full", "budget": 0}))
    assert loose.more["missing"] == 0
    one_line = trade.measure(Setting("", {"method": "sampled", "lines": 1}))
    assert np.isclose(one_line.error, one_line.more["missing"])
