"""Shapes as (T, 3, 3) corners of triangles, and looking things up on them."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.light.occlusion import Occluders
from tests.systems.campus.models import house, level


def triangles_of(rows: Floats) -> Floats:
    """(2 n, 3, 3) of the (4 n, 5) corners of quads."""
    quads = rows[:, :3].reshape(-1, 4, 3)
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


HOUSE = triangles_of(np.concatenate(list(house(0, 0, 12, 8, 9, 2).values())))
GROUND = triangles_of(level((-30, -30), (40, 40), 0))


def indexed(corner: Floats) -> tuple[Floats, np.ndarray]:
    points, place = np.unique(corner.reshape(-1, 3), axis=0, return_inverse=True)
    return points, place.reshape(-1, 3).astype(np.int32)


def surroundings(*parts: Floats) -> Occluders:
    points, triangles = indexed(np.concatenate(parts))
    return Occluders(points, triangles, points.mean(axis=0), 0.0, 1e-4)


def quad(*corner: tuple[float, float, float]) -> Floats:
    return np.array([[corner[0], corner[1], corner[2]], [corner[0], corner[2], corner[3]]], float)


def prism(x: float, z: float, wide: float, deep: float, high: float) -> Floats:
    """The walls of a box, wound outwards."""
    at = [(x, z), (x, z + deep), (x + wide, z + deep), (x + wide, z)]
    quads = []
    for k in range(4):
        (a, b), (c, d) = at[k], at[(k + 1) % 4]
        quads.append(quad((a, 0, b), (c, 0, d), (c, high, d), (a, high, b)))
    return np.concatenate(quads)


def loose(count: int) -> Floats:
    """(count, 3, 3) faces without neighbours, of all sizes."""
    random = np.random.default_rng(1)
    size = 10 ** random.uniform(-1, 1.5, (count, 1, 1))
    return random.random((count, 1, 3)) * 1000 + size * random.random((count, 3, 3))


def ledges(count: int) -> Floats:
    """A wall with shelves of 3 cm by 6 m, of which all faces are loose."""
    parts = [[[0, 0, 0], [6, 0, 0], [6, 8, 0], [0, 8, 0]]]
    for k in range(count):
        y = 0.5 + 0.1 * k
        for low, high, back in ((y, y, 0.0), (y + 0.03, y + 0.03, 0.0), (y, y + 0.03, 0.03)):
            quad = [[0, low, 0.03], [6, low, 0.03], [6, high, back], [0, high, back]]
            parts.append(quad if low != y or high != y else quad[::-1])
    quads = np.array(parts, float)
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


def bilinear(texels: Floats, at: Floats) -> tuple[Floats, np.ndarray, Floats]:
    """(n,) as a client finds it; (n, 4) what is read, by row and column, and its weights."""
    size = len(texels)
    place = at * size - 0.5
    first = np.floor(place).astype(int)
    read, weights = [], []
    for right in (0, 1):
        for below in (0, 1):
            column, row = (first + [right, below]).T.clip(0, size - 1)
            weight = np.abs(1 - right - (place - first)[:, 0])
            weight = weight * np.abs(1 - below - (place - first)[:, 1])
            weights.append(weight)
            read.append(row * size + column)
    index, share = np.stack(read, axis=1), np.stack(weights, axis=1)
    return (share * texels.ravel()[index]).sum(axis=1), index, share


def samples(corner: Floats, uv: Floats, count: int) -> tuple[np.ndarray, Floats, Floats]:
    """Faces, points on them, and their coordinates from the upper left."""
    random = np.random.default_rng(5)
    face = random.integers(0, len(corner), count)
    share = random.dirichlet([1, 1, 1], count)
    point, at = (np.einsum("nk,nkx->nx", share, held[face]) for held in (corner, uv))
    return face, point, at * [1, -1] + [0, 1]
