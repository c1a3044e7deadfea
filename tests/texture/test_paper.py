"""Profile `paper`: exact, shorter than `raw`, and strict about what a JPEG says it is."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.texture.profiles import paper, raw
from ptmtools.texture.pyramid import mean_below
from tests.texture.coding import coded_groups


@pytest.fixture(autouse=True)
def _needs_imagecodecs() -> None:
    pytest.importorskip("imagecodecs", reason="pip install 'ptmtools[codecs]'")


def image(height: int, width: int, components: int, dtype: str) -> NDArray:
    y, x = np.mgrid[:height, :width]
    noise = np.random.default_rng(1).integers(0, 4, (height, width, components))
    planes = np.stack([2 * x + (c + 1) * y for c in range(components)], axis=2) + noise
    return (planes * (1 if dtype == "uint8" else 131)).astype(dtype)


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
@pytest.mark.parametrize("components", [1, 2, 3, 4])
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (2, 2), (33, 20), (64, 65)])
def test_every_level_is_exact(dtype: str, components: int, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(2)
    noise = rng.integers(0, np.iinfo(dtype).max + 1, (*shape, components)).astype(dtype)
    for finest in (image(*shape, components, dtype), noise):
        for data, level in coded_groups(paper, finest)[1:]:
            assert len(data) <= 1 + len(raw.encode_tile(level, mean_below(level)).data)


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_it_is_shorter_than_raw(dtype: str) -> None:
    level = image(128, 129, 3, dtype)
    below = mean_below(level)
    data = paper.encode_tile(level, below).data
    assert data[0] == paper.JPEG
    assert len(data) < 0.8 * len(raw.encode_tile(level, below).data)


def test_floats_are_refused() -> None:
    level = np.zeros((4, 4, 1), np.float32)
    for attempt in (
        lambda: paper.encode_base(level),
        lambda: paper.encode_tile(level, level[::2, ::2]),
        lambda: paper.decode_tile(b"", level, (8, 8, 1)),
    ):
        with pytest.raises(InputError, match="PTM-I111"):
            attempt()


def test_without_imagecodecs_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imagecodecs", None)
    with pytest.raises(MissingComponentError, match=r"ptmtools\[codecs\].*PTM-M100"):
        paper.encode_base(np.zeros((1, 1, 1), np.uint8))


LEVEL = image(35, 38, 3, "uint8")
BELOW = mean_below(LEVEL)


def test_another_size_is_refused_before_it_is_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    import imagecodecs

    huge = imagecodecs.jpeg8_encode(np.zeros((60000, 4, 3), np.uint8), lossless=True)
    texels = LEVEL[:34:2, ::2].copy()
    twice = imagecodecs.jpeg8_encode(texels, lossless=True)
    lossy = imagecodecs.jpeg8_encode(texels, 90)
    begin = -(-BELOW.size // 4) + 1 + LEVEL[34:].nbytes
    prefix = paper.encode_tile(LEVEL, BELOW).data[:begin]
    monkeypatch.delattr(imagecodecs, "jpeg8_decode")
    for jpeg in (huge, twice + twice[2:], lossy, b""):
        data = prefix + len(jpeg).to_bytes(4, "little") + bytes(jpeg)
        with pytest.raises(InputError, match="PTM-I112"):
            paper.decode_tile(data, BELOW, LEVEL.shape)
