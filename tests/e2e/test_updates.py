"""Incremental builds: stages that run again, predictions of `--dry-run`, and reused results."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.store.layout import LOCK, STAGING
from ptmtools.store.lock import holder
from tests.e2e.conftest import Ptm, listing

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "benchmarks")]
from kills import Trial  # noqa: E402

QUICK = ("--samples", 4, "-j", 1, "--light", "none")


def built(ptm: Ptm, model: Path, db: Path, *more: object) -> dict[str, Any]:
    done = ptm("build-scene", model, "-o", db, "--json", *QUICK, *more)
    assert (done.status, done.err) == (0, "")
    report: dict[str, Any] = json.loads(done.out)
    return {stage["stage"]: stage for stage in report["stages"]}


def planned(ptm: Ptm, model: Path, db: Path, *more: object) -> dict[str, Any]:
    done = ptm("build-scene", model, "-o", db, "--json", "--dry-run", *QUICK, *more)
    assert (done.status, done.err) == (0, "")
    report: dict[str, Any] = json.loads(done.out)
    return {stage["stage"]: stage for stage in report["stages"]}


def states(ptm: Ptm, db: Path) -> dict[str, str]:
    actual = json.loads(ptm("status", db, "--json").out)
    return {stage["stage"]: stage["state"] for stage in actual["stages"]}


def ran(stages: dict[str, Any]) -> list[str]:
    return [name for name, stage in stages.items() if stage["ran"]]


def repaint(file: Path) -> None:
    """The same image with its colours turned round: no alpha, the same size."""
    with Image.open(file) as image:
        texels = np.asarray(image.convert("RGB"))
    Image.fromarray(255 - texels).save(file)


@pytest.fixture
def model(two_rooms: Path) -> Path:
    return two_rooms / "two_rooms.obj"


def test_one_texture_painted_over_is_one_texture_encoded(
    model: Path, tmp_path: Path, ptm: Ptm
) -> None:
    db = tmp_path / "a.db"
    built(ptm, model, db)
    before = listing(db)
    stamps = {p: p.stat().st_mtime_ns for p in db.rglob("*") if p.is_file()}
    repaint(model.with_name("floor.png"))

    plan = planned(ptm, model, db)
    assert [name for name, stage in plan.items() if stage["plan"] == "run"] == ["scene", "textures"]
    assert plan["textures"]["textures"] == ["floor"]
    assert plan["emit"]["plan"] == "maybe"
    assert plan["scene"]["reasons"] == ["floor.png changed"]
    assert listing(db) == before

    stages = built(ptm, model, db)
    assert ran(stages) == ["scene", "textures", "emit"]
    total, kept, _ = stages["textures"]["tasks"]
    assert (total, kept) == (total, total - 1)
    touched = {
        p.name for p, stamp in stamps.items() if p.exists() and p.stat().st_mtime_ns != stamp
    }
    always = {"manifest.json", "images.json", "floor.ptm", "floor.png", "floor.json"}
    always |= {"floor-64.webp", "hints.json", "statistics.json"}
    assert touched == always
    built(ptm, model, tmp_path / "fresh.db")
    assert listing(db) == listing(tmp_path / "fresh.db")


@pytest.mark.parametrize("change", ["alpha", "fallback", "broken", "format"])
def test_an_image_that_bears_on_the_scene_is_not_only_painted_over(
    model: Path, tmp_path: Path, ptm: Ptm, change: str
) -> None:
    db, file = tmp_path / "a.db", model.with_name("floor.png")
    built(ptm, model, db)
    if change == "alpha":
        with Image.open(file) as image:
            alpha = image.convert("RGBA")
        alpha.putalpha(100)
        alpha.save(file)
    elif change == "fallback":
        shutil.copy(model.with_name("room_a.png"), file)
    elif change == "broken":
        file.write_bytes(file.read_bytes()[:100])
    else:
        with Image.open(file) as image:
            image.save(file, "BMP")
    built(ptm, model, db)
    built(ptm, model, tmp_path / "fresh.db")
    assert listing(db) == listing(tmp_path / "fresh.db")


def test_a_plan_says_why(model: Path, tmp_path: Path, ptm: Ptm) -> None:
    db = tmp_path / "a.db"
    plan = planned(ptm, model, db)
    assert {stage["plan"] for stage in plan.values()} == {"run"}
    assert not db.exists()
    built(ptm, model, db)
    assert {stage["plan"] for stage in planned(ptm, model, db).values()} == {"current"}
    plan = planned(ptm, model, db, "--max-leaves", 2)
    assert plan["cells"] == {
        "stage": "cells",
        "plan": "run",
        "reasons": ["max leaves: 50000 → 2"],
        "textures": [],
    }
    assert plan["pvs"]["plan"] == plan["ach"]["plan"] == plan["emit"]["plan"] == "maybe"
    assert plan["textures"]["plan"] == "current"
    (db / "www/root.wrl").write_text("mine")
    assert planned(ptm, model, db)["emit"]["reasons"] == ["www/root.wrl is missing or damaged"]
    model.write_text("# nothing\n" + model.read_text())
    plan = planned(ptm, model, db)
    assert plan["scene"]["plan"] == "run"
    assert plan["textures"]["plan"] == "maybe"
    assert ptm("build-scene", tmp_path / "gone.obj", "-o", db, "--dry-run").status == 3


def test_status(model: Path, tmp_path: Path, ptm: Ptm) -> None:
    db = tmp_path / "a.db"
    assert ptm("status", db).status == 5
    assert ptm("cells", model, "-o", db).status == 0
    assert states(ptm, db) == {
        "scene": "done",
        "apo": "done",
        "cells": "done",
        **dict.fromkeys(["pvs", "ach", "textures", "relief", "light", "emit"], "not run"),
    }
    built(ptm, model, db)
    assert set(states(ptm, db).values()) == {"done"}
    repaint(model.with_name("floor.png"))
    assert ptm("cells", model, "-o", db, "--max-leaves", 2).status == 0
    actual = states(ptm, db)
    assert (actual["pvs"], actual["textures"], actual["scene"]) == ("stale", "stale", "done")
    assert ptm("emit", db).status == 5
    (db / "stages/pvs.npz").unlink()
    assert states(ptm, db)["pvs"] == "damaged"
    printed = ptm("status", db).out
    assert "stages/pvs.npz is missing or damaged" in printed
    assert "not finished" in printed


@pytest.fixture
def writing(model: Path, tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A build of ``a.db`` that is stopped in the middle, with the lock in its hands."""
    db = tmp_path / "a.db"
    command = [sys.executable, "-m", "ptmtools", "build-scene", str(model), "-o", str(db)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 120
        while holder(db) is None:  # the file is there for a moment before it is signed
            assert time.monotonic() < deadline
            time.sleep(0.005)
        process.send_signal(signal.SIGSTOP)
        yield process
        process.kill()


def test_two_builds_at_once(
    model: Path, tmp_path: Path, ptm: Ptm, writing: subprocess.Popen[bytes]
) -> None:
    db = tmp_path / "a.db"
    refused = ptm("build-scene", model, "-o", db)
    assert refused.status == 5
    assert f"another ptm is writing this database, process {writing.pid}" in refused.err
    assert "PTM-D007" in refused.err
    assert json.loads(ptm("status", db, "--json").out)["writer"] == f"process {writing.pid}"
    writing.kill()
    writing.wait()
    assert (db / LOCK).exists()  # stale, and known to be
    assert json.loads(ptm("status", db, "--json").out)["writer"] is None
    built(ptm, model, db)
    assert not (db / LOCK).exists()


def test_killed_builds_end_as_undisturbed_ones(model: Path, tmp_path: Path) -> None:
    """A few; ``benchmarks/kills.py`` has more, and one at each change of a name."""
    trial = Trial(model, tmp_path, [str(option) for option in QUICK], update=False)
    for share in (0.35, 0.6, 0.8):
        assert trial.after(share * trial.seconds) in ("", None)
    for n in (40, 90):
        assert trial.at_name(n) == ""


def test_a_killed_update_ends_as_an_undisturbed_one(model: Path, tmp_path: Path) -> None:
    trial = Trial(model, tmp_path, [str(option) for option in QUICK], update=True)
    for n in (12, 25):
        assert trial.at_name(n) == ""


def test_textures_that_were_finished_are_taken_over(model: Path, tmp_path: Path, ptm: Ptm) -> None:
    db = tmp_path / "a.db"
    built(ptm, model, db, "--profile", "raw")
    wanted = listing(db)
    built(ptm, model, db)
    # The stage stops at its last texture; what it has finished waits.
    images = json.loads((db / "stages/images.json").read_text())["images"]
    victim = db / "stages/images" / images[-1]["sha256"]
    data = victim.read_bytes()
    victim.write_bytes(b"broken")
    assert ptm("textures", db, "--profile", "raw", "-j", 1).status == 5
    assert json.loads(ptm("status", db, "--json").out)["waiting"] == len(images) - 1
    victim.write_bytes(data)
    stages = built(ptm, model, db, "--profile", "raw")
    assert stages["textures"]["tasks"] == [len(images), 0, len(images) - 1]
    assert listing(db) == wanted


def test_a_full_disk(model: Path, tmp_path: Path, ptm: Ptm) -> None:
    """Written to a disk of 1 MB that fills up; the database that is there stays what it was."""
    disk = tmp_path / "disk"
    disk.mkdir()
    quiet = subprocess.DEVNULL
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)]
    if os.geteuid() != 0 or subprocess.run(mount, stderr=quiet).returncode:
        pytest.skip("a small disk can only be mounted by root")
    try:
        db = disk / "a.db"
        built(ptm, model, db)
        before = listing(db)
        free = os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize
        (disk / "ballast").write_bytes(bytes(max(0, free - 20_000)))
        full = ptm("build-scene", model, "-o", db, *QUICK, "--profile", "raw", "--title", "other")
        assert full.status == 4
        assert "the disk is full" in full.err
        assert "PTM-O003" in full.err
        assert {n: d for n, d in listing(db).items() if not n.startswith(STAGING)} == before
        assert ptm("validate", db).status == 0
        (disk / "ballast").unlink()
        built(ptm, model, db, "--profile", "raw", "--title", "other")
        built(ptm, model, tmp_path / "fresh.db", "--profile", "raw", "--title", "other")
        assert listing(db) == listing(tmp_path / "fresh.db")
    finally:
        subprocess.run(["umount", str(disk)], check=True)
