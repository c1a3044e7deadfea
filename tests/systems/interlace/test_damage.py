"""Damaged and hostile folders: one line that says what is wrong, never a traceback, and the check
finds it."""

from __future__ import annotations

import io
import json
import os
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.diagnostics import FOLDER_CODES
from ptmtools.texture import Limits
from ptmtools.texture.images import png_bytes
from ptmtools_systems.interlace import deinterlace, validate_interlaced
from tests.systems.interlace.folders import folder_of, image

Damage = Callable[[Path], object]


def edited(edit: Callable[[dict[str, Any]], object]) -> Damage:
    """A change of the manifest."""

    def damage(folder: Path) -> None:
        index = folder / "interlace.json"
        document = json.loads(index.read_text())
        edit(document)
        index.write_text(json.dumps(document))

    return damage


def put(name: str, data: bytes, recorded: bool = False) -> Damage:
    """A file is replaced; with ``recorded`` the manifest knows its bytes and checksum."""

    def damage(folder: Path) -> None:
        (folder / name).write_bytes(data)

        def edit(document: dict[str, Any]) -> None:
            (file,) = (file for file in document["files"] if file["name"] == name)
            file |= {"bytes": len(data), "crc32": zlib.crc32(data)}

        if recorded:
            edited(edit)(folder)

    return damage


def cut(name: str, keep: int) -> Damage:
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:keep])


def cut_and_recorded(folder: Path) -> None:
    put("2.png", (folder / "2.png").read_bytes()[:-30], recorded=True)(folder)


def flipped(folder: Path) -> None:
    data = bytearray((folder / "3.png").read_bytes())
    data[60] ^= 1
    (folder / "3.png").write_bytes(data)


def linked(folder: Path) -> None:
    (folder / "2.png").rename(folder.parent / "outside.png")
    (folder / "2.png").symlink_to("../outside.png")


def piped(folder: Path) -> None:
    (folder / "2.png").unlink()
    os.mkfifo(folder / "2.png")


def foldered(folder: Path) -> None:
    (folder / "2.png").unlink()
    (folder / "2.png").mkdir()


def sparse(folder: Path) -> None:
    with open(folder / "2.png", "r+b") as file:
        file.truncate(1 << 40)


def huge_index(folder: Path) -> None:
    with open(folder / "interlace.json", "r+b") as file:
        file.truncate(1 << 40)


def sized(data: bytes, width: int, height: int) -> bytes:
    """A PNG that declares another size."""
    head = b"IHDR" + struct.pack(">II", width, height) + data[24:29]
    return data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:]


def bomb(folder: Path) -> None:
    put("2.png", sized((folder / "2.png").read_bytes(), 60_000, 60_000), recorded=True)(folder)


def at(*path: str | int, value: Any) -> Damage:
    """A value of the manifest replaced."""

    def edit(document: Any) -> None:
        for step in path[:-1]:
            document = document[step]
        document[path[-1]] = value

    return edited(edit)


def swapped(document: dict[str, Any]) -> None:
    files = document["files"]
    files[1], files[2] = files[2], files[1]


OTHER, SMALLER = png_bytes(image(8, 8)), png_bytes(image(4, 4))
WEBP = io.BytesIO()
Image.fromarray(image(4, 8)).save(WEBP, "WEBP", lossless=True)
GREY = png_bytes(image(4, 8, 1))
DEEP = png_bytes(image(4, 8, 3, "uint16"))

