"""The meshes as GLB: geometry in world coordinates, which names materials by their number in
campus.json (docs/formats/campus.md, "Meshes").
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.arrays import Floats
from ptmtools.glb import (
    BINARY,
    JSON,
    BufferWriter,
    elements,
    glb_chunks,
    meaning,
    natural,
    one_mesh,
)
from ptmtools.output.gltf_shapes import flip_v
from ptmtools_systems.campus.model import CampusMaterial

_ADD: dict[str, Callable[[BufferWriter, NDArray[Any]], int]] = {
    "POSITION": BufferWriter.positions,
    "TEXCOORD_0": BufferWriter.vectors,
    "TEXCOORD_1": BufferWriter.vectors,
    "COLOR_0": BufferWriter.shares,
}


@dataclass(frozen=True)
class Corners:
    """A mesh as corners of its faces.

    Attributes
    ----------
    point: (T, 3, 3) metres.
    material: (T,) indices into those of the campus.
    uv: (T, 3, 2) origin at the lower left; ignored without textures.
    light: (T, 3, 2) coordinates of the lightmap, or None.
    color: (T, 3, 3) linear, or None if all are white.
    """

    point: Floats
    material: NDArray[np.integer[Any]]
    uv: Floats
    light: Floats | None = None
    color: Floats | None = None


def mesh_bytes(mesh: Corners, materials: tuple[CampusMaterial, ...]) -> bytes:
    """The GLB of a mesh, of at least one face."""
    buffer = BufferWriter()
    primitives: list[dict[str, Any]] = []
    named: list[dict[str, Any]] = []
    for index in np.unique(mesh.material).tolist():
        faces = np.flatnonzero(mesh.material == index)
        material = materials[index]
        data: dict[str, NDArray[Any]] = {"POSITION": mesh.point[faces].astype("<f4")}
        if material.base is not None:
            data["TEXCOORD_0"] = flip_v(mesh.uv[faces])
        if mesh.light is not None:
            data["TEXCOORD_1"] = flip_v(mesh.light[faces])
        if mesh.color is not None:
            texels = np.full((len(faces), 3, 4), 65535, "<u2")
            texels[..., :3] = np.rint(65535 * np.clip(mesh.color[faces], 0, 1))
            data["COLOR_0"] = texels
        rows = [part.reshape(3 * len(faces), -1).view(np.uint8) for part in data.values()]
        first, triangle = _vertices(np.concatenate(rows, axis=1))
        vertices = {name: part.reshape(-1, part.shape[-1])[first] for name, part in data.items()}
        primitives.append(
            {
                "attributes": {name: _ADD[name](buffer, part) for name, part in vertices.items()},
                "indices": buffer.indices(triangle, len(first)),
                "material": len(named),
            }
        )
        entry: dict[str, Any] = {
            "name": material.base or material.name,
            "extras": {"material": index},
        }
        named.append(entry | ({"doubleSided": True} if material.two_sided else {}))
    return one_mesh(primitives, buffer, {"materials": named})


@dataclass(frozen=True)
class Primitive:
    """The part of a GLB with one material, read back.

    Attributes
    ----------
    material: its number in the campus.
    point: (n, 3) metres.
    triangle: (m, 3) indices into the vertices.
    uv, light: (n, 2) texture coordinates, origin at the upper left, or None.
    color: (n, 3) linear, or None.
    """

    material: int
    point: Floats
    triangle: NDArray[np.int64]
    uv: Floats | None
    light: Floats | None
    color: Floats | None


def read_mesh(data: bytes) -> tuple[Primitive, ...]:
    """The primitives of a GLB that `mesh_bytes` wrote.

    Raises ValueError, with what is wrong, for anything else.
    """
    chunks = glb_chunks(data)
    if [kind for kind, *_ in chunks] != [JSON, BINARY]:
        raise ValueError("not one chunk of JSON and one of bytes")
    document, binary = schemas.parse(chunks[0][2]), chunks[1][2]
    try:
        view_bytes(document, binary)
        wanted = document["meshes"][0]["primitives"]
        unread = len(binary)
        parts = []
        for primitive in wanted:
            parts.append(_read(document, binary, primitive))
            # Each has arrays of its own, so all together are no larger than the bytes.
            unread -= parts[-1].point.size * 4
            if unread < 0:
                raise ValueError("primitives that share their arrays")
    except (LookupError, TypeError, AttributeError) as fault:
        raise ValueError(f"not as a mesh of a campus is ({fault})") from None
    if not parts:
        raise ValueError("no primitives")
    return tuple(parts)


def view_bytes(document: Any, binary: bytes) -> int:
    """Bytes of all vertices and indices of a GLB in graphics memory.

    Raises ValueError if its views exceed its bytes, LookupError or TypeError for invalid glTF.
    """
    total = sum(natural(view["byteLength"]) for view in document["bufferViews"])
    if total > len(binary):
        raise ValueError(f"views of {total} bytes in {len(binary)}")
    return total


def _read(document: Any, binary: bytes, primitive: Mapping[str, Any]) -> Primitive:
    def values(index: object) -> Floats | None:
        if index is None:
            return None
        accessor = document["accessors"][index]
        stored = elements(accessor, document["bufferViews"][accessor["bufferView"]], binary)
        return meaning(stored, bool(accessor.get("normalized")))

    named = primitive["attributes"]
    point, indices = values(named["POSITION"]), values(primitive["indices"])
    if point is None or indices is None:
        raise ValueError("a primitive without positions or indices")
    uv, light, color = (values(named.get(n)) for n in ("TEXCOORD_0", "TEXCOORD_1", "COLOR_0"))
    for part, components in ((point, 3), (uv, 2), (light, 2), (color, 4)):
        if part is None:
            continue
        if len(part) != len(point) or not np.isfinite(part).all():
            raise ValueError("attributes of other lengths, or not finite")
        if part.shape[1] != components:
            raise ValueError(f"an attribute of {part.shape[1]} components instead of {components}")
    if not len(indices) or len(indices) % 3 or indices.min() < 0 or indices.max() >= len(point):
        raise ValueError("indices that are no triangles of the vertices")
    material = document["materials"][primitive["material"]]["extras"]["material"]
    if type(material) is not int:
        raise ValueError("a material without a number")
    return Primitive(
        material,
        point,
        indices.reshape(-1, 3).astype(np.int64),
        uv,
        light,
        None if color is None else color[:, :3],
    )


def _vertices(rows: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The first of each distinct one of (3 m, bytes) corners, ascending, and (m, 3) the number of
    each corner among them."""
    kept = np.ascontiguousarray(rows).view(f"V{rows.shape[1]}").ravel()
    _, first, place = np.unique(kept, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[place.ravel()].reshape(-1, 3)
