"""decode(encode(x)) == x, at every level."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from ptmtools.texture import (
    EncodeOptions,
    build_pyramid,
    decode,
    decode_levels,
    encode,
    read_header,
    read_image,
)

PROFILES = ("raw", "fast")
SIDES = 67


def assert_every_level(image: NDArray[np.uint8], profile: str, one_by_one: bool = False) -> bytes:
    data = encode(image, EncodeOptions(profile))
    expected = build_pyramid(image if image.ndim == 3 else image[:, :, None])
    found = list(decode_levels(data))
    assert len(found) == len(expected) == len(read_header(data).levels)
    for n, level in enumerate(expected):
        np.testing.assert_array_equal(found[n], level)
        if one_by_one:
            np.testing.assert_array_equal(decode(data, n), level)
    return data


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("quarter", range(4))
def test_all_sizes_to_67(profile: str, quarter: int) -> None:
    """Every size; the number of components goes round with it."""
    rng = np.random.default_rng(4)
    y, x = np.mgrid[:SIDES, :SIDES]
    smooth = np.stack([(2 * x + 3 * y + 40 * c) % 256 for c in range(4)], axis=2)
    canvas = np.clip(smooth + rng.integers(-3, 4, smooth.shape), 0, 255).astype(np.uint8)
    for height in range(1 + quarter, SIDES + 1, 4):
        for width in range(1, SIDES + 1):
            components = 1 + (height // 4 + width) % 4
            assert_every_level(canvas[:height, :width, :components], profile)


@settings(deadline=None, max_examples=80)
@given(
    image=arrays(
        np.uint8,
        st.tuples(st.integers(1, 40), st.integers(1, 40), st.integers(1, 4)),
        elements=st.integers(0, 255),
    ),
    profile=st.sampled_from(PROFILES),
)
def test_anything(image: NDArray[np.uint8], profile: str) -> None:
    assert_every_level(image, profile, one_by_one=True)


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    height=st.integers(2, 90),
    width=st.integers(2, 90),
    components=st.integers(1, 4),
    grain=st.sampled_from([0, 1, 4, 30, 255]),
    step=st.sampled_from([1, 2, 7, 85, 255]),
)
def test_textures_of_many_kinds(
    seed: int, height: int, width: int, components: int, grain: int, step: int
) -> None:
    """Flat, smooth, grainy, of few values: what makes the encoder choose differently."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    slope = rng.integers(-3, 4, (2, components))
    values = 128 + np.multiply.outer(x, slope[0]) + np.multiply.outer(y, slope[1])
    values = values + rng.integers(-grain, grain + 1, values.shape)
    image = (np.clip(values, 0, 255) // step * step).astype(np.uint8)
    assert_every_level(image, "fast")


@pytest.mark.parametrize(
    "view",
    [
        lambda image: image[:, :, 0],
        lambda image: image[::2, ::-1],
        lambda image: image.transpose(1, 0, 2),
        np.asfortranarray,
    ],
    ids=["grey without axis", "strided", "transposed", "Fortran order"],
)
@pytest.mark.parametrize("profile", PROFILES)
def test_any_memory_layout(profile: str, view: object) -> None:
    image = np.arange(60 * 50 * 3, dtype=np.int64).reshape(60, 50, 3) * 7 // 11 % 256
    seen = view(image.astype(np.uint8))  # type: ignore[operator]
    seen.flags.writeable = False
    assert_every_level(seen, profile)


@pytest.mark.parametrize("profile", PROFILES)
def test_every_shared_texture(shared: Path, profile: str) -> None:
    files = sorted((shared / "textures").glob("*.png"))
    assert files
    total = {"ptm": 0, "png": 0}
    for file in files:
        data = assert_every_level(read_image(file), profile)
        total["ptm"] += len(data)
        total["png"] += file.stat().st_size
    # Loose on purpose: it fails when a coder stops working, not when it gets a little worse.
    assert total["ptm"] < (0.9 if profile == "fast" else 3.0) * total["png"]


def test_min_side_and_max_side() -> None:
    image = np.random.default_rng(1).integers(0, 256, (100, 37, 3), dtype=np.uint8)
    pyramid = build_pyramid(image)
    data = encode(image, EncodeOptions("raw", min_side=5, max_side=60))
    header = read_header(data)
    assert [(level.width, level.height) for level in header.levels] == [(9, 25), (18, 50)]
    assert (header.width, header.height, header.trimmed) == (37, 100, 1)
    np.testing.assert_array_equal(decode(data, 0), pyramid[-3])
    np.testing.assert_array_equal(decode(data), pyramid[-2])


def test_a_pyramid_is_the_floor_of_the_means() -> None:
    image = np.array([[1, 2, 9], [3, 5, 9], [9, 9, 9]], np.uint8)
    below, same = build_pyramid(image)
    assert below.tolist() == [[(1 + 2 + 3 + 5) // 4]]
    np.testing.assert_array_equal(same, image)
    sizes = [level.shape for level in build_pyramid(np.zeros((6, 20, 2), np.uint8))]
    assert sizes == [(1, 5, 2), (3, 10, 2), (6, 20, 2)]
