"""The table of emitters: one that is added by a line is written, listed and checked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

from ptmtools.cli.main import main
from ptmtools.database import EmitOptions, emit, validate_database
from ptmtools.database.content import Content
from ptmtools.database.emitters import EMITTERS, Emitter, chosen_emitters
from ptmtools.database.validation.served import ServedDatabase
from ptmtools.errors import InputError, OutputError
from ptmtools.lazy import Lazy

TOY = Emitter(
    name="toy",
    about="how many shapes there are",
    owns=("toy.txt", "toys/"),
    entry="toy.txt",
    writer=Lazy(f"{__name__}:write_toy"),
    reader=Lazy(f"{__name__}:read_toy"),
    check=Lazy(f"{__name__}:check_toy"),
)


def write_toy(content: Content) -> Iterator[tuple[str, str]]:
    for cell in range(content.cells.cell_count):
        yield f"toys/{cell}.txt", f"{len([*content.geometry.shapes(cell)])} shapes\n"
    yield "toy.txt", f"{content.cells.cell_count} cells\n"


def read_toy(path: str, data: bytes) -> int | None:
    number, _, what = data.decode().partition(" ")
    return int(number) if what in ("shapes\n", "cells\n") else None


def check_toy(database: ServedDatabase) -> Mapping[str, int]:
    cells = [path for path in database.held if path.startswith("toys/")]
    if database.held.get("toy.txt") != len(cells):
        database.at("toy.txt").add("PTM-D730", "counts other cells than there are")
    return {"shapes": sum(database.held[path] for path in cells)}


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(EMITTERS, TOY.name, TOY)


@pytest.mark.usefixtures("toy")
@pytest.mark.parametrize("format", ["toy", "toy,vrml", "gltf,toy,vrml"])
def test_a_toy_emitter(
    artifacts, tmp_path: Path, put_textures, seal: Callable[[Path], None], format: str
) -> None:
    a, db = artifacts, tmp_path / "db"
    records, options = put_textures(db / "www"), EmitOptions(format=format)
    report = emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", options)
    assert report.files[-4:] == ("toys/0.txt", "toys/1.txt", "toys/2.txt", "toy.txt")
    assert ("root.wrl" in report.files) is ("vrml" in format)
    assert ("gltf/hints.json" in report.files) is ("gltf" in format)
    with pytest.raises(OutputError, match="PTM-O001"):
        emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", EmitOptions(format="toy"))
    seal(db)
    unnamed = {"PTM-D677"} if format == "toy" else set()
    assert {issue.code for issue in validate_database(db).issues} == unnamed
    (db / "www/toys/3.txt").write_text("7 shapes\n")
    seal(db)
    assert {issue.code for issue in validate_database(db).issues} == unnamed | {"PTM-D730"}


@pytest.mark.usefixtures("toy")
def test_the_command_knows_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["emit", str(tmp_path), "--format", "vrml,toy"]) == 5, "no database there"
    assert main(["emit", str(tmp_path), "--format", "vrml,toys"]) == 2
    assert "'toys' is not one of vrml, gltf, toy" in capsys.readouterr().err


def test_names_in_any_order() -> None:
    assert EmitOptions(format="gltf,vrml,gltf").format == "vrml,gltf"
    for wrong in ("usd", "", "vrml,", "vrml, gltf"):
        with pytest.raises(InputError, match="PTM-I603"):
            EmitOptions(format=wrong)


def test_gltf_alone_still_means_both(artifacts, tmp_path: Path, put_textures) -> None:
    assert chosen_emitters("gltf") == chosen_emitters("vrml,gltf")
    a, records = artifacts, put_textures(tmp_path)
    for format in ("gltf", "vrml,gltf"):
        options = EmitOptions(format=format)
        assert options == EmitOptions(format="gltf,vrml")
        report = emit(a.scene, a.cells, a.pvs, a.ach, records, tmp_path / format, options)
        assert {"root.wrl", "gltf/hints.json"} <= set(report.files)


@pytest.mark.parametrize("format", ["gltf", "vrml,gltf", "vrml"])
def test_a_note_where_a_name_has_changed_its_meaning(tmp_path: Path, capsys, format: str) -> None:
    main(["emit", str(tmp_path), "--format", format])
    assert ("say --format vrml,gltf" in capsys.readouterr().err) is (format == "gltf")


def test_each_declaration_names_what_there_is() -> None:
    for name, emitter in EMITTERS.items():
        assert emitter.name == name
        assert emitter.is_owner(emitter.entry)
        assert emitter.is_owner(f"{emitter.entry}.gz")
        assert not emitter.is_owner("index.html")
