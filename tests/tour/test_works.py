"""Which surfaces are works, shown in true colours: canvases, not frames, walls or windows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ptmtools.scene.model import Material, Scene, SourceImage
from ptmtools.tour.pictures import works_of
from tests.conftest import scene_of

IMAGE = SourceImage("a.png", "0" * 64, bytes)
PLAIN, TEXTURED, GLASS = (
    Material("plain"),
    Material("image", image=0),
    Material("pane", opacity=0.3, transparent=True),
)


def rectangle(x: float, y: float, z: float, width: float, height: float) -> list[list[float]]:
    """Upright, its front towards +Z; x, y and z are those of its lower left corner."""
    return [[x, y, z], [x + width, y, z], [x + width, y + height, z], [x, y + height, z]]


#: A floor and a wall behind all; the wall is 4 m by 3 m at z = 0.
FLOOR = [[0.0, 0, 0], [0, 0, 5], [4, 0, 5], [4, 0, 0]]
WALL = rectangle(0, 0, 0, 4, 3)


def with_object(*quads: Any, wall: Any = (WALL,), span: float = 1.0, **more: Any) -> Scene:
    """A plain floor and wall, and an object of quads with the image."""
    faces = [FLOOR, *wall, *quads]
    number = np.r_[0, np.ones(len(wall), int), np.full(len(quads), 2)]
    scene = scene_of(faces, materials=(PLAIN, TEXTURED, GLASS), material=(number == 2).astype(int))
    scene = replace(
        scene,
        images=(IMAGE,),
        objects=("floor", "wall", "object"),
        triangle_object=np.repeat(number, 2).astype(np.int32),
        uv=scene.uv * span,
    )
    return replace(scene, **more)


def works(scene: Scene) -> list[str]:
    return sorted({scene.objects[n] for n in scene.triangle_object[works_of(scene)]})


def test_a_canvas_before_a_wall_is_a_work() -> None:
    canvas = rectangle(1, 1, 0.02, 1.2, 0.8)
    assert works(with_object(canvas)) == ["object"]
    assert works(with_object(canvas, rectangle(2.5, 1, 0.02, 0.8, 1))) == ["object"], "two of them"


def test_its_frame_is_none() -> None:
    """A frame of the same object, of another material, before the canvas."""
    bars = [rectangle(1, 1, 0.05, 1.2, 0.05), rectangle(1, 1.75, 0.05, 1.2, 0.05)]
    scene = with_object(rectangle(1, 1, 0.02, 1.2, 0.8), *bars)
    material = scene.triangle_material.copy()
    material[-4:] = 0
    framed = replace(scene, triangle_material=material)
    assert np.flatnonzero(works_of(framed)).tolist() == [4, 5]


@pytest.mark.parametrize(
    "quads",
    [
        [WALL],
        [[[1.0, 0.01, 1], [1, 0.01, 2], [2, 0.01, 2], [2, 0.01, 1]]],  # a tile
        [rectangle(1, 0.1, 0.02, 1.2, 2)],  # a door
        [rectangle(0.5, 0.5, 0.6, 1.2, 0.8)],  # a screen in the room
        [rectangle(1, 1, 0.02, 1.2, 0.8), rectangle(0.5, 0.5, 0.6, 1.2, 0.8)],
    ],
    ids=["wall", "tile", "door", "screen", "one of two"],
)
def test_other_objects_are_none(quads: Any) -> None:
    assert works(with_object(*quads)) == []


@pytest.mark.parametrize("span", [0.5, 2.0])
def test_a_part_of_an_image_and_a_pattern_are_none(span: float) -> None:
    assert works(with_object(rectangle(1, 1, 0.02, 1.2, 0.8), span=span)) == []


def around(z: float) -> list[Any]:
    """A wall with an opening of 1.2 m by 0.8 m."""
    return [
        rectangle(0, 0, z, 4, 1),
        rectangle(0, 1.8, z, 4, 1.2),
        rectangle(0, 1, z, 1, 0.8),
        rectangle(2.2, 1, z, 1.8, 0.8),
    ]


@pytest.mark.parametrize("depth", [0.0, 0.1])
def test_windows_and_panels_of_walls_are_none(depth: float) -> None:
    """What fills an opening of a wall, even if another wall is behind it."""
    window = rectangle(1, 1, 0.3, 1.2, 0.8)
    assert works(with_object(window, wall=around(0.3 + depth))) == []
    both = [WALL, *around(0.25 + depth)]
    assert works(with_object(rectangle(1, 1, 0.25, 1.2, 0.8), wall=both)) == []


def test_what_hangs_before_glass_is_none() -> None:
    scene = with_object(rectangle(1, 1, 0.02, 1.2, 0.8))
    material = scene.triangle_material.copy()
    material[2:4] = 2
    assert works(replace(scene, triangle_material=material)) == []


def test_an_image_of_many_objects_is_none() -> None:
    scene = with_object(*(rectangle(0.2 * k, 1, 0.02, 0.15, 0.5) for k in range(18)))
    assert works(scene) == ["object"]
    number = np.r_[scene.triangle_object[:4], np.repeat(np.arange(2, 20), 2)].astype(np.int32)
    names = ("floor", "wall", *(f"tile {k}" for k in range(18)))
    assert works(replace(scene, triangle_object=number, objects=names)) == []
