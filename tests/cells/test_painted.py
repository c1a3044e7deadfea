"""Triangles with colours of their own: pieces with the same owners are joined only where the
colours go on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.cells.joining import patches
from ptmtools.cells.search import first_alike
from ptmtools.scene.model import Scene
from tests.conftest import scene_of

#: A wall of two quadrilaterals side by side, of one object and material, one texture map.
QUADS = [
    [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)],
    [(2, 0, 0), (4, 0, 0), (4, 2, 0), (2, 2, 0)],
]


def wall(colors: np.ndarray | None) -> Scene:
    made = scene_of(QUADS, ["wall", "wall"])
    uv = made.corners[..., :2] / 4
    one = np.zeros_like(made.triangle_object)
    return replace(made, uv=uv, triangle_object=one, objects=("wall",), colors=colors)


def pieces(scene: Scene) -> int:
    triangle = np.arange(len(scene.triangles))
    corner = first_alike(scene.points)[scene.triangles]
    may = np.ones(len(triangle), dtype=bool)
    return len(np.unique(patches(scene, triangle, corner, may, scene.tolerance)))


def ramp(scene: Scene, per_metre: float) -> np.ndarray:
    shade = np.rint(per_metre * scene.corners[..., :1]).astype(np.uint8)
    return np.repeat(shade, 3, axis=2)


def test_colours_that_go_on_are_one_patch() -> None:
    plain = wall(None)
    assert pieces(plain) == 1
    assert pieces(wall(ramp(plain, 50))) == 1


def test_colours_that_do_not_are_apart() -> None:
    """A step at the joint; and a slope that ends there."""
    plain = wall(None)
    step = ramp(plain, 0)
    step[2:] = 200
    assert pieces(wall(step)) == 2
    bent = np.minimum(ramp(plain, 50), 100).astype(np.uint8)
    assert pieces(wall(bent)) == 2
