"""Light on the page: pixels by the formula and as by `ptm render`, exposure, requests, hostile and
damaged files, a lost context."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Visitor, hurried, new_page, visiting_in
from engines import PACKAGES, Engine, visiting_by
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
from tests.site.mirrors import mirror_site, mirrors_of
from tests.site.strips import EXPOSURE, EYES, lit_site, view_of
from tests.systems.apo.statues import write_rooms

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

WIDTH, HEIGHT = 320, 240


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with light at half of its exposure, and the same one without light; the second
    statue has no texture."""
    folder = tmp_path_factory.mktemp("light")
    model = write_rooms(folder / "model", 4)
    options = ["--format", "gltf", "--no-fallback", "-j", "1", "--backend", "embree"]
    for name, more in (("lit", ["--light", "bake", "--light-samples", "16"]), ("plain", [])):
        command = ["-q", "build-scene", str(model), "-o", str(folder / name), *options, *more]
        assert main(command) == 0
    hints = folder / "lit/www/hints.json"
    index = json.loads(hints.read_text())
    for cell in index["cells"]:
        cell["exposure"] = [0.5, 0.5, 0.5]
    hints.write_text(json.dumps(index))
    return folder


@pytest.fixture(scope="module")
def site(folder: Path) -> Site:
    return site_of(folder / "lit", PLAIN)


@pytest.fixture(scope="module")
def plain(folder: Path) -> Site:
    return site_of(folder / "plain", PLAIN)


def psnr(one: Floats, other: Floats) -> float:
    return float(10 * np.log10(255**2 / max(((one - other) ** 2).mean(), 1e-9)))


def lightmaps(site: Site) -> set[str]:
    """Their images."""
    rows = (row for row in site.index["textures"] if "light" in row)
    return {preview["file"] for row in rows for preview in row["previews"]}


def test_light_at_vertices_is_baked_light(visit: Visiting, site: Site, folder: Path) -> None:
    """Of the second statue, which is plain and has light in its colours."""
    served, statue = read_served(folder / "lit"), (slice(80, 160), slice(120, 200))
    angle = float(np.degrees(served.index["viewpoints"][0]["fieldOfView"]))
    eye = (2.7, 0.45, -0.3, 180.0)
    view = ViewOptions(eye=eye, field_of_view=angle, width=WIDTH, height=HEIGHT)
    expected = draw_view(served, view).astype(float)[statue]
    unlit = draw_view(read_served(folder / "plain"), view).astype(float)[statue]
    query = "#" + ",".join(map(str, eye))
    with visit(site, query=query, width=WIDTH, height=HEIGHT) as visitor:
        visitor.complete()
        shown = visitor.picture().astype(float)[statue]
    assert psnr(shown, expected) > max(34, psnr(shown, unlit) + 8)


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
    assert psnr(shown, expected) > max(34, psnr(shown, unlit) + 8)


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


def stand(visitor: Visitor, eye: Sequence[float]) -> None:
    """Places the eye, which nothing moves then."""
    visitor.until("s.pose")
    place = "(eye) => { ptm.walker.step = () => {}; ptm.goTo({ eye, yaw: 0, pitch: 0 }) }"
    visitor.page.evaluate(place, list(eye))


def check_strips(visitor: Visitor, site: Site, tone: str, size: tuple[int, int]) -> None:
    """From a cell with little exposure, and from one with much."""
    angle = site.index["viewpoints"][0]["fieldOfView"]
    for eye, exposure in zip(EYES, EXPOSURE, strict=True):
        stand(visitor, eye)
        visitor.complete()
        exposed = [1, 1, 1] if tone == "plain" else exposure
        expected, parts = view_of(eye, angle, size, exposed, tone)
        apart = np.abs(visitor.picture() - expected).max(axis=2)
        assert [name for name, part in parts.items() if apart[part].max() > 3] == []
    assert visitor.messages == []


@pytest.mark.parametrize("tone", ["neutral", "agx", "plain"])
def test_each_pixel_follows_the_formula(visit: Visiting, plain: Site, tone: str) -> None:
    """Of a lightmap, of light at vertices, of an unlit surface, under a normal map, and around."""
    site = lit_site(plain, lambda index: index["light"].update(tone=tone))
    with visit(site, width=WIDTH, height=HEIGHT) as visitor:
        check_strips(visitor, site, tone, (WIDTH, HEIGHT))


