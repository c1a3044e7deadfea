"""Prices of options for a visitor: sentences, tables, and a real run on two rooms."""

from __future__ import annotations

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import InputError, LimitError
from ptmtools.light.options import LightOptions
from ptmtools.output import EmitOptions
from ptmtools.output.served import read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene, run_stage
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import CELLS, EMIT, LIGHT, STAGES, TEXTURES
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.walk import Walk, read_walk
from ptmtools_lab.comparing import play
from ptmtools_lab.path.making import path_through
from ptmtools_lab.path.options import PathOptions
from ptmtools_lab.tables import Drawing, look
from ptmtools_lab.tradeoff.experiment import Deadline
from ptmtools_lab.tradeoff.knobs import (
    KNOBS,
    KnobSetting,
    build_again,
    concerned_stages,
    own_options,
    settings,
    temporary_copy,
)
from ptmtools_lab.tradeoff.report import (
    representative,
    sentence,
    sentences,
    settings_table as table,
    trades,
)
from ptmtools_lab.tradeoff.walk import (
    WalkOptions,
    WalkOutcome,
    WalkTrade,
    WalkTrial,
    begins_with,
    by_turns,
    comparison_world,
    needs_of,
    require_prices,
    try_settings,
)
from ptmtools_lab.world import World, prepare
from tests.conftest import files_below

TWO_ROOMS = Path(__file__).resolve().parents[3] / "sample_data/two_rooms/two_rooms.obj"


@pytest.fixture(scope="module")
def db(tmp_path_factory) -> Path:
    """The two rooms, with noise on the walls, which no codec keeps for nothing, and no light."""
    folder = tmp_path_factory.mktemp("walk")
    shutil.copytree(TWO_ROOMS.parent, folder / "model")
    random = np.random.default_rng(0)
    for image in sorted((folder / "model").glob("*.png")):
        Image.fromarray(random.integers(0, 256, (64, 64, 3), np.uint8)).save(image)
    options = AchOptions(preset="fast", backend="embree"), EmitOptions(), LightOptions("none")
    build_scene(folder / "model" / TWO_ROOMS.name, folder / "rooms.db", *options, workers=1)
    return folder / "rooms.db"


@pytest.fixture(scope="module")
def walk(db) -> Walk:
    return path_through(Artifacts(open_database(db)), PathOptions(duration=10.0)).walk


@pytest.fixture(scope="module")
def original(db, walk) -> World:
    return prepare(read_served(db), walk)


def built(db: Path, **changed):
    """What is served of a copy with other options of its textures."""
    own = own_options(Artifacts(open_database(db)))
    options = {**own, TEXTURES: replace(own[TEXTURES], **changed)}
    build_again(db, {stage: options[stage] for stage in concerned_stages(TEXTURES, options)})
    return read_served(db)


def seen(e: float, bandwidth: float | None = 4e6, policy: str = "best", **more) -> WalkOutcome:
    return replace(WalkOutcome(policy, bandwidth, "10%", e, 3 * e, 10**6, 1.5), **more)


OWN = WalkTrial("", "", "", 20.0, 10**7, (seen(2.0, 512e3), seen(1.0)))


def tried(name: str, *es: float, build: float = 20.0, served: int = 10**7) -> WalkTrial:
    option = name.split()[0]
    both = (seen(es[0], 512e3), seen(es[1]))
    return WalkTrial(name, f"{option} 0", option, build, served, both)


def test_a_sentence_tells_what_is_saved_and_what_is_seen() -> None:
    small = tried("--max-side 512", 2.001, 1.021, build=17.1, served=3_900_000)
    trade = WalkTrade(60.0, OWN, (small,))
    assert sentence(small, trade) == (
        "--max-side 512 instead of --max-side 0 reduces the total size by 61 % and "
        "builds 2.9 s faster; the image is worse by 2.1 % at 4 Mbit/s (e 1.00 → 1.02), "
        "and the same otherwise."
    )


def test_who_sees_nothing_is_told_so() -> None:
    same = tried("--samples 8", 2.0, 1.004, build=23.0, served=10_400_000)
    assert sentence(same, WalkTrade(60.0, OWN, (same,))) == (
        "--samples 8 instead of --samples 0 increases the total size by 4.0 % and "
        "builds 3.0 s slower; no visible difference."
    )
    assert sentence(tried("--a 1", 2.0, 1.0), WalkTrade(60.0, OWN, ())) == (
        "--a 1 instead of --a 0 costs the same; no visible difference."
    )


