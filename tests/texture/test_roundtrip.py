"""decode(encode(x)) == x, at every level, bit for bit; or within the allowed error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
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
from ptmtools.texture.samples import KINDS

Samples = NDArray[Any]
PROFILES = ("raw", "fast", "small")
SIDES = 67


def assert_every_level(
    image: Samples, profile: str, one_by_one: bool = False, **options: int
) -> bytes:
    chosen = EncodeOptions(profile, **options)
    data = encode(image, chosen)
    expected = build_pyramid(image if image.ndim == 3 else image[:, :, None])
    actual = list(decode_levels(data))
    assert len(actual) == len(expected) == len(read_header(data).levels)
    for n, level in enumerate(expected):
        assert actual[n].shape == level.shape
        assert actual[n].dtype == level.dtype
        if chosen.max_error:
            errors = np.abs(actual[n].astype(np.int64) - level)
            assert errors.max() <= chosen.max_error, (n, errors.max())
        else:
            # As bytes: a NaN is not equal to itself.
            assert actual[n].tobytes() == level.tobytes(), n
        if one_by_one:
            assert decode(data, n).tobytes() == actual[n].tobytes()
    return data


def canvas() -> NDArray[np.uint8]:
    rng = np.random.default_rng(4)
    y, x = np.mgrid[:SIDES, :SIDES]
    smooth = np.stack([(2 * x + 3 * y + 40 * c) % 256 for c in range(4)], axis=2)
    return np.clip(smooth + rng.integers(-3, 4, smooth.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("profile", ["raw", "fast"])
@pytest.mark.parametrize("quarter", range(4))
def test_all_sizes_to_67(profile: str, quarter: int) -> None:
    """Every size, of large ones a third; the number of components goes round with it."""
    for height in range(1 + quarter, SIDES + 1, 4):
        for width in range(1, SIDES + 1):
            if min(height, width) > 24 and (height + width) % 3:
                continue
            components = 1 + (height // 4 + width) % 4
            assert_every_level(canvas()[:height, :width, :components], profile)


@pytest.mark.parametrize("components", [1, 2, 3, 4])
@pytest.mark.parametrize("profile", PROFILES)
def test_all_small_sizes_with_any_number_of_components(profile: str, components: int) -> None:
    step = 1 if profile != "small" else 2
    for height in range(1, 21, step):
        for width in range(1, 21, step):
            image = canvas()[:height, :width, :components]
            if width % 2:
                image[: height // 2] = 7
            assert_every_level(image, profile)


#: NaNs with payloads, infinities, denormals, negative zeros, and others at the edge of something.
SPECIAL = (0, 1, 0x7C00, 0xFC00, 0x7E01, 0xFE00, 0x8000, 0x7BFF, 0x3C00, 0x7F800000, 0xFF800000)
SPECIAL += (0x7FC00123, 0x80000000, 0x7F7FFFFF, 0x3F800000)


@st.composite
def images(draw: st.DrawFn, most: int = 40) -> Samples:
    """Any bits of any kind."""
    kind = KINDS[draw(st.sampled_from(sorted(KINDS)))]
    shape = st.tuples(st.integers(1, most), st.integers(1, most), st.integers(1, 4))
    bits = np.dtype(f"u{kind.size}")
    elements = st.integers(0, kind.top) | st.sampled_from([v for v in SPECIAL if v <= kind.top])
    return draw(arrays(bits, shape, elements=elements)).view(kind.name)


@pytest.mark.parametrize("profile", PROFILES)
@settings(deadline=None, max_examples=120)
@given(image=images())
def test_anything(profile: str, image: Samples) -> None:
    assert_every_level(image, profile, one_by_one=True)


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    height=st.integers(2, 90),
    width=st.integers(2, 90),
    components=st.integers(1, 4),
    grain=st.sampled_from([0, 1, 4, 30, 255]),
    step=st.sampled_from([1, 2, 7, 85, 255]),
    profile=st.sampled_from(["fast", "small"]),
    max_error=st.sampled_from([0, 0, 1, 2, 7, 100, 255]),
    wide=st.booleans(),
)
def test_textures_of_many_kinds(
    seed: int,
    height: int,
    width: int,
    components: int,
    grain: int,
    step: int,
    profile: str,
    max_error: int,
    wide: bool,
) -> None:
    """Flat, smooth, grainy, of few values: what makes the encoder choose differently."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    slope = rng.integers(-3, 4, (2, components))
    values = 128 + np.multiply.outer(x, slope[0]) + np.multiply.outer(y, slope[1])
    values = values + rng.integers(-grain, grain + 1, values.shape)
    image = (np.clip(values, 0, 255) // step * step).astype(np.uint8)
    if wide:
        assert_every_level(image.astype(np.uint16) * 257, profile, max_error=max_error * 100)
    else:
        assert_every_level(image, profile, max_error=max_error)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_floats_of_every_magnitude(profile: str, dtype: str) -> None:
    limits = np.finfo(dtype)
    rng = np.random.default_rng(5)
    powers = rng.uniform(np.log2(limits.smallest_subnormal), np.log2(limits.max), (40, 37, 2))
    image = (np.exp2(powers.astype(np.float64)) * rng.choice([-1, 1], powers.shape)).astype(dtype)
    assert_every_level(image, profile)
    image[::5, ::3] = np.nan
    image[1::7, ::4] = np.inf
    image[2::7, ::4] = -np.inf
    image[3::5, 1::4] = -0.0
    assert_every_level(image, profile)


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
def test_any_memory_layout(profile: str, view: Callable[[Samples], Samples]) -> None:
    image = np.arange(60 * 50 * 3, dtype=np.int64).reshape(60, 50, 3) * 7 // 11 % 256
    seen = view(image.astype(np.uint8))
    seen.flags.writeable = False
    assert_every_level(seen, profile)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("max_error", [0, 3])
def test_tiles(profile: str, max_error: int) -> None:
    if profile == "raw" and max_error:
        return
    for height, width in ((64, 96), (67, 35), (33, 34)):
        image = canvas()[:height].repeat(2, axis=1)[:, :width, :3]
        assert_every_level(image, profile, tile=16, max_error=max_error)


@pytest.mark.parametrize("profile", ["raw", "fast"])
def test_every_shared_texture(shared: Path, profile: str) -> None:
    files = sorted((shared / "textures").glob("*.png"))
    assert files
    total = {"ptm": 0, "png": 0}
    for file in files:
        data = assert_every_level(read_image(file), profile)
        total["ptm"] += len(data)
        total["png"] += file.stat().st_size
    # Loose on purpose: it fails when a coder stops working, not when it gets a little worse.
    assert total["ptm"] < (0.85 if profile == "fast" else 3.0) * total["png"]


def test_a_shared_texture_in_the_smallest_profile(shared: Path) -> None:
    for name in ("kodim05.png", "ldr-xy-normal1.png"):
        image = read_image(shared / "textures" / name)[:300, :300]
        small, fast = (assert_every_level(image, profile) for profile in ("small", "fast"))
        assert len(small) < 0.95 * len(fast)


def test_a_pyramid_is_the_floor_of_the_means() -> None:
    image = np.array([[1, 2, 9], [3, 5, 9], [9, 9, 9]], np.uint8)
    below, same = build_pyramid(image)
    assert below.tolist() == [[(1 + 2 + 3 + 5) // 4]]
    np.testing.assert_array_equal(same, image)
    sizes = [level.shape for level in build_pyramid(np.zeros((6, 20, 2), np.uint8))]
    assert sizes == [(1, 5, 2), (3, 10, 2), (6, 20, 2)]
