"""Rooms with things in them, and the renderers that draw them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.coverage.backends import BACKENDS
from ptmtools.coverage.item_buffer import ItemRenderer, ItemSurfaces
from ptmtools.coverage.sample_points import SamplePoints
from ptmtools.coverage.tally import PixelCounter
from ptmtools.scene.model import Material, Scene


@pytest.fixture(params=["gl", "embree"])
def backend(request) -> str:
    """Each backend in turn."""
    if request.param == "gl":
        request.getfixturevalue("gl")
    return request.param


@pytest.fixture(scope="session")
def pixel_centres() -> Callable[[int], np.ndarray]:
    """``pixel_centres(face)``: where the centres of a row of pixels lie in (-1, 1)."""
    return lambda face: (2.0 * np.arange(face) + 1.0) / face - 1.0


@contextmanager
def renderer_of(backend: str, surfaces: ItemSurfaces, face: int) -> Iterator[ItemRenderer]:
    renderer = BACKENDS[backend].open(surfaces, face)
    try:
        yield renderer
    finally:
        renderer.close()


@pytest.fixture(scope="session")
def drawing() -> Callable[..., AbstractContextManager[ItemRenderer]]:
    """``with drawing(backend, surfaces, face) as renderer``."""
    return renderer_of


def sample_points_at(positions, near: float = 1e-3, shift=(0.0, 0.0)) -> SamplePoints:
    at = np.array(positions, dtype=np.float64).reshape(-1, 3)
    return SamplePoints(at, np.full(len(at), near), np.tile(np.array(shift, float), (len(at), 1)))


@pytest.fixture(scope="session")
def sample_points() -> Callable[..., SamplePoints]:
    """``sample_points(positions, near, shift)``."""
    return sample_points_at


def counted(
    renderer: ItemRenderer, surfaces: ItemSurfaces, cells: Cells, at: SamplePoints, face: int
) -> list[int]:
    counter = PixelCounter(renderer, surfaces, cells, face)
    tally = counter.count(at, np.arange(surfaces.cell_count))
    return np.append(tally.in_views.sum(axis=0), tally.missed.sum())


@pytest.fixture(scope="session")
def coverage_at() -> Callable[..., np.ndarray]:
    """``coverage_at(backend, scene, cells, point, face)``: pixels of each cell, then of none."""

    def at(backend, scene, cells, point, face=64, near=1e-3):
        surfaces = ItemSurfaces.from_scene(scene, cells)
        with renderer_of(backend, surfaces, face) as renderer:
            return counted(renderer, surfaces, cells, sample_points_at(point, near), face)

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
    return scene.with_points(scene.points * factor + offset), cut


@pytest.fixture(scope="session")
def elsewhere() -> Callable[..., tuple[Scene, Cells]]:
    """``elsewhere(scene, cells, offset, factor)``."""
    return moved_and_scaled


def pixel_corner(d, y, z):
    """Area on the faces of the cube [-1, 1]³, of 24 in all, of the rectangle between (d, 0, 0) and
    (d, y, z) seen from the origin, d > 0; odd in y and z. The integral of d / max(d, |y|, |z|)³.
    """
    less, more = (f(np.abs(y), np.abs(z)) for f in (np.minimum, np.maximum))
    with np.errstate(divide="ignore", invalid="ignore"):
        ahead = less * more / d**2
        on_one_side = less / d + less * d / 2 * (1 / d**2 - 1 / more**2)
        round_the_corner = 3 - 2 * d / less + d / 2 * (1 / less - less / more**2)
    area = np.where(more <= d, ahead, np.where(less <= d, on_one_side, round_the_corner))
    return np.sign(y) * np.sign(z) * area / 24


def angle_corner(d, y, z):
    """The same as a solid angle, over 4π."""
    return np.arctan(y * z / (d * np.sqrt(d * d + y * y + z * z))) / (4 * np.pi)


def of_a_window(weighting, d, y, z):
    """Share of all that is seen from the origin that a rectangle across the x axis at distance d
    takes up; y and z are its ends."""
    corner = pixel_corner if weighting == "pixel" else angle_corner
    return sum((-1) ** (i + j) * corner(d, y[i], z[j]) for i in range(2) for j in range(2))


def panels(*ends: float, nodes: int = 24):
    """Nodes and weights of Gauss-Legendre quadrature between each two of the ends; their mean."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    low, size = np.array(ends[:-1])[:, None], np.diff(ends)[:, None]
    return (low + size * (x + 1) / 2).ravel(), (size * w / 2).ravel() / (ends[-1] - ends[0])


@cache
def beyond(doors: int, weighting: str, y_ends=(0.0, 3.0), z_ends=(-1.0, 1.0), length=4.0) -> float:
    """What lies beyond so many doors of `room_row` in a row, all of the given ends, as a share of
    all that is seen, on average over a room of the given length; by dense quadrature."""
    u, wd = panels(0, 1, nodes=40)
    wd, d = 3 * u**2 * wd, length * u**3  # dense where the eye comes close to the door
    y, wy = panels(0, *(e for e in y_ends if 0 < e < 4), 4)
    z, wz = panels(-2, *(e for e in z_ends if -2 < e < 2), 2)
    d, y, z = np.meshgrid(d, y, z, indexing="ij", sparse=True)
    # The last door as it appears in the plane of the first.
    s = d / (d + 4 * (doors - 1))
    open_y = [f(e - y, (e - y) * s) for f, e in zip((np.maximum, np.minimum), y_ends, strict=True)]
    open_z = [f(e - z, (e - z) * s) for f, e in zip((np.maximum, np.minimum), z_ends, strict=True)]
    open_y[1], open_z[1] = np.maximum(*open_y), np.maximum(*open_z)
    seen = of_a_window(weighting, d, open_y, open_z)
    return float(np.einsum("i,j,k,ijk->", wd, wy, wz, seen))


@pytest.fixture(scope="session")
def through_doors() -> Callable[..., float]:
    """``through_doors(doors, weighting, y_ends, z_ends, length)``: the share of what is seen from a
    room that lies beyond so many doors, by quadrature."""
    return beyond


@pytest.fixture(scope="session")
def exact_row() -> Callable[[int, str], np.ndarray]:
    """``exact_row(n, weighting)``: the (n, n) hints of `room_row`, by quadrature."""

    def exact(n: int, weighting: str = "pixel") -> np.ndarray:
        share = [1.0, *(beyond(k, weighting) for k in range(1, n))]
        actual = np.zeros((n, n))
        for i in range(n):
            for far, step in ((n - 1 - i, 1), (i, -1)):
                for k in range(1, far + 1):
                    actual[i, i + step * k] = share[k] - (share[k + 1] if k < far else 0.0)
            actual[i, i] = 1 - actual[i].sum()
        return actual

    return exact
