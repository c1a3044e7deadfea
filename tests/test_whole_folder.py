"""Folders that are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from ptmtools import whole_folder
from ptmtools.errors import OutputError
from ptmtools.whole_folder import FolderForm

FORM = FolderForm(
    "index.json", "a test", "ptm test", lambda p: p == "index.json" or p.startswith("parts/")
)
INDEX = b'{"format": "a test"}'


def files(text: bytes) -> list[tuple[str, bytes]]:
    return [("parts/1", text), ("index.json", INDEX)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    FORM.write(tmp_path / "a", files(b"before"))
    return tmp_path / "a"


def held(folder: Path) -> bytes:
    return (folder / "parts/1").read_bytes()


def test_a_folder_is_replaced_with_force_alone(folder: Path) -> None:
    with pytest.raises(OutputError, match="PTM-O001"):
        FORM.write(folder, files(b"after"))
    assert held(folder) == b"before"
    FORM.write(folder, files(b"after"), force=True)
    assert held(folder) == b"after"
    assert os.listdir(folder.parent) == ["a"]


@pytest.mark.parametrize("can_exchange", [True, False])
def test_at_no_moment_there_is_none(
    folder: Path, can_exchange: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where folders can be exchanged nothing is renamed; elsewhere a failure is undone."""
    if not can_exchange:
        monkeypatch.setattr(whole_folder, "exchange", lambda *_: False)
    renamed: list[str] = []
    rename = os.rename

    def fail(one: Path, other: Path) -> None:
        renamed.append(Path(other).name)
        if Path(other) == folder and len(renamed) == 2:
            raise OSError(5, "Input/output error")
        rename(one, other)

    monkeypatch.setattr(os, "rename", fail)
    if can_exchange and whole_folder.exchange(folder, folder):
        FORM.write(folder, files(b"after"), force=True)
        assert (held(folder), renamed) == (b"after", [])
    else:
        with pytest.raises(OutputError, match="PTM-O002"):
            FORM.write(folder, files(b"after"), force=True)
        assert held(folder) == b"before"
    assert os.listdir(folder.parent) == ["a"]


def test_what_is_not_ours_stays(folder: Path) -> None:
    for strange in ("mine.txt", "empty/"):
        path = folder / strange
        path.mkdir() if strange.endswith("/") else path.write_text("mine")
        with pytest.raises(OutputError, match="PTM-O010"):
            FORM.write(folder, files(b"after"), force=True)
        path.rmdir() if strange.endswith("/") else path.unlink()
    (folder / "index.json").write_text('{"format": "another"}')
    with pytest.raises(OutputError, match="PTM-O010"):
        FORM.write(folder, files(b"after"), force=True)
    assert held(folder) == b"before"


def test_a_failure_on_the_way_leaves_nothing(folder: Path) -> None:
    with pytest.raises(ValueError, match="no file of such"):
        FORM.write(folder, [*files(b"after"), ("../out", b"")], force=True)
    assert held(folder) == b"before"
    assert os.listdir(folder.parent) == ["a"]


def test_the_folder_above_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="PTM-O002"):
        FORM.check(tmp_path / "no" / "where")
