"""The vertices of a shape in glTF, and the plain buffer of a cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints, Singles
from ptmtools.glb import BYTE, COMPONENTS, FLOAT, INT, ITEMS, QUANTIZATION, SHORT, BufferWriter
from ptmtools.meshopt.encoding import by_first_use
from ptmtools.output.geometry import Shape
from ptmtools.scene.colors import pack_colors, to_linear, unpack_colors

#: Whole numbers below this are written without the ".0" that Python gives them.
_WHOLE = 1e15


class VertexTables(Protocol):
    """The rows that shapes refer to.

    Attributes
    ----------
    point, uv: (n, 3), (k, 2) float32.
    """

    @property
    def point(self) -> Singles: ...

    @property
    def uv(self) -> Singles: ...


@dataclass(frozen=True)
class Vertices:
    """A shape as glTF has it; vertices differ in position, coordinates, colour or normal.

    Attributes
    ----------
    point: (n, 3) float32.
    uv: (n, 2) float32, origin at the upper left; None without a texture.
    color: (n, 4) uint16, linear light and an alpha of 1, of 65535; None where all are white.
    triangle: (m, 3)
    light: (n, 2) float32 coordinates in the lightmap, or in the normal map, origin at the upper
        left; None without one.
    normal: (n, 2) those in the normal map of a shape with a lightmap, if they are its own.
    frame: (n, 7) float32 normal, tangent and sign of the bitangent; None without a normal map.
    normals: (n, 3) int8 as in `Shape`, or None.
    """

    point: Singles
    uv: Singles | None
    color: NDArray[np.uint16] | None
    triangle: Ints
    light: Singles | None = None
    frame: Singles | None = None
    normal: Singles | None = None
    normals: NDArray[np.int8] | None = None


def vertices_of(tables: VertexTables, shape: Shape, *, textured: bool) -> Vertices:
    """The vertices of a shape in the order of their first use."""
    # A vertex for each that differs in position, texture coordinates, colour or light.
    width = len(shape.uv) if textured else 1
    corner = shape.triangle * width + (shape.uv_triangle if textured else 0)
    vertex, triangle = by_first_use(corner)
    second = None
    of_material = None if shape.relief is not None else shape.normal
    parts = [shape.light if shape.relief is None else shape.relief, of_material]
    present = [rows for rows in parts if rows is not None]
    if present:
        rows = np.concatenate(present, axis=2)
        table, place = np.unique(rows.reshape(-1, rows.shape[2]), axis=0, return_inverse=True)
        both, triangle = by_first_use(triangle * len(table) + place.reshape(-1, 3))
        vertex, second = vertex[both // len(table)], table[both % len(table)]
    rgba = None
    if shape.color is not None:
        both, triangle = by_first_use(triangle << 24 | pack_colors(shape.color))
        vertex, color = vertex[both >> 24], unpack_colors(both & 0xFFFFFF)
        second = None if second is None else second[both >> 24]
        # 8 bits of linear light would be too few in the dark.
        rgba = np.full((len(color), 4), 65535, np.uint16)
        rgba[:, :3] = np.rint(65535 * to_linear(color / 255))
    normals = None
    if shape.normals is not None:
        packed = pack_colors(shape.normals.view(np.uint8))
        both, triangle = by_first_use(triangle << 24 | packed)
        source, normals = both >> 24, unpack_colors(both & 0xFFFFFF).view(np.int8)
        vertex = vertex[source]
        second = None if second is None else second[source]
        rgba = None if rgba is None else rgba[source]
    point = tables.point[shape.point[vertex // width]]
    uv = flip_v(tables.uv[shape.uv[vertex % width]]) if textured else None
    light = None if second is None else flip_v(second[:, :2])
    frame = None if second is None or shape.relief is None else second[:, 2:]
    third = len(present) > 1 and second is not None
    normal = flip_v(second[:, 2:4]) if third and second is not None else None
    return Vertices(point, uv, rgba, triangle, light, frame, normal, normals)


def flip_v(uv: NDArray[np.floating]) -> Singles:
    """Texture coordinates with the origin at the upper left instead of the lower, or back."""
    turned = np.array(uv, dtype=np.float64)
    turned[..., 1] = 1 - turned[..., 1]
    return turned.astype(np.float32)


def shortest(values: Singles) -> list[float]:
    """The shortest numbers in JSON that read back to the same float32."""
    numbers = [float(str(value)) for value in values]
    return [int(v) if v.is_integer() and abs(v) < _WHOLE else v for v in numbers]


#: Width and height of the texture, of the lightmap or normal map, and of the normal map beside a
#: lightmap of a shape, texels; None without one.
Sizes = tuple[tuple[int, int] | None, tuple[int, int] | None, tuple[int, int] | None]
#: In the order of the views: component type and type.
_KINDS = (
    (FLOAT, "VEC3"),
    (FLOAT, "VEC2"),
    (FLOAT, "VEC4"),
    (SHORT, "VEC4"),
    (BYTE, "VEC3"),
    (INT, "SCALAR"),
    (SHORT, "SCALAR"),
)


def stride_of(component: int, form: str) -> int:
    """The bytes of an element of an array of vertices, a multiple of 4."""
    size = ITEMS[form] * np.dtype(COMPONENTS[component]).itemsize
    return int(size + -size % 4)


class PlainBuffer(BufferWriter):
    """Gathers the arrays of one cell, uncompressed: one view for each kind, one accessor for equal
    arrays.

    Vertices are in the order of their first use, so rectangles of all sizes share their six
    indices, and often their texture coordinates. Each shape has positions of its own: with one
    accessor for the whole cell the files of the sample museum are 13 % smaller, those of the
    hospital 5 %, but clients take its bounds for the shape's, and some copy all of it for each.
    """

    def __init__(self) -> None:
        super().__init__()
        self._known: dict[tuple[int, bytes], int] = {}
        self._of_kind: tuple[list[bytes], ...] = tuple([] for _ in _KINDS)
        self._sizes = [0] * len(_KINDS)
        self._targets = [0] * len(_KINDS)

    def take(self, vertices: Vertices, material: int, _: Sizes) -> dict[str, Any]:
        """The primitive of a shape. Where it has second coordinates but no first ones, glTF demands
        these, and the second ones take their place."""
        attributes = {"POSITION": self.positions(vertices.point)}
        for n, coordinates in enumerate((vertices.uv, vertices.light, vertices.normal)):
            if coordinates is not None:
                attributes[f"TEXCOORD_{n}"] = self.vectors(coordinates)
        if vertices.light is not None and vertices.uv is None:
            attributes["TEXCOORD_0"] = attributes["TEXCOORD_1"]
        if vertices.frame is not None:
            attributes["NORMAL"] = self.vectors(vertices.frame[:, :3])
            attributes["TANGENT"] = self.vectors(vertices.frame[:, 3:])
        if vertices.normals is not None:
            attributes["NORMAL"] = self.directions(vertices.normals)
        if vertices.color is not None:
            attributes["COLOR_0"] = self.shares(vertices.color)
        indices = self.indices(vertices.triangle, len(vertices.point))
        return {"attributes": attributes, "indices": indices, "material": material}

    def finish(self) -> None:
        """Nothing: primitives are complete."""

    def _append(self, accessor: dict[str, Any], data: bytes, target: int) -> int:
        kind = _KINDS.index((accessor["componentType"], accessor["type"]))
        place = self._known.setdefault((kind, data), len(self._accessors))
        if place == len(self._accessors):
            begin = {"byteOffset": self._sizes[kind]} if self._sizes[kind] else {}
            self._accessors.append({"bufferView": kind} | begin | accessor)
            self._of_kind[kind].append(data)
            self._sizes[kind] += len(data)
            self._targets[kind] = target
        return place

    def _numbers(self, values: Singles) -> list[float]:
        return shortest(values)

    def members(self) -> dict[str, Any]:
        """The members "accessors", "bufferViews" and "buffers" of the document, and the extensions
        that these use; none without arrays."""
        views: list[dict[str, Any]] = []
        place: dict[int, int] = {}
        at = 0
        for kind, (component, form) in enumerate(_KINDS):
            if not self._sizes[kind]:
                continue
            place[kind] = len(views)
            view: dict[str, Any] = {"buffer": 0} | ({"byteOffset": at} if at else {})
            view["byteLength"] = self._sizes[kind]
            # Vertex data that several accessors share must have it, indices must not.
            if form != "SCALAR" and (len(self._of_kind[kind]) > 1 or component == BYTE):
                view["byteStride"] = stride_of(component, form)
            views.append(view | {"target": self._targets[kind]})
            at += self._sizes[kind]
        if not views:
            return {}
        used = [QUANTIZATION] if self._sizes[_KINDS.index((BYTE, "VEC3"))] else []
        return ({"extensionsUsed": used, "extensionsRequired": used} if used else {}) | {
            "accessors": [a | {"bufferView": place[a["bufferView"]]} for a in self._accessors],
            "bufferViews": views,
            "buffers": [{"byteLength": at}],
        }

    def bytes(self) -> bytes:
        """All arrays."""
        return b"".join(part for parts in self._of_kind for part in parts)
