"""The Haar coder: the compiled pass against its reference, in every mode."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.texture.coders import haar
from ptmtools.texture.coders.group import GroupReader
from ptmtools.texture.pyramid import mean_below
from tests.texture.coding import textured
from tests.texture.oracles.haar import decode_haar
from tests.texture.oracles.rans import read_tables


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
    below = mean_below(level)
    group = haar.encode(level, below)
    np.testing.assert_array_equal(decode_haar(group, below, level.shape), level)
    np.testing.assert_array_equal(haar.decode(group, below, level.shape), level)


def test_the_reference_has_seen_every_mode() -> None:
    """The case above with 66 × 70 texels sends ranks; this one sends weights and tables."""
    level = textured(200, 210, 1)
    level[::11, ::13] = 255 - level[::11, ::13]
    below = mean_below(level)
    group = haar.encode(level, below)
    assert group[0] == haar.SENT_WEIGHTS
    tables = read_tables(GroupReader(group[1 + 26 :]), 29)
    assert len({tuple(table) for table in tables}) > 3
    np.testing.assert_array_equal(decode_haar(group, below, level.shape), level)


def test_haar_differences_and_ranks_are_inverted_for_every_remainder() -> None:
    """All blocks of a small alphabet at once: 6^4 of them, by value and by rank."""
    alphabet = np.array([0, 1, 2, 127, 254, 255])
    corners = np.stack(np.meshgrid(*[alphabet] * 4, indexing="ij"), axis=-1).reshape(36, 36, 2, 2)
    level = corners.transpose(0, 2, 1, 3).reshape(72, 72, 1).astype(np.uint8)
    for image in (level, level // 2 + 60):
        low = mean_below(image)
        np.testing.assert_array_equal(haar.decode(haar.encode(image, low), low, image.shape), image)
    assert haar.encode(level, mean_below(level))[0] & haar.RANKED
