"""Lightmaps: grain, covered texels, the light of vertices and of the model."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats, fill_gaps
from ptmtools.light.atlas import unwrap
from ptmtools.light.lightmap import TexelGrid, vertex_light
from ptmtools.light.looks import LightImage, PaintedLight
from ptmtools.light.model import lossy_codes
from ptmtools.light.occlusion import normals
from ptmtools.scene.source import SourceWrap
from ptmtools.texture.previews import decode_preview
from tests.light.shapes import GROUND, indexed, triangles_of
from tests.systems.campus.models import level

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

SIZE = 256


def grid_of(corner: Floats) -> TexelGrid:
    return TexelGrid.of_atlas(corner, unwrap(*indexed(corner), (SIZE,)), SIZE)


def test_grain_is_smoothed_and_edges_of_light_stay() -> None:
    """Of light of which each ray brings nothing or much, as from a window far away."""
    grid = grid_of(GROUND)
    random, rays = np.random.default_rng(1), 64
    left = grid.points()[:, 0] < GROUND[..., 0].mean()
    share = np.where(left, 0.05, 0.4)
    hits = random.binomial(rays, share) / rays
    light = np.stack([hits, 2 * hits, 3 * hits], axis=1).astype(np.float32)
    variance = (4 * hits * (1 - hits) / rays).astype(np.float32)
    smooth = grid.smooth(light, variance, 1e-3)
    wanted = np.outer(share, [1, 2, 3])
    before, after = np.abs(light - wanted).mean(), np.abs(smooth - wanted).mean()
    assert after < 0.3 * before
    assert smooth[left].mean() == pytest.approx(wanted[left].mean(), rel=0.1)
    assert smooth[~left].mean() == pytest.approx(wanted[~left].mean(), rel=0.03)


def test_light_with_a_slope_stays_at_the_edges_of_charts() -> None:
    """Means would be those of the inner side, and walls in two cells would have a seam."""
    grid = grid_of(GROUND)
    random, wanted = np.random.default_rng(2), 90 + grid.points()[:, [0]]
    grain = 0.3 * np.ones(len(wanted), np.float32)
    light = (wanted + np.sqrt(grain)[:, None] * random.standard_normal(wanted.shape)).astype("f4")
    smooth = grid.smooth(light, grain, 1e-3)
    place = grid.points()[:, 0]
    for edge in (place < np.quantile(place, 0.02), place > np.quantile(place, 0.98)):
        assert smooth[edge].mean() == pytest.approx(wanted[edge].mean(), abs=0.08)


def test_covered_texels_take_what_is_open_and_give_nothing() -> None:
    grid = grid_of(GROUND)
    light = np.ones((len(grid.face), 1), np.float32)
    covered = np.abs(grid.points()[:, 0]) < 2
    assert 10 < covered.sum() < len(covered) / 2
    light[covered] = np.nan
    smooth = grid.smooth(light, np.ones(len(light), np.float32), 1e-3)
    assert np.isnan(smooth[covered]).all()
    assert smooth[~covered] == pytest.approx(1)
    assert grid.fill(smooth) == pytest.approx(1)
    assert np.isfinite(grid.fill(np.full_like(light, np.nan))).all()


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 40))
def test_gaps_take_what_is_near(seed: int, height: int, width: int) -> None:
    random = np.random.default_rng(seed)
    value = random.random((height, width, 2)).astype(np.float32)
    known = random.random((height, width)) < 0.2
    actual = fill_gaps(value, known)
    assert np.array_equal(actual[known], value[known])
    if known.any():
        assert actual.min() >= value[known].min() - 1e-6
        assert actual.max() <= value[known].max() + 1e-6
    else:
        assert (actual == 1).all()


def test_a_gap_has_the_value_of_its_own_side() -> None:
    value = np.zeros((32, 32, 1), np.float32)
    known = np.zeros((32, 32), bool)
    known[:, :12] = known[:, 20:] = True
    value[:, 20:] = 1
    actual = fill_gaps(value, known)
    assert (actual[:, 12:14] == 0).all()
    assert (actual[:, 18:20] == 1).all()


def test_vertices_carry_the_light_of_their_faces() -> None:
    """On a plane whose light is linear the fit is exact; noise is averaged."""
    corner = triangles_of(level((0, 0), (10, 10), 0))

    def look(face: object, point: Floats, turn: object) -> Floats:
        return np.asarray(point[:, :1] / [10.0, 20.0], np.float32)

    actual = vertex_light(look, corner, normals(corner))
    assert np.allclose(actual, corner[..., :1] / [10.0, 20.0], atol=0.06)


def test_the_models_own_light_is_looked_up() -> None:
    corner = triangles_of(level((0, 0), (10, 10), 0))
    uv = np.stack([corner[..., 0] / 10, corner[..., 2] / 10], axis=2)
    image = LightImage(np.tile(np.linspace(0, 255, 64).astype(np.uint8), (64, 1)), CLAMPED)
    look = PaintedLight(corner, uv, np.zeros(2, np.int32), (image,), np.arange(2))
    point = np.array([[2.0, 0, 3], [8, 0, 7]])
    face = np.array([1 if z > x else 0 for x, _, z in point])
    actual = look(face, point, np.zeros(2))
    assert np.allclose(actual[:, 0], [0.2, 0.8], atol=0.02)
    white = PaintedLight(corner, uv, np.full(2, -1, np.int32), (image,), np.arange(2))
    assert (white(face, point, np.zeros(2)) == 1).all()


CLAMPED: tuple[SourceWrap, SourceWrap] = ("clamp", "clamp")


@pytest.mark.parametrize(
    ("wrap", "wanted"),
    [("repeat", [0, 1, 0, 1]), ("clamp", [0, 1, 1, 1]), ("mirror", [0, 1, 1, 0])],
)
def test_the_models_own_light_goes_on_as_its_sampler_says(
    wrap: SourceWrap, wanted: list[float]
) -> None:
    """A half dark image, looked up in four halves, along either axis."""
    texels = np.zeros((8, 8), np.uint8)
    texels[:, 4:] = 255
    corner = triangles_of(level((0, 0), (10, 10), 0))
    point = np.array([[1.25, 0, 1.25], [3.75, 0, 1.25], [6.25, 0, 1.25], [8.75, 0, 1.25]])
    for axis, image in ((0, texels), (2, texels.T[::-1])):
        uv = corner[..., [0, 2]] / 5
        look = PaintedLight(
            corner, uv, np.zeros(2, np.int32), (LightImage(image, (wrap, wrap)),), np.arange(2)
        )
        at = point if axis == 0 else point[:, ::-1]
        assert look(_face_of(corner, at), at, np.zeros(4))[:, 0].tolist() == wanted


def _face_of(corner: Floats, point: Floats) -> np.ndarray:
    """Which of two triangles of a square a point is nearer to the middle of."""
    far = np.linalg.norm(point[:, None] - corner.mean(axis=1), axis=2)
    return np.asarray(far.argmin(axis=1))


def test_a_weaker_light_is_nearer_to_white() -> None:
    corner = triangles_of(level((0, 0), (10, 10), 0))
    image = LightImage(np.zeros((2, 2), np.uint8), strength=0.25)
    look = PaintedLight(corner, np.zeros((2, 3, 2)), np.zeros(2, np.int32), (image,), np.arange(2))
    actual = look(np.array([0]), corner[0].mean(axis=0)[None], np.zeros(1))
    assert actual[0, 0] == pytest.approx(0.75)


def test_images_of_codes_keep_their_tint() -> None:
    """Encoders round differences of colour down."""
    tint = np.array([1.2, 0.0, -1.4])
    ramp = np.linspace(90, 200, 96)[:, None, None] + np.linspace(0, 9, 96)[None, :, None]
    codes = (ramp + tint).astype(np.float32)
    name, data = lossy_codes(codes, {"avif": 85, "webp": 90})
    assert name in ("avif", "webp")
    shown = decode_preview(data, 3).astype(float)
    assert np.abs((shown - codes).mean(axis=(0, 1))).max() < 0.4
    assert np.abs(shown - codes).max() < 8
