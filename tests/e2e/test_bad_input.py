"""Whatever is wrong with the input: one line of error, the documented status, nothing left behind.

Every case runs the real command in a folder that holds a good model (`model/two_rooms.obj`), its
database (`db`) and what the case adds or damages. Afterwards the folder must be what it was.
"""

from __future__ import annotations

import errno
import io
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cells.buildings import carved, moved, room, write
from tests.e2e.conftest import Ptm, listing

Prepare = Callable[[Path], None]

BUILD = "build-scene model/two_rooms.obj -o new"
TWO = "encode model/floor.png model/room_a.png"
BUILD_A = "build-scene a.obj -o new"
LINE = re.compile(r"ptm: .+ \[PTM-[A-Z]\d{3}\]\n")


def nothing(folder: Path) -> None:
    """The input is bad as it stands."""


def file(name: str, data: bytes) -> Prepare:
    def prepare(folder: Path) -> None:
        (folder / name).write_bytes(data)

    return prepare


def two_buildings(folder: Path) -> None:
    one, other = carved([room(0, 0, 5, 5)]), carved([room(0, 0, 4, 4)])
    write(folder / "a.obj", [("one", one), ("other", moved(other, 9))])


def without(name: str) -> Prepare:
    def prepare(folder: Path) -> None:
        (folder / name).unlink()

    return prepare


def changed(name: str, change: Callable[[bytes], bytes]) -> Prepare:
    """A file with other bytes."""

    def prepare(folder: Path) -> None:
        (folder / name).write_bytes(change((folder / name).read_bytes()))

    return prepare


def flipped(name: str, at: int) -> Prepare:
    return changed(name, lambda d: d[:at] + bytes([d[at] ^ 0x10]) + d[at + 1 :])


def edited(name: str, old: str, new: str) -> Prepare:
    def change(data: bytes) -> bytes:
        assert old.encode() in data
        return data.replace(old.encode(), new.encode())

    return changed(name, change)


def image(name: str, mode: str, suffix: str, size: tuple[int, int] = (8, 8)) -> Prepare:
    def prepare(folder: Path) -> None:
        Image.new(mode, size).save(folder / name, suffix)

    return prepare


def grey(name: str) -> Prepare:
    return image(name, "L", "PNG")


def png(side: int) -> bytes:
    """A PNG whose header promises more than its data hold."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    data = zlib.compress(bytes(64))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def deep_png(name: str) -> Prepare:
    def prepare(folder: Path) -> None:
        Image.fromarray(np.full((4, 4), 40000, np.uint16)).save(folder / name)

    return prepare


def array(kind: str) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.ones((4, 4, 3), kind))
    return buffer.getvalue()


def empty_folder(folder: Path) -> None:
    (folder / "empty").mkdir()


def cut_png(folder: Path) -> None:
    changed("model/floor.png", lambda d: d[:-30])(folder)


def noise(folder: Path) -> None:
    """A `.ptm` large enough to be damaged in a chosen place."""
    from ptmtools.texture import encode

    texels = np.random.default_rng(1).integers(0, 256, (32, 32, 3), np.uint8)
    (folder / "a.ptm").write_bytes(encode(texels))


def floats(folder: Path) -> None:
    from ptmtools.texture import EncodeOptions, encode

    texels = np.ones((4, 4, 3), np.float32)
    (folder / "a.ptm").write_bytes(encode(texels, EncodeOptions("raw")))


def damaged_ptm(at: int) -> Prepare:
    return lambda folder: (noise(folder), flipped("a.ptm", at)(folder))[1]


def cut_ptm(end: int) -> Prepare:
    return lambda folder: (noise(folder), changed("a.ptm", lambda d: d[:end])(folder))[1]


def schema(folder: Path) -> None:
    manifest = json.loads((folder / "db/manifest.json").read_text())
    manifest["schema"] = 99
    (folder / "db/manifest.json").write_text(json.dumps(manifest))


def outside(folder: Path) -> None:
    """A texture that is there, but not in the model's folder or below it."""
    (folder / "model/floor.png").rename(folder / "tiles.png")
    edited("model/two_rooms.mtl", "floor.png", "../tiles.png")(folder)


def cut_manifest(folder: Path) -> None:
    changed("db/manifest.json", lambda d: d[:90])(folder)


