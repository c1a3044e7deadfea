"""Scenes written as lists of quadrilaterals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from ptmtools.scene.model import Material, Scene

Corner = Sequence[float]
BuildScene = Callable[..., Scene]


@pytest.fixture(scope="session")
def quads() -> BuildScene:
    """``quads(corners, objects=None, materials=None, material=None)``: a scene of 4-corner faces.

    ``corners`` is (n, 4, 3); ``objects`` one name per face; ``material`` one index per face.
    Texture coordinates are (0,0) (1,0) (1,1) (0,1).
    """

    def build(
        corners: Sequence[Sequence[Corner]],
        objects: Sequence[str] | None = None,
        materials: Sequence[Material] = (Material("plain"),),
        material: Sequence[int] | None = None,
    ) -> Scene:
        points = np.array(corners, dtype=np.float64)
        n = len(points)
        loop = np.array([[0, 1, 2], [0, 2, 3]])
        names = list(objects or [f"quad{i}" for i in range(n)])
        corner_uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)
        return Scene(
            points=points.reshape(-1, 3),
            triangles=(4 * np.arange(n)[:, None, None] + loop).reshape(-1, 3).astype(np.int32),
            uv=np.tile(corner_uv[loop], (n, 1, 1)),
            triangle_object=np.repeat(np.arange(n), 2).astype(np.int32),
            triangle_material=np.repeat(
                np.zeros(n, np.int32) if material is None else np.array(material, np.int32), 2
            ),
            two_sided=np.ones(2 * n, dtype=bool),
            objects=tuple(names),
            materials=tuple(materials),
        )

    return build


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