def test_a_knob_of_some_clients_names_them() -> None:
    own = replace(OWN, seen=(*OWN.seen, seen(3.0, policy="ach")))
    rough = WalkTrial(
        "--samples 1", "--samples 8", "--samples", 20, 10**7, (seen(3.3, policy="ach"),)
    )
    text = sentence(rough, WalkTrade(60.0, own, (rough,)))
    reported = "the image for the client ach is worse by 10 % at 4 Mbit/s (e 3.00 → 3.30)."
    assert text.endswith(reported)


def test_what_cannot_be_built_says_why() -> None:
    failed = WalkTrial("--cells leaf", "--cells room", "--cells", 0, 0, problem="is too much")
    trade = WalkTrade(60.0, OWN, (failed,))
    assert sentences(trade) == ["--cells leaf cannot be tested: is too much."]
    with pytest.raises(InputError, match=r"--cells leaf could not be tested \(is too much\)"):
        require_prices(trade, Path("db"))


def test_of_a_knob_the_best_is_told_then_what_saves_most_then_what_loses_least() -> None:
    better = tried("--k 1", 1.9, 0.9, served=2 * 10**7)
    alike = tried("--k 2", 2.001, 1.001, served=9 * 10**6)
    cheap = tried("--k 3", 2.003, 1.003, served=8 * 10**6)
    bad, worst = tried("--k 4", 2.4, 1.2, served=10**6), tried("--k 5", 4.0, 3.0, served=10**5)
    for some, reported in (
        ((bad, better, alike), better),
        ((worst, alike, cheap, bad), cheap),
        ((worst, bad), bad),
    ):
        assert representative(some, OWN) is reported


def test_the_best_price_is_first() -> None:
    names = {
        "--gain 1": (2.0, 1.0, 20.0, 9 * 10**6),
        "--trade 1": (2.4, 1.2, 20.0, 8 * 10**6),
        "--dear-trade 1": (3.0, 1.5, 20.0, 8 * 10**6),
        "--nothing 1": (2.0, 1.0, 20.1, 10**7),
        "--loss 1": (2.0, 1.0, 25.0, 10**7),
    }
    trials = [tried(name, *v[:2], build=v[2], served=v[3]) for name, v in names.items()]
    lines = sentences(WalkTrade(60.0, OWN, (*trials[::-1],)))
    assert [line.split(" instead")[0] for line in lines] == [*names]


def test_the_table_has_a_block_for_each_walker_and_the_cheapest() -> None:
    trade = WalkTrade(60.0, OWN, (tried("--k 1", 1.9, 0.9, build=30), tried("--k 2", 3.0, 2.0)))
    lines = table(trade, 1.95)
    assert lines[0].startswith("--k 1 instead of --k 0 builds 10.0 s slower; the image is better")
    assert sum("setting" in line and "served" in line for line in lines) == 2
    assert [line.split(": ")[-1] for line in lines if "cheapest" in line] == [
        "--k 1",  # at 512 kbit/s
        "unchanged",
    ]
    (row,) = (line for line in lines if line.startswith("  --k 2") and "+100.0%" in line)
    assert row.split()[2:7] == ["20.0", "s", "10.0", "MB", "2.000"]
    assert [len(each.trials) for each in trades(trade)] == [3, 3]


