"""Lightmaps of objects: known scenes, what larger ones take over, and their filters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.light.atlas import cover, unwrap
from ptmtools.light.lightmap import vertex_light
from ptmtools.light.occlusion import normals
from ptmtools_systems.campus.lightmaps import AGREE, _enlarge, bake, smooth
from ptmtools_systems.campus.obscurance import RayLight
from tests.light.shapes import GROUND, HOUSE, bilinear, indexed, ledges, samples, surroundings
from tests.systems.campus import filters

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
    wanted = light(face, point, np.zeros(len(face)))[:, 0]
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

    monkeypatch.setattr("ptmtools_systems.campus.lightmaps._enlarge", nothing)
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
        return np.asarray(step + 0.1 * (turn - 0.5), np.float32)[:, None]

    (grained,), (smooth,) = (bake(look, GROUND, atlas, grain, (512,)) for grain in (0.0, 0.1))
    face, point, at = samples(GROUND, atlas.uv, 4000)
    texel = np.ptp(GROUND[..., 0]) / (512 * np.ptp(atlas.uv[..., 0]))
    # Not those between two texels on both sides of the edge.
    apart = np.abs(point[:, 0] - middle) > 1.05 * texel
    wanted = look(face, point, np.full(len(face), 0.5))[apart, 0]
    before, after = (
        np.abs(bilinear(actual.value, at)[0][apart] - wanted) for actual in (grained, smooth)
    )
    assert after.max() < 0.05
    assert after.mean() < 0.6 * before.mean()


def test_a_corner_does_not_blacken_its_faces() -> None:
    where = surroundings(HOUSE, GROUND)
    look = RayLight(where, HOUSE, 64, 20.0)
    actual = vertex_light(look, HOUSE, normals(HOUSE))
    roof = normals(HOUSE)[:, 1] > 0.9
    assert actual[roof].min() > 0.95
    assert actual.min() > 0.2