def unlike_mirrors(
    visitor: Visitor, site: Site, size: tuple[int, int], arrives: bool = True
) -> dict[str, float]:
    """From the first cell, how far parts are off that are: polished and bent metal, a floor, and
    glass before a bright and a dark surface."""
    angle = site.index["viewpoints"][0]["fieldOfView"]
    expected, parts = mirrors_of(angle, EYES[0], size, arrives)
    apart = np.abs(visitor.picture() - expected).max(axis=2)
    errors = {name: float(apart[part].max()) for name, part in parts.items()}
    return {name: error for name, error in errors.items() if error > 3}


@pytest.mark.parametrize("name", PACKAGES)
def test_other_engines_draw_the_same(
    engines: Callable[[str], Engine], plain: Site, name: str
) -> None:
    size = 512, 384
    for site in (lit_site(plain), mirror_site(plain)):
        with visiting_by(engines(name), site.entries, width=size[0], height=size[1]) as visitor:
            if "probe" in site.index["textures"][-2]:
                stand(visitor, EYES[0])
                visitor.complete()
                assert unlike_mirrors(visitor, site, size) == {}
            else:
                check_strips(visitor, site, "neutral", size)


#: Shrinks a texture by a level.
SHRINK = """
(t) => {
  ptm.freeze(true);
  const { memory } = ptm.walk, want = memory.held.map((held, k) => held - (k === t));
  memory.settle(want, new Float64Array(want.length), memory.loss.slice());
}
"""


def test_reflections_follow_the_formula(visit: Visiting, plain: Site) -> None:
    """Without the finest level of the probe, coarser ones mix its parts: its mean counts."""
    site, size = mirror_site(plain), (WIDTH, HEIGHT)
    probe = len(site.index["textures"]) - 2
    with visit(site, width=WIDTH, height=HEIGHT) as visitor:
        stand(visitor, EYES[0])
        levels = visitor.complete()["held"][probe]
        assert unlike_mirrors(visitor, site, size) == {}
        visitor.page.evaluate(SHRINK, probe)
        visitor.until(f"s.held[{probe}] === {levels - 1}")
        visitor.frames(20)
        assert unlike_mirrors(visitor, site, size, arrives=False) == {}
        assert visitor.messages == []


def test_without_a_probe(visit: Visiting, plain: Site) -> None:
    """All directions show its mean."""
    site = mirror_site(plain)
    entries = {name: e for name, e in site.entries.items() if name != "data/probe.ptm"}
    with visit(Site(entries, site.index), width=WIDTH, height=HEIGHT) as visitor:
        stand(visitor, EYES[0])
        visitor.page.wait_for_function("ptm.errors.length > 0", timeout=90_000)
        visitor.complete()
        assert unlike_mirrors(visitor, site, (WIDTH, HEIGHT), arrives=False) == {}


def test_low_quality_reflects_nothing(visit: Visiting, plain: Site) -> None:
    """And needs no probe: surfaces are as if no material had one."""
    site, bare = mirror_site(plain), mirror_site(plain, probe=False)
    _, parts = mirrors_of(site.index["viewpoints"][0]["fieldOfView"], EYES[0], (WIDTH, HEIGHT))
    pictures = []
    for each, query in ((site, "?quality=low"), (bare, "")):
        with visit(each, query=query, width=WIDTH, height=HEIGHT) as visitor:
            stand(visitor, EYES[0])
            picture = settled(visitor)
            pictures.append({name: picture[part] for name, part in parts.items()})
            files = {v.path.rpartition("/")[2] for v in visitor.visits}
            assert "even.ptm" in files
            assert "probe.ptm" not in files
    low, matt = pictures
    assert all((low[name] == matt[name]).all() for name in parts)
    assert low["metal"].std(axis=0).max() < 2


#: A graphics card, or none, as a browser says it; and the numbers of texels that textures average.
CARD = """
card => {
  const { getContext } = HTMLCanvasElement.prototype;
  const { texParameterf } = WebGL2RenderingContext.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    if (!options?.failIfMajorPerformanceCaveat) return getContext.call(this, kind, options);
    return card ? getContext.call(this, kind, { antialias: true }) : null;
  };
  const { getParameter } = WebGL2RenderingContext.prototype, { RENDERER } = WebGL2RenderingContext;
  WebGL2RenderingContext.prototype.getParameter = function (name) {
    return card && [RENDERER, 0x9246].includes(name) ? "A Card" : getParameter.call(this, name);
  };
  globalThis.slants = [];
  WebGL2RenderingContext.prototype.texParameterf = function (target, name, value) {
    if (name === 0x84fe) globalThis.slants.push(value);
    texParameterf.call(this, target, name, value);
  };
}
"""


