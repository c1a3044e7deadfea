"""Icons and ranks of points of interest."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ptmtools import schemas
from ptmtools.errors import InputError
from ptmtools.pipeline.validation import validate
from ptmtools.scene import IngestOptions
from ptmtools_systems.campus import CampusOptions, make_campus, read_campus
from ptmtools_systems.campus.model import HIGHEST_RANK, ICONS
from ptmtools_systems.campus.records import read_places
from ptmtools_systems.schemas import CAMPUS

OBJECTS = [("House_1", "House 1"), ("a_b", "a/b")]


def test_places_are_in_the_index(model: Path, tmp_path: Path) -> None:
    records, folder = tmp_path / "records", tmp_path / "c"
    records.mkdir()
    table = {"House 1": {"icon": "books", "rank": 2}, "Fence": {"rank": 0}, "Castle": {"rank": 1}}
    (records / "places.json").write_text(json.dumps(table))
    options = CampusOptions(lightmaps="none", faces=20)
    made = make_campus(model, folder, options, IngestOptions(unit="m", up="y"), records=records)
    assert [note for note in made.notes if "places" in note] == [
        "places.json: no object is called 'Castle'"
    ]
    assert validate(folder).issues == ()
    places = {o.label: (o.icon, o.rank) for o in read_campus(folder).objects}
    assert (places["House 1"], places["Fence"]) == (("books", 2), (None, 0))
    rows = json.loads((folder / "campus.json").read_text())["objects"]
    assert {row["label"] for row in rows if "icon" in row} == {"House 1"}
    assert {row["label"] for row in rows if "rank" in row} == {"House 1", "Fence"}


def test_by_label_or_by_name(tmp_path: Path) -> None:
    assert read_places(tmp_path, OBJECTS) == ({}, ())
    (tmp_path / "places.json").write_text('{"House_1": {"rank": 1}, "a/b": {"icon": "info"}}')
    assert read_places(tmp_path, OBJECTS) == ({"House_1": {"rank": 1}, "a_b": {"icon": "info"}}, ())


@pytest.mark.parametrize(
    "table",
    [
        "{",
        "[" * 100_000,
        "[]",
        {"a/b": {}},
        {"a/b": 1},
        {"a/b": {"icon": "castle"}},
        {"a/b": {"icon": ["info"]}},
        {"a/b": {"rank": True}},
        {"a/b": {"rank": HIGHEST_RANK + 1}},
        {"a/b": {"rank": 1, "parent": "c"}},
    ],
    ids=lambda table: str(table)[:24],
)
def test_impossible_places(tmp_path: Path, table: Any) -> None:
    text = table if isinstance(table, str) else json.dumps(table)
    (tmp_path / "places.json").write_text(text)
    with pytest.raises(InputError) as refused:
        read_places(tmp_path, OBJECTS)
    assert refused.value.code == "PTM-I122"


def test_the_schema_has_them() -> None:
    fields = json.loads(schemas.schema_text(CAMPUS))["$defs"]["object"]["properties"]
    assert tuple(fields["icon"]["enum"]) == ICONS
    assert fields["rank"]["maximum"] == HIGHEST_RANK
