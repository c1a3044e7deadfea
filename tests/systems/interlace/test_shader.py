"""The fragment shader joins as numpy does, bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ptmtools.errors import MissingComponentError
from ptmtools_systems.interlace.model import Axis, axes_of
from ptmtools_systems.interlace.steps import join, split
from tests.systems.interlace.step_shader import FRAGMENT, StepShader


@pytest.fixture(scope="module")
def shader(require: Callable[[str, str], None]) -> Iterator[StepShader]:
    try:
        made = StepShader()
    except MissingComponentError as fault:
        require("OpenGL", str(fault.remedy))
    yield made
    made.close()


@pytest.mark.parametrize("axis", ["rows", "columns"])
@pytest.mark.parametrize("components", [1, 2, 3, 4])
@pytest.mark.parametrize("size", [(1, 1), (2, 1), (1, 2), (4, 4), (8, 64), (256, 32), (512, 512)])
@pytest.mark.parametrize("kind", ["uint8", "uint16"])
def test_a_step(
    shader: StepShader, axis: Axis, components: int, size: tuple[int, int], kind: str
) -> None:
    random = np.random.default_rng(components)
    top = np.iinfo(kind).max
    first, second = random.integers(0, top, (2, *size, components), kind, endpoint=True)
    actual = shader.join(first, second, axis)
    assert actual.dtype == first.dtype
    np.testing.assert_array_equal(actual, join(first, second, axis))


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_a_step_to_the_longest_side(shader: StepShader, axis: Axis) -> None:
    along = shader.most // 2
    shape = (along, 2, 1) if axis == "rows" else (2, along, 1)
    first, second = np.random.default_rng(1).integers(0, 256, (2, *shape), np.uint8)
    np.testing.assert_array_equal(shader.join(first, second, axis), join(first, second, axis))


@pytest.mark.parametrize("size", [(64, 64), (32, 256), (256, 16)])
def test_all_steps_of_an_image(shader: StepShader, size: tuple[int, int]) -> None:
    image = np.random.default_rng(2).integers(0, 256, (*size, 3), np.uint8)
    axes = axes_of(size[1], size[0], 4)
    actual, *rest = split(image, axes)
    for part, axis in zip(rest, axes, strict=True):
        actual = shader.join(actual, part, axis)
    np.testing.assert_array_equal(actual, image)


def test_the_page_has_this_shader() -> None:
    page = Path(__file__).resolve().parents[3] / "docs/formats/interlace.md"
    assert f"```glsl{FRAGMENT}```" in page.read_text("utf-8")
