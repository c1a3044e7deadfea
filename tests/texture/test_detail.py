"""Detail that each level adds, from the encoder, against decoded and enlarged levels."""

from __future__ import annotations

import io
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, decode_levels, encode_to, read_header
from ptmtools.texture.detail import Detail, difference_between, with_offset
from tests.output.texture_agreement import detail_of_levels

TYPES = (np.uint8, np.uint16, np.float16, np.float32)
OPTIONS = (
    {"tile": 16},
    {"tile": 16, "max_error": 6},
    {"min_side": 9},
    {"max_side": 40},
    {"max_level": 2},
)


def encoded(image: NDArray, **options: object) -> tuple[Detail, bytes]:
    file = io.BytesIO()
    detail = encode_to(file, image, EncodeOptions(**options))
    return detail, file.getvalue()


def enlarged(below: NDArray, height: int, width: int) -> NDArray[np.float64]:
    """Nearest: each texel over its block, and an odd last row or column from the block beside."""
    rows, columns = (
        np.minimum(np.arange(side) // 2, under - 1)
        for side, under in zip((height, width), below.shape[:2], strict=True)
    )
    return below[rows][:, columns].astype(np.float64)


def by_definition(data: bytes) -> list[float]:
    levels = list(decode_levels(data))
    colours = {1: 1, 2: 1, 3: 3, 4: 3}[levels[0].shape[2]]
    top = {"uint8": 255, "uint16": 65535}.get(levels[0].dtype.name, 1)
    actual = [0.0]
    for below, level in pairwise(levels):
        difference = (level - enlarged(below, *level.shape[:2]))[..., :colours]
        actual.append(float(np.sqrt(np.mean((difference * 255 / top) ** 2, axis=2)).mean()))
    return actual


def noise(height: int, width: int, components: int, dtype: type, seed: int = 0) -> NDArray:
    random = np.random.default_rng(seed)
    if np.dtype(dtype).kind == "f":
        return random.uniform(0, 3, (height, width, components)).astype(dtype)
    slope = np.linspace(0, 0.5, width)[None, :, None]
    texels = (slope + random.uniform(0, 0.5, (height, width, components))) * np.iinfo(dtype).max
    return texels.astype(dtype)


@given(
    st.integers(1, 40), st.integers(1, 40), st.integers(1, 4), st.sampled_from(TYPES), st.integers()
)
def test_the_differences_are_those_of_the_levels(
    height: int, width: int, components: int, dtype: type, seed: int
) -> None:
    detail, data = encoded(noise(height, width, components, dtype, abs(seed)))
    assert detail.differences == pytest.approx(by_definition(data), rel=5.1e-3)
    assert all(value == float(f"{value:.3g}") for value in detail.differences)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_tiles_errors_and_levels_left_out(options: dict[str, int], dtype: type) -> None:
    """Of what a decoder has, which an allowed error changes."""
    detail, data = encoded(noise(83, 101, 3, dtype), **options)
    assert len(detail.differences) == len(read_header(data).levels)
    assert detail.differences == pytest.approx(by_definition(data), rel=5.1e-3)
    of_levels = detail_of_levels(decode_levels(data))[0]
    assert of_levels.differences == detail.differences
    if "tile" in options:
        assert of_levels == detail
        return
    # What is left out counts.
    whole, count = encoded(noise(83, 101, 3, dtype))[0].offsets, len(detail.offsets)
    assert detail.offsets == (whole[-count:] if "min_side" in options else whole[:count])


def test_alpha_is_no_colour() -> None:
    image = noise(16, 16, 4, np.uint8)
    opaque = image.copy()
    opaque[..., 3] = 255
    assert encoded(image)[0] == encoded(opaque)[0]
    assert encoded(image[..., :3])[0] == encoded(image)[0]
    assert encoded(image[..., :2])[0] == encoded(image[..., :1])[0]


@given(st.integers(0, 5), st.integers(0, 5), st.integers(1, 4), st.integers(0))
def test_with_its_offset_a_level_is_as_bright_as_the_finest(
    high: int, wide: int, components: int, seed: int
) -> None:
    """Where each level has whole blocks of the next."""
    detail, data = encoded(noise(1 << high, 1 << wide, components, np.uint8, seed) // 2)
    colours = slice(components - (components in (2, 4)))
    levels = list(decode_levels(data))
    for level, offset in zip(levels, detail.offsets, strict=True):
        seen = with_offset(level, offset)
        missing = levels[-1][..., colours].mean() - seen[..., colours].mean()
        assert abs(missing) <= 0.5 + 1e-9
        assert (seen[..., components:] == level[..., components:]).all()


def test_offsets_of_flat_deep_and_odd_images() -> None:
    """A flat image loses nothing, 16 bits next to nothing; what odd sides leave out is no loss."""
    assert encoded(np.full((64, 64, 3), 200, np.uint8))[0].offsets == (0,) * 7
    assert not any(encoded(noise(64, 64, 3, np.uint16))[0].offsets)
    assert not any(encoded(noise(64, 64, 3, np.float32))[0].offsets)
    image = noise(65, 65, 3, np.uint8) // 2
    image[64:], image[:, 64:] = 255, 255
    assert encoded(image)[0].offsets == encoded(image[:64, :64])[0].offsets != (0,) * 7
    alone = encoded(noise(64, 64, 1, np.uint8), tile=16)[0].offsets
    assert alone == encoded(noise(64, 64, 1, np.uint8))[0].offsets


def test_offsets_stay_within_a_byte_and_off_alpha() -> None:
    level = np.array([[[250, 3, 254]]], np.uint8)
    assert with_offset(level, 0) is level
    assert with_offset(level, 3).tolist() == [[[253, 6, 255]]]
    assert with_offset(level, -4).tolist() == [[[246, 0, 250]]]
    assert with_offset(level[..., :2], 3).tolist() == [[[253, 3]]]


def test_the_colour_is_that_of_the_coarsest_level() -> None:
    image = noise(64, 32, 3, np.uint8)
    detail, data = encoded(image)
    (first, *_) = decode_levels(data)
    assert first.shape == (2, 1, 3)
    exact = image.astype(float).mean(axis=(0, 1)).mean() - first.mean()
    assert detail.color == tuple(np.floor(first.mean(axis=(0, 1)) + exact + 0.5).astype(int))
    assert encoded(np.full((4, 4, 1), 0x8080, np.uint16))[0].color == (128, 128, 128)
    assert encoded(np.full((4, 4, 3), (0, 0.5, 7), np.float32))[0].color == (0, 128, 255)


def test_what_is_not_finite_differs_from_nothing() -> None:
    level = np.ones((2, 2, 1), np.float32)
    level[0, 0] = np.nan
    level[0, 1] = 3
    assert difference_between(level, np.ones((1, 1, 1), np.float32)) == 2


@pytest.mark.parametrize("components", [1, 2, 3, 4])
def test_the_largest_differences_add_up(components: int) -> None:
    """2^20 times 65,535; of one colour to the last bit."""
    level = np.full((1024, 1024, components), 65535, np.uint16)
    actual = difference_between(level, np.zeros((512, 512, components), np.uint16))
    assert actual == pytest.approx(65535 * 2**20, rel=1e-12 if components > 2 else 0, abs=0)


@given(st.integers(0, 5), st.integers(0, 5), st.integers(1, 4), st.integers(0))
def test_who_has_a_level_is_off_by_no_more_than_the_rest_adds(
    high: int, wide: int, components: int, seed: int
) -> None:
    """Where each level has whole blocks of the next."""
    detail, data = encoded(noise(1 << high, 1 << wide, components, np.uint8, seed))
    colours = slice(components - (components in (2, 4)))
    *rest, finest = (level[..., colours] for level in decode_levels(data))
    for n, level in enumerate(rest):
        times = 1 << (len(rest) - n)
        shown = level.astype(np.float64).repeat(times, axis=0).repeat(times, axis=1)
        off = np.sqrt(((finest - shown) ** 2).mean(axis=2)).mean()
        assert off <= 1.006 * sum(detail.differences[n + 1 :])
