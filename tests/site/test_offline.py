"""Sites of `ptm publish --offline`: visited once, they work without a network."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Visitor, image_of
from numpy.typing import NDArray
from samples import write_tour
from starlette.responses import PlainTextResponse, RedirectResponse

from ptmtools.cli.main import main
from ptmtools.site.about import MANIFEST
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.lookup import entry_lookup
from ptmtools.site.program import INDEX, WORKER
from ptmtools.site.publishing import weight_of
from ptmtools.site.responses import app_of
from ptmtools.site.serving import running, serving
from ptmtools.site.throttle import Visits
from ptmtools.store.layout import sha256

#: Whether the browser keeps the page and every byte of the textures that it has received.
KEEPS = """
async () => {
  const names = await caches.keys(), cache = names.length === 1 && await caches.open(names[0]);
  if (!cache || !(await cache.match("./"))) return false;
  const keys = (await cache.keys()).map(({ url }) => url), { stream } = ptm.walk;
  const has = (url, byte) => keys.some((key) => {
    const [, begin, end] = key.match(/^.*[?]bytes=([0-9]+)-([0-9]+)/) ?? [];
    return key.startsWith(url) && Number(begin) <= byte && byte <= Number(end);
  });
  const { cells } = ptm.index, received = stream.files.map(({ length }) => length);
  const keeps = (kind, c) => keys.includes(stream.site.cell(kind, c));
  return received.every((length, t) => !length || (has(stream.url("texture", t), 0)
      && has(stream.url("texture", t), length - 1)))
    && cells.every((_, c) => !stream.records.has(c) || keeps("record", c))
    && cells.every((_, c) => !stream.shapes.has(c) || keeps("geometry", c));
}
"""
#: Everything of the site is here.
ALL = "ptm.walk.exact && s.pending === 0 && ptm.walk.client.next(ptm.walk.stream.estimate) === null"


#: The names that the browser keeps.
NAMES = """
async () => {
  const keys = [];
  for (const name of await caches.keys()) keys.push(...(await (await caches.open(name)).keys()));
  return keys.map(({ url }) => new URL(url).pathname.slice(1));
}
"""
GONE = """
async () => {
  const registrations = await navigator.serviceWorker.getRegistrations();
  return registrations.length + (await caches.keys()).length === 0;
}
"""


#: Loads a sound: whether it plays, as the browser expects, without a stop.
PLAYS = """
(url) => new Promise((done) => {
  const sound = Object.assign(new Audio(url), { preload: "auto" });
  sound.oncanplaythrough = () => done(true);
  sound.onerror = () => done(false);
})
"""
#: The folder of a site that is not at the root of its host.
FOLDER = "walk"


class Host:
    """A host of a site in a folder, which removes ``.html`` from addresses, as Cloudflare Pages
    does; with ``fault``, its answers have the status 503."""

    def __init__(self, site: Site) -> None:
        self.visits, self.fault = Visits(), False
        self._files = app_of(entry_lookup(site.entries), visits=self.visits)

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        path = scope["path"].removeprefix(f"/{FOLDER}")
        query = f"?{text}" if (text := scope["query_string"].decode()) else ""
        app: Any = self._files
        if self.fault:
            app = PlainTextResponse("busy", 503)
        elif path.endswith(".html"):
            app = RedirectResponse(f"/{FOLDER}{path[:-5].removesuffix('index')}{query}", 308)
        elif "." not in path and path != "/":
            path += ".html"
        await app({**scope, "raw_path": path.encode()}, receive, send)


#: Tells the worker what the page has received, and gives it the time to keep that.
RECEIVED = """
async (name) => {
  const files = [new URL(name, location).href], { controller } = navigator.serviceWorker;
  controller.postMessage({ index: "", files, ranged: [] });
  await new Promise((done) => setTimeout(done, 500));
}
"""
#: Fetches a file; it would be kept by the second time. Whether a service worker answers.
FETCH = """
async (name) => {
  for (const _ of [1, 2]) await (await fetch(name)).arrayBuffer();
  return navigator.serviceWorker.controller !== null;
}
"""


@pytest.fixture(scope="module")
def with_tour(tmp_path_factory: pytest.TempPathFactory) -> SiteOptions:
    """The options of a site with a tour of one sound."""
    return SiteOptions(pictures=False, tour=write_tour(tmp_path_factory.mktemp("tour")))


@pytest.fixture(scope="module")
def site(two_rooms: Path, with_tour: SiteOptions) -> Site:
    return site_of(two_rooms, replace(with_tour, offline=True))


@contextmanager
def browsing(chromium: Any) -> Iterator[Any]:
    """A browser whose pages keep their policies."""
    context = chromium.new_context(viewport={"width": 320, "height": 240}, reduced_motion="reduce")
    try:
        yield context
    finally:
        context.close()


@contextmanager
def open_page(context: Any, url: str) -> Iterator[Visitor]:
    page = context.new_page()
    visitor = Visitor(page, url, Visits())
    page.on("console", lambda said: visitor.hear(f"{said.type}: {said.text}"))
    page.on("pageerror", lambda fault: visitor.messages.append(f"error: {fault}"))
    page.goto(url)
    yield visitor
    page.close()


def picture_of(visitor: Visitor) -> NDArray[np.uint8]:
    """The window: the policy of the page forbids the style of `Visitor.picture`."""
    return image_of(visitor.page.screenshot())


def forget(visitor: Visitor) -> None:
    """Empties the cache of HTTP, not that of service workers."""
    session = visitor.page.context.new_cdp_session(visitor.page)
    session.send("Network.clearBrowserCache")


def port_of(url: str) -> int:
    return int(url.rstrip("/").rpartition(":")[2])


def wait_for(visitor: Visitor, condition: str) -> None:
    """Of an asynchronous function of the page."""
    late = time.monotonic() + 60
    while not visitor.page.evaluate(condition):
        assert time.monotonic() < late, condition
        visitor.frames(5)


def keeps(visitor: Visitor) -> None:
    """Waits until the browser keeps what the page has received."""
    visitor.until(ALL)
    wait_for(visitor, KEEPS)


def test_a_visited_walk_without_a_network(chromium: Any, site: Site) -> None:
    """The same picture, at the beginning and at another place; a second visit downloads documents
    alone. The catalogue and a sound are kept as well, whatever the host makes of addresses."""
    last = len(site.index["viewpoints"]) - 1
    (sound,) = (name for name in site.entries if name.endswith(".wav"))
    first, again = Host(site), Host(site)
    with browsing(chromium) as context, ExitStack() as serving_first:
        root = serving_first.enter_context(running(first))
        url = f"{root}{FOLDER}/"
        with open_page(context, url) as visitor:
            keeps(visitor)
            pictures = [picture_of(visitor)]
            assert visitor.page.evaluate(PLAYS, sound)
            visitor.page.evaluate("(place) => ptm.goTo(place)", last)
            visitor.frames(2)
            visitor.until(ALL)
            keeps(visitor)
            pictures.append(picture_of(visitor))
            # No navigation may be answered with a response that was redirected.
            visitor.page.evaluate("fetch('catalogue-de.html').then((answer) => answer.text())")
            visitor.page.goto(f"{url}catalogue.html")
            assert visitor.page.url == f"{url}catalogue"
            for name in ("catalogue.html", "catalogue-de.html"):
                wait_for(visitor, f"async () => Boolean(await caches.match('{name}'))")
            assert visitor.messages == []
            first.fault = True
            visitor.page.goto(f"{url}catalogue")
            assert visitor.page.locator("h3").inner_text() == "Night"
            visitor.page.goto(f"{url}?ui=none")
            assert visitor.page.title() == "Db"
            forget(visitor)
        serving_first.close()
        with running(again, port=port_of(root)), open_page(context, url) as one:
            one.until(ALL)
        names = {visit.path.lstrip("/") for visit in again.visits}
        assert names <= {"", WORKER, MANIFEST}, names
        with open_page(context, f"{url}index.html?lang=en") as visitor:
            visitor.until(ALL)
            assert np.array_equal(picture_of(visitor), pictures[0])
            assert visitor.page.evaluate(PLAYS, sound)
            visitor.page.evaluate("(place) => ptm.goTo(place)", last)
            visitor.frames(2)
            visitor.until(ALL)
            assert np.array_equal(picture_of(visitor), pictures[1])
            assert visitor.page.evaluate("ptm.errors") == []
            for address, title in {"catalogue": "Night", "catalogue-de.html": "Nacht"}.items():
                visitor.page.goto(f"{url}{address}")
                assert visitor.page.locator("h3").inner_text() == title
        assert visitor.messages == []


def exchanged(site: Site) -> Site:
    """A later version of a site: two textures have changed places."""
    (old,) = (name for name in site.entries if name.startswith("data/index-"))
    index = json.loads(site.entries[old].read())
    rows = index["textures"]
    places = [k for k, row in enumerate(rows) if "room_" in row["file"]]
    rows[places[0]], rows[places[1]] = rows[places[1]], rows[places[0]]
    data = json.dumps(index).encode()
    new = f"data/index-{sha256(data)[:10]}.json"
    entries = {name: entry for name, entry in site.entries.items() if name != old}
    entries[new] = replace(site.entries[old], name=new, source=data)
    text = entries[INDEX].read().decode().replace(old, new)
    entries[INDEX] = replace(entries[INDEX], source=text.encode())
    return Site(entries, index)


def test_a_new_version_takes_the_place_of_the_old(chromium: Any, two_rooms: Path) -> None:
    """Also without a network; what it does not name is removed. Published without `--offline`, the
    site leaves nothing in the browser, even if a page of before is open."""
    plain = SiteOptions(pictures=False, opening=False)
    before = site_of(two_rooms, replace(plain, offline=True))
    after = exchanged(before)
    (old,) = before.entries.keys() - after.entries.keys()
    with browsing(chromium) as context:
        with serving(before.entries) as url, open_page(context, url) as visitor:
            keeps(visitor)
            first = picture_of(visitor)
            assert old in visitor.page.evaluate(NAMES)
        port = port_of(url)
        with serving(after.entries, port=port), open_page(context, url) as visitor:
            keeps(visitor)
            second = picture_of(visitor)
            # The page sees no downloads of its own, but learns of those of the service worker.
            visitor.until("s.latency !== 0.1", 20)
            assert not np.array_equal(first, second)
            wait_for(visitor, f"async () => !(await ({NAMES})()).includes('{old}')")
            kept = visitor.page.evaluate(NAMES)
            assert any(name.endswith(".ptm") for name in kept)
            assert all(name in after.entries for name in kept if name)
            forget(visitor)
        with open_page(context, url) as visitor:
            visitor.until(ALL)
            assert np.array_equal(picture_of(visitor), second)
        entries = site_of(two_rooms, plain).entries
        with open_page(context, url) as former:
            with serving(entries, port=port):
                former.until(ALL)
                with open_page(context, url) as visitor:
                    visitor.until(ALL)
                    wait_for(visitor, GONE)
                    assert np.array_equal(picture_of(visitor), first)
                # Browsers end a worker when they like; for a page that is open they start it again.
                session = context.new_cdp_session(former.page)
                for command in ("enable", "stopAllWorkers"):
                    session.send(f"ServiceWorker.{command}")
                name = next(name for name in entries if name.endswith(".glb"))
                assert former.page.evaluate(FETCH, name), "a worker answers"
            # A page that loads slowly tells the worker last what it received; the host has gone.
            former.page.evaluate(RECEIVED, name)
            assert former.page.evaluate(GONE)
        assert visitor.messages == []


def test_other_sites_do_not_grow(site: Site, two_rooms: Path, with_tour: SiteOptions) -> None:
    plain = site_of(two_rooms, with_tour)
    assert site.entries.keys() - plain.entries.keys() == {WORKER}
    assert "register.js" not in plain.entries[INDEX].read().decode()
    assert weight_of(site).whole - weight_of(plain).whole < 200


def test_the_command_writes_and_removes_the_script(two_rooms: Path, tmp_path: Path) -> None:
    words = ["-q", "publish", str(two_rooms), "-o", str(tmp_path / "site"), "--no-pictures"]
    assert main([*words, "--offline"]) == 0
    assert (tmp_path / "site" / WORKER).exists()
    assert main(words) == 0
    assert not (tmp_path / "site" / WORKER).exists()
