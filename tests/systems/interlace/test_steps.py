"""Splitting and joining: exact, every texel once, each step a decimation of the whole image."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from ptmtools_systems.interlace.model import axes_of, sizes_of
from ptmtools_systems.interlace.steps import join, split, stride

powers = st.integers(0, 7).map(lambda n: 1 << n)
images = st.tuples(
    powers, powers, st.integers(1, 4), st.sampled_from(["u1", "u2"]), st.integers(0, 999)
).map(
    lambda made: np.random.default_rng(made[4]).integers(
        0, 256 ** int(made[3][1]), made[:3], made[3]
    )
)
minima = st.integers(1, 200)


def joined(parts: list[NDArray], axes: tuple) -> list[NDArray]:
    """The image after each step."""
    steps = zip(parts[1:], axes, strict=True)
    return list(accumulate(steps, lambda image, step: join(image, *step), initial=parts[0]))


@pytest.mark.parametrize(
    ("width", "height", "smallest", "files"),
    [
        (512, 512, 128, 5),  # §3.1
        (4096, 4096, 128, 11),  # §3.1
        (1024, 1024, 128, 7),
        (2048, 2048, 128, 9),
        (128, 128, 128, 1),
        (64, 4096, 128, 1),
        (256, 128, 128, 1),
        (4096, 256, 128, 3),
        (256, 4096, 128, 3),
        (512, 512, 100, 5),
        (512, 512, 129, 3),
        (4, 4, 1, 5),
        (1, 1, 1, 1),
    ],
)
def test_number_of_files(width: int, height: int, smallest: int, files: int) -> None:
    assert len(axes_of(width, height, smallest)) + 1 == files


def test_files_of_512_texels() -> None:
    axes = axes_of(512, 512, 128)
    assert axes == ("columns", "rows", "columns", "rows")
    own = [size for size, _ in sizes_of(512, 512, axes)]
    assert own == [(128, 128), (128, 128), (256, 128), (256, 256), (512, 256)]


def test_four_by_four_by_hand() -> None:
    image = np.arange(16).reshape(4, 4, 1)
    actual = [part[:, :, 0].tolist() for part in split(image, axes_of(4, 4, 1))]
    assert actual == [
        [[0]],
        [[2]],
        [[8, 10]],
        [[1, 3], [9, 11]],
        [[4, 5, 6, 7], [12, 13, 14, 15]],
    ]


@given(images, minima)
def test_joined_is_what_was_split(image: NDArray, smallest: int) -> None:
    height, width, _ = image.shape
    axes = axes_of(width, height, smallest)
    last = joined(split(image, axes), axes)[-1]
    assert last.dtype == image.dtype
    np.testing.assert_array_equal(last, image)


@given(images, minima)
def test_every_step_is_a_decimation(image: NDArray, smallest: int) -> None:
    height, width, _ = image.shape
    axes = axes_of(width, height, smallest)
    for step, actual in enumerate(joined(split(image, axes), axes), 1):
        rows, columns = stride(axes, step)
        np.testing.assert_array_equal(actual, image[::rows, ::columns])


@given(powers, powers, minima)
def test_every_texel_is_in_one_file(width: int, height: int, smallest: int) -> None:
    number = np.arange(width * height).reshape(height, width)
    axes = axes_of(width, height, smallest)
    sent = np.concatenate([part.ravel() for part in split(number, axes)])
    np.testing.assert_array_equal(np.sort(sent), number.ravel())


@given(powers, powers, minima)
def test_sizes_and_the_minimum(width: int, height: int, smallest: int) -> None:
    axes = axes_of(width, height, smallest)
    sizes = sizes_of(width, height, axes)
    image = np.zeros((height, width, 1), np.uint8)
    parts = split(image, axes)
    assert [own for own, _ in sizes] == [part.shape[1::-1] for part in parts]
    assert [made for _, made in sizes] == [part.shape[1::-1] for part in joined(parts, axes)]
    first = min(sizes[0][0])
    assert first >= smallest or not axes
    assert first >> 1 < smallest  # one more pair would go below
