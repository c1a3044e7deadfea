"""A walk in a page of another origin: the element, its events, and what leads the visitor."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import CELLS, SCENE
from ptmtools.site.about import element_tags
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.entry import SiteEntry
from ptmtools.site.program import ELEMENT, fixed_script
from ptmtools.site.serving import serving
from ptmtools.tour.starting import first_tour

#: The page of a museum, with the element and a list of its events.
HOST = """<!doctype html><title>Host</title>
{tags}
<script>
  window.events = [];
  for (const name of ["ready", "room", "label"]) {{
    addEventListener(`ptm-${{name}}`, (event) => events.push([name, event.detail]));
  }}
</script>"""


@pytest.fixture(scope="module")
def toured(museum_db: Path, tmp_path_factory: pytest.TempPathFactory) -> Site:
    artifacts = Artifacts(open_database(museum_db))
    text, _, _ = first_tour(artifacts[SCENE], artifacts[CELLS], "museum.obj")
    file = tmp_path_factory.mktemp("tour") / "tour.json"
    file.write_text(text)
    return site_of(museum_db, SiteOptions(pictures=False, opening=False, tour=str(file)))


@pytest.fixture(scope="module")
def served(toured: Site) -> Iterator[str]:
    with serving(toured.entries, origin="*") as url:
        yield url


def host(chromium: Any, site: str, more: str = "") -> Any:
    """A context manager of the host's page, of another origin; ``more`` are attributes."""
    tags = element_tags("The museum", ELEMENT, fixed_script(ELEMENT).read(), site)
    tags = tags.replace("<ptm-walk ", f'<ptm-walk {more} style="width:640px;height:480px" ')
    text = HOST.format(tags=tags).encode()
    return serving({"index.html": SiteEntry("index.html", text, "text/html; charset=utf-8")})


def frame_of(page: Any) -> Any:
    """The frame of the walk, once it is complete."""
    page.wait_for_function("events.some(([name]) => name === 'ready')", timeout=120_000)
    (frame,) = (frame for frame in page.frames if frame != page.main_frame)
    frame.wait_for_function("window.ptm?.tour && ptm.walk.complete", timeout=120_000)
    return frame


def test_events_and_ways_of_an_embedded_walk(chromium: Any, served: str, toured: Site) -> None:
    with host(chromium, served) as url:
        page = chromium.new_context(bypass_csp=True).new_page()
        page.goto(url)
        frame = frame_of(page)
        assert url.split("/")[2] != served.split("/")[2], "another origin"
        assert page.evaluate("events[0]") == ["ready", {"format": "ptm-walk", "title": "Museum"}]
        page.evaluate("document.querySelector('ptm-walk').goTo({ stop: 1 })")
        page.wait_for_function("events.some(([name]) => name === 'label')")
        assert frame.evaluate("ptm.tour.stop") == 1
        (name,) = (n for n in toured.entries if n.startswith("data/tour-"))
        ids = [row["id"] for row in json.loads(toured.entries[name].read())["labels"]]
        page.evaluate("(id) => document.querySelector('ptm-walk').goTo({ label: id })", ids[3])
        frame.wait_for_function("ptm.tour.open === 3")
        places = len(toured.index["viewpoints"])
        page.evaluate("(k) => document.querySelector('ptm-walk').goTo({ place: k })", places - 1)
        cell = toured.index["viewpoints"][places - 1]["cell"]
        page.wait_for_function(
            "(cell) => events.some(([name, row]) => name === 'room' && row.cell === cell)", arg=cell
        )
        page.context.close()


STRANGE = [
    "null",
    "'x'",
    "{ format: 'ptm-walk' }",
    "{ format: 'ptm-walk', goTo: { place: 'length' } }",
    "{ format: 'ptm-walk', goTo: { place: -1, stop: 1e9, label: {} } }",
    "{ format: 'other', goTo: { stop: 1 } }",
]


def test_strange_messages_change_nothing(chromium: Any, served: str) -> None:
    with host(chromium, served) as url:
        page = chromium.new_context(bypass_csp=True).new_page()
        page.goto(url)
        frame = frame_of(page)
        before = frame.evaluate("ptm.walker.pose")
        for message in STRANGE:
            window = "document.querySelector('ptm-walk').frame.contentWindow"
            page.evaluate(f"{window}.postMessage({message}, '*')")
        # Messages arrive in their order.
        frame.evaluate("addEventListener('message', ({ data }) => (window.last = data))")
        page.evaluate(f"{window}.postMessage('last', '*')")
        frame.wait_for_function("window.last === 'last'")
        assert frame.evaluate("[ptm.tour.stop, ptm.errors]") == [-1, []]
        assert frame.evaluate("ptm.walker.pose") == before
        page.context.close()


def test_a_frame_without_an_interface_that_begins_at_a_label(
    chromium: Any, served: str, toured: Site
) -> None:
    (name,) = (n for n in toured.entries if n.startswith("data/tour-"))
    id = json.loads(toured.entries[name].read())["labels"][2]["id"]
    with host(chromium, served, f'ui="none" label="{id}"') as url:
        page = chromium.new_context(bypass_csp=True).new_page()
        page.goto(url)
        frame = frame_of(page)
        assert not frame.locator("nav").is_visible()
        assert frame.evaluate("ptm.tour.open") == 2
        assert page.locator("iframe").get_attribute("title") == "The museum"
        page.context.close()


def test_a_script_of_other_contents_does_not_run(chromium: Any, served: str) -> None:
    tags = element_tags("The museum", ELEMENT, fixed_script(ELEMENT).read() + b" ", served)
    text = HOST.format(tags=tags).encode()
    with serving({"index.html": SiteEntry("index.html", text, "text/html; charset=utf-8")}) as url:
        page = chromium.new_context().new_page()
        with page.expect_console_message(lambda message: "integrity" in message.text):
            page.goto(url)
        assert page.locator("iframe").count() == 0
        page.context.close()


def test_a_kiosk_returns_to_its_beginning(chromium: Any, served: str) -> None:
    page = chromium.new_context(bypass_csp=True).new_page()
    page.goto(f"{served}?ui=kiosk&rest=0.7")
    page.wait_for_function("window.ptm?.tour && ptm.walk.complete")
    first = page.evaluate("ptm.state().pose.eye")
    page.evaluate("ptm.goTo(3)")
    page.locator("button[aria-controls=tour]").click()
    assert page.evaluate("ptm.state().pose.eye") != first
    page.wait_for_function(
        "(eye) => String(ptm.state().pose.eye) === String(eye) && "
        "!document.querySelector('#panels section:not([hidden])')",
        arg=first,
    )
    page.context.close()


def test_the_page_alone_loads_no_script_of_frames(chromium: Any, served: str) -> None:
    page = chromium.new_context(bypass_csp=True).new_page()
    names: list[str] = []
    page.on("request", lambda request: names.append(request.url))
    page.goto(served)
    page.wait_for_function("window.ptm?.tour && ptm.walk.complete", timeout=120_000)
    assert not any("embedded" in name for name in names)
    page.context.close()
