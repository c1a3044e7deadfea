"""Reads `tour.json`, and checks it: its schema, languages, ids, files and addresses.

A tour is written by hand, so an error names the place in the file and the remedy.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ptmtools import schemas
from ptmtools.errors import InputError, LimitError, naming
from ptmtools.files import open_regular
from ptmtools.tour.markdown import is_address
from ptmtools.tour.model import FORMAT, SCHEMA, Label, Stop, Texts, Tour, View

#: Largest tour, sound and captions, bytes.
LARGEST, LARGEST_SOUND, LARGEST_CAPTIONS = 8 << 20, 64 << 20, 1 << 20
#: Suffix → media type.
SOUNDS = {
    ".mp3": "audio/mpeg",
    ".m4a": "audio/mp4",
    ".ogg": "audio/ogg",
    ".opus": "audio/ogg",
    ".wav": "audio/wav",
}
CAPTIONS = {".vtt": "text/vtt; charset=utf-8"}
_TEXTS = ("title", "maker", "date", "text", "image")


def read_tour(path: str | os.PathLike[str]) -> Tour:
    """Reads a tour; its sounds and captions exist.

    Raises
    ------
    InputError: PTM-I122 a file cannot be read; PTM-I870 it is no tour, does not match its schema,
        or contradicts itself.
    LimitError: PTM-L204 a file is too large.
    """
    file = Path(path)
    return tour_of(content_of(file, LARGEST), file)


def tour_of(data: bytes, file: Path) -> Tour:
    """The tour in ``data``, for a file; raises as `read_tour`."""
    with naming(file):
        if len(data) > LARGEST:
            raise LimitError("PTM-L204", f"more than {LARGEST >> 20} MiB")
        return _tour(document_of(data), file.absolute().parent)


def document_of(data: bytes) -> dict[str, Any]:
    """The document in ``data``, which matches the schema. Raises InputError: PTM-I870."""
    try:
        document = schemas.parse(data)
    except schemas.ShapeError as fault:
        raise _no_tour(str(fault)) from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise _no_tour(f'its format is not "{FORMAT}"')
    if document.get("schema") != SCHEMA:
        number = json.dumps(document.get("schema"))[:40]
        raise InputError(
            "PTM-I870", f"a tour of schema {number}, not {SCHEMA}", remedy="update ptmtools"
        )
    try:
        schemas.check(document, schemas.TOUR)
    except schemas.ShapeError as fault:
        raise _tour_error(fault.place, fault.message) from None
    try:
        json.dumps(document, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise _no_tour("an escape is half of a character") from None
    return document


def _tour(document: Mapping[str, Any], folder: Path) -> Tour:
    languages = tuple(document["languages"])
    if len({language.lower() for language in languages}) < len(languages):
        raise _tour_error("languages", "a language is listed twice")
    reader = _TourReader(languages, folder)
    labels: dict[str, Label] = {}
    for number, row in enumerate(document["labels"]):
        place = f"labels[{number}]"
        if row["id"] in labels:
            raise _tour_error(f"{place}.id", f"{row['id']} is the id of an earlier label, too")
        labels[row["id"]] = reader.label(row, place)
    order = {id: number for number, id in enumerate(labels)}
    stops = []
    for number, row in enumerate(document.get("stops", ())):
        place = f"stops[{number}]"
        if (id := row.get("label")) is not None and id not in order:
            raise _tour_error(f"{place}.label", f"no label has the id {id}")
        title = reader.texts(row, "title", place)
        stops.append(Stop(_view(row["view"], place), order.get(id, -1), title))
    places = {}
    for name in document.get("places", ()):
        if texts := reader.texts(document["places"], name, "places"):
            places[name] = texts
    return Tour(
        languages,
        tuple(labels.values()),
        tuple(stops),
        reader.texts(document, "title", ""),
        document.get("model", ""),
        reader.texts(document, "description", ""),
        places,
    )


class _TourReader:
    """Reads the fields of labels and stops."""

    def __init__(self, languages: tuple[str, ...], folder: Path) -> None:
        self._languages, self._folder = languages, folder

    def label(self, row: Mapping[str, Any], place: str) -> Label:
        described = [name for name in ("object", "room", "at") if name in row]
        if len(described) != 1:
            raise _tour_error(place, "needs one of object, room and at")
        texts = {name: self.texts(row, name, place) for name in _TEXTS}
        sound = self._files(row, "sound", place, SOUNDS, LARGEST_SOUND)
        captions = self._files(row, "captions", place, CAPTIONS, LARGEST_CAPTIONS)
        if captions and not sound:
            raise _tour_error(f"{place}.captions", "captions need a sound")
        link = self.texts(row, "link", place)
        for tag, address in (link or {}).items():
            if not is_address(address):
                raise _tour_error(
                    _place_of(f"{place}.link", tag), "is no address such as https://example.org"
                )
        at = tuple(row["at"]) if "at" in row else None
        return Label(
            row["id"], row.get("object", ""), row.get("room", ""), at, **texts,
            sound=sound, captions=captions, link=link,
        )  # fmt: skip

    def texts(self, row: Mapping[str, Any], name: str, place: str) -> Texts | None:
        """The texts of a field by language; None without the field or with empty texts."""
        value = row.get(name)
        if value is None or isinstance(value, str):
            return {"": value} if value else None
        for tag in value:
            if tag not in self._languages:
                raise _tour_error(
                    _place_of(f"{place}.{name}".lstrip("."), tag),
                    f"{tag} is not among the languages of the tour",
                )
        return {tag: text for tag, text in value.items() if text} or None

    def _files(
        self, row: Mapping[str, Any], name: str, place: str, suffixes: Mapping[str, str], limit: int
    ) -> Mapping[str, Path] | None:
        texts = self.texts(row, name, place)
        files = {}
        for tag, text in (texts or {}).items():
            where, file = _place_of(f"{place}.{name}", tag), self._folder / text
            if file.suffix.lower() not in suffixes:
                raise _tour_error(where, f"{text} is not one of {', '.join(suffixes)}")
            inside = Path(os.path.normpath(file)).is_relative_to(self._folder)
            if Path(text).is_absolute() or not inside:
                raise _tour_error(where, f"{text} lies outside the folder of the tour")
            data = content_of(file, limit)
            if suffixes is CAPTIONS and not _is_captions(data):
                raise _tour_error(where, f"{text} is not WebVTT")
            files[tag] = file
        return files or None


def _view(row: Mapping[str, Any], place: str) -> View:
    direction = row["direction"]
    length = math.hypot(*direction)
    if not 0 < length < math.inf:
        raise _tour_error(f"{place}.view.direction", "has no length")
    x, y, z = (value / length for value in direction)
    return View(tuple(row["position"]), (x, y, z))


def content_of(file: Path, limit: int) -> bytes:
    """The bytes of a file.

    Raises InputError: PTM-I122 it cannot be read. LimitError: PTM-L204 it has more than ``limit``.
    """
    try:
        with open_regular(file) as stream:
            data = stream.read(limit + 1)
    except (OSError, ValueError) as fault:
        reason = getattr(fault, "strerror", None) or fault
        raise InputError("PTM-I122", f"cannot be read ({reason})", file=file) from None
    if len(data) > limit:
        raise LimitError("PTM-L204", f"more than {limit >> 20} MiB", file=file)
    return data


def _is_captions(data: bytes) -> bool:
    try:
        return data.decode().removeprefix("\ufeff").startswith("WEBVTT")
    except UnicodeDecodeError:
        return False


def _place_of(place: str, tag: str) -> str:
    return f"{place}.{tag}" if tag else place


def _tour_error(place: str, message: str) -> InputError:
    return InputError("PTM-I870", message, place=place, remedy="see docs/formats/tour.md")


def _no_tour(problem: str) -> InputError:
    return InputError(
        "PTM-I870", f"is no tour: {problem}", remedy="make one with `ptm tour init DB`"
    )
