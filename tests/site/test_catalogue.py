"""The catalogue of a tour: a plain page that needs no script."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from ptmtools.site.catalogue import CatalogueContent, catalogue_of
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.serving import serving
from ptmtools.site.tours import transcript_of
from ptmtools.tour.markdown import nodes_of

HOSTILE = "</script><script>window.broken=1</script><img src=x onerror=window.broken=1>\"'"


def label(id: str, cell: int = 0, **fields: Any) -> dict[str, Any]:
    return {"id": id, "marker": [0, 0, 0], "box": [0] * 6, "cell": cell, **fields}


def content(*labels: dict[str, Any], stops: list[dict[str, Any]] | None = None) -> CatalogueContent:
    tour = {"languages": ["en", "ar"], "labels": list(labels), "stops": stops or []}
    pictures = {0: "data/work-a.jpg"}
    transcripts = {0: {"en": "Look left"}}
    return CatalogueContent(tour, "Museum", {0: "Hall", 1: "Attic"}, pictures, transcripts, "data/")


class Page(HTMLParser):
    """Elements with their attributes, and the text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(re.sub(r"<(style|script)[^>]*>.*?</\1>", r"<\1></\1>", html, flags=re.DOTALL))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))

    def handle_data(self, data: str) -> None:
        self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


def test_works_are_listed_by_room_in_the_order_of_the_tour() -> None:
    first = label(
        "a",
        title={"en": "Night", "ar": "ليل"},
        maker={"": "R."},
        image={"en": "Dark."},
        text={"en": nodes_of("*Old* canvas")},
        sound={"": "s.mp3"},
        captions={"": "c.vtt"},
        link={"": "https://example.org"},
    )
    labels = first, label("b", 1, title={"": "Attic work"}), label("c", title={"": "Second"})
    stops = [{"label": 2}, {"label": 1}, {"label": 0}]
    pages = catalogue_of(content(*labels, stops=stops))
    assert list(pages) == ["catalogue.html", "catalogue-ar.html"]
    page = Page(pages["catalogue.html"])
    assert [row["id"] for row in page.all("article")] == ["c", "a", "b"], "rooms stay together"
    assert page.text.index("Hall") < page.text.index("Second") < page.text.index("Attic")
    (image,) = page.all("img")
    assert (image["src"], image["alt"]) == ("data/work-a.jpg", "Dark.")
    assert [row["src"] for row in page.all("audio") + page.all("track")] == [
        "data/s.mp3",
        "data/c.vtt",
    ]
    assert "Look left" in page.text
    links = [row["href"] for row in page.all("a")]
    assert {"index.html?label=a&lang=en", "https://example.org", "catalogue-ar.html"} <= set(links)
    other = Page(pages["catalogue-ar.html"])
    assert other.all("html") == [{"lang": "ar", "dir": "rtl"}]
    assert "ليل" in other.text
    spans = [row for row in other.all("div") if row.get("lang") == "en"]
    assert spans, "a text in another language says so"


def test_rooms_have_names_in_the_language_of_the_page() -> None:
    plain = content(label("a"), label("b", 1))
    walk = {
        "title": {"en": "Walk", "ar": "جولة"},
        "description": {"en": "Old works."},
        "places": {"Hall": {"en": "Red hall", "ar": "القاعة الحمراء"}, "Attic": {"en": HOSTILE}},
    }
    pages = catalogue_of(replace(plain, tour={**plain.tour, **walk}))
    assert '<h1><span dir="auto">Walk</span>: Catalogue</h1>' in pages["catalogue.html"]
    english = {**plain.tour, **walk, "title": {"en": "Walk"}}
    arabic = catalogue_of(replace(plain, tour=english))["catalogue-ar.html"]
    assert '<h1><span dir="auto" lang="en">Walk</span></h1>' in arabic
    page, other = (Page(pages[name]) for name in ("catalogue.html", "catalogue-ar.html"))
    assert "Red hall" in page.text
    assert "Old works." in page.text
    assert "القاعة الحمراء" in other.text
    assert page.all("span")[0] == {"dir": "auto"}
    assert {"dir": "auto", "lang": "en"} in other.all("span"), "a name in another language"
    assert HOSTILE in page.text
    assert len(page.all("script")) == 1
    assert [row["content"] for row in page.all("meta") if row.get("property")] == [
        "Walk: Catalogue",
        "Old works.",
    ]
    text = pages["catalogue-ar.html"].partition('<script type="application/ld+json">')[2]
    data = json.loads(text.partition("</script>")[0])
    assert (data["inLanguage"], data["description"]) == ("ar", "Old works.")
    # The walk is in the language of the page that leads to it.
    assert {row["href"] for row in other.all("a") if "index" in str(row["href"])} == {
        "index.html?lang=ar",
        "index.html?label=a&lang=ar",
        "index.html?label=b&lang=ar",
    }
    assert "العربية" in page.text
    assert other.all("a")[0] == {"class": "skip", "href": "#content"}
    assert {"lang": "en", "dir": "ltr"} in other.all("span"), "words that are not translated"


