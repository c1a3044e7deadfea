"""Whatever a user gives, it ends in one line with a code and in no folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from ptmtools.cli.main import main
from ptmtools.errors import PtmError
from ptmtools_systems.campus import read_campus
from tests.systems.campus.models import write_campus, write_gltf

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def absent(folder: Path) -> list[str]:
    return [str(folder / "gone.obj")]


def text(name: str, content: str, *options: str) -> Callable[[Path], list[str]]:
    """A model of these words, and options."""

    def given(folder: Path) -> list[str]:
        (folder / name).write_text(content)
        return [str(folder / name), *options]

    return given


def without_light(folder: Path) -> list[str]:
    return [str(write_gltf(folder / "m", light=False)), "--lightmaps", "model"]


def damaged_light(folder: Path) -> list[str]:
    model = write_gltf(folder / "m")
    (folder / "m" / "light.png").write_bytes(b"\x89PNG\r\n\x1a\n nothing")
    return [str(model), "--lightmaps", "model"]


def a_file_is_there(folder: Path) -> list[str]:
    (folder / "out").write_text("mine")
    return [str(write_campus(folder / "m"))]


def another_folder_is_there(folder: Path) -> list[str]:
    (folder / "out").mkdir()
    (folder / "out" / "mine.txt").write_text("mine")
    return [str(write_campus(folder / "m")), "--force"]


def too_large_an_image(folder: Path) -> list[str]:
    return [str(write_campus(folder / "m")), "--limit", "1", "--unit", "m"]


GOOD = text("t.obj", TRIANGLE)
#: Words → code.
BAD: list[tuple[str, Callable[[Path], list[str]]]] = [
    ("PTM-I120", absent),
    ("PTM-I122", lambda folder: [str(folder)]),
    ("PTM-I243", text("e.obj", "")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--lods", "0")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--lods", "99")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--ratio", "0")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--ratio", "nan")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--faces", "0")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--error", "-1")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--small", "-1")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--samples", "0")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--samples", "999999")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--reach", "0")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--quality", "100")),
    ("PTM-I111", text("t.obj", TRIANGLE, "--unit", "ells")),
    ("PTM-I701", text("t.obj", TRIANGLE, "--lightmaps", "model")),
    ("PTM-I701", without_light),
    ("PTM-I125", damaged_light),
    ("PTM-I247", text("v.obj", "v 0 0 0\n")),
    ("PTM-I247", text("d.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")),
    ("PTM-L203", text("t.obj", TRIANGLE * 2, "--max-triangles", "1")),
    ("PTM-L104", too_large_an_image),
    ("PTM-O010", a_file_is_there),
    ("PTM-O010", another_folder_is_there),
]  # fmt: skip


@pytest.mark.parametrize(("code", "words"), BAD, ids=[f"{c}-{i}" for i, (c, _) in enumerate(BAD)])
def test_one_line(
    code: str,
    words: Callable[[Path], list[str]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = words(tmp_path)
    light = [] if "--lightmaps" in given else ["--lightmaps", "none"]
    status = main(["campus", *given, *light, "-o", str(tmp_path / "out"), "-j", "1", "-q"])
    printed = capsys.readouterr().err.strip()
    assert status in (3, 4, 7)
    assert printed.endswith(f"[{code}]"), printed
    assert "\n" not in printed
    assert not (tmp_path / "out" / "campus.json").exists()
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("words", [["--lightmaps", "moon"], ["--lods", "two"], ["-j", "-1"]])
def test_clicks_own(words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["campus", *GOOD(tmp_path), "-o", str(tmp_path / "out"), *words]) == 2
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("code", "data"),
    [
        ("PTM-I821", b""),
        ("PTM-I821", b"{"),
        ("PTM-I821", b"[]"),
        ("PTM-I821", b'{"format": "ptmtools campus", "schema": 1}'),
        ("PTM-I821", json.dumps({"format": "ptmtools campus", "schema": 2}).encode()),
        ("PTM-I821", b'{"a": 1, "a": 2}'),
        ("PTM-I122", None),
    ],
)
def test_an_index_that_is_none(code: str, data: bytes | None, tmp_path: Path) -> None:
    if data is not None:
        (tmp_path / "campus.json").write_bytes(data)
    with pytest.raises(PtmError, match=code):
        read_campus(tmp_path)


def test_an_index_without_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ptmtools_systems.campus.reading.LONGEST", 100)
    (tmp_path / "campus.json").write_bytes(b" " * 101)
    with pytest.raises(PtmError, match="PTM-L204"):
        read_campus(tmp_path)
