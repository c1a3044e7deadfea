"""Meshes with known normals, as scenes and as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ptmtools.scene.model import Material, Scene
from ptmtools.scene.orientation.main_axes import tolerance_of


def scene_of(points: np.ndarray, triangles: np.ndarray, colors: np.ndarray | None = None) -> Scene:
    count = len(triangles)
    return Scene(
        points=points.astype(np.float64),
        triangles=triangles.astype(np.int32),
        uv=np.zeros((count, 3, 2)),
        triangle_object=np.zeros(count, np.int32),
        triangle_material=np.zeros(count, np.int32),
        two_sided=np.ones(count, bool),
        objects=("statue",),
        materials=(Material("stone", (1.0, 1.0, 1.0)),),
        tolerance=tolerance_of(points, triangles),
        colors=colors,
    )


def sphere(subdivisions: int, relief: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a sphere of radius 1, with bumps."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    v = np.asarray(ball.vertices)
    bumps = np.sin(9 * v[:, 0]) * np.sin(8 * v[:, 1] + 1) * np.cos(7 * v[:, 2])
    return v * (1 + relief * bumps[:, None]), np.asarray(ball.faces)


def square(n: int, height: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A square of n × n fields, seen from above (+Y), with waves."""
    x, z = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n, indexing="ij")
    y = height * np.sin(20 * x) * np.sin(20 * z)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    b, c, d = a + 1, a + n + 2, a + n + 1
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate(
        [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    )


def ply(path: Path, points: np.ndarray, triangles: np.ndarray) -> Path:
    """Written by hand, as binary PLY."""
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(triangles), [("n", "u1"), ("v", "<i4", 3)])
    faces["n"], faces["v"] = 3, triangles
    path.write_bytes(head.encode() + points.astype("<f4").tobytes() + faces.tobytes())
    return path
