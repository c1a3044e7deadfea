"""Notes of a build: their order, and notes that are only counted."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ptmtools.cells.model import Cells
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.records import StageReport
from ptmtools.pipeline.stages import CELLS
from ptmtools.scene import IngestOptions
from tests.e2e.conftest import TWO_ROOMS, Ptm
from tests.scene.buildings import house, inside_out, obj_text, y_up
from tests.scene.orientation.test_facing import glb

MODEL = TWO_ROOMS / "two_rooms.obj"


@pytest.fixture
def lying(tmp_path: Path) -> Path:
    """A glTF file whose content has Z up."""
    path = tmp_path / "lying.glb"
    path.write_bytes(glb(y_up(y_up(y_up(house())))))  # a quarter turn too much or too little
    return path


def test_warnings_come_with_their_stage_and_notes_are_counted(ptm: Ptm, lying: Path) -> None:
    done = ptm("cells", lying)
    assert (done.status, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0].startswith("scene ")
    assert lines[1].startswith(
        "warning: the format prescribes Y as the up axis, but the model seems to lie on its"
    )
    assert lines[2].startswith("cells ")
    assert lines[-1].endswith(" notes not shown; -v lists them")
    assert "note: " not in done.out

    again = ptm("cells", lying, "-v").out.splitlines()
    assert again[0].startswith("scene     unchanged")
    assert again[1] == lines[1]
    notes = [line for line in again if line.startswith("note: ")]
    assert f"{len(notes)} notes not shown; -v lists them" == lines[-1]
    for verbose in ([], ["-v"]):
        reported = ptm("info", lying.with_suffix(".db"), *verbose).out
        assert reported.count(lines[1].removeprefix("warning: ")) == 1

    turned = ptm("cells", lying, "--up", "z").out
    assert "warning: " not in turned
    assert "1 unit = 1 m, Z up; 19.2 × 11.6 m, 3.5 m high" in turned


def test_the_json_report_is_complete(ptm: Ptm, lying: Path) -> None:
    done = ptm("cells", lying, "--json")
    assert done.err == ""
    scene, cells = json.loads(done.out)["stages"]
    assert len(scene["warnings"]) == 1
    assert scene["warnings"][0] in scene["notes"]
    assert cells["notes"]
    assert cells["warnings"] == []
    recorded = json.loads(ptm("info", lying.with_suffix(".db"), "--json").out)["stages"]
    assert recorded["scene"]["warnings"] == scene["warnings"]
    assert recorded["scene"]["notes"] == scene["notes"]


def test_quiet_says_nothing(ptm: Ptm, lying: Path) -> None:
    assert ptm("-q", "cells", lying).out == ""


def test_a_stage_is_told_of_before_the_next_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[str] = []

    def tell(report: StageReport) -> None:
        happened.append(f"told of {report.stage}")

    def compute(*_: object) -> Cells:
        happened.append("cut")
        raise KeyboardInterrupt

    monkeypatch.setattr("ptmtools.cells.subdivide", compute)
    with pytest.raises(KeyboardInterrupt):
        build_scene(MODEL, tmp_path / "db", IngestOptions(), tell=tell, until=CELLS)
    assert happened == ["told of scene", "cut"]


def test_an_empty_world_is_an_error_and_leaves_no_database(ptm: Ptm, tmp_path: Path) -> None:
    path = tmp_path / "out.glb"
    path.write_bytes(glb(inside_out(house())))
    done = ptm("build-scene", path)
    assert done.status == 3
    assert "warning: the model seems to be inside out: " in done.out
    assert done.err.startswith(f"ptm: {path}: no part of the model is visible from inside: ")
    assert "--two-sided" in done.err
    assert done.err.endswith("[PTM-I304]\n")
    assert not (tmp_path / "out.db" / "manifest.json").exists()
    done = ptm("cells", path, "--two-sided")
    assert (done.status, done.err) == (0, "")
    assert "warning: " not in done.out


def test_a_house_of_walls_stands_up(ptm: Ptm, tmp_path: Path) -> None:
    path = tmp_path / "walls.obj"
    path.write_text(obj_text(house(floor=False, roof=False)))
    out = ptm("cells", path).out
    assert "Z up (unit and up axis guessed); 19.2 × 11.6 m, 3 m high" in out


def test_the_runner_up_of_the_up_axis_is_shown_with_its_stage(ptm: Ptm, tmp_path: Path) -> None:
    """Of OBJ with Z up, which is not its convention; not of two rooms with Y up."""
    path = tmp_path / "house.obj"
    path.write_text(obj_text(house()))
    lines = ptm("cells", path).out.splitlines()
    assert lines[1].startswith(
        "note: second-best guess: Y as the up axis, 19.2 m wide and 11.6 m high, "
    )
    assert lines[1].endswith("; use --up y to select it [PTM-N238]")
    assert sum("PTM-N238" in line for line in ptm("cells", path, "-v").out.splitlines()) == 1
    assert "PTM-N238" not in ptm("cells", MODEL, "-o", tmp_path / "rooms.db").out
