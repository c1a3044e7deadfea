"""Profile `raw`: by hand, and exactly for every bit pattern of every kind."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.errors import InputError
from ptmtools.texture.profiles import raw
from ptmtools.texture.profiles.raw import group_length
from ptmtools.texture.pyramid import mean_below
from ptmtools.texture.samples import KINDS
from tests.texture.coding import coded_groups

DTYPES = [np.dtype(name) for name in KINDS]


@settings(deadline=None, max_examples=60)
@given(
    exponents=st.tuples(st.integers(-44, 38), st.integers(-44, 38)),
    seed=st.integers(0, 2**32 - 1),
    signed=st.booleans(),
    dtype=st.sampled_from([np.dtype(np.float16), np.dtype(np.float32)]),
)
def test_any_range_of_floats(
    exponents: tuple[int, int], seed: int, signed: bool, dtype: np.dtype
) -> None:
    rng = np.random.default_rng(seed)
    values = 10.0 ** rng.uniform(min(exponents), max(exponents), (18, 21, 3))
    values *= np.where(signed & (rng.random(values.shape) < 0.5), -1, 1)
    with np.errstate(over="ignore"):
        coded_groups(raw, values.astype(dtype))


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
@pytest.mark.parametrize("shape", [(1, 5, 1), (5, 1, 2), (1, 1, 4), (3, 2, 1)])
def test_tiles_with_nothing_below(dtype: np.dtype, shape: tuple[int, int, int]) -> None:
    level = np.arange(int(np.prod(shape))).reshape(shape).astype(dtype)
    below = mean_below(level)
    tile = raw.encode_tile(level, below)
    np.testing.assert_array_equal(raw.decode_tile(tile.data, below, shape).texels, level)


def test_sixteen_bits_by_hand() -> None:
    """Two blocks and an odd column: remainders, then little-endian samples without s."""
    level = np.array([[1, 2, 300, 65535, 7], [4, 4, 65535, 65535, 8]], np.uint16)[:, :, None]
    below = mean_below(level)
    assert below.reshape(-1).tolist() == [2, (300 + 3 * 65535) // 4]
    residuals = 11 % 4 | (300 + 3 * 65535) % 4 << 2
    samples = struct.pack("<8H", 1, 2, 300, 65535, 7, 4, 65535, 8)
    assert raw.encode_tile(level, below).data == bytes([residuals]) + samples


def test_floats_by_hand() -> None:
    """s as the formula says; one unit above it; three below it, which is an escape."""
    one, unit = 1.0, 2.0**-23
    below = np.ones((1, 3, 1), np.float32)
    level = np.ones((2, 6, 1), np.float32)
    level[1, 3] = one + unit
    level[1, 5] = one - 3 * unit / 2
    samples = struct.pack("<9f", *[1.0] * 9)
    data = raw.encode_tile(level, below).data
    # Codes 0, 2 (+1), 3 (escape); -3 is 5 in zigzag, of which 3 is told by the code.
    assert data == bytes([0 | 2 << 2 | 3 << 4]) + samples + bytes([5 - 3])
    np.testing.assert_array_equal(raw.decode_tile(data, below, level.shape).texels, level)


def test_where_the_formula_is_no_number_the_texel_to_the_left_stands_in() -> None:
    level = np.array([[np.inf, 5], [2, 2]], np.float16)[:, :, None]
    level[0, 1] = np.nan
    data = raw.encode_tile(level, mean_below(level)).data
    assert data[0] == 0
    assert len(data) == 7


@pytest.mark.parametrize(
    ("name", "share"), [("uint8", 12), ("uint16", 24)], ids=["eight bits", "sixteen bits"]
)
def test_what_residuals_cost(name: str, share: int) -> None:
    """1/12 of an image of 8 bits (the paper's 6 % of the pyramid), 1/24 of one of 16."""
    image = np.zeros((256, 256, 3), name)
    groups = coded_groups(raw, image)
    total = sum(len(data) for data, _ in groups)
    for data, level in groups[1:]:
        assert len(data) == group_length(level.shape, level.dtype)
    assert 0 <= total - image.nbytes * (1 + 1 / share) <= 16


def test_floats_of_like_magnitude_cost_little_more_than_three_bits_a_block() -> None:
    level = np.random.default_rng(1).uniform(1, 4, (128, 128, 1)).astype(np.float32)
    data = raw.encode_tile(level, mean_below(level)).data
    extra = 8 * (len(data) - 3 * level.nbytes / 4) / (64 * 64)
    assert 2 < extra < 3.4


@pytest.mark.parametrize("escapes", [b"\xff\xff\xff\xff\xff\xff\x7f", b"\x88", b"\x11\x11", b""])
def test_impossible_escapes_are_refused(escapes: bytes) -> None:
    below = np.ones((1, 1, 1), np.float32)
    data = bytes([3]) + struct.pack("<3f", 1, 1, 1)
    with pytest.raises(InputError, match="PTM-I112"):
        raw.decode_tile(data + escapes, below, (2, 2, 1))
