"""The tour of a site: `tour.json` with places in the world, and texts as trees.

The page fetches the document after its first view, with a script that only sites with a tour have.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.model import Cells
from ptmtools.errors import InputError, naming
from ptmtools.output.served import place_names
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.stages import CELLS, SCENE
from ptmtools.scene.model import Scene
from ptmtools.store.folder import DatabaseFolder
from ptmtools.tour.markdown import nodes_of
from ptmtools.tour.model import NAME, Label, Texts, Tour, in_language
from ptmtools.tour.placing import Anchor, Placing, unknown_name_error
from ptmtools.tour.reading import CAPTIONS, SOUNDS, read_tour

#: A file of the tour, and its media type → its URL, relative to the document.
NameOf = Callable[[Path, str], str]
#: The choice of no tour.
NONE = "none"
#: Lines of captions (WebVTT) with times, and markup in them.
_TIMES = re.compile(r"^\s*(?:\d+:)?\d\d:\d\d\.\d{3}\s+-->")
_MARKUP = re.compile(r"<[^>]*>")


def tour_file(database: Path, choice: str) -> Path | None:
    """The file of the tour of a database: that of the choice; without one, `tour.json` in the
    folder that contains the database, if it exists.

    Raises InputError: PTM-I120 the file of the choice does not exist.
    """
    if choice == NONE:
        return None
    if not choice:
        beside = database.absolute().parent / NAME
        return beside if beside.is_file() else None
    file = Path(choice)
    if not file.exists():
        raise InputError(
            "PTM-I120", "no such file", file=file, remedy="make one with `ptm tour init DB`"
        )
    return file


@dataclass(frozen=True)
class SiteTour:
    """The document of a site's tour, and the texts of the captions of its labels."""

    document: dict[str, Any]
    transcripts: Mapping[int, Texts]

    @property
    def empty(self) -> bool:
        """Whether a visitor would see nothing of it."""
        return not any(value for name, value in self.document.items() if name != "languages")

    def text(self, name: str) -> str:
        """The title or the description of the walk in the default language, "" without one."""
        return self._first(self.document.get(name)) or ""

    def place(self, name: str) -> str:
        """The name of a place in the default language."""
        return self._first(self.document.get("places", {}).get(name)) or name

    def _first(self, texts: Texts | None) -> str | None:
        return in_language(texts, "", self.document["languages"][0])[0]


def site_tour(folder: DatabaseFolder, choice: str, name_of: NameOf) -> tuple[SiteTour | None, str]:
    """The tour of a site, None without one; and a note, "" without one.

    Raises as `tour_file`, `read_tour`, `Placing.anchors`; PTM-D004 to D008 for the artifacts.
    """
    file = tour_file(folder.path, choice)
    if file is None:
        return None, ""
    tour = read_tour(file)
    model = folder.manifest.model
    if tour.model and tour.model != model and not choice:
        return None, f"{file} is the tour of {tour.model}, not of {model}: left out"
    with naming(file):
        document = TourPlacer(folder).page_document(tour, name_of)
    transcripts: dict[int, Texts] = {
        number: {
            tag: transcript_of(file.read_text("utf-8-sig")) for tag, file in label.captions.items()
        }
        for number, label in enumerate(tour.labels)
        if label.captions
    }
    return SiteTour(document, transcripts), ""


def transcript_of(captions: str) -> str:
    """The lines of all cues of captions, without times, markup, notes and styles, for visitors who
    read instead of listening."""
    lines: list[str] = []
    for block in re.split(r"\n\s*\n", captions.replace("\r\n", "\n").replace("\r", "\n")):
        rows = block.split("\n")
        start = next((k for k, row in enumerate(rows) if _TIMES.match(row)), None)
        if start is not None:
            lines += (unescape(_MARKUP.sub("", row)).strip() for row in rows[start + 1 :])
    return " ".join(filter(None, lines))


class TourPlacer:
    """Places tours in the scene of a database."""

    def __init__(self, folder: DatabaseFolder) -> None:
        """Raises PTM-D004 to D008 for the artifacts."""
        artifacts = Artifacts(folder)
        self._folder = folder
        self.scene: Scene = artifacts[SCENE]
        self._cells: Cells = artifacts[CELLS]
        self.placing = Placing(self.scene)

    def page_document(self, tour: Tour, name_of: NameOf) -> dict[str, Any]:
        """The document of a tour on the page; raises as `Placing.anchors`, and PTM-I302 no place
        has a name of `Tour.new_names`."""
        places = self.placing.anchors(tour)
        markers = np.array([place.marker for place in places]).reshape(-1, 3)
        new_names = tour.new_names
        known = self.place_names() if new_names else ()
        for name in new_names:
            if name not in known:
                raise unknown_name_error("place", name, known, f"places.{name}")
        return _document(tour, places, self._cells.locate(markers).tolist(), name_of)

    def place_names(self) -> tuple[str, ...]:
        """The names of the viewpoints; raises as `place_names`."""
        return place_names(self._folder.path)


def _document(
    tour: Tour, places: list[Anchor], cells: list[int], name_of: NameOf
) -> dict[str, Any]:
    labels = [
        _label(label, place, cell, name_of)
        for label, place, cell in zip(tour.labels, places, cells, strict=True)
    ]
    stops = [
        {
            **({"title": stop.title} if stop.title else {}),
            **({"label": stop.label} if stop.label >= 0 else {}),
            "position": list(stop.view.position),
            "direction": list(stop.view.direction),
        }
        for stop in tour.stops
    ]
    walk = {"title": tour.title, "description": tour.description, "places": tour.new_names}
    return {
        "languages": list(tour.languages),
        **{name: texts for name, texts in walk.items() if texts},
        "labels": labels,
        "stops": stops,
    }


def _label(label: Label, place: Anchor, cell: int, name_of: NameOf) -> dict[str, Any]:
    row: dict[str, Any] = {
        "id": label.id,
        "marker": _point(place.marker),
        "box": [*_point(place.low), *_point(place.high)],
        "cell": cell,
    }
    if place.picture is not None:
        row["normal"] = [round(float(value), 4) for value in place.picture.normal]
    plain = ("title", "maker", "date", "image", "link")
    row |= {name: texts for name in plain if (texts := getattr(label, name))}
    if label.text:
        row["text"] = {tag: nodes_of(text) for tag, text in label.text.items()}
    if label.sound:
        row["sound"] = _urls(label.sound, SOUNDS, name_of)
    if label.captions:
        row["captions"] = _urls(label.captions, CAPTIONS, name_of)
    return row


def _urls(
    files: Mapping[str, Path], media: Mapping[str, str], name_of: NameOf
) -> Mapping[str, str]:
    return {tag: name_of(file, media[file.suffix.lower()]) for tag, file in files.items()}


def _point(point: Floats) -> list[float]:
    return [round(float(value), 3) for value in point]
