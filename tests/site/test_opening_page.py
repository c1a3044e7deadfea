"""The page takes the first view from the opening, and does without one that is damaged."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browser import hurried

from ptmtools.site import opening
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.program import address_of
from tests.web import node

from .browser import Visitor

HERE = Path(__file__).parent

Visiting = Callable[..., AbstractContextManager[Visitor]]


@pytest.fixture(scope="module")
def site(two_rooms: Path) -> Site:
    return site_of(two_rooms, SiteOptions(pictures=False))


@pytest.fixture(scope="module")
def large(two_rooms: Path) -> Site:
    """As one whose opening has only the first view."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(opening, "WHOLE", 0)
        return site_of(two_rooms, SiteOptions(pictures=False))


@pytest.fixture(scope="module")
def without(two_rooms: Path) -> Site:
    return site_of(two_rooms, SiteOptions(pictures=False, opening=False))


def opening_name(site: Site) -> str:
    return next(name for name in site.entries if name.startswith("data/opening-"))


def asked(visitor: Visitor) -> list[str]:
    return [visit.path.lstrip("/") for visit in visitor.visits]


@pytest.mark.parametrize("rooms", ["first", "all"])
def test_the_first_view_comes_with_the_opening(
    visit: Visiting, site: Site, large: Site, without: Site, rooms: str
) -> None:
    site = site if rooms == "all" else large
    with visit(site) as visitor:
        state = visitor.complete()
        files = asked(visitor)
        assert state["exact"]
        assert visitor.messages == []
    with visit(without) as visitor:
        same = visitor.complete()
        more = asked(visitor)
    cell = site.index["cells"][state["cell"]]
    assert files.count(opening_name(site)) == 1
    assert not {f"data/{cell['record']}", f"data/{cell['geometry']}"} & set(files)
    assert len(files) < len(more)
    others = {f"data/{row[kind]}" for row in site.index["cells"] for kind in ("record", "geometry")}
    assert bool(others & set(files)) is (rooms == "first")
    assert (state["cell"], state["held"]) == (same["cell"], same["held"])


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[: len(data) // 2],
        lambda data: b"\xff" * len(data),
        lambda data: data[:4] + bytes(len(data) - 4),
        lambda data: data[:-200] + bytes(200),
        lambda data: data + bytes(1000),
    ],
)
def test_a_damaged_opening_costs_only_time(
    visit: Visiting, site: Site, damage: Callable[[bytes], bytes]
) -> None:
    name = opening_name(site)
    entry = site.entries[name]
    entries = {**site.entries, name: replace(entry, source=damage(entry.read()))}
    with visit(replace(site, entries=entries)) as visitor:
        state = visitor.complete()
        assert state["exact"]
        assert not [message for message in visitor.messages if "Error" in message]


def test_a_missing_opening_costs_only_time(visit: Visiting, site: Site) -> None:
    entries = {n: entry for n, entry in site.entries.items() if n != opening_name(site)}
    with visit(replace(site, entries=entries)) as visitor:
        assert visitor.complete()["exact"]


def test_an_opening_that_never_arrives_costs_only_time(visit: Visiting, site: Site) -> None:
    def prepare(page: Any) -> None:
        page.route("**/opening-*", lambda route: None)
        hurried(page)

    with visit(site, prepare=prepare) as visitor:
        assert visitor.complete()["exact"]


def test_browsers_that_cannot_unpack_it_do_not_fetch_it(visit: Visiting, site: Site) -> None:
    def prepare(page: Any) -> None:
        page.add_init_script("delete window.DecompressionStream")

    with visit(site, prepare=prepare) as visitor:
        assert visitor.complete()["exact"]
        assert opening_name(site) not in asked(visitor)
        assert visitor.messages == []


@pytest.mark.parametrize(
    ("aside", "turned", "expected"),
    [(0.0, 0.0, True), (0.4, 9.0, True), (0.0, 351.0, True), (0.0, -369.0, True)]
    + [(0.6, 0.0, False), (0.0, 11.0, False), (0.0, 349.0, False), (0.0, 180.0, False)],
)
def test_a_link_close_by_brings_the_opening(
    visit: Visiting, large: Site, aside: float, turned: float, expected: bool
) -> None:
    x, y, z, yaw = address_of(large.index["viewpoints"][0])
    with visit(large, query=f"#{x + aside},{y},{z},{yaw + turned}") as visitor:
        visitor.complete()
        assert (opening_name(large) in asked(visitor)) is expected


@pytest.mark.parametrize("place", [0, 1])
def test_every_link_brings_an_opening_with_all_rooms(
    visit: Visiting, site: Site, place: int
) -> None:
    """The page knows whether it leads to the view of the opening."""
    x, y, z, yaw = address_of(site.index["viewpoints"][place])
    with visit(site, query=f"#{x},{y},{z},{yaw}") as visitor:
        assert visitor.complete()["exact"]
        assert opening_name(site) in asked(visitor)
        expected = visitor.page.evaluate(
            "ptm.walk.stream.opening.next.then((next) => next !== null)"
        )
        assert expected is (place == 0)


def test_a_link_to_a_viewpoint_brings_its_opening(
    visit: Visiting, two_rooms: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opening, "WHOLE", 0)
    monkeypatch.setattr(opening, "REPEATED", 1.0)
    site = site_of(two_rooms, SiteOptions(pictures=False))
    view = site.index["viewpoints"][1]
    x, y, z, yaw = address_of(view)
    with visit(site, query=f"#{x + 0.1},{y},{z},{yaw + 2}") as visitor:
        state = visitor.complete()
        assert state["exact"]
        assert state["cell"] == view["cell"]
        (name,) = {name for name in asked(visitor) if "opening-" in name}
        assert name.endswith("-1.bin")
        assert f"data/{site.index['cells'][view['cell']]['record']}" not in asked(visitor)
        assert visitor.messages == []


@pytest.mark.parametrize("there", [3, 2, 1, 0])
def test_a_silent_connection_gives_up_the_rest(there: int) -> None:
    """What came before is used."""
    parts = [("record", 3, b"room"), ("texture", 0, b"levels"), ("preview", 5, b"image")]
    listed = [[kind, number, len(data)] for kind, number, data in parts]
    text = json.dumps({"parts": listed, "next": []}).encode()
    head = struct.pack("<I", len(text)) + text
    stream = zlib.compressobj(9, zlib.DEFLATED, zlib.MAX_WBITS | 16)
    packed = [
        stream.compress(data) + stream.flush(zlib.Z_SYNC_FLUSH)
        for data in (head, *(data for *_, data in parts))
    ]
    data = b"".join(packed) + stream.flush()
    end = len(data) if there == 3 else len(b"".join(packed[: there + 1])) + 1
    actual = json.loads(node.run(HERE / "stalled.mjs", json.dumps([*data]), end))
    expected = ["room", "levels", "image"][:there]
    assert actual["taken"] == expected + [None] * (4 - there)
    assert actual["bytes"] == end
    assert actual["waited"] == 20_000