def drop_stage(stage: str) -> Prepare:
    def prepare(folder: Path) -> None:
        manifest = json.loads((folder / "db/manifest.json").read_text())
        del manifest["stages"][stage]
        (folder / "db/manifest.json").write_text(json.dumps(manifest))

    return prepare


def foreign_folder(folder: Path) -> None:
    (folder / "new").mkdir()
    (folder / "new" / "mine.txt").write_text("mine")


def umlauts(folder: Path) -> None:
    (folder / "Räume im Süden").mkdir()
    (folder / "Räume im Süden" / "Plan B.obj").write_text("")


TEXTURE = "db/www/textures/floor.ptm"
ONE = b"v 0 0 0\nv 4 0 0\nv 0 4 0\nf 1 2 3\n"
NO_FACES = b"v 0 0 0\nv 4 0 0\nv 0 4 0\n"
NAN = b"v nan 0 0\nv 4 nan 0\nv 0 4 inf\nf 1 2 3\n"
OUT_OF_RANGE = b"v 0 0 0\nv 4 0 0\nv 0 4 0\nf 1 2 30\n"
HP = b"PTM_1.2\nPTM_FORMAT_LRGB\n512\n512\n"
GLB = b"glTF" + struct.pack("<II", 2, 400) + struct.pack("<I4s", 40, b"JSON") + b'{"asset":{"ver'

