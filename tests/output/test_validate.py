"""Databases without faults, and the report of validation."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.diagnostics import CODES
from ptmtools.errors import DatabaseError, InputError
from ptmtools.output import EmitOptions, emit, validate_database, validate_ptm
from ptmtools.texture import Limits, read_header
from ptmtools.visibility.model import Pvs
from tests.output.agreement import disagreements, kinds
from tests.output.damage import (
    KINDS,
    Damage,
    appended,
    hinted,
    put,
    removed,
    replaced,
    zipped,
)
from tests.output.faults import (
    C0,
    C1,
    coarser,
    findings,
    flipped,
)

TESTS = Path(__file__).parents[1]
FALLBACK_FREE = EmitOptions(fallback=False, format="vrml")


def test_a_good_database_has_no_issue(finished: Path) -> None:
    report = validate_database(finished)
    assert report.issues == ()
    assert disagreements(finished / "www") == []
    assert report.ok
    assert report.files == 13
    assert report.bytes == sum(
        p.stat().st_size for p in (finished / "www").rglob("*") if p.is_file()
    )


@pytest.fixture(scope="session")
def roomy(artifacts, tmp_path_factory, put_textures, made_up_hints, seal) -> Path:
    """The first two rooms as one cell of two leaves; no fallback images; shares of textures."""
    db = tmp_path_factory.mktemp("roomy") / "db"
    cell = np.maximum(artifacts.cells.triangle_cell - 1, -1)
    cells = replace(
        artifacts.cells,
        leaf_cell=np.array([0, 0, 1], np.int32),
        triangle_cell=np.where(artifacts.cells.triangle_cell == 0, 0, cell),
    )
    pvs = Pvs.from_matrix(np.ones((2, 2), np.bool_))
    ach = made_up_hints(pvs, np.array([0.75, 0.25, 0.5, 0.5]))
    ach = replace(
        ach,
        texture_start=np.array([0, 2, 3, 4, 5]),
        texture=np.array([0, -1, 1, -1, 0], np.int32),
        texture_value=np.array([0.5, 0.25, 0.25, 0.5, 0.5]),
    )
    records = put_textures(db / "www")
    for image in (db / "www/textures").glob("*.png"):
        image.unlink()
    emit(artifacts.scene, cells, pvs, ach, records, db / "www", FALLBACK_FREE)
    seal(db)
    return db


def test_cells_of_several_leaves(roomy: Path) -> None:
    assert findings(roomy) == []
    assert disagreements(roomy / "www") == []


@pytest.mark.parametrize(
    ("expected", "pattern", "new"),
    [
        ("leaf_start cell", r"leafStart +\[ 0, 8", "leafStart [ 0, 20"),
        ("leaf_start cell", r"leafStart +\[ 0, 8", "leafStart [ 0, 8, 8"),
        ("leaf_start", r"leafStart +\[ 0", "leafStart [ 1"),
        ("leaf_start cell", r"leafStart +\[ 0, 8", "leafStart [ 8, 0"),
        ("leaf_start", r"leafStart +\[ 0, 8", "leafStart [ 0, -8"),
        ("leaf_start cell", r"leafPoint +\[ \d[^]]*\]", "leafPoint [ ]"),
        ("cell", r"leafPoint +\[ (\d+)", "leafPoint [ 99"),
    ],
)
def test_faults_of_leaves(
    roomy: Path, tmp_path: Path, seal: Damage, expected: str, pattern: str, new: str
) -> None:
    db = tmp_path / "db"
    shutil.copytree(roomy, db)
    replaced(C0, pattern, new)(db)
    seal(db)
    assert kinds(db / "www") == set(expected.split())


@pytest.mark.parametrize("format", ["vrml", "gltf"])
def test_one_form_alone(artifacts, tmp_path: Path, put_textures, seal, format: str) -> None:
    db = tmp_path / "db"
    a, records = artifacts, put_textures(db / "www")
    emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", EmitOptions(format=format))
    seal(db)
    assert findings(db) == []
    assert list(json.loads((db / "www/hints.json").read_text())["geometry"]) == [format]


def test_gzip_copies(database: Path, seal: Damage) -> None:
    for name in ("root.wrl", "hints.json", "hints/c0001.json", "cells/c0001.wrl"):
        zipped(name)(database)
    seal(database)
    assert findings(database) == []


@pytest.mark.parametrize("level", [0, 2, -1])
def test_a_fallback_image_of_a_coarser_level(database: Path, seal: Damage, level: int) -> None:
    coarser(level)(database)
    count = len(read_header((database / "www/textures/a.ptm").read_bytes()).levels)
    hinted(lambda d: d["textures"][0].update(fallbackLevel=range(count)[level]))(database)
    seal(database)
    assert findings(database) == []


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1e6, 1e15])
def test_tiny_and_huge_worlds(artifacts, tmp_path: Path, put_textures, seal, scale: float) -> None:
    db = tmp_path / "db"
    a, c = artifacts, artifacts.cells
    plane = c.node_plane * [1, 1, 1, scale]
    cells = replace(
        c,
        node_plane=plane,
        root_box=c.root_box * scale,
        leaf_point=c.leaf_point * scale,
        portal_plane=c.portal_plane * [1, 1, 1, scale],
        portal_point=c.portal_point * scale,
        portal_area=c.portal_area * scale**2,
        vertex=c.vertex * scale,
    )
    scene = a.scene.with_points(a.scene.points * scale)
    avatar = (0.25 * scale, 1.6 * scale, 0.75 * scale)
    records = put_textures(db / "www")
    options = EmitOptions(avatar_size=avatar)
    emit(scene, cells, a.pvs, a.ach, records, db / "www", options)
    seal(db)
    assert findings(db) == []
    assert disagreements(db / "www") == []


def test_repeated_faults_are_summed_up(database: Path) -> None:
    nodes = "".join(f'Inline {{ url [ "no{n}.wrl" ] }}\n' for n in range(9))
    appended(C1, nodes.encode())(database)
    report = validate_database(database)
    repeated = [i for i in report.issues if i.code == "PTM-D671"]
    assert len(repeated) == 6
    assert (repeated[-1].message, repeated[-1].count) == ("4 more of these", 4)
    assert report.error_count == 10, "and one hash"


def test_findings_can_be_printed(database: Path) -> None:
    hinted(lambda d: d["textures"][0].update(fallback="\ud800\x1b[2J\n" + 10_000 * "x"))(database)
    lines = findings(database)
    assert len(lines) > 1
    for line in lines:
        assert line.isprintable()
        assert len(line) < 700


@pytest.mark.parametrize("workers", [1, 3])
def test_threads_change_nothing(database: Path, seal: Damage, workers: int) -> None:
    for damage in (flipped, appended(C0, b"{"), removed(C1), put("cells/notes.txt")):
        damage(database)
    report = validate_database(database, workers=workers)
    assert report == validate_database(database)
    assert len(report.issues) > 5


def test_what_is_too_large_is_not_looked_into(database: Path, finished: Path) -> None:
    limits = Limits(decoded_bytes=300)
    report = validate_database(finished, limits=limits)
    large = {i.file for i in report.issues if i.code == "PTM-D713"}
    assert "www/textures/a.ptm" in large, "a file of more bytes"
    assert "www/hints.json" in large
    assert {i.code for i in report.errors} == set()
    flipped(database)
    actual = {(i.code, i.file) for i in validate_database(database, limits=limits).issues}
    assert ("PTM-D652", "www/textures/a.ptm") in actual, "its hash is held against the manifest"
    small = validate_ptm(finished / "www/textures/a.ptm", limits=limits)
    assert [i.code for i in small.issues] == ["PTM-D713"], "texels of more bytes"


def test_single_file(finished: Path, tmp_path: Path) -> None:
    good = finished / "www/textures/a.ptm"
    assert validate_ptm(good).ok
    data = bytearray(good.read_bytes())
    data[-1] ^= 0x40
    bad = tmp_path / "bad.ptm"
    bad.write_bytes(data)
    assert [i.code for i in validate_ptm(bad).errors] == ["PTM-D710"]
    with pytest.raises(InputError, match="PTM-I122"):
        validate_ptm(tmp_path / "absent.ptm")


def test_no_folder(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="PTM-D001"):
        validate_database(tmp_path / "absent")


def test_every_code_is_planted_somewhere() -> None:
    tests = [*TESTS.glob("output/**/test_*.py"), *TESTS.glob("pipeline/test_*.py")]
    text = "\n".join(test.read_text() for test in tests)
    named = {*re.findall(r"\bD[678]\d\d\b", text), *(code for code, _ in KINDS.values())}
    assert {code.removeprefix("PTM-") for code in CODES} <= named
    assert {kind for kind in KINDS if not re.search(rf"\b{kind}\b", text)} == set()