def test_settings_are_other_than_the_databases_own_and_coarser_where_pictures_change(db) -> None:
    own = own_options(Artifacts(open_database(db)))
    names = {each.name for each in settings(own, 1024)}
    assert {"--max-side 512", "--cells leaf", "--trim", "--pvs fast", "--samples 8"} <= names
    assert not {"--max-side 1024", "--profile fast", "--profile small", "--pvs full"} & names
    assert [s.name for s in settings(own, 1024, ["need"])] == ["--need 0"]
    bare = {**own, EMIT: replace(own[EMIT], need=0)}
    assert [s.name for s in settings(bare, 1024, ["need"])] == ["--need 16"]
    lossy = {**own, TEXTURES: replace(own[TEXTURES], max_error=2, trim=True)}
    names = {each.name for each in settings(lossy, 1)}
    assert "--max-error 4" in names
    assert not {"--max-error 2", "--max-side 0", "--trim", "--no-trim"} & names
    (small,) = (s for s in settings(own, 9, ["profile"]) if s.value == "small")
    assert (small.own, small.options.profile) == ("--profile fast", "small")
    quick = list(settings(own, 1024, quick=True))
    assert len({each.knob.option for each in quick}) == len(quick) <= len(KNOBS)
    lit = {**own, LIGHT: LightOptions()}
    assert [s.name for s in concerned_stages(TEXTURES, lit)] == [
        "textures",
        "relief",
        "light",
        "emit",
    ]


def test_what_lacks_levels_is_predicted_by_the_tables_of_the_original(db, walk, original) -> None:
    """Looking again, with the coarse textures on the walls, gives the same."""
    with temporary_copy(db) as copy:
        coarse = built(copy, max_side=16, preview=0)
        world = comparison_world(coarse, walk, original)
        own = read_pyramids(coarse)
    assert begins_with(original.pyramids, own)
    assert not begins_with(own, original.pyramids)
    assert own.levels.max() < original.pyramids.levels.max()
    track = original.track
    unique, first = np.unique(track.view, return_index=True)
    (again,) = look(
        coarse.surfaces, own, original.camera, track.eye[first], track.direction[first],
        drawing=Drawing(full=original.pyramids, same_maps=True),
    )  # fmt: skip
    assert len(unique) == again.frames
    for name in ("start", "cell", "texture"):
        np.testing.assert_array_equal(getattr(again, name), getattr(world.views, name))
    # Columns beyond the levels of a texture are never read.
    levels = np.append(own.levels, own.levels.max())[world.views.texture]
    for name, more in (("error", 2), ("square", 2), ("need", 0), ("sight", 0)):
        actual, desired = getattr(again, name), getattr(world.views, name)
        valid = np.arange(actual.shape[1]) < levels[:, None] + more
        np.testing.assert_allclose(
            actual[valid], desired[valid], rtol=1e-4, atol=1e-6, err_msg=name
        )
    finest = own.levels[world.views.texture] + 1
    textured = world.views.texture >= 0
    left = world.views.error[np.arange(len(finest)), finest][textured]
    assert left.sum() > 0, "what is gone is an error"
    assert world.catalogue.ends[:, -1].sum() < original.catalogue.ends[:, -1].sum()


def test_texels_that_differ_are_an_error_even_when_all_is_there(db, walk, original) -> None:
    with temporary_copy(db) as copy:
        world = comparison_world(built(copy, max_error=8), walk, original)
    assert not begins_with(original.pyramids, world.pyramids)
    rows = np.flatnonzero(world.views.texture >= 0)
    last = world.pyramids.levels[world.views.texture[rows]] + 1
    left, exact = (views.error[rows, last] for views in (world.views, original.views))
    assert left.sum() > 0
    # A frame's errors are means over its pixels; no texel is off by more than was allowed.
    assert left.max() <= 8
    assert (exact == 0).all()
    np.testing.assert_array_equal(world.views.error[rows, 0], original.views.error[rows, 0])


def test_the_same_database_shows_the_same(db, walk, original) -> None:
    world = comparison_world(read_served(db), walk, original)
    np.testing.assert_array_equal(world.views.error, original.views.error)
    np.testing.assert_array_equal(world.views.sight, original.views.sight)


def test_other_previews_have_other_errors_and_the_same_reference(db, walk, original) -> None:
    assert len(original.lossy.state) > 0
    with temporary_copy(db) as copy:
        worse = comparison_world(built(copy, preview=10), walk, original)
    with temporary_copy(db) as copy:
        lossy = comparison_world(built(copy, exact="never"), walk, original)
    known = original.pyramids.levels[original.views.texture] + 2
    exact = (np.arange(original.views.error.shape[1]) < known[:, None]) & (
        original.views.texture >= 0
    )[:, None]
    assert (worse.views.error[exact] == original.views.error[exact]).all()
    states = ~exact & (original.views.error > 0)
    assert worse.views.error[states].sum() > 1.01 * original.views.error[states].sum()
    # Without exact levels all that is there is off by the finest preview.
    few = np.flatnonzero(lossy.catalogue.stored < lossy.catalogue.levels)
    rows = np.flatnonzero(np.isin(lossy.views.texture, few) & (lossy.views.need[:, -1] > 0))
    assert lossy.views.error[rows, lossy.pyramids.levels[lossy.views.texture[rows]] + 1].min() > 0