#: name → (how to prepare, arguments, exit status, code without PTM- or the beginning of it)
CASES: dict[str, tuple[Prepare, str, int, str]] = {
    "empty model": (file("a.obj", b""), BUILD_A, 3, "I243"),
    "no such model": (nothing, BUILD_A, 3, "I120"),
    "a folder as model": (nothing, "build-scene model -o new", 3, "I122"),
    "a model of an unknown kind": (file("a.xyzzy", b"x"), "build-scene a.xyzzy -o new", 3, "I"),
    "a model that is noise": (file("a.obj", bytes(range(256))), BUILD_A, 3, "I"),
    "no faces": (file("a.obj", NO_FACES), BUILD_A, 3, "I"),
    "one triangle": (file("a.obj", ONE), BUILD_A, 3, "I"),
    "coordinates not finite": (file("a.obj", NAN), BUILD_A, 3, "I"),
    "face index out of range": (file("a.obj", OUT_OF_RANGE), BUILD_A, 3, "I"),
    "damaged GLB": (file("a.glb", GLB), "build-scene a.glb -o new", 3, "I"),
    "GLB cut in its header": (file("a.glb", b"glTF"), "build-scene a.glb -o new", 3, "I"),
    "glTF that is no JSON": (file("a.gltf", b"{"), "build-scene a.gltf -o new", 3, "I"),
    "MTL missing, strict": (without("model/two_rooms.mtl"), BUILD + " --strict", 3, "I203"),
    "texture missing, strict": (without("model/floor.png"), BUILD + " --strict", 3, "I204"),
    "texture empty, strict": (file("model/floor.png", b""), BUILD + " --strict", 3, "I206"),
    "texture outside the folder, strict": (outside, BUILD + " --strict", 3, "I205"),
    "half of it left out, strict": (
        two_buildings, BUILD_A + " --up z --unit m --reach main --strict", 3, "I305"
    ),
    "texture that promises the moon": (
        file("model/floor.png", png(60_000)), BUILD, 7, "L104"
    ),
    "texture beyond the limit": (
        image("model/floor.png", "RGB", "PNG", (600, 600)), BUILD + " --limit 1", 7, "L104"
    ),
    "more triangles than allowed": (nothing, BUILD + " --max-triangles 9", 7, "L203"),
    "limit of nothing": (nothing, BUILD + " --limit 0", 3, "I111"),
    "the same, cells alone": (
        image("model/floor.png", "RGB", "PNG", (600, 600)),
        "cells model/two_rooms.obj -o new --limit 1",
        7,
        "L104",
    ),
    "texture of 16 bits": (deep_png("model/floor.png"), BUILD + " --strict", 3, "I126"),
    "unknown unit": (nothing, BUILD + " --unit cubit", 3, "I"),
    "impossible unit": (nothing, BUILD + " --unit 0", 3, "I"),
    "unit that makes it a planet": (nothing, BUILD + " --unit 1e12", 7, "L204"),
    "unknown axis": (nothing, BUILD + " --up x", 2, "U001"),
    "unknown profile for a scene": (nothing, BUILD + " --profile tiny", 2, "U001"),
    "no samples": (nothing, BUILD + " --samples 0", 3, "I111"),
    "viewpoint of two numbers": (nothing, BUILD + " --viewpoint 1,2", 2, "U001"),
    "viewpoint outside": (nothing, BUILD + " --viewpoint 900,900,900", 3, "I"),
    "a folder that is not ours": (foreign_folder, BUILD, 4, "O010"),
    "a file where the database goes": (file("new", b"mine"), BUILD, 4, "O001"),
    "a database of another model": (file("a.obj", ONE), "build-scene a.obj -o db", 4, "O010"),
    "output below a file": (file("f", b""), "build-scene model/two_rooms.obj -o f/new", 4, "O002"),
    "spaces and umlauts": (umlauts, "build-scene Räume☃im☃Süden/Plan☃B.obj -o new", 3, "I243"),
    "no such database": (nothing, "pvs new", 5, "D001"),
    "a folder that is no database": (nothing, "info model", 5, "D001"),
    "schema of another version": (schema, "validate db", 5, "D003"),
    "manifest cut": (cut_manifest, "info db", 5, "D002"),
    "manifest cut, to build on": (cut_manifest, "build-scene model/two_rooms.obj -o db", 5, "D002"),
    "damaged npz": (flipped("db/stages/cells.npz", 3000), "plot db -o plan.png", 5, "D006"),
    "missing npz": (without("db/stages/cells.npz"), "plot db -o plan.png", 5, "D005"),
    "stage not run": (drop_stage("cells"), "plot db -o plan.png", 5, "D004"),
    "stage before it not run": (drop_stage("pvs"), "ach db", 5, "D004"),
    "plot of no such cell": (nothing, "plot db --cell 77 -o plan.png", 3, "I111"),
    "plot exists": (file("plan.png", b"mine"), "plot db -o plan.png", 4, "O001"),
    "flipped byte in the database": (flipped(TEXTURE, 150), "validate db -q", 8, "C001"),
    "missing cell file": (without("db/www/cells/c0000.wrl"), "validate db -q", 8, "C001"),
    "no such image": (nothing, "encode a.png", 3, "I120"),
    "a folder to one file": (nothing, "encode model -o a.ptm", 2, "U001"),
    "a folder without images": (empty_folder, "encode empty", 3, "I120"),
    "a folder without textures": (nothing, "decode model", 3, "I120"),
    "empty image": (file("a.png", b""), "encode a.png", 3, "I125"),
    "not an image": (file("a.png", b"I am text\n"), "encode a.png", 3, "I125"),
    "truncated PNG": (cut_png, "encode model/floor.png", 3, "I125"),
    "64-bit array": (file("a.npy", array(">f8")), "encode a.npy", 3, "I126"),
    "CMYK JPEG": (image("a.jpg", "CMYK", "JPEG"), "encode a.jpg", 3, "I126"),
    "PNG that promises the moon": (file("a.png", png(2**31 - 1)), "encode a.png", 7, "L104"),
    "PNG beyond memory": (file("a.png", png(60_000)), "encode a.png", 7, "L104"),
    "unknown profile": (nothing, "encode model/floor.png --profile tiny", 2, "U001"),
    "no side at all": (nothing, "encode model/floor.png --min-side 0", 3, "I111"),
    "error for floats": (file("a.npy", array("<f4")), "encode a.npy --max-error 1", 3, "I111"),
    "beyond the limit": (
        image("a.png", "RGB", "PNG", (600, 600)),
        "encode a.png --limit 1",
        7,
        "L104",
    ),
    "two files to stdout": (nothing, TWO + " -o -", 2, "U001"),
    "stdin and a file": (nothing, "encode - model/floor.png", 2, "U001"),
    "output exists": (file("model/floor.ptm", b"mine"), "encode model/floor.png", 4, "O001"),
    "output in no folder": (nothing, "encode model/floor.png -o no/a.ptm", 4, "O002"),
    "output where nobody may write": (nothing, "encode model/floor.png -o /proc/a.ptm", 4, "O002"),
    "output is a device": (nothing, "encode model/floor.png --force -o /dev/full", 4, "O002"),
    "several images to one file": (nothing, TWO + " -o a.ptm", 2, "U001"),
    "two images of one name": (
        grey("room_a.png"),
        "encode model/room_a.png room_a.png -o .",
        4,
        "O101",
    ),
    "image without a name": (nothing, "encode ☃☃", 3, "I120"),
    "texture without a name": (nothing, "decode ☃☃", 3, "I120"),
    "nothing to tell of": (nothing, "info ☃☃", 3, "I120"),
    "nothing to check": (nothing, "validate ☃☃", 3, "I120"),
    "nothing to compare": (nothing, "compare ☃☃", 3, "I120"),
    "output without a name": (nothing, "encode model/floor.png -o ☃☃", 2, "U001"),
    "output named like an image": (nothing, "encode model/floor.png -o a.PNG", 4, "O101"),
    "output named like a lossy image": (nothing, "encode model/floor.png -o a.jxl", 4, "O101"),
    "a .ptm as image": (noise, "encode a.ptm -o b.ptm", 3, "I125"),
    "Polynomial Texture Map": (file("a.ptm", HP), "decode a.ptm", 3, "I"),
    ".ptm that is text": (file("a.ptm", b"hello"), "decode a.ptm", 3, "I"),
    ".ptm cut in its header": (cut_ptm(40), "decode a.ptm", 3, "I"),
    ".ptm cut in a group": (cut_ptm(-9), "decode a.ptm --level 5", 3, "I103"),
    ".ptm with a flipped byte": (damaged_ptm(900), "decode a.ptm", 3, "I108"),
    ".ptm with a flipped byte in its header": (damaged_ptm(13), "info a.ptm", 3, "I"),
    ".ptm damaged, validated": (damaged_ptm(900), "validate a.ptm -q", 8, "C001"),
    "level too high": (noise, "decode a.ptm --level 6", 3, "I111"),
    "level below 0": (noise, "decode a.ptm --level -1", 3, "I111"),
    "no such command": (nothing, "frobnicate", 2, "U001"),
    "no such option": (nothing, "decode a.ptm --colour", 2, "U001"),
    "no argument": (nothing, "decode", 2, "U001"),
    "output that would be lossy": (noise, "decode a.ptm -o a.jpg", 4, "O101"),
    "output of no kind": (noise, "decode a.ptm -o a", 4, "O101"),
    "floats as PNG": (floats, "decode a.ptm -o a.png", 4, "O101"),
    "window outside": (noise, "decode a.ptm --window 30,30,3,3", 3, "I111"),
    "window of no size": (noise, "decode a.ptm --window 3,3,0,3", 3, "I111"),
    "window of fractions": (noise, "decode a.ptm --window 3,3,0.5,3", 2, "U001"),
    "window of almost whole numbers": (noise, "decode a.ptm --window 3,3,2.0,3", 2, "U001"),
    "window of three": (noise, "decode a.ptm --window 3,3,3", 2, "U001"),
}  # fmt: skip


