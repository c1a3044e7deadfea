"""Display of baked light in pictures, against the formulas of docs/formats/hints.md."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.output.locating import Locator
from ptmtools.output.served import Served
from ptmtools.output.surfaces import Surfaces
from ptmtools.progress import silent
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.rendering.kernels import GREY
from ptmtools.rendering.painting import SurfacePainter
from ptmtools.rendering.pyramids import pack_pyramids
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.rendering.records import Sight
from ptmtools.rendering.tone import GLOW, LIT_GLOW, SKY, Tone, agx, show_vertex_light, tone_of
from ptmtools.scene.colors import to_linear
from ptmtools.site.pictures import PictureKind, _Scene, _Textures
from ptmtools_lab.lossy import no_previews
from ptmtools_lab.renderer import FrameRenderer
from tests.lab.worlds import leaf

STOPS, SKY_LIGHT, GROUND_LIGHT = 10, (0.7, 0.9, 1.3), (0.3, 0.25, 0.2)
NEUTRAL = {"stops": STOPS, "hue": 2, "tone": "neutral", "sky": SKY_LIGHT, "ground": GROUND_LIGHT}
PLAIN = {"stops": STOPS, "tone": "plain"}
#: Texel of the image, of 255, and its linear factor; codes of the two texels of the lightmap.
TEXEL, FACTOR = (200, 90, 30), (0.9, 0.5, 0.7)
CODES = ((250, 240, 200), (120, 180, 255))
#: Linear colours of the corners of strip 1, with light as a share of white, and factors of strips
#: 1 and 2.
CORNERS = ((0.9, 0.5, 0.1), (0.2, 0.3, 0.6), (0.05, 0.02, 0.0))
TINT, DULL = (0.8, 0.6, 0.9), (0.4, 0.2, 0.6)
WHITE = (3.0, 2.0)
FAR, CAMERA = 4.0, RayCamera(48, 24, 1.2, 2.0)
AHEAD = np.array([0.0, 0.0, -1.0])
#: Left edge of each strip of the view, at that distance; what is right of the last is empty.
EDGES = (-6.0, -3.0, 0.0, 3.0)


def encoded(linear: float) -> float:
    linear = min(max(linear, 0), 1)
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


def decoded(color: float) -> float:
    return color / 12.92 if color <= 0.04045 else ((color + 0.055) / 1.055) ** 2.4


def displayed(radiance: list[float], exposure: Sequence[float], toned: bool) -> list[float]:
    """A colour, 0 to 255, of linear radiance."""
    x = [value * factor for value, factor in zip(radiance, exposure, strict=True)]
    peak = max(x)
    if toned and peak > 0.8:
        limit = 1 - 0.2 * 0.2 / (peak + 0.2 - 0.8)
        fade = 1 - 1 / (0.15 * (peak - limit) + 1)
        x = [(1 - fade) * value * limit / peak + fade * limit for value in x]
    return [255 * encoded(value) for value in x]


def index_of(light: Mapping[str, Any] | None, *exposures: Sequence[float]) -> dict[str, Any]:
    row = {"components": 3, "ends": [1], "width": 1, "height": 1}
    cells: list[dict[str, Any]] = [{"exposure": list(value)} for value in exposures] or [{}]
    index: dict[str, Any] = {"textures": [row, row], "cells": cells, "viewpoints": []}
    return index | ({"light": dict(light)} if light else {})


def served_of(surfaces: Surfaces, index: Mapping[str, Any]) -> Served:
    """With cells side by side along x, 20 m each, the first around the origin."""
    low = np.array([-10.0, -10, -10])
    step = np.array([20.0, 0, 0])
    count = len(index["cells"])
    records = [{"leaves": [leaf(low + k * step, low + 20 + k * step)]} for k in range(count)]
    sizes = np.zeros(count, np.int64)
    return Served(
        Path(), index, tuple(records), {}, 0, 0, sizes, sizes, (), surfaces, Locator(records)
    )


def strips(
    light: Mapping[str, Any] | None = NEUTRAL, exposure: Sequence[float] = (1, 1, 1)
) -> Served:
    """Two faces each: with image and lightmap, with light at vertices, and not lit."""
    corner, spot = [], []
    for low, high in pairwise(EDGES):
        a, b, c, d = ((x, y, -FAR) for x, y in ((low, -9), (high, -9), (high, 9), (low, 9)))
        corner += [(a, b, c), (a, c, d)]
        spot += [((0, 0), (1, 0), (1, 0)), ((0, 0), (1, 0), (0, 0))]
    lit, strip = light is not None, np.repeat([0, 1, 2], 2)
    colors = np.ones((6, 3, 3))
    colors[2:4] = [[[encoded(value) for value in corner] for corner in CORNERS]] * 2
    factor = np.array([[encoded(value) for value in row] for row in (FACTOR, TINT, DULL)])
    surfaces = Surfaces(
        corner=np.array(corner, np.float64),
        uv=np.zeros((6, 3, 2)),
        cell=np.zeros(6, np.int32),
        shape=strip.astype(np.int32),
        texture=np.array([0, -1, -1], np.int32)[strip],
        color=factor[strip] * colors.mean(axis=1),
        two_sided=np.ones(6, np.bool_),
        glass=np.zeros(6, np.bool_),
        clamped=np.zeros((6, 2), np.bool_),
        seen=np.repeat(np.arange(6)[:, None], 2, axis=1),
        lightmap=np.array([1, -1, -1], np.int32)[strip] if lit else None,
        spot=np.array(spot, np.float64) if lit else None,
        white=np.array([*WHITE, 0])[strip] if lit else None,
        vertex_colors=colors,
    )
    return served_of(surfaces, index_of(light, exposure))


def levels(codes: object = CODES) -> list[list[np.ndarray]]:
    """Of the image, and of the lightmap of two texels side by side."""
    image, lightmap = np.array([[TEXEL]], np.uint8), np.array([codes], np.uint8)
    return [[image], [np.rint(lightmap.mean(axis=1, keepdims=True)).astype(np.uint8), lightmap]]


def painted(served: Served, sight: Sight, tone: Tone | None, monkeypatch: Any) -> Floats:
    pyramids = pack_pyramids(levels())
    monkeypatch.setattr("ptmtools.rendering.painting.read_pyramids", lambda *_: pyramids)
    painter = SurfacePainter(served, tone, max_side=0, lit=False, progress=silent)
    painter.load(sight.triangle)
    return painter.colors(sight)


def pictured(served: Served, sight: Sight, tone: Tone | None, monkeypatch: Any) -> Floats:
    textures: Any = dict(enumerate(levels()))
    return _Scene(served)._colors(textures, tone, sight)


def expected_colors(sight: Sight, tone: str | None, exposure: Sequence[float]) -> Floats:
    """(n, 3) colours of the pixels of `strips`, one by one."""
    toned = tone == "neutral"
    return np.array([_expected(ray, tone, toned, exposure) for ray in sight.ray.tolist()])


def _expected(
    ray: list[float], tone: str | None, toned: bool, exposure: Sequence[float]
) -> list[float]:
    x, y = FAR * ray[0], FAR * ray[1]
    if not EDGES[0] < x < EDGES[-1]:
        return _outside(ray, exposure) if toned else list(SKY)
    strip = sum(x > edge for edge in EDGES[1:])
    along, up = (x - EDGES[strip]) / 3, (y + 9) / 18
    if strip == 0:
        base = [decoded(t / 255) * f for t, f in zip(TEXEL, FACTOR, strict=True)]
        if tone is None:
            return [255 * encoded(f) * t / 255 for t, f in zip(TEXEL, FACTOR, strict=True)]
        share = min(max(2 * along - 0.5, 0), 1)
        texel = [(1 - share) * a + share * b for a, b in zip(*CODES, strict=True)]
        luma = sum(w * t for w, t in zip((0.299, 0.587, 0.114), texel, strict=True))
        codes = [luma + (t - luma) / (NEUTRAL["hue"] if toned else 1) for t in texel]
        light = [WHITE[0] * 2 ** (STOPS * (code / 255 - 1)) for code in codes]
        return displayed([b * v for b, v in zip(base, light, strict=True)], exposure, toned)
    weight = (1 - along, along - up, up) if along > up else (1 - up, along, up - along)
    if strip == 1 and tone:
        color = [
            sum(w * c for w, c in zip(weight, k, strict=True)) for k in zip(*CORNERS, strict=True)
        ]
        base = [f * value for f, value in zip(TINT, color, strict=True)]
        return displayed([WHITE[1] * value for value in base], exposure, toned)
    glow = LIT_GLOW if tone else GLOW
    shade = glow + (1 - glow) / math.hypot(*ray)
    if strip == 2:
        return [255 * shade * encoded(value) for value in DULL]
    colors = [
        sum(w * encoded(c) for w, c in zip(weight, k, strict=True))
        for k in zip(*CORNERS, strict=True)
    ]
    return [255 * shade * encoded(f) * v for f, v in zip(TINT, colors, strict=True)]


def _outside(ray: list[float], exposure: Sequence[float]) -> list[float]:
    at = min(max((ray[1] / math.hypot(*ray) + 0.02) / 0.04, 0), 1)
    share = at * at * (3 - 2 * at)
    pairs = zip(GROUND_LIGHT, SKY_LIGHT, strict=True)
    return displayed([(1 - share) * low + share * high for low, high in pairs], exposure, True)


@pytest.mark.parametrize("draw", [painted, pictured])
@pytest.mark.parametrize(
    ("light", "exposure"),
    [
        (NEUTRAL, (1, 1, 1)),
        (NEUTRAL, (0.3, 0.2, 0.1)),
        (NEUTRAL, (4, 5, 6)),
        (PLAIN, (6, 6, 6)),
        (None, (6, 6, 6)),
    ],
)
def test_pictures_show_light_by_the_formula(
    draw: Callable[..., Floats],
    light: Mapping[str, Any] | None,
    exposure: Sequence[float],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In lightmaps and at vertices; not on what is not lit, which is brighter beside it. Light of
    the model itself has neither exposure nor background."""
    served = strips(light, exposure)
    sight = Caster(served.surfaces).look(CAMERA, np.zeros(3), AHEAD)
    assert {*sight.triangle.tolist()} == {-1, *range(6)}
    actual = draw(served, sight, tone_of(served.index, 0), monkeypatch)
    tone = light["tone"] if light else None
    expected = expected_colors(sight, tone, exposure if tone == "neutral" else (1, 1, 1))
    np.testing.assert_allclose(actual, expected, atol=1e-6)


