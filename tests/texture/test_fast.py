"""Profile fast for 8 bits: the choice of a coder, bounds, every small size, old files."""

from __future__ import annotations

import zlib

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture.profiles import fast
from ptmtools.texture.profiles.raw import group_length
from tests.texture.coding import coded_groups, textured

BYTE = np.dtype(np.uint8)


def test_a_coarsest_level_of_any_size_comes_back_and_is_compressed() -> None:
    for height, width in ((1, 1), (1, 40), (37, 1), (2, 2), (64, 61)):
        level = np.tile(textured(8, 8, 3), (8, 8, 1))[:height, :width].copy()
        data = fast.encode_base(level)
        assert len(data) <= 1 + level.size
        np.testing.assert_array_equal(fast.decode_base(data, level.shape, BYTE), level)
    assert len(data) < 0.2 * level.size


@pytest.mark.parametrize(
    "image",
    [
        np.random.default_rng(0).integers(0, 256, (128, 128, 3), dtype=np.uint8),
        np.random.default_rng(0).integers(0, 2, (128, 128, 1), dtype=np.uint8) * 255,
        np.full((128, 128, 4), 9, np.uint8),
        np.tile(np.eye(16, dtype=np.uint8)[:, :, None] * 255, (8, 8, 3)),
    ],
    ids=["noise", "two-valued noise", "flat", "repeats"],
)
def test_no_group_is_longer_than_raw(image: NDArray[np.uint8]) -> None:
    for data, level in coded_groups(fast, image):
        shape = (level.shape[0], level.shape[1], level.shape[2])
        assert len(data) <= 1 + (group_length(shape) if min(shape[:2]) > 1 else level.size)


def test_the_coder_fits_the_image() -> None:
    rng = np.random.default_rng(4)
    y, x = np.mgrid[:160, :160]
    waves = np.stack([120 + 70 * np.sin(x / 9 + c) + 40 * np.cos(y / 7) for c in range(3)], axis=2)
    photo = np.clip(waves + rng.normal(0, 5, (160, 160, 1)), 0, 255).astype(np.uint8)
    words = np.tile(rng.integers(0, 2, (20, 16, 1), dtype=np.uint8) * 255, (8, 10, 1))
    noise = rng.integers(0, 256, (160, 160, 3), dtype=np.uint8)
    first = [
        coded_groups(fast, np.ascontiguousarray(image))[-1][0][0] for image in (photo, words, noise)
    ]
    assert first == [fast.HAAR, fast.REPEATS, fast.STORED]
    atlas = np.full((512, 512, 3), 60, np.uint8)
    atlas[40:200, 50:210] = photo
    atlas[300:460, 300:460] = words
    finest, level = coded_groups(fast, atlas)[-1]
    assert finest[0] == fast.REPEATS
    assert len(finest) < 1.1 * len(coded_groups(fast, photo)[-1][0]) + 2000
    assert np.array_equal(level, atlas)


@pytest.mark.parametrize(
    "group", [b"", b"\0", b"\2\xff", b"\3", b"\4", b"\5", b"\6", b"\7", b"\1", b"\1\0", b"\4\xf0"]
)
def test_nonsense_is_refused(group: bytes) -> None:
    below = np.zeros((4, 4, 3), np.uint8)
    with pytest.raises(InputError, match="PTM-I112"):
        fast.decode_tile(group, below, (8, 8, 3))
    with pytest.raises(InputError, match="PTM-I112"):
        fast.decode_base(group, (8, 8, 3), BYTE)


def test_inflation_stops_at_the_size_of_the_level() -> None:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    bomb = packer.compress(bytes(50_000_000)) + packer.flush()
    with pytest.raises(InputError, match="PTM-I112"):
        fast.decode_base(b"\2" + bomb, (4, 4, 3), BYTE)
