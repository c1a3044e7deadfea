"""Lightmaps on the page: pictures as by `ptm render`, requests, damaged files, a lost context."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Visitor, hurried
from numpy.typing import NDArray
from PIL import Image

from ptmtools.arrays import Floats
from ptmtools.cli.main import main
from ptmtools.output.served import read_served
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.site.content import Site, site_of
from ptmtools.site.entry import SiteEntry
from ptmtools.site.pictures import pictures
from tests.site.conftest import PLAIN, Visiting
from tests.systems.apo.statues import write_rooms

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

WIDTH, HEIGHT = 320, 240


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with light, and the same one without; the second statue has no texture."""
    folder = tmp_path_factory.mktemp("light")
    model = write_rooms(folder / "model", 4)
    options = ["--format", "gltf", "--no-fallback", "-j", "1", "--backend", "embree"]
    for name, more in (("lit", ["--light", "bake", "--light-samples", "16"]), ("plain", [])):
        command = ["-q", "build-scene", str(model), "-o", str(folder / name), *options, *more]
        assert main(command) == 0
    return folder


@pytest.fixture(scope="module")
def site(folder: Path) -> Site:
    return site_of(folder / "lit", PLAIN)


def psnr(one: Floats, other: Floats) -> float:
    return float(10 * np.log10(255**2 / max(((one - other) ** 2).mean(), 1e-9)))


def lightmaps(site: Site) -> set[str]:
    return {row["file"] for row in site.index["textures"] if "light" in row}


def test_light_at_vertices_is_baked_light(visit: Visiting, site: Site, folder: Path) -> None:
    """The second statue, plain and with light in its colours, keeps as much of them as plain
    surfaces with a lightmap."""
    served, statue = read_served(folder / "lit"), (slice(80, 160), slice(120, 200))
    angle = float(np.degrees(served.index["viewpoints"][0]["fieldOfView"]))
    eye = (2.7, 0.45, -0.3, 180.0)
    view = ViewOptions(eye=eye, field_of_view=angle, width=WIDTH, height=HEIGHT)
    expected = draw_view(served, view).astype(float)[statue]
    unlit = replace(served, surfaces=replace(served.surfaces, lightmap=None))
    assert expected.mean() > draw_view(unlit, view)[statue].mean() + 5
    query = "#" + ",".join(map(str, eye))
    with visit(site, query=query, width=WIDTH, height=HEIGHT) as visitor:
        visitor.complete()
        assert psnr(visitor.picture().astype(float)[statue], expected) > 34


@pytest.mark.parametrize("viewpoint", [0, 1])
def test_the_page_shows_what_render_draws(
    visit: Visiting, site: Site, folder: Path, viewpoint: int
) -> None:
    served, plain = (read_served(folder / name) for name in ("lit", "plain"))
    view = ViewOptions(viewpoint=viewpoint, width=WIDTH, height=HEIGHT)
    expected, unlit = (draw_view(each, view).astype(float) for each in (served, plain))
    with visit(site, width=WIDTH, height=HEIGHT) as visitor:
        visitor.complete()
        visitor.go(viewpoint)
        visitor.complete()
        shown = visitor.picture().astype(float)
        assert visitor.messages == []
        asked = {v.path.rpartition("/")[2] for v in visitor.visits}
        assert asked & lightmaps(site)
    assert psnr(shown, expected) > 34
    assert psnr(shown, expected) > psnr(shown, unlit) + 8


def test_a_lightmap_is_in_view_with_its_cell(visit: Visiting, site: Site) -> None:
    """With all levels, for all pixels of surfaces that it lights."""
    rows = site.index["textures"]
    with visit(site, width=WIDTH, height=HEIGHT) as visitor:
        visitor.complete()
        cell, wide, present = visitor.page.evaluate(
            "[ptm.walk.cell, ptm.walk.client.catalogue.K, [...ptm.walk.needs.present]]"
        )
    (number,) = (n for n, row in enumerate(rows) if row.get("light") == cell)
    shares = present[number * wide + 1 : number * wide + 1 + len(rows[number]["ends"])]
    assert min(shares) == pytest.approx(max(shares))
    assert 0.3 < shares[0] <= 1


def test_a_lightmap_that_is_damaged_or_missing(visit: Visiting, site: Site) -> None:
    """The walk goes on with the mean light."""
    entries: dict[str, SiteEntry] = dict(site.entries)
    names = sorted(name for name in entries if "light_" in name)
    first = next(name for name in names if name.endswith(".ptm"))
    entries[first] = SiteEntry(first, entries[first].read()[:40], entries[first].media)
    for name in set(names) - {first}:
        del entries[name]
    damaged = Site(entries, site.index)
    with visit(damaged, width=WIDTH, height=HEIGHT, prepare=hurried) as visitor:
        visitor.page.wait_for_function("window.ptm?.errors.length > 0", timeout=90_000)
        visitor.page.wait_for_function("ptm.walk.begun", timeout=90_000)
        images = "ptm.walk.index.textures.flatMap((row, t) => row.light === undefined ? [t] : [])"
        held = f"{images}.some((t) => ptm.walk.memory.held[t] > 3)"
        visitor.page.wait_for_function(held, timeout=90_000)
        maps = images.replace("===", "!==")
        assert visitor.page.evaluate(f"{maps}.map((t) => ptm.walk.memory.held[t])") == [0, 0]


def settled(visitor: Visitor) -> NDArray[np.int64]:
    """The picture once it stays the same: exact levels may come to the screen some frames after
    they are counted as there."""
    visitor.until("s.complete && s.exact")
    picture = visitor.picture().astype(np.int64)
    for _ in range(50):
        visitor.frames(20)
        before, picture = picture, visitor.picture().astype(np.int64)
        if (picture == before).all():
            return picture
    raise AssertionError("the picture does not stay the same")


def test_a_context_that_is_lost(visit: Visiting, site: Site) -> None:
    with visit(site, width=WIDTH, height=HEIGHT) as visitor:
        before = settled(visitor)
        visitor.lose_context()
        visitor.restore_context()
        assert np.abs(settled(visitor) - before).max() <= 1


def test_posters_are_lit(folder: Path) -> None:
    lit, plain = (
        np.asarray(Image.open(io.BytesIO(pictures(read_served(folder / name))[0]))).astype(float)
        for name in ("lit", "plain")
    )
    expected = draw_view(read_served(folder / "lit"), ViewOptions(width=640, height=360))
    assert psnr(lit, expected.astype(float)) > psnr(plain, expected.astype(float)) + 5
