"""Objects with normal maps in the rooms of a walk."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.served import read_served
from ptmtools.rendering.drawing import ViewOptions, draw_view, eye_of
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.site.content import Site, site_of
from ptmtools.site.entry import SiteEntry
from tests.site.conftest import PLAIN, Visiting
from tests.systems.apo.statues import write_rooms

WIDTH, HEIGHT = 320, 240
LEVELS = "window.ptm.walk.picture.renderer.statues?.levels ?? []"
#: An eye in front of each statue, and its yaw in degrees.
EYES = {0: ((-2.8, 0.6, 0.5), 0.0), 1: ((2.7, 0.45, -0.3), 180.0)}


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two rooms with a statue each, of which the second has no texture."""
    folder = tmp_path_factory.mktemp("statues")
    model = write_rooms(folder / "model", 5)
    options = ["--apo", "statue*", "--apo-faces", "500", "--apo-error", "0.01"]
    options += ["--relief", "normal-map", "--format", "gltf", "-j", "1", "--backend", "embree"]
    options += ["--light", "none"]
    assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), *options]) == 0
    return folder / "db"


@pytest.fixture(scope="module")
def site(database: Path) -> Site:
    return site_of(database, PLAIN)


def address(statue: int) -> str:
    eye, yaw = EYES[statue]
    return "#" + ",".join(f"{x:.4f}" for x in (*eye, yaw))


@pytest.mark.parametrize("statue", EYES)
def test_they_are_drawn_as_by_render(
    visit: Visiting, site: Site, database: Path, statue: int
) -> None:
    served = read_served(database)
    eye, yaw = EYES[statue]
    angle = float(np.degrees(served.index["viewpoints"][0]["fieldOfView"]))
    options = ViewOptions(
        eye=(*eye, yaw), field_of_view=angle, width=WIDTH, height=HEIGHT, lit=True
    )
    expected = draw_view(served, options)
    view = eye_of(served, options)
    camera = RayCamera(WIDTH, HEIGHT, view.field_of_view, WIDTH / HEIGHT, HEIGHT)
    sight = Caster(served.surfaces).look(camera, view.position, view.direction)
    relief = served.surfaces.relief
    assert relief is not None
    number = next(
        n
        for n, row in enumerate(served.index["textures"])
        if row.get("relief") == f"statue_0{statue + 1}"
    )
    shown = np.where(sight.triangle < 0, -1, relief.number[sight.triangle])
    mask = inside = (shown == number).reshape(HEIGHT, WIDTH)
    for dy in range(-3, 4):
        for dx in range(-3, 4):
            inside = inside & np.roll(mask, (dy, dx), (0, 1))
    assert inside.sum() > 0.1 * mask.size
    with visit(site, query=address(statue), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        assert visitor.page.evaluate(LEVELS)[statue] >= 6
        picture = visitor.picture()
        assert visitor.messages == []
    error = ((picture[inside].astype(float) - expected[inside]) ** 2).mean()
    assert 10 * np.log10(255**2 / error) >= 38


#: How many levels of the first normal map the view wants.
WANTED = """(() => {
  const { client: { catalogue: { K } }, needs: { present } } = window.ptm.walk;
  const first = window.ptm.index.textures.findIndex((row) => row.relief === "statue_01");
  return [...present.slice(first * K, (first + 1) * K)].filter((share) => share > 0).length;
})()"""


def test_the_screen_decides_how_many_levels_are_wanted(visit: Visiting, site: Site) -> None:
    with visit(site, query=address(0), width=20, height=15) as visitor:
        visitor.until("s.complete")
        few = visitor.page.evaluate(WANTED)
        assert few >= 4
        visitor.page.set_viewport_size({"width": 1280, "height": 960})
        visitor.until(f"{WANTED} > {few}")
        visitor.until("s.complete")


def test_a_context_that_is_lost(visit: Visiting, site: Site) -> None:
    statue = slice(80, 160), slice(120, 200)
    with visit(site, query=address(1), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        before = visitor.picture()[statue]
        assert np.ptp(before) > 10  # lit
        visitor.lose_context()
        visitor.restore_context()
        visitor.until(f"({LEVELS})[1] > 0 && s.complete")
        after = visitor.picture()[statue]
        assert np.abs(after.astype(int) - before).max() <= 2


@pytest.mark.parametrize("number", [0, 99])
def test_an_object_with_another_texture_for_a_normal_map(
    visit: Visiting, site: Site, number: int
) -> None:
    """0 is the texture of the floor, 99 does not exist."""
    entries: dict[str, SiteEntry] = dict(site.entries)
    for name, entry in site.entries.items():
        if not name.endswith(".glb"):
            continue
        document, binary = unpack(entry.read())
        for material in document["materials"]:
            if "normal" in material.get("extras", {}):
                material["extras"]["normal"] = number
        entries[name] = SiteEntry(name, pack(document, binary), entry.media)
    changed = Site(entries, site.index)
    with visit(changed, query=address(0), width=WIDTH, height=HEIGHT) as visitor:
        visitor.page.wait_for_function("window.ptm?.errors.length > 0", timeout=90_000)
        visitor.until("s.complete")
        assert visitor.page.evaluate("window.ptm.errors[0].code") == "PTM-V105"
        assert not visitor.page.is_visible("#error")


def test_a_normal_map_that_is_missing(visit: Visiting, site: Site) -> None:
    row = next(row for row in site.index["textures"] if row.get("relief") == "statue_01")
    gone = {row["file"], *(preview["file"] for preview in row.get("previews", ()))}
    entries = {n: e for n, e in site.entries.items() if n.rpartition("/")[2] not in gone}
    assert len(entries) == len(site.entries) - len(gone)
    with visit(Site(entries, site.index), query=address(0)) as visitor:
        visitor.page.wait_for_function("window.ptm?.errors.length > 0", timeout=90_000)
        assert visitor.page.evaluate("window.ptm.errors[0].code") == "PTM-V103"
        visitor.until("s.complete")
        assert not visitor.page.is_visible("#error")
        assert visitor.page.evaluate(LEVELS)[0] == 0


def test_other_sites_do_not_load_the_script(visit: Visiting, site: Site, museum: Site) -> None:
    def loads(of: Site) -> bool:
        with visit(of, width=64, height=48) as visitor:
            visitor.until("s.complete")
            return any(v.path.endswith("reliefs.js") for v in visitor.visits)

    assert loads(site)
    assert not loads(museum)
