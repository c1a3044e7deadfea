"""Adds triangles to a model without adding rooms: ``enlarged(scene, kind, triangles, library)``

walls       subdivides each triangle of the opaque surfaces into k² congruent ones of about equal
            size: the structure itself gets the triangles, with T-junctions where k differs
furniture   adds copies of curved meshes, eight per room: sofas with round edges, vases, figures,
            plants of loose leaves

The result is an OBJ copy of the model with its materials, in single precision. The same arguments
give the same bytes.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np
import orjson
from numpy.typing import NDArray

from ptmtools.arrays import areas, normals
from ptmtools.cells.search import distinct
from ptmtools.scene import Scene, ingest

Floats = NDArray[np.float64]
Mesh = tuple[Floats, Floats]  # (n, 3, 3) corners and (n, 3, 2) texture coordinates

KINDS = ("walls", "furniture")
A_ROOM = 8
_LINES = 1 << 18


def enlarged(scene: Scene, kind: str, triangles: int, library: str) -> list[bytes]:
    """The OBJ, in parts, of a scene with about ``triangles`` triangles; ``library`` is its MTL."""
    corners, uv, owner = scene.corners, scene.uv, scene.triangle_object
    names, material = list(scene.objects), scene.triangle_material
    if kind == "walls":
        (corners, uv), source = _subdivided(corners, uv, scene.opaque, triangles)
        owner, material = owner[source], material[source]
    else:
        places = _places(scene)
        each = max((triangles - len(corners)) // len(places), 32)
        meshes = [
            _MESHES[i % len(_MESHES)](each, np.random.default_rng(i)) for i in range(len(places))
        ]
        of = np.repeat(np.arange(len(meshes)), [len(mesh) for mesh, _ in meshes])
        things = np.concatenate([mesh for mesh, _ in meshes]) + places[of, None]
        corners = np.concatenate([corners, things])
        uv = np.concatenate([uv, *(coordinates for _, coordinates in meshes)])
        owner = np.concatenate([owner, len(names) + of])
        material = np.concatenate([material, of % len(scene.materials)])
        names += [f"thing_{i:03d}" for i in range(len(places))]
    materials = [m.name for m in scene.materials]
    return list(_obj(corners, uv, owner, material, names, materials, library))


def _subdivided(
    corners: Floats, uv: Floats, which: NDArray[np.bool_], wanted: int
) -> tuple[Mesh, NDArray[np.int64]]:
    """Those triangles in parts of about equal area, the others as they are; and the source of
    each."""
    area = areas(corners)
    low, high = 1e-3, 1e6
    for _ in range(60):  # the density that gives as many
        density = (low * high) ** 0.5
        parts = np.where(which, np.maximum(np.round(np.sqrt(area * density)), 1), 1).astype(int)
        low, high = (low, density) if (parts**2).sum() > wanted else (density, high)
    both = np.concatenate([corners, uv], axis=2)
    actual, sources = [], []
    for k in np.unique(parts):
        rows = np.flatnonzero(parts == k)
        i, j = (n.ravel() for n in np.meshgrid(np.arange(k), np.arange(k), indexing="ij"))
        up = i + j < k
        down = i + j < k - 1
        grid = (
            np.concatenate(
                [
                    np.stack([[i[up], j[up]], [i[up] + 1, j[up]], [i[up], j[up] + 1]]),
                    np.stack(
                        [
                            [i[down] + 1, j[down]],
                            [i[down] + 1, j[down] + 1],
                            [i[down], j[down] + 1],
                        ]
                    ),
                ],
                axis=2,
            ).transpose(2, 0, 1)
            / k
        )  # (k², 3, 2) shares of the second and third corner
        share = np.concatenate([1 - grid.sum(axis=2, keepdims=True), grid], axis=2)
        actual.append(np.einsum("pcw,rwx->rpcx", share, both[rows]).reshape(-1, 3, 5))
        sources.append(np.repeat(rows, k * k))
    source = np.concatenate(sources)
    order = np.argsort(source, kind="stable")
    every = np.concatenate(actual)[order]
    return (every[..., :3], every[..., 3:]), source[order]


def _places(scene: Scene) -> Floats:
    """(n, 3) where things stand: in rows on the largest floors."""
    corners = scene.corners
    normal = normals(corners)
    floors = np.array([name.endswith("floor") for name in scene.objects])[scene.triangle_object]
    floors &= normal[:, 1] > 0.9 * np.linalg.norm(normal, axis=1)
    places = []
    for room in np.unique(scene.triangle_object[floors]):
        points = corners[floors & (scene.triangle_object == room)].reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        if (high - low)[[0, 2]].min() > 5:
            for i in range(A_ROOM):
                share = np.array([(i % 4 + 0.5) / 4, 0.0, (i // 4 + 0.5) / 2])
                places.append(low + 0.8 + share * (high - low - 1.6) - [0, 0.8, 0])
    return np.array(places)


def _sheet(rows: int, columns: int) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Angles (u around, v from pole to pole) of a closed sheet, and its triangles."""
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    i, j = (n.ravel() for n in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    a = i * (columns + 1) + j
    b = a + columns + 1
    halves = np.stack([a, a + 1, b], axis=1), np.stack([a + 1, b + 1, b], axis=1)
    return u.ravel(), v.ravel(), np.concatenate(halves)


def _closed(count: int, rng: np.random.Generator, shape: str) -> Mesh:
    rows = max(int((count / 4) ** 0.5), 2)
    u, v, faces = _sheet(rows, 2 * rows)
    around, down = 2 * np.pi * (u % 1.0), np.pi * v
    around[np.isclose(u, 1)] = 0.0
    x, y, z = np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)
    if shape == "sofa":  # a box with round edges
        power = 0.25
        x, y, z = (np.sign(c) * np.abs(c) ** power for c in (x, y, z))
        points = np.stack([0.8 * x, 0.4 * y + 0.4, 0.4 * z], axis=1)
    elif shape == "vase":
        radius = 0.25 + 0.1 * np.sin(3 * down) + 0.05 * np.cos(9 * around) * np.sin(down)
        points = np.stack([radius * x, 0.6 * (1 - np.cos(down)), radius * z], axis=1)
    else:  # a figure: a column with folds
        k = rng.integers(3, 9, 4)
        folds = 0.06 * sum(
            np.sin(n * around) * np.sin(m * down) for n, m in zip(k, k[::-1], strict=True)
        )
        points = np.stack([(0.25 + folds) * x, 0.85 * (1 + y), (0.2 + folds) * z], axis=1)
    corners = points[faces]
    whole = areas(corners) > 1e-12
    return corners[whole], np.stack([u, v], axis=1)[faces][whole]


