"""Furniture, fittings and facades of the made models in `strangers`, each of many triangles.

Metres, Z up.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from tests.scene.buildings import box

#: Corners of a corner: two triangles of a quadrilateral.
_HALVES = ((0, 1, 2), (0, 2, 3))


def grid(points: Floats) -> Floats:
    """(n, 3, 3) triangles of a (u, v, 3) grid of points."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.stack([a, b, c, d], axis=2).reshape(-1, 4, 3)
    return np.concatenate([corners[:, half] for half in _HALVES])


def bowl(at: tuple[float, float, float], radius: float, rings: int = 60) -> Floats:
    """A closed round shell, such as a basin, of about 4·rings² triangles."""
    turn = np.linspace(0, 2 * np.pi, 2 * rings + 1)[:, None]
    tilt = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)[None]
    level = radius * np.cos(tilt)
    z = np.broadcast_to(0.6 * radius * np.sin(tilt), (2 * rings + 1, rings + 1))
    points = np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=2)
    return grid(points + np.array(at))


def sofa(x: float, y: float, rings: int = 12) -> Floats:
    """A seat with a back, arms and round cushions."""
    parts = [
        box((x, y, 0.1), (x + 2, y + 0.9, 0.45)),
        box((x, y + 0.7, 0.45), (x + 2, y + 0.9, 0.9)),
        box((x, y, 0.45), (x + 0.2, y + 0.7, 0.65)),
        box((x + 1.8, y, 0.45), (x + 2, y + 0.7, 0.65)),
    ]
    parts += [bowl((x + 0.5 + 0.5 * k, y + 0.4, 0.6), 0.2, rings) for k in range(3)]
    return np.concatenate(parts)


def shelf(x: float, y: float, boards: int = 8, books: int = 30) -> Floats:
    """A shelf 2 m wide and high, full of books."""
    parts = [box((x, y, 0), (x + 0.03, y + 0.3, 2)), box((x + 1.97, y, 0), (x + 2, y + 0.3, 2))]
    rng = np.random.default_rng(5)
    for level in np.linspace(0, 1.97, boards):
        parts.append(box((x, y, level), (x + 2, y + 0.3, level + 0.03)))
        for k in range(books):
            left, high = x + 0.05 + k * 1.9 / books, level + rng.uniform(0.12, 0.2)
            deep = rng.uniform(0.15, 0.25)
            parts.append(box((left, y + 0.02, level + 0.03), (left + 0.05, y + deep, high)))
    return np.concatenate(parts)


def facade(x0: float, x1: float, y: float, high: float, deep: float = 0.15) -> Floats:
    """Windows with sills and lintels on a facade in a plane of constant y, in storeys of 3 m."""
    parts = []
    for z in np.arange(0.9, high - 2, 3.0):
        for x in np.arange(x0 + 1, x1 - 1.5, 2.5):
            parts += [
                box((x, y - deep, z - 0.1), (x + 1.2, y, z)),
                box((x, y - deep, z + 1.5), (x + 1.2, y, z + 1.6)),
                box((x - 0.1, y - deep / 2, z), (x, y, z + 1.5)),
                box((x + 1.2, y - deep / 2, z), (x + 1.3, y, z + 1.5)),
            ]
    return np.concatenate(parts)


def noisy(low: tuple[float, float, float], high: tuple[float, float, float], step: float) -> Floats:
    """The inside of a box as a scan gives it: triangles of about a step, no two in one plane."""
    rng = np.random.default_rng(9)
    faces = []
    size = np.subtract(high, low)
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        sides = [np.linspace(0, size[i], max(2, round(size[i] / step) + 1)) for i in (u, v)]
        flat = np.stack(np.meshgrid(*sides, indexing="ij"), axis=2)
        for end in (0.0, size[axis]):
            points = np.zeros((*flat.shape[:2], 3))
            points[..., [u, v]] = flat
            points[..., axis] = end
            rough = points + low
            rough[1:-1, 1:-1] += rng.normal(0, step / 10, rough[1:-1, 1:-1].shape)
            faces.append(grid(rough))
    return np.concatenate(faces)


def around(
    x0: float, y0: float, x1: float, y1: float, wide: float, low: float, high: float
) -> Floats:
    """A frame of a width inside a rectangle in plan, such as a gallery, a parapet or a curb."""
    return np.concatenate(
        [
            box((x0, y0, low), (x1, y0 + wide, high)),
            box((x0, y1 - wide, low), (x1, y1, high)),
            box((x0, y0 + wide, low), (x0 + wide, y1 - wide, high)),
            box((x1 - wide, y0 + wide, low), (x1, y1 - wide, high)),
        ]
    )


def shell(low: tuple[float, float, float], high: tuple[float, float, float]) -> Floats:
    """A box without its bottom."""
    sides = box(low, high)
    return sides[(sides[:, :, 2] > low[2]).any(axis=1)]


def pictures(x0: float, y0: float, x1: float, y1: float) -> Floats:
    """Ten panels of 1.6 × 1.4 m, 4 cm thick and 2 to 5 cm off the walls of a room of 10 × 8 m."""
    panels = []
    for k in range(3):
        x, off = x0 + 1 + 3.2 * k, 0.02 + 0.01 * k
        panels.append(box((x, y0 + off, 0.9), (x + 1.6, y0 + off + 0.04, 2.3)))
        panels.append(box((x, y1 - off - 0.04, 0.9), (x + 1.6, y1 - off, 2.3)))
    for k in range(2):
        y, off = y0 + 0.8 + 2.4 * k, 0.03 + 0.02 * k
        panels.append(box((x0 + off, y, 0.9), (x0 + off + 0.04, y + 1.6, 2.3)))
        panels.append(box((x1 - off - 0.04, y, 0.9), (x1 - off, y + 1.6, 2.3)))
    return np.concatenate(panels)
