"""The texel coder: exact, within its error, alike in two implementations, safe on damaged bytes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture.coders import (
    rans as tables,
    texel as coder,
    texel_kernels as kernels,
    texel_layout as layout,
    texel_layout as numbering,
)
from ptmtools.texture.profiles.raw import group_length
from ptmtools.texture.pyramid import build_pyramid, mean_below
from ptmtools.texture.samples import KINDS, from_ordered, round_to, to_ordered
from tests.texture.oracles import texel as reference

DTYPES = [np.dtype(name) for name in KINDS]
WIDE = [np.dtype(name) for name in ("uint16", "float16", "float32")]
FLOATS = [np.dtype(name) for name in ("float16", "float32")]
INTEGERS = [np.dtype(name) for name in ("uint8", "uint16")]


def smooth(height: int, width: int, components: int, dtype: np.dtype, seed: int = 5) -> NDArray:
    """Slopes, a bright spot and some noise."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    planes = [(0.2 + 0.3 * c) * x / width + 0.4 * y / height + 0.1 for c in range(components)]
    image = np.stack(planes, axis=2) * (1 + 0.02 * rng.standard_normal((height, width, 1)))
    image[height // 4 : height // 3, width // 3 : width // 2] *= 2.5
    if dtype.kind == "u":
        return np.clip(image * np.iinfo(dtype).max / 3, 0, np.iinfo(dtype).max).astype(dtype)
    return ((image - 0.2) * 300).astype(dtype)


def bits(array: NDArray) -> bytes:
    return np.ascontiguousarray(array).tobytes()


def assert_exact(level: NDArray) -> bytes:
    below = mean_below(level)
    data, texels = coder.encode(level, below)
    actual = coder.decode(data, below, level.shape)
    assert bits(texels) == bits(level)
    assert actual.dtype == level.dtype
    assert bits(actual) == bits(level)
    return data


def assert_within(level: NDArray, below: NDArray, max_error: int) -> tuple[bytes, NDArray]:
    data, texels = coder.encode(level, below, max_error)
    actual = coder.decode(data, below, level.shape, max_error)
    assert bits(actual) == bits(texels)
    assert int(np.abs(actual.astype(np.int64) - level).max()) <= max_error
    return data, actual


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (2, 2), (3, 2), (5, 7), (37, 40), (66, 65)])
def test_every_size_and_kind(dtype: np.dtype, shape: tuple[int, int]) -> None:
    for components in range(1, 5):
        assert_exact(smooth(*shape, components, dtype))


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    height=st.integers(2, 70),
    width=st.integers(2, 70),
    components=st.integers(1, 4),
    dtype=st.sampled_from(DTYPES),
    coarse=st.sampled_from([1, 4, 257, 8192]),
)
def test_images_of_many_kinds(
    seed: int, height: int, width: int, components: int, dtype: np.dtype, coarse: int
) -> None:
    """Of full precision, on a lattice, of few values: what the encoder numbers differently."""
    values = to_ordered(smooth(height, width, components, dtype, seed))
    level = values.astype(np.int64) // coarse * coarse
    level = from_ordered(level.astype(values.dtype), dtype)
    for one in build_pyramid(np.ascontiguousarray(level)):
        assert_exact(one)


