"""What the manifest says about files, counts and stages, and manifests with faults."""

from __future__ import annotations

import hashlib
import json
import os
import re
from pathlib import Path

import pytest

from ptmtools.output import validate_database
from tests.output.agreement import wrong_counts
from tests.output.damage import (
    Damage,
    appended,
    expect,
    put,
    removed,
    rewritten,
)
from tests.output.faults import (
    C0,
    HINTS,
    ROOT,
    codes,
    flipped,
)


def test_what_the_manifest_says(database: Path) -> None:
    (database / "www/cells/c0001.wrl").unlink()
    flipped(database)
    (database / "www/cells/notes.txt").write_text("mine")
    actual = {(i.code, i.file) for i in validate_database(database).issues}
    assert ("PTM-D651", "www/cells/c0001.wrl") in actual
    assert ("PTM-D652", "www/textures/a.ptm") in actual
    assert ("PTM-D710", "www/textures/a.ptm") in actual
    assert ("PTM-D653", "www/cells/notes.txt") in actual


def test_other_files_belong_to_the_user(database: Path) -> None:
    """Beside our files and folders, whatever it is called and holds: mentioned once."""
    files = ("index.html", "js/walk.js", "map.png", "walk.wrl", "\udcff\n.txt")
    for name in files:
        put(name)(database)
    report = validate_database(database)
    assert report.issues == ()
    (note,) = report.notes
    assert note.startswith("5 files in www/ are")
    assert note.endswith(": index.html, js/walk.js, map.png, …")
    assert note.isprintable()


@pytest.mark.parametrize(
    ("expected", "damage"),
    [
        ("D651", removed(ROOT)),
        ("D651", removed(HINTS)),
        ("D652", appended(ROOT, b"# a comment\n")),
        ("D652", rewritten(HINTS, lambda data: data + b" ")),
        ("D652", rewritten(C0, lambda data: data.replace(b"0.8 0.8 0.8", b"0.8 0.8 0.7"))),
        ("D653", put("cells/notes.txt")),
        ("D653", put("gltf/away.txt")),
        ("D653", put("cells/\udcff\n.txt")),
        ("D657", lambda db: (db / "www").rename(db / "w") and (db / "www").symlink_to("w")),
    ],
)
def test_only_the_manifest_tells(database: Path, expected: str, damage: Damage) -> None:
    damage(database)
    expect(validate_database(database).issues, expected)


def with_stage(db: Path, name: str, **record: object) -> None:
    """Adds to the record of a stage, or makes one."""
    path = db / "manifest.json"
    document = json.loads(path.read_text())
    empty = {"recipe": 1, "parameters": {}, "inputs": {}, "outputs": {}, "counts": {}, "notes": []}
    stage = document["stages"].setdefault(name, empty)
    for field, value in record.items():
        stage[field] |= value
    path.write_text(json.dumps(document))


@pytest.mark.parametrize("stage", ["textures", "emit"])
def test_counts(database: Path, stage: str) -> None:
    served = database / "www"
    counts = {"textures": 2, "raw_bytes": 16 * 24 * 3 + 9 * 5 * 4}
    if stage == "textures":
        counts["ptm_bytes"] = sum(p.stat().st_size for p in served.glob("textures/*.ptm"))
    else:
        text = "".join(p.read_text() for p in served.glob("cells/*.wrl"))
        files = [p for p in served.rglob("*.*") if p.parent.name != "textures"]
        counts = {"files": len(files), "viewpoints": 3, "shapes": text.count(" Shape {")}
        counts["bytes"] = sum(p.stat().st_size for p in files)
        counts["triangles"] = sum(
            index.count("-1") for index in re.findall(r" coordIndex [^]]*", text)
        )
    with_stage(database, stage, counts=counts)
    assert wrong_counts(database) == set()
    for name, count in counts.items():
        with_stage(database, stage, counts={name: count + 1})
        assert wrong_counts(database) == {f"{stage}.{name}"}
        with_stage(database, stage, counts={name: count})


def test_a_stale_stage(database: Path) -> None:
    with_stage(database, "emit", inputs={"www/textures/a.ptm": "0" * 64})
    assert codes(database) == {"PTM-D656"}


@pytest.mark.parametrize(
    ("there", "expected"),
    [
        (lambda path: path.write_bytes(b"arrays"), set()),
        (lambda path: None, {"PTM-D651"}),
        (lambda path: path.mkdir(), {"PTM-D651"}),
        (lambda path: os.mkfifo(path), {"PTM-D651"}),
    ],
)
def test_files_that_are_not_served(database: Path, there: Damage, expected: set[str]) -> None:
    (database / "stages").mkdir()
    there(database / "stages/pvs.npz")
    digest = hashlib.sha256(b"arrays").hexdigest()
    with_stage(database, "pvs", outputs={"stages/pvs.npz": digest})
    assert codes(database) == expected


@pytest.mark.parametrize(
    "manifest",
    [
        None,
        b"",
        b"[]",
        b'{"stages": 3}',
        b'{"stages": {"emit": {}}}',
        b"\xff",
        b"[" * 100_000,
        b'{"format": "ptmtools database", "schema": 3, "model": "a", "stages": {}, "stages": {}}',
    ],
)
def test_a_bad_manifest(database: Path, manifest: bytes | None) -> None:
    path = database / "manifest.json"
    path.unlink()
    if manifest is not None:
        path.write_bytes(manifest)
    assert codes(database) == {"PTM-D650"}


@pytest.mark.parametrize("name", ["../root.wrl", "/root.wrl", "www/../root.wrl", "root.wrl"])
def test_a_manifest_that_leads_outside(database: Path, name: str) -> None:
    path = database / "manifest.json"
    path.write_text(path.read_text().replace("www/root.wrl", name))
    assert codes(database) == {"PTM-D650"}


def test_a_file_of_two_stages(database: Path) -> None:
    document = json.loads((database / "manifest.json").read_text())
    digest = document["stages"]["emit"]["outputs"]["www/root.wrl"]
    with_stage(database, "textures", outputs={"www/root.wrl": digest})
    assert codes(database) == {"PTM-D650"}


def test_a_manifest_that_is_a_pipe(database: Path) -> None:
    (database / "manifest.json").unlink()
    os.mkfifo(database / "manifest.json")
    assert codes(database) == {"PTM-D650"}


def test_an_unfinished_database_only_warns(database: Path, seal: Damage) -> None:
    for path in sorted((database / "www").rglob("*.*"), reverse=True):
        path.unlink()
    seal(database)
    document = json.loads((database / "manifest.json").read_text())
    del document["stages"]["emit"]
    (database / "manifest.json").write_text(json.dumps(document))
    report = validate_database(database)
    assert report.ok
    assert {i.code for i in report.issues} == {"PTM-D655"}
