"""Grids of points with texture coordinates, and the OBJ text of many of them.

Every surface of the atrium is a grid: a plane, a solid of revolution, a ring of an arch, a drape.
The corners of a grid are shared; its front is at the left of rows times columns (right-handed).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Sheet:
    """An object's surface in one material.

    Attributes
    ----------
    name: of the object. material: its name.
    points: (rows, columns, 3) metres. uv: (rows, columns, 2).
    """

    name: str
    material: str
    points: Floats
    uv: Floats

    @property
    def triangle_count(self) -> int:
        """Two for each square of the grid."""
        rows, columns = self.points.shape[:2]
        return int(2 * (rows - 1) * (columns - 1))


def plane(
    name: str, material: str, corner: Vector, right: Vector, up: Vector, tile: float
) -> Sheet:
    """A parallelogram; the image repeats every ``tile`` metres. Front: right × up."""
    a, u, v = (np.array(x, dtype=np.float64) for x in (corner, right, up))
    points = np.array([[a, a + u], [a + v, a + u + v]])
    wide, tall = np.linalg.norm(u) / tile, np.linalg.norm(v) / tile
    uv = np.array([[[0, 0], [wide, 0]], [[0, tall], [wide, tall]]])
    return Sheet(name, material, points, uv)


def picture(name: str, material: str, corner: Vector, right: Vector, up: Vector) -> Sheet:
    """A parallelogram that shows its image once."""
    sheet = plane(name, material, corner, right, up, 1.0)
    uv = np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]])
    return Sheet(name, material, sheet.points, uv)


def box(
    name: str, material: str, low: Vector, high: Vector, tile: float, sides: str = "xXyYzZ"
) -> list[Sheet]:
    """The outward faces of a solid box; ``sides``: x at the low end, X at the high end, …"""
    (x, y, z), (w, h, d) = low, tuple(b - a for a, b in zip(low, high, strict=True))
    faces: dict[str, tuple[Vector, Vector, Vector]] = {
        "x": (low, (0, 0, d), (0, h, 0)),
        "X": ((x + w, y, z + d), (0, 0, -d), (0, h, 0)),
        "y": (low, (w, 0, 0), (0, 0, d)),
        "Y": ((x, y + h, z + d), (w, 0, 0), (0, 0, -d)),
        "z": ((x + w, y, z), (-w, 0, 0), (0, h, 0)),
        "Z": ((x, y, z + d), (w, 0, 0), (0, h, 0)),
    }
    return [plane(name, material, *faces[side], tile) for side in sides]


def revolve(
    name: str,
    material: str,
    profile: Sequence[tuple[float, float]],
    segments: int,
    foot: Vector,
    turns: int,
    *,
    flutes: int = 0,
    depth: float = 0.0,
) -> Sheet:
    """A solid of revolution about the vertical through ``foot``.

    ``profile``: radius and height from the bottom up, metres. The image goes ``turns`` times
    around. ``flutes`` hollows of ``depth``, a share of the radius, run up the surface.
    """
    angle = 2 * math.pi * np.arange(segments + 1) / segments
    angle[-1] = 0.0  # closed exactly
    radius, height = np.array(profile, dtype=np.float64).T
    hollow = 1 - depth * np.abs(np.sin(flutes * angle / 2)) if flutes else np.ones(segments + 1)
    across = radius[:, None] * hollow
    points = np.stack(
        [
            foot[0] + across * np.cos(angle),
            foot[1] + np.broadcast_to(height[:, None], across.shape),
            foot[2] - across * np.sin(angle),
        ],
        axis=2,
    )
    around = 2 * math.pi * radius.max() / turns
    u = np.broadcast_to(np.linspace(0, turns, segments + 1), across.shape)
    along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(radius), np.diff(height)))])
    v = np.broadcast_to((along / around)[:, None], across.shape)
    return Sheet(name, material, points, np.stack([u, v], axis=2))


def smooth(
    profile: Sequence[tuple[float, float]], points_per_piece: int
) -> list[tuple[float, float]]:
    """A profile with so many points to a piece, on a Catmull-Rom curve through its points."""
    p = np.array([profile[0], *profile, profile[-1]], dtype=np.float64)
    actual = [profile[0]]
    for k in range(1, len(p) - 2):
        a, b, c, d = p[k - 1 : k + 3]
        for t in np.arange(1, points_per_piece + 1) / points_per_piece:
            point = (
                2 * b
                + (c - a) * t
                + (2 * a - 5 * b + 4 * c - d) * t**2
                + (3 * b - 3 * c + d - a) * t**3
            ) / 2
            actual.append((max(float(point[0]), 0.0), float(point[1])))
    return actual


def obj_text(sheets: Sequence[Sheet], head: Sequence[str], library: str) -> str:
    """The OBJ text of all sheets: 0.1 mm, texture coordinates to 1e-5."""
    lines = [*head, f"mtllib {library}"]
    first, name, material = 1, "", ""
    for sheet in sheets:
        rows, columns = sheet.points.shape[:2]
        if sheet.name != name:
            name = sheet.name
            lines.append(f"o {name}")
            material = ""
        lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in sheet.points.reshape(-1, 3).tolist()]
        lines += [f"vt {u:.5f} {v:.5f}" for u, v in sheet.uv.reshape(-1, 2).tolist()]
        if sheet.material != material:
            material = sheet.material
            lines.append(f"usemtl {material}")
        number = first + np.arange(rows * columns).reshape(rows, columns)
        a, b = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
        c, d = number[1:, 1:].ravel(), number[1:, :-1].ravel()
        corners = np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1)
        for i, j, k in corners.reshape(-1, 3).tolist():
            lines.append(f"f {i}/{i} {j}/{j} {k}/{k}")
        first += rows * columns
    return "\n".join(lines) + "\n"
