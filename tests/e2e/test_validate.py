"""`ptm validate` as a user runs it: what the builds leave is good, and faults end it with 8."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from ptmtools import schemas
from ptmtools.store.layout import sha256
from tests.e2e.conftest import TWO_ROOMS, Ptm, make_museum
from tests.output.agreement import disagreements, kinds, wrong_counts
from tests.output.damage import Damage, copied, hinted, put, removed, replaced, rewritten

MODEL = TWO_ROOMS / "two_rooms.obj"


def issues(ptm: Ptm, db: Path, *options: str) -> tuple[int, set[str]]:
    """The exit status, and the codes of what is found."""
    done = ptm("validate", db, "--json", *options)
    report = json.loads(done.out)
    schemas.check(report, schemas.VALIDATION)
    assert report["ok"] is (done.status == 0)
    return done.status, {issue["code"] for issue in report["issues"]}


@pytest.mark.parametrize(
    "options",
    [
        "",
        "--cells leaf",
        "--no-fallback",
        "--fallback-size 16",
        "--gzip",
        "--format gltf --gzip",
        "--format vrml",
        "--per-texture --samples 4",
        "--unit 1e-6",
        "--unit 1e6",
    ],
)
def test_what_is_built_is_good(ptm: Ptm, tmp_path: Path, options: str) -> None:
    db = tmp_path / "db"
    assert ptm("-q", "build-scene", MODEL, "-o", db, *options.split()).status == 0
    assert issues(ptm, db, "--strict") == (0, set())
    assert disagreements(db / "www") == []
    assert wrong_counts(db) == set()


def test_the_smallest_museum_is_good(ptm: Ptm, tmp_path: Path) -> None:
    model, db = make_museum(tmp_path / "model"), tmp_path / "db"
    assert ptm("-q", "build-scene", model, "-o", db, "--gzip").status == 0
    assert issues(ptm, db, "--strict") == (0, set())
    assert disagreements(db / "www") == []


def resealed(*damages: Damage) -> Damage:
    """Damages, of which the manifest knows nothing: hashes and counts are brought up to date."""

    def damage(db: Path) -> None:
        for each in damages:
            each(db)
        path = db / "manifest.json"
        document = json.loads(path.read_text())
        stages = document["stages"]
        for stage in stages.values():
            stage["outputs"] = {n: sha256((db / n).read_bytes()) for n in stage["outputs"]}
        known = {name: h for stage in stages.values() for name, h in stage["outputs"].items()}
        for stage in stages.values():
            stage["inputs"] = {n: known.get(n, h) for n, h in stage["inputs"].items()}
        emitted = stages["emit"]
        emitted["counts"]["bytes"] = sum((db / n).stat().st_size for n in emitted["outputs"])
        path.write_text(json.dumps(document))

    return damage


def spoilt(name: str, share: float = 0.5) -> Damage:
    """One bit is another, at a share of the file: not in the date of a member, which nothing
    reads."""

    def changed(data: bytes) -> bytes:
        at = int(share * len(data))
        return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]

    return rewritten(name, changed)


def stages(change: Callable[[dict], object]) -> Damage:
    """Changes the stages in the manifest."""
    return hinted(lambda document: change(document["stages"]), "../manifest.json")


C0 = "cells/c0000.wrl"
FAULTS: dict[str, tuple[int, str, Damage]] = {
    "a file is gone": (8, "D651 D671", removed("cells/c0001.wrl")),
    "a file is changed": (8, "D652", replaced("root.wrl", "ptmtools database", "Museum")),
    "a file is put there": (0, "", put("mine")),
    "a file is put among ours": (
        0,
        "D653",
        put("cells/mine"),
    ),
    "a stage is exchanged": (8, "D652", spoilt("../stages/pvs.npz")),
    "a stage is damaged, its hash not": (8, "D720", resealed(spoilt("../stages/cells.npz", 0.9))),
    "a count is wrong": (8, "D699", stages(lambda s: s["cells"]["counts"].update(leaves=4))),
    "a stage is stale": (
        8,
        "D656",
        stages(lambda s: s["pvs"]["inputs"].update({"stages/cells.npz": "0" * 64})),
    ),
    "a URL leads nowhere": (
        8,
        "D671 cell material",
        resealed(replaced(C0, "room_a.ptm", "room_c.ptm")),
    ),
    "a cell does not see another": (
        0,
        "ach_length cell",
        resealed(replaced(C0, r'\[ "c0000.wrl", "c0001.wrl" \]', '[ "c0000.wrl" ]')),
    ),
    # VRML files name no lightmaps.
    "hints are no hints": (8, "D677 D700", resealed(replaced("hints.json", '"unit"', '"units"'))),
    "a texture is damaged": (8, "D710", resealed(spoilt("textures/floor.ptm"))),
    "a fallback image is another": (
        0,
        "texture",
        resealed(copied("textures/room_b.png", "textures/room_a.png")),
    ),
    "a fallback image is too much": (
        0,
        "D653 D677",
        copied("textures/floor.png", "textures/more.png"),
    ),
    "a bomb": (
        8,
        "D653 D676",
        put("root.wrl.gz", gzip.compress(bytes(1 << 24))),
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_planted_faults(ptm: Ptm, database: Path, name: str) -> None:
    status, expected, damage = FAULTS[name]
    damage(database)
    codes = {f"PTM-{code}" for code in expected.split() if code.startswith("D")}
    assert issues(ptm, database) == (status, codes)
    differences = {word for word in expected.split() if not word.startswith("D")}
    assert differences <= kinds(database / "www"), disagreements(database / "www")
    assert issues(ptm, database, "--strict") == (8 if codes else 0, codes)
    result = ptm("validate", database)
    assert result.status == status
    assert all(code in result.out for code in codes)
    assert ("PTM-C001" in result.err) is (status == 8)


def test_what_is_no_database(ptm: Ptm, tmp_path: Path) -> None:
    done = ptm("validate", tmp_path)
    assert (done.status, done.out) == (5, "")
    assert "PTM-D001" in done.err
