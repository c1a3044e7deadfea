"""Reflections in pictures, against the formulas of docs/formats/hints.md, pixel by pixel."""

from __future__ import annotations

import json
import math
import re
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.errors import DatabaseError
from ptmtools.light.model import PROBE_MAPS, PROBE_SIZE
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.served import Served, read_served
from ptmtools.output.surfaces import Gloss
from ptmtools.pipeline.validation import validate
from ptmtools.progress import silent
from ptmtools.rendering.layers import Layers, blend, transparent_of
from ptmtools.rendering.painting import SurfacePainter
from ptmtools.rendering.pyramids import pack_pyramids
from ptmtools.rendering.rays import Caster
from ptmtools.rendering.records import Sight
from ptmtools.rendering.reflection import DIELECTRIC, Panorama, lit_radiance, mix_light, octahedral
from ptmtools.rendering.tone import LitSurfaces, show_vertex_light, tone_of
from ptmtools.site.pictures import _Scene
from ptmtools_lab.catalogue import catalogue_of
from ptmtools_lab.lossy import no_previews
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.tables import look
from tests.lab.test_tone import (
    AHEAD,
    CAMERA,
    CODES,
    CORNERS,
    DULL,
    EDGES,
    FACTOR,
    FAR,
    NEUTRAL,
    PLAIN,
    STOPS,
    TEXEL,
    TINT,
    WHITE,
    _outside,
    decoded,
    displayed,
    encoded,
    levels,
    strips,
)

Vector = list[float]
MEAN, COLOR, OPACITY, EXPOSURE = 2.0, (200, 180, 210), 0.3, (0.7, 0.8, 0.6)
CENTRE, LOW, HIGH = [0.5, 0.3, 0.2], [-7.0, -5.0, -6.0], [7.0, 6.0, 5.0]
PROBE = {"cell": 0, "white": 5.0, "mean": MEAN, "centre": CENTRE, "low": LOW, "high": HIGH}
#: Metallic and roughness of the strips, the last of which is a pane.
FINISHES = [
    [(0.0, 0.3), (1.0, 0.0), (0.0, 0.0)],
    [(0.5, 0.5), (0.2, 0.75), (0.0, 0.6)],
    [(1.0, 0.9), (0.0, 1.0), (0.0, 1.0)],
]
#: Unit normals of the corners of strip 1, one of which leans away from the eye.
NORMALS = [[0.6, 0.0, 0.8], [0.0, -0.6, -0.8], [-0.8, 0.36, 0.48]]


def codes_of(way: Floats) -> Floats:
    """(n, 3) codes of the probe in (n, 3) unit directions, smooth ones."""
    return 170 + 70 * np.stack([way[:, 0], way[:, 1] * way[:, 2], -way[:, 2]], axis=1)


def probe_image() -> np.ndarray:
    """With the same codes for all roughnesses, but for 3 less in each map."""
    image = np.zeros((*PROBE_SIZE[::-1], 3), np.uint8)
    for number, (left, top, side) in enumerate(PROBE_MAPS):
        at = (np.arange(-1, side - 1) + 0.5) / (side - 2) * 2 - 1
        x, z = (grid.ravel() for grid in np.meshgrid(at, at))
        # A place beyond an edge is the one that is mirrored at the middle of the edge.
        for one, other in ((x, z), (z, x)):
            beyond = np.abs(one) > 1
            one[beyond] = np.sign(one[beyond]) * (2 - np.abs(one[beyond]))
            other[beyond] *= -1
        y = 1 - np.abs(x) - np.abs(z)
        folded = (1 - np.abs(z)) * np.where(x < 0, -1, 1), (1 - np.abs(x)) * np.where(z < 0, -1, 1)
        way = np.stack([np.where(y < 0, folded[0], x), y, np.where(y < 0, folded[1], z)], axis=1)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        codes = np.rint(codes_of(way) - 3 * number).reshape(side, side, 3)
        image[top : top + side, left : left + side] = codes
    return image


