"""Units and axes: names, numbers, and guesses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ptmtools.errors import InputError
from ptmtools.scene.space import UNITS, guess_unit, guess_up, parse_unit, turned


@pytest.mark.parametrize(
    ("given", "metres"),
    [("m", 1), ("CM", 0.01), ("mm", 0.001), ("in", 0.0254), (" ft ", 0.3048), ("0.5", 0.5), (2, 2)],
)
def test_units(given: str | float, metres: float) -> None:
    assert parse_unit(given) == metres


@pytest.mark.parametrize("given", ["parsec", "", "0", "-1", "nan", "inf", 0.0])
def test_units_that_are_none(given: str | float) -> None:
    with pytest.raises(InputError, match="PTM-I250"):
        parse_unit(given)


@pytest.mark.parametrize(
    ("width", "height", "unit"),
    [
        (56, 6, "m"),
        (10, 5, "m"),
        (6, 3, "m"),
        (60, 30, "m"),
        (400, 100, "m"),
        (5600, 600, "cm"),
        (1000, 280, "cm"),
        (56000, 6000, "mm"),
        (8000, 2500, "mm"),
        (2322, 112, "in"),
        (1, 0, "m"),
    ],
)
def test_guessed_units(width: float, height: float, unit: str) -> None:
    assert guess_unit(width, height)[0] == unit


def box(x: float, y: float, z: float) -> np.ndarray:
    """The (12, 3, 3) triangles of a box."""
    corner = np.array([[a, b, c] for a in (0, x) for b in (0, y) for c in (0, z)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corner[[t for q in quads for t in (q[:3], [q[0], q[2], q[3]])]]


@pytest.mark.parametrize("scale", [1e-150, 1.0, 39.37, 1e150])
def test_guessed_axes(scale: float) -> None:
    assert guess_up(box(20, 3, 15) * scale)[0] == "y"
    assert guess_up(box(20, 15, 3) * scale)[0] == "z"


def test_floors_outweigh_height() -> None:
    """A tower of 12 floors, higher than wide."""
    floors = [box(20, 0, 20)[4:6] + [0, 3.0 * i, 0] for i in range(12)]
    tower = np.concatenate([box(20, 36, 20), *floors])
    assert guess_up(tower)[0] == "y"
    assert guess_up(tower[..., [0, 2, 1]])[0] == "z"


def test_turning_is_a_rotation() -> None:
    axes = turned(np.eye(3), "z")
    assert axes.tolist() == [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    assert np.linalg.det(axes) == 1
    assert not np.signbit(axes[0]).any()
    assert turned(np.eye(3), "y").tolist() == np.eye(3).tolist()


def test_each_unit_can_be_guessed_or_given() -> None:
    assert list(UNITS) == ["m", "cm", "mm", "in", "ft"]


@pytest.mark.parametrize("size", [0.0, 5e-324, 1e-300, 1e300, 1.7e308, math.inf])
def test_sizes_at_the_ends_of_numbers_have_a_unit(size: float) -> None:
    for other in (1.0, size):
        assert guess_unit(size, other)[0] in UNITS
        assert guess_unit(other, size)[0] in UNITS