#: Kinds of damage: the code of reading, that of the check, and a pattern of their message.
KINDS = {
    "missing": ("PTM-I122", "PTM-D803", "is missing|cannot be read"),
    "recorded": ("PTM-I821", "PTM-D804", "bytes instead of|another checksum"),
    "image": ("PTM-I821", "PTM-D804", "is not the image"),
    "large_file": ("PTM-L204", "PTM-D804", "too many for"),
    "schema": ("PTM-I821", "PTM-D800", "is not the manifest"),
    "number": ("PTM-I821", "PTM-D800", "schema number"),
    "contradiction": ("PTM-I821", "PTM-D800", "^(?!.*(is not the manifest|schema number))"),
    "large_index": ("PTM-L204", "PTM-D800", "too many for a manifest"),
}
#: What is done to a folder of 16 × 32 texels in 5 PNGs, and the kind of the damage.
DAMAGES: dict[str, tuple[Damage, str]] = {
    "file missing": (lambda f: (f / "4.png").unlink(), "missing"),
    "file cut": (cut("2.png", 40), "recorded"),
    "file empty": (cut("1.png", 0), "recorded"),
    "cut, and recorded so": (cut_and_recorded, "image"),
    "bit flipped": (flipped, "recorded"),
    "file a link": (linked, "missing"),
    "file a pipe": (piped, "missing"),
    "file a folder": (foldered, "missing"),
    "file of a terabyte": (sparse, "large_file"),
    "another size": (put("2.png", OTHER, recorded=True), "image"),
    "grey for colours": (put("1.png", GREY, recorded=True), "image"),
    "deep for 8 bits": (put("1.png", DEEP, recorded=True), "image"),
    "no image": (put("3.png", b"nonsense", recorded=True), "image"),
    "a smaller size": (put("2.png", SMALLER, recorded=True), "image"),
    "another container": (put("1.png", WEBP.getvalue(), recorded=True), "image"),
    "a huge size declared": (bomb, "image"),
    "checksum": (at("files", 0, "crc32", value=7), "recorded"),
    "index cut": (cut("interlace.json", 100), "schema"),
    "index empty": (cut("interlace.json", 0), "schema"),
    "index not UTF-8": (put("interlace.json", b"\xff{}"), "schema"),
    "index a list": (put("interlace.json", b"[1]"), "schema"),
    "index too deep": (put("interlace.json", b"[" * 99_999), "schema"),
    "index of a terabyte": (huge_index, "large_index"),
    "a field missing": (edited(lambda d: d.pop("min")), "schema"),
    "format": (at("format", value="ptmtools walk"), "schema"),
    "schema 2": (at("schema", value=2), "number"),
    "schema text": (at("schema", value="1"), "schema"),
    "a path that leads out": (
        at("files", 1, "name", value="../../etc/passwd"),
        "schema",
    ),
    "an absolute path": (at("files", 1, "name", value="/2.png"), "schema"),
    "a name twice": (at("files", 1, "name", value="1.png"), "contradiction"),
    "a name of another container": (
        at("files", 1, "name", value="2.jpg"),
        "contradiction",
    ),
    "files swapped": (edited(swapped), "contradiction"),
    "a file left out": (edited(lambda d: d["files"].pop()), "contradiction"),
    "no files": (at("files", value=[]), "schema"),
    "an axis of the first": (at("files", 0, "axis", value="rows"), "contradiction"),
    "no axis": (at("files", 2, "axis", value=None), "contradiction"),
    "axis": (at("files", 2, "axis", value="columns"), "contradiction"),
    "width": (at("width", value=64), "contradiction"),
    "no power of two": (at("width", value=33), "contradiction"),
    "a side of nothing": (at("height", value=0), "schema"),
    "a side of a million": (at("height", value=1_000_000), "schema"),
    "a size of a file": (at("files", 2, "width", value=32), "contradiction"),
    "a size after joining": (
        at("files", 2, "joined", "height", value=16),
        "contradiction",
    ),
    "components": (at("components", value=5), "schema"),
    "components of others": (at("components", value=4), "image"),
    "kind of others": (at("kind", value="uint16"), "image"),
    "lossless or not": (at("lossless", value=False), "contradiction"),
    "bytes": (at("files", 3, "bytes", value=2**53 - 1), "recorded"),
}


def said(capsys: pytest.CaptureFixture[str]) -> tuple[str, str]:
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return out, err


