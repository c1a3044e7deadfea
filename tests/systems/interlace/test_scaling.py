"""Scaling to powers of two."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from PIL import Image

from ptmtools_systems.interlace.steps import nearest_power, scale


@given(st.integers(1, 1 << 16))
def test_the_nearest_power_of_two(side: int) -> None:
    actual = nearest_power(side)
    assert actual == 1 << round(math.log2(side))
    assert max(actual, side) <= math.sqrt(2) * min(actual, side)


def test_powers_of_two_stay() -> None:
    assert all(nearest_power(1 << n) == 1 << n for n in range(17))


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
@pytest.mark.parametrize("components", [1, 2, 3, 4])
def test_a_plain_image_stays_plain(kind: str, components: int) -> None:
    top = np.iinfo(kind).max
    texel = np.array([top, top // 3, 5, 1 + top // 2], kind)[:components]
    if components in (2, 4):
        texel[-1] = 1 + top // 2
    image = np.broadcast_to(texel, (23, 45, components))
    actual = scale(np.ascontiguousarray(image), 64, 16)
    assert actual.dtype == np.dtype(kind)
    assert actual.shape == (16, 64, components)
    np.testing.assert_array_equal(actual, np.broadcast_to(texel, actual.shape))


def test_a_ramp_stays_a_ramp() -> None:
    ramp = np.tile(np.arange(0, 192, 2, np.uint8), (96, 1))[:, :, None]
    actual = scale(ramp, 128, 128)[5, 4:-4, 0].astype(float)
    want = ((np.arange(128) + 0.5) * 0.75 - 0.5)[4:-4] * 2
    assert abs(actual - want).max() <= 0.5 + 1e-9


def test_transposed_is_the_same() -> None:
    image = np.random.default_rng(3).integers(0, 256, (45, 77, 3), np.uint8)
    other = scale(image.swapaxes(0, 1), 32, 64).swapaxes(0, 1)
    apart = scale(image, 64, 32).astype(int) - other
    assert abs(apart).max() <= 1  # sums in another order


@pytest.mark.parametrize("size", [(64, 128), (128, 64), (128, 128), (64, 64)])
def test_inside_it_is_the_cubic_of_pillow(size: tuple[int, int]) -> None:
    """Which has the same filter; at the edges it leaves out what is outside."""
    image = np.random.default_rng(6).integers(0, 65536, (90, 91, 1), np.uint16)
    real = Image.fromarray(image[:, :, 0].astype(np.float32))
    want = np.asarray(real.resize(size, Image.Resampling.BICUBIC))[4:-4, 4:-4]
    actual = scale(image, *size)[4:-4, 4:-4, 0]
    assert abs(actual - want.clip(0, 65535)).max() < 0.6


def test_strips_do_not_show() -> None:
    column = np.random.default_rng(4).integers(0, 65536, (700, 1, 1), np.uint16)
    wide = scale(np.repeat(column, 5000, axis=1), 4096, 512)  # 256 rows a strip
    thin = scale(np.repeat(column, 40, axis=1), 32, 512)  # one strip
    np.testing.assert_array_equal(wide[:, ::128], thin)


def test_what_is_transparent_does_not_bleed() -> None:
    image = np.zeros((48, 48, 4), np.uint8)
    image[:, :24] = 200, 100, 50, 255
    image[:, 24:] = 0, 255, 0, 0  # what nobody sees
    actual = scale(image, 64, 64)
    seen = actual[actual[:, :, 3] > 0][:, :3].astype(int)
    assert abs(seen - (200, 100, 50)).max() <= 1
