"""HTML records of the objects of a campus."""

from __future__ import annotations

import json
import shutil
import zlib
from pathlib import Path

import pytest

from ptmtools import schemas
from ptmtools.cli.main import main
from ptmtools.errors import InputError, LimitError
from ptmtools.folder_kinds import folder_kinds
from ptmtools.pipeline.validation import validate
from ptmtools.scene import IngestOptions
from ptmtools.site.forms import form_site
from ptmtools_lab.campus.stock import read_stock
from ptmtools_systems.campus import CampusOptions, make_campus, read_campus
from ptmtools_systems.campus.records import LARGEST, read_records
from ptmtools_systems.schemas import CAMPUS
from tests.conftest import files_below

HOUSE = "<h1>House 1</h1><p>Built in 1903. Größe: 96 m²</p>"
OBJECTS = [("House_1", "House 1"), ("a_b", "a/b")]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")
    (folder / "House 1.html").write_text(HOUSE, "utf-8")
    (folder / "Fence.html").write_bytes(b"")
    (folder / "Castle.html").write_text("no such building")
    (folder / "style.css").write_text("not a record")
    return folder


@pytest.fixture(scope="module")
def recorded(model: Path, pages: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campus with records; not to be changed."""
    folder = tmp_path_factory.mktemp("recorded") / "c"
    options = CampusOptions(lightmaps="none", faces=20)
    made = make_campus(model, folder, options, IngestOptions(unit="m", up="y"), records=pages)
    assert "1 record of no object: Castle.html" in made.notes
    return folder


@pytest.fixture
def copy(recorded: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recorded, tmp_path / "c"))


def test_records_are_in_the_campus(recorded: Path, plain: Path) -> None:
    assert validate(recorded).issues == ()
    rows = {each.label: each.record for each in read_campus(recorded).objects}
    assert {label for label, row in rows.items() if row} == {"House 1", "Fence"}
    row = rows["House 1"]
    assert row is not None
    assert (recorded / row.file).read_text("utf-8") == HOUSE
    # All other files are those of the campus without records.
    others = {n: d for n, d in files_below(recorded).items() if not n.startswith("records/")}
    without = files_below(plain)
    assert others.keys() == without.keys()
    assert [n for n in others if others[n] != without[n]] == ["campus.json"]


def test_no_server_sends_them_as_pages(recorded: Path) -> None:
    entries = form_site(recorded, folder_kinds()["campus.json"]).entries
    media = [entry.media for name, entry in entries.items() if "/records/" in name]
    assert media == ["text/plain; charset=utf-8"] * 2


def test_the_simulated_client_does_not_load_them(recorded: Path) -> None:
    assert not [name for name in read_stock(recorded).names if "record" in name]


def test_by_label_or_by_name(tmp_path: Path) -> None:
    (tmp_path / "House_1.html").write_text("by name")
    (tmp_path / "a_b.html").write_text("slash")
    records, notes = read_records(tmp_path, OBJECTS)
    assert (records, notes) == ({"House_1": b"by name", "a_b": b"slash"}, ())
    (tmp_path / "House 1.html").write_text("by label")
    records, notes = read_records(tmp_path, OBJECTS)
    assert records["House_1"] == b"by label"
    assert notes == ("1 record of no object: House_1.html",)


def test_unreadable_records(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="PTM-I122"):
        read_records(tmp_path / "none", OBJECTS)
    file = tmp_path / "House 1.html"
    file.write_bytes(b"ab\xff")
    with pytest.raises(InputError, match=r"byte 2 is not UTF-8.*PTM-I122"):
        read_records(tmp_path, OBJECTS)
    file.write_bytes(bytes(LARGEST + 1))
    with pytest.raises(LimitError, match="PTM-L204"):
        read_records(tmp_path, OBJECTS)
    file.unlink()
    file.symlink_to("/etc/hostname")
    with pytest.raises(InputError, match="PTM-I122"):
        read_records(tmp_path, OBJECTS)


@pytest.mark.parametrize("damage", ["missing", "other", "not UTF-8"])
def test_damage_is_a_finding(copy: Path, damage: str) -> None:
    document = json.loads((copy / "campus.json").read_text())
    row = next(o["record"] for o in document["objects"] if o["label"] == "House 1")
    file = copy / row["file"]
    if damage == "missing":
        file.unlink()
    else:
        file.write_bytes(b"\xff" * row["bytes"])
    if damage == "not UTF-8":
        row["crc32"] = zlib.crc32(file.read_bytes())
        (copy / "campus.json").write_text(json.dumps(document))
    (issue,) = validate(copy).issues
    assert issue.code == ("PTM-D803" if damage == "missing" else "PTM-D804")


@pytest.mark.parametrize("file", ["../x.txt", "records/x.html", "/etc/passwd"])
def test_a_record_elsewhere(copy: Path, file: str) -> None:
    document = json.loads((copy / "campus.json").read_text())
    document["objects"][1]["record"]["file"] = file
    with pytest.raises(schemas.ShapeError):
        schemas.check(document, CAMPUS)


def test_the_command(
    model: Path, pages: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["campus", str(model), "-o", str(tmp_path / "c"), "--lightmaps", "none", "--unit", "m",
             "--up", "y", "-j", "1"]  # fmt: skip
    assert main([*words, "--records", str(pages)]) == 0
    assert "1 record of no object: Castle.html" in capsys.readouterr().err
    assert len([*(tmp_path / "c/records").iterdir()]) == 2
    assert main([*words, "--records", "", "--force"]) == 2
    assert main([*words, "--records", str(tmp_path / "none"), "--force"]) == 3
    assert "PTM-I122" in capsys.readouterr().err