def test_linked_data_names_the_works() -> None:
    pages = catalogue_of(content(label("a", title={"": "Night"}, maker={"": "R."})))
    text = pages["catalogue.html"].partition('<script type="application/ld+json">')[2]
    data = json.loads(text.partition("</script>")[0])
    (work,) = data["hasPart"]
    assert work == {
        "@type": "VisualArtwork",
        "name": "Night",
        "creator": "R.",
        "image": "data/work-a.jpg",
        "url": "index.html?label=a&lang=en",
    }


def test_hostile_texts_stay_texts() -> None:
    fields = {name: {"": HOSTILE} for name in ("title", "maker", "date", "image")}
    row = label("a", **fields, text={"": nodes_of(HOSTILE)})
    page = Page(catalogue_of(content(row))["catalogue.html"])
    assert len(page.all("script")) == 1, "the data"
    assert len(page.all("img")) == 1, "the picture of the work"
    assert not any(name.startswith("on") for _, attributes in page.elements for name in attributes)


@pytest.mark.parametrize(
    ("captions", "text"),
    [
        (
            "WEBVTT\n\n00:00.000 --> 00:01.000\n<v Guide>Look <b>left</b> &amp; up\n",
            "Look left & up",
        ),
        ("WEBVTT - x\r\n\r\nNOTE no\r\n\r\n1\r\n00:00:00.000 --> 00:00:01.000\r\nA\r\nB", "A B"),
        ("WEBVTT\n\nSTYLE\n::cue {}\n\n00:01.000 --> 00:02.000 align:start\n- C\n", "- C"),
        ("WEBVTT", ""),
    ],
)
def test_texts_of_captions(captions: str, text: str) -> None:
    assert transcript_of(captions) == text


def test_a_site_has_the_catalogue_with_pictures(
    museum_db: Path, tmp_path: Path, chromium: Any
) -> None:
    objects = ["painting_01", "painting_02"]
    document = {
        "format": "ptmtools tour",
        "schema": 1,
        "languages": ["en", "ar"],
        "labels": [
            {"id": f"w{k}", "object": name, "title": name} for k, name in enumerate(objects)
        ],
        "stops": [{"label": "w0", "view": {"position": [0, 1.6, 0], "direction": [1, 0, 0]}}],
    }
    (tmp_path / "tour.json").write_text(json.dumps(document))
    options = SiteOptions(opening=False, tour=str(tmp_path / "tour.json"))
    site: Site = site_of(museum_db, options)
    with serving(site.entries) as url:
        context = chromium.new_context(java_script_enabled=False)
        page = context.new_page()
        page.goto(url + "catalogue.html")
        assert page.locator("article").count() == 2
        # Nothing lies where one could scroll to: a page from right to left began there.
        page.goto(url + "catalogue-ar.html")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.goto(url + "catalogue.html")
        width = page.locator("img").evaluate_all("(all) => all.map((one) => one.naturalWidth)")
        assert width == [480], "the work with a stop has a picture"
        page.goto(url)
        page.get_by_role("link", name="The works as text and pictures").first.click()
        assert page.locator("h1").inner_text().endswith("Catalogue")
        context.close()
