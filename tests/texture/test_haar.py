"""The Haar coder: the compiled pass against its reference, in every mode."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture import build_pyramid
from ptmtools.texture.coders.haar import coder as haar
from ptmtools.texture.coders.haar.reference import decode_haar
from ptmtools.texture.coders.rans.reference import read_tables


def textured(height: int, width: int, components: int, seed: int = 0) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    ramp = np.stack([x * 2 + y * (c + 1) + 50 * (x > width // 2) for c in range(components)], 2)
    return np.clip(ramp + rng.integers(-4, 5, ramp.shape), 0, 255).astype(np.uint8)


def below_of(level: NDArray[np.uint8]) -> NDArray[np.uint8]:
    empty = np.zeros((level.shape[0] >> 1, level.shape[1] >> 1, level.shape[2]), np.uint8)
    return build_pyramid(level)[-2] if empty.size else empty


@pytest.mark.parametrize(
    ("height", "width", "components", "step"),
    [
        (9, 7, 1, 1),
        (12, 8, 3, 1),
        (33, 31, 2, 1),
        (21, 40, 4, 1),
        (68, 67, 3, 1),
        (66, 70, 3, 9),
        (1, 9, 3, 1),
        (8, 1, 2, 1),
    ],
)
def test_compiled_pass_agrees_with_the_reference(
    height: int, width: int, components: int, step: int
) -> None:
    level = textured(height, width, components) // step * step
    level[::11, ::13] = 255 - level[::11, ::13]
    below = below_of(level)
    group = haar.encode(level, below)
    np.testing.assert_array_equal(decode_haar(group, below, level.shape), level)
    np.testing.assert_array_equal(haar.decode(group, below, level.shape), level)


def test_the_reference_has_seen_every_mode() -> None:
    """The case above with 66 × 70 texels sends ranks; this one sends weights and tables."""
    level = textured(200, 210, 1)
    level[::11, ::13] = 255 - level[::11, ::13]
    below = below_of(level)
    group = haar.encode(level, below)
    assert group[0] == haar.SENT_WEIGHTS
    tables, _ = read_tables(group, 1 + 26, 29)
    assert len({tuple(table) for table in tables}) > 3
    np.testing.assert_array_equal(decode_haar(group, below, level.shape), level)


@settings(deadline=None, max_examples=150)
@given(position=st.floats(0, 1, exclude_max=True), value=st.integers(0, 255), cut=st.booleans())
def test_a_damaged_group_is_an_error_or_an_image(position: float, value: int, cut: bool) -> None:
    """Behind a right checksum too, whatever stands in a group must not lead outside the arrays."""
    level = textured(37, 41, 3) // 5 * 5
    below = below_of(level)
    group = bytearray(haar.encode(level, below))
    at = int(position * len(group))
    group[at] = value
    if cut:
        del group[at:]
    codes, found = [], None
    try:
        found = haar.decode(bytes(group), below, level.shape)
    except InputError as error:
        codes.append(error.code)
    assert codes == ["PTM-I112"] or (found is not None and found.shape == level.shape)


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
