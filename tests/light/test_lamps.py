"""Lamps and the sky against what is known of them: formulas, and rays without Embree."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.cells import ABOVE, WHITE, CellLight, LightBaking, encode, expose
from ptmtools.light.lamps import (
    _BOTH,
    _MOST,
    _PATCH_KIND,
    _POINT,
    _SPOT,
    _SUN,
    Lamps,
    _merge,
    direct_light,
    lamp_luminance,
    lamps_near,
    lamps_of,
    measure_lamps,
)
from ptmtools.light.looks import RayLight
from ptmtools.light.mixing import LightMix, light_mix
from ptmtools.light.occlusion import light_and_sky, points_on, turns
from ptmtools.light.options import LightOptions
from ptmtools.scene.lights import Lamp, Lights
from ptmtools.scene.model import Material, Scene
from ptmtools.scene.orientation.main_axes import tolerance_of
from tests.light.shapes import indexed, quad, surroundings
from tests.light.test_cells import HEIGHT, SIDE, at, piece, room

NOWHERE = quad((90, 90, 90), (91, 90, 90), (91, 91, 90), (90, 91, 90))
UP = np.array([[0.0, 1.0, 0.0]])


def lamp(kind: int, place: tuple[float, float, float], **more: Any) -> Lamps:
    given = {"way": (0.0, -1.0, 0.0), "power": 1.0, "area": 0.0, "cone": (1.0, 0.0), **more}
    rows = (np.array([value], float) for value in given.values())
    return Lamps(np.array([kind], np.uint8), np.array([place], float), *rows)


def received(lamps: Lamps, point: Floats, *walls: Floats, rays: int = 64) -> Floats:
    """The light on level places."""
    normal = np.broadcast_to(UP, (len(point), 3)).copy()
    around = surroundings(NOWHERE, *walls)
    return direct_light(around, lamps, point, normal, turns(len(point)), rays)


def scene_of(corner: Floats, lamp_faces: int, *, two_sided: bool = False) -> Scene:
    """A scene whose last faces glow."""
    points, triangles = indexed(corner)
    count = len(corner)
    material = np.zeros(count, np.int32)
    material[count - lamp_faces :] = 1
    return Scene(
        points,
        triangles,
        np.zeros((count, 3, 2)),
        np.zeros(count, np.int32),
        material,
        np.full(count, two_sided),
        ("building",),
        (Material("wall"), Material("lamp")),
        tolerance_of(points, triangles, 0.0),
    )


def shining(luminance: float, *lamps: Lamp) -> Lights:
    glow = np.array([[0.0] * 3, [luminance] * 3], np.float32)
    return replace(Lights.none(2), glow=glow, lamps=lamps)


def test_a_point_lights_by_the_square_of_its_distance() -> None:
    point = np.array([[x, 0.0, z] for x in (0, 1, 4) for z in (0, 2, -3)])
    away = np.array([0, 3.0, 0]) - point
    far = np.linalg.norm(away, axis=1)
    expected = 50 * (away[:, 1] / far) / far**2
    actual = received(lamp(_POINT, (0, 3, 0), power=50.0), point)
    assert actual == pytest.approx(expected, rel=1e-3)  # rays begin above the surface


def many_lamps(count: int) -> Lamps:
    """Points, spots and suns in and about a hall of 20 m."""
    rng = np.random.default_rng(3)
    way = rng.normal(size=(count, 3)) - [0.0, 3, 0]
    return Lamps(
        rng.choice([_POINT, _POINT, _SPOT, _SUN], count).astype(np.uint8),
        rng.uniform((-10, 2, -10), (10, 5, 10), (count, 3)),
        way / np.linalg.norm(way, axis=1, keepdims=True),
        rng.uniform(0, 2, count),
        np.zeros(count),
        np.stack([rng.uniform(0.7, 1, count), rng.uniform(0, 0.6, count)], axis=1),
    )


@pytest.mark.parametrize("kind", [_POINT, _SPOT, _SUN])
def test_too_many_lamps_join_and_light_about_as_before(kind: int) -> None:
    lamps = many_lamps(40_000)
    lamps = lamps.only(lamps.kind == kind)
    joined = _merge(lamps)
    assert len(lamps) > 2 * _MOST
    assert 50 < len(joined) <= _MOST
    assert joined.power.sum() == pytest.approx(lamps.power.sum())
    x, z = np.meshgrid(np.linspace(-9, 9, 7), np.linspace(-9, 9, 7))
    point = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    assert received(joined, point) == pytest.approx(received(lamps, point), rel=0.15)


def test_few_lamps_are_as_they_are_and_dark_ones_are_left_out() -> None:
    lamps = many_lamps(_MOST)
    lamps.power[:100] = 0
    joined = _merge(lamps)
    assert np.array_equal(joined.place, lamps.place[100:])
    assert np.array_equal(joined.power, lamps.power[100:])


def test_lamps_of_unlike_kinds_and_ways_stay_apart() -> None:
    lamps = many_lamps(_MOST)
    turned = lamps.only(np.arange(_MOST))
    turned.kind[:] = _SPOT
    turned.way[:, 1] *= -1
    pairs = zip(vars(lamps).values(), vars(turned).values(), strict=True)
    up = Lamps(*map(np.concatenate, pairs))
    joined = _merge(up)
    for kind in (_POINT, _SPOT, _SUN):
        own, before = joined.only(joined.kind == kind), up.only(up.kind == kind)
        assert own.power.sum() == pytest.approx(before.power.sum())
    spots, before = joined.only(joined.kind == _SPOT), up.only(up.kind == _SPOT)
    rising = spots.power[spots.way[:, 1] > 0].sum()
    assert rising == pytest.approx(before.power[before.way[:, 1] > 0].sum(), rel=0.05)


def test_a_spot_lights_its_cone_and_a_sun_everywhere() -> None:
    point = np.array([[0.0, 0, 0], [1, 0, 0], [2.2, 0, 0]])
    cone = math.cos(math.radians(20)), math.cos(math.radians(45))
    centre, edge, outside = received(lamp(_SPOT, (0, 2, 0), cone=cone), point)
    assert centre == pytest.approx(1 / 4, rel=1e-3)
    assert 0 < edge < 1 / 4 * 2 / math.sqrt(5)
    assert outside == 0
    slanted = np.array([math.sin(0.5), -math.cos(0.5), 0])
    assert received(lamp(_SUN, (0, 0, 0), way=slanted, power=3.0), point) == pytest.approx(
        3 * math.cos(0.5)
    )


def parallel(a: float, b: float, height: float) -> float:
    """The light of a rectangle of luminance 1 above a level place below its corner (Howell's
    catalogue of view factors, B-4)."""
    x, y = a / height, b / height
    first = x / math.hypot(1, x) * math.atan(y / math.hypot(1, x))
    return (first + y / math.hypot(1, y) * math.atan(x / math.hypot(1, y))) / 2


def test_a_rectangle_that_glows_as_its_formula_says() -> None:
    wide, deep, high = 1.2, 0.6, 2.0
    panel = quad((0, high, 0), (wide, high, 0), (wide, high, deep), (0, high, deep))
    floor = quad((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))
    scene = scene_of(np.concatenate([floor, panel]), 2)
    lamps = lamps_of(scene, shining(5.0))
    assert lamps.area.sum() == pytest.approx(wide * deep)
    corner = received(lamps, np.array([[0.0, 0, 0]]), panel)
    assert corner == pytest.approx(5 * parallel(wide, deep, high), rel=0.03)
    beside = 5 * (parallel(3 + wide, deep, high) - parallel(3, deep, high))
    assert received(lamps, np.array([[-3.0, 0, 0]]), panel) == pytest.approx(beside, rel=0.03)
    above = np.array([[0.5, 3.0, 0.3]])
    down = -UP
    assert direct_light(surroundings(NOWHERE), lamps, above, down, turns(1), 64) == 0
    both = lamps_of(replace(scene, two_sided=np.ones(4, bool)), shining(5.0))
    assert set(both.kind) == {_BOTH}
    assert direct_light(surroundings(NOWHERE), both, above, down, turns(1), 64) > 1


def test_a_wall_shades_a_lamp() -> None:
    wall = quad((1, 0, -9), (1, 0, 9), (1, 2, 9), (1, 2, -9))
    bulb = lamp(_POINT, (0, 1, 0))
    before, behind, far = received(bulb, np.array([[0.5, 0, 0], [1.5, 0, 0], [9, 0, 0]]), wall)
    assert before > 0.3
    assert behind == far == 0
    # Half of a strip of lamps is behind the wall.
    strip = [lamp(_POINT, (x, 1.0, 0)) for x in np.linspace(-1, 3, 64)]
    held = zip(*(vars(each).values() for each in strip), strict=True)
    lamps = Lamps(*map(np.concatenate, held))
    point = np.array([[1.001, 0.0, 5]])
    high = quad((1, 0, -9), (1, 0, 9), (1, 9, 9), (1, 9, -9))
    free, half = received(lamps, point), received(lamps, point, high)
    assert half == pytest.approx(free / 2, rel=0.05)


def hits(origin: Floats, target: Floats, corner: Floats) -> np.ndarray:
    """(n,) whether a face lies between two places (Möller and Trumbore)."""
    way = (target - origin)[:, None]
    a, b, c = corner[:, 0], corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.cross(way, c)
    det = np.einsum("ntx,tx->nt", across, b)
    start = origin[:, None] - a
    aside = np.cross(start, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("ntx,ntx->nt", start, across) / det
        v = np.einsum("nyx,ntx->nt", way, aside) / det
        t = np.einsum("tx,ntx->nt", c, aside) / det
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return np.asarray((inside & (t > 1e-6) & (t < 1 - 1e-6)).any(axis=1))


def test_many_lamps_in_a_room_of_shelves_by_brute_force() -> None:
    random = np.random.default_rng(3)
    shelves = random.random((60, 1, 3)) * [8, 3, 8] + random.normal(0, 0.6, (60, 3, 3))
    shelves[..., 1] = np.maximum(shelves[..., 1], 0.2)
    count = 24
    lamps = Lamps(
        np.full(count, _POINT, np.uint8),
        random.random((count, 3)) * [8, 0.1, 8] + [0, 3.5, 0],
        np.tile([0.0, -1, 0], (count, 1)),
        random.random(count) + 0.5,
        np.zeros(count),
        np.ones((count, 2)),
    )
    point = random.random((200, 3)) * [8, 0, 8]
    expected = np.zeros(len(point))
    for place, power in zip(lamps.place, lamps.power, strict=True):
        away = place - point
        far = np.linalg.norm(away, axis=1)
        free = ~hits(point, np.broadcast_to(place, point.shape), shelves)
        expected += power * free * away[:, 1] / far**3
    actual = received(lamps, point, shelves, rays=512)
    assert np.abs(actual - expected).mean() < 0.01 * expected.mean()
    few = received(lamps, point, shelves, rays=16)
    assert np.abs(few - expected).mean() < 0.1 * expected.mean()
    assert few.mean() == pytest.approx(expected.mean(), rel=0.02)


def test_lamps_that_matter_are_kept() -> None:
    """Of a row of lamps, those far away are left out, and the light stays."""
    count = 400
    lamps = Lamps(
        np.full(count, _POINT, np.uint8),
        np.stack([np.arange(count) * 10.0, np.full(count, 3.0), np.zeros(count)], axis=1),
        np.tile([0.0, -1, 0], (count, 1)),
        np.full(count, 9.0),
        np.zeros(count),
        np.ones((count, 2)),
    )
    floor = quad((0, 0, 0), (0, 0, 4), (4, 0, 4), (4, 0, 0))
    kept = lamps_near(lamps, floor)
    assert 0 < len(kept) < count / 2
    point = points_on(floor[:1].repeat(50, axis=0), np.arange(50))
    assert received(kept, point, rays=512) == pytest.approx(
        received(lamps, point, rays=512), abs=0.01
    )


def test_each_kind_is_measured_by_its_own_light() -> None:
    """A sun in lux does not drown a lamp in candela."""
    sun, bulb = lamp(_SUN, (0, 0, 0), power=1e5), lamp(_POINT, (0, 2, 0), power=3.0)
    pairs = zip(vars(sun).values(), vars(bulb).values(), strict=True)
    both = Lamps(*(np.concatenate(pair) for pair in pairs))
    point = np.random.default_rng(0).random((301, 3)) * [6, 0, 6]
    normal = np.tile(UP, (301, 1))
    result = measure_lamps(surroundings(NOWHERE), both, point, normal, turns(301), 64)
    for kind in (_SUN, _POINT):
        own = result.only(result.kind == kind)
        assert np.median(received(own, point)) == pytest.approx(1)


def test_what_glows_a_little_or_everywhere_is_no_lamp() -> None:
    faces = room()
    assert lamp_luminance(scene_of(faces, 2), shining(0.05)).tolist() == [0, 0]
    assert lamp_luminance(scene_of(faces, 2), shining(0.5)).tolist() == pytest.approx([0, 0.5])
    assert lamp_luminance(scene_of(faces, 8), shining(0.5)).tolist() == [0, 0]


WINDOW = 2.0, 4.0, 1.0, 2.5  # from, to along x; from, to in height


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


def upright(width: float, height: float, far: float) -> float:
    """The part of the sky seen from a level place through an upright rectangle that stands on its
    level, with its lower corner right before it (Howell, B-3)."""
    x, y = far / width, height / width
    reach = math.hypot(x, y)
    return (math.atan(1 / x) - x / reach * math.atan(1 / reach)) / (2 * math.pi)


def test_the_sky_through_a_window_as_its_formula_says() -> None:
    left, right, low, high = WINDOW
    point = np.array([[x, 0.0, z] for x in (2.5, 3.5) for z in (1, 2, 4)])
    normal = np.tile(UP, (len(point), 1))
    around = surroundings(windowed())
    _, seen = light_and_sky(around, point, normal, turns(len(point)), 4096, 3.0)
    expected = [
        sum(upright(width, high, z) - upright(width, low, z) for width in (x - left, right - x))
        for x, _, z in point.tolist()
    ]
    assert seen == pytest.approx(expected, abs=0.004)
    assert min(expected) > 0.005


BAKE = LightOptions("bake", light_samples=256)


def lit_room(corner: Floats, lights: Lights | None = None) -> tuple[CellLight, LightMix]:
    """The light of a room, of which what glows has none of its own."""
    lamp_faces = 2 if lights is not None and lights.glow.any() else 0
    scene, around = scene_of(corner, lamp_faces), surroundings(corner)
    own = piece(corner)
    own.glass[len(corner) - lamp_faces :] = True
    mix = light_mix(around, [own], lamps_of(scene, lights), BAKE, ABOVE, WHITE)
    return LightBaking(around, BAKE, mix).light(own), mix


def test_a_closed_room_without_lamps_is_as_by_ambient_light_alone() -> None:
    result, mix = lit_room(room())
    assert mix == LightMix()
    assert np.array_equal(
        result.texels, LightBaking(surroundings(room()), BAKE).light(piece(room())).texels
    )


def test_a_room_is_brighter_near_its_window() -> None:
    result, mix = lit_room(windowed())
    plain = LightBaking(surroundings(windowed()), BAKE).light(piece(windowed()))
    assert mix.sky
    assert mix.slope < 1
    near_it, far_off = (1, (0.5, 0.25, 0.25)), (0, (0.1, 0.4, 0.5))  # 1.5 m and 5.4 m away
    assert at(result, *near_it) == pytest.approx(at(plain, *near_it), abs=0.1)
    assert at(result, *far_off) < 0.95 * at(plain, *far_off)
    rays = RayLight(surroundings(windowed()), windowed(), 1024, 3.0, above=ABOVE)
    point = np.array([[3.0, 0, z] for z in (1.0, 1.5, 2, 2.5, 3, 4)])
    gain = mix.look(rays)(np.zeros(6, int), point, turns(6)) / rays(
        np.zeros(6, int), point, turns(6)
    )
    assert (np.diff(gain[1:]) < 0.01).all()  # below the sill it is darker again
    assert gain[1] > 1.1 * gain[-1]
    assert result.texels is not None
    assert result.texels.min() > 20


def test_a_wall_without_windows_is_about_as_bright_beside_the_brightest_of_rooms() -> None:
    wall = np.array([0.67], np.float32)
    most = LightMix(slope=(WHITE - 0.57) / (3.0 - 0.57))  # ambient light, the sky, and lamps
    assert expose(most.tone(wall)) > 0.9 * expose(wall)
    assert np.diff(most.tone(np.linspace(0, 3, 50, dtype=np.float32))).min() > 0
    assert most.tone(np.array([3.0], np.float32)) == pytest.approx(WHITE)


def test_a_lamp_in_one_corner_lights_what_it_sees() -> None:
    panel = quad((4.5, 2.9, 4.5), (5.5, 2.9, 4.5), (5.5, 2.9, 5.5), (4.5, 2.9, 5.5))
    corner = np.concatenate([room(), panel])
    result, mix = lit_room(corner, shining(1.0))
    assert mix.lamps is not None
    assert set(mix.lamps.kind) == {_PATCH_KIND}
    below, away = (0.17, 0.0, 0.83), (0.83, 0.0, 0.17)
    assert at(result, 0, below) > 1.15 * at(result, 0, away) > 0.3
    screen = quad((3, 0, 0), (3, 0, 6), (3, 3, 6), (3, 3, 0))
    shaded, _ = lit_room(np.concatenate([room(), screen, panel]), shining(1.0))
    assert at(shaded, 0, away) < 0.95 * at(result, 0, away)
    assert not result.mapped.size or result.uv[-2:].max() == 0  # the lamp has none


def test_more_of_a_lamp_is_never_darker_nor_is_anything_black() -> None:
    x = np.linspace(0, 50, 200)
    total = 0.3 + x / (1 + x)
    assert (np.diff(encode(0.6 * total).astype(int)) >= 0).all()
    assert encode(np.zeros(1)) > 20
