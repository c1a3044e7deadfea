"""The two profiles: bytes by hand, the compiled passes against references, and no blow-ups."""

from __future__ import annotations

import os
import subprocess
import sys
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture import EncodeOptions, build_pyramid, encode, read_header
from ptmtools.texture.coders.haar import coder as haar
from ptmtools.texture.coders.haar import kernels, layout, tables
from ptmtools.texture.coders.haar.reference import decode_haar, normalised
from ptmtools.texture.profiles.fast import FastProfile
from ptmtools.texture.profiles.raw import RawProfile, group_length


def textured(height: int, width: int, components: int, seed: int = 0) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    ramp = np.stack([x * 2 + y * (c + 1) + 50 * (x > width // 2) for c in range(components)], 2)
    return np.clip(ramp + rng.integers(-4, 5, ramp.shape), 0, 255).astype(np.uint8)


# --- raw ------------------------------------------------------------------------------------


def test_raw_group_by_hand() -> None:
    level = np.array(
        [[10, 11, 20, 20], [12, 14, 20, 21], [0, 0, 255, 255], [0, 3, 255, 254]], np.uint8
    )[:, :, None]
    # Sums 47, 81, 3, 1019: means 11, 20, 0, 254; remainders 3, 1, 3, 3.
    below = np.array([[11, 20], [0, 254]], np.uint8)[:, :, None]
    residuals = 3 | 1 << 2 | 3 << 4 | 3 << 6
    partial = [10, 11, 20, 20, 12, 20, 0, 0, 255, 255, 0, 255]
    np.testing.assert_array_equal(build_pyramid(level)[-2], below)
    assert RawProfile().encode_group(level, below) == bytes([residuals, *partial])


def test_raw_file_by_hand() -> None:
    """A whole file of 3 × 2 texels in RGB, byte for byte."""
    level = np.array(
        [[[1, 2, 3], [5, 6, 7], [100, 101, 102]], [[2, 2, 2], [4, 4, 4], [103, 104, 105]]], np.uint8
    )
    # Sums 12, 14, 16: mean 3, 3, 4; remainders 0, 2, 0.
    base = bytes([3, 3, 4])
    group = bytes([0 | 2 << 2 | 0 << 4]) + bytes(
        [1, 2, 3, 5, 6, 7, 100, 101, 102, 2, 2, 2, 103, 104, 105]
    )
    size = 28 + 2 * 20 + 4
    head = b"\x89PTM\r\n\x1a\n" + bytes([1, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 3, 2, 0, 0])
    head += size.to_bytes(4, "little")
    for offset, data in ((size, base), (size + 3, group)):
        head += offset.to_bytes(8, "little") + len(data).to_bytes(8, "little")
        head += zlib.crc32(data).to_bytes(4, "little")
    head += zlib.crc32(head).to_bytes(4, "little")
    assert encode(level, EncodeOptions("raw")) == head + base + group


def test_raw_residuals_cost_one_twelfth() -> None:
    image = np.zeros((256, 256, 3), np.uint8)
    header = read_header(encode(image, EncodeOptions("raw")))
    payload = sum(level.length for level in header.levels)
    # One byte more than 13/12 in whole bytes: the smallest groups are rounded up.
    assert 0 <= payload - image.size * 13 / 12 <= 4


# --- fast -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("height", "width", "components", "step"),
    [(9, 7, 1, 1), (12, 8, 3, 1), (33, 31, 2, 1), (21, 40, 4, 1), (68, 67, 3, 1), (66, 70, 3, 9)],
)
def test_compiled_pass_agrees_with_the_reference(
    height: int, width: int, components: int, step: int
) -> None:
    level = textured(height, width, components) // step * step
    level[::11, ::13] = 255 - level[::11, ::13]
    below = build_pyramid(level)[-2]
    group = haar.encode(level, below)
    np.testing.assert_array_equal(decode_haar(group, below, level.shape), level)
    np.testing.assert_array_equal(haar.decode(group, below, level.shape), level)


def test_the_reference_has_seen_every_mode() -> None:
    """The case above with 66 × 70 texels sends weights and ranks; this one sends tables."""
    level = textured(128, 130, 1)
    level[::11, ::13] = 255 - level[::11, ::13]
    below = build_pyramid(level)[-2]
    group = haar.encode(level, below)
    assert group[0] == haar.SENT_WEIGHTS
    kinds = group[1 + 26 : 1 + 26 + layout.TABLES]
    assert tables.SENT in kinds
    assert any(0 < kind < tables.SENT for kind in kinds)
    np.testing.assert_array_equal(decode_haar(group, below, level.shape), level)


@settings(deadline=None, max_examples=60)
@given(
    counts=st.lists(
        st.integers(0, 5) | st.integers(0, 10**6) | st.integers(0, 2**40), min_size=1, max_size=256
    ).filter(any)
)
def test_normalised_frequencies(counts: list[int]) -> None:
    row = [*counts, *[0] * (256 - len(counts))]
    found = tables.normalise(np.array([row], np.int64))[0]
    assert found.tolist() == normalised(row)
    assert int(found.sum()) == tables.TABLE_SIZE
    assert ((found > 0) == (np.array(row) > 0)).all()


def test_built_in_tables_are_those_of_the_specification() -> None:
    for row, mean in zip(tables.built_in()[1:], tables.BUILT_IN_MEANS, strict=True):
        ratio = 65536 * mean // (16 + mean)
        weights = [1 << 24]
        for z in range(1, 255):
            weights.append(weights[-1] * ratio >> 16 if z % 2 else weights[-1])
        total = sum(weights)
        weights = [0 if 4096 * weight < total else weight for weight in weights]
        assert row.tolist() == normalised([*weights, sum(weights) >> 10])


@settings(deadline=None, max_examples=40)
@given(st.lists(st.lists(st.integers(0, 2000), min_size=256, max_size=256), max_size=4))
def test_tables_survive_their_serialised_form(rows: list[list[int]]) -> None:
    counts = np.zeros((layout.TABLES, 256), np.int64)
    for t, row in enumerate(rows):
        counts[7 * t] = row
    frequency, packed = tables.choose(counts)
    parsed, used = tables.parse(packed + b"more", layout.TABLES)
    np.testing.assert_array_equal(parsed, frequency)
    assert used == len(packed)


def test_the_length_table_is_a_logarithm() -> None:
    """Only tables are chosen by it; it must not be far off."""
    f = np.arange(1, tables.TABLE_SIZE + 1)
    exact = 256 * (tables.TABLE_BITS - np.log2(f))
    assert np.abs(tables._log_table()[1:] - exact).max() <= 1.5


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
    for level in read_header(encode(image)).levels:
        shape = (level.height, level.width, image.shape[2])
        assert level.length <= 1 + (
            group_length(shape) if min(shape[:2]) > 1 else int(np.prod(shape))
        )


def test_flat_and_repeating_images_are_small() -> None:
    flat = encode(np.full((512, 512, 3), 9, np.uint8))
    assert len(flat) < 1500
    repeats = np.tile(textured(16, 16, 3), (32, 32, 1))
    assert len(encode(repeats)) < 0.05 * repeats.size


@settings(deadline=None, max_examples=150)
@given(position=st.floats(0, 1, exclude_max=True), value=st.integers(0, 255), cut=st.booleans())
def test_a_damaged_group_is_an_error_or_an_image(position: float, value: int, cut: bool) -> None:
    """Behind a right checksum too, whatever stands in a group must not lead outside the arrays."""
    level = textured(37, 41, 3) // 5 * 5
    below = build_pyramid(level)[-2]
    group = bytearray(b"\1" + haar.encode(level, below))
    at = int(position * len(group))
    group[at] = value
    if cut:
        del group[at:]
    codes, found = [], None
    try:
        found = FastProfile().decode_group(bytes(group), below, level.shape)
    except InputError as error:
        codes.append(error.code)
    assert codes == ["PTM-I112"] or (found is not None and found.shape == level.shape)


@pytest.mark.parametrize("group", [b"", b"\0", b"\2\xff", b"\3", b"\4", b"\1", b"\1\0", b"\1\xf0"])
def test_nonsense_is_refused(group: bytes) -> None:
    below = np.zeros((4, 4, 3), np.uint8)
    with pytest.raises(InputError, match="PTM-I112"):
        FastProfile().decode_group(group, below, (8, 8, 3))


def test_inflation_stops_at_the_size_of_the_level() -> None:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    bomb = packer.compress(bytes(50_000_000)) + packer.flush()
    with pytest.raises(InputError, match="PTM-I112"):
        FastProfile().decode_base(b"\2" + bomb, (4, 4, 3))


def test_haar_differences_and_ranks_are_inverted_for_every_remainder() -> None:
    """All blocks of a small alphabet at once: 6^4 of them, by value and by rank."""
    alphabet = np.array([0, 1, 2, 127, 254, 255])
    corners = np.stack(np.meshgrid(*[alphabet] * 4, indexing="ij"), axis=-1).reshape(36, 36, 2, 2)
    level = corners.transpose(0, 2, 1, 3).reshape(72, 72, 1).astype(np.uint8)
    below = build_pyramid(level)[-2]
    for image in (level, level // 2 + 60):
        low = build_pyramid(image)[-2]
        np.testing.assert_array_equal(haar.decode(haar.encode(image, low), low, image.shape), image)
    assert haar.encode(level, below)[0] & haar.RANKED


SCRIPT = """
import hashlib, sys
import numpy as np
from ptmtools.texture import encode
y, x = np.mgrid[:150, :170]
image = np.stack([(x * y // 7 + 40 * c) % 251 for c in range(3)], 2).astype(np.uint8)
image[40:90, 30:99] = 200
print(hashlib.sha256(encode(image)).hexdigest())
"""


def test_other_processes_and_thread_counts_write_the_same_bytes() -> None:
    found = set()
    for threads in ("1", "4"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(names, threads), "PYTHONHASHSEED": threads}
        run = subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, check=True
        )
        found.add(run.stdout)
    assert len(found) == 1


def test_kernel_and_table_constants_agree() -> None:
    assert (kernels.TABLE_BITS, kernels.ESCAPE) == (tables.TABLE_BITS, tables.ESCAPE)
