"""A tour: labels, stops and texts in several languages, as `ptmtools.tour.reading` returns it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
#: Language → text. A text for all languages has the key "".
Texts = Mapping[str, str]
#: Language → file, likewise.
Files = Mapping[str, Path]

FORMAT, SCHEMA = "ptmtools tour", 1
#: The name of the file, beside the model.
NAME = "tour.json"


@dataclass(frozen=True)
class View:
    """Eye in world metres, and the unit direction in which it looks."""

    position: tuple[float, float, float]
    direction: tuple[float, float, float]


@dataclass(frozen=True)
class Label:
    """The description of a work, a room or a place.

    Attributes
    ----------
    id: unique in the tour.
    object, room: name of the object or of the room that it describes, or "".
    at: place of the marker in world metres where it describes neither.
    title, maker, date, image: plain text; `image` describes the work for visitors who do not see
        it.
    text: Markdown, see `ptmtools.tour.markdown`.
    sound, captions: files.
    link: addresses.
    """

    id: str
    object: str = ""
    room: str = ""
    at: tuple[float, float, float] | None = None
    title: Texts | None = None
    maker: Texts | None = None
    date: Texts | None = None
    text: Texts | None = None
    image: Texts | None = None
    sound: Files | None = None
    captions: Files | None = None
    link: Texts | None = None


@dataclass(frozen=True)
class Stop:
    """A view of the tour, and the number of the label that opens there, or -1."""

    view: View
    label: int = -1
    title: Texts | None = None


@dataclass(frozen=True)
class Tour:
    """A tour.

    Attributes
    ----------
    languages: tags; the first is the default.
    labels, stops: in the order of the file.
    title, description: of the walk, plain text, or None.
    places: names of viewpoints by the name that the model gives them, which the menu of places has.
    model: file name of the model that it describes, or "".
    """

    languages: tuple[str, ...]
    labels: tuple[Label, ...]
    stops: tuple[Stop, ...] = ()
    title: Texts | None = None
    model: str = ""
    description: Texts | None = None
    places: Mapping[str, Texts] = field(default_factory=dict)

    @property
    def new_names(self) -> dict[str, Texts]:
        """`places` without those that keep the name of the model."""
        return {name: texts for name, texts in self.places.items() if {*texts.values()} != {name}}

    def files(self) -> Iterator[Path]:
        """All sounds and captions."""
        for label in self.labels:
            for files in (label.sound, label.captions):
                yield from (files or {}).values()


def in_language(
    texts: Mapping[str, T] | None, language: str, default: str
) -> tuple[T, str] | tuple[None, str]:
    """A text in a language, else in the default language, else in any; and the tag of the language
    that it is in, "" if it is for all. (None, "") without a text."""
    for tag in (language, "", default, *(texts or {})):
        if texts and tag in texts:
            return texts[tag], tag
    return None, ""
