"""The grids of compressed cells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.errors import InputError
from ptmtools.output import EmitOptions
from ptmtools.output.grid import (
    COARSEST,
    MOST,
    least_thickness,
    position_exponent,
    texture_exponents,
)
from ptmtools.tolerance import Tolerance


def plate(low: tuple[float, ...], high: tuple[float, ...]) -> np.ndarray:
    """(12, 3, 3) the triangles of a box."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    corner = np.array(low) + corner * (np.array(high) - low)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([[corner[[a, b, c]], corner[[a, c, d]]] for a, b, c, d in quads]).reshape(
        -1, 3, 3
    )


ROOM = plate((0, 0, 0), (20, 3, 10))


def thickness(*parts: np.ndarray) -> float:
    corners = np.concatenate(parts)
    return least_thickness(corners, Tolerance.for_points(corners.reshape(-1, 3)))


@given(st.floats(0.5e-3, 9e-3), st.floats(0, np.pi))
def test_a_plate_in_any_direction_is_measured(thick: float, angle: float) -> None:
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    board = (plate((0, 0, 0), (1, 1, thick)) @ turn.T) + [8, 1, 5]
    assert thickness(ROOM, board) == pytest.approx(thick, rel=0.01)


def test_a_picture_in_front_of_a_wall_is_measured() -> None:
    picture = plate((2, 1, 0.002), (3, 2, 0.3))[4:6]
    assert thickness(ROOM, picture + [0, 0, 0]) <= 10 * 2.0**COARSEST
    front = np.array([[[2, 1, 0.002], [3, 1, 0.002], [3, 2, 0.002]]])
    assert thickness(ROOM, front) == pytest.approx(0.002, rel=0.01)


def test_thick_parts_and_dust_do_not_count() -> None:
    most = 10 * 2.0**COARSEST
    assert thickness(ROOM) == thickness(ROOM, plate((1, 1, 1), (2, 2, 1.02))) == most
    assert thickness(ROOM, plate((1, 1, 1), (1.01, 1.01, 1.001))) == most
    assert thickness(np.zeros((4, 3, 3))) == most


def test_the_step_is_a_power_of_two_or_less_than_the_given_one(artifacts: Any) -> None:
    scene = artifacts.scene
    assert position_exponent(scene, 0.001) == -10
    assert position_exponent(scene, 2.0**-13) == -13
    assert position_exponent(scene) <= COARSEST
    assert 2.0 ** position_exponent(scene, 1e-30) * MOST >= np.abs(scene.points).max()
    for step in (0.0, -1.0, float("inf"), float("nan")):
        with pytest.raises(InputError, match=r"gltf-step.*PTM-I111"):
            EmitOptions(gltf_step=step)


@given(st.integers(1, 70000), st.integers(1, 70000), st.floats(0, 1e9))
def test_texture_coordinates_are_within_a_tenth_of_a_texel(
    width: int, height: int, most: float
) -> None:
    """In a range of more steps than 24 bits hold, all 24 are used."""
    exponents = texture_exponents(np.array([[most, -most]]), width, height)
    for exponent, side in zip(exponents, (width, height), strict=True):
        assert most <= MOST * 2.0**exponent
        assert 2.0**exponent * side <= 0.2 or 2.0**exponent * MOST < 2 * most
