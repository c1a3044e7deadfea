"""Meshes that tests simplify."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.simplification import Mesh


def grid(columns: int, rows: int) -> NDArray[np.int32]:
    """(2 columns rows, 3) triangles over (columns + 1) (rows + 1) points, row by row."""
    at = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    pair = np.stack([a, b, c, a, c, d], axis=-1)
    return pair.reshape(-1, 3).astype(np.int32)


def box(steps: int) -> Mesh:
    """A box of 1 x 2 x 3 with 12 steps² faces, each side with points of its own."""
    axis = np.arange(steps + 1) / steps
    u, v = (each.reshape(-1) for each in np.meshgrid(axis, axis))
    sides = []
    for k in range(3):
        for end in (0, 1):
            side = np.empty((len(u), 3))
            side[:, k] = end
            side[:, (k + 1) % 3], side[:, (k + 2) % 3] = (u, v) if end else (v, u)
            sides.append(side)
    points = np.concatenate(sides) * [1.0, 2.0, 3.0]
    faces = [grid(steps, steps) + i * len(u) for i in range(6)]
    return Mesh(points, np.concatenate(faces))


def torus(columns: int, rows: int) -> Mesh:
    """A closed torus of 2 columns rows faces."""
    across, along = np.meshgrid(np.arange(columns), np.arange(rows))
    a = 2 * np.pi * across.reshape(-1) / columns
    b = 2 * np.pi * along.reshape(-1) / rows
    radius = 2 + np.cos(b)
    points = np.stack([radius * np.cos(a), radius * np.sin(a), np.sin(b)], axis=1)
    faces = grid(columns, rows)
    row, column = np.divmod(faces, columns + 1)
    return Mesh(points, (row % rows * columns + column % columns).astype(np.int32))


def sphere(steps: int) -> Mesh:
    """A unit sphere, a box of 12 steps² faces blown up; points of equal places differ."""
    given = box(steps)
    points = given.points / [1.0, 2.0, 3.0] * 2 - 1
    points /= np.sqrt((points**2).sum(axis=1))[:, None]
    return Mesh(points, given.triangles)


def facade(columns: int, rows: int, cells: int) -> Mesh:
    """A wall of bricks (material 0) with columns x rows windows (material 1) in its plane.

    Each window has a margin as wide as itself; everything is cut into squares, ``cells`` to a
    window's side. Bricks are tiled, a window has the whole of its texture.
    """
    across, up = cells * (2 * columns + 1), cells * (2 * rows + 1)
    x, y = np.meshgrid(np.arange(across + 1.0), np.arange(up + 1.0))
    points = np.stack([x.reshape(-1), y.reshape(-1), np.zeros(x.size)], axis=1) / cells
    triangles = grid(across, up)
    middle = points[triangles].mean(axis=1)
    within = (np.floor(middle[:, :2]) % 2 == 1).all(axis=1)
    corner = points[triangles][:, :, :2]
    bricks = corner * [4.0, 8.0] + 0.25
    window = corner - np.floor(middle[:, None, :2])
    uv = np.where(within[:, None, None], window, bricks)
    return Mesh(points, triangles, within.astype(np.int32), uv)


def cylinder(columns: int, rows: int) -> Mesh:
    """An open cylinder with a texture wrapped around it once, which has a seam."""
    triangles = grid(columns, rows)
    row, column = np.divmod(np.arange((columns + 1) * (rows + 1)), columns + 1)
    a = 2 * np.pi * (column % columns) / columns
    points = np.stack([np.cos(a), np.sin(a), 2 * row / rows], axis=1)
    uv = np.stack([column / columns, row / rows], axis=1)
    return Mesh(points, triangles, uv=uv[triangles])


def edge_faces(mesh: Mesh) -> NDArray[np.int64]:
    """How many faces each edge has, of points that are told by their places."""
    _, place = np.unique(mesh.points, axis=0, return_inverse=True)
    faces = place.reshape(-1)[mesh.triangles]
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def euler(mesh: Mesh) -> int:
    """Vertices - edges + faces."""
    corners = mesh.points[mesh.triangles].reshape(-1, 3)
    return len(np.unique(corners, axis=0)) - len(edge_faces(mesh)) + len(mesh.triangles)


def normals(mesh: Mesh) -> Floats:
    """(T, 3), twice as long as the faces are large."""
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    return np.asarray(np.cross(b - a, c - a))
