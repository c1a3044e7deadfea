"""Normal maps of materials on the page: as in the pictures of `ptm render`, after the textures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.output.served import Served, read_served
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.rays import RayCamera
from ptmtools.site.content import Site, site_of
from ptmtools_lab.tables import look
from tests.scene.bumpy import write_bumpy
from tests.site.conftest import PLAIN, Visiting

WIDTH, HEIGHT = 320, 240
QUICK = ["--samples", "4", "--format", "gltf", "-j", "1", "--backend", "embree"]
#: Eyes in the first room, with yaw in degrees: at a wall and the ceiling, and at the floor.
EYES = {"wall": ((-2.1, 2.2, 0.9), 20.0), "floor": ((-3.2, 0.5, 1.3), -45.0)}
HELD = "window.ptm.walk.picture.renderer.statues?.levels ?? []"


@pytest.fixture(scope="module", params=["unlit", "lit"])
def database(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two rooms with normal maps on walls, floor and ceiling; the last has no texture."""
    folder = tmp_path_factory.mktemp("bumpy")
    options = list(QUICK)
    if request.param == "lit":
        pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")
        options += ["--light", "bake", "--light-density", "4", "--light-samples", "8"]
    model = write_bumpy(folder / "model")
    assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), *options]) == 0
    return folder / "db"


@pytest.fixture(scope="module")
def site(database: Path) -> Site:
    return site_of(database, PLAIN)


def address(name: str) -> str:
    eye, yaw = EYES[name]
    return "#" + ",".join(f"{x:.4f}" for x in (*eye, yaw))


def expected(served: Served, name: str) -> np.ndarray:
    eye, yaw = EYES[name]
    angle = float(np.degrees(served.index["viewpoints"][0]["fieldOfView"]))
    options = ViewOptions(eye=(*eye, yaw), field_of_view=angle, width=WIDTH, height=HEIGHT)
    return draw_view(served, options).astype(float)


def inside(picture: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Without the outermost percent: edges, which the page smooths."""
    error = ((picture - other) ** 2).mean(axis=2)
    return error[error <= np.quantile(error, 0.99)]


@pytest.mark.parametrize("name", EYES)
def test_they_are_drawn_as_by_render(
    visit: Visiting, site: Site, database: Path, name: str
) -> None:
    served = read_served(database)
    with visit(site, query=address(name), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        assert visitor.page.evaluate(HELD)[0] > 3
        picture = visitor.picture().astype(float)
        assert visitor.messages == []
    assert 10 * np.log10(255**2 / inside(picture, expected(served, name)).mean()) >= 40


def test_they_come_after_the_first_picture(visit: Visiting, site: Site) -> None:
    numbers = [n for n, row in enumerate(site.index["textures"]) if row.get("normals")]
    assert len(numbers) == 2
    files = {site.index["textures"][n]["file"].rpartition("/")[2] for n in numbers}
    files |= {
        preview["file"].rpartition("/")[2]
        for n in numbers
        for preview in site.index["textures"][n].get("previews", ())
    }
    shown = next(
        row["file"].rpartition("/")[2]
        for row in site.index["textures"]
        if row["file"].startswith("room_a")
    )
    with visit(site, query=address("wall"), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        paths = [v.path.rpartition("/")[2] for v in visitor.visits]
        own = [at for at, path in enumerate(paths) if path in files]
        assert own
        assert min(own) > paths.index(shown)


def test_the_simulator_wants_the_same_levels(visit: Visiting, site: Site, database: Path) -> None:
    """Of a map beside the textures of walls and floor, as much as its own pixels want."""
    served = read_served(database)
    name, K = "floor", "window.ptm.walk.client.catalogue.K"
    number = next(
        n for n, row in enumerate(served.index["textures"]) if row["file"] == "textures/waves.ptm"
    )
    row = f"[...window.ptm.walk.needs.present].slice({number} * {K}, {number + 1} * {K})"
    with visit(site, query=address(name), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        actual = np.array(visitor.page.evaluate(row))[1:]
    eye, yaw = EYES[name]
    angle = served.index["viewpoints"][0]["fieldOfView"]
    camera = RayCamera(WIDTH, HEIGHT, angle, WIDTH / HEIGHT, HEIGHT)
    turn = np.radians(yaw)
    direction = np.array([[-np.sin(turn), 0.0, -np.cos(turn)]])
    pyramids = read_pyramids(served)
    views = look(served.surfaces, pyramids, camera, np.array([eye]), direction)[0]
    expected = views.sight[views.texture == number].sum(axis=0)
    count = min(len(actual), len(expected))
    assert expected[0] > 0.3
    assert actual[:count] == pytest.approx(expected[:count], abs=0.05)