IMAGE = probe_image()


def panorama(texels: Any = IMAGE, **change: Any) -> Panorama:
    numbers = {"white": 5.0, "stops": STOPS, "mean": MEAN} | change
    box = {k: np.array(PROBE[k], np.float64) for k in ("centre", "low", "high")}
    return Panorama(**numbers, **box, texels=np.array(texels, np.float32).reshape(-1, 3))


def glossy(
    finishes: Sequence[tuple[float, float]], curved: bool = False, light: Any = NEUTRAL
) -> Served:
    """The strips, all with one probe; the last is a pane before what is around."""
    served = strips(light, EXPOSURE)
    row = {"components": 3, "ends": [1], "width": 192, "height": 128, "color": COLOR}
    index = dict(served.index, textures=[*served.index["textures"], row | {"probe": PROBE}])
    metallic, roughness = np.repeat(np.array(finishes), 2, axis=0).T
    normals = np.zeros((6, 3, 3), np.float32)
    normals[2:4] = NORMALS
    pane = np.arange(6) > 3
    surfaces = replace(
        served.surfaces,
        gloss=Gloss(np.full(6, 2, np.int32), metallic, roughness),
        normals=normals if curved else None,
        glass=pane,
        transparent=pane,
        cutoff=np.zeros(6),
        opacity=np.where(pane, OPACITY, 1.0),
    )
    return replace(served, surfaces=surfaces, index=index)


def sight_of(served: Served) -> tuple[Sight, Any]:
    caster = Caster(served.surfaces, transparent_of(served.surfaces))
    sight = caster.look(CAMERA, np.zeros(3), AHEAD)
    return Layers(served.surfaces).split(
        sight, lambda at: (np.ones(len(at.ray)), np.zeros(len(at.ray)))
    )


def chains(probe: np.ndarray = IMAGE) -> list[list[np.ndarray]]:
    return [*levels(), [probe]]


def painted(
    served: Served, monkeypatch: Any, probe: np.ndarray = IMAGE, *, lit: bool = False
) -> Floats:
    pyramids = pack_pyramids(chains(probe))
    monkeypatch.setattr("ptmtools.rendering.painting.read_pyramids", lambda *_: pyramids)
    tone = tone_of(served.index, 0)
    painter = SurfacePainter(served, tone, max_side=0, lit=lit, progress=silent)
    sight, layers = sight_of(served)
    painter.load(sight.triangle, *(layer.triangle for layer in layers))
    shown = painter.colors(sight)
    blend(layers, sight, painter.layer, shown)
    return shown


def pictured(served: Served, monkeypatch: Any, probe: np.ndarray = IMAGE) -> Floats:
    scene: Any = _Scene(served)
    given = dict(enumerate(chains(probe))), tone_of(served.index, 0)
    sight, layers = sight_of(served)
    shown: Floats = scene._colors(*given, sight)
    blend(layers, sight, partial(scene._layer, *given), shown)
    return shown


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def unit(a: Vector) -> Vector:
    return [x / math.hypot(*a) for x in a]


def looked_up(way: Vector, roughness: float, image: np.ndarray | None) -> Vector:
    """Radiance of the probe, from the texels of its image; without one by the mean code."""
    if image is None:
        return [5.0 * 2 ** (STOPS * (c / 255 - 1)) for c in COLOR]
    x, y, z = (v / sum(map(abs, way)) for v in way)
    if y < 0:
        x, z = (1 - abs(z)) * (-1 if x < 0 else 1), (1 - abs(x)) * (-1 if z < 0 else 1)
    first = math.floor(3 * roughness)
    mixed = []
    for left, top, side in (PROBE_MAPS[first], PROBE_MAPS[min(first + 1, 3)]):
        u, v = (k + 1 + (p * 0.5 + 0.5) * (side - 2) for k, p in ((left, x), (top, z)))
        column, row = math.floor(u - 0.5), math.floor(v - 0.5)
        a, b = u - 0.5 - column, v - 0.5 - row
        four = image[row : row + 2, column : column + 2].astype(float)
        mixed.append(((1 - b) * four[0] + b * four[1]).T @ [1 - a, a])
    code = mixed[0] + (3 * roughness - first) * (mixed[1] - mixed[0])
    return [5.0 * 2 ** (STOPS * (c / 255 - 1)) for c in code]


