"""WCAG 2.2 AA of the walk, its panels and the catalogue, by axe-core; and what axe cannot tell."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.npm import AXE
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import CELLS, SCENE
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.tour.starting import first_tour
from tests.site.axe import barriers, contrasts
from tests.site.browser import Visitor, visiting

#: Level AA of text.
LEGIBLE = 4.5
PANELS = ("tour", "places", "map", "details", "help")


@pytest.fixture(scope="module", autouse=True)
def axe(require: Callable[[str, str], None]) -> None:
    if remedy := AXE.remedy():
        require("axe-core", remedy)


@pytest.fixture(scope="module")
def toured(museum_db: Path, tmp_path_factory: pytest.TempPathFactory) -> Site:
    artifacts = Artifacts(open_database(museum_db))
    document = json.loads(first_tour(artifacts[SCENE], artifacts[CELLS], "museum.obj")[0])
    document["labels"][0] |= {
        "title": "Night",
        "maker": "A. Painter",
        "text": "A *dark* canvas.\n\n- one",
        "image": "Darkness.",
        "link": "https://example.org/night",
    }
    file = tmp_path_factory.mktemp("tour") / "tour.json"
    file.write_text(json.dumps(document))
    return site_of(museum_db, SiteOptions(pictures=False, opening=False, tour=str(file)))


@pytest.fixture(scope="module")
def visitor(chromium: Any, toured: Site) -> Iterator[Visitor]:
    with visiting(chromium, toured.entries, width=640, height=400) as visitor:
        visitor.complete()
        yield visitor


def test_the_walk_and_its_panels_have_no_barriers(visitor: Visitor) -> None:
    page = visitor.page
    assert barriers(page) == []
    for name in PANELS:
        page.locator(f"button[aria-controls={name}]").click()
        page.wait_for_selector(f"#{name}:visible")
        assert barriers(page) == [], name
        least = contrasts(page)
        assert len(least) > 3
        assert least[0][0] >= LEGIBLE, least[:3]
        page.keyboard.press("Escape")


def test_an_open_label_has_no_barriers(visitor: Visitor) -> None:
    page = visitor.page
    page.locator("button[aria-controls=tour]").click()
    page.get_by_role("button", name="Night").first.click()
    page.wait_for_function("ptm.tour.open === 0")
    assert barriers(page) == []
    assert contrasts(page)[0][0] >= LEGIBLE
    page.keyboard.press("Escape")


def test_a_narrow_window_shows_all_controls(visitor: Visitor) -> None:
    """640 × 400 is a window of 1280 × 800 at 200 %, 320 × 256 one at 400 %."""
    page = visitor.page
    for width, height in ((640, 400), (320, 256)):
        page.set_viewport_size({"width": width, "height": height})
        visitor.frames(2)
        boxes = [b.bounding_box() for b in page.locator("nav button").all() if b.is_visible()]
        assert len(boxes) >= len(PANELS)
        for box in boxes:
            assert box["x"] >= 0
            assert box["x"] + box["width"] <= width
            assert box["y"] + box["height"] <= height
            # Of a target that is not in a line of text (2.5.8).
            assert min(box["width"], box["height"]) >= 24
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.set_viewport_size({"width": 640, "height": 400})


def test_forced_colours_keep_the_focus_visible(visitor: Visitor) -> None:
    page = visitor.page
    page.emulate_media(forced_colors="active")
    page.locator("nav button").first.focus()
    page.keyboard.press("Tab")
    style = "getComputedStyle(document.activeElement)"
    assert page.evaluate(f"{style}.outlineStyle") != "none"
    assert page.evaluate(f"parseFloat({style}.outlineWidth)") >= 1
    # What is open shows without its colour, and the map and its key keep theirs.
    width = "(one) => parseFloat(getComputedStyle(one).borderTopWidth)"
    button = page.locator("nav [aria-controls=map]")
    before = button.evaluate(width)
    button.click()
    page.locator("#map .key").wait_for()
    assert button.evaluate(width) > before
    key = "getComputedStyle(document.querySelector('.key span'), '::before').backgroundColor"
    assert page.evaluate(key) == "rgb(255, 199, 102)"
    button.click()
    page.emulate_media(forced_colors="none")


def test_the_catalogue_has_no_barriers(chromium: Any, toured: Site) -> None:
    with visiting(chromium, toured.entries, width=640, height=400) as visitor:
        visitor.page.goto(f"{visitor.url}catalogue.html")
        assert barriers(visitor.page) == []
        assert visitor.page.evaluate("document.documentElement.scrollWidth") <= 640


def test_barriers_are_seen(visitor: Visitor) -> None:
    page = visitor.page
    page.evaluate("document.querySelector('nav button').setAttribute('role', 'nothing')")
    assert "aria-roles" in {row[0] for row in barriers(page)}
