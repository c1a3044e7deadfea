"""Each planted fault is found, in one file or between two."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest
from PIL import Image

from ptmtools.diagnostics import CODES
from ptmtools.output import validate_database
from tests.output.agreement import disagreements, kinds
from tests.output.damage import (
    Damage,
    all_of,
    appended,
    copied,
    expect,
    hinted,
    linked,
    put,
    removed,
    replaced,
    rewritten,
    zipped,
)
from tests.output.faults import (
    C0,
    C1,
    HINTS,
    LONG,
    R0,
    ROOT,
    STATISTICS,
    TRIANGLE,
    TWO_SHAPES,
    VISIBLE,
    A,
    S,
    cell,
    coarser,
    counted,
    findings,
    flipped,
    misplaced,
    moved,
    needed,
    painted,
    portal,
    recoded,
    repainted,
    shifted,
    textured,
    unused,
)

#: Kinds of differences between files (`tests.output.agreement`).
DIFFERENCES = frozenset(
    ["cell", "viewpoint", "root", "relation", "openings", "overlap"]
    + ["shares", "statistics", "texture", "box", "leaves", "portals", "viewpoint_place"]
    + ["vrml", "not_finite", "lacks", "coord_index", "tex_coord_index", "colour"]
    + ["hull", "outside_hull", "leaf_start", "ach_length"]
)
#: The codes that the check reports, and the kinds of differences between files, for each fault. The
#: manifest is written afterwards, so that no hash reveals the fault. Where a fault makes two files
#: contradict each other, both are named.
FAULTS: list[tuple[str, Damage]] = [
    ("D657 no_file", linked("textures/a.png", "/etc/hostname")),
    ("D657", linked("more", "/etc")),
    ("D657", linked("textures/up.png", "../../manifest.json")),
    ("special_file", lambda db: os.mkfifo(db / "www/pipe")),
    ("special_file", linked("more", "cells")),
    ("special_file", linked("more", "nothing")),
    ("special_file", linked("more", "more")),
    ("special_file", lambda db: socket.socket(socket.AF_UNIX).bind(os.path.relpath(db / "www/s"))),
    ("utf8 vrml", appended(C0, b"# \xff\n")),
    ("utf8 vrml", appended(C0, b"# \xed\xa0\x80\n")),
    ("D661 vrml", put(C0, b"")),
    ("vrml", replaced(C0, r"texture USE \w+", "texture USE nowhere")),
    ("vrml", replaced(C0, r"texture USE \w+", "texture USE C0_floor")),
    ("vrml", replaced(C0, r"coord Coordinate \{[^}]*\}", "coord USE C0_texture")),
    (
        "vrml",
        all_of(
            replaced(C0, r"geometry IndexedFaceSet", "geometry DEF G IndexedFaceSet"),
            appended(C0, b"Shape { geometry USE G }\n"),
        ),
    ),
    ("D661 vrml", rewritten(C0, lambda data: b"\xef\xbb\xbf" + data)),
    ("D661 vrml", rewritten(C0, lambda data: data.replace(b"\n", b"\r\n"))),
    ("D661 vrml", rewritten(C0, lambda data: data[: len(data) // 2])),
    ("vrml", rewritten(C0, lambda data: data + data)),
    ("vrml", replaced(C0, "solid FALSE", "solid false")),
    ("vrml", replaced(C0, "solid FALSE", "solid FALSE solid FALSE")),
    ("vrml", replaced(C0, "diffuseColor", "specularColor")),
    ("vrml", replaced(C0, r"diffuseColor ([.\d]+) ([.\d]+)", r"diffuseColor \1.\2")),
    ("vrml", replaced(C0, r"DEF (\w+) Shape", r"DEF \1.x Shape")),
    ("D661 vrml", replaced(C0, r"\[ ", "")),
    ("vrml", appended(C0, b"Transform { }\n")),
    ("D661 vrml", appended(C0, b'"')),
    ("vrml", appended(C0, "\u00a0".encode())),
    ("vrml", replaced(C0, r"(DEF \w+) Shape(.*)DEF \w+ Shape", r"\1 Shape\2\1 Shape")),
    ("vrml", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ 4294967296")),
    ("vrml", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ 0x0")),
    ("vrml", replaced(C0, r"(\n    coord [^\n]*)(\n    coordIndex [^\n]*)", r"\2\1")),
    ("vrml", replaced(C0, r"WorldInfo \{ \}", "Shape { }")),
    ("not_finite", replaced(C0, r"point \[ [-.\d]+", "point [ NaN")),
    ("not_finite", replaced(ROOT, r"position [-.\d]+", "position inf")),
    ("not_finite", replaced(C1, r"point \[ [-.\d]+", "point [ 1e39")),
    ("lacks", replaced(C0, r"\n  ach  [^\n]*", "")),
    ("lacks", replaced(C0, r"\nPTMCell \{.*?\n\}", "")),
    ("lacks", replaced(C0, r"\n    coord C[^\n]*", "")),
    ("tex_coord_index", replaced(C0, r" *texture USE[^\n]*\n", "")),
    ("lacks", replaced(ROOT, r"NavigationInfo [^\n]*\n", "")),
    ("lacks", replaced(ROOT, r"fieldOfView [.\d]+", "")),
    ("lacks", replaced(ROOT, "ptm:database 1", "ptm:database 2")),
    ("lacks root", replaced(ROOT, r"bboxSize [^}]*", "")),
    ("vrml", replaced(C0, "MFFloat  ach", "MFFloat  share")),
    ("lacks coord_index", all_of(*(replaced(C0, *change) for change in TWO_SHAPES))),
    (
        "lacks root viewpoint",
        replaced(ROOT, r"PTMViewpointCell \{ viewpoint \"VP_1\"", "PTMViewpointCell {"),
    ),
    ("leads_out cell", replaced(C0, r"\.\./textures/a\.ptm", "../../secret.ptm")),
    ("leads_out cell", replaced(C0, r"\.\./textures/a\.ptm", "http://elsewhere/a.ptm")),
    ("leads_out cell", replaced(C0, r"\.\./textures/a\.ptm", "//elsewhere/a.ptm")),
    ("leads_out cell", replaced(C0, r"\.\./textures/a\.ptm", "/etc/passwd")),
    ("leads_out cell", replaced(C0, r"\.\./textures/a\.ptm", "..%2f../a.ptm")),
    ("no_file cell", replaced(C0, r"\.\./textures/a\.ptm", "../textures/A.ptm")),
    ("no_file cell", replaced(HINTS, r'"textures/a\.png"', '"textures/c.png"')),
    ("no_file cell", replaced(C0, r"\.\./textures/a\.png", "../textures/%61.pn%67%00")),
    ("no_file root", removed(C1)),
    ("malformed_url cell", replaced(C0, r"\.\./textures/a\.ptm", "../textures/a.ptm?x")),
    ("malformed_url cell", replaced(C0, r"\.\./textures/a\.ptm", "../textures/a b.ptm")),
    ("malformed_url cell", replaced(C0, r"\.\./textures/a\.ptm", "../textures/%ff.ptm")),
    ("malformed_url cell", replaced(C0, r"\.\./textures/a\.ptm", "")),
    ("twice D708 statistics", hinted(lambda d: d["textures"].append(d["textures"][0]))),
    (
        "twice index cell viewpoint viewpoint_place openings relation box",
        hinted(lambda d: d["cells"][2].update(name="c0001")),
    ),
    ("cell", replaced(C0, r"\.\./textures/a\.png", "../textures/a.ptm")),
    ("D675 D677", all_of(copied(A, "textures/A.ptm"), copied("textures/a.png", "textures/A.png"))),
    ("D675", put("Cells/c0000.txt")),
    ("D676", zipped(C0, lambda data: data[:-9])),
    ("D676", zipped(C0, lambda data: data[:40])),
    ("D676", zipped(C0, lambda data: data + b"x")),
    ("D676", zipped(C0, lambda data: data[:-6] + bytes(2) + data[-4:])),
    ("D676", zipped(C0, lambda data: LONG)),
    ("D676", zipped(C0, lambda data: b"")),
    ("D676", put("nothing.wrl.gz", LONG)),
    ("D676", all_of(zipped(C0), appended(C0, b"\n"))),
    ("D677", copied("textures/a.png", "textures/z.png")),
    ("coord_index", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ 99")),
    ("coord_index", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ -2")),
    ("coord_index", replaced(C0, rf"coordIndex \[ \d+{S}", "coordIndex [ ")),
    ("coord_index", replaced(C0, rf"coordIndex \[ (\d+){S}\d+", r"coordIndex [ \1 \1")),
    ("tex_coord_index", replaced(C0, r"texCoordIndex \[ \d+", "texCoordIndex [ 99")),
    ("tex_coord_index", replaced(C0, rf"(texCoordIndex \[ ){TRIANGLE}", r"\1")),
    ("colour", replaced(C0, r"diffuseColor [.\d]+", "diffuseColor 1.5")),
    ("colour", replaced(C0, r"transparency [.\d]+", "transparency -0.5")),
    ("colour", replaced(C1, r"color \[ 1 ", "color [ -1 ")),
    ("colour", replaced(C1, r"colorIndex \[ 0", "colorIndex [ 7")),
    ("colour", replaced(C1, r"colorPerVertex FALSE", "colorPerVertex TRUE")),
    ("hull", replaced(C0, rf"(hullIndex +\[ ){TRIANGLE}", r"\1")),
    ("hull", replaced(C0, rf"(hullIndex +\[ )(\d+){S}(\d+)", r"\1\3 \2")),
    ("hull", replaced(C0, r"hullPoint +\[ 0 0 -2", "hullPoint   [ 2 2 0")),
    ("hull", replaced(C0, r"hullIndex +\[ \d[^]]*\]", "hullIndex [ ]")),
    ("outside_hull root", replaced(C0, r"(point \[ [^]]*?)4 0 ", r"\g<1>5 0 ")),
    ("cell", replaced(C0, VISIBLE, r"visibleUrl [ \2, \1, \3 ]")),
    (
        "ach_length cell",
        replaced(C0, VISIBLE, "visibleUrl [ ]"),
    ),
    ("ach_length cell", replaced(C0, rf"ach +\[ [.\d]+{S}([.\d]+){S}[.\d]+", r"ach [ 0.8, \1")),
    ("cell", replaced(C0, r"\n  ach +\[ [^]]*\]", "\n ach [ 1.5, -0.25, -0.25 ]")),
    ("cell", replaced(C0, r"ach +\[ [.\d]+", "ach [ 0.69998")),
    ("cell", replaced(C0, r'adjacentUrl \[ "c0001.wrl" \]', "adjacentUrl [ ]")),
    ("ach_length cell", replaced(C0, VISIBLE, r"visibleUrl [ \1, \2 ]")),
    (
        "no_file cell",
        replaced(C0, 'adjacentUrl \\[ "c0001', 'adjacentUrl [ "c0009'),
    ),
    ("cell", replaced(C0, VISIBLE, r"visibleUrl [ \1, \2, \2 ]")),
    ("cell", replaced(C0, VISIBLE, r"visibleUrl [ \1, \3, \2 ]")),
    ("cell", replaced(C0, 'adjacentUrl \\[ "c0001', 'adjacentUrl [ "c0000.wrl", "c0001')),
    ("cell", replaced(C0, r'cellName +"c0000"', 'cellName "c0002"')),
    ("root", replaced(ROOT, r'Inline \{ url \[ "cells/c0002[^\n]*\n', "")),
    ("root", replaced(ROOT, r'(Inline \{ url \[ "cells/c0002[^\n]*\n)', r"\1\1")),
    ("root", replaced(ROOT, r"bboxSize 4 4 4", "bboxSize 4 3 4")),
    ("root viewpoint", replaced(ROOT, r'viewpoint "VP_1"', 'viewpoint "VP_9"')),
    ("root", replaced(ROOT, "ptm:viewpoint VP_1", "ptm:viewpoint VP_9")),
    ("D700", put(HINTS, b"")),
    ("D700", put(R0, b"")),
    ("D700", put(STATISTICS, b"")),
    ("D700", rewritten(HINTS, lambda data: b"\xef\xbb\xbf" + data)),
    ("D700", rewritten(HINTS, lambda data: data.replace(b'"c0000', b'"c\xff000'))),
    ("D700", rewritten(HINTS, lambda data: data[:-3])),
    ("D700", replaced(HINTS, r'"unit":', '"units":')),
    ("D700", replaced(HINTS, r'"unit":', '"up": "y", "unit":')),
    ("D700", replaced(HINTS, r'"schema":3', '"schema":3.0')),
    ("D700", replaced(R0, r'"area":[.\d]+', '"area":NaN')),
    ("D700", replaced(R0, r'"area":[.\d]+', '"area":1e999')),
    ("D700", replaced(R0, r'"visible":\[\d', '"visible":[77')),
    ("D700", appended(HINTS, b"}")),
    ("D700", put(HINTS, b"[" * 100_000)),
    ("D700", put(R0, b"[]")),
    ("D700", cell(0, lambda c: c["ach"].__setitem__(0, 1.5))),
    ("D700 leaves", cell(0, lambda c: c["leaves"][0]["faces"][0].append(99))),
    ("D700 openings", cell(0, lambda c: c["portals"][0].update(neighbour=3))),
    ("D700 relation", cell(0, lambda c: c["textures"][2].append(2))),
    ("D700", cell(2, lambda c: c.pop("floor"))),
    ("D700", counted(2, lambda c: c["views"].pop())),
    ("D700", counted(1, lambda c: c["p95"].__setitem__(0, None))),
    ("D700", counted(0, lambda c: c["seen"].__setitem__(1, 1.5))),
    ("D700", hinted(lambda d: d["viewpoints"][0].update(cell=True))),
    ("D700", hinted(lambda d: d["viewpoints"][0].update(cell=3))),
    ("D700", hinted(lambda d: d["textures"][0].update(sha256="0" * 63), STATISTICS)),
    ("D700", hinted(lambda d: d.update(record="hints/c0000.json"))),
    ("index cell", cell(1, lambda c: c.update(name="c0007"))),
    ("cell", cell(1, lambda c: c["ach"].reverse())),
    ("cell relation", cell(1, lambda c: c["textures"][0].pop())),
    ("leaves box cell", cell(1, lambda c: c["leaves"][0]["points"][0].reverse())),
    ("own_first cell relation", cell(1, lambda c: c["visible"].reverse())),
    ("record_ach statistics cell", cell(1, lambda c: c["ach"].pop())),
    ("record_ach", cell(1, lambda c: c["textures"].pop())),
    ("order cell", cell(1, lambda c: c["adjacent"].reverse())),
    ("cell openings relation", cell(1, lambda c: c["adjacent"].pop())),
    ("record_ach", cell(1, lambda c: c["ach"].__setitem__(0, 0.6 + 1e-8))),
    ("D703", counted(2, lambda c: c.update(missed=2e-4))),
    ("texture", hinted(lambda d: d["textures"][0].update(sha256="0" * 64), STATISTICS)),
    ("D704", hinted(lambda d: d["textures"][0]["ends"].pop())),
    ("D704", hinted(lambda d: d["textures"][0].update(texelBytes=1))),
    ("D704", hinted(lambda d: d["textures"][0].update(gpuTexelBytes=3))),
    ("D704 texture", hinted(lambda d: d["textures"][0]["differences"].pop())),
    ("texture", hinted(lambda d: d["textures"][0]["differences"].sort(reverse=True))),
    ("D704 texture", hinted(lambda d: d["textures"][0].update(offsets=[1]))),
    ("D700", hinted(lambda d: d["textures"][0].update(offsets=[256]))),
    ("texture", hinted(lambda d: d["textures"][1]["color"].reverse())),
    ("D700", hinted(lambda d: d["textures"][1]["color"].__setitem__(0, 256))),
    ("D700", hinted(lambda d: d["textures"][1]["differences"].__setitem__(1, -1))),
    ("D704", hinted(lambda d: d["textures"][0]["ends"].__setitem__(1, 1))),
    ("D704", hinted(lambda d: d["textures"][0].update(width=23))),
    ("D704", hinted(lambda d: d["textures"][0].update(components=4))),
    ("D704 texture", hinted(lambda d: d["textures"][0].update(fallbackLevel=0))),
    ("D704", hinted(lambda d: d["textures"][0].update(fallbackLevel=99))),
    ("D704", hinted(lambda d: d["textures"][0].update(fallbackLevel=None))),
    ("D704 texture", coarser(1)),
    ("texture", recoded(lambda texels: texels[:, ::-1])),
    ("openings", cell(1, lambda c: c["portals"].pop())),
    ("openings", portal(lambda row: row.update(area=99.0))),
    ("portals", portal(lambda row: moved(row, 0, 0, 0.1))),
    ("portals", portal(lambda row: shifted(row, 5.0))),
    ("openings", portal(lambda row: row["polygon"].append(row["polygon"][0]))),
    ("portals", portal(lambda row: row["polygon"].reverse())),
    ("portals openings", cell(0, lambda c: c["portals"][0]["polygon"].reverse())),
    ("openings", cell(0, lambda c: c["portals"][0].update(area=1.0))),
    ("viewpoint_place viewpoint", hinted(lambda d: d["viewpoints"][0].update(cell=2))),
    ("viewpoint", hinted(lambda d: d["viewpoints"][0].update(name="VP_7"))),
    (
        "viewpoint_place viewpoint",
        hinted(lambda d: d["viewpoints"][0]["position"].__setitem__(0, 99.0)),
    ),
    ("viewpoint", hinted(lambda d: d["viewpoints"][0].update(fieldOfView=1.0))),
    ("viewpoint", hinted(lambda d: d["viewpoints"][0]["direction"].reverse())),
    ("viewpoint", hinted(lambda d: d["viewpoints"].pop())),
    ("statistics", counted(0, lambda c: c["seen"].__setitem__(1, 0))),
    ("statistics", counted(1, lambda c: c["p95"].pop())),
    ("statistics", counted(2, lambda c: c["views"][3].__setitem__(0, 0.5))),
    ("shares", textured([[[0, 0.5]]] * 3)),
    ("record_ach", textured([[[0, 0.8]], [[0, 0.1]]])),
    ("D708", unused),
    ("leaves box cell", cell(1, lambda c: c["leaves"][0]["points"][0].__setitem__(1, -1.0))),
    ("leaves", cell(1, lambda c: c["leaves"][0]["faces"].pop())),
    ("leaves", cell(1, lambda c: c["leaves"][0]["faces"][0].reverse())),
    ("leaves", cell(1, lambda c: [loop.reverse() for loop in c["leaves"][0]["faces"]])),
    ("portals viewpoint_place box cell overlap", misplaced),
    ("D710", flipped),
    ("D710 texture", appended(A, b"x")),
    ("D710 texture", rewritten(A, lambda data: data[:-1])),
    ("D710", put(A, b"")),
    ("texture", repainted),
    (
        "fallback_differs texture",
        lambda db: Image.new("RGB", (300, 200)).save(db / "www/textures/a.png"),
    ),
    ("fallback_unreadable", put("textures/b.png", b"\x89PNG")),
    ("fallback_unreadable", put("textures/b.png", b"")),
    ("fallback_unreadable", rewritten("textures/b.png", lambda data: data[:-20])),
    *(
        ("D700", textured(shares))
        for shares in (
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
        )
    ),
    *(("D700", painted(texture)) for texture in (2, -1, 0.0, True, "0", [])),
    *(
        ("other_schema", hinted(lambda d: d.update(schema=1), name))
        for name in (HINTS, R0, STATISTICS)
    ),
    ("other_schema", hinted(lambda d: d.update(schema=4, cells="of another kind"))),
    ("shares", needed([[1, 0, 0.2], [0, 0, 0.3]])),
    ("shares", needed([[0, 0, 0.2], [0, 0, 0.3]])),
    ("needs", needed([[0, 3, 0.2, 0.1, 0.1]])),
    ("shares", needed([[0, 0, 0.1, 0.2]])),
    ("shares", needed([[0, 0, 0.5], [1, 0, 0.52]])),
    ("D700 shares", needed([[2, 0, 0.1]])),
    ("D700", needed([[0, 0, 0]])),
    ("D700", needed([[0, 0]])),
    ("index", cell(0, lambda c: c.update(cell=1))),
    ("index", hinted(lambda d: d.update(record="cells/{name}.wrl"))),
    ("twice index", hinted(lambda d: d.update(record="hints/{name}/../statistics.json"))),
    ("twice index", hinted(lambda d: d.update(record="{name}/../hints.json"))),
    ("relation", cell(0, lambda c: c["textures"][1].pop())),
    ("box", hinted(lambda d: d["cells"][1]["box"].__setitem__(3, -0.5))),
    ("statistics", hinted(lambda d: d["cells"].pop(), STATISTICS)),
    ("statistics", hinted(lambda d: d["textures"].pop(), STATISTICS)),
    ("index", hinted(lambda d: d.update(geometry={"gltf": "cells/{name}.wrl"}))),
    ("index", hinted(lambda d: d["geometry"].clear())),
    ("no_file", hinted(lambda d: d["geometry"].update(usd="usd/{name}.usd"))),
    ("no_file", removed(R0)),
    ("no_file", removed(STATISTICS)),
]


@pytest.mark.parametrize(
    ("expected", "damage"), FAULTS, ids=lambda v: v if isinstance(v, str) else ""
)
def test_each_planted_fault_is_found(
    database: Path, seal: Damage, expected: str, damage: Damage, monkeypatch
) -> None:
    monkeypatch.chdir(database)  # a socket's name may not be long
    damage(database)
    seal(database)
    report = validate_database(database)
    differences = {word for word in expected.split() if word in DIFFERENCES}
    expect(report.issues, " ".join(word for word in expected.split() if word not in differences))
    assert kinds(database / "www") == differences, disagreements(database / "www")
    assert report.ok == all(CODES[i.code][0] == "warning" for i in report.issues)


def test_symmetry_in_the_hints_alone(database: Path) -> None:
    """Relations that a client of the hints relies on are compared there, too."""
    cell(0, lambda c: c["visible"].remove(2))(database)
    cell(0, lambda c: c["adjacent"].append(2))(database)
    lines = disagreements(database / "www")
    for line in (
        "relation: 2: 0 is visible, but not the reverse",
        "relation: 0: 2 is adjacent, but not the reverse",
        "relation: 0: {2} adjacent, but not visible",
    ):
        assert line in lines


def test_fields_of_later_releases_are_passed_over(database: Path, seal: Damage) -> None:
    for name in (HINTS, R0, STATISTICS):
        hinted(lambda d: d.update(crowded=False, more={"a": [1]}), name)(database)
    hinted(lambda d: [c.update(crowded=False) for c in d["cells"]])(database)
    seal(database)
    assert findings(database) == []


def test_a_viewpoint_is_where_one_can_stand(database: Path, seal: Damage) -> None:
    hinted(lambda d: d["cells"][d["viewpoints"][0]["cell"]].update(standing=False))(database)
    seal(database)
    assert {issue.code for issue in validate_database(database).issues} == {"PTM-D699"}


def test_hints_of_another_schema_name_the_command(database: Path, seal: Damage) -> None:
    hinted(lambda d: d.update(schema=1))(database)
    seal(database)
    (line,) = findings(database)
    assert "schema: error: is 1, this ptmtools reads 3; `ptm build-scene`" in line


@pytest.mark.parametrize("texture", [None, 0, 1])
def test_shares_of_known_textures_are_no_fault(
    database: Path, seal: Damage, texture: int | None
) -> None:
    painted(texture)(database)
    seal(database)
    assert findings(database) == []