def test_frames_of_the_simulator_show_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """With what a client has: of a lightmap without levels, the mean code. A cell without geometry
    is grey."""
    served, pyramids = strips(NEUTRAL, (2.0, 1.5, 1.0)), pack_pyramids(levels())
    pyramids = pyramids._replace(mean=np.array([TEXEL, np.mean(CODES, axis=0)], np.float64))
    world: Any = SimpleNamespace(
        served=served,
        relief=None,
        pyramids=pyramids,
        lossy=no_previews(2),
        camera=CAMERA,
        catalogue=SimpleNamespace(cell_count=1),
        shows=None,
    )
    renderer = FrameRenderer(world, CAMERA.height, samples=1)
    sight, there = renderer.look(np.zeros(3), AHEAD), np.ones(1, np.bool_)
    tone = tone_of(served.index, 0)
    assert tone
    expected = painted(served, sight, tone, monkeypatch)
    np.testing.assert_allclose(renderer.full(sight).reshape(-1, 3), expected)
    hit = sight.triangle >= 0
    wall = hit & (sight.triangle < 2)
    bare = renderer.colors(sight, there, np.array([1, 0])).reshape(-1, 3)
    base = to_linear(np.array(TEXEL) / 255) * FACTOR
    light = tone.light(np.array([WHITE[0]]), pyramids.mean[1:])
    np.testing.assert_allclose(bare[wall], np.repeat(tone.display(base * light), wall.sum(), 0))
    np.testing.assert_allclose(bare[~wall], expected[~wall])
    grey = renderer.colors(sight, ~there, np.array([1, 2])).reshape(-1, 3)
    assert (grey[hit] == GREY).all()
    np.testing.assert_allclose(grey[~hit], expected[~hit])