def split(nv: float, r: float) -> tuple[float, float]:
    x, y, z, w = (
        r * a + b for a, b in ((-1, 1), (-0.0275, 0.0425), (-0.572, 1.04), (0.022, -0.04))
    )
    a = min(x * x, 2 ** (-9.28 * nv)) * x + y
    return -1.04 * a + z, 1.04 * a + w


def mirrored(at: Vector, v: Vector, n: Vector) -> Vector:
    w = [2 * dot(n, v) * a - b for a, b in zip(n, v, strict=True)]
    t = [max((h - p) / k, (b - p) / k) for h, b, p, k in zip(HIGH, LOW, at, w, strict=True)]
    return unit([p + k * max(0.0, min(t)) - c for p, k, c in zip(at, w, CENTRE, strict=True)])


def expected_colors(
    sight: Sight, finishes: Sequence[tuple[float, float]], image: Any = IMAGE, curved: bool = False
) -> Floats:
    return np.array([_expected(ray, finishes, image, curved) for ray in sight.ray.tolist()])


def _expected(
    ray: Vector, finishes: Sequence[tuple[float, float]], image: Any, curved: bool
) -> Vector:
    at, v = [FAR * k for k in ray], unit([-k for k in ray])
    around = _outside(ray, EXPOSURE)
    if not EDGES[0] < at[0] < EDGES[-1]:
        return around
    strip = sum(at[0] > edge for edge in EDGES[1:])
    m, r = finishes[strip]
    if strip == 2:
        return _expected_pane(at, v, r, image, around)
    along, up = (at[0] - EDGES[strip]) / 3, (at[1] + 9) / 18
    if strip == 0:
        base = [decoded(t / 255) * f for t, f in zip(TEXEL, FACTOR, strict=True)]
        share = min(max(2 * along - 0.5, 0), 1)
        texel = [(1 - share) * a + share * b for a, b in zip(*CODES, strict=True)]
        luma = dot(texel, [0.299, 0.587, 0.114])
        codes = [luma + (t - luma) / NEUTRAL["hue"] for t in texel]
        light = [WHITE[0] * 2 ** (STOPS * (code / 255 - 1)) for code in codes]
    weight = (1 - along, along - up, up) if along > up else (1 - up, along, up - along)
    if strip == 1:
        base = [f * dot(weight, k) for f, k in zip(TINT, zip(*CORNERS, strict=True), strict=True)]
        light = [WHITE[1]] * 3
    n = [0.0, 0.0, 1.0]
    if strip == 1 and curved:
        n = unit([dot(weight, k) for k in zip(*NORMALS, strict=True)])
    n = [-k for k in n] if dot(n, v) < 0 else n
    scale, bias = split(max(dot(n, v), 0.001), r)
    s = [(DIELECTRIC * (1 - m) + b * m) * scale + bias for b in base]
    luminance = dot(light, [0.2126, 0.7152, 0.0722])
    dark = 1 + r * (min(1, luminance / MEAN) - 1)
    t = min(max((r - 0.2) / 0.6, 0), 1)
    t = t * t * (3 - 2 * t)
    probe = looked_up(mirrored(at, v, n), r, image)
    shown = [(1 - t) * p * dark + t * k for p, k in zip(probe, light, strict=True)]
    rows = zip(base, light, shown, s, strict=True)
    return displayed(
        [b * k * (1 - m) * (1 - max(s)) + p * q for b, k, p, q in rows], EXPOSURE, True
    )


