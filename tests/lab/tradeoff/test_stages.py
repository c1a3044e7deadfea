"""The experiments of real stages, through the command, on the two rooms."""

from __future__ import annotations

import io
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.console import Console
from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.scene.model import SourceImage
from ptmtools.texture import EncodeOptions
from ptmtools.visibility.options import PvsOptions
from ptmtools.visibility.pvs import compute_pvs
from ptmtools_lab.tradeoff.experiment import Setting
from ptmtools_lab.tradeoff.stages import (
    REFERENCE_SEED,
    CoverageTrade,
    textures_experiment,
    visibility_experiment,
)
from tests.conftest import files_below

TWO_ROOMS = Path(__file__).resolve().parents[3] / "sample_data/two_rooms/two_rooms.obj"
LITTLE = ("--cells-tried", "2", "--reference", "64")
SHORT = ("--quick", "--bandwidth", "4M", "--knob", "pvs")


@pytest.fixture(scope="module")
def db(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("trade") / "rooms.db"
    build_scene(TWO_ROOMS, path, AchOptions(preset="fast", backend="embree"))
    return path


def test_all_stages(db, tmp_path, capsys) -> None:
    """The walk, then one table for the whole pipeline; the database is as it was."""
    before = files_below(db)
    table, plot = tmp_path / "t.csv", tmp_path / "t.png"
    asked = ["tradeoff", str(db), *LITTLE, *SHORT, "--csv", str(table), "--plot", str(plot)]
    assert main([*asked, "--error", "0.05"]) == 0
    output = capsys.readouterr().out
    for stage in ("cells:", "pvs:", "ach:", "textures:"):
        assert output.count(stage) == 1
    assert output.startswith("--pvs fast instead of --pvs full ")
    assert output.count("cheapest with an error of at most 0.05") == 5
    assert files_below(db) == before
    rows = table.read_text().splitlines()
    assert {row.split(",")[0] for row in rows[1:]} == {"walk", "cells", "pvs", "ach", "textures"}
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


def test_the_cheapest_in_json(db, capsys) -> None:
    asked = ["tradeoff", str(db), "--stage", "ach", "--stage", "cells", *LITTLE, "--json"]
    assert main([*asked, "--error", "1e-9"]) == 0
    assert [t["cheapest"] for t in json.loads(capsys.readouterr().out)] == [None, None]
    assert main([*asked, "--error", "1e9"]) == 0
    for trade in json.loads(capsys.readouterr().out):
        assert trade["cheapest"] == trade["trials"][0]["setting"]["name"]


def no_constant(name: str) -> None:
    raise ValueError(name)


def test_cells_without_usable_points_give_json_and_rates(tmp_path, capsys) -> None:
    """Nothing in the rooms keeps a megametre from all surfaces: one point stands for each."""
    path = tmp_path / "tight.db"
    options = AchOptions(backend="embree", clearance=1e6), LightOptions("none")
    build_scene(TWO_ROOMS, path, *options)
    assert main(["tradeoff", str(path), "--stage", "ach", *LITTLE, "--json"]) == 0
    (trade,) = json.loads(capsys.readouterr().out, parse_constant=no_constant)
    assert trade["reference_error"] == 0
    works = {t["setting"]["name"]: t["measured"]["work"] for t in trade["trials"]}
    assert works["--preset fast"] == 6 * 4**2


def test_what_is_no_number_is_null_in_json(capsys) -> None:
    document = {"a": [math.nan, {"b": np.float64("inf")}], "c": (-math.inf, 1.5, True, None, "NaN")}
    Console().json(document)
    document = json.loads(capsys.readouterr().out, parse_constant=no_constant)
    assert document == {"a": [None, {"b": None}], "c": [None, 1.5, True, None, "NaN"]}


def test_a_database_of_lossy_textures() -> None:
    """The profile raw, which is always exact, is tried all the same."""
    noise = np.random.default_rng(0).integers(0, 256, (32, 32, 3), np.uint8)
    png = io.BytesIO()
    Image.fromarray(noise).save(png, "png")
    image = SourceImage("noise.png", "0" * 64, png.getvalue)
    exact, lossy = (textures_experiment([image], EncodeOptions(max_error=n)) for n in (0, 2))
    smaller = {
        setting.knobs["profile"]: lossy.measure(setting).work < exact.measure(setting).work
        for setting in lossy.settings
    }
    assert smaller.pop("paper", False) is False  # needs an optional component
    assert smaller == {"raw": False, "fast": True, "small": True}


@pytest.mark.parametrize("option", ["--csv", "--plot"])
@pytest.mark.parametrize("file", ["absent/x", "file/x", "folder"])
def test_what_cannot_be_written_is_refused_before_anything_runs(
    db, tmp_path, capsys, monkeypatch, option, file
) -> None:
    monkeypatch.setattr("ptmtools_lab.cli.tradeoff.run", pytest.fail)
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    assert main(["tradeoff", str(db), option, str(tmp_path / file), "--force"]) == 4
    assert "PTM-O002" in capsys.readouterr().err


def test_a_plot_without_matplotlib_is_refused_before_anything_runs(
    db, tmp_path, capsys, monkeypatch
) -> None:
    monkeypatch.setattr("ptmtools_lab.cli.tradeoff.run", pytest.fail)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert main(["tradeoff", str(db), "--plot", str(tmp_path / "t.png")]) == 6
    assert "PTM-M100" in capsys.readouterr().err


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


def test_hints_of_some_cells_are_compared_with_their_own(room_row) -> None:
    scene, cells = room_row(4)
    options = AchOptions(backend="embree", samples=64)
    trade = CoverageTrade(scene, cells, compute_pvs(cells), options, 4, 64)
    some, _, _ = trade.hints(options, [3, 1])
    every, _, _ = trade.hints(options)
    assert list(every) == [0, 1, 2, 3]
    assert trade.errors(some).tolist() == trade.errors(every)[[3, 1]].tolist()
    with pytest.raises(KeyError):
        trade.errors({9: every[0]})


def test_only_settings_of_fewer_points_than_the_reference(room_row) -> None:
    scene, cells = room_row(3)
    given = scene, cells, compute_pvs(cells), AchOptions(backend="embree"), 1
    few = {s.name: s for s in CoverageTrade(*given, 64).settings()}
    assert "--preset fast" in few
    assert "--preset default" not in few
    assert max(s.knobs.get("samples", 0) for s in few.values()) == 32
    every = [s.name for s in CoverageTrade(*given).settings()]
    assert "--preset high" in every
    assert any("--samples 2048" in name for name in every)


@pytest.mark.parametrize("seed", [0, REFERENCE_SEED])
def test_the_reference_has_a_scramble_of_its_own(room_row, seed) -> None:
    scene, cells = room_row(4)
    options = AchOptions(backend="embree", seed=seed)
    trade = CoverageTrade(scene, cells, compute_pvs(cells), options, 2, 64)
    same = trade.measure(Setting("", {"samples": 64, "face": 4, "placement": "sobol"}))
    assert same.error > 0


@pytest.mark.parametrize("built", [PvsOptions(budget=7), PvsOptions(method="fast")])
def test_visibility_is_tried_alike_whatever_the_database_was_built_with(room_row, built) -> None:
    _, cells = room_row(4)
    asked: list[PvsOptions] = []

    def watched(cells, options):
        asked.append(options)
        return compute_pvs(cells, options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ptmtools_lab.tradeoff.stages.compute_pvs", watched)
        trade = visibility_experiment(cells, built.budget)
        assert (asked[0].method, asked[0].budget) == ("full", 2_000_000)
        asked.clear()
        settings = trade.settings
        for setting in settings:
            trade.measure(setting)
    budgets = [s.knobs["budget"] for s in settings if s.family == "budget"]
    assert budgets == sorted({200, 2_000, 20_000, 200_000, built.budget})
    for setting, options in zip(settings, asked, strict=True):
        assert f"--pvs {options.method}" in setting.name
        assert options.method != "full" or f"--pvs-budget {options.budget}" in setting.name


def test_sampled_visibility_lacks_pairs_and_is_never_the_best(room_row) -> None:
    _, cells = room_row(6)
    trade = visibility_experiment(cells, PvsOptions().budget)
    settings = {s.name: s for s in trade.settings}
    sampled = [s for name, s in settings.items() if "sampled" in name]
    assert sampled
    assert not any(s.sound for s in sampled)
    exact = trade.measure(settings["--pvs full --pvs-budget 200000"])
    assert exact.error == exact.more["missing"] == 0
    loose = trade.measure(Setting("", {"method": "full", "budget": 0}))
    assert loose.more["missing"] == 0
    one_line = trade.measure(Setting("", {"method": "sampled", "lines": 1}))
    assert np.isclose(one_line.error, one_line.more["missing"])
