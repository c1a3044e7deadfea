"""Builds a small campus: an OBJ with its materials and images, and a glTF."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from ptmtools.arrays import Floats

#: Metres of facade that an image covers, across and up.
TILE = 4.0


def wall(start: Sequence[float], end: Sequence[float], high: float, steps: int = 1) -> Floats:
    """(4 n, 5) corners of quads over a vertical wall: x, y, z, u, v; u along it, v up."""
    a, b = np.array(start, float), np.array(end, float)
    long = float(np.linalg.norm(b - a))
    rows = []
    for i in range(steps):
        for j in range(steps):
            for s, t in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                p = a + (b - a) * s / steps
                rows.append([p[0], high * t / steps, p[1], long * s / steps, high * t / steps])
    actual = np.array(rows)
    actual[:, 3:] /= TILE
    return actual


def level(low: Sequence[float], high: Sequence[float], y: float) -> Floats:
    """(4, 5) a level quad that faces up."""
    (x0, z0), (x1, z1) = low, high
    return np.array(
        [[x0, y, z1, 0, 0], [x1, y, z1, 1, 0], [x1, y, z0, 1, 1], [x0, y, z0, 0, 1]], float
    )


def house(
    x: float, z: float, wide: float, deep: float, high: float, steps: int
) -> dict[str, Floats]:
    """The quads of a house by material: walls outwards, a flat roof."""
    at = [(x, z), (x, z + deep), (x + wide, z + deep), (x + wide, z)]
    walls = [wall(at[i], at[(i + 1) % 4], high, steps) for i in range(4)]
    return {"facade": np.concatenate(walls), "roof": level((x, z), (x + wide, z + deep), high)}


def texture(width: int, height: int, seed: int, alpha: bool = False) -> Image.Image:
    """Smooth colours with some grain."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    texels = 120 + 60 * np.sin(x / 7 + seed)[..., None] * np.cos(y / 5)[..., None] * [1, 0.7, 0.4]
    texels = texels + random.normal(0, 6, texels.shape)
    held = np.clip(texels, 0, 255).astype(np.uint8)
    if alpha:
        through = np.where((x // 8 + y // 8) % 2, 255, 0).astype(np.uint8)
        held = np.concatenate([held, through[..., None]], axis=2)
    return Image.fromarray(held)


MTL = """newmtl facade
Kd 1 1 1
map_Kd wall.png
map_Ks shine.png
newmtl roof
Kd 0.5 0.3 0.3
newmtl lawn
Kd 1 1 1
map_Kd lawn.png
newmtl fence
Kd 1 1 1
map_Kd fence.png
"""


def write_campus(folder: Path, *, houses: int = 2, steps: int = 6) -> Path:
    """campus.obj: houses in a row that share a facade, a lawn, a fence and three small bins."""
    folder.mkdir(parents=True, exist_ok=True)
    texture(200, 100, 1).save(folder / "wall.png")
    texture(64, 64, 2).convert("L").save(folder / "shine.png")
    texture(640, 640, 3).save(folder / "lawn.png")
    texture(64, 64, 4, alpha=True).save(folder / "fence.png")
    (folder / "campus.mtl").write_text(MTL)
    objects: list[tuple[str, dict[str, Floats]]] = [
        ("lawn", {"lawn": level((-30, -30), (60, 40), 0)})
    ]
    for i in range(houses):
        objects.append((f"House {i + 1}", house(20 * i, 0, 12, 8, 9, steps)))
    objects.append(("Fence", {"fence": wall((-10, 15), (30, 15), 2)}))
    for i in range(3):
        objects.append((f"bin {i}", house(17 + 0.8 * i, 10, 0.5, 0.5, 1, 1)))
    write_obj(folder / "campus.obj", objects)
    return folder / "campus.obj"


def write_obj(file: Path, objects: Sequence[tuple[str, dict[str, Floats]]]) -> None:
    lines, at = ["mtllib campus.mtl"], 1
    for name, parts in objects:
        lines.append(f"o {name}")
        for material, rows in parts.items():
            lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z, _, _ in rows.tolist()]
            lines += [f"vt {u:.6f} {v:.6f}" for *_, u, v in rows.tolist()]
            lines.append(f"usemtl {material}")
            for k in range(at, at + len(rows), 4):
                lines.append("f " + " ".join(f"{k + c}/{k + c}" for c in range(4)))
            at += len(rows)
    file.write_text("\n".join(lines) + "\n")


def write_gltf(folder: Path, *, light: bool = True, moved: bool = False) -> Path:
    """lit.gltf: a floor of 10 m under a wall, two nodes; of the lightmap, in a second set of
    coordinates, the left half is dark. Its roughness is 0 on the left half, too. ``moved``: that
    has other coordinates than the colours."""
    folder.mkdir(parents=True, exist_ok=True)
    texture(64, 64, 5).save(folder / "base.png")
    half = np.full((64, 64, 3), 255, np.uint8)
    half[:, :32] = 40
    Image.fromarray(half).save(folder / "light.png")
    rough = np.full((64, 64, 3), 255, np.uint8)
    rough[:, :32] = 0
    Image.fromarray(rough).save(folder / "rough.png")
    point = np.array([[-5, 0, 5], [5, 0, 5], [5, 0, -5], [-5, 0, -5]], "<f4")
    upright = np.array([[-5, 0, -5], [5, 0, -5], [5, 5, -5], [-5, 5, -5]], "<f4")
    uv = np.array([[0, 4], [4, 4], [4, 0], [0, 0]], "<f4")
    second = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")
    index = np.array([0, 1, 2, 0, 2, 3], "<u2")
    arrays = [(point, "VEC3"), (upright, "VEC3"), (uv, "VEC2"), (second, "VEC2"), (index, "SCALAR")]
    data, views, accessors = b"", [], []
    for array, kind in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        size = {"componentType": 5123 if kind == "SCALAR" else 5126, "count": len(array)}
        accessors.append({"bufferView": len(views) - 1, "type": kind, **size})
        data += array.tobytes()
    (folder / "lit.bin").write_bytes(data)
    attributes = {"TEXCOORD_0": 2, "TEXCOORD_1": 3}
    material: dict[str, object] = {
        "name": "stone",
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicRoughnessTexture": {"index": 2, "texCoord": int(moved)},
        },
    }
    if light:
        material["occlusionTexture"] = {"index": 1, "texCoord": 1}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "floor", "mesh": 0}, {"name": "back", "mesh": 1}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": k, **attributes}, "indices": 4, "material": 0}
                ]
            }
            for k in (0, 1)
        ],
        "materials": [material],
        "textures": [{"source": 0}, {"source": 1}, {"source": 2}],
        "images": [{"uri": "base.png"}, {"uri": "light.png"}, {"uri": "rough.png"}],
        "buffers": [{"uri": "lit.bin", "byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    (folder / "lit.gltf").write_text(json.dumps(document))
    return folder / "lit.gltf"


def cut_glb(data: bytes, length: int) -> bytes:
    """A GLB whose header says that it is shorter."""
    return data[:8] + struct.pack("<I", length) + data[12:length]