@pytest.mark.parametrize(
    ("card", "query", "slants"),
    [("true", "", {4}), ("false", "", set()), ("true", "?quality=low", set())],
)
def test_graphics_cards_filter_along_the_line_of_sight(
    visit: Visiting, plain: Site, card: str, query: str, slants: set[int]
) -> None:
    def prepare(page: Any) -> None:
        page.add_init_script(f"({CARD.strip()})({card})")

    with visit(plain, query=query, prepare=prepare, width=64, height=48) as visitor:
        visitor.complete()
        assert set(visitor.page.evaluate("slants")) == slants


#: Exposures of a walk through the door, at these cells, places along x and times, s.
EXPOSURES = """
([fades, steps]) => {
  const { picture, picture: { renderer: { light } }, client, index } = ptm.walk;
  return steps.map(([cell, x, now]) => {
    light.adapt({ cell, client, index, memory: { fades }, picture }, [x, 1.5, 0], now);
    return light.exposure;
  });
}
"""


def test_exposure_eases(visit: Visiting, plain: Site) -> None:
    """Within a second; at once after a jump, or if nothing shall move; outside of all cells it
    stays."""
    less, more = EXPOSURE
    steps = [(1, 3.0, 0.5), (0, 0.0, 1.0), (1, 0.2, 1.1), (1, 0.3, 1.3), (1, 0.4, 2.2)]
    steps += [(-1, 0.5, 3.0), (0, -2.0, 3.1)]
    with visit(lit_site(plain), width=64, height=48) as visitor:
        visitor.complete()
        eased, sudden = (visitor.page.evaluate(EXPOSURES, [f, steps]) for f in (True, False))
    assert sudden == [more, less, more, more, more, more, less]
    for channel in zip(less, *eased[2:4], more, strict=True):
        assert (np.diff(channel) > 0).all()
    assert eased[:2] + eased[4:] == sudden[:2] + sudden[4:]


def change(**light: Any) -> Callable[[dict[str, Any]], None]:
    """Other members of the light of an index."""
    return lambda index: index["light"].update(light)


HOSTILE: dict[str, tuple[Callable[[dict[str, Any]], None], dict[str, Any]]] = {
    "a light that brightens by codes": (change(stops=-1), {}),
    "a range that is no number": (change(stops="many"), {}),
    "an infinite sky": (change(sky=[0, 1e999, 0]), {}),
    "a sky that is no colour": (change(sky=3), {}),
    "a dark cell": (lambda index: index["cells"][1].update(exposure=[1, 1, -1]), {}),
    "a negative white": (change(), {"white": -1}),
    "a lightmap without a white": (change(), {"white": None}),
}
#: Codes of the message and of errors of a walk.
CODES = """
[document.querySelector("#error-code").textContent,
  ...(window.ptm?.errors ?? []).map(({ code }) => code)].filter(Boolean)
"""


@pytest.fixture(scope="module")
def hasty(chromium: Any) -> Iterator[Any]:
    page = new_page(chromium, 160, 120, hurried)
    yield page
    page.context.close()


@pytest.mark.parametrize("fault", HOSTILE)
def test_hostile_light(hasty: Any, plain: Site, fault: str) -> None:
    with visiting_in(hasty, lit_site(plain, *HOSTILE[fault]).entries) as visitor:
        visitor.until(f"({CODES.strip()}).length > 0")
        assert set(visitor.page.evaluate(CODES)) == {"PTM-V105"}


def test_without_its_script(visit: Visiting, plain: Site) -> None:
    """The walk goes on, unlit."""
    entries = lit_site(plain).entries
    entries = {name: e for name, e in entries.items() if not name.endswith("/light.js")}
    with visit(Site(entries, {}), width=160, height=120) as visitor:
        visitor.page.wait_for_selector("#notices p")
        stand(visitor, EYES[0])
        visitor.complete()
        assert visitor.picture().std() > 5