def _expected_pane(at: Vector, v: Vector, r: float, image: Any, behind: Vector) -> Vector:
    scale, bias = split(max(v[2], 0.001), r)
    s = DIELECTRIC * scale + bias
    f = s * (1 + 0.9 * (1 - s))
    near = looked_up(mirrored(at, v, [0.0, 0.0, 1.0]), r, image)
    far = looked_up([-k for k in v], 1.0, image)
    glare = displayed([b * (1 - f) + f * p for b, p in zip(far, near, strict=True)], EXPOSURE, True)
    plain = displayed(far, EXPOSURE, True)
    own = [255 * encoded(d) * (0.7 + 0.3 * v[2]) for d in DULL]
    rows = zip(own, glare, plain, behind, strict=True)
    return [
        c * OPACITY * (1 - f) + max(g - (1 - f) * p, 0) + (1 - OPACITY) * (1 - f) * b
        for c, g, p, b in rows
    ]


@pytest.mark.parametrize("draw", [painted, pictured])
@pytest.mark.parametrize("finishes", FINISHES)
def test_pictures_reflect_by_the_formula(
    draw: Callable[..., Floats], finishes: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Surfaces with lightmaps and with light at vertices, and panes."""
    served = glossy(finishes)
    sight, layers = sight_of(served)
    assert [*np.unique(layers[0].triangle)] == [4, 5]
    actual, expected = draw(served, monkeypatch), expected_colors(sight, finishes)
    np.testing.assert_allclose(actual, expected, atol=0.01)


@pytest.mark.parametrize("draw", [painted, pictured])
def test_curved_surfaces_have_normals_between_those_of_corners(
    draw: Callable[..., Floats], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Turned to the eye; others stay flat."""
    served = glossy(FINISHES[0], curved=True)
    actual = draw(served, monkeypatch)
    expected = expected_colors(sight_of(served)[0], FINISHES[0], curved=True)
    np.testing.assert_allclose(actual, expected, atol=0.01)


@pytest.mark.parametrize("draw", [painted, pictured])
def test_the_mean_code_counts_until_the_finest_level(
    draw: Callable[..., Floats], monkeypatch: pytest.MonkeyPatch
) -> None:
    served = glossy(FINISHES[0])
    actual = draw(served, monkeypatch, np.ascontiguousarray(IMAGE[::2, ::2]))
    expected = expected_colors(sight_of(served)[0], FINISHES[0], None)
    np.testing.assert_allclose(actual, expected, atol=0.01)


def test_frames_of_the_simulator_reflect(monkeypatch: pytest.MonkeyPatch) -> None:
    """With what a client has of the probe. The simulator has no panes."""
    served, pyramids = glossy(FINISHES[0]), pack_pyramids(chains())
    world: Any = SimpleNamespace(
        served=served,
        relief=None,
        pyramids=pyramids._replace(mean=np.full((3, 3), 99.0)),
        lossy=no_previews(3),
        camera=CAMERA,
        catalogue=SimpleNamespace(cell_count=1),
        shows=None,
    )
    renderer = FrameRenderer(world, CAMERA.height, samples=1)
    sight = renderer.look(np.zeros(3), AHEAD)
    strip = FAR * sight.ray[:, 0] < EDGES[2]
    expected = expected_colors(sight, FINISHES[0])
    np.testing.assert_allclose(
        renderer.full(sight).reshape(-1, 3)[strip], expected[strip], atol=0.01
    )
    frame = renderer.colors(sight, np.ones(1, np.bool_), np.array([1, 2, 0])).reshape(-1, 3)
    expected = expected_colors(sight, FINISHES[0], None)
    np.testing.assert_allclose(frame[strip], expected[strip], atol=0.01)


def test_clients_want_the_finest_level_of_a_probe_in_sight() -> None:
    """Coarser ones are of no use. The error of the tables knows texels alone."""
    served = glossy(FINISHES[0])
    pyramids = pack_pyramids([*levels(), [IMAGE[::2, ::2], IMAGE]])
    eye, ahead = np.zeros((1, 3)), AHEAD[None]
    (views,) = look(served.surfaces, pyramids, CAMERA, eye, ahead)
    triangle = Caster(served.surfaces).look(CAMERA, eye[0], ahead[0]).triangle
    mirrors, rows = (triangle >= 0) & (triangle < 4), views.texture == 2
    np.testing.assert_allclose(views.need[rows], [[0, mirrors.mean()]])
    np.testing.assert_allclose(views.sight[rows], [[0, mirrors[CAMERA.sparse].mean()]])
    assert (views.error[rows] == 0).all()
    served.index["cells"][0]["box"] = [[-9, -9, -9], [9, 9, 9]]
    for row in served.index["textures"]:
        row.update(texelBytes=3, gpuTexelBytes=4, differences=[0], color=[0, 0, 0])
    served.index["textures"][2].update(ends=[1, 2], differences=[0, 7])
    served = replace(served, statistics={"cells": [{}]})
    stock = catalogue_of(served, np.zeros((3, 2)), np.zeros((3, 3)))
    assert stock.differences[2].tolist() == [0, 0, 7]
    assert stock.shapes.texture.tolist().count(2) == 3


@pytest.mark.parametrize("light", [NEUTRAL, PLAIN, None])
def test_nothing_reflects_without_baked_light(light: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor by the lamp of pictures that show no baked light."""
    served, lit = glossy(FINISHES[0], light=light), light is NEUTRAL
    if lit:
        served = show_vertex_light(served)
    plain = replace(served, surfaces=replace(served.surfaces, gloss=None))
    shown, expected = (painted(each, monkeypatch, lit=lit) for each in (served, plain))
    np.testing.assert_array_equal(shown, expected)


def test_each_tone_curve_shows_reflections(monkeypatch: pytest.MonkeyPatch) -> None:
    served = glossy(FINISHES[0], light=dict(NEUTRAL, tone="agx"))
    plain = replace(served, surfaces=replace(served.surfaces, gloss=None))
    shown, without = (painted(each, monkeypatch) for each in (served, plain))
    assert np.abs(shown - without).mean() > 5


def test_a_probe_shows_a_smooth_sphere() -> None:
    """Over the edges of its maps as well, for any roughness."""
    random = np.random.default_rng(3)
    way = random.normal(size=(4000, 3))
    way[:1000, 0] *= 1e-4
    way[1000:2000, 1] *= 1e-4
    way[2000:3000, :2] *= 1e-4
    way = np.concatenate([way, np.eye(3), -np.eye(3), [[0, -1, 1], [-1, -1, 0], [1, 0, -1]]])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for roughness in (0.0, 0.2, 1 / 3, 0.5, 0.9, 1.0):
        actual = 255 * (1 + np.log2(panorama().radiance(7 * way, roughness) / 5) / STOPS)
        expected = codes_of(way) - 9 * roughness
        np.testing.assert_allclose(actual, expected, atol=1.2 + 5.5 * roughness)


def test_directions_and_places() -> None:
    ways = [
        [0, 1, 0],
        [0, -1, 0],
        [1, 0, 0],
        [0, 0, -1],
        [1, -1, 0],
        [-1, -2, -1],
        [-0.0, -1, -0.0],
    ]
    places = [[0, 0], [1, 1], [1, 0], [0, -1], [1, 0.5], [-0.75, -0.75], [1, 1]]
    np.testing.assert_allclose(octahedral(np.array(ways, np.float64)), places)
    odd = np.array([[0, 0, 0], [np.nan, 1, 0], [np.inf, 1, -np.inf]])
    assert (octahedral(odd) == 0).all()


def test_a_mirror_looks_at_the_sides_of_the_box() -> None:
    """From a point inside, outside, and on a side."""
    at = np.array([[1.0, 2.0, -6.0], [1.0, 2.0, 6.0], [7.0, 2.0, -6.0]])
    view = np.array([[0.6, 0.0, 0.8], [0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    with np.errstate(all="raise"):
        way = panorama().mirror_ways(at, view, np.tile([0.0, 0.0, 1.0], (3, 1)))
    expected = np.array([[-7, 2, 14 / 3], [1, 2, 6], [7, 2, -6]]) - CENTRE
    np.testing.assert_allclose(way, expected, atol=1e-9)


def test_a_mirror_of_metal_shows_a_code() -> None:
    """Seen from straight ahead it has the colour of the metal."""
    ahead, base = np.array([[0.0, 0.0, 1.0]]), np.array([[0.9, 0.6, 0.3]])
    texels = np.tile(np.array([255.0, 204.0, 0.0]), (128 * 192, 1))
    probe = panorama(texels)
    mirrored = probe.radiance(probe.mirror_ways(np.zeros((1, 3)), ahead, ahead), 0.0)
    np.testing.assert_allclose(mirrored, [[5, 5 / 4, 5 / 1024]], rtol=1e-5)
    shown = lit_radiance(base, np.ones((1, 3)), mirrored, np.ones(1), (1.0, 0.0))
    np.testing.assert_allclose(shown, base * mirrored, rtol=0.02)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.6, 1.0])
def test_a_white_furnace(roughness: float) -> None:
    """A white surface in light of 1 from everywhere is as bright as that."""
    facing = np.linspace(0.001, 1, 50)
    one = np.ones((50, 3))
    probe = panorama([[255.0] * 3], white=1.0, mean=1.0)
    reflected = mix_light(probe.radiance(one, roughness), one, 1.0, roughness)
    shown = lit_radiance(one, one, reflected, facing, (0.0, roughness))
    np.testing.assert_allclose(shown, 1, atol=1e-6)
    # The fit leaves out light that bounces between the facets of a rough metal.
    metal = lit_radiance(one, one, reflected, facing, (1.0, roughness))
    assert metal.max() <= 1 + 1e-6
    np.testing.assert_allclose(metal, 1, atol=0.55 * roughness + 0.01)


def test_a_pane_before_dark_shows_more_than_before_bright() -> None:
    served = glossy(FINISHES[0])
    sight, layers = sight_of(served)
    pane = np.flatnonzero((FAR * sight.ray[:, 0] > EDGES[2]) & (FAR * sight.ray[:, 0] < EDGES[3]))
    scene: Any = _Scene(served)
    paint = partial(scene._layer, dict(enumerate(chains())), tone_of(served.index, 0))
    changes = []
    for behind in (0.0, 250.0):
        shown = np.full((len(sight.ray), 3), behind)
        blend(layers, sight, paint, shown)
        changes.append(shown[pane].mean() - behind)
    dark, bright = changes
    assert dark > 20
    assert bright < 0


@pytest.mark.parametrize(("others", "white"), [("lit", 1.0), ("unlit", 0.0)])
def test_only_layers_without_light_are_panes(others: str, white: float) -> None:
    """A lit one, whose texture is half transparent, has its reflection among its colours. Panes
    reflect in a building without any lit surface, too."""
    served = glossy(FINISHES[0])
    assert served.surfaces.white is not None
    pane = np.arange(6) > 3
    whites = np.where(pane, white, served.surfaces.white if others == "lit" else 0.0)
    served = replace(served, surfaces=replace(served.surfaces, white=whites))
    sight, layers = sight_of(served)
    ray, triangle, _ = layers[0]
    part = sight._replace(triangle=triangle.astype(np.int64), ray=sight.ray[ray])
    shown, share = np.full((len(ray), 3), 99.0), np.full((len(ray), 1), 0.4)
    tone = tone_of(served.index, 0)
    color, alpha = LitSurfaces(served).layer(part, tone, lambda _: IMAGE, share, shown)
    assert ((color == shown * share).all() and (alpha == share).all()) == (others == "lit")


def test_extremes_are_colors() -> None:
    """Eyes at a surface, in the centre and far away; a box without room, a probe without light."""
    flat = dict(PROBE, centre=[0, 0, -FAR], low=[0, 0, -FAR], high=[0, 0, -FAR], mean=0)
    served = glossy(FINISHES[0], curved=True)
    index = dict(served.index)
    for probe in (PROBE, flat):
        index["textures"] = [*index["textures"][:2], dict(index["textures"][2], probe=probe)]
        scene = _Scene(replace(served, index=index))
        textures: Any = dict(enumerate(chains()))
        sight, _ = sight_of(served)
        for eye in ([0, 0, 0], [0, 0, -FAR], [0, 0, -FAR + 1e-9], [1e9, 0, 1e9]):
            there = sight._replace(eye=np.array(eye, np.float64))
            shown = scene._colors(textures, tone_of(index, 0), there)
            assert np.isfinite(shown).all()
            assert shown.min() >= 0
            assert shown.max() <= 255


ROW: dict[str, Any] = {"cell": 0, "white": 1, "mean": 1, "centre": [0, 0, 0]}
ROW |= {"low": [-1, -1, -1], "high": [1, 1, 1]}
FINE = {"width": 192, "height": 128, "components": 3, "ends": [1], "color": [1, 2, 3]}
FAULTS: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "a box inside out": ({"low": [0, 2, 0]}, {}, r"probe\.low"),
    "no white": ({"white": 0}, {}, r"probe\.white"),
    "less than no light": ({"mean": -1}, {}, r"probe\.mean"),
    "an infinite box": ({"high": [0, 1e999, 0]}, {}, "not finite"),
    "a centre in a plane": ({"centre": [0, 0]}, {}, r"probe\.centre"),
    "a cell that is not there": ({"cell": 99}, {}, r"probe\.cell"),
    "another size": ({}, {"width": 96}, "192 x 128"),
    "a grey image": ({}, {"components": 1}, "192 x 128"),
}


@pytest.fixture
def damaged(two_rooms: Path, tmp_path: Path) -> Path:
    """A database to spoil."""
    return Path(shutil.copytree(two_rooms, tmp_path / "db"))


def check_refusal(database: Path, words: str, code: str) -> None:
    """By clients of the hints, and by the check."""
    with pytest.raises(DatabaseError, match=f"{words}.*PTM-D006"):
        read_served(database)
    faults = [issue for issue in validate(database, workers=1).issues if issue.code == code]
    assert any(re.search(words, f"{fault.place} {fault.message}") for fault in faults)


@pytest.mark.parametrize("fault", FAULTS)
def test_damaged_rows(damaged: Path, fault: str) -> None:
    file = damaged / "www/hints.json"
    index = json.loads(file.read_text())
    probe, row, words = FAULTS[fault]
    index["textures"].append(index["textures"][0] | FINE | {"probe": ROW | probe} | row)
    index["textures"][-1].pop("previews", None)
    file.write_text(json.dumps(index))
    check_refusal(damaged, words, "PTM-D700")


@pytest.mark.parametrize(
    ("extras", "words", "code"),
    [
        ({"probe": 0, "white": 1}, "texture 0 of the hints is not", "PTM-D731"),
        ({"probe": 99, "white": 1}, "belongs to another cell|no probe 99", "PTM-D704"),
        ({"probe": -1, "white": 1}, "probe", "PTM-D731"),
        ({"probe": 0}, "neither lit nor a pane", "PTM-D731"),
    ],
)
def test_materials_with_a_probe_that_is_none(
    damaged: Path, extras: dict[str, Any], words: str, code: str
) -> None:
    file = damaged / "www/gltf/c0000.glb"
    document, binary = unpack(file.read_bytes())
    for material in document["materials"]:
        material["extras"] = material.get("extras", {}) | extras
    file.write_bytes(pack(document, binary))
    check_refusal(damaged, words, code)
