"""Classification of objects as detail by their shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.arrays import areas
from ptmtools.cells import SubdivideOptions, structural_triangles, subdivide
from ptmtools.cells.fabric import Fabric
from ptmtools.cells.floors import Floors
from ptmtools.scene.model import Material, Scene
from tests.conftest import scene_of, subdivided


def ball(rows: int, radius: float = 0.4, middle: tuple[float, ...] = (2, 0.5, 0)) -> np.ndarray:
    """4·rows·(rows - 1) triangles around a middle."""
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, 2 * rows + 1), indexing="ij")
    turn, down = 2 * np.pi * (u % 1), np.pi * v
    points = np.stack([np.sin(down) * np.cos(turn), np.cos(down), np.sin(down) * np.sin(turn)], 2)
    points = radius * points + middle
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    halves = np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 2)
    corners = halves.reshape(-1, 3, 3)
    return corners[areas(corners) > 1e-9]


def plant(leaves: int) -> np.ndarray:
    """Leaves of one triangle, none touching another."""
    random = np.random.default_rng(1)
    middle = random.uniform([1.7, 0, -0.3], [2.3, 1.5, 0.3], (leaves, 3))
    return middle[:, None] + random.normal(0, 0.03, (leaves, 3, 3))


def cuboid(low: tuple[float, ...], high: tuple[float, ...], times: int) -> np.ndarray:
    """A closed box, its faces seen from outside, subdivided."""
    from tests.cells.conftest import box

    scene = scene_of([face[::-1] for face in box(low, high)])
    return subdivided(scene, times).corners


def furnished(things: np.ndarray, room_faces, single_object: bool = True) -> Scene:
    """A room of 8 × 4 × 4 m with things in it, one object but for the walls."""
    walls = scene_of(room_faces((0, 0, -2), (8, 4, 2))).corners
    scene = scene_of(np.concatenate([walls, things]))
    if single_object:
        owner = np.minimum(scene.triangle_object, len(walls))
        scene = replace(scene, triangle_object=owner, objects=scene.objects[: len(walls) + 1])
    return scene


def taken(scene: Scene, **options: object) -> int:
    """How many triangles are taken for detail; all of them things."""
    structural = structural_triangles(scene, SubdivideOptions(**options))  # type: ignore[arg-type]
    assert np.all(structural[:12])
    return int(np.count_nonzero(~structural))


@pytest.mark.parametrize("single_object", [True, False])
def test_a_statue_is_detail_whatever_the_objects_are(room_faces, single_object: bool) -> None:
    things = ball(12)
    scene = furnished(things, room_faces, single_object)
    assert taken(scene) == len(things)
    cells = subdivide(scene)
    assert any("small, dense and round" in note for note in cells.notes)
    assert cells.cell_count == 1
    assert len(cells.triangle) >= 12 + len(things)  # it is drawn


def test_a_plant_is_detail_as_an_object_only(room_faces) -> None:
    assert taken(furnished(plant(400), room_faces)) == 400
    assert taken(furnished(plant(400), room_faces, single_object=False)) == 0


@pytest.mark.parametrize(
    "things",
    [
        pytest.param(ball(6), id="too few triangles"),
        pytest.param(ball(12, 1.6, (3, 2, 0)), id="too large"),
        pytest.param(cuboid((1, 0, -0.2), (1.4, 2.5, 0.2), 6), id="a pillar of many triangles"),
        pytest.param(cuboid((1, 0, -1), (1.1, 2.1, 0), 6), id="a door leaf of many triangles"),
        pytest.param(ball(12) * [1, 1, 0.05], id="flat as a plate"),
    ],
)
def test_what_is_structure(things: np.ndarray, room_faces) -> None:
    assert taken(furnished(things, room_faces)) == 0


def test_names_and_the_switch_come_first(room_faces) -> None:
    scene = furnished(ball(12), room_faces)
    statue = scene.objects[-1]
    assert taken(scene, structural=(statue,)) == 0
    assert taken(scene, detail_by_shape=False) == 0
    assert taken(scene, detail=(statue,)) == 528


def test_nobody_stands_on_a_ball_of_glass(room_faces) -> None:
    scene = furnished(ball(20), room_faces)
    of = scene.triangle_material.copy()
    of[12:] = len(scene.materials)
    glass = Material("glass", opacity=0.4, transparent=True)
    scene = replace(scene, materials=(*scene.materials, glass), triangle_material=of)
    for by_shape in (True, False):
        options = SubdivideOptions(detail_by_shape=by_shape)
        fabric = Fabric.from_scene(scene, options)
        floors = Floors.from_fabric(fabric)
        assert (len(floors.corners) > 4) != by_shape  # floor and ceiling have four