def test_a_stage_runs_again_where_it_is_current(db) -> None:
    own = own_options(Artifacts(open_database(db)))
    with temporary_copy(db) as copy:
        before = files_below(copy / "www")
        assert list(build_again(copy, own)) == [stage.name for stage in own]
        assert files_below(copy / "www") == before
        assert not run_stage(copy, own[TEXTURES], workers=1).stages[0].ran


def test_all_later_stages_are_built_again(two_rooms) -> None:
    """Also the light, whose stage is to store nothing and has nothing to set then."""
    artifacts = Artifacts(open_database(two_rooms))
    assert not artifacts.is_stored(LIGHT)
    own = own_options(artifacts)
    assert {stage.name for stage in own} == {
        name for name in artifacts.db.manifest.stages if not STAGES[name].joined
    }
    chosen = list(settings(own, 64))
    assert {setting.knob for setting in chosen} == {k for k in KNOBS if k.stage != LIGHT}
    for setting in chosen:
        again = concerned_stages(setting.knob.stage, own)
        for stage, options in own.items():
            if stage not in again:
                assert not {*stage.sources(options), *stage.heeds} & {*again}


#: Options of the first and of a later stage, and one of some clients.
TESTED = ("cells", "max-side", "samples")


def test_options_are_priced_on_a_default_build(two_rooms, walk_file, tmp_path, capsys) -> None:
    before = files_below(two_rooms)
    file = tmp_path / "t.csv"
    asked = ["tradeoff", str(two_rooms), "--stage", "walk", "--csv", str(file), "--quick"]
    asked += ["--walk", str(walk_file)]
    knobs = [word for name in TESTED for word in ("--option", name)]
    links = ["--bandwidth", "64k,inf", "--memory", "inf"]
    assert main([*asked, *knobs, *links, "--json"]) == 0
    out, err = capsys.readouterr()
    assert "3 settings on a walk of 20 s at 64 kbit/s and unlimited bandwidth" in err
    (actual,) = json.loads(out)
    assert actual["stage"] == "walk"
    trials = {trial["option"]: trial for trial in actual["trials"]}
    assert set(trials) == {f"--{name}" for name in TESTED}
    assert [trial["problem"] for trial in actual["trials"]] == [""] * 3
    assert len(actual["sentences"]) == 3
    side = trials["--max-side"]
    assert side["served"] < actual["own"]["served"]
    by_case = {(s["policy"], s["bandwidth"]): s["e"] for s in actual["own"]["seen"]}
    assert set(by_case) == {(p, b) for p in ("best", "ach") for b in (64e3, None)}
    (unlimited,) = (s["e"] for s in side["seen"] if s["bandwidth"] is None)
    assert unlimited > by_case["best", None], "no link brings what was left out"
    assert {s["policy"] for s in trials["--samples"]["seen"]} == {"ach"}
    assert files_below(two_rooms) == before
    rows = list(csv.DictReader(file.open(encoding="utf-8")))
    assert {row["stage"] for row in rows} == {"walk"}
    assert len(rows) == 4 + 2 * 3


@pytest.fixture
def instant(monkeypatch) -> None:
    """Nothing is built again, and leaves are too many."""

    def build(db, options):
        if CELLS in options and options[CELLS].cells == "leaf":
            raise LimitError("PTM-L400", "is too much")
        return {stage.name: 0.1 for stage in options}

    monkeypatch.setattr("ptmtools_lab.tradeoff.walk.build_again", build)
    monkeypatch.setattr("ptmtools_lab.tradeoff.walk.warm_building", lambda: None)


@pytest.mark.usefixtures("instant")
def test_a_setting_that_cannot_be_tested_is_an_error(two_rooms, walk_file, capsys) -> None:
    asked = ["tradeoff", str(two_rooms), "--stage", "walk", "--walk", str(walk_file)]
    assert main([*asked, "--option", "cells", "--option", "max-side", "--quick"]) == 3
    out, err = capsys.readouterr()
    assert "--max-side 32 instead of --max-side 0" in out, "the others are priced"
    assert "--cells leaf could not be tested (is too much)" in err
    assert "PTM-I701" in err


