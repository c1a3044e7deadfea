"""Octree textures in a database: what the hints say of them, and every fault planted there."""

from __future__ import annotations

import json
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.output import EmitExtras, EmitOptions, emit, validate_database
from ptmtools.output.names import HINTS
from ptmtools.output.representation import Represented
from ptmtools_systems.apo.declarations import OCTREES
from ptmtools_systems.apo.files import encode_stream
from ptmtools_systems.stages.apo import OctreeRecord
from tests.output.agreement import disagreements
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
    rewritten,
)
from tests.systems.apo.building import ball

LOW, SIDE = (1.0, 0.5, -0.25), 1.5
#: What they are of, and how deep.
OBJECTS = (("Statue ü", "Statue_u", 4), ("Statue ü", "Statue_u_2", 0))
FIRST = "apo/Statue_u.bin"


def put_octrees(www: Path) -> Represented:
    (www / "apo").mkdir()
    records = []
    for number, (name, stem, depth) in enumerate(OBJECTS):
        octree = ball(depth, LOW, SIDE)
        data, levels = encode_stream(octree.texels, octree)
        (www / f"apo/{stem}.bin").write_bytes(data)
        counts = tuple(np.diff(octree.start).tolist())
        ends, checks = tuple(levels["ends"]), tuple(levels["crc32"])
        file = f"apo/{stem}.bin"
        records.append(OctreeRecord(name, number, file, LOW, SIDE, counts, ends, checks))
    rows = [record.row() for record in records]
    return Represented(tuple(range(len(rows))), OCTREES, rows)


@pytest.fixture(scope="module")
def whole(artifacts, tmp_path_factory, put_textures, seal) -> Path:
    db = tmp_path_factory.mktemp("octrees") / "db"
    a, textures = artifacts, put_textures(db / "www")
    octrees = put_octrees(db / "www")
    options = EmitOptions(format="vrml")
    emit(
        a.scene,
        a.cells,
        a.pvs,
        a.ach,
        textures,
        db / "www",
        options,
        EmitExtras(represented=(octrees,)),
    )
    seal(db)
    return db


@pytest.fixture
def db(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "db"))


def test_the_hints_name_them(whole: Path) -> None:
    assert validate_database(whole).issues == ()
    assert disagreements(whole / "www") == []
    first, second = json.loads((whole / "www" / HINTS).read_text())["octrees"]
    octree = ball(4, LOW, SIDE)
    assert first["object"] == second["object"] == "Statue ü"
    assert first["cube"] == {"low": list(LOW), "side": SIDE}
    data = (whole / "www" / first["file"]).read_bytes()
    assert len(data) == first["ends"][-1]
    for k, (end, texels) in enumerate(zip(first["ends"], first["levels"], strict=True)):
        held = zlib.decompressobj().decompress(data[:end])
        assert held == octree.texels[: sum(first["levels"][: k + 1])].tobytes()
        assert zlib.crc32(held[-4 * texels :]) == first["crc32"][k]
    assert second["levels"] == [1]


def test_without_any_the_hints_say_nothing(finished: Path) -> None:
    assert "octrees" not in json.loads((finished / "www" / HINTS).read_text())


def row(change: Callable[[dict[str, Any]], object], number: int = 0) -> Damage:
    return hinted(lambda d: change(d["octrees"][number]))


def restreamed(change: Callable[[np.ndarray], object]) -> Damage:
    """Other texels under checksums that are right."""

    def damage(db: Path) -> None:
        octree = ball(4, LOW, SIDE)
        texels = octree.texels.copy()
        change(texels)
        data, levels = encode_stream(texels, octree)
        (db / "www" / FIRST).write_bytes(data)
        row(lambda r: r.update(levels))(db)

    return damage


def at(index: tuple[int, int], value: int) -> Callable[[np.ndarray], object]:
    return lambda texels: texels.__setitem__(index, value)


@hinted
def longer(document: dict[str, Any]) -> None:
    """The last level is said to have more texels and bytes than it has."""
    row = document["octrees"][0]
    row["ends"][-1] += 2
    row["levels"][-1] += 1


FAULTS: list[tuple[str, Damage]] = [
    ("no_file", removed(FIRST)),
    ("no_file octree_unnamed", row(lambda r: r.update(file="apo/statue_u.bin"))),
    ("leads_out octree_unnamed", row(lambda r: r.update(file="../manifest.json"))),
    ("malformed_url octree_unnamed", row(lambda r: r.update(file="apo/Statue ü.bin"))),
    (
        "twice octree_length octree_level octree_unnamed",
        row(lambda r: r.update(file="apo/Statue_u_2.bin")),
    ),
    ("D657 no_file", linked(FIRST, "/etc/passwd")),
    ("D700 octree_unnamed", row(lambda r: r.pop("cube"))),
    ("D700 octree_unnamed", row(lambda r: r["cube"].update(side=0))),
    ("D700 octree_unnamed", row(lambda r: r["cube"]["low"].pop())),
    ("D700 octree_unnamed", row(lambda r: r["levels"].__setitem__(0, 0))),
    ("D700 octree_unnamed", row(lambda r: r["levels"].__setitem__(0, 1.5))),
    ("D700 octree_unnamed", row(lambda r: r["crc32"].__setitem__(0, 1 << 32))),
    ("D700 octree_unnamed", row(lambda r: r.update(levels=[1] * 22))),
    ("octree_row", row(lambda r: r["levels"].pop())),
    ("octree_row", row(lambda r: r["crc32"].append(0))),
    ("octree_row", row(lambda r: r["ends"].reverse())),
    ("octree_row", row(lambda r: r["ends"].__setitem__(1, r["ends"][0]))),
    ("octree_row", row(lambda r: r["ends"].__setitem__(-1, 1 << 62))),
    ("octree_row", row(lambda r: r["levels"].__setitem__(-1, 1 << 24))),
    ("octree_length", appended(FIRST, b"x")),
    ("octree_length octree_level", rewritten(FIRST, lambda data: data[:-1])),
    ("octree_length octree_level", put(FIRST, b"")),
    ("octree_level", rewritten(FIRST, lambda data: data[:20] + b"\0\0\0\0" + data[24:])),
    ("octree_level", row(lambda r: r["crc32"].__setitem__(2, 0))),
    ("octree_level", row(lambda r: r["levels"].__setitem__(1, r["levels"][1] + 1))),
    ("octree_level", all_of(appended(FIRST, b"xy"), longer)),
    ("octree_order", restreamed(at((0, 3), 0))),
    ("octree_order", restreamed(at((1, 0), 99))),
    ("octree_order", restreamed(at((1, 3), 0))),
    ("octree_unnamed", hinted(lambda d: d["octrees"].pop())),
    ("octree_unnamed", hinted(lambda d: d.pop("octrees"))),
    ("octree_unnamed", copied(FIRST, "apo/more.bin")),
]  # fmt: skip


@pytest.mark.parametrize(
    ("expected", "damage"), FAULTS, ids=lambda v: v if isinstance(v, str) else ""
)
def test_each_planted_fault_is_found(db: Path, seal: Damage, expected: str, damage: Damage) -> None:
    damage(db)
    seal(db)
    expect(validate_database(db).issues, expected)


def test_a_file_that_no_stage_wrote(db: Path) -> None:
    copied(FIRST, "apo/more.bin")(db)
    assert {i.code for i in validate_database(db).issues} == {"PTM-D653", "PTM-D677"}
