"""Coloured glass: what passes it, and what counts as such."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.building import BuildingBaking, BuildingLight
from ptmtools.light.model import CellSurfaces
from ptmtools.light.occlusion import Occluders, normals, turns
from ptmtools.scene.lights import Lamp, Lights
from ptmtools.scene.model import Material, SourceImage
from tests.light.shapes import quad
from tests.light.test_building import UP, WINDOW, light_at, windowed, with_lamps
from tests.light.test_cells import HEIGHT, SIDE, piece, room, scene_of

#: What passes a red pane of this opacity: all red, of the rest what it leaves open.
OPACITY = 0.6
PASSES = np.array([1, 1 - OPACITY, 1 - OPACITY])


def behind_glass(
    corner: Floats,
    panes: Floats,
    lights: Lights,
    *,
    albedo: float = 0.0,
    both: bool = True,
    opacity: float = OPACITY,
    transmits: float = 0.0,
) -> BuildingLight:
    """The light of a room with red panes."""
    together = np.concatenate([corner, panes])
    glass = np.arange(len(together)) >= len(corner)
    scene = replace(
        scene_of(together),
        materials=(Material("wall"), Material("red", (1, 0, 0), opacity, transparent=True)),
        triangle_material=glass.astype(np.int32),
        two_sided=glass & both,
    )
    colors = np.full((len(together), 3), albedo)
    colors[glass] = 1, 0, 0
    passes = np.array([0, transmits], np.float32)
    more = replace(Lights.none(2), lamps=lights.lamps, transmits=passes)
    shown: CellSurfaces = replace(piece(together), glass=glass)
    return BuildingBaking(scene, [shown], more, colors).light()


def across(x: float) -> Floats:
    """A square before the wall x = SIDE, of 1 m."""
    return quad((x, 1, 2.5), (x, 2, 2.5), (x, 2, 3.5), (x, 1, 3.5))


WEST = np.array([[-1.0, 0.0, 0.0]])


def on_the_wall(building: BuildingLight, y: float, z: float) -> Floats:
    """(3,) the light of lamps on the wall x = SIDE."""
    corner = np.array([[[SIDE, y, z], [SIDE, y, z + 0.01], [SIDE, y + 0.01, z]]])
    look = building.look(corner, np.array([np.sign(normals(corner)[0] @ WEST[0])]), 4096, 0.0)
    return np.asarray(look(np.zeros(1, int), np.array([[SIDE, y, z]]), turns(1))[0], float)


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize(
    ("panes", "power"),
    [
        (across(3.0), 1.0),
        (np.concatenate([across(3.0), across(3.2)]), 2.0),
        (np.concatenate([across(3.0), across(3.02)[:, ::-1]]), 1.0),
        (np.concatenate([across(3.0), across(3.0)[:, ::-1]]), 1.0),
        (np.concatenate([across(x) for x in (3.0, 3.004, 3.2, 3.204)]), 2.0),
    ],
    ids=["a pane", "two panes", "two sides of one", "in one place", "two solids"],
)
def test_a_red_pane_between_a_lamp_and_a_white_wall(
    panes: Floats, both: bool, power: float
) -> None:
    """Whether faces show both of their sides makes no difference."""
    lamp = with_lamps(Lamp("point", (1.0, 1.5, 3.0), intensity=100.0))
    building = behind_glass(room(), panes, lamp, both=both)
    patch, beside = on_the_wall(building, 1.5, 3.0), on_the_wall(building, 1.5, 0.5)
    assert patch / patch[0] == pytest.approx(PASSES**power)
    assert patch[0] == pytest.approx(100 / 5**2 / math.pi, rel=1e-4)
    assert beside[0] > 0
    assert beside == pytest.approx(beside[0])


def test_glass_that_transmits_light_has_all_of_its_colour() -> None:
    """It is drawn with a small opacity; any other of that opacity counts as clear."""
    lamp = with_lamps(Lamp("point", (1.0, 1.5, 3.0), intensity=100.0))
    for transmits, passes in ((0.0, 1.0), (1.0, 0.0)):
        building = behind_glass(room(), across(3.0), lamp, opacity=0.1, transmits=transmits)
        patch = on_the_wall(building, 1.5, 3.0)
        assert patch / patch[0] == pytest.approx([1, passes, passes])


def test_a_red_window_before_the_sky_and_the_sun() -> None:
    left, right, low, high = WINDOW
    pane = quad((left, low, 0), (right, low, 0), (right, high, 0), (left, high, 0))
    ray = np.array([0.0, -1.0, 2.0]) / math.sqrt(5)
    for lamp in (Lamp("point", (90, 90, 90), intensity=1e-6), Lamp("sun", (0, 0, 0), tuple(ray))):
        lights = with_lamps(lamp)
        clear, red = (
            replace(b, field=replace(b.field, radiance=np.zeros_like(b.field.radiance)))
            for b in (behind_glass(windowed(), p, lights) for p in (pane[:0], pane))
        )
        for point in ([3.0, 0.0, 1.5], [3.0, 0.0, 3.5]):
            bare, tinted = (light_at(b, np.array([point])) for b in (clear, red))
            assert bare[0] > 0
            assert tinted == pytest.approx(bare * PASSES, rel=1e-4)


def test_coloured_light_goes_on() -> None:
    """What surfaces behind a pane reflect is red; glass that is nearly clear has no effect."""
    lamp = with_lamps(Lamp("point", (1.0, 1.5, 3.0), intensity=100.0))
    wide = quad((3, 0, 0), (3, HEIGHT, 0), (3, HEIGHT, SIDE), (3, 0, SIDE))
    building = behind_glass(room(), wide, lamp, albedo=0.5)
    floor = light_at(building, np.array([[5.0, 0.0, 3.0]]))
    ceiling = light_at(building, np.array([[5.0, HEIGHT, 3.0]]), -UP)
    for light in (floor, ceiling):
        assert light[1] < 0.5 * light[0]
    assert building.field.around.panes is not None
    assert behind_glass(room(), wide, lamp, opacity=0.1).field.around.panes is None


def test_a_lamp_of_glass_does_not_colour_its_own_light() -> None:
    """Shadow rays end on its faces."""
    random = np.random.default_rng(1)
    point = random.uniform([1, 0.1, 1], [5, 0.2, 5], (200, 3))
    target = np.stack([random.uniform(2.6, 3.4, 200), np.full(200, 2.0), point[:, 2]], axis=1)
    shade = quad((2, 2, -1), (4, 2, -1), (4, 2, 7), (2, 2, 7))
    building = behind_glass(room(), shade, with_lamps())
    around = building.field.around
    assert around.panes is not None
    assert (around.transmittance(point, target) == 1).all()
    assert (around.transmittance(point, target + [0, 0.1, 0])[:, 1] < 1).all()


@pytest.mark.parametrize(("plain", "tinted"), [(True, True), (False, False)])
def test_leaves_are_no_coloured_glass(plain: bool, tinted: bool) -> None:
    """Images with alpha have holes, whose colours count in the mean."""
    scene = scene_of(across(3.0))
    image = SourceImage("leaf.png", "0", lambda: b"", plain=plain)
    leaf = Material("leaf", opacity=0.95, image=0, transparent=True)
    scene = replace(scene, materials=(leaf,), images=(image,))
    around = Occluders.from_scene(scene, np.zeros((2, 3)))
    assert (around.panes is not None) is tinted
