"""Scenes written as lists of quadrilaterals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from ptmtools.scene.model import Scene
from tests.conftest import scene_of

Corner = Sequence[float]
BuildScene = Callable[..., Scene]


@pytest.fixture(scope="session")
def quads() -> BuildScene:
    """``quads(corners, objects=None, materials=…, material=None)``: see `scene_of`."""
    return scene_of


def box(low: Corner, high: Corner, leave_out: str = "") -> list[list[list[float]]]:
    """The faces of a box seen from inside, less those named in ``leave_out`` (of -x +x -y …)."""
    (a, b, c), (d, e, f) = low, high
    faces = {
        "-x": [[a, b, c], [a, e, c], [a, e, f], [a, b, f]],
        "+x": [[d, b, c], [d, b, f], [d, e, f], [d, e, c]],
        "-y": [[a, b, c], [a, b, f], [d, b, f], [d, b, c]],
        "+y": [[a, e, c], [d, e, c], [d, e, f], [a, e, f]],
        "-z": [[a, b, c], [d, b, c], [d, e, c], [a, e, c]],
        "+z": [[a, b, f], [a, e, f], [d, e, f], [d, b, f]],
    }
    return [quad for name, quad in faces.items() if name not in leave_out.split()]


@pytest.fixture(scope="session")
def room_faces() -> Callable[..., list[list[list[float]]]]:
    """``room_faces(low, high, leave_out="")``: see `box`."""
    return box


def panel(x: float, hole: tuple[float, float, float, float] | None) -> list[list[list[float]]]:
    """A partition at x over y in [0, 4], z in [-2, 2] with a hole (y0, y1, z0, z1)."""

    def face(y0: float, y1: float, z0: float, z1: float) -> list[list[float]]:
        return [[x, y0, z0], [x, y1, z0], [x, y1, z1], [x, y0, z1]]

    if hole is None:
        return [face(0, 4, -2, 2)]
    y0, y1, z0, z1 = hole
    parts = [(0, 4, -2, z0), (0, 4, z1, 2), (0, y0, z0, z1), (y1, 4, z0, z1)]
    return [face(*p) for p in parts if p[1] > p[0] and p[3] > p[2]]


@pytest.fixture(scope="session")
def partition() -> Callable[..., list[list[list[float]]]]:
    """``partition(x, hole)``: see `panel`."""
    return panel
