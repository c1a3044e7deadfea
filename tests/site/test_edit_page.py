"""A curator places labels on the page of `ptm serve DB --edit`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ptmtools.site.edit_requests import Editing
from ptmtools.site.editing import TourEditor
from ptmtools.site.lookup import files_of
from ptmtools.site.serving import serving
from ptmtools.site.throttle import Visits
from tests.site.browser import Visitor

HOSTILE = "<img src=x onerror=window.broken=1> *sails*"
#: A text that the editor does not change keeps its form.
TOUR = """{"format": "ptmtools tour", "schema": 1, "languages": ["en", "de"],
 "title": {"en": "Works",   "de": "Werke"},
 "labels": [
  {"id": "first", "at": [0.50, 1e0, 0], "title": "First", "date": "about 1700"}],
 "stops": []
}
"""


@pytest.fixture
def visitor(chromium: Any, museum_db: Path, tmp_path: Path) -> Iterator[Visitor]:
    """The page of the editor; `tmp_path` has the tour."""
    database = tmp_path / "museum.db"
    database.symlink_to(museum_db)
    (tmp_path / "tour.json").write_text(TOUR)
    editing = Editing(TourEditor(database))
    with serving(files_of(database), editing=editing) as url:
        viewport = {"width": 900, "height": 500}
        fresh = chromium.new_context(viewport=viewport, bypass_csp=True, locale="en-GB")
        visitor = Visitor(fresh.new_page(), url, Visits())
        visitor.page.on("pageerror", lambda fault: visitor.messages.append(f"error: {fault}"))
        visitor.page.goto(url + editing.address)
        try:
            visitor.until("window.editor")
            visitor.complete()
            yield visitor
            assert visitor.messages == []
            assert visitor.page.evaluate("window.broken") is None
        finally:
            fresh.close()


def field(visitor: Visitor, name: str) -> Any:
    return visitor.page.locator(f"#edit [data-field={name}]")


def button(visitor: Visitor, name: str) -> Any:
    return visitor.page.locator("#edit").get_by_role("button", name=name, exact=True)


def look_at(visitor: Visitor, name: str) -> None:
    """Stands before a picture, with its middle in the middle of the window."""
    place = visitor.page.evaluate(
        """async (name) => {
          const draft = structuredClone(editor.draft.document);
          draft.labels = [{ id: "x", object: name }];
          return (await editor.server.preview(draft)).shown.labels[0];
        }""",
        name,
    )
    middle = [(place["box"][k] + place["box"][k + 3]) / 2 for k in range(3)]
    x, _, z = place["normal"]
    eye = [a + 1.5 * b for a, b in zip(middle, place["normal"], strict=True)]
    visitor.page.evaluate(
        "([eye, x, z]) => ptm.goTo({ eye, yaw: Math.atan2(x, z), pitch: 0 })", [eye, x, z]
    )
    visitor.complete()


def test_a_label_from_the_click_to_the_plain_page(visitor: Visitor, tmp_path: Path) -> None:
    page, file = visitor.page, tmp_path / "tour.json"
    assert "token" not in page.url, "it is not copied with the link to a place"
    look_at(visitor, "painting_02")
    button(visitor, "Add label").click()
    page.mouse.click(450, 250)
    field(visitor, "title").wait_for()
    page.wait_for_function("document.activeElement.dataset.field === 'title'")
    page.keyboard.type("Night")
    field(visitor, "maker").fill("A. Painter")
    field(visitor, "text").fill(HOSTILE)
    page.get_by_role("tab", name="German").click()
    field(visitor, "title").fill("Nacht")
    page.get_by_role("tab", name="English").click()
    # As visitors see it, beside the form: the server makes the texts.
    page.wait_for_function("document.querySelector('#label em')?.textContent === 'sails'")
    assert page.locator("#label img").count() == 0
    page.wait_for_function("document.querySelector('#markers [aria-current]')")
    page.keyboard.press("Control+s")
    page.wait_for_function("!editor.draft.changed")
    text = file.read_text()
    first, second = json.loads(text)["labels"]
    assert second == {
        "id": "painting_02",
        "object": "painting_02",
        "title": {"en": "Night", "de": "Nacht"},
        "maker": "A. Painter",
        "text": {"en": HOSTILE},
    }
    assert first == json.loads(TOUR)["labels"][0]
    assert text.startswith(TOUR[: TOUR.index("}]")]), "the rest is as it was written"
    (stop,) = json.loads(text)["stops"]
    assert stop["label"] == "painting_02"
    button(visitor, "← All stops and labels").click()
    page.get_by_text("Names of the places").click()
    (name, *_) = page.evaluate("editor.loaded.places")
    place = page.locator(f'#edit [data-field="{name}"]')
    place.fill("Hall")
    page.wait_for_function("ptm.index.viewpoints[0].title?.text === 'Hall'")
    page.get_by_text("Languages", exact=True).click()
    page.get_by_role("tab", name="German").click()
    place.fill("Saal")
    field(visitor, "description").fill("Alte Werke.")
    page.wait_for_function("document.querySelector('#tour h2 + p')?.textContent === 'Alte Werke.'")
    page.keyboard.press("Control+s")
    page.wait_for_function("!editor.draft.changed")
    document = json.loads(file.read_text())
    assert document["places"] == {name: {"en": "Hall", "de": "Saal"}}
    assert document["description"] == {"de": "Alte Werke."}
    page.get_by_role("button", name="Remove German").click()
    assert page.evaluate("editor.draft.document.places") == {name: {"en": "Hall"}}
    assert page.evaluate("editor.draft.document.description") is None
    button(visitor, "Undo").click()
    plain = page.context.new_page()
    plain.goto(f"{visitor.url}?label=painting_02&lang=de")
    plain.locator("#label h2").wait_for()
    assert plain.locator("#label h2").inner_text() == "Nacht"
    assert plain.locator("#edit").count() == 0
    assert plain.evaluate("ptm.walker.pose.eye") == pytest.approx(stop["view"]["position"])


def test_order_undo_refusals_and_changes_of_the_file(visitor: Visitor, tmp_path: Path) -> None:
    """By keyboard where a hand could do it, too."""
    page, file = visitor.page, tmp_path / "tour.json"
    look_at(visitor, "painting_01")
    button(visitor, "Add label").press("Enter")
    page.wait_for_function("document.activeElement.id === 'view'")
    page.keyboard.press("Enter")  # what is in the middle
    page.wait_for_function("document.activeElement.dataset.field === 'title'")
    field(visitor, "link").fill("example.org")
    page.get_by_text("Cannot be saved yet: “painting_01”, link").wait_for()
    assert field(visitor, "link").get_attribute("aria-invalid") == "true"
    field(visitor, "link").fill("")
    button(visitor, "← All stops and labels").click()
    button(visitor, "Add stop here").click()
    field(visitor, "title").fill("The end")
    button(visitor, "← All stops and labels").click()
    names = page.locator("#edit ol .name")
    assert names.all_inner_texts() == ["painting_01", "The end"]
    page.get_by_role("button", name="Move The end up").press("Enter")
    assert names.all_inner_texts() == ["The end", "painting_01"]
    assert page.evaluate("document.activeElement.ariaLabel") == "Move The end down"
    names.last.click()
    field(visitor, "place").fill("1")
    field(visitor, "place").press("Enter")
    assert page.evaluate("editor.draft.stops[0].label") == "painting_01"
    button(visitor, "Undo").click()
    button(visitor, "Delete label").click()
    assert names.all_inner_texts() == ["The end"]
    button(visitor, "Undo").click()
    assert names.all_inner_texts() == ["The end", "painting_01"]
    # Another program writes the file meanwhile.
    file.write_text(TOUR.replace("about 1700", "1701"))
    button(visitor, "Save").click()
    page.get_by_text("another program has changed the file").wait_for()
    assert "The end" not in file.read_text()
    button(visitor, "Load the file").click()
    page.wait_for_function("editor.conflict.hidden")
    assert names.count() == 0
    assert page.evaluate("editor.draft.labels[0].date") == "1701"
    button(visitor, "Undo").click()
    assert page.evaluate("editor.draft.changed")
    # Unsaved changes ask before the page is left.
    asked: list[str] = []
    page.on("dialog", lambda dialog: (asked.append(dialog.type), dialog.dismiss()))
    page.close(run_before_unload=True)
    visitor.frames(2)
    assert asked == ["beforeunload"]
    button(visitor, "Save").click()
    page.wait_for_function("!editor.draft.changed")
    stops = json.loads(file.read_text())["stops"]
    assert [stop.get("title", stop.get("label")) for stop in stops] == [
        {"en": "The end"},
        "painting_01",
    ]
