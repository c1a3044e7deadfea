"""A good database has no issue; every planted fault is found with its code."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.database import validate_database, validate_ptm
from ptmtools.database.findings import CODES
from ptmtools.errors import DatabaseError, InputError

Damage = Callable[[Path], None]


def codes(db: Path) -> set[str]:
    return {issue.code for issue in validate_database(db).issues}


def test_a_good_database_has_no_issue(finished: Path) -> None:
    report = validate_database(finished)
    assert report.issues == ()
    assert report.ok
    assert report.files == 9
    assert report.bytes == sum(
        p.stat().st_size for p in (finished / "www").rglob("*") if p.is_file()
    )


def replaced(name: str, pattern: str, new: str) -> Damage:
    """Replaces the first match in a served file; it must be there."""

    def damage(db: Path) -> None:
        path = db / "www" / name
        text, count = re.subn(pattern, new, path.read_text(), count=1, flags=re.DOTALL)
        assert count == 1, f"{pattern} is not in {name}"
        path.write_text(text)

    return damage


def appended(name: str, data: bytes) -> Damage:
    def damage(db: Path) -> None:
        path = db / "www" / name
        path.write_bytes(path.read_bytes() + data)

    return damage


def removed(name: str) -> Damage:
    return lambda db: (db / "www" / name).unlink()


def hinted(change: Callable[[dict], object]) -> Damage:
    """Changes hints.json."""

    def damage(db: Path) -> None:
        path = db / "www/hints.json"
        document = json.loads(path.read_text())
        change(document)
        path.write_text(json.dumps(document))

    return damage


def textured(shares: object) -> Damage:
    """Puts something in the place of the shares of textures of a cell that sees three."""
    return hinted(lambda d: d["cells"][2]["coverage"].update(textures=shares))


def painted(texture: object) -> Damage:
    """Says that this texture alone is what a cell sees."""

    def change(document: dict) -> None:
        cell = document["cells"][2]
        cell["coverage"]["textures"] = [[[texture, share]] for share in cell["ach"]]

    return hinted(change)


def repainted(db: Path) -> None:
    Image.fromarray(np.zeros((16, 24, 3), np.uint8)).save(db / "www/textures/a.png")


def flipped(db: Path) -> None:
    path = db / "www/textures/a.ptm"
    data = bytearray(path.read_bytes())
    data[-3] ^= 1
    path.write_bytes(data)


C0, C1 = "cells/c0000.wrl", "cells/c0001.wrl"

#: Each with a manifest written afterwards, so that no hash gives the fault away.
FAULTS: list[tuple[str, Damage]] = [
    ("PTM-D660", appended(C0, b"# \xff\n")),
    ("PTM-D661", replaced(C0, "solid FALSE", "solid false")),
    ("PTM-D661", replaced(C0, "diffuseColor", "specularColor")),
    ("PTM-D661", replaced(C0, r"DEF (\w+) Shape", r"DEF \1.x Shape")),
    ("PTM-D661", appended(C0, b"Transform { }\n")),
    ("PTM-D661", replaced(C0, r"(DEF \w+) Shape(.*)DEF \w+ Shape", r"\1 Shape\2\1 Shape")),
    ("PTM-D662", replaced(C0, r"point \[ [-.\d]+", "point [ NaN")),
    ("PTM-D662", replaced("root.wrl", r"position [-.\d]+", "position inf")),
    ("PTM-D662", replaced(C1, r"point \[ [-.\d]+", "point [ 1e39")),
    ("PTM-D663", replaced(C0, r"\n  ach  [^\n]*", "")),
    ("PTM-D663", replaced(C0, r"\nPTMCell \{.*?\n\}", "")),
    ("PTM-D663", replaced("root.wrl", r"NavigationInfo [^\n]*\n", "")),
    ("PTM-D670", replaced(C0, r"\.\./textures/a\.ptm", "../../secret.ptm")),
    ("PTM-D670", replaced(C0, r"\.\./textures/a\.ptm", "http://elsewhere/a.ptm")),
    ("PTM-D670", replaced(C0, r"\.\./textures/a\.ptm", "..%2f../a.ptm")),
    ("PTM-D671", replaced(C0, r"\.\./textures/a\.ptm", "../textures/A.ptm")),
    ("PTM-D672", removed(C1)),
    ("PTM-D680", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ 99")),
    ("PTM-D680", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ -2")),
    ("PTM-D680", replaced(C0, r"coordIndex \[ \d+ ", "coordIndex [ ")),
    ("PTM-D681", replaced(C0, r"texCoordIndex \[ \d+", "texCoordIndex [ 99")),
    ("PTM-D681", replaced(C0, r"(texCoordIndex \[ )\d+ \d+ \d+ -1,", r"\1")),
    ("PTM-D682", replaced(C0, r"diffuseColor [.\d]+", "diffuseColor 1.5")),
    ("PTM-D682", replaced(C1, r"color \[ 1 ", "color [ -1 ")),
    ("PTM-D682", replaced(C1, r"colorIndex \[ 0", "colorIndex [ 7")),
    ("PTM-D683", replaced(C0, r"(hullIndex [^]]*?)\d+ \d+ \d+ -1,", r"\1")),
    ("PTM-D683", replaced(C0, r"hullPoint   \[ 0 0 -2", "hullPoint   [ 2 2 0")),
    ("PTM-D684", replaced(C0, r"(point \[ [^]]*?)4 0 ", r"\g<1>5 0 ")),
    ("PTM-D690", replaced(C0, r'visibleUrl  \[ ("\w+.wrl"), ("\w+.wrl")', r"visibleUrl [ \2, \1")),
    ("PTM-D691", replaced(C0, r"ach         \[ [.\d]+,([.\d]+),[.\d]+", r"ach [ 0.8, \1")),
    ("PTM-D692", replaced(C0, r"\n  ach         \[ [^]]*\]", "\n ach [ 1.5, -0.25, -0.25 ]")),
    ("PTM-D693", replaced(C0, r"ach         \[ [.\d]+", "ach [ 0.69998")),
    ("PTM-D694", replaced(C0, r'adjacentUrl \[ "c0001.wrl" \]', "adjacentUrl [ ]")),
    ("PTM-D695", replaced(C0, r', "c0002.wrl" \]', " ]")),
    ("PTM-D696", replaced(C0, r'adjacentUrl \[ "c0001.wrl" \]', 'adjacentUrl [ "c0009.wrl" ]')),
    ("PTM-D697", replaced(C0, r', "c0002.wrl" \]', ', "c0001.wrl" ]')),
    ("PTM-D698", replaced(C0, r'cellName    "c0000"', 'cellName "c0002"')),
    ("PTM-D699", replaced("root.wrl", r'Inline \{ url \[ "cells/c0002[^\n]*\n', "")),
    ("PTM-D699", replaced("root.wrl", r"bboxSize 4 4 4", "bboxSize 4 3 4")),
    ("PTM-D699", replaced("root.wrl", r'viewpoint "VP_1"', 'viewpoint "VP_9"')),
    ("PTM-D700", replaced("hints.json", r'"unit":', '"units":')),
    ("PTM-D700", replaced("hints.json", r'"area":[.\d]+', '"area":NaN')),
    ("PTM-D700", replaced("hints.json", r'"visible":\[\d', '"visible":[77')),
    ("PTM-D700", appended("hints.json", b"}")),
    ("PTM-D701", hinted(lambda d: d["cells"][1]["visible"].reverse())),
    ("PTM-D701", hinted(lambda d: d["cells"][1]["ach"].reverse())),
    ("PTM-D701", hinted(lambda d: d["cells"][1]["textures"].pop())),
    ("PTM-D701", hinted(lambda d: d["cells"][1]["leaves"][0]["points"][0].reverse())),
    ("PTM-D702", hinted(lambda d: d["cells"][1]["ach"].__setitem__(0, 0.6 + 1e-8))),
    ("PTM-D702", hinted(lambda d: d["cells"][1]["ach"].pop())),
    ("PTM-D703", hinted(lambda d: d["cells"][2].__setitem__("missed", 2e-4))),
    ("PTM-D704", hinted(lambda d: d["textures"][0].__setitem__("sha256", "0" * 64))),
    ("PTM-D704", hinted(lambda d: d["textures"][0]["levels"].pop())),
    ("PTM-D705", hinted(lambda d: d["cells"][1]["portals"].pop())),
    ("PTM-D707", hinted(lambda d: d["cells"][0]["coverage"]["seen"].__setitem__(1, 1.5))),
    ("PTM-D707", hinted(lambda d: d["cells"][0]["coverage"]["seen"].__setitem__(1, 0))),
    ("PTM-D707", hinted(lambda d: d["cells"][1]["coverage"]["p95"].pop())),
    ("PTM-D707", hinted(lambda d: d["cells"][1]["coverage"]["p95"].__setitem__(0, None))),
    ("PTM-D707", hinted(lambda d: d["cells"][2]["coverage"]["views"].pop())),
    ("PTM-D707", hinted(lambda d: d["cells"][2]["coverage"]["views"][3].__setitem__(0, 0.5))),
    *(
        ("PTM-D707", textured(shares))
        for shares in (
            [[[0, 0.5]]] * 3,
            5,
            None,
            {},
            [[1], [2], [3]],
            [5, 6, 7],
            [[["a", "b"]], [], []],
            [[["0", 1]], [], []],
            [[[0, None]], [], []],
            [[[0, 1.5], [1, -0.5]], [], []],
            [[[True, 0.5]], [], []],
            [[[0, 0.5, 0.5]], [], []],
            [[[0, 0.5]], []],
        )
    ),
    *(("PTM-D707", painted(texture)) for texture in (2, -1, 0.0, True, "0", [])),
    ("PTM-D700", hinted(lambda d: d["cells"][2]["coverage"].pop("floor"))),
    ("PTM-D706", hinted(lambda d: d["viewpoints"][0].__setitem__("cell", 2))),
    ("PTM-D710", flipped),
    ("PTM-D710", appended("textures/a.ptm", b"x")),
    ("PTM-D711", repainted),
    ("PTM-D712", lambda db: (db / "www/textures/b.png").write_bytes(b"\x89PNG")),
]


@pytest.mark.parametrize(("code", "damage"), FAULTS, ids=lambda v: v if isinstance(v, str) else "")
def test_each_planted_fault_is_found(
    database: Path, seal: Damage, code: str, damage: Damage
) -> None:
    damage(database)
    seal(database)
    report = validate_database(database)
    found = {issue.code: issue for issue in report.issues}
    assert code in found, [str(i) for i in report.issues]
    assert found[code].severity == CODES[code][0]
    assert report.ok == (code == "PTM-D703")


@pytest.mark.parametrize("texture", [None, 0, 1])
def test_shares_of_known_textures_are_no_fault(
    database: Path, seal: Damage, texture: int | None
) -> None:
    painted(texture)(database)
    seal(database)
    assert codes(database) == set()


def test_what_the_manifest_says(database: Path) -> None:
    (database / "www/cells/c0001.wrl").unlink()
    flipped(database)
    (database / "www/notes.txt").write_text("mine")
    report = validate_database(database)
    told = {(i.code, i.file) for i in report.issues}
    assert ("PTM-D651", "www/cells/c0001.wrl") in told
    assert ("PTM-D652", "www/textures/a.ptm") in told
    assert ("PTM-D710", "www/textures/a.ptm") in told
    assert ("PTM-D653", "www/notes.txt") in told


@pytest.mark.parametrize(
    "manifest", [None, b"", b"[]", b'{"stages": 3}', b'{"stages": {"emit": {}}}', b"\xff"]
)
def test_a_bad_manifest(database: Path, manifest: bytes | None) -> None:
    path = database / "manifest.json"
    path.unlink()
    if manifest is not None:
        path.write_bytes(manifest)
    assert codes(database) == {"PTM-D650"}


def test_a_manifest_that_leads_outside(database: Path) -> None:
    path = database / "manifest.json"
    path.write_text(path.read_text().replace("www/root.wrl", "../root.wrl"))
    assert "PTM-D650" in codes(database)


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


def test_repeated_faults_are_summed_up(database: Path) -> None:
    path = database / "www/cells/c0001.wrl"
    path.write_text(re.sub(r" coordIndex \[ \d+", " coordIndex [ 99", path.read_text()))
    told = [i for i in validate_database(database).issues if i.code == "PTM-D680"]
    assert len(told) == 6
    assert told[-1].message == "4 more of these"


def test_single_file(finished: Path, tmp_path: Path) -> None:
    good = finished / "www/textures/a.ptm"
    assert validate_ptm(good).ok
    data = bytearray(good.read_bytes())
    data[-1] ^= 0x40
    bad = tmp_path / "bad.ptm"
    bad.write_bytes(data)
    assert [i.code for i in validate_ptm(bad).errors] == ["PTM-D710"]
    with pytest.raises(InputError, match="PTM-I602"):
        validate_ptm(tmp_path / "absent.ptm")


def test_no_folder(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="PTM-D605"):
        validate_database(tmp_path / "absent")


def test_every_code_is_documented() -> None:
    text = (Path(__file__).parents[2] / "docs/database.md").read_text()
    for code, (severity, meaning) in CODES.items():
        assert f"| {code} | {severity} | {meaning} |" in text
