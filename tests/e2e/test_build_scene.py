"""`ptm build-scene` as a user runs it: a whole database, the same bytes every time, resumable."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.pipeline.stages import LIGHT, STAGES
from ptmtools.texture import decode, read_header, read_image, read_ptm
from tests.e2e.conftest import TWO_ROOMS, Ptm, listing
from tests.output.agreement import disagreements

SCRIPT = Path(sys.executable).with_name("ptm")


def run(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [SCRIPT, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=300
    )


Build = Callable[..., dict[str, Any]]


@pytest.fixture
def build(ptm: Ptm) -> Build:
    """``build(model, db, …)``: builds without a fault; the report."""

    def build(model: Path, db: Path, *more: object) -> dict[str, Any]:
        done = ptm("build-scene", model, "-o", db, "--json", *more)
        assert (done.status, done.err) == (0, "")
        report = json.loads(done.out)
        assert isinstance(report, dict)
        return report

    return build


def ran(report: dict[str, Any]) -> list[str]:
    return [stage["stage"] for stage in report["stages"] if stage["ran"]]


def test_two_rooms(tmp_path: Path) -> None:
    done = run("build-scene", TWO_ROOMS / "two_rooms.obj", "-o", "rooms.db", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "2 cells of 3 convex leaves, 2 portals; closed to the outside" in done.stdout
    assert "visibility culling saves little" in done.stdout
    assert "ptm validate rooms.db" in done.stdout

    db = tmp_path / "rooms.db"
    assert run("validate", db, "--strict", "--segments", 20_000).returncode == 0
    about = json.loads(run("info", db, "--json").stdout)
    assert about["stages"]["cells"]["counts"]["portals"] == 2
    assert run("plot", db, "--cell", 0, "-o", tmp_path / "plan.png").returncode == 0
    assert (tmp_path / "plan.png").read_bytes().startswith(b"\x89PNG")

    served = {p.relative_to(db / "www").as_posix() for p in (db / "www").rglob("*") if p.is_file()}
    assert {"root.wrl", "hints.json", "hints/c0000.json", "cells/c0000.wrl"} <= served
    assert {"gltf/c0000.glb", "textures/floor.ptm", "textures/floor.png"} <= served
    manifest = (db / "manifest.json").read_text()
    assert str(tmp_path) not in manifest
    assert str(TWO_ROOMS) not in manifest


def test_what_cannot_be_walked_in_is_not_to_be_served(ptm: Ptm, database: Path) -> None:
    for format in ("vrml", "gltf", "vrml,gltf"):
        done = ptm("emit", database, "--format", format)
        assert done.status == 0
        assert "ptm validate" in done.out
        assert (f"ptm serve {database}" in done.out) == ("gltf" in format)
        remedy = ("emit", database, "--format", "vrml,gltf")
        assert (" ".join(map(str, remedy)) in done.out) == (format == "vrml")
        if format == "vrml":
            assert ptm(*remedy).status == 0
            assert (database / "www" / "gltf").is_dir()


def test_the_same_bytes_anywhere_and_with_any_number_of_workers(
    tmp_path: Path, database: Path, build: Build
) -> None:
    """The database of the session is one process's, of a model in another folder."""
    build(TWO_ROOMS / "two_rooms.obj", tmp_path / "deep" / "b", "-j", 2)
    assert listing(database) == listing(tmp_path / "deep" / "b")


def test_stage_by_stage_is_the_same_as_all_at_once(
    tmp_path: Path, database: Path, ptm: Ptm
) -> None:
    model, db = TWO_ROOMS / "two_rooms.obj", tmp_path / "a.db"
    assert ptm("cells", model, "-o", db).status == 0
    for stage in ("pvs", "ach", "textures", "relief", "light", "emit"):
        outcome = ptm(stage, db)
        assert (outcome.status, outcome.err) == (0, "")
    assert listing(db) == listing(database)


