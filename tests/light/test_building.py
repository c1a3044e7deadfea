"""The light of a building: what the model states, what stands in for it, and extremes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.building import BuildingBaking, BuildingLight
from ptmtools.light.cells import CellLight, LightBaking
from ptmtools.light.model import (
    HUE,
    STOPS,
    CellSurfaces,
    coded_light,
    light_codes,
    scale_hue,
)
from ptmtools.light.occlusion import normals, turns
from ptmtools.scene.colors import luminance
from ptmtools.scene.lights import Lamp, Lights
from ptmtools.scene.model import Scene
from tests.light.shapes import quad
from tests.light.test_cells import HEIGHT, OPTIONS, SIDE, at, piece, room, scene_of

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

WINDOW = 2.0, 4.0, 1.0, 2.5  # from, to along x; from, to in height
CENTRE = np.array([[SIDE / 2, 0.0, SIDE / 2]])
UP = np.array([[0.0, 1.0, 0.0]])


def windowed() -> Floats:
    """The room with an opening in the wall z = 0."""
    left, right, low, high = WINDOW
    walls = room()
    plane = np.abs(walls[..., 2]).max(axis=1) == 0
    parts = [(0, left, 0, HEIGHT), (right, SIDE, 0, HEIGHT), (left, right, 0, low)]
    parts.append((left, right, high, HEIGHT))
    front = [quad((a, c, 0), (b, c, 0), (b, d, 0), (a, d, 0)) for a, b, c, d in parts]
    assert plane.sum() == 2
    return np.concatenate([walls[~plane], *front])


def lit(
    corner: Floats, lights: Lights | None = None, albedo: Floats | float = 0.5
) -> BuildingLight:
    grey = np.broadcast_to(np.asarray(albedo, float), (len(corner), 3))
    return BuildingBaking(scene_of(corner), [piece(corner)], lights, grey).light()


def with_lamps(*lamps: Lamp) -> Lights:
    return replace(Lights.none(1), lamps=lamps)


def light_at(building: BuildingLight, point: Floats, normal: Floats = UP) -> Floats:
    """(3,) the light at a point, by many rays."""
    corner = np.array([point[0], point[0] + [0.01, 0, 0], point[0] + [0, 0, -0.01]])[None]
    corner = corner if normal[0, 1] > 0 else corner[:, ::-1]
    look = building.look(corner, np.ones(1), 4096, 0.0)
    assert normals(corner) @ normal[0] == pytest.approx(1)
    return np.asarray(look(np.zeros(1, int), point, turns(1))[0], float)


def test_codes_are_exact_within_half_a_step() -> None:
    light = np.geomspace(2.0**-STOPS, 1.0, 500) * 37
    decoded = coded_light(np.rint(light_codes(light, 37.0)), 37.0)
    assert np.abs(np.log2(decoded / light)).max() <= STOPS / 255 / 2 + 1e-9
    assert light_codes(np.array([0.0, 1e9]), 1.0).tolist() == [0, 255]


def upright(width: float, height: float, far: float) -> float:
    """The part of the sky seen from a level place through an upright rectangle that stands on its
    level, with its lower corner right before it (Howell, B-3)."""
    x, y = far / width, height / width
    reach = math.hypot(x, y)
    return (math.atan(1 / x) - x / reach * math.atan(1 / reach)) / (2 * math.pi)


def test_the_sky_through_a_window_as_its_formula_says() -> None:
    """In a black room, which reflects nothing and whose ceiling is no lamp."""
    left, right, low, high = WINDOW
    building = lit(windowed(), with_lamps(Lamp("point", (90, 90, 90), intensity=1e-6)), 0.0)
    sky = building.field.daylight.sky[1]
    for x, z in ((2.5, 1), (3.5, 2), (2.5, 4)):
        share = sum(upright(w, high, z) - upright(w, low, z) for w in (x - left, right - x))
        actual = light_at(building, np.array([[x, 0.0, z]]))[1] / sky
        assert actual == pytest.approx(share, abs=0.004)


def test_a_closed_room_without_lamps_has_a_ceiling_that_glows() -> None:
    building = lit(room())
    assert building.ceilings
    assert not building.sky
    floor = light_at(building, CENTRE)
    assert floor.min() > 0
    assert floor.max() < 1.5 * floor.min()
    corner = light_at(building, np.array([[0.1, 0.0, 0.1]]))
    assert 0.3 < corner[1] / floor[1] < 0.9


def test_a_room_with_a_window_and_no_lamp_has_both() -> None:
    building = lit(windowed())
    assert building.ceilings
    assert building.sky
    near_it, far_off = (light_at(building, np.array([[3.0, 0, z]]))[1] for z in (1.5, 5.5))
    assert near_it > 1.5 * far_off > 0


def test_lamps_are_all_of_the_light_where_there_are_some() -> None:
    bulb = Lamp("point", (3, 2.5, 3), intensity=100.0)
    building = lit(room(), with_lamps(bulb), 0.0)
    assert not building.ceilings
    assert light_at(building, CENTRE)[1] == pytest.approx(100 / 2.5**2 / math.pi, rel=0.01)


def test_rooms_that_no_lamp_reaches_are_not_black() -> None:
    """Two rooms without a door, one of which has a lamp."""
    both = np.concatenate([room(), room() + [10.0, 0, 0]])
    building = lit(both, with_lamps(Lamp("point", (3, 2.5, 3), intensity=100.0)))
    assert building.ceilings
    lighted, dark = (light_at(building, CENTRE + [x, 0, 0])[1] for x in (0.0, 10.0))
    assert 0.05 < dark / lighted < 1


def test_kinds_of_light_that_are_implausible_together_are_alike() -> None:
    """A sun in lux before the window does not drown a lamp in a unit of its own."""
    sun = Lamp("sun", (0, 0, 0), (0.0, -0.6, 0.8), 1e5)
    bulb = Lamp("point", (3, 2.5, 5), intensity=1e-3)
    alone = lit(windowed(), with_lamps(bulb), 0.0)
    both = lit(windowed(), with_lamps(sun, bulb), 0.0)
    far_off = np.array([[3.0, 0, 5.5]])
    assert alone.lamps.power[0] > 1  # beside the sky
    for building in (alone, both):
        (number,) = np.flatnonzero(building.lamps.groups()[0])
        bulb_alone = replace(building, lamps=building.lamps.only(np.array([number])))
        assert 0.1 < light_at(bulb_alone, far_off)[1] / building.usual < 10
    plausible = lit(windowed(), with_lamps(replace(bulb, intensity=1e3)), 0.0)
    assert plausible.lamps.power.tolist() == [1e3]


def test_a_red_wall_reddens_the_floor_beside_it() -> None:
    albedo = np.full((12, 3), 0.6)
    corner = room()
    red = np.abs(corner[..., 0]).max(axis=1) == 0
    assert red.sum() == 2
    albedo[red] = [0.6, 0.05, 0.05]
    lamp = with_lamps(Lamp("point", (3, 2.5, 3), intensity=100.0))
    beside, away = (
        light_at(lit(corner, lamp, albedo), np.array([[x, 0.0, 3.0]])) for x in (0.2, 5.8)
    )
    assert beside[0] / beside[1] > 1.1 * away[0] / away[1]


def test_a_closed_box_stays_dark() -> None:
    """A chest of 0.5 m in a bright room, of walls of 1 cm, seen from within."""
    inner = 0.08 * room() + [3.0, 0.1, 3.0]
    middle = inner.reshape(-1, 3).mean(axis=0)
    outer = middle + (inner - middle) * 1.04
    both = np.concatenate([room(), inner, outer[:, ::-1]])
    building = lit(both, with_lamps(Lamp("point", (3, 2.5, 3), intensity=100.0)), 0.8)
    inside = light_at(building, np.array([[3.2, 0.101, 3.2]]))
    assert inside.max() < 1e-3 * light_at(building, np.array([[1.0, 0.0, 1.0]])).min()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("candela", [1e-6, 1e9])
def test_extremes_give_numbers(
    scale: float, candela: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ptmtools.light.building.MOST", 4000)
    monkeypatch.setattr("ptmtools.light.cells._LARGEST", 64)
    corner = windowed() * scale
    shown = piece(corner)
    lamp = Lamp("point", (3 * scale, 2.5 * scale, 3 * scale), intensity=candela)
    grey = np.full((len(corner), 3), 0.5)
    building = BuildingBaking(scene_of(corner), [shown], with_lamps(lamp), grey).light()
    # Of the largest, no more texels than of the room.
    options = replace(OPTIONS, light_density=min(1000.0, max(0.1, 4 / scale)), light_samples=8)
    result = LightBaking(options, building, None, grey[:, 0].astype(np.float32)).light(shown)
    assert result.texels is not None
    assert math.isfinite(result.white)
    assert result.white > 0
    assert math.isfinite(result.exposure)
    assert np.isfinite(result.balance).all()
    assert result.texels.max() > 200


@pytest.mark.parametrize("albedo", [0.5, 0.8, 0.9])
def test_all_bounces_count(albedo: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """As many passes as it takes bring hardly more light than the usual number."""
    usual = lit(room(), None, albedo).usual
    monkeypatch.setattr("ptmtools.light.building.PASSES", 80)
    assert usual == pytest.approx(lit(room(), None, albedo).usual, rel=0.02)


@pytest.mark.parametrize("walls", [(0.8, 0.3, 0.3), (0.5, 0.5, 0.5), (0.3, 0.3, 0.8)])
def test_white_is_balanced(walls: tuple[float, float, float]) -> None:
    """Walls of a colour: the exposure takes most of the hue of their light away, and no more."""
    corner = room()
    albedo = np.tile(walls, (len(corner), 1))
    building = lit(corner, None, albedo)
    grey = np.full(len(corner), 0.5, np.float32)
    result = LightBaking(OPTIONS, building, None, grey).light(piece(corner))
    assert result.texels is not None
    light = coded_light(result.texels, result.white).reshape(-1, 3)
    bright = luminance(light)[:, None]
    seen = light * np.minimum(1.0, np.quantile(bright, 0.9) / bright)
    before = np.diff(np.log(seen.mean(axis=0)))
    after = before + np.diff(result.balance)
    np.testing.assert_allclose(after, 0.3 * before, atol=0.03)
    strength = np.abs(before).max()
    assert strength < 0.1 if len(set(walls)) == 1 else strength > 0.3


@pytest.mark.parametrize(("reflectance", "shown"), [(0.1, 0.3), (0.4, 0.3), (0.8, 0.56)])
def test_white_rooms_are_not_grey(reflectance: float, shown: float) -> None:
    """What surfaces show on average: 0.3 as in a photograph, but more in a white room."""
    corner = room()
    building = lit(corner, None, reflectance)
    grey = np.full(len(corner), reflectance, np.float32)
    result = LightBaking(OPTIONS, building, None, grey).light(piece(corner))
    assert result.texels is not None
    light = coded_light(result.texels, result.white).reshape(-1, 3)
    radiance = reflectance * math.exp(result.exposure) * luminance(light)
    assert np.exp(np.log(radiance).mean()) == pytest.approx(shown, rel=0.15)
    assert np.quantile(radiance, 0.9) < 0.7


def beside_a_spot(albedo: float, fill: float = 1e-9, usual: float | None = None) -> CellLight:
    """A dark room with a bright spot on a wall, and a lamp of ``fill`` candela for the rest, of a
    building with this usual light."""
    corner, cone = room(), (math.cos(0.3), math.cos(0.32))
    lamp = Lamp("spot", (3, 1.5, 3), (1, 0, 0), intensity=9, cone=cone, color=(1, 1, 0.6))
    rest = Lamp("point", (3, 1.5, 3), intensity=fill)
    building = lit(corner, with_lamps(lamp, rest), albedo)
    if usual is not None:
        building = replace(building, usual=usual)
    grey = np.full(len(corner), albedo, np.float32)
    return LightBaking(OPTIONS, building, None, grey).light(piece(corner))


#: The light in the middle of the spot, but for what surfaces reflect.
SPOT = 9 / 3**2 / math.pi


def test_glare_leaves_the_room_its_codes() -> None:
    """Images have three times the hue of codes, which would be cut off in the dark room."""
    result, albedo = beside_a_spot(0.15), 0.15
    assert result.texels is not None
    light = math.exp(result.exposure) * coded_light(result.texels, result.white)
    shown = albedo * light.max(axis=2) < 1
    assert 0.9 < shown.mean() < 0.995
    assert np.quantile(scale_hue(result.texels[shown], HUE), 0.01) > 0
    # Its spot still shows as white.
    assert albedo * light.max() > 5


@pytest.mark.parametrize(
    ("albedo", "fill", "usual"),
    [(0.0, 1e-9, None), (0.05, 0.5, None), (0.15, 1e-9, SPOT)],
    ids=["black", "dark", "in a brighter building"],
)
def test_what_shows_is_no_glare(albedo: float, fill: float, usual: float | None) -> None:
    """The stage of a black theatre, and a sunny spot in a dim cell, whose exposure has a limit."""
    result = beside_a_spot(albedo, fill, usual)
    assert result.texels is not None
    assert coded_light(result.texels, result.white).max() > 0.9 * SPOT


def test_a_pane_is_no_surface_of_the_light() -> None:
    corner = room()
    glass: CellSurfaces = replace(piece(corner), glass=np.ones(len(corner), np.bool_))
    scene: Scene = scene_of(corner)
    building = BuildingBaking(scene, [glass], None, np.full((12, 3), 0.5)).light()
    result = LightBaking(OPTIONS, building, None, np.full(12, 0.5, np.float32)).light(glass)
    assert not result.lit.any()
    assert (result.exposure, result.area) == (0, 0)
    assert not result.balance.any()


def test_a_texel_beside_a_thin_wall_has_no_light_of_the_other_side() -> None:
    """A wall of 5 cm between a bright room and a dark one without a ceiling to glow."""
    wall = np.concatenate([room(), (room() + [SIDE + 0.05, 0, 0])])
    lamp = with_lamps(Lamp("point", (3, 2.5, 3), intensity=100.0))
    building = lit(wall, lamp, 0.8)
    shown = replace(piece(room() + [SIDE + 0.05, 0, 0]), face=np.arange(12, 24))
    radiance = building.field.radiance.copy()
    radiance[building.field.patches.faces()[0] >= 12] = 0
    assert radiance.any()
    dark = replace(building, field=replace(building.field, radiance=radiance))
    result = LightBaking(OPTIONS, dark, None, np.full(24, 0.8, np.float32)).light(shown)
    assert at(result, 0, (0.5, 0.0, 0.5)) == pytest.approx(0, abs=2e-3 * building.usual)