@pytest.fixture
def folder(
    two_rooms: Path, database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """The present folder, with `model/` and `db/`."""
    assert two_rooms.parent == database.parent == tmp_path
    monkeypatch.chdir(tmp_path)
    return tmp_path


def split(arguments: str) -> list[str]:
    """☃ stands for a space in an argument, ☃☃ for an empty argument."""
    return ["" if part == "☃☃" else part.replace("☃", " ") for part in arguments.split()]


@pytest.mark.parametrize("name", CASES)
def test_bad_input(name: str, folder: Path, ptm: Ptm) -> None:
    prepare, arguments, status, code = CASES[name]
    prepare(folder)
    before = listing(folder)
    outcome = ptm(*split(arguments))
    assert LINE.fullmatch(outcome.err), outcome.err
    assert f"[PTM-{code}" in outcome.err
    assert outcome.status == status
    # Finished stages are reported, with the second-best guess of the up axis.
    assert all(line.startswith(("scene ", "note: ")) for line in outcome.out.splitlines())
    assert listing(folder) == before


def test_a_missing_texture_is_a_note_unless_strict(folder: Path, ptm: Ptm) -> None:
    (folder / "model/floor.png").unlink()
    outcome = ptm("build-scene", folder / "model/two_rooms.obj", "-o", folder / "new")
    assert (outcome.status, outcome.err) == (0, "")
    assert "floor.png" in outcome.out
    assert "two_rooms.mtl" in outcome.out
    assert not list((folder / "new/www/textures").glob("floor*"))


def test_what_was_built_without_strict_is_no_excuse(folder: Path, ptm: Ptm) -> None:
    two_buildings(folder)
    command = ("cells", folder / "a.obj", "-o", folder / "new", "--up", "z", "--unit", "m")
    assert ptm(*command, "--strict").status == 0, "both are kept"
    outcome = ptm(*command, "--reach", "main")
    assert (outcome.status, outcome.err) == (0, "")
    assert "warning: 38% of the walkable floor is left out" in outcome.out
    before = listing(folder)
    outcome = ptm(*command, "--reach", "main", "--strict")
    assert (outcome.status, "PTM-I305" in outcome.err) == (3, True)
    assert listing(folder) == before


def test_spaces_and_umlauts_are_no_obstacle(folder: Path, ptm: Ptm) -> None:
    odd = folder / "Räume im Süden"
    shutil.copytree(folder / "model", odd)
    (odd / "two_rooms.obj").rename(odd / "Plan B.obj")
    outcome = ptm("build-scene", odd / "Plan B.obj", "-o", odd / "die Räume.db")
    assert (outcome.status, outcome.err) == (0, "")
    assert ptm("validate", odd / "die Räume.db").status == 0


@pytest.mark.parametrize(
    "arguments", ["build-scene model/two_rooms.obj -o new", "encode model/floor.png"]
)
def test_full_disk(arguments: str, folder: Path, ptm: Ptm, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    before = listing(folder)
    monkeypatch.setattr(os, "fsync", full)
    outcome = ptm(*split(arguments))
    monkeypatch.undo()
    assert LINE.fullmatch(outcome.err), outcome.err
    assert "PTM-O003" in outcome.err
    assert outcome.status == 4
    assert listing(folder) == before


def test_a_cut_file_decodes_to_its_last_whole_level(folder: Path, ptm: Ptm) -> None:
    noise(folder)
    data = (folder / "a.ptm").read_bytes()
    (folder / "a.ptm").write_bytes(data[:-9])
    outcome = ptm("decode", folder / "a.ptm")
    assert outcome.status == 0
    with Image.open(folder / "a.png") as actual:
        assert actual.size == (16, 16)


def test_a_bug_is_reported_in_one_line_and_status_1(
    folder: Path, ptm: Ptm, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: object) -> None:
        raise RuntimeError("two\nlines")

    monkeypatch.setattr("ptmtools.texture.images.load_image", broken)
    outcome = ptm("encode", folder / "model/floor.png")
    assert LINE.fullmatch(outcome.err), outcome.err
    assert "internal error, RuntimeError: two lines" in outcome.err
    assert outcome.status == 1
    assert "Traceback" in ptm("encode", folder / "model/floor.png", "-v").err


@pytest.mark.parametrize(
    ("fault", "status", "code"),
    [
        (MemoryError(), 7, "L099"),
        (KeyboardInterrupt(), 130, "X130"),
        (OSError(errno.EIO, "Input/output error", "a.png"), 3, "I122"),
        (OSError(errno.ENOSPC, "No space", "a.png"), 4, "O003"),
    ],
)
def test_what_the_system_refuses(
    fault: BaseException,
    status: int,
    code: str,
    folder: Path,
    ptm: Ptm,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refused(*arguments: object) -> None:
        raise fault

    monkeypatch.setattr("ptmtools.texture.images.load_image", refused)
    outcome = ptm("encode", folder / "model/floor.png")
    lines = outcome.err.strip().splitlines()
    assert len(lines) == 1
    assert code in lines[0]
    assert outcome.status == status


def test_the_installed_command_says_the_same(folder: Path) -> None:
    script = Path(sys.executable).with_name("ptm")
    run = subprocess.run([script, "info", folder / "no"], capture_output=True, text=True)
    assert LINE.fullmatch(run.stderr), run.stderr
    assert (run.returncode, run.stdout) == (3, "")


def test_a_reader_that_goes_away_is_no_error(folder: Path) -> None:
    script = Path(sys.executable).with_name("ptm")
    with subprocess.Popen(
        [script, "info", folder / "db", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        assert run.stdout is not None
        assert run.stderr is not None
        run.stdout.close()
        assert run.stderr.read() == b""
    assert run.returncode in (0, 141)