def _plant(count: int, rng: np.random.Generator) -> Mesh:
    """Loose leaves of two triangles around a stem."""
    leaves = count // 2
    middle = rng.normal(0, 0.2, (leaves, 3)) + [0, 0.9, 0]
    along, across = rng.normal(0, 0.03, (2, leaves, 3))
    quad = np.stack([middle - along, middle - across, middle + along, middle + across], axis=1)
    uv = np.broadcast_to(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]), (leaves, 4, 2))
    fan = np.array([[0, 1, 2], [0, 2, 3]])
    return quad[:, fan].reshape(-1, 3, 3), uv[:, fan].reshape(-1, 3, 2)


_MESHES = (*(partial(_closed, shape=shape) for shape in ("sofa", "vase", "figure")), _plant)


def _obj(
    corners: Floats,
    uv: Floats,
    owner: NDArray[np.integer],
    material: NDArray[np.integer],
    names: list[str],
    materials: list[str],
    library: str,
) -> list[bytes]:
    """OBJ text with shared vertices."""
    out = [f"mtllib {library}\n".encode()]
    index = []
    for word, values in (("v", corners), ("vt", uv)):
        single = values.reshape(-1, values.shape[2]).astype(np.float32) + np.float32(0)
        first, number = distinct(single.astype(np.float64))
        rows = single[first]
        index.append(number.reshape(-1, 3) + 1)
        for begin in range(0, len(rows), _LINES):
            some = np.ascontiguousarray(rows[begin : begin + _LINES])
            text = orjson.dumps(some, option=orjson.OPT_SERIALIZE_NUMPY)
            lines = text[2:-2].replace(b"],[", b"\n" + word.encode() + b" ").replace(b",", b" ")
            out.append(word.encode() + b" " + lines + b"\n")
    pairs = np.stack(index, axis=2).reshape(-1, 6)
    order = np.lexsort((material, owner))
    group = np.stack([owner[order], material[order]], axis=1)
    cuts = np.flatnonzero(np.any(group[1:] != group[:-1], axis=1)) + 1
    for rows in np.split(order, cuts):
        out.append(f"o {names[owner[rows[0]]]}\nusemtl {materials[material[rows[0]]]}\n".encode())
        out.append(b"".join(b"f %d/%d %d/%d %d/%d\n" % tuple(row) for row in pairs[rows].tolist()))
    return out


def main(arguments: list[str]) -> int:
    model, kind, triangles, out = arguments
    parts = enlarged(ingest(model), kind, int(float(triangles)), f"{Path(model).stem}.mtl")
    Path(out).write_bytes(b"".join(parts))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
