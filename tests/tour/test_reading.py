"""Reading of tours: a complete one, and what is wrong with others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ptmtools.errors import InputError, LimitError
from ptmtools.tour import reading
from ptmtools.tour.model import in_language
from ptmtools.tour.reading import read_tour

VIEW = {"position": [1, 2, 3], "direction": [0, 0, -2]}
LABEL: dict[str, Any] = {"id": "one", "object": "painting_01"}


def document(**changes: Any) -> dict[str, Any]:
    plain = {"format": "ptmtools tour", "schema": 1, "languages": ["en", "de"], "labels": [LABEL]}
    return {**plain, **changes}


def write(folder: Path, content: Any) -> Path:
    file = folder / "tour.json"
    file.write_text(content if isinstance(content, str) else json.dumps(content))
    return file


def with_label(**fields: Any) -> dict[str, Any]:
    return document(labels=[{**LABEL, **fields}])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "one.mp3").write_bytes(b"sound")
    (tmp_path / "one.vtt").write_text("WEBVTT\n\n00:00.000 --> 00:01.000\nHello\n")
    (tmp_path / "no.vtt").write_text("Hello")
    (tmp_path.parent / "outside.mp3").write_bytes(b"sound")
    return tmp_path


def test_a_complete_tour(folder: Path) -> None:
    label = {
        **LABEL,
        "title": {"en": "Night", "de": "Nacht"},
        "maker": "R.",
        "text": {"en": "*Text*", "de": ""},
        "sound": {"en": "one.mp3"},
        "captions": "one.vtt",
        "link": "https://example.org",
    }
    stops = [{"label": "one", "view": VIEW}, {"view": VIEW, "title": "End"}]
    places = {"Room 1": {"en": "Hall", "de": ""}, "Room 2": "Room 2", "Room 3": {}}
    walk = {"title": "T", "model": "m.obj", "description": {"de": "Alt"}, "places": places}
    tour = read_tour(write(folder, document(labels=[label], stops=stops, **walk)))
    assert (tour.languages, tour.title, tour.model) == (("en", "de"), {"": "T"}, "m.obj")
    assert tour.description == {"de": "Alt"}
    assert tour.places == {"Room 1": {"en": "Hall"}, "Room 2": {"": "Room 2"}}
    assert tour.new_names == {"Room 1": {"en": "Hall"}}, "the other keeps the name of the model"
    (own,) = tour.labels
    assert own.title == {"en": "Night", "de": "Nacht"}
    assert own.text == {"en": "*Text*"}, "an empty text is none"
    assert own.sound == {"en": folder / "one.mp3"}
    assert [stop.label for stop in tour.stops] == [0, -1]
    assert tour.stops[0].view.direction == (0, 0, -1), "of unit length"
    assert set(tour.files()) == {folder / "one.mp3", folder / "one.vtt"}
    assert in_language(own.title, "de", "en") == ("Nacht", "de")
    assert in_language(own.text, "de", "en") == ("*Text*", "en"), "another language, named"
    assert in_language(own.maker, "de", "en") == ("R.", "")
    assert in_language(None, "de", "en") == (None, "")


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        ("{", "", "no tour"),
        ('{"format": "x"}', "", "its format is not"),
        (document(schema=2), "", "schema 2"),
        (document(languages=[]), "languages", "fewer than"),
        (document(places={"Hall": {"fr": "Salle"}}), "places.Hall.fr", "among the languages"),
        (document(places={"Hall": 7}), "places.Hall", "not of type"),
        (document(description={"fr": "x"}), "description.fr", "among the languages"),
        (document(languages=["en", "EN"]), "languages", "twice"),
        (document(languages=["../x"]), "languages[0]", "does not match"),
        (document(labels=[LABEL, LABEL]), "labels[1].id", "earlier label"),
        (document(labels=[{"id": "A B", "object": "x"}]), "labels[0].id", "does not match"),
        (document(labels=[{"id": "a"}]), "labels[0]", "one of object, room and at"),
        (with_label(at=[0, 0, 0]), "labels[0]", "one of object, room and at"),
        (with_label(titel="x"), "labels[0].titel", "not known"),
        (with_label(title={"fr": "x"}), "labels[0].title.fr", "among the languages"),
        (with_label(title=7), "labels[0].title", "not of type"),
        (with_label(text="x" * 20_001), "labels[0].text", "more than 20000"),
        (with_label(link="javascript:alert(1)"), "labels[0].link", "no address"),
        (with_label(sound="one.exe"), "labels[0].sound", "not one of"),
        (with_label(sound="../outside.mp3"), "labels[0].sound", "outside the folder"),
        (with_label(sound="/etc/x.mp3"), "labels[0].sound", "outside the folder"),
        (with_label(captions="one.vtt"), "labels[0].captions", "need a sound"),
        (with_label(sound="one.mp3", captions="no.vtt"), "labels[0].captions", "not WebVTT"),
        (document(stops=[{"label": "two", "view": VIEW}]), "stops[0].label", "no label"),
        (
            document(stops=[{"view": {**VIEW, "direction": [0, 0, 0]}}]),
            "stops[0].view.direction",
            "no length",
        ),
    ],
)
def test_wrong_tours(folder: Path, content: Any, place: str, words: str) -> None:
    file = write(folder, content)
    with pytest.raises(InputError, match="PTM-I870") as caught:
        read_tour(file)
    assert caught.value.file == str(file)
    assert (caught.value.place or "") == place
    assert words in caught.value.message
    assert caught.value.remedy


def test_files_that_cannot_be_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="PTM-I122") as caught:
        read_tour(write(folder, with_label(sound="missing.mp3")))
    assert str(caught.value.file).endswith("missing.mp3")
    with pytest.raises(InputError, match="PTM-I122"):
        read_tour(folder / "no.json")
    monkeypatch.setattr(reading, "LARGEST_SOUND", 4)
    with pytest.raises(LimitError, match="PTM-L204"):
        read_tour(write(folder, with_label(sound="one.mp3")))
