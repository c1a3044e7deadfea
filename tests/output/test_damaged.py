"""Whatever is in a database's files, the check ends, in time, and tells of it in its report."""

from __future__ import annotations

import contextlib
import gzip
import os
import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from ptmtools.diagnostics import CODES
from ptmtools.output import EmitOptions, emit, validate_database
from ptmtools.output.model import FileError
from ptmtools.output.validation.vrml import read_file

#: So many mutations of each kind of file; PTM_FUZZ asks for more.
ROUNDS = int(os.environ.get("PTM_FUZZ", "40"))

EXTREMES = (
    *b"0 -1 1 2 99 1e39 -1e39 1e-46 1e308 1e999 nan inf 2147483648 -2147483649 0.5 1.".split(),
    *(b'[ ] { } , : " \\ # null true TRUE {} [] "" ../.. %00 \xff \xe2\x80\xa8 \x00'.split(b" ")),
    str(10**400).encode(),
    b"[" * 2000,
)
TOKEN = re.compile(rb"[-+.\w]+|[^\s\w]")


def flip(data: bytearray, rng: random.Random) -> None:
    for _ in range(rng.choice((1, 1, 2, 8))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def cut(data: bytearray, rng: random.Random) -> None:
    del data[rng.randrange(len(data)) :]


def lose(data: bytearray, rng: random.Random) -> None:
    at = rng.randrange(len(data))
    del data[at : at + rng.choice((1, 4, 50, 1000))]


def repeat(data: bytearray, rng: random.Random) -> None:
    at, to = rng.randrange(len(data)), rng.randrange(len(data))
    data[to:to] = data[at : at + rng.choice((1, 4, 50, 1000))]


def extreme(data: bytearray, rng: random.Random) -> None:
    """Another token, of those that numbers, brackets and names may be taken for."""
    tokens = list(TOKEN.finditer(data))
    for _ in range(rng.choice((1, 1, 3))):
        if tokens:
            token = rng.choice(tokens[-1000:] if rng.random() < 0.5 else tokens)
            data[token.start() : token.end()] = rng.choice(EXTREMES)


def swap(data: bytearray, rng: random.Random) -> None:
    """Two tokens change places."""
    tokens = list(TOKEN.finditer(data))
    if len(tokens) > 1:
        one, two = sorted(rng.sample(tokens, 2), key=lambda t: t.start())
        data[two.start() : two.end()], data[one.start() : one.end()] = one.group(), two.group()


MUTATORS: tuple[Callable[[bytearray, random.Random], None], ...] = (
    *(flip, cut, lose, repeat, extreme, extreme, swap, swap),
)


@pytest.fixture(scope="module")
def everything(artifacts, tmp_path_factory, put_textures, seal) -> Path:
    """A database with files of every kind."""
    db = tmp_path_factory.mktemp("everything") / "db"
    a, records = artifacts, put_textures(db / "www")
    emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", EmitOptions(format="vrml,gltf"))
    for name in ("hints.json", "root.wrl"):
        copy = db / f"www/{name}.gz"
        copy.write_bytes(gzip.compress((db / "www" / name).read_bytes(), mtime=0))
    seal(db)
    return db


@pytest.mark.parametrize(
    "name",
    [
        "manifest.json",
        "www/hints.json",
        "www/root.wrl",
        "www/cells/c0001.wrl",
        "www/textures/a.ptm",
        "www/textures/b.png",
        "www/hints/c0001.json",
        "www/hints/statistics.json",
        "www/gltf/c0000.glb",
        "www/hints.json.gz",
    ],
)
def test_mutations(everything: Path, seal: Callable[[Path], None], name: str) -> None:
    path, good = everything / name, (everything / name).read_bytes()
    actual = 0
    try:
        for round in range(ROUNDS):
            rng = random.Random(f"{name} {round}")
            data = bytearray(good)
            mutators = rng.choices(MUTATORS, k=rng.choice((1, 1, 2)))
            for mutate in mutators:
                if data:
                    mutate(data, rng)
            path.write_bytes(data)
            if name != "manifest.json":
                seal(everything)
            report = validate_database(everything, workers=1)
            assert {i.code for i in report.issues} <= set(CODES)
            actual += bool(report.issues)
    finally:
        path.write_bytes(good)
        seal(everything)
    assert actual > ROUNDS // 2, "most mutations are faults"


@pytest.mark.parametrize(
    "text",
    [
        '"' * 200_000,
        'WorldInfo { title "' + "\\\\" * 200_000,
        'WorldInfo { info [ "' + "a" * 200_000,
        "#" * 200_000,
        "# \n" * 100_000,
        "Inline { url [ " + '"a" ' * 100_000,
        "url [ " * 100_000,
        '# url [ "\\"\n' * 50_000,
        "Shape { geometry IndexedFaceSet { " * 20_000,
        "]" * 200_000,
        "\n" * 200_000 + "}",
    ],
)
def test_reading_takes_time_by_length(text: str) -> None:
    """None of these takes a moment; one that took time by the square would take minutes."""
    with contextlib.suppress(FileError):
        read_file("a.wrl", f"#VRML V2.0 utf8\n{text}".encode())
