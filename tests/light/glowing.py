"""A glTF room with lightmaps: each side of a box in a tile of one image, and a ball."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from tests.scene.conftest import GltfModel, png
from tests.systems.apo.meshes import sphere

SIDE, HEIGHT = 6.0, 3.0
#: Texels of a tile, of which the outermost are those of its edge.
TILE = 48
#: Light of the ball, of the middle of a side, and of its slopes along both edges, of 255.
BALL, MIDDLE, ALONG, ACROSS = 90, 150, 60, 30


def sides() -> list[tuple[Floats, Floats]]:
    """Of each side of the room an origin and two edges, wound inwards."""
    s, h = SIDE, HEIGHT
    rows = [
        ((0, 0, 0), (0, 0, s), (s, 0, 0)),
        ((0, h, 0), (s, 0, 0), (0, 0, s)),
        ((0, 0, 0), (s, 0, 0), (0, h, 0)),
        ((s, 0, 0), (0, 0, s), (0, h, 0)),
        ((s, 0, s), (-s, 0, 0), (0, h, 0)),
        ((0, 0, s), (0, 0, -s), (0, h, 0)),
    ]
    return [(np.array(origin, float), np.array(edges, float)) for origin, *edges in rows]


def light_at(point: Floats) -> Floats:
    """(n,) what the lightmap has at (n, 3) points of the sides, of 255; NaN between two sides."""
    result, count = np.zeros(len(point)), np.zeros(len(point))
    for origin, edges in sides():
        normal = np.cross(*edges)
        own = np.abs((point - origin) @ normal) < 1e-3 * np.linalg.norm(normal)
        share = (point[own] - origin) @ (edges / (edges**2).sum(axis=1, keepdims=True)).T
        result[own] = MIDDLE + (share - 0.5) @ [ALONG, ACROSS]
        count += own
    return np.where(count == 1, result, np.nan)


def tiles() -> np.ndarray:
    """The image: the tiles of the sides in two rows, and a third row for the ball."""
    along = np.clip((np.arange(TILE) - 2) / (TILE - 5), 0, 1) - 0.5
    tile = MIDDLE + ALONG * along[None, :] - ACROSS * along[:, None]
    rows = np.tile(tile, (2, 3))
    image = np.concatenate([rows, np.full((TILE, 3 * TILE), BALL)])
    return np.repeat(np.rint(image).astype(np.uint8)[:, :, None], 3, axis=2)


def write_lit_room(folder: Path, *, ball: int = 0, **material: Any) -> Path:
    """lit.glb; the ball has 20 · 4^``ball`` faces, 0 for none. ``material``: further fields of the
    material of the sides."""
    doc = GltfModel()
    image = doc.view(png(tiles()))
    doc.tree["images"] = [{"bufferView": image, "mimeType": "image/png"}]
    doc.tree["textures"] = [{"source": 0}]
    lit = {"doubleSided": True, "occlusionTexture": {"index": 0, "texCoord": 1}, **material}
    doc.tree["materials"] = [{"name": "lit", **lit}]
    if ball:
        points, triangles = sphere(ball, 0.05)
        points = 0.5 * points + [3, 1, 3]
        at = np.stack([points[:, 0] / SIDE, np.full(len(points), 5 / 6)], axis=1)
        doc.place(
            {
                "attributes": {
                    "POSITION": doc.add(points.astype(np.float32)),
                    "TEXCOORD_1": doc.add(at.astype(np.float32)),
                },
                "indices": doc.add(triangles.ravel().astype(np.uint16)),
                "material": 0,
            },
            name="ball",
        )
    width, inner = 3 * TILE, TILE - 5
    for k, (origin, edges) in enumerate(sides()):
        corner = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
        points = origin + corner @ edges
        left, top = TILE * (k % 3) + 2.5, TILE * (k // 3) + 2.5
        place = np.stack([left + corner[:, 0] * inner, top + (1 - corner[:, 1]) * inner], axis=1)
        doc.place(
            {
                "attributes": {
                    "POSITION": doc.add(points.astype(np.float32)),
                    "TEXCOORD_0": doc.add(corner.astype(np.float32)),
                    "TEXCOORD_1": doc.add((place / width).astype(np.float32)),
                },
                "indices": doc.add(np.array([0, 1, 2, 0, 2, 3], np.uint16)),
                "material": 0,
            },
            name=f"side {k}",
        )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "lit.glb").write_bytes(doc.glb())
    return folder / "lit.glb"