def test_links_and_memory_suit_the_walk(world) -> None:
    options = WalkOptions().for_walk(world)
    memory, received = needs_of(world)
    assert 0 < memory <= world.catalogue.whole
    slow, fast = (link.bandwidth for link in options.links())
    assert slow == pytest.approx(8 * received / world.track.time[-1], rel=0.05)
    assert fast == pytest.approx(8 * slow, rel=0.1)
    given = replace(WalkOptions(), bandwidth="512k,4M", memory="10%")
    assert given.for_walk(world) == given
    suited, starved = ([r.measures.e.mean for r in play({"": world}, o)] for o in (options, given))
    assert suited[0] > 2 * suited[1] > 0, "the wider link shows more"
    assert starved[0] == pytest.approx(starved[1], rel=0.01), "a tenth of the memory shows nothing"


@pytest.mark.usefixtures("instant")
def test_what_the_time_does_not_allow_is_named(two_rooms, walk_file) -> None:
    """The first values of all options are before the second ones."""
    lines: list[str] = []
    trade = try_settings(
        Artifacts(open_database(two_rooms)), read_walk(walk_file), WalkOptions(),
        ["max-side", "need"], deadline=Deadline(1e-9), tell=lines.append,
    )  # fmt: skip
    assert [trial.name for trial in trade.trials] == ["--max-side 32"]
    assert trade.untried == ("--max-side 16", "--need 0")
    assert "of which 0 s are allowed" in lines[0]
    assert table(trade)[-1].endswith("(--minutes): --max-side 16, --need 0.")
    names = ["a1", "a2", "a3", "b1", "b2"]
    some = [KnobSetting(KNOBS[name > "b"], name, "", None) for name in names]
    assert [names[k] for k in by_turns(some)] == ["a1", "b1", "a2", "b2", "a3"]


def test_seconds_do_not_include_the_compiler(db, monkeypatch) -> None:
    compiled, seconds = iter([0, 3, 3, 3]), iter([50.0, 2.0, 0.5, 0.4])
    monkeypatch.setattr("ptmtools_lab.tradeoff.knobs.compilations", lambda: next(compiled))
    monkeypatch.setattr("ptmtools_lab.tradeoff.knobs.time_work", lambda run: (None, next(seconds)))
    both = {EMIT: EmitOptions(), TEXTURES: None}
    assert build_again(db, both) == {"emit": 2.0, "textures": 0.4}


def test_a_policy_without_its_hints_is_refused_before_anything_is_built(
    db, walk_file, tmp_path, capsys, monkeypatch
) -> None:
    with temporary_copy(db) as copy:
        own = own_options(Artifacts(open_database(copy)))
        build_again(copy, {EMIT: replace(own[EMIT], need=0)})
        monkeypatch.setattr("ptmtools_lab.tradeoff.walk.build_again", pytest.fail)
        asked = ["tradeoff", str(copy), "--stage", "walk", "--walk", str(walk_file)]
        assert main([*asked, "--policy", "screen+need"]) == 3
    assert "PTM-I701" in capsys.readouterr().err


def test_a_walk_elsewhere_is_refused(db, tmp_path, capsys) -> None:
    file = tmp_path / "away.json"
    rows = [[t, 1e3, 1.6, 1e3 + t, 0, 0, 1] for t in (0.0, 8.0)]
    document = {"format": "ptmtools walk", "schema": 1, "fieldOfView": 1.0, "aspect": 1.7}
    file.write_text(json.dumps({**document, "samples": rows}))
    assert main(["tradeoff", str(db), "--stage", "walk", "--walk", str(file)]) == 3
    assert "PTM-I700" in capsys.readouterr().err


def test_an_option_without_another_setting_is_refused(two_rooms, capsys) -> None:
    """The small rooms have no light."""
    words = ["tradeoff", str(two_rooms), "--stage", "walk", "--option", "light-samples"]
    assert main(words) == 3
    assert "nothing to try for --option light-samples" in capsys.readouterr().err
