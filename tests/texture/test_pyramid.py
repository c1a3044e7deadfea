"""Levels of every kind of sample: floors, means rounded once, and what is no number."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ptmtools.texture import pyramid
from ptmtools.texture.pyramid import build_pyramid, level_sizes, mean_below
from ptmtools.texture.samples import KINDS, KINDS_BY_NUMBER, from_ordered, kind_of, to_ordered

FLOATS = [np.dtype(name) for name in ("float16", "float32")]


def block(values: list[Any], dtype: Any) -> NDArray[Any]:
    return np.array(values, dtype).reshape(2, 2, 1)


@given(st.lists(st.integers(0, 65535), min_size=4, max_size=4))
def test_integers_are_floored(values: list[int]) -> None:
    assert mean_below(block(values, np.uint16)).item() == sum(values) // 4
    small = [v & 255 for v in values]
    assert mean_below(block(small, np.uint8)).item() == sum(small) // 4


def nearest(exact: Fraction, dtype: np.dtype) -> Any:
    """The float of that type nearest to a fraction, half to even, without any arithmetic of it."""
    numbers = np.arange(1 << 16, dtype=np.uint16)
    all_ = from_ordered(numbers, dtype)
    finite = all_[np.isfinite(all_)]
    low = max(i for i in range(len(finite)) if i == 0 or Fraction(float(finite[i])) <= exact)
    if low == len(finite) - 1:
        return finite[low]
    a, b = finite[low], finite[low + 1]
    below, above = exact - Fraction(float(a)), Fraction(float(b)) - exact
    if below == above:
        return a if int(a.view(np.uint16)) % 2 == 0 else b
    return a if below < above else b


@settings(deadline=None, max_examples=25)
@given(st.lists(st.integers(0, 0xFFFF), min_size=4, max_size=4))
def test_halves_are_rounded_once(patterns: list[int]) -> None:
    level = np.array(patterns, np.uint16).view(np.float16).reshape(2, 2, 1)
    actual = mean_below(level).reshape(-1)
    if np.isfinite(level).all():
        exact = sum((Fraction(float(v)) for v in level.reshape(-1)), Fraction()) / 4
        assert float(actual[0]) == float(nearest(exact, np.dtype(np.float16)))


@given(st.lists(st.floats(width=32, allow_nan=False, allow_infinity=False), min_size=4, max_size=4))
def test_singles_are_summed_in_float64_in_order_and_rounded_once(values: list[float]) -> None:
    a, b, c, d = values
    expected = np.float32(((a + b) + (c + d)) * 0.25)
    actual = mean_below(block(values, np.float32)).reshape(-1)
    assert actual.view(np.uint32) == np.array([expected]).view(np.uint32)
    assert np.isfinite(actual).all()


def test_the_order_of_the_sum_is_that_of_the_rows() -> None:
    """2^60 + 1 loses the 1 in float64: only p + q and r + s keep what stands beside it."""
    big = float(2**60)
    assert mean_below(block([big, -big, 1, 1], np.float32)).item() == 0.5
    assert mean_below(block([big, 1, -big, 1], np.float32)).item() == 0
    assert mean_below(block([1, big, 1, -big], np.float32)).item() == 0


def test_rounding_goes_to_the_stored_type_at_once() -> None:
    """By way of a single, 1024.5 + 2^-26 would be a tie and go down to the even half."""
    assert mean_below(block([4096, 2, 2**-24, 0], np.float16)).item() == 1025
    assert mean_below(block([4096, 2, 0, 0], np.float16)).item() == 1024


@pytest.mark.parametrize("dtype", FLOATS, ids=str)
def test_extremes(dtype: np.dtype) -> None:
    info = np.finfo(dtype)
    top, tiny = info.max, info.smallest_subnormal
    inf, nan = np.inf, np.nan
    assert mean_below(block([top] * 4, dtype)).item() == top
    assert mean_below(block([-top, top, top, top], dtype)).item() == top / 2
    assert mean_below(block([tiny, tiny, 0, 0], dtype)).item() == 0
    assert mean_below(block([tiny, tiny, tiny, 0], dtype)).item() == tiny
    assert mean_below(block([inf, 1, 2, 3], dtype)).item() == inf
    assert mean_below(block([-inf, -inf, 2, 3], dtype)).item() == -inf
    assert np.signbit(mean_below(block([-0.0] * 4, dtype))).all()
    assert not np.signbit(mean_below(block([-0.0, 0.0, -0.0, -0.0], dtype))).any()
    quiet = {2: 0x7E00, 4: 0x7FC00000}[dtype.itemsize]
    assert kind_of(dtype).quiet_nan == quiet
    unsigned = np.dtype(f"u{dtype.itemsize}")
    odd = block([quiet + 5] * 4, unsigned).view(dtype)
    negative = block([quiet | 1 << (8 * dtype.itemsize - 1), 0, 0, 0], unsigned).view(dtype)
    for level in (odd, negative, block([inf, -inf, 0, 0], dtype), block([nan, 1, 1, 1], dtype)):
        assert mean_below(level).view(unsigned).item() == quiet


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("shape", [(2, 2), (7, 5, 3), (64, 33, 4), (31, 64, 1)])
def test_strips_change_nothing(
    name: str, shape: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    size = int(np.prod(shape)) * KINDS[name].size
    level = np.frombuffer(np.random.default_rng(1).bytes(size), name).reshape(shape)
    whole = mean_below(level)
    assert whole.shape == (shape[0] >> 1, shape[1] >> 1, *shape[2:])
    for samples in (1, 40, 1000):
        monkeypatch.setattr(pyramid, "STRIP_SAMPLES", samples)
        assert mean_below(level).tobytes() == whole.tobytes()


class Rows:
    """A source that only has rows, and notes how many were asked for at once."""

    def __init__(self, image: NDArray[Any]) -> None:
        self._image = image
        self.shape = image.shape
        self.dtype = image.dtype
        self.most = 0

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        self.most = max(self.most, len(range(*rows.indices(self.shape[0]))))
        return self._image[rows]


def test_any_source_of_rows_will_do(tmp_path: Any) -> None:
    image = np.random.default_rng(2).integers(0, 65536, (2048, 300, 3)).astype(np.uint16)
    expected = build_pyramid(image)
    source = Rows(image)
    actual = build_pyramid(source)
    assert actual[-1] is source
    for one, other in zip(actual[:-1], expected[:-1], strict=True):
        np.testing.assert_array_equal(one, other)
    assert source.most <= pyramid.STRIP_SAMPLES // (300 * 3)
    mapped = np.memmap(tmp_path / "image", np.uint16, "w+", shape=image.shape)
    mapped[:] = image
    np.testing.assert_array_equal(build_pyramid(mapped)[0], expected[0])


def test_sizes() -> None:
    assert level_sizes(20, 6) == [(5, 1), (10, 3), (20, 6)]
    assert level_sizes(20, 6, 3) == [(10, 3), (20, 6)]
    assert level_sizes(1, 9) == [(1, 9)]
    image = np.zeros((37, 100), np.float32)
    assert [(b, a) for a, b in (level.shape for level in build_pyramid(image, 4))] == level_sizes(
        100, 37, 4
    )


@pytest.mark.parametrize("name", KINDS)
def test_ordered_integers_keep_every_bit_and_the_order(name: str) -> None:
    kind = KINDS[name]
    assert KINDS_BY_NUMBER[kind.number] is kind
    step = 1 if kind.size < 4 else 65521
    patterns = np.arange(0, kind.top + 1, step, dtype=np.int64).astype(f"u{kind.size}")
    samples = patterns.view(name)
    ordered = to_ordered(samples)
    assert from_ordered(ordered, samples.dtype).tobytes() == samples.tobytes()
    assert len(np.unique(ordered)) == len(patterns)
    numbers = samples[~np.isnan(samples)] if kind.is_float else samples
    by_value = np.sort(to_ordered(numbers))
    values = from_ordered(by_value, samples.dtype).astype(np.float64)
    assert (np.diff(values) >= 0).all()
    if kind.is_float:
        zero = to_ordered(np.array([-0.0, 0.0], name)).tolist()
        assert zero[1] == zero[0] + 1
        one = np.array([1], name)
        assert to_ordered(np.nextafter(one, one * 2)) == to_ordered(one) + 1


def test_foreign_byte_order_and_other_types_are_no_kind() -> None:
    for dtype in (">u2", ">f4", "i2", "f8", "u4", "?"):
        with pytest.raises(KeyError):
            kind_of(np.dtype(dtype))


@pytest.mark.parametrize(
    ("size", "coarsest", "levels"),
    [
        ((1, 1), (1, 1), 1),
        ((4096, 1), (4096, 1), 1),
        ((1, 7), (1, 7), 1),
        ((4096, 16), (256, 1), 5),
    ],
)
def test_levels_of_strips_stop_at_a_shorter_side_of_1(
    size: tuple[int, int], coarsest: tuple[int, int], levels: int
) -> None:
    sizes = level_sizes(*size)
    assert (sizes[0], len(sizes)) == (coarsest, levels)
    built = build_pyramid(np.zeros((size[1], size[0], 1), np.uint8))
    assert [level.shape[1::-1] for level in built] == sizes
