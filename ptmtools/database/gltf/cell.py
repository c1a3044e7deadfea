"""A cell as a GLB: a node and a mesh for each object, a primitive for each of its shapes.

The shapes are those of the VRML file, in its order. Triangles are indexed; a vertex is a position
with, where the material has an image, its texture coordinates, whose origin is the upper left in
glTF, and with its colour where the shape has several. There are no normals: the scene has none, and
surfaces without are flat (glTF 2.0, section 3.7.2.1). Each shape has positions of its own: with one
accessor for the whole cell the files of the sample museum are 13 % smaller, those of the hospital
5 %, but clients take its bounds for the shape's, and some copy all of it for each.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.content import Content
from ptmtools.database.geometry import Geometry, Shape
from ptmtools.database.gltf.buffer import BufferWriter
from ptmtools.database.gltf.container import pack
from ptmtools.database.gltf.material import MaterialWriter
from ptmtools.database.names import GLTF_FILES, cell_name, path_of
from ptmtools.scene.colors import packed, to_linear, unpacked
from ptmtools.scene.model import Scene


def gltf_files(content: Content) -> Iterator[tuple[str, bytes]]:
    """Path, relative to the served folder, and bytes of every GLB.

    Raises LimitError: PTM-L600 a cell is longer than a GLB can be.
    """
    count = content.cells.cell_count
    for cell in range(count):
        content.progress(cell, count, "glTF")
        yield path_of(cell, GLTF_FILES), _glb(content, cell)
    content.progress(count, count, "glTF")


def flipped(uv: NDArray[np.floating]) -> NDArray[np.float32]:
    """Texture coordinates with the origin at the upper left instead of the lower, or back."""
    turned = np.array(uv, dtype=np.float64)
    turned[..., 1] = 1 - turned[..., 1]
    return turned.astype(np.float32)


def _glb(content: Content, cell: int) -> bytes:
    scene, geometry, buffer = content.scene, content.geometry, BufferWriter()
    materials = MaterialWriter(scene.materials, content.records, content.options.fallback)
    nodes: list[dict[str, Any]] = []
    node: dict[str, Any]
    meshes: list[dict[str, Any]] = []
    last = -1
    for shape in geometry.shapes(cell):
        if shape.object != last:
            last = shape.object
            node = {"name": scene.objects[shape.object], "mesh": len(meshes)}
            if (octree := content.octree_of.get(shape.object)) is not None:
                node["extras"] = {"octree": octree}
            nodes.append(node)
            meshes.append({"primitives": []})
        meshes[-1]["primitives"].append(_primitive(scene, geometry, shape, buffer, materials))
    top: dict[str, Any] = {"name": cell_name(cell), "extras": {"cell": cell}}
    if nodes:
        top["nodes"] = list(range(len(nodes)))
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "ptmtools"},
        "scene": 0,
        "scenes": [top],
    }
    if nodes:
        document |= {"nodes": nodes, "meshes": meshes}
    members, binary = buffer.finish()
    return pack(document | materials.members() | members, binary)


def _primitive(
    scene: Scene,
    geometry: Geometry,
    shape: Shape,
    buffer: BufferWriter,
    materials: MaterialWriter,
) -> dict[str, Any]:
    textured = scene.materials[shape.material].image >= 0
    # A vertex for each that differs in position, texture coordinates or colour.
    width = len(shape.uv) if textured else 1
    corner = shape.triangle * width + (shape.uv_triangle if textured else 0)
    vertex, triangle = _by_first_use(corner)
    color = None
    if shape.color is not None:
        both, triangle = _by_first_use(triangle << 24 | packed(shape.color))
        vertex, color = vertex[both >> 24], unpacked(both & 0xFFFFFF)
    attributes = {"POSITION": buffer.positions(geometry.point[shape.point[vertex // width]])}
    if textured:
        uv = geometry.uv[shape.uv[vertex % width]]
        attributes["TEXCOORD_0"] = buffer.coordinates(flipped(uv))
    if color is not None:
        attributes["COLOR_0"] = buffer.colors(to_linear(color / 255))
    return {
        "attributes": attributes,
        "indices": buffer.indices(triangle, len(vertex)),
        "material": materials.take(shape.material, shape.two_sided),
    }


def _by_first_use(corner: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The distinct values of an (m, 3) array, in the order in which they come, and (m, 3) where
    each is among them."""
    distinct, first, place = np.unique(corner.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return distinct[order], rank[place.ravel()].reshape(-1, 3)