def test_textures_within_an_error_have_twins_of_the_same_texels(
    tmp_path: Path, ptm: Ptm, build: Build
) -> None:
    db = tmp_path / "a.db"
    options = ("--profile", "small", "--max-error", 3, "--max-level", -2, "--light", "none")
    build(TWO_ROOMS / "two_rooms.obj", db, *options)
    assert ptm("validate", db, "--strict").status == 0
    assert disagreements(db / "www") == []
    files = sorted((db / "www/textures").glob("*.ptm"))
    assert files
    for file in files:
        header = read_header(read_ptm(file))
        assert (header.profile, header.max_error, header.trimmed) == ("small", 3, 1)
        np.testing.assert_array_equal(decode(file), read_image(file.with_suffix(".png")))


def test_only_what_changed_is_done_again(tmp_path: Path, ptm: Ptm, build: Build) -> None:
    folder = Path(shutil.copytree(TWO_ROOMS, tmp_path / "model"))
    model, db = folder / "two_rooms.obj", tmp_path / "a.db"
    # An optional stage that writes nothing is not reported, but for light, which has a default.
    assert ran(build(model, db)) == [
        name for name, stage in STAGES.items() if not stage.optional or stage is LIGHT
    ]
    before = listing(db)
    stamps = {p: p.stat().st_mtime_ns for p in db.rglob("*")}

    assert ran(build(model, db)) == []
    assert {p: p.stat().st_mtime_ns for p in db.rglob("*")} == stamps

    assert ran(build(model, db, "--samples", 4)) == ["ach", "emit"]
    assert ran(build(model, db, "--samples", 4, "--profile", "raw")) == [
        "textures",
        "light",
        "emit",
    ]
    assert ran(build(model, db)) == ["ach", "textures", "light", "emit"]
    assert listing(db) == before

    with model.open("a") as text:
        text.write("# a comment\n")
    assert ran(build(model, db)) == ["scene"]

    shutil.copy(folder / "room_a.png", folder / "floor.png")
    assert {"scene", "textures", "emit"} <= set(ran(build(model, db)))
    assert ptm("validate", db).status == 0
    images = [f for f in (db / "www/textures").glob("*.ptm") if "light~" not in f.name]
    assert len(images) == 3  # equal images are one

    (folder / "floor.png").unlink()
    assert "scene" in ran(build(model, db))
    shutil.copy(TWO_ROOMS / "floor.png", folder / "floor.png")
    assert "scene" in ran(build(model, db))  # a file that was missing has come
    shutil.copy(TWO_ROOMS / "two_rooms.obj", model)
    build(model, db)
    assert listing(db) == before


