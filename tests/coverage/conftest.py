"""Rooms with things in them, and the renderers that draw them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.eyes import Eyes
from ptmtools.coverage.item_buffer import Renderer, Surfaces
from ptmtools.coverage.looking import Looker, Owners
from ptmtools.coverage.opengl import APT, OpenGLRenderer, create_context
from ptmtools.errors import MissingComponentError
from ptmtools.scene.model import Material, Scene


@pytest.fixture(scope="session")
def has_gl() -> bool:
    try:
        create_context().release()
    except MissingComponentError:
        return False
    return True


@pytest.fixture(params=["gl", "embree"])
def backend(request, has_gl, require) -> str:
    """Each backend in turn; a missing OpenGL is reported."""
    if request.param == "gl" and not has_gl:
        require("OpenGL", APT)
    return request.param


@contextmanager
def renderer_of(backend: str, surfaces: Surfaces, face: int) -> Iterator[Renderer]:
    renderer: Renderer
    if backend == "gl":
        renderer = OpenGLRenderer(create_context(), surfaces, face)
    else:
        renderer = EmbreeRenderer(surfaces, face)
    try:
        yield renderer
    finally:
        renderer.close()


@pytest.fixture(scope="session")
def drawing() -> Callable[..., AbstractContextManager[Renderer]]:
    """``with drawing(backend, surfaces, face) as renderer``."""
    return renderer_of


def eyes_at(points, near: float = 1e-3, shift=(0.0, 0.0)) -> Eyes:
    place = np.array(points, dtype=np.float64).reshape(-1, 3)
    return Eyes(place, np.full(len(place), near), np.tile(np.array(shift, float), (len(place), 1)))


@pytest.fixture(scope="session")
def eyes() -> Callable[..., Eyes]:
    """``eyes(points, near, shift)``."""
    return eyes_at


def counted(renderer: Renderer, surfaces: Surfaces, cells: Cells, at: Eyes, face: int) -> list[int]:
    owners = Owners.of(surfaces, by_image=False)
    looker = Looker(renderer, surfaces, cells, face, by_angle=False)
    seen = looker.look(at, owners, np.arange(surfaces.cell_count))
    return np.append(seen.counts.sum(axis=(0, 1)), seen.missed.sum())


@pytest.fixture(scope="session")
def count() -> Callable[..., np.ndarray]:
    """``count(renderer, surfaces, cells, eyes, face)``: pixels of each cell, then of none."""
    return counted


@pytest.fixture(scope="session")
def coverage_at() -> Callable[..., np.ndarray]:
    """``coverage_at(backend, scene, cells, point, face)``: pixels of each cell, then of none."""

    def at(backend, scene, cells, point, face=64, near=1e-3):
        surfaces = Surfaces.of(scene, cells)
        with renderer_of(backend, surfaces, face) as renderer:
            return counted(renderer, surfaces, cells, eyes_at(point, near), face)

    return at


def with_quads(
    scene: Scene,
    cells: Cells,
    quads: list[list[list[float]]],
    sides: list[tuple[int, int]],
    transparent: bool = False,
) -> tuple[Scene, Cells]:
    """Hangs quadrilaterals into a subdivided scene; ``sides`` are their cells (front, back)."""
    corners = np.array(quads, dtype=np.float64).reshape(-1, 4, 3)
    added, t = len(corners), len(scene.triangles)
    base = len(scene.points) + 4 * np.arange(added)[:, None, None]
    triangles = (base + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3).astype(np.int32)
    material = np.full(2 * added, len(scene.materials), np.int32)
    points = np.concatenate([scene.points, corners.reshape(-1, 3)])
    together = replace(
        scene,
        points=points,
        triangles=np.concatenate([scene.triangles, triangles]),
        uv=np.concatenate([scene.uv, np.zeros((2 * added, 3, 2))]),
        triangle_object=np.concatenate([scene.triangle_object, np.zeros(2 * added, np.int32)]),
        triangle_material=np.concatenate([scene.triangle_material, material]),
        two_sided=np.ones(t + 2 * added, bool),
        materials=(*scene.materials, Material("added", transparent=transparent)),
    )
    owners = np.repeat(np.array(sides, np.int32).reshape(-1, 2), 2, axis=0)
    cut = replace(
        cells,
        vertex=points,
        vertex_uv=np.zeros((len(points), 2)),
        triangle=np.concatenate([cells.triangle, triangles]),
        triangle_source=np.concatenate(
            [cells.triangle_source, np.arange(t, t + 2 * added, dtype=np.int32)]
        ),
        triangle_cell=np.concatenate([cells.triangle_cell, owners]),
    )
    return together, cut


@pytest.fixture(scope="session")
def furnish() -> Callable[..., tuple[Scene, Cells]]:
    """``furnish(scene, cells, quads, sides, transparent=False)``."""
    return with_quads


def moved_and_scaled(
    scene: Scene, cells: Cells, offset: np.ndarray, factor: float
) -> tuple[Scene, Cells]:
    """The same rooms, each position ``x`` at ``x * factor + offset``."""
    normal, d = cells.node_plane[:, :3], cells.node_plane[:, 3]
    plane = np.column_stack([normal, d * factor - normal @ offset])
    cut = replace(
        cells,
        node_plane=plane,
        root_box=cells.root_box * factor + offset,
        leaf_point=cells.leaf_point * factor + offset,
        portal_point=cells.portal_point * factor + offset,
        vertex=cells.vertex * factor + offset,
    )
    return replace(scene, points=scene.points * factor + offset), cut


@pytest.fixture(scope="session")
def elsewhere() -> Callable[..., tuple[Scene, Cells]]:
    """``elsewhere(scene, cells, offset, factor)``."""
    return moved_and_scaled
