"""Linear light and sRGB."""

from __future__ import annotations

import numpy as np

from ptmtools.scene.colors import encode_srgb, pack_colors, to_linear, to_srgb, unpack_colors


def test_what_the_standard_says() -> None:
    """IEC 61966-2-1: both ends, the knee, and a half; what is no light is none or all."""
    light = np.array([0.0, 0.0031308, 0.5, 1.0, -1.0, 7.0, np.nan])
    assert np.allclose(to_srgb(light), [0, 0.04045, 0.735357, 1, 0, 1, 0], atol=1e-5)
    assert to_srgb(np.ones(1))[0] == 1


def test_levels_come_back() -> None:
    levels = np.arange(256, dtype=np.uint8)
    assert np.array_equal(encode_srgb(to_linear(levels / 255)), levels)
    in_16_bits = np.rint(65535 * to_linear(levels / 255)) / 65535
    assert np.array_equal(encode_srgb(in_16_bits), levels)


def test_numbers_of_colors() -> None:
    colors = np.random.default_rng(1).integers(0, 256, (4, 5, 3), dtype=np.uint8)
    assert np.array_equal(unpack_colors(pack_colors(colors)), colors)
    assert pack_colors(np.array([1, 2, 3], np.uint8)) == 0x010203
