"""How much there is to see in an image."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.texture import encode
from ptmtools.texture.detail import detail


def stripes(side: int, period: int, low: int, high: int) -> np.ndarray:
    rows = np.where(np.arange(side) // (period // 2) % 2, high, low).astype(np.uint8)
    return np.repeat(np.repeat(rows[:, None], side, axis=1)[..., None], 3, axis=2)


def test_stripes() -> None:
    """Two texels of the level of 64 each: half their difference."""
    assert detail(encode(stripes(256, 16, 0, 51))) == pytest.approx(0.1, rel=1e-6)
    assert detail(encode(stripes(64, 4, 0, 51))) == pytest.approx(0.1, rel=1e-6)


def test_grain_and_shading_are_no_detail() -> None:
    random = np.random.default_rng(1)
    noise = random.integers(100, 151, (1024, 1024, 3)).astype(np.uint8)
    assert detail(encode(noise)) < 0.01
    slope = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 256, axis=1)[..., None]
    assert detail(encode(slope)) < 0.02
    assert detail(encode(np.full((32, 32, 1), 9, np.uint8))) == 0


def test_alpha_does_not_count() -> None:
    rgba = np.full((64, 64, 4), 90, np.uint8)
    rgba[::2, :, 3] = 255
    assert detail(encode(rgba)) == 0


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (5, 3), (2, 64)])
def test_small_and_narrow(shape: tuple[int, int]) -> None:
    texels = np.zeros((*shape, 1), np.float32)
    texels[..., : shape[1] // 2, :] = 4.0
    assert 0 <= detail(encode(texels)) <= 0.5
    assert np.isfinite(detail(encode(np.full((*shape, 1), np.nan, np.float32))))
