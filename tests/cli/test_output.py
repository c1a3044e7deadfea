"""Printed text holds no terminal control characters and no unencodable characters."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from ptmtools.cli.console import Console, printable
from ptmtools.cli.main import main
from ptmtools.pipeline.stages import STAGES


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Tür ☃ 壁\tund\nmehr", "Tür ☃ 壁\tund\nmehr"),
        ("\x1b[2J\x07", "\\x1b[2J\\x07"),
        ("a\rb\x00\x7f\x9b", "a\\rb\\x00\\x7f\\x9b"),
        ("\u202egnp.a", "\\u202egnp.a"),
        (os.fsdecode(b"\xff.png") + "\ud800", "\\udcff.png\\ud800"),
    ],
)
def test_names_are_shown_harmlessly(
    text: str, shown: str, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    assert printable(text) == shown
    Console().print(text)
    Console().warn(text)
    printed = capsysbinary.readouterr()
    assert printed.out.decode() == shown + "\n"
    assert printed.err.decode() == f"ptm: {shown}\n"


def test_json_of_what_is_no_text(capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    document = {"name": "\ud800\x1b ☃"}
    Console().json(document)
    out = capsysbinary.readouterr().out
    assert json.loads(out) == document
    assert "☃".encode() in out
    assert b"\x1b" not in out


@pytest.mark.parametrize("name", [b"\x1b[2J.png", b"\xff.png", b"a\nb.png"])
def test_errors_about_odd_files(
    name: bytes, tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    path = tmp_path / os.fsdecode(name)
    path.write_bytes(b"no image\n")
    assert main(["encode", str(path)]) == 3
    err = capsysbinary.readouterr().err
    assert err.count(b"\n") == 1
    assert b"\x1b" not in err
    err.decode()


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("value", [None, "x", {}, [], "9", float("inf")])
def test_figures_of_a_damaged_manifest(stage: str, value: object) -> None:
    """Whatever the manifest says, a line comes out."""
    names = (
        *("triangles", "objects", "images", "metres", "up", "unit_guessed", "up_guessed", "closed"),
        *(
            "cells",
            "leaves",
            "portals",
            "mean_volume",
            "most_volume",
            "samples",
            "backend",
            "renderer",
        ),
        *("textures", "raw_bytes", "ptm_bytes", "files", "bytes", "viewpoints"),
    )
    assert isinstance(STAGES[stage].summarize(dict.fromkeys(names, value)), str)
    assert STAGES[stage].summarize({}) == "invalid counts"
    assert isinstance(STAGES[stage].summarize(dict.fromkeys(names, 10**400)), str)
