"""Probes: where they stand, what they see, and the maps of their image."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.baked import BakedSurfaces, find_pieces
from ptmtools.light.building import BuildingBaking
from ptmtools.light.cells import LightBaking
from ptmtools.light.model import PROBE_MAPS, PROBE_SIZE, coded_light
from ptmtools.light.probes import (
    Probe,
    ProbeBaking,
    _prefilter,
    directions,
    share_lobes,
    weigh,
    with_border,
)
from ptmtools.light.reflectance import SmallImages
from ptmtools.scene.lights import Lamp, Lights
from tests.light.test_cells import HEIGHT, OPTIONS, SIDE, piece, room, scene_of

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

CENTRE = np.array([SIDE / 2, 1.6, SIDE / 2])
RED, GREY = (0.8, 0.1, 0.1), (0.5, 0.5, 0.5)


def probe_of(corner: Floats, points: Floats, lights: Lights | None = None) -> Probe:
    """The probe of a room whose wall x = 0 is red."""
    tint = np.where(np.abs(corner[..., 0]).max(axis=1, keepdims=True) == 0, RED, GREY)
    scene, pieces = scene_of(corner), piece(corner)
    building = BuildingBaking(scene, [pieces], lights, tint).light()
    baking = LightBaking(OPTIONS, building, None, tint[:, 1].astype(np.float32))
    lit, black = baking.light(pieces), np.zeros_like(tint)
    surfaces = BakedSurfaces.of_scene(
        scene, [pieces], [lit], tint, black, SmallImages.of_texels([]), 1.0
    )
    return ProbeBaking(building, surfaces, np.arange(len(corner)), corner).probe(points)


@pytest.fixture(scope="module")
def probe() -> Probe:
    return probe_of(room(), np.array([CENTRE]))


def seen(probe: Probe, *way: float) -> Floats:
    """(3,) the radiance from a direction, by the sharpest map."""
    side = PROBE_MAPS[0][2] - 2
    nearest = int(np.argmax(directions(side, 1)[0] @ np.array(way)))
    row, column = divmod(nearest, side)
    return coded_light(probe.texels[row + 1, column + 1], probe.white)


def test_a_probe_shows_what_is_around_it(probe: Probe) -> None:
    assert probe.texels.shape == (*PROBE_SIZE[::-1], 3)
    red = seen(probe, -1, 0, 0)
    assert red[0] > 5 * red[1]
    grey = seen(probe, 1, 0, 0)
    assert grey[0] < 1.4 * grey[1]


def test_the_box_is_the_room(probe: Probe) -> None:
    assert probe.low == pytest.approx([0, 0, 0], abs=1e-3)
    assert probe.high == pytest.approx([SIDE, HEIGHT, SIDE], abs=1e-3)


def test_rougher_maps_are_more_even(probe: Probe) -> None:
    spreads = []
    for left, top, side in PROBE_MAPS:
        codes = probe.texels[top + 1 : top + side - 1, left + 1 : left + side - 1]
        spreads.append(np.log2(coded_light(codes, probe.white)).std())
    assert spreads == sorted(spreads, reverse=True)
    assert spreads[0] > 1.5 * spreads[-1]


def test_the_most_open_point_is_the_centre() -> None:
    """Neither in a corner nor behind a wall."""
    points = np.array([[0.1, 1.6, 0.1], CENTRE, [SIDE + 1, 1.6, 1]])
    assert probe_of(room(), points).centre.tolist() == CENTRE.tolist()


def test_a_lamp_without_a_surface_shines_in_it() -> None:
    lamp = Lamp("point", (CENTRE[0], 2.9, CENTRE[2] + 2), intensity=5.0)
    lit = probe_of(room(), np.array([CENTRE]), replace(Lights.none(1), lamps=(lamp,)))
    way = np.array([0, 1.3, 2]) / math.hypot(1.3, 2)
    assert seen(lit, *way).min() == pytest.approx(lit.white, rel=0.02)
    assert seen(lit, *(way * [1, 1, -1])).max() < lit.white / 8


@pytest.mark.parametrize("power", [1e-6, 1e9])
def test_probes_of_dark_and_dazzling_rooms_are_finite(power: float) -> None:
    lamp = Lamp("point", (9.0, 9.0, 9.0), intensity=power)  # outside: the room is dark
    for place in (lamp, replace(lamp, position=(3.0, 2.5, 3.0))):
        lit = probe_of(room(), np.array([CENTRE]), replace(Lights.none(1), lamps=(place,)))
        assert 0 < lit.mean < math.inf
        assert 0 < lit.white < math.inf


def test_directions_cover_the_sphere_evenly() -> None:
    way, solid = directions(62, 1)
    assert np.linalg.norm(way, axis=1) == pytest.approx(1)
    assert solid.sum() == pytest.approx(4 * math.pi, rel=2e-3)
    assert np.abs(solid @ way).max() < 1e-9
    # Neighbours of a row are near each other, across the equator, too.
    step = np.arccos(
        np.clip((way.reshape(62, 62, 3)[:, 1:] * way.reshape(62, 62, 3)[:, :-1]).sum(-1), -1, 1)
    )
    assert step.max() < 0.1


def test_a_border_repeats_its_neighbours_on_the_sphere() -> None:
    side = 14
    way, _ = directions(side, 1)
    codes = np.rint((way.reshape(side, side, 3) + 1) * 127).astype(np.uint8)
    whole = with_border(codes).astype(float) / 127 - 1
    for outer, inner in ((whole[0], whole[1]), (whole[:, -1], whole[:, -2])):
        assert np.abs(outer - inner).max() < 4 / side


@pytest.mark.parametrize("alpha", [1 / 9, 4 / 9, 1.0])
def test_lobes_keep_even_light_and_lean_to_their_side(alpha: float) -> None:
    way, solid = directions(63, 1)
    target = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    share = share_lobes(target, way, solid, alpha)
    assert share.sum(axis=1) == pytest.approx(1)
    above = (way[:, 1:2] > math.cos(0.3)).astype(np.float32)
    shine = weigh(share, above)
    angle = np.linspace(0, math.pi / 2, 10_000)
    lobe = ((1 + np.cos(angle)) / 2 * (alpha**2 - 1) + 1) ** -2 * np.cos(angle) * np.sin(angle)
    assert shine[0, 0] == pytest.approx(lobe[angle < 0.3].sum() / lobe.sum(), rel=0.03)
    assert shine[1, 0] == 0


def test_each_quarter_of_a_map_has_the_light_of_its_own_directions() -> None:
    side = PROBE_MAPS[0][2] - 2
    light = np.random.default_rng(0).random((side * side, 3)) ** 8
    way, solid = directions(side // 2, 1)
    source = light.reshape(side // 2, 2, side // 2, 2, 3).mean(axis=(1, 3)).reshape(-1, 3)
    for number, texels in enumerate(_prefilter(light), 1):
        alpha = (number / (len(PROBE_MAPS) - 1)) ** 2
        target, _ = directions(PROBE_MAPS[number][2] - 2, 1)
        share = share_lobes(target, way, solid, alpha)
        assert texels == pytest.approx(share @ source, rel=1e-4)


def test_a_piece_is_the_one_that_holds_the_point_on_its_side() -> None:
    low, high = (
        np.array([[[0, 0, 0], [1, 0, 0], [1, 0, 1]]], np.float32) + [[x, 0, 0]] for x in (0, 1)
    )
    corner = np.concatenate([low, high, low]).astype(np.float32)
    point = np.array([[0.9, 0, 0.5], [1.9, 0, 0.5], [0.9, 0, 0.5], [1.9, 0, 0.5]])
    piece_of, share = find_pieces(
        np.zeros(4, np.int64), point, np.array([True, True, False, False]),
        np.array([0, 3]), np.arange(3), corner, np.array([1, 0, -1], np.int8),
    )  # fmt: skip
    assert piece_of.tolist() == [0, 1, 2, 1]
    assert np.einsum("nk,nkx->nx", share, corner[piece_of]) == pytest.approx(point, abs=1e-6)
    none, _ = find_pieces(
        np.zeros(1, np.int64), point[:1], np.array([False]),
        np.array([0, 1]), np.arange(1), corner, np.array([1], np.int8),
    )  # fmt: skip
    assert none.tolist() == [-1]