@pytest.mark.parametrize("dtype", INTEGERS, ids=str)
@pytest.mark.parametrize("share", [0, 1, 2, 8, 64, 255])
def test_the_error_is_bounded_at_every_level(dtype: np.dtype, share: int) -> None:
    """Closed loop: what is below is itself only near the mean; at last even any error goes."""
    top = int(np.iinfo(dtype).max)
    max_error = max(1, top * share // 255)
    rng = np.random.default_rng(7)
    noise = rng.integers(0, top + 1, (45, 38, 3)).astype(dtype)
    for image in (smooth(67, 90, 4, dtype), noise, np.full((64, 64, 3), top, dtype)):
        coarsest, *levels = build_pyramid(image)
        below = np.ascontiguousarray(coarsest)
        for level in levels:
            _, below = assert_within(level, below, max_error)


def test_an_error_makes_files_much_smaller() -> None:
    level = smooth(256, 256, 3, np.dtype(np.uint8)) // 2
    noise = np.random.default_rng(2).integers(-9, 10, level.shape)
    level = np.clip(level.astype(np.int64) + 60 + noise, 0, 255).astype(np.uint8)
    below = mean_below(level)
    sizes = [len(coder.encode(level, below, d)[0]) for d in (0, 1, 2, 4, 8, 16)]
    assert all(next_ < 0.9 * size for size, next_ in pairwise(sizes))
    assert sizes[-1] < 0.12 * sizes[0]


#: An error can be allowed for integers only.
EXACT = [(dtype, 0) for dtype in DTYPES]
ROUGH = [(dtype, max_error) for dtype in INTEGERS for max_error in (1, 3, 20)]


@pytest.mark.parametrize(("dtype", "max_error"), EXACT + ROUGH, ids=str)
@pytest.mark.parametrize("shape", [(9, 7, 1), (24, 31, 3), (21, 18, 4), (52, 50, 2)])
def test_compiled_pass_agrees_with_the_reference(
    dtype: np.dtype, shape: tuple[int, int, int], max_error: int
) -> None:
    assert_reference(smooth(*shape, dtype), max_error)


@pytest.mark.parametrize("dtype", WIDE, ids=str)
def test_the_reference_sees_every_numbering(dtype: np.dtype) -> None:
    """One component each on a lattice, from a list, on a grid with exceptions, of any values."""
    rng = np.random.default_rng(3)
    fine = to_ordered(smooth(64, 72, 4, dtype)).astype(np.int64)
    one, two, three, _ = np.moveaxis(fine, 2, 0)
    fine[:, :, 0] = one // 64 * 64 + 5
    palette = np.sort(rng.choice(fine[:, :, 1].reshape(-1), 40, replace=False))
    fine[:, :, 1] = palette[np.searchsorted(palette[:-1], two)]
    fine[:, :, 2] = np.where(rng.random(three.shape) < 0.98, three // 128 * 128, three)
    level = from_ordered(fine.astype(f"u{dtype.itemsize}"), dtype)
    data = assert_reference(level)
    assert data[1] == (
        numbering.LATTICE | numbering.LIST << 2 | numbering.GRID << 4 | numbering.ITSELF << 6
    )


def assert_reference(level: NDArray, max_error: int = 0) -> bytes:
    below = mean_below(level)
    data, texels = coder.encode(level, below, max_error)
    if data[0] in (coder.CODED, coder.CODED_WITH_WEIGHTS):
        actual = reference.decode_texels(data, below, level.shape, max_error)
        assert bits(actual) == bits(texels)
    assert bits(coder.decode(data, below, level.shape, max_error)) == bits(texels)
    return data


def test_the_reference_sees_sent_weights_and_tables() -> None:
    level = smooth(96, 100, 1, np.dtype(np.uint16))
    level[::17, ::13] ^= 0x7FFF
    data = assert_reference(level)
    assert data[0] == coder.CODED_WITH_WEIGHTS


def test_built_in_tables_are_those_of_the_specification() -> None:
    family = layout.table_family().tables
    assert len(family) == 1 + 7 + 71
    for kind, row in enumerate(family[1:], start=1):
        assert row.tolist() == reference.built_in(kind)
    assert (family[1:].sum(axis=1) == tables.TABLE_SIZE).all()


def test_tokens_cover_every_number_once() -> None:
    first = 0
    for token in range(layout.TOKENS):
        low, count = layout.token_span(token)
        assert low == first
        first += count
    assert first >= 1 << 33


@settings(deadline=None, max_examples=300)
@given(st.integers(0, 2**16 - 1), st.floats(allow_nan=False))
def test_halves_and_singles_as_integers(pattern: int, value: float) -> None:
    half = np.array([pattern], np.uint16).view(np.float16)
    number = int(to_ordered(half)[0])
    np.testing.assert_equal(kernels.float_value(number, kernels.HALF), np.float64(half[0]))
    for dtype, kind in zip(FLOATS, (kernels.HALF, kernels.SINGLE), strict=True):
        rounded = round_to(np.array([value]), dtype)
        assert int(kernels.ordered_value(value, kind)) == int(to_ordered(rounded)[0])
        again = kernels.float_value(int(to_ordered(rounded)[0]), kind)
        np.testing.assert_equal(again, np.float64(rounded[0]))


@pytest.mark.parametrize("dtype", WIDE, ids=str)
def test_noise_costs_no_more_than_raw_or_plain(dtype: np.dtype) -> None:
    shape = (64, 64, 3)
    rng = np.random.default_rng(0)
    level = np.frombuffer(rng.bytes(int(np.prod(shape)) * dtype.itemsize), dtype).reshape(shape)
    data = assert_exact(level)
    assert len(data) <= 1 + level.nbytes
    if dtype == np.uint16:
        assert len(data) <= 1 + group_length(shape, dtype)


@pytest.mark.parametrize("dtype", WIDE, ids=str)
def test_flat_images_and_masks_are_small(dtype: np.dtype) -> None:
    flat = np.full((256, 256, 4), 0.25 if dtype.kind == "f" else 9000, dtype)
    assert len(assert_exact(flat)) < 80
    y, x = np.mgrid[:256, :256]
    disc = ((x - 128) ** 2 + (y - 128) ** 2 < 9000)[:, :, None]
    mask = disc.astype(dtype) if dtype.kind == "f" else disc.astype(dtype) * 65535
    assert len(assert_exact(mask)) < 300


def test_widened_bytes_cost_like_bytes() -> None:
    narrow = smooth(128, 128, 3, np.dtype(np.uint8))
    bytes_ = len(coder.encode(narrow, mean_below(narrow))[0])
    for wide in (narrow.astype(np.uint16) * 257, (narrow / 255).astype(np.float32)):
        assert len(assert_exact(wide)) < 1.15 * bytes_ + 700


def test_a_level_below_that_is_no_mean_costs_more_and_nothing_else() -> None:
    level = smooth(32, 32, 3, np.dtype(np.uint16))
    below = mean_below(level) + np.uint16(900)
    data, _ = coder.encode(level, below)
    assert data[0] in (coder.RAW, coder.PLAIN)
    if data[0] == coder.PLAIN:
        assert bits(coder.decode(data, below, level.shape)) == bits(level)


@settings(deadline=None, max_examples=200)
@given(body=st.binary(max_size=200), form=st.integers(0, 5), dtype=st.sampled_from(DTYPES))
def test_nonsense_is_refused(body: bytes, form: int, dtype: np.dtype) -> None:
    below = np.zeros((4, 4, 3), dtype)
    with pytest.raises(InputError, match="PTM-I112"):
        coder.decode(bytes([form]) + body, below, (8, 8, 3))


def test_empty_bytes_are_refused() -> None:
    with pytest.raises(InputError, match="PTM-I112"):
        coder.decode(b"", np.zeros((1, 1, 1), np.uint16), (2, 2, 1))
