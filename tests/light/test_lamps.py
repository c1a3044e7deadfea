"""Lamps against what is known of them: formulas, and rays without Embree."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.lamps import (
    _BOTH,
    _POINT,
    _SPOT,
    _SUN,
    MOST_PATCHES,
    Lamps,
    _merge,
    direct_light,
    lamp_radiance,
    lamps_near,
    lamps_of,
)
from ptmtools.light.occlusion import points_on, turns
from ptmtools.scene.lights import Lamp, Lights
from ptmtools.scene.model import Material, Scene
from ptmtools.scene.orientation.main_axes import tolerance_of
from tests.light.shapes import indexed, quad, surroundings
from tests.light.test_cells import room

NOWHERE = quad((90, 90, 90), (91, 90, 90), (91, 91, 90), (90, 91, 90))
UP = np.array([[0.0, 1.0, 0.0]])


def lamp(kind: int, place: tuple[float, float, float], **more: Any) -> Lamps:
    given = {
        "way": (0.0, -1.0, 0.0),
        "power": 1.0,
        "area": 0.0,
        "cone": (1.0, 0.0),
        "color": (1.0, 1, 1),
    }
    given |= more
    rows = (np.array([value], float) for value in given.values())
    return Lamps(np.array([kind], np.uint8), np.array([place], float), *rows)


def received(lamps: Lamps, point: Floats, *walls: Floats, rays: int = 64) -> Floats:
    """The irradiance of level places by white lamps."""
    normal = np.broadcast_to(UP, (len(point), 3)).copy()
    around = surroundings(NOWHERE, *walls)
    light = direct_light(around, lamps, point, normal, turns(len(point)), rays)
    assert light[:, 0] == pytest.approx(light[:, 2])
    return math.pi * light[:, 1]


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
        np.ones((count, 3)),
    )


@pytest.mark.parametrize("kind", [_POINT, _SPOT, _SUN])
def test_too_many_lamps_join_and_light_about_as_before(kind: int) -> None:
    lamps = many_lamps(40_000)
    lamps = lamps.only(lamps.kind == kind)
    joined = _merge(lamps, MOST_PATCHES)
    assert len(lamps) > 2 * MOST_PATCHES
    assert 50 < len(joined) <= MOST_PATCHES
    assert joined.power.sum() == pytest.approx(lamps.power.sum())
    x, z = np.meshgrid(np.linspace(-9, 9, 7), np.linspace(-9, 9, 7))
    point = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    assert received(joined, point) == pytest.approx(received(lamps, point), rel=0.15)


def test_few_lamps_are_as_they_are_and_dark_ones_are_left_out() -> None:
    lamps = many_lamps(MOST_PATCHES)
    lamps.power[:100] = 0
    joined = _merge(lamps, MOST_PATCHES)
    assert np.array_equal(joined.place, lamps.place[100:])
    assert np.array_equal(joined.power, lamps.power[100:])


def test_lamps_of_unlike_kinds_and_ways_stay_apart() -> None:
    lamps = many_lamps(MOST_PATCHES)
    turned = lamps.only(np.arange(MOST_PATCHES))
    turned.kind[:] = _SPOT
    turned.way[:, 1] *= -1
    pairs = zip(vars(lamps).values(), vars(turned).values(), strict=True)
    up = Lamps(*map(np.concatenate, pairs))
    joined = _merge(up, MOST_PATCHES)
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
    assert not direct_light(surroundings(NOWHERE), lamps, above, down, turns(1), 64).any()
    both = lamps_of(replace(scene, two_sided=np.ones(4, bool)), shining(5.0))
    assert set(both.kind) == {_BOTH}
    assert direct_light(surroundings(NOWHERE), both, above, down, turns(1), 64).min() > 1 / math.pi


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
        np.ones((count, 3)),
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
        np.ones((count, 3)),
    )
    floor = quad((0, 0, 0), (0, 0, 4), (4, 0, 4), (4, 0, 0))
    kept = lamps_near(lamps, floor, 1.0)
    assert 0 < len(kept) < count / 2
    point = points_on(floor[:1].repeat(50, axis=0), np.arange(50))
    assert received(kept, point, rays=512) == pytest.approx(
        received(lamps, point, rays=512), abs=0.01
    )


def test_what_glows_a_little_or_everywhere_is_no_lamp() -> None:
    faces = room()
    assert not lamp_radiance(scene_of(faces, 2), shining(0.05)).any()
    assert lamp_radiance(scene_of(faces, 2), shining(0.5)).tolist() == [[0] * 3, [0.5] * 3]
    assert not lamp_radiance(scene_of(faces, 8), shining(0.5)).any()


def test_colours_are_exact_without_shadows_and_shaded_by_lamp() -> None:
    """A red lamp behind a wall, and a blue one before it; and both without the wall."""
    red, blue = [1 / 0.2126, 0, 0], [0, 0, 1 / 0.0722]
    lamps = [lamp(_POINT, (x, 2, 0), color=c) for x, c in ((-3.0, red), (3.0, blue))]
    both = Lamps(*map(np.concatenate, zip(*(vars(k).values() for k in lamps), strict=True)))
    point, wall = np.array([[0.5, 0, 0]]), quad((0, 0, -9), (0, 0, 9), (0, 9, 9), (0, 9, -9))
    given = turns(1), 64
    free = direct_light(surroundings(NOWHERE), both, point, UP, *given)[0]
    shaded = direct_light(surroundings(NOWHERE, wall), both, point, UP, *given)[0]
    for k, x in ((0, 3.5), (2, 2.5)):
        expected = 2 / (x * x + 4) ** 1.5 / math.pi * both.color[k // 2, k]
        assert free[k] == pytest.approx(expected, rel=1e-3)
    assert shaded[0] == 0
    assert shaded[2] == pytest.approx(free[2])


def test_a_sun_that_is_shut_out_leaves_no_grain() -> None:
    """Its light would be ten thousand times that of the bulb."""
    sun, bulb = lamp(_SUN, (0, 0, 0), power=1e5), lamp(_POINT, (0, 2, 0), power=10.0)
    both = Lamps(*map(np.concatenate, zip(vars(sun).values(), vars(bulb).values(), strict=True)))
    roof = quad((-9, 3, -9), (9, 3, -9), (9, 3, 9), (-9, 3, 9))
    point = np.random.default_rng(0).random((301, 3)) * [6, 0, 6]
    assert received(both, point, roof, rays=4) == pytest.approx(received(bulb, point, rays=4))