@pytest.mark.parametrize("name", DAMAGES)
def test_one_line(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    damage, kind = DAMAGES[name]
    code, finding, pattern = KINDS[kind]
    folder = folder_of(tmp_path / "folder", image())
    damage(folder)
    assert main(["deinterlace", str(folder), "-o", str(tmp_path / "x.png")]) == (
        7 if code.startswith("PTM-L") else 3
    )
    out, err = said(capsys)
    assert out == ""
    assert re.fullmatch(rf"ptm: \S+/folder.*\[{code}\]\n", err)
    assert re.search(pattern, err)
    assert not (tmp_path / "x.png").exists()
    errors = validate_interlaced(folder).errors
    assert {issue.code for issue in errors} == {finding}
    assert all(re.search(pattern, issue.message) for issue in errors), errors
    assert main(["validate", str(folder)]) == 8
    out, err = said(capsys)
    assert f"[{finding}]" in out
    assert err.count("\n") == 1
    assert "ptm interlace IMAGE -o" in err
    status = main(["info", str(folder)])
    _, err = said(capsys)
    assert (status == 0) == (finding in ("PTM-D803", "PTM-D804"))
    assert err.count("\n") == (status != 0)


def test_what_is_larger_than_described_is_not_decoded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folder_of(tmp_path / "folder", image())
    put("2.png", png_bytes(np.zeros((2000, 2000, 3), np.uint8)), recorded=True)(folder)
    assert main(["deinterlace", str(folder), "-o", str(tmp_path / "x.png")]) == 3
    assert "more than the limit of 128 bytes" in said(capsys)[1]


def test_a_single_file_of_any_size_is_refused(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "folder", image(4, 4))
    put("1.png", png_bytes(image(4, 5)), recorded=True)(folder)
    for path in (("width",), ("files", 0, "width"), ("files", 0, "joined", "width")):
        at(*path, value=5)(folder)
    assert [issue.code for issue in validate_interlaced(folder).issues] == ["PTM-D800"]


def test_the_undamaged_folder_is_good(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = folder_of(tmp_path / "folder", image())
    assert main(["validate", "--strict", str(folder)]) == 0
    out, err = said(capsys)
    assert out.startswith(f"{folder}: 6 files, ")
    assert out.endswith("; 0 errors, 0 warnings\n")
    assert err == ""


def test_a_palette_is_what_it_shows(tmp_path: Path) -> None:
    flat = np.zeros((16, 32, 3), np.uint8)
    folder = folder_of(tmp_path / "folder", flat)
    Image.new("P", (8, 4)).save(folder / "1.png")
    put("1.png", (folder / "1.png").read_bytes(), recorded=True)(folder)
    assert validate_interlaced(folder).ok


@pytest.mark.parametrize("what", ["none", "no index", "a file"])
def test_no_such_folder(tmp_path: Path, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "folder"
    if what == "no index":
        target.mkdir()
    elif what == "a file":
        target.write_bytes(b"")
    assert main(["deinterlace", str(target)]) == 3
    out, err = said(capsys)
    assert out == ""
    assert re.fullmatch(r"ptm: .*\[PTM-I120\]\n", err)


@pytest.mark.parametrize("step", ["0", "-1", "6", "99999999999999999999"])
def test_no_such_step(tmp_path: Path, step: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder = folder_of(tmp_path / "folder", image())
    assert main(["deinterlace", str(folder), f"--step={step}"]) == 3
    assert re.fullmatch(r"ptm: .*1 to 5 \[PTM-I111\]\n", said(capsys)[1])


def test_more_texels_than_allowed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = folder_of(tmp_path / "folder", np.zeros((1024, 1024, 2), np.uint8), smallest=128)
    out = ["-o", str(tmp_path / "x.png"), "--limit", "1"]
    assert main(["deinterlace", str(folder), *out]) == 7
    assert re.fullmatch(r"ptm: .*\[PTM-L104\]\n", said(capsys)[1])
    assert main(["deinterlace", str(folder), *out, "--step", "6"]) == 0
    report = validate_interlaced(folder, Limits(decoded_bytes=1 << 20))
    assert [issue.code for issue in report.issues] == ["PTM-D713"]


def test_warnings(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "folder", image())
    (folder / "notes.txt").write_text("mine")
    edited(lambda document: document.update(min=2))(folder)
    report = validate_interlaced(folder)
    assert [(issue.code, issue.file) for issue in report.issues] == [
        ("PTM-D808", "interlace.json"),
        ("PTM-D806", "notes.txt"),
    ]
    assert report.ok


def test_other_axes_are_joined_as_they_say(tmp_path: Path) -> None:
    """Such as a set of two files, or one that begins with rows; the check points it out."""
    texels = image(16, 32)
    folder = folder_of(tmp_path / "folder", texels, smallest=16)
    data = [png_bytes(np.ascontiguousarray(part)) for part in (texels[::2], texels[1::2])]

    def edit(document: dict[str, Any]) -> None:
        joined = [{"width": 32, "height": height} for height in (8, 16)]
        document["files"] = [
            {"name": f"{n + 1}.png", "width": 32, "height": 8, "bytes": len(data[n])}
            | {"crc32": zlib.crc32(data[n]), "axis": (None, "rows")[n], "joined": joined[n]}
            for n in range(2)
        ]

    for number, part in enumerate(data, 1):
        (folder / f"{number}.png").write_bytes(part)
    edited(edit)(folder)
    np.testing.assert_array_equal(deinterlace(folder), texels)
    assert [issue.code for issue in validate_interlaced(folder).issues] == ["PTM-D808"]


def test_every_code_is_found_somewhere() -> None:
    assert {kind for _, kind in DAMAGES.values()} == set(KINDS)
    actual = {finding for _, finding, _ in KINDS.values()}
    assert actual | {"PTM-D806", "PTM-D713", "PTM-D808"} == set(FOLDER_CODES)


def test_no_manifest_however_damaged_ends_in_a_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folder_of(tmp_path / "folder", image())
    index = folder / "interlace.json"
    whole = index.read_bytes()
    random = np.random.default_rng(6)
    out = str(tmp_path / "x.png")
    for _ in range(300):
        data = bytearray(whole)
        for place in random.integers(0, len(data), random.integers(1, 4)):
            data[place] = random.integers(32, 127)
        index.write_bytes(data)
        assert main(["deinterlace", str(folder), "-o", out, "--force"]) in (0, 3, 7)
        validate_interlaced(folder)
        assert said(capsys)[1].count("\n") <= 1
