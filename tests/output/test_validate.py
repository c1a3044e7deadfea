"""A good database has no issue; every planted fault is found with its code and no other."""

from __future__ import annotations

import gzip
import hashlib
import json
import os
import re
import shutil
import socket
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import DatabaseError, InputError
from ptmtools.output import EmitOptions, emit, validate_database, validate_ptm
from ptmtools.output.validation.findings import CODES
from ptmtools.texture import EncodeOptions, Limits, decode, encode, read_header
from ptmtools.visibility.model import Pvs
from tests.output.agreement import disagreements, kinds, wrong_counts
from tests.output.damage import (
    KINDS,
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

TESTS = Path(__file__).parents[1]
FALLBACK_FREE = EmitOptions(fallback=False, format="vrml")


def codes(db: Path) -> set[str]:
    return {issue.code for issue in validate_database(db).issues}


def findings(db: Path) -> list[str]:
    return [str(issue) for issue in validate_database(db).issues]


# Good databases


def test_a_good_database_has_no_issue(finished: Path) -> None:
    report = validate_database(finished)
    assert report.issues == ()
    assert disagreements(finished / "www") == []
    assert report.ok
    assert report.files == 16
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
    differences = {word for word in expected.split() if word == "cell"}
    expect(validate_database(db).issues, expected.removesuffix("cell"))
    assert kinds(db / "www") == differences


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


# Faults, and what plants them


def coarser(level: int) -> Damage:
    """The fallback image of the first texture holds another level."""

    def damage(db: Path) -> None:
        data = (db / "www/textures/a.ptm").read_bytes()
        level_number = range(len(read_header(data).levels))[level]
        Image.fromarray(decode(data, level_number)).save(db / "www/textures/a.png")

    return damage


def recoded(change: Callable[[np.ndarray], np.ndarray], **options: object) -> Damage:
    """Another `.ptm` for the first texture, of which only sizes and hash are brought up to date."""

    def damage(db: Path) -> None:
        path = db / "www/textures/a.ptm"
        path.write_bytes(encode(change(decode(path.read_bytes())), EncodeOptions(**options)))

    return damage


def cell(number: int, change: Callable[[dict], object]) -> Damage:
    """Changes the record of a cell."""
    return hinted(change, f"hints/c{number:04d}.json")


def counted(number: int, change: Callable[[dict], object]) -> Damage:
    """Changes the statistics of a cell."""
    return hinted(lambda d: change(d["cells"][number]), STATISTICS)


def portal(change: Callable[[dict], object]) -> Damage:
    """Changes the portal between the first two rooms, on both sides."""

    def of(beyond: int) -> Callable[[dict], object]:
        return lambda c: [change(row) for row in c["portals"] if row["neighbour"] == beyond]

    return all_of(cell(0, of(1)), cell(1, of(0)))


def moved(row: dict, corner: int, axis: int, by: float) -> None:
    """Moves the same corner of a polygon, whichever way it runs."""
    ordered = sorted(range(len(row["polygon"])), key=lambda i: row["polygon"][i])
    row["polygon"][ordered[corner]][axis] += by


def shifted(row: dict, by: float) -> None:
    for point in row["polygon"]:
        point[2] += by


def painted(texture: object) -> Damage:
    """Says that this texture alone is what a cell sees."""
    return cell(2, lambda c: c.update(textureShares=[[[texture, share]] for share in c["ach"]]))


def textured(shares: object) -> Damage:
    """Puts something in the place of the shares of textures of a cell that sees three."""
    return cell(2, lambda c: c.update(textureShares=shares))


def needed(rows: object) -> Damage:
    """Says how fine a cell needs textures."""
    return cell(1, lambda c: c.update(need=rows))


def repainted(db: Path) -> None:
    Image.fromarray(np.zeros((16, 24, 3), np.uint8)).save(db / "www/textures/a.png")


flipped = rewritten("textures/a.ptm", lambda data: data[:-3] + bytes([data[-3] ^ 1]) + data[-2:])


def misplaced(db: Path) -> None:
    """The second room where the first one is."""
    first = json.loads((db / "www" / R0).read_text())
    cell(1, lambda c: c.update(leaves=first["leaves"]))(db)


def unused(db: Path) -> None:
    """A texture that all files list, and no cell uses."""
    for number in range(3):
        path = db / f"www/cells/c{number:04d}.wrl"
        text = path.read_text()
        path.write_text(text.replace("textures/b.", "textures/a."))
        cell(number, lambda c: c.update(textures=[[0] if t else [] for t in c["textures"]]))(db)


#: Between the entries of a list.
S = r"[\s,]+"
C0, C1, C2 = "cells/c0000.wrl", "cells/c0001.wrl", "cells/c0002.wrl"
HINTS, ROOT, A = "hints.json", "root.wrl", "textures/a.ptm"
R0, STATISTICS = "hints/c0000.json", "hints/statistics.json"
TRIANGLE = rf"\d+{S}\d+{S}\d+{S}-1{S}"
VISIBLE = r'visibleUrl +\[ ("\w+.wrl"), ("\w+.wrl"), ("\w+.wrl") \]'
#: One shape lacks its points, another has an index too large.
TWO_SHAPES = (r"\n    coord C[^\n]*", ""), (r"(.*coordIndex \[ )\d+", r"\g<1>99")
#: A bomb: a thousand times as long as it is.
LONG = gzip.compress(bytes(1 << 22))

#: Kinds of differences between files (`tests.output.agreement`).
DIFFERENCES = frozenset(
    ["cell", "viewpoint", "root", "relation", "openings", "overlap"]
    + ["shares", "statistics", "texture", "bundle"]
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
    ("utf8", appended(C0, b"# \xff\n")),
    ("utf8", appended(C0, b"# \xed\xa0\x80\n")),
    ("D661", put(C0, b"")),
    ("D661", replaced(C0, r"texture USE \w+", "texture USE nowhere")),
    ("D661", replaced(C0, r"texture USE \w+", "texture USE C0_floor")),
    ("D661", replaced(C0, r"coord Coordinate \{[^}]*\}", "coord USE C0_texture")),
    (
        "D661",
        all_of(
            replaced(C0, r"geometry IndexedFaceSet", "geometry DEF G IndexedFaceSet"),
            appended(C0, b"Shape { geometry USE G }\n"),
        ),
    ),
    ("D661", rewritten(C0, lambda data: b"\xef\xbb\xbf" + data)),
    ("D661", rewritten(C0, lambda data: data.replace(b"\n", b"\r\n"))),
    ("D661", rewritten(C0, lambda data: data[: len(data) // 2])),
    ("D661", rewritten(C0, lambda data: data + data)),
    ("D661", replaced(C0, "solid FALSE", "solid false")),
    ("D661", replaced(C0, "solid FALSE", "solid FALSE solid FALSE")),
    ("D661", replaced(C0, "diffuseColor", "specularColor")),
    ("D661", replaced(C0, r"diffuseColor ([.\d]+) ([.\d]+)", r"diffuseColor \1.\2")),
    ("D661", replaced(C0, r"DEF (\w+) Shape", r"DEF \1.x Shape")),
    ("D661", replaced(C0, r"\[ ", "")),
    ("D661", appended(C0, b"Transform { }\n")),
    ("D661", appended(C0, b'"')),
    ("D661", appended(C0, "\u00a0".encode())),
    ("D661", replaced(C0, r"(DEF \w+) Shape(.*)DEF \w+ Shape", r"\1 Shape\2\1 Shape")),
    ("D661", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ 4294967296")),
    ("D661", replaced(C0, r"coordIndex \[ \d+", "coordIndex [ 0x0")),
    ("D661", replaced(C0, r"(\n    coord [^\n]*)(\n    coordIndex [^\n]*)", r"\2\1")),
    ("D661", replaced(C0, r"WorldInfo \{ \}", "Shape { }")),
    ("not_finite", replaced(C0, r"point \[ [-.\d]+", "point [ NaN")),
    ("not_finite", replaced(ROOT, r"position [-.\d]+", "position inf")),
    ("not_finite", replaced(C1, r"point \[ [-.\d]+", "point [ 1e39")),
    ("lacks", replaced(C0, r"\n  ach  [^\n]*", "")),
    ("lacks", replaced(C0, r"\nPTMCell \{.*?\n\}", "")),
    ("lacks", replaced(C0, r"\n    coord C[^\n]*", "")),
    ("lacks", replaced(C0, r" *texture USE[^\n]*\n", "")),
    ("lacks", replaced(ROOT, r"NavigationInfo [^\n]*\n", "")),
    ("lacks", replaced(ROOT, r"fieldOfView [.\d]+", "")),
    ("lacks", replaced(ROOT, "ptm:database 1", "ptm:database 2")),
    ("lacks root", replaced(ROOT, r"bboxSize [^}]*", "")),
    ("lacks", replaced(C0, "MFFloat  ach", "MFFloat  share")),
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
        "twice index cell viewpoint openings relation",
        hinted(lambda d: d["cells"][2].update(name="c0001")),
    ),
    ("twice cell", replaced(C0, r"\.\./textures/a\.png", "../textures/a.ptm")),
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
    ("D700", replaced(HINTS, r'"schema":2', '"schema":2.0')),
    ("D700", replaced(R0, r'"area":[.\d]+', '"area":NaN')),
    ("D700", replaced(R0, r'"area":[.\d]+', '"area":1e999')),
    ("D700", replaced(R0, r'"visible":\[\d', '"visible":[77')),
    ("D700", appended(HINTS, b"}")),
    ("D700", put(HINTS, b"[" * 100_000)),
    ("D700", put(R0, b"[]")),
    ("D700", cell(0, lambda c: c["ach"].__setitem__(0, 1.5))),
    ("D700", cell(0, lambda c: c["leaves"][0]["faces"][0].append(99))),
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
    ("leaves index cell", cell(1, lambda c: c["leaves"][0]["points"][0].reverse())),
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
    ("bundle texture", recoded(lambda texels: texels[:, ::-1])),
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
    ("D708 first_look", unused),
    ("leaves index cell", cell(1, lambda c: c["leaves"][0]["points"][0].__setitem__(1, -1.0))),
    ("leaves", cell(1, lambda c: c["leaves"][0]["faces"].pop())),
    ("leaves", cell(1, lambda c: c["leaves"][0]["faces"][0].reverse())),
    ("leaves", cell(1, lambda c: [loop.reverse() for loop in c["leaves"][0]["faces"]])),
    ("portals viewpoint_place index cell overlap", misplaced),
    ("D710", flipped),
    ("D710 texture", appended(A, b"x")),
    ("D710 texture", rewritten(A, lambda data: data[:-1])),
    ("D710 bundle", put(A, b"")),
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
    ("other_schema", hinted(lambda d: d.update(schema=3, cells="of another kind"))),
    ("first_look", hinted(lambda d: d.pop("firstLook"))),
    ("first_look", cell(0, lambda c: c.pop("firstLook"))),
    ("first_look bundle", cell(0, lambda c: c["firstLook"].pop())),
    ("bundle", cell(0, lambda c: c["firstLook"].reverse())),
    ("first_look", cell(0, lambda c: c["firstLook"].append(c["firstLook"][-1]))),
    ("first_look", cell(0, lambda c: c["firstLook"][0].__setitem__(1, 99))),
    ("D700", cell(0, lambda c: c["firstLook"][0].__setitem__(0, 2))),
    ("first_look bundle", rewritten("hints/c0001.bin", lambda data: data[:-1])),
    ("first_look bundle", appended("hints/c0001.bin", b"x")),
    ("bundle", rewritten("hints/c0001.bin", lambda data: data[:9] + b"x" + data[10:])),
    ("no_file", removed("hints/c0001.bin")),
    ("needs", needed([[1, 0, 0.2], [0, 0, 0.3]])),
    ("needs", needed([[0, 0, 0.2], [0, 0, 0.3]])),
    ("needs", needed([[0, 3, 0.2, 0.1, 0.1]])),
    ("shares", needed([[0, 0, 0.1, 0.2]])),
    ("shares", needed([[0, 0, 0.5], [1, 0, 0.52]])),
    ("D700", needed([[2, 0, 0.1]])),
    ("D700", needed([[0, 0, 0]])),
    ("D700", needed([[0, 0]])),
    ("index", cell(0, lambda c: c.update(cell=1))),
    ("index", hinted(lambda d: d.update(record="cells/{name}.wrl"))),
    ("twice index", hinted(lambda d: d.update(record="hints/{name}/../statistics.json"))),
    ("twice index", hinted(lambda d: d.update(record="{name}/../hints.json"))),
    ("relation", cell(0, lambda c: c["textures"][1].pop())),
    ("index", hinted(lambda d: d["cells"][1]["box"].__setitem__(3, -0.5))),
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
    assert "schema: error: is 1, this ptmtools reads 2; `ptm build-scene`" in line


@pytest.mark.parametrize("texture", [None, 0, 1])
def test_shares_of_known_textures_are_no_fault(
    database: Path, seal: Damage, texture: int | None
) -> None:
    painted(texture)(database)
    seal(database)
    assert findings(database) == []


# Faults of which the manifest is the witness


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
        b'{"format": "ptmtools database", "schema": 2, "model": "a", "stages": {}, "stages": {}}',
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


# The report


def test_repeated_faults_are_summed_up(database: Path) -> None:
    path = database / "www/cells/c0001.wrl"
    path.write_text(re.sub(r" coordIndex \[ \d+", " coordIndex [ 99", path.read_text()))
    report = validate_database(database)
    repeated = [i for i in report.issues if i.code == "PTM-D661"]
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
