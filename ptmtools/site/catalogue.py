"""The catalogue of a tour: the same content as a plain page, which needs no script.

One page for each language, in the order of the tour and under the names of the rooms: title, maker,
date, text and description of each work, a picture of it as its stop shows it, its sound, and the
text of the captions. Each work links to its place in the walk.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby
from typing import Any, TypeVar
from urllib.parse import urlencode

from ptmtools.site.about import About
from ptmtools.site.words import has_words, words_of
from ptmtools.tour.markdown import html_of, plain_text
from ptmtools.tour.model import Texts, in_language

T = TypeVar("T")
INDEX = "index.html"
#: Width and height of the pictures, pixels, and their vertical field of view, radians.
PICTURE, ANGLE = (480, 360), math.pi / 3
#: Right-to-left scripts, by the languages that are usually written in them.
_RIGHT_TO_LEFT = {"ar", "fa", "he", "ur", "yi", "ps", "sd", "ug", "dv", "ku"}
#: The service worker recognises a catalogue by this line (web/page/offline/visits.js).
GENERATOR = '<meta name="generator" content="ptmtools">'
#: Languages by their own names, for the links between the pages; their tags for others.
_NAMES = {
    "ar": "العربية",
    "cs": "Čeština",
    "da": "Dansk",
    "de": "Deutsch",
    "el": "Ελληνικά",
    "en": "English",
    "es": "Español",
    "fi": "Suomi",
    "fr": "Français",
    "he": "עברית",
    "hu": "Magyar",
    "it": "Italiano",
    "ja": "日本語",
    "ko": "한국어",
    "nl": "Nederlands",
    "no": "Norsk",
    "pl": "Polski",
    "pt": "Português",
    "ru": "Русский",
    "sv": "Svenska",
    "tr": "Türkçe",
    "uk": "Українська",
    "zh": "中文",
}
_STYLE = """
:root { color-scheme: light dark; font: 17px/1.55 system-ui, sans-serif; }
body { max-width: 46rem; margin: 0 auto; padding: 1rem; }
a { color: #0b57a4; } a:hover { text-decoration-thickness: 2px; }
:focus-visible { outline: 3px solid currentColor; outline-offset: 3px; }
img { display: block; width: 100%; height: auto; border-radius: 6px; }
article { margin: 0 0 3rem; } h2 { margin: 2.5rem 0 1rem; } h3 { margin: .8rem 0 .2rem; }
.by { margin: 0 0 .8rem; } audio { width: 100%; } nav ul { padding: 0; list-style: none; }
nav li { display: inline-block; margin-inline-end: 1rem; }
.skip:not(:focus) { position: absolute; inset-inline-start: -999px; }
@media (prefers-color-scheme: dark) { a { color: #9cc7ff; } }
"""


@dataclass(frozen=True)
class CatalogueContent:
    """The content of a catalogue.

    Attributes
    ----------
    tour: the document of the site's tour (`ptmtools.site.tours`).
    title: of the site.
    rooms: cell → name of the room.
    pictures: label → URL of its picture, relative to the page.
    transcripts: label → texts of its captions.
    base: URL of the folder of the tour's files, relative to the page, with a slash.
    address: URL of the folder of the site with a slash, or "" if it is unknown.
    """

    tour: Mapping[str, Any]
    title: str
    rooms: Mapping[int, str]
    pictures: Mapping[int, str]
    transcripts: Mapping[int, Texts]
    base: str
    address: str = ""


def page_name(language: str, languages: Sequence[str]) -> str:
    """The file of a language: the default one has the short name."""
    return "catalogue.html" if language == languages[0] else f"catalogue-{language}.html"


def catalogue_of(content: CatalogueContent) -> dict[str, str]:
    """The pages, file → HTML; the first is in the default language."""
    languages = content.tour["languages"]
    return {page_name(tag, languages): _Page(content, tag).html() for tag in languages}


class _Page:
    """A page of the catalogue in one language."""

    def __init__(self, content: CatalogueContent, language: str) -> None:
        self._content, self._tour, self._language = content, content.tour, language
        self._words = words_of(language)["catalogue"]
        title = self._plain(content.tour.get("title")) or content.title
        #: What marks words of the page that exist only in English.
        self._foreign = "" if has_words(language) else ' lang="en" dir="ltr"'
        word = "" if self._foreign else f": {self._words['catalogue']}"
        self._title = title + word
        self._h1 = (self._span(content.tour.get("title")) or escape(content.title)) + escape(word)

    def html(self) -> str:
        """The whole page."""
        language, words = self._language, self._words
        direction = "rtl" if language.split("-")[0].lower() in _RIGHT_TO_LEFT else "ltr"
        others = [tag for tag in self._tour["languages"] if tag != language]
        names = {tag: page_name(tag, self._tour["languages"]) for tag in others}
        alternates = "".join(
            f'<link rel="alternate" hreflang="{escape(tag)}" href="{escape(name)}">\n'
            for tag, name in names.items()
        )
        links = "".join(
            f'<li><a lang="{escape(tag)}" hreflang="{escape(tag)}" href="{escape(name)}">'
            f"{escape(_NAMES.get(tag.lower(), tag))}</a></li>\n"
            for tag, name in names.items()
        )
        nav = (
            f'<nav aria-label="{escape(words["languages"])}"><ul>\n{links}</ul></nav>\n'
            if others
            else ""
        )
        return (
            f'<!doctype html>\n<html lang="{escape(language)}" dir="{direction}">\n<head>\n'
            '<meta charset="utf-8">\n<meta name="viewport" content="width=device-width, '
            f'initial-scale=1">\n{GENERATOR}\n<title>{escape(self._title)}</title>\n'
            f"{self._preview_tags()}{alternates}"
            f'<link rel="icon" href="data:,">\n<style>{_STYLE}</style>\n'
            f"{self._linked_data()}</head>\n<body>\n"
            f'<a class="skip" href="#content">{self._word("skip")}</a>\n'
            f"<header>\n<h1>{self._h1}</h1>\n"
            f"{self._paragraph(self._tour.get('description'))}"
            f'<p><a href="{escape(self._walk())}">{self._word("walk")}</a></p>\n{nav}</header>\n'
            f'<main id="content">\n{"".join(self._sections())}</main>\n'
            f"<footer>\n<p>{self._word('access')}</p>\n</footer>\n</body>\n</html>\n"
        )

    def _walk(self, **query: str) -> str:
        """The URL of the walk, in the language of this page if there are several."""
        if len(self._tour["languages"]) > 1:
            query["lang"] = self._language
        return f"{INDEX}?{urlencode(query)}" if query else INDEX

    def _word(self, name: str) -> str:
        """Words of the page as HTML."""
        text = escape(self._words[name])
        return f"<span{self._foreign}>{text}</span>" if self._foreign else text

    def _preview_tags(self) -> str:
        """What link previews and search engines read."""
        about = About(self._title, self._plain(self._tour.get("description")))
        return "".join(f"{line}\n" for line in about.texts())

    def _paragraph(self, texts: Texts | None) -> str:
        text = self._span(texts)
        return f"<p>{text}</p>\n" if text else ""

    def _sections(self) -> Iterator[str]:
        """Works under the names of their rooms."""
        for room, group in groupby(self._order(), self._room):
            articles = "".join(self._article(number) for number in group)
            yield f"<section>\n<h2>{self._room_heading(room)}</h2>\n{articles}</section>\n"

    def _order(self) -> list[int]:
        """Labels: rooms by their first stop, in them the order of the tour."""
        stops = [stop["label"] for stop in self._tour["stops"] if "label" in stop]
        order = list(dict.fromkeys([*stops, *range(len(self._tour["labels"]))]))
        rooms = list(dict.fromkeys(map(self._room, order)))
        return sorted(order, key=lambda number: rooms.index(self._room(number)))

    def _room(self, number: int) -> str:
        cell = self._tour["labels"][number]["cell"]
        return self._content.rooms.get(cell, "")

    def _room_heading(self, room: str) -> str:
        """Its name in the language of the page, where the tour has one."""
        if not room:
            return self._word("elsewhere")
        return self._span(self._tour.get("places", {}).get(room)) or escape(room)

    def _article(self, number: int) -> str:
        label = self._tour["labels"][number]
        by = [part for name in ("maker", "date") if (part := self._span(label.get(name)))]
        image = self._plain(label.get("image"))
        parts = [f"<h3>{self._heading(number)}</h3>\n"]
        if by:
            parts.append(f'<p class="by">{", ".join(by)}</p>\n')
        if number in self._content.pictures:
            width, height = PICTURE
            parts.append(
                f'<img src="{escape(self._content.pictures[number])}" width="{width}" '
                f'height="{height}" loading="lazy" alt="{escape(image or self._name(number))}">\n'
            )
        nodes, tag = self._version(label.get("text"))
        if nodes:
            parts.append(f"<div{_lang(tag)}>{html_of(nodes)}</div>\n")
        if image:
            parts.append(
                f"<details><summary>{self._word('image')}</summary>"
                f"<p>{self._span(label['image'])}</p></details>\n"
            )
        parts += self._sound(number)
        link = self._plain(label.get("link"))
        if link:
            parts.append(_link(link, self._word("about")))
        parts.append(_link(self._walk(label=label["id"]), self._word("here")))
        return f'<article id="{escape(label["id"])}">\n{"".join(parts)}</article>\n'

    def _sound(self, number: int) -> Iterator[str]:
        label = self._tour["labels"][number]
        sound, captions = self._plain(label.get("sound")), self._plain(label.get("captions"))
        if not sound:
            return
        track = (
            f'<track kind="captions" src="{escape(self._content.base + captions)}" default>'
            if captions
            else ""
        )
        source = escape(self._content.base + sound)
        yield f'<audio controls preload="none" src="{source}">{track}</audio>\n'
        if text := self._plain(self._content.transcripts.get(number)):
            yield (
                f"<details><summary>{self._word('captions')}</summary>"
                f"<p>{escape(text)}</p></details>\n"
            )

    def _heading(self, number: int) -> str:
        label = self._tour["labels"][number]
        return self._span(label.get("title")) or escape(label["id"])

    def _name(self, number: int) -> str:
        label = self._tour["labels"][number]
        parts = [self._plain(label.get("title")) or label["id"], self._plain(label.get("maker"))]
        return ", ".join(filter(None, parts))

    def _version(self, texts: Mapping[str, T] | None) -> tuple[T, str] | tuple[None, str]:
        return in_language(texts, self._language, self._tour["languages"][0])

    def _plain(self, texts: Texts | None) -> str:
        return self._version(texts)[0] or ""

    def _span(self, texts: Texts | None) -> str:
        """A text as HTML, marked with its language where that is not the page's."""
        text, tag = self._version(texts)
        if not text:
            return ""
        mark = _lang(tag) if tag and tag != self._language else ""
        return f'<span dir="auto"{mark}>{escape(text)}</span>'

    def _linked_data(self) -> str:
        """The works as schema.org data, which search engines read."""
        works, address = [], self._content.address
        for number in self._order():
            label = self._tour["labels"][number]
            nodes, _ = self._version(label.get("text"))
            fields = {
                "@type": "VisualArtwork",
                "name": self._plain(label.get("title")),
                "creator": self._plain(label.get("maker")),
                "dateCreated": self._plain(label.get("date")),
                "description": re.sub(r"\s+", " ", plain_text(nodes or ())).strip(),
                "image": number in self._content.pictures
                and f"{address}{self._content.pictures[number]}",
                "url": f"{address}{self._walk(label=label['id'])}",
            }
            works.append({name: value for name, value in fields.items() if value})
        data = {
            "@context": "https://schema.org",
            "@type": "Collection",
            "name": self._title,
            "description": self._plain(self._tour.get("description")),
            "inLanguage": self._language,
            "hasPart": works,
        }
        data = {name: value for name, value in data.items() if value}
        # Nothing in it ends the element that holds it.
        text = json.dumps(data, ensure_ascii=False).replace("<", "\\u003c")
        return f'<script type="application/ld+json">{text}</script>\n'


def _link(address: str, text: str) -> str:
    """A link with a text, which is HTML."""
    return f'<p><a href="{escape(address)}" rel="noopener">{text}</a></p>\n'


def _lang(tag: str) -> str:
    return f' lang="{escape(tag)}"' if tag else ""
