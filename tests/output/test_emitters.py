"""The table of emitters: one that is added by a line is written, listed and checked."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from ptmtools.cli.main import main
from ptmtools.errors import InputError, OutputError
from ptmtools.lazy import Lazy
from ptmtools.output import EmitOptions, emit, validate_database
from ptmtools.output.content import Content
from ptmtools.output.emitter import Emitter
from ptmtools.output.emitters import EMITTERS, all_emitters, owner_of
from ptmtools.output.validation.files import ServedDatabase
from tests.output.agreement import disagreements

TOY = Emitter(
    name="toy",
    about="how many shapes there are",
    owns=("toy.txt", "toys/"),
    writer=Lazy(f"{__name__}:write_toy"),
    reader=Lazy(f"{__name__}:read_toy"),
    check=Lazy(f"{__name__}:check_toy"),
    entry="toy.txt",
)


def write_toy(content: Content) -> Iterator[tuple[str, str]]:
    for cell in range(content.cells.cell_count):
        yield f"toys/{cell}.txt", f"{len([*content.geometry.shapes(cell)])} shapes\n"
    yield "toy.txt", f"{content.cells.cell_count} cells\n"


def read_toy(path: str, data: bytes) -> int | None:
    number, _, what = data.decode().partition(" ")
    return int(number) if what in ("shapes\n", "cells\n") else None


def check_toy(database: ServedDatabase) -> None:
    cells = [path for path in database.contents if path.startswith("toys/")]
    if database.contents.get("toy.txt") != len(cells):
        database.place("toy.txt").add("PTM-D699", "counts other cells than there are")


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(EMITTERS, TOY.name, TOY)


@pytest.mark.usefixtures("toy")
@pytest.mark.parametrize("format", ["toy,vrml", "gltf,toy,vrml"])
def test_a_toy_emitter(
    artifacts, tmp_path: Path, put_textures, seal: Callable[[Path], None], format: str
) -> None:
    a, db = artifacts, tmp_path / "db"
    records, options = put_textures(db / "www"), EmitOptions(format=format)
    report = emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", options)
    ours = ("toys/0.txt", "toys/1.txt", "toys/2.txt", "toy.txt")
    cells = [f"hints/c000{cell}.json" for cell in range(3)]
    hints = (*cells, "hints/statistics.json", "hints.json")
    assert report.files[-9:] == (*ours, *hints), "the hints are always written"
    assert ("root.wrl" in report.files) is ("vrml" in format)
    assert ("gltf/c0000.glb" in report.files) is ("gltf" in format)
    with pytest.raises(OutputError, match="PTM-O001"):
        emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", EmitOptions(format=format))
    seal(db)
    assert validate_database(db).issues == ()
    assert disagreements(db / "www") == []
    (db / "www/toys/3.txt").write_text("7 shapes\n")
    seal(db)
    assert {issue.code for issue in validate_database(db).issues} == {"PTM-D699"}


@pytest.mark.usefixtures("toy")
def test_an_emitter_without_a_check(
    artifacts, tmp_path: Path, put_textures, seal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the hashes of its files are checked."""
    monkeypatch.setitem(EMITTERS, TOY.name, replace(TOY, reader=None, check=None))
    a, db = artifacts, tmp_path / "db"
    records = put_textures(db / "www")
    emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", EmitOptions(format="vrml,toy"))
    seal(db)
    assert validate_database(db).issues == ()
    (db / "www/toy.txt").write_text("no cells\n")
    assert {issue.code for issue in validate_database(db).issues} == {"PTM-D652"}


@pytest.mark.usefixtures("toy")
def test_the_command_knows_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["emit", str(tmp_path), "--format", "vrml,toy"]) == 5, "no database there"
    assert main(["emit", str(tmp_path), "--format", "vrml,toys"]) == 2
    assert "'toys' is not one of vrml, gltf, interlace, toy" in capsys.readouterr().err


@pytest.mark.usefixtures("toy")
def test_a_form_without_cells_cannot_stand_alone() -> None:
    with pytest.raises(InputError, match=r"add vrml or gltf.*PTM-I111"):
        EmitOptions(format="toy")


def test_names_in_any_order() -> None:
    assert EmitOptions(format="gltf,vrml,gltf").format == "vrml,gltf"
    for wrong in ("usd", "", "vrml,", "vrml, gltf"):
        with pytest.raises(InputError, match="PTM-I111"):
            EmitOptions(format=wrong)


def test_both_by_default_and_each_alone(artifacts, tmp_path: Path, put_textures) -> None:
    a, records = artifacts, put_textures(tmp_path)
    assert EmitOptions().format == "vrml,gltf"
    for format in ("vrml,gltf", "vrml", "gltf"):
        options = EmitOptions(format=format)
        report = emit(a.scene, a.cells, a.pvs, a.ach, records, tmp_path / format, options)
        assert ("root.wrl" in report.files) is ("vrml" in format)
        assert ("gltf/c0000.glb" in report.files) is ("gltf" in format)
        index = json.loads((tmp_path / format / "hints.json").read_text())
        assert list(index["geometry"]) == format.split(",")


def test_each_emitter_has_a_writer_and_a_check() -> None:
    for emitter in all_emitters():
        for function in (emitter.writer, emitter.reader, emitter.check):
            assert callable(function.load())


def test_each_declaration_names_what_there_is() -> None:
    for name, emitter in EMITTERS.items():
        assert emitter.name == name
    for emitter in all_emitters():
        for path in filter(None, (emitter.entry, emitter.cell_files)):
            assert emitter.is_owner(path)
            assert emitter.is_owner(f"{path}.gz")
            assert owner_of(path) is emitter
        assert not emitter.is_owner("index.html")
