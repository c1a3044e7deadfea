"""Levels of detail of objects in the page: drawn simplified at first, then as modelled."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.site.content import Site, site_of
from tests.site.conftest import PLAIN, build
from tests.systems.apo.statues import write_rooms

#: Triangles that the page has, and those that it draws.
COUNTS = """({
  here: [...ptm.walk.stream.shapes.values()].flat().reduce((n, s) => n + s.indices.length / 3, 0),
  drawn: [...ptm.walk.picture.renderer.cells.values()].flatMap(({ batches }) => batches)
    .reduce((n, { count }) => n + count / 3, 0),
  files: ptm.walk.client.catalogue.meshes.map(({ file }) => file),
})"""
#: Near to each statue; the first viewpoint is far from one.
NEAR = [[-2.8, 1.5, 0.6], [2.7, 1.5, -0.4]]


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rooms(tmp_path_factory.mktemp("statues") / "rooms", 6)


@pytest.fixture(scope="module")
def database(model: Path) -> Path:
    return build(model, model.with_name("db"))


@pytest.fixture(scope="module")
def site(database: Path) -> Site:
    return site_of(database, PLAIN)


@pytest.fixture(scope="module")
def plain(model: Path, database: Path) -> Site:
    """Of a copy that is emitted again."""
    copy = shutil.copytree(database, database.with_name("plain"))
    return site_of(build(model, copy, "--lods", "none"), PLAIN)


class Gate:
    """Holds requests for finer meshes until it is opened."""

    def __init__(self) -> None:
        self.held: list[Any] = []
        self.is_open = False

    def prepare(self, page: Any) -> None:
        page.route("**/*-mesh-*.glb", self.take)

    def take(self, route: Any) -> None:
        if self.is_open:
            route.continue_()
        else:
            self.held.append(route)

    def open(self) -> None:
        self.is_open = True
        for route in self.held:
            route.continue_()


def test_an_object_is_simplified_at_first(
    visit: Callable[..., Any], site: Site, plain: Site
) -> None:
    gate = Gate()
    with visit(site, prepare=gate.prepare) as visitor:
        visitor.until("window.ptm?.walk.begun")
        visitor.page.wait_for_function(f"{COUNTS}.drawn > 0")
        first = visitor.page.evaluate(COUNTS)
        assert len(first["files"]) == 4
        assert first["here"] < 8000
        state = visitor.until("s.pending > 0 || !s.complete")
        assert not state["complete"]
        gate.open()
        visitor.go(0)
        visitor.page.wait_for_function(f"{COUNTS}.here === {COUNTS}.drawn")  # by the next frame
        enough = visitor.page.evaluate(COUNTS)
        assert 80_000 < enough["here"] == enough["drawn"] < 163_880
        shown = visitor.picture().astype(float)
        for eye in NEAR:
            visitor.page.evaluate("(eye) => ptm.goTo({ eye, yaw: 0, pitch: 0 })", eye)
            visitor.complete()
        last = visitor.page.evaluate(COUNTS)
        assert last["here"] == last["drawn"] == 163_880
        visitor.lose_context()
        visitor.restore_context()
        visitor.complete()
        assert visitor.page.evaluate(COUNTS)["drawn"] == 163_880
        assert visitor.messages == []
    with visit(plain) as visitor:
        visitor.until("window.ptm?.walk.begun")
        visitor.go(0)
        assert visitor.page.evaluate(COUNTS) == {"here": 163_880, "drawn": 163_880, "files": []}
        assert np.abs(visitor.picture().astype(float) - shown).mean() < 0.2


def test_the_papers_policy_fetches_objects_as_modelled(
    visit: Callable[..., Any], site: Site
) -> None:
    with visit(site, query="?policy=paper") as visitor:
        visitor.until("window.ptm?.walk.begun")
        assert visitor.state()["policy"] == "paper"
        visitor.page.wait_for_function(f"{COUNTS}.drawn === 163880", timeout=60_000)
        files = visitor.page.evaluate(COUNTS)["files"]
        fetched = {visit.path.rpartition("/")[2] for visit in visitor.visits}
        assert fetched & set(files) == set(files[1::2])


def test_a_finer_mesh_that_is_missing(visit: Callable[..., Any], site: Site) -> None:
    """The coarser one stays, and the page says so."""

    def without(page: Any) -> None:
        page.route("**/*-mesh-*.glb", lambda route: route.fulfill(status=404, body="no"))

    with visit(site, prepare=without) as visitor:
        visitor.until("window.ptm?.walk.begun")
        visitor.until("window.ptm.errors.length > 0")
        assert visitor.page.evaluate("ptm.errors[0].code") == "PTM-V103"
        assert 0 < visitor.page.evaluate(COUNTS)["drawn"] < 8000


def test_a_finest_mesh_that_is_missing(visit: Callable[..., Any], site: Site) -> None:
    """The one before it takes its place, and the view is complete."""
    finest = {row["files"][-1] for row in site.index["meshes"]}

    def without(page: Any) -> None:
        for name in finest:
            page.route(f"**/{name}", lambda route: route.fulfill(status=404, body="no"))

    with visit(site, prepare=without) as visitor:
        visitor.until("window.ptm?.walk.begun")
        for eye in NEAR:
            visitor.page.evaluate("(eye) => ptm.goTo({ eye, yaw: 0, pitch: 0 })", eye)
            visitor.complete()
        assert visitor.page.evaluate("ptm.errors.map(({ code }) => code)") == ["PTM-V103"] * 2
        assert 15_000 < visitor.page.evaluate(COUNTS)["drawn"] < 30_000


def test_the_last_of_two_policies_counts(visit: Callable[..., Any], site: Site) -> None:
    """The first one is still on its way."""
    with visit(site) as visitor:
        visitor.until("window.ptm?.walk.begun")
        visitor.page.evaluate("Promise.all([ptm.setPolicy('paper'), ptm.setPolicy('best')])")
        assert visitor.state()["policy"] == "best"
        visitor.page.evaluate("ptm.setPolicy('paper')")
        assert visitor.state()["policy"] == "paper"
        visitor.page.evaluate("ptm.setPolicy('none')")
        assert visitor.state()["policy"] == "paper"
