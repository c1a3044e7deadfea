"""Lightmaps: known scenes, what larger ones take over, the light of vertices and of the model."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.light.atlas import cover, unwrap
from ptmtools.light.lightmap import AGREE, _enlarge, bake, fill, smooth, vertex_light
from ptmtools.light.looks import LightImage, PaintedLight, RayLight
from ptmtools.light.occlusion import normals
from ptmtools.scene.source import SourceWrap
from tests.light import filters
from tests.light.shapes import (
    GROUND,
    HOUSE,
    bilinear,
    indexed,
    ledges,
    samples,
    surroundings,
    triangles_of,
)
from tests.systems.campus.models import level

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

SIZES = (512, 1024, 2048)


def test_thin_faces_show_their_own_light() -> None:
    """The undersides of shelves are dark, their tops are light."""
    sizes = (256, 512)
    corner = ledges(10)
    atlas = unwrap(*indexed(corner), sizes)
    where = surroundings(corner, GROUND)
    face, point, at = samples(corner, atlas.uv, 4000)
    light = RayLight(where, corner, 256, 0.2)
    wanted = light(face, point, np.zeros(len(face)))
    assert np.ptp(wanted) > 0.5
    maps = bake(light, corner, atlas, light.grain, sizes)
    for actual, most in zip(maps, (0.08, 0.04), strict=True):
        assert (np.abs(bilinear(actual.value, at)[0] - wanted) > 0.1)[face >= 2].mean() < most


def test_a_lightmap_of_a_house_on_the_ground() -> None:
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles, SIZES)
    where = surroundings(HOUSE, GROUND)
    look = RayLight(where, HOUSE, 64, 20.0)
    maps = bake(look, HOUSE, atlas, look.grain, SIZES)
    assert [len(m.value) for m in maps] == [512, 1024, 2048]
    normal = normals(HOUSE)
    owner = cover(atlas.uv, 512)
    value = maps[0].value
    assert value.min() >= 0
    assert value.max() <= 1
    roof = np.flatnonzero(normal[:, 1] > 0.9)
    assert value[np.isin(owner, roof)].min() > 0.99, "the roof is in the open"
    low = np.flatnonzero((normal[:, 1] < 0.1) & (HOUSE[..., 1].max(axis=1) < 5))
    high = np.flatnonzero((normal[:, 1] < 0.1) & (HOUSE[..., 1].min(axis=1) > 4))
    assert value[np.isin(owner, low)].mean() < value[np.isin(owner, high)].mean() - 0.05


def test_larger_lightmaps_are_nearly_what_rays_say_everywhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles, SIZES)
    where = surroundings(HOUSE, GROUND)
    look = RayLight(where, HOUSE, 64, 20.0)
    (taken,) = bake(look, HOUSE, atlas, look.grain, (512,))

    def nothing(
        value: object, chart: object, centred: object, larger: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(larger.shape, np.float32), np.zeros(larger.shape, np.bool_)

    monkeypatch.setattr("ptmtools.light.lightmap._enlarge", nothing)
    (whole,) = bake(look, HOUSE, atlas, look.grain, (512,))
    assert whole.computed == whole.covered
    assert taken.computed < 0.05 * whole.computed
    error = np.abs(taken.value - whole.value)[cover(atlas.uv, 512) >= 0]
    assert np.sqrt((error**2).mean()) < AGREE / 10
    assert error.max() < AGREE


@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.sampled_from([0.0, 0.02, 0.5]))
def test_filters_are_those_of_arrays(seed: int, side: int, grain: float) -> None:
    """Bit by bit."""
    random = np.random.default_rng(seed)
    value = random.choice([1, 0.03, 0.0], 1) * random.random((side, side), np.float32)
    value = value.astype(np.float32)
    chart = random.integers(-1, 2, (side, side), np.int32)
    larger = chart.repeat(2, axis=0).repeat(2, axis=1)
    other = random.random(larger.shape) < 0.1
    larger[other] = random.integers(-1, 2, other.sum(), np.int32)
    centred = random.random(value.shape) < 0.7
    for one, plain in zip(
        _enlarge(value, chart, centred, larger),
        filters.enlarged(value, chart, centred, larger),
        strict=True,
    ):
        np.testing.assert_array_equal(one, plain)
    row, column = np.nonzero(chart >= 0)
    np.testing.assert_array_equal(
        smooth(value, chart, row, column, np.float32(grain)),
        filters.smoothed(value, chart, row, column, grain),
    )


def test_no_row_of_texels_lies_in_the_ground() -> None:
    """The lower edge of a wall that stands on it."""
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles, SIZES)
    where = surroundings(HOUSE, GROUND)
    look = RayLight(where, HOUSE, 64, 20.0)
    (actual,) = bake(look, HOUSE, atlas, look.grain, (512,))
    assert actual.value.min() > 0.4


def test_grain_is_smoothed_and_edges_of_light_stay() -> None:
    atlas = unwrap(*indexed(GROUND), SIZES)
    middle = GROUND[..., 0].mean()

    def look(face: Ints, point: Floats, turn: Floats) -> Singles:
        step = np.where(point[:, 0] < middle, 0.2, 0.8)
        return np.asarray(step + 0.1 * (turn - 0.5), np.float32)

    (grained,), (smooth,) = (bake(look, GROUND, atlas, grain, (512,)) for grain in (0.0, 0.1))
    face, point, at = samples(GROUND, atlas.uv, 4000)
    texel = np.ptp(GROUND[..., 0]) / (512 * np.ptp(atlas.uv[..., 0]))
    # Not those between two texels on both sides of the edge.
    apart = np.abs(point[:, 0] - middle) > 1.05 * texel
    wanted = look(face, point, np.full(len(face), 0.5))[apart]
    before, after = (
        np.abs(bilinear(actual.value, at)[0][apart] - wanted) for actual in (grained, smooth)
    )
    assert after.max() < 0.05
    assert after.mean() < 0.6 * before.mean()


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 40))
def test_gaps_take_what_is_near(seed: int, height: int, width: int) -> None:
    random = np.random.default_rng(seed)
    value = random.random((height, width)).astype(np.float32)
    known = random.random((height, width)) < 0.2
    actual = fill(value, known)
    assert np.array_equal(actual[known], value[known])
    if known.any():
        assert actual.min() >= value[known].min() - 1e-6
        assert actual.max() <= value[known].max() + 1e-6
    else:
        assert (actual == 1).all()


def test_a_gap_has_the_value_of_its_own_side() -> None:
    value = np.zeros((32, 32), np.float32)
    known = np.zeros((32, 32), bool)
    known[:, :12] = known[:, 20:] = True
    value[:, 20:] = 1
    actual = fill(value, known)
    assert (actual[:, 12:14] == 0).all()
    assert (actual[:, 18:20] == 1).all()


def test_vertices_carry_the_light_of_their_faces() -> None:
    """On a plane whose light is linear the fit is exact; noise is averaged."""
    corner = triangles_of(level((0, 0), (10, 10), 0))

    def look(face: object, point: Floats, turn: object) -> Floats:
        return np.asarray(point[:, 0] / 10, np.float32)

    actual = vertex_light(look, corner, normals(corner))
    assert np.allclose(actual, corner[..., 0] / 10, atol=0.06)


def test_a_corner_does_not_blacken_its_faces() -> None:
    where = surroundings(HOUSE, GROUND)
    look = RayLight(where, HOUSE, 64, 20.0)
    actual = vertex_light(look, HOUSE, normals(HOUSE))
    roof = normals(HOUSE)[:, 1] > 0.9
    assert actual[roof].min() > 0.95
    assert actual.min() > 0.2


def test_the_models_own_light_is_looked_up() -> None:
    corner = triangles_of(level((0, 0), (10, 10), 0))
    uv = np.stack([corner[..., 0] / 10, corner[..., 2] / 10], axis=2)
    image = LightImage(np.tile(np.linspace(0, 255, 64).astype(np.uint8), (64, 1)), CLAMPED)
    look = PaintedLight(corner, uv, np.zeros(2, np.int32), (image,), np.arange(2))
    point = np.array([[2.0, 0, 3], [8, 0, 7]])
    face = np.array([1 if z > x else 0 for x, _, z in point])
    actual = look(face, point, np.zeros(2))
    assert np.allclose(actual, [0.2, 0.8], atol=0.02)
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
        assert look(_face_of(corner, at), at, np.zeros(4)).tolist() == wanted


def _face_of(corner: Floats, point: Floats) -> np.ndarray:
    """Which of two triangles of a square a point is nearer to the middle of."""
    far = np.linalg.norm(point[:, None] - corner.mean(axis=1), axis=2)
    return np.asarray(far.argmin(axis=1))


def test_a_weaker_light_is_nearer_to_white() -> None:
    corner = triangles_of(level((0, 0), (10, 10), 0))
    image = LightImage(np.zeros((2, 2), np.uint8), strength=0.25)
    look = PaintedLight(corner, np.zeros((2, 3, 2)), np.zeros(2, np.int32), (image,), np.arange(2))
    actual = look(np.array([0]), corner[0].mean(axis=0)[None], np.zeros(1))
    assert actual[0] == pytest.approx(0.75)
