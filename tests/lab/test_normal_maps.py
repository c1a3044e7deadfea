"""Normal maps of materials in pictures: the light on a tilted face, against the formula."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.link import Conditions
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.served import Served, read_served
from ptmtools.output.surfaces import bumps_of
from ptmtools.pipeline.build import build_scene
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.rendering.light import AMBIENT, LAMP, with_lamp
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.walk import read_walk
from ptmtools_lab.catalogue import NORMALS
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.simulation import simulate
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import World, prepare, relief_of
from tests.scene.bumpy import write_bumpy
from tests.systems.apo.statues import write_rooms

#: In the first room; looks at its north wall, of which x is to the right.
EYE, WALL = (-2.1, 1.5, 0.8), (-2.1, 1.5, -2.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database, and a walk through it."""
    folder = tmp_path_factory.mktemp("bumpy")
    model = write_bumpy(folder / "model", {"room_a": "norm waves.png"})
    options = AchOptions(samples=4, backend="embree"), LightOptions(light_samples=4)
    build_scene(model, folder / "db", *options, workers=1)
    walk = ["path", str(folder / "db"), "-o", str(folder / "walk.json"), "--duration", "10"]
    assert main(["-q", *walk]) == 0
    return folder


@pytest.fixture(scope="module")
def served(folder: Path) -> Served:
    return read_served(folder / "db")


@pytest.fixture(scope="module")
def world(folder: Path, served: Served) -> World:
    return prepare(served, read_walk(folder / "walk.json"), rate=4)


def picture(served: Served, *, lit: bool = False) -> np.ndarray:
    view = ViewOptions(eye=EYE, look=WALL, width=200, height=150, lit=lit)
    return draw_view(served, view).astype(np.float64)


def test_surfaces_that_blend_show_none(folder: Path) -> None:
    """As on the page; those with a cutoff show theirs."""
    files = sorted(folder.glob("db/www/gltf/*.glb"))
    shapes = [p for file in files for p in read_glb(file.read_bytes()).primitives]
    shape = next(p for p in shapes if p.normal is not None)
    for blends, cutoff in ((False, None), (True, 0.5), (True, None)):
        material = replace(shape.material, blends=blends, cutoff=cutoff)
        bumps = bumps_of([replace(shape, material=material)], [len(shape.triangle)])
        assert (bumps is None) == (blends and cutoff is None)


def plain(served: Served) -> Served:
    return replace(served, surfaces=replace(served.surfaces, bumps=None))


def light(normal: tuple[float, float, float]) -> float:
    unit = np.array(normal) / np.linalg.norm(normal)
    return float(AMBIENT + (1 - AMBIENT) * ((1 + unit @ LAMP) / 2) ** 2)


@pytest.mark.parametrize(
    ("texel", "world"),
    [
        ((127.5, 127.5, 255), (0, 0, 1)),
        ((202.5, 127.5, 202.5), (1, 0, 1)),
        ((52.5, 127.5, 202.5), (-1, 0, 1)),
        ((127.5, 202.5, 202.5), (0, 1, 1)),
        ((127.5, 52.5, 202.5), (0, -1, 1)),
    ],
    ids=["level", "right", "left", "up", "down"],
)
def test_the_light_on_a_wall(
    served: Served,
    monkeypatch: pytest.MonkeyPatch,
    texel: tuple[float, ...],
    world: tuple[float, float, float],
) -> None:
    """The wall looks to z; x of its map is to the right and y up."""
    import ptmtools.rendering.normal_maps as drawing

    def sampled(sight, *_):  # type: ignore[no-untyped-def]
        return np.tile(np.array(texel, np.float64), (len(sight.ray), 1))

    before = picture(plain(served))[60:90, 80:120]
    monkeypatch.setattr(drawing, "_sample_maps", sampled)
    after = picture(served)[60:90, 80:120]
    expected = np.minimum(before * light(world) / light((0, 0, 1)), 255)
    assert np.abs(after - expected).max() <= 1.5


def test_a_scale_of_nothing_is_level(served: Served) -> None:
    bumps = served.surfaces.bumps
    assert bumps
    level = replace(served.surfaces, bumps=replace(bumps, scale=0 * bumps.scale))
    assert np.array_equal(picture(replace(served, surfaces=level)), picture(plain(served)))
    assert np.abs(picture(served) - picture(plain(served))).max() > 20


def test_lit_pictures_show_them_too(served: Served) -> None:
    difference = picture(served, lit=True) - picture(plain(served), lit=True)
    assert np.abs(difference).max() > 20


def number(served: Served) -> int:
    """Of the map in the hints."""
    (result,) = [n for n, row in enumerate(served.index["textures"]) if row.get("normals")]
    return result


def test_their_worth_is_a_part(world: World) -> None:
    stock, own = world.catalogue, number(world.served)
    assert np.array_equal(stock.gains[own], NORMALS * stock.differences[own])
    other = stock.gains[: stock.texture_count] / np.maximum(stock.differences, 1e-9)
    assert set(np.unique(other[np.arange(stock.texture_count) != own])) == {0, 1}


def test_clients_fetch_them_after_the_textures(world: World) -> None:
    """None of the map before a level of each texture on the screen; all of it in the end."""
    own = number(world.served)
    run = simulate(world, POLICIES["best"], Conditions(1e6), world.catalogue.whole)
    assert run.column[-1][own] == world.catalogue.levels[own]
    begins = np.argmax(run.column > 0, axis=0)
    assert begins[own] >= begins[world.views.texture[world.views.rows(0)].max()]
    records = world.served.records
    assert not any(own in used for record in records for used in record["textures"])


def test_pictures_of_a_walk_show_them(world: World) -> None:
    """With the levels that a client has."""
    renderer = FrameRenderer(world, 90)
    sight = renderer.look(np.array(EYE), np.array([0.0, 0.0, -1.0]))
    full = renderer.full(sight)
    loaded = np.ones(world.catalogue.cell_count, np.bool_)
    column = world.catalogue.levels.copy()
    assert np.abs(renderer.colors(sight, loaded, column) - full).max() < 1e-9
    column[number(world.served)] = 0
    without = FrameRenderer(replace(world, served=plain(world.served)), 90).full(sight)
    assert np.abs(renderer.colors(sight, loaded, column) - without).max() < 1e-9
    assert np.abs(full - without).max() > 20


def test_lit_walks_show_the_maps_of_objects(tmp_path: Path) -> None:
    model, db = write_rooms(tmp_path / "model", 4), tmp_path / "db"
    options = ["--samples", "4", "--light-samples", "4", "-j", "1"]
    options += ["--apo", "statue*", "--apo-faces", "500"]
    options += ["--apo-error", "0.1", "--relief", "normal-map"]
    assert main(["-q", "build-scene", str(model), "-o", str(db), *options]) == 0
    walk = ["path", str(db), "-o", str(tmp_path / "walk.json"), "--duration", "2"]
    assert main(["-q", *walk]) == 0
    served = with_lamp(read_served(db))
    relief = relief_of(served, read_pyramids(served))
    world = prepare(
        served, read_walk(tmp_path / "walk.json"), rate=1, drawing=Drawing(relief=relief)
    )
    flat = replace(served, surfaces=replace(served.surfaces, relief=None))
    renderer, other = FrameRenderer(world, 90), FrameRenderer(replace(world, served=flat), 90)
    sight = renderer.look(np.array((-2.8, 0.6, 0.5)), np.array([0.0, 0.0, -1.0]))
    difference = np.abs(renderer.full(sight) - other.full(sight)).max(axis=2)
    assert (difference > 5).mean() > 0.1
