"""The labels of a tour on the page: markers, panel, list, languages, keyboard and hostile texts."""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ptmtools.errors import InputError
from ptmtools.output.served import place_names
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import CELLS, SCENE
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.tour.starting import first_tour
from tests.site.browser import Visitor, new_page, visiting, visiting_in

HOSTILE = "<img src=x onerror=window.broken=1> [x](javascript:window.broken=1) **bold**"
CAPTIONS = "WEBVTT\n\n00:00.000 --> 00:09.000\n<v Guide>Look <b>left</b> &amp; up\n"


def silence(seconds: float) -> bytes:
    """A WAV file."""
    samples = bytes([128]) * int(8000 * seconds)
    head = struct.pack("<IHHIIHH", 16, 1, 1, 8000, 8000, 1, 8)
    chunks = b"fmt " + head + b"data" + struct.pack("<I", len(samples)) + samples
    return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks


@pytest.fixture(scope="module")
def tour_file(museum_db: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tour in two languages; its first labels have everything, or hostile texts."""
    folder = tmp_path_factory.mktemp("tour")
    artifacts = Artifacts(open_database(museum_db))
    text, _, _ = first_tour(artifacts[SCENE], artifacts[CELLS], "museum.obj")
    document = json.loads(text)
    document["languages"] = ["en", "de"]
    document["title"] = {"en": "Highlights", "de": "Höhepunkte"}
    document["description"] = {"en": "Old works.", "de": "Alte Werke."}
    first, second, third, *_ = place_names(museum_db)
    document["places"] = {
        first: {"en": "Red hall", "de": "Roter Saal"},
        second: {"en": HOSTILE},
        third: {"en": third},
    }
    first, second, *_ = document["labels"]
    first |= {
        "title": {"en": "Night", "de": "Nacht"},
        "maker": "A. Painter",
        "date": {"en": "about 1700", "de": "um 1700"},
        "text": {"en": "A *dark* canvas.\n\n- one\n- two"},
        "image": {"en": "Darkness."},
        "sound": "night.wav",
        "captions": {"en": "night.vtt"},
        "link": "https://example.org/night",
    }
    second |= {"title": HOSTILE, "maker": HOSTILE, "text": HOSTILE, "image": HOSTILE}
    (folder / "night.wav").write_bytes(silence(3))
    (folder / "night.vtt").write_text(CAPTIONS)
    file = folder / "tour.json"
    file.write_text(json.dumps(document))
    return file


@pytest.fixture(scope="module")
def toured(museum_db: Path, tour_file: Path) -> Site:
    return site_of(museum_db, SiteOptions(pictures=False, opening=False, tour=str(tour_file)))


@pytest.fixture(scope="module")
def page(chromium: Any) -> Iterator[Any]:
    page = new_page(chromium, 960, locale="en-GB")
    yield page
    page.context.close()


@pytest.fixture
def visitor(page: Any, toured: Site) -> Iterator[Visitor]:
    with visiting_in(page, toured.entries) as visitor:
        visitor.until("window.ptm.tour")
        visitor.complete()
        yield visitor
        assert visitor.page.evaluate("window.broken") is None


def shown(visitor: Visitor) -> list[int]:
    """Labels whose markers are shown, after two item buffers."""
    visitor.complete()
    visitor.until("window.ptm.walk.needs.age !== null")
    visitor.frames(30)
    labels: list[int] = visitor.page.evaluate("ptm.tour.markers.shown")
    return labels


def test_a_site_without_a_tour_has_none(museum: Site) -> None:
    assert not any("tour-" in name for name in museum.entries)


def test_a_stop_shows_its_work_with_a_marker(visitor: Visitor) -> None:
    visitor.page.get_by_role("button", name="Tour", exact=True).click()
    visitor.page.get_by_role("button", name="Night, A. Painter").first.click()
    assert 0 in shown(visitor)
    panel = visitor.page.locator("#label")
    assert panel.locator("h2").inner_text() == "Night"
    assert panel.locator(".by").inner_text() == "A. Painter, about 1700"
    assert panel.locator("li").all_inner_texts() == ["one", "two"]
    assert panel.locator("em").inner_text() == "dark"
    assert panel.get_by_role("link").get_attribute("href") == "https://example.org/night"
    # The marker lies below the middle of the picture, which the view is turned to.
    box = visitor.page.locator("#markers button[aria-current]").bounding_box()
    size = visitor.page.viewport_size
    assert abs(box["x"] + box["width"] / 2 - size["width"] / 2) < 5
    assert size["height"] / 2 < box["y"] + box["height"] / 2 < size["height"]


def test_markers_behind_walls_are_hidden(visitor: Visitor) -> None:
    """Of the markers that the frustum and the visible cells leave, rays see the same ones."""
    page = visitor.page
    for stop in range(0, page.evaluate("ptm.tour.tour.stops.length"), 5):
        page.evaluate("(stop) => ptm.tour.go(stop)", stop)
        labels = shown(visitor)
        assert page.evaluate(f"ptm.tour.tour.stops[{stop}].label") in labels
    # Behind the visitor's back nothing is marked: turn around at the last stop.
    page.evaluate("ptm.goTo({...ptm.walker.pose, yaw: ptm.walker.pose.yaw + Math.PI, pitch: 0})")
    assert page.evaluate("ptm.tour.open") not in shown(visitor)


def test_a_wall_between_hides_a_marker(visitor: Visitor) -> None:
    page = visitor.page
    page.evaluate("ptm.tour.go(0)")
    assert 0 in shown(visitor)
    # Through the picture to the other side of its wall, looking back at it.
    page.evaluate(
        """() => {
          const { eye, yaw, pitch } = ptm.walker.pose, { normal, marker } = ptm.tour.tour.labels[0];
          const behind = marker.map((x, k) => x - normal[k] * 1.5);
          ptm.goTo({ eye: [behind[0], eye[1], behind[2]], yaw: yaw + Math.PI, pitch });
        }"""
    )
    assert 0 not in shown(visitor)


def test_a_click_on_a_work_opens_its_label_and_a_drag_does_not(visitor: Visitor) -> None:
    page = visitor.page
    page.evaluate("ptm.tour.go(0)")
    shown(visitor)
    page.evaluate("ptm.tour.close()")
    size = page.viewport_size
    x, y = size["width"] / 2, size["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60, y, steps=3)
    page.mouse.up()
    assert page.locator("#label").is_hidden()
    page.evaluate("ptm.tour.go(0)")
    shown(visitor)
    page.evaluate("ptm.tour.close()")
    page.mouse.click(x, y)
    assert page.locator("#label h2").inner_text() == "Night"


def test_the_tour_by_keyboard_alone(visitor: Visitor) -> None:
    page = visitor.page
    page.locator("#view").focus()
    page.keyboard.press("n")
    visitor.complete()
    assert page.evaluate("document.activeElement.textContent") == "Night", "read by screen readers"
    page.keyboard.press("n")
    visitor.complete()
    assert page.evaluate("ptm.tour.stop") == 1
    page.keyboard.press("p")
    visitor.complete()
    assert page.evaluate("ptm.tour.stop") == 0
    page.keyboard.press("Escape")
    assert page.locator("#label").is_hidden()
    assert page.evaluate("document.activeElement.id") == "view"
    shown(visitor)
    page.locator("#markers button").first.focus()
    page.keyboard.press("Enter")
    assert page.locator("#label").is_visible()
    page.keyboard.press("Escape")
    assert page.evaluate("document.activeElement.parentElement.id") == "markers"


def test_texts_are_never_markup(visitor: Visitor) -> None:
    page = visitor.page
    page.evaluate("ptm.tour.go(1)")
    shown(visitor)
    panel = page.locator("#label")
    assert panel.locator("h2").inner_text() == HOSTILE
    assert panel.locator("img, script").count() == 0
    assert panel.get_by_role("link").count() == 0
    assert panel.locator("strong").inner_text() == "bold"
    assert page.locator("#tour img").count() == 0


def test_languages_side_by_side(visitor: Visitor) -> None:
    page = visitor.page
    page.get_by_role("button", name="Tour", exact=True).click()
    page.evaluate("ptm.tour.go(0)")
    page.get_by_label("Language").select_option("de")
    panel = page.locator("#label")
    assert panel.locator("h2").inner_text() == "Nacht"
    assert panel.locator("h2").get_attribute("lang") == "de"
    assert panel.locator(".by").inner_text() == "A. Painter, um 1700"
    # Without a German text, the English one says so.
    assert panel.locator("div[lang=en] em").inner_text() == "dark"
    assert page.locator("#tour h2").inner_text() == "Höhepunkte"
    assert page.locator("#tour h2 + p").inner_text() == "Alte Werke."
    assert page.locator("#tour p a").get_attribute("href") == "catalogue-de.html"


def test_the_walk_and_its_places_have_names_in_each_language(
    visitor: Visitor, museum_db: Path
) -> None:
    page, (model, _, third) = visitor.page, place_names(museum_db)[:3]
    assert page.title() == "Highlights"
    page.get_by_role("button", name="Places").click()
    places = page.locator("#places ol button")
    places.first.wait_for()
    assert places.all_inner_texts()[:3] == ["Red hall", HOSTILE, third]
    assert page.locator("#places img").count() == 0, "a text stays text"
    page.evaluate("ptm.goTo(0)")
    page.get_by_role("button", name="Map").click()
    page.get_by_text("Red hall").nth(1).wait_for()
    page.get_by_role("button", name="Tour", exact=True).click()
    page.get_by_label("Language").select_option("de")
    assert page.title() == "Höhepunkte"
    assert page.locator("title").get_attribute("lang") == "de"
    assert places.first.inner_text() == "Roter Saal"
    assert places.first.locator("span").get_attribute("lang") == "de"
    assert places.nth(1).locator("span").get_attribute("lang") == "en", "only in English"
    assert places.nth(2).locator("span").get_attribute("lang") == "", "the name of the model"
    page.locator("#map .place", has_text="Roter Saal").wait_for()
    assert "Roter Saal" in page.locator("#map canvas").get_attribute("aria-label")
    row = page.evaluate("ptm.index.viewpoints[0]")
    assert row["description"] == model, "programs get the same name in each language"


def test_the_page_has_title_and_places_of_the_tour(
    toured: Site, museum_db: Path, tour_file: Path
) -> None:
    """Those of the options take precedence."""
    page = toured.entries["index.html"].read().decode()
    assert "<title>Highlights</title>" in page
    assert 'property="og:description" content="Old works."' in page
    catalogue = toured.entries["catalogue-de.html"].read().decode()
    assert 'property="og:title" content="Höhepunkte: Katalog"' in catalogue
    assert 'property="og:description" content="Alte Werke."' in catalogue
    for tour in ("none", str(tour_file)):
        options = SiteOptions(
            pictures=False, opening=False, title="A & B", description="C", tour=tour
        )
        own = site_of(museum_db, options).entries
        for name in {"index.html", "catalogue-de.html"} & own.keys():
            text = own[name].read().decode()
            assert "A &amp; B" in text
            assert 'property="og:description" content="C"' in text
            assert "Highlights" not in text
            assert "Höhepunkte" not in text


def test_an_empty_tour_is_none(museum_db: Path, tmp_path: Path) -> None:
    """As `ptm tour init` writes it where it finds nothing."""
    names = place_names(museum_db)
    file = tmp_path / "tour.json"
    empty = {"format": "ptmtools tour", "schema": 1, "languages": ["en"], "labels": []}
    options = SiteOptions(pictures=False, opening=False, tour=str(file))
    file.write_text(json.dumps(empty | {"places": {name: {"en": name} for name in names}}))
    site = site_of(museum_db, options)
    assert not any("tour-" in name or "catalogue" in name for name in site.entries)
    assert any("tour is empty" in note for note in site.notes)
    # Names alone have no catalogue.
    file.write_text(json.dumps(empty | {"places": {names[0]: "Hall"}}))
    again = site.again()
    assert tour_name(again)
    assert not any("catalogue" in name for name in again.entries)
    file.write_text(json.dumps(empty | {"places": {"Nowhere": "Hall"}}))
    with pytest.raises(InputError, match="PTM-I302") as caught:
        site.again()
    assert caught.value.place == "places.Nowhere"


def test_the_browsers_language_and_a_link_to_a_label(chromium: Any, toured: Site) -> None:
    id = json.loads(toured.entries[tour_name(toured)].read())["labels"][0]["id"]
    with visiting(chromium, toured.entries, query=f"?label={id}", locale="de-AT") as visitor:
        visitor.until("window.ptm.tour?.open === 0")
        assert visitor.page.locator("#label h2").inner_text() == "Nacht"
    with visiting(chromium, toured.entries, query="?lang=en", locale="de-AT") as visitor:
        visitor.until("window.ptm.tour")
        assert visitor.page.evaluate("ptm.tour.language") == "en"


def test_a_label_ends_above_two_rows_of_buttons(chromium: Any, toured: Site) -> None:
    with visiting(chromium, toured.entries, query="?lang=de", width=390) as visitor:
        visitor.until("window.ptm.tour")
        visitor.page.evaluate("ptm.tour.go(0)")
        page = visitor.page
        page.locator("#label").wait_for()
        tops = {round(each.bounding_box()["y"]) for each in page.locator("nav button").all()}
        assert len(tops) == 2
        visitor.until("document.querySelector('#panels').style.bottom")
        label = page.locator("#label").bounding_box()
        assert label["y"] + label["height"] < min(tops)
        # A narrow window has room for one panel.
        for name, other in (("tour", "map"), ("map", "tour"), ("tour", "map")):
            page.locator(f"nav [aria-controls={name}]").click()
            page.locator(f"#{name}").wait_for()
            assert page.locator(f"#{other}").is_hidden()


def test_a_sound_is_fetched_by_a_click_only_and_has_captions(visitor: Visitor) -> None:
    page = visitor.page
    page.evaluate("ptm.tour.go(0)")
    visitor.complete()
    assert not [
        visit.path for visit in visitor.visits if ".wav" in visit.path or ".vtt" in visit.path
    ]
    page.locator("#label audio").evaluate("(audio) => audio.play()")
    page.wait_for_function("document.querySelector('#label .captions').textContent")
    assert page.locator("#label .captions").inner_text() == "Look left & up"


def test_a_damaged_or_missing_tour_is_a_notice(chromium: Any, toured: Site) -> None:
    name = tour_name(toured)
    for data in (b"{}", b'{"languages":["en"],"labels":[{"id":1}],"stops":[]}', b"no"):
        entries = {**toured.entries, name: replace(toured.entries[name], source=data)}
        with visiting(chromium, entries) as visitor:
            visitor.page.get_by_text("labels of the tour could not be loaded").wait_for()
            assert visitor.until("s.complete")


def tour_name(site: Site) -> str:
    (name,) = (name for name in site.entries if name.startswith("data/tour-") and ".json" in name)
    return name


def test_the_default_is_the_tour_beside_the_database(
    museum_db: Path, tour_file: Path, tmp_path: Path
) -> None:
    database, beside = tmp_path / "museum.db", tmp_path / "tour.json"
    shutil.copytree(museum_db, database)
    for file in tour_file.parent.iterdir():
        shutil.copy(file, tmp_path)
    plain = SiteOptions(pictures=False, opening=False)
    assert tour_name(site_of(database, plain))
    document = json.loads(tour_file.read_text())
    beside.write_text(json.dumps({**document, "model": "other.obj"}))
    site = site_of(database, plain)
    assert not any("tour-" in name for name in site.entries)
    assert any("other.obj" in note for note in site.notes)
    with pytest.raises(InputError, match="PTM-I120"):
        site_of(database, replace(plain, tour=str(tmp_path / "no.json")))