#: Exposures of two cells.
LITTLE, MUCH = (0.5, 0.4, 0.6), (4.0, 3.0, 5.0)


def test_an_eye_has_the_exposure_of_its_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of the viewpoint, or that in which it is; 1 outside all."""
    served = strips(NEUTRAL)
    index = index_of(NEUTRAL, LITTLE, MUCH)
    view: dict[str, Any] = {
        "position": [-4.5, 0, 0],
        "direction": [0, 0, -1],
        "fieldOfView": 1.0,
        "cell": 1,
    }
    index["viewpoints"] = [view]
    served = served_of(replace(served.surfaces, lightmap=None, spot=None), index)
    pyramids = pack_pyramids(levels())
    monkeypatch.setattr("ptmtools.rendering.painting.read_pyramids", lambda *_: pyramids)
    size = {"width": 4, "height": 2, "field_of_view": 10.0}
    for options, exposure in (
        (ViewOptions(**size), MUCH),  # type: ignore[arg-type]
        (ViewOptions(eye=(-9, 0, 0), look=(-9, 1, 0), **size), LITTLE),  # type: ignore[arg-type]
        (ViewOptions(eye=(19, 0, 0), look=(19, 1, 0), **size), MUCH),  # type: ignore[arg-type]
        (ViewOptions(eye=(0, 11, 0), look=(0, 99, 0), **size), (1, 1, 1)),  # type: ignore[arg-type]
    ):
        expected = displayed(list(SKY_LIGHT), exposure, True)
        if options.eye is None:
            base = [decoded(t / 255) * f * WHITE[0] for t, f in zip(TEXEL, FACTOR, strict=True)]
            expected = displayed(base, exposure, True)
        actual = draw_view(served, options)[0, 0]
        np.testing.assert_allclose(actual, expected, atol=0.51)
    scene, textures = _Scene(served), _Textures(served, 1)
    for more, exposure in ({}, MUCH), ({"cell": 0}, LITTLE), ({"cell": None}, LITTLE):
        picture = scene._view(PictureKind((2, 2), 999), view | more, textures)
        assert picture.tone
        assert tuple(picture.tone.exposure) == exposure


@pytest.mark.parametrize("exposure", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("white", [1e-6, 1.0, 1e9])
@pytest.mark.parametrize("curve", ["plain", "neutral", "agx"])
def test_extremes_are_colors(white: float, exposure: float, curve: str) -> None:
    tone = Tone(STOPS, np.full(3, exposure), curve, np.array([[0, 0, 0], [white] * 3]))
    code = np.array([[0, 0, 0], [255, 255, 255], [0, 255, 0], [255, 254, 253]], np.float64)
    with np.errstate(all="raise", under="ignore"):
        light = tone.light(np.full(4, white), code)
        shown = tone.display(light)
        black = tone.display(0 * light)
        outside = tone.background_colors(
            np.array([[0, 1, 0], [0, -1, 0], [1, 0, 0], [0, 1e-9, 1.0]])
        )
    np.testing.assert_allclose(light[:2, 0], [white / 2**STOPS, white])
    np.testing.assert_allclose(black, 0, atol=0.5)
    for colors in (shown, outside):
        assert np.isfinite(colors).all()
        assert colors.min() >= 0
        assert colors.max() <= 255
    assert (np.diff(shown[3]) <= 0.01).all()
    assert shown[1, 0] >= shown[0, 0]


def test_agx_keeps_greys_and_pales_bright_colors() -> None:
    """With the values of its authors for middle grey and the ends."""
    ends = agx(np.array([[0.0], [0.18], [2.0**8]]) * np.ones(3))
    assert ends.mean(axis=1) == pytest.approx([0, 0.2145, 1], abs=0.006)
    assert np.ptp(ends, axis=1).max() < 1e-4
    light = np.geomspace(1e-3, 1e3, 500)[:, None] * [1, 0.5, 0.1]
    shown = agx(light)
    assert (np.diff(shown, axis=0) >= -1e-3).all()
    assert shown[-1].min() > 0.8
    assert shown[250, 2] < 0.6 * shown[250, 0]


def test_brighter_light_is_never_darker() -> None:
    """Nor does its colour change up to the shoulder."""
    tone = Tone(STOPS, 1.0, "neutral", None)
    light = np.geomspace(1e-3, 1e6, 2000)[:, None] * [1, 0.5, 0.1]
    shown = tone.display(light)
    assert (np.diff(shown, axis=0) >= -1e-9).all()
    linear = [[decoded(value / 255) for value in row] for row in shown[light[:, 0] < 0.8].tolist()]
    np.testing.assert_allclose(linear, light[light[:, 0] < 0.8], rtol=1e-9)
    np.testing.assert_allclose(shown[-1], 255, atol=2)


def encoded_tint() -> Floats:
    return np.array([encoded(value) for value in TINT])


def test_light_at_vertices_for_pictures_that_compute_none() -> None:
    """Its colours are those displayed on white; without any, that of all of it."""
    served = strips(NEUTRAL)
    for colors in (served.surfaces.vertex_colors, None):
        lit = replace(served.surfaces, vertex_colors=colors)
        if colors is None:
            lit = replace(lit, color=np.tile(encoded_tint(), (6, 1)))
        shown = show_vertex_light(replace(served, surfaces=lit)).surfaces
        light = CORNERS if colors is not None else np.ones((3, 3))
        expected = [displayed([WHITE[1] * v for v in corner], (1, 1, 1), True) for corner in light]
        assert shown.white is None
        assert shown.vertex_colors is not None
        np.testing.assert_allclose(255 * shown.vertex_colors[2], expected)
        np.testing.assert_allclose(255 * shown.color[2], encoded_tint() * np.mean(expected, axis=0))
        np.testing.assert_array_equal(shown.color[[0, 4]], lit.color[[0, 4]])
        np.testing.assert_array_equal(shown.vertex_colors[[0, 4]], 1)