def test_damage_is_mended(database: Path, ptm: Ptm, build: Build) -> None:
    model, db = TWO_ROOMS / "two_rooms.obj", database
    before = listing(db)
    for name, stage in (
        ("stages/cells.npz", "cells"),
        ("www/textures/floor.ptm", "textures"),
        ("www/root.wrl", "emit"),
    ):
        data = bytearray((db / name).read_bytes())
        data[len(data) // 2] ^= 1
        (db / name).write_bytes(data)
        assert ptm("validate", db).status == 8
        assert ran(build(model, db)) == [stage]
        assert listing(db) == before


def test_a_stage_that_others_have_left_behind_is_refused(database: Path, ptm: Ptm) -> None:
    model, db = TWO_ROOMS / "two_rooms.obj", database
    assert ptm("cells", model, "-o", db, "--max-leaves", 2).status == 0
    before = listing(db)
    outcome = ptm("ach", db)
    assert outcome.status == 5
    assert "PTM-D008" in outcome.err
    assert listing(db) == before
    for stage in ("pvs", "ach", "light", "emit"):
        assert ptm(stage, db).status == 0
    assert ptm("validate", db).status == 0


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_a_build_that_was_stopped_is_resumed(
    tmp_path: Path, database: Path, end: signal.Signals, build: Build
) -> None:
    model, db = TWO_ROOMS / "two_rooms.obj", tmp_path / "a.db"
    with subprocess.Popen(
        [SCRIPT, "build-scene", model, "-o", db, "-q"], stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        deadline = time.monotonic() + 120
        # Stopped as soon as something has been committed, whichever stage that hits.
        while not (db / "manifest.json").exists() and process.poll() is None:
            assert time.monotonic() < deadline
            time.sleep(0.002)
        process.send_signal(end)
        printed = process.stderr.read()
    if process.returncode == 130:
        assert printed.startswith("ptm: interrupted")
    else:
        assert process.returncode in (0, -signal.SIGKILL)
    report = build(model, db)
    assert "scene" not in ran(report)
    assert listing(db) == listing(database)


def test_foreign_files_stay(tmp_path: Path, ptm: Ptm, build: Build) -> None:
    model, db = TWO_ROOMS / "two_rooms.obj", tmp_path / "a.db"
    db.mkdir()
    (db / "mine.txt").write_text("mine")
    assert ptm("build-scene", model, "-o", db).status == 4
    assert listing(db) == {"mine.txt": b"mine"}
    build(model, db, "--force")
    assert (db / "mine.txt").read_text() == "mine"
    other = tmp_path / "other.obj"
    shutil.copy(TWO_ROOMS / "two_rooms.obj", other)
    build(other, db, "--force")
    assert (db / "mine.txt").read_text() == "mine"
    assert json.loads((db / "manifest.json").read_text())["model"] == "other.obj"
    images = [f for f in (db / "www/textures").glob("*") if "light~" not in f.name]
    assert not images  # other.obj has its materials elsewhere


def test_no_fallback(tmp_path: Path, ptm: Ptm, build: Build) -> None:
    db = tmp_path / "a.db"
    build(TWO_ROOMS / "two_rooms.obj", db, "--no-fallback")
    assert not list(db.rglob("*.png"))
    assert ".png" not in (db / "www/cells/c0000.wrl").read_text()
    assert ptm("validate", db).status == 0


def test_hospital(shared: Path, tmp_path: Path, ptm: Ptm, build: Build) -> None:
    quick = ("--samples", 2, "--face", 16, "--light-samples", 4, "--light-density", 4)
    db = tmp_path / "hospital.db"
    report = build(shared / "scenes/hospital/hospital.obj", db, *quick)
    counts = {stage["stage"]: stage["counts"] for stage in report["stages"]}
    assert counts["scene"]["metres"] == pytest.approx(0.01)
    assert counts["scene"]["up"] == "z"
    assert counts["textures"]["textures"] == 9
    assert counts["cells"]["cells"] > 50
    assert counts["pvs"]["average_share"] < 0.5
    assert counts["ach"]["backend"] in ("gl", "embree")
    assert report["peak_memory"] < 2 << 30
    done = ptm("validate", db, "--segments", 100_000)
    assert done.status == 0, done.out
    assert ran(build(shared / "scenes/hospital/hospital.obj", db, *quick)) == []


def test_a_stage_run_alone_leaves_the_later_ones_stale(database: Path, ptm: Ptm) -> None:
    model, db = TWO_ROOMS / "two_rooms.obj", database
    assert ptm("validate", db).status == 0
    assert ptm("cells", model, "-o", db, "--max-leaves", 1).status == 0
    stale = ptm("validate", db)
    assert stale.status == 8
    assert "PTM-D656" in stale.out + stale.err


def test_gallery_is_one_hall_and_said_to_be(
    shared: Path, tmp_path: Path, ptm: Ptm, build: Build
) -> None:
    db = tmp_path / "gallery.db"
    quick = ("--samples", 2, "--face", 16, "--light-samples", 4)
    report = build(shared / "scenes/gallery/gallery.obj", db, *quick)
    counts = {stage["stage"]: stage["counts"] for stage in report["stages"]}
    assert counts["cells"]["cells"] == 1
    assert counts["cells"]["leaves"] > 20
    done = ptm("validate", db, "--segments", 100_000)
    assert done.status == 0, done.out
    printed = [note for stage in report["stages"] for note in stage["notes"] if "culling" in note]
    assert printed == ["visibility culling saves nothing here: the model is a single hall"]


def test_progress_is_not_shown_to_a_pipe(tmp_path: Path) -> None:
    environment = {**os.environ, "FORCE_COLOR": "1"}
    done = subprocess.run(
        [SCRIPT, "build-scene", TWO_ROOMS / "two_rooms.obj", "-o", tmp_path / "a.db"],
        capture_output=True,
        env=environment,
    )
    assert done.stderr == b""
    assert b"\x1b" not in done.stdout
