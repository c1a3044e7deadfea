"""The buffer of a cell compressed with meshopt (EXT_meshopt_compression).

All shapes of a cell share one array of vertices and one of indices; those with colours have two of
their own, and so have those with a lightmap, those with a normal map, and those with normals. A
vertex is a position, texture coordinates and coordinates in the lightmap or the normal map, or
both, float32 on the grids of `ptmtools.output.grid`, stored as 24 bits and an exponent (filter
EXPONENTIAL). Normals and tangents of normal maps are a view of their own: they are those of charts,
and take next to no bytes. Normals of curved surfaces are bytes, in another view. Shapes lie in
the order of their materials, the vertices and triangles of each in that of
`ptmtools.meshopt.encoding.reorder`. Buffer 1 is the fallback of the extension: it has no data,
and the extension is required.

Tried, in bytes for each triangle after gzip (museum, hospital, gallery, office), with a step of
0.98 mm for all, JSON included:

- Integers of 16 bits (KHR_mesh_quantization) with a node's origin and scale, and a scale of texture
  coordinates for each material: 4.3, 11.3, 3.8, 6.7. They hold 8 m where a picture hangs 2 mm in
  front of a wall, and floats must take their place beyond. This form: 4.4, 10.9, 4.1, 6.7.
- Deltas of 2 and 4 bits, which save a quarter without gzip: with them the museum has 7 % more with
  gzip, the gallery 15 %, the office 4 %. So deltas are whole bytes here.
- Components in the order of their position, extent or number of triangles: 4 to 20 % more than in
  that of the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints, Singles
from ptmtools.glb import BYTE, FLOAT, INT, NARROW, QUANTIZATION, SHORT
from ptmtools.meshopt.encoding import (
    encode_attributes,
    encode_triangles,
    exponential,
    reorder,
)
from ptmtools.output.gltf_shapes import Sizes, Vertices, shortest
from ptmtools.output.grid import texture_exponents

MESHOPT = "EXT_meshopt_compression"
#: Bytes of a position, of texture coordinates, of a colour.
_POSITION, _COORDINATES, _COLOR = 12, 8, 8
#: Columns of positions, of these and texture coordinates, of these and light, and of all these and
#: the normal map.
_PLACED, _TEXTURED, _LIT, _BOTH = 3, 5, 7, 9
#: Exponents of the steps of normal, tangent and sign, see `apo.normal_map`; bytes of a normal.
_FRAME, _NORMAL = np.array([-9] * 6 + [0]), 12
WHOLE_BYTES = 0
_NORMALIZED = {"normalized": True}


@dataclass(frozen=True)
class _BufferPart:
    """A shape on the grids.

    Attributes
    ----------
    primitive: its object in the document, to be completed.
    material: its index, by which parts are sorted.
    step: (n, 9) coordinates in steps; those of a texture, of a lightmap and of a normal map are 0
        without one.
    exponent: (9,) of the steps.
    textured, lit, both: whether it has texture coordinates, those in a lightmap or normal map, and
        those in a normal map besides.
    frame: (n, 7) in steps, or None.
    color: (n, 4) or None. normals: (n, 3) int8 or None.
    triangle: (m, 3)
    """

    primitive: dict[str, Any]
    material: int
    step: Ints
    exponent: Ints
    textured: bool
    lit: bool
    both: bool
    frame: Ints | None
    color: NDArray[np.uint16] | None
    normals: NDArray[np.int8] | None
    triangle: Ints

    @property
    def kind(self) -> tuple[bool, ...]:
        """Parts of one kind share their arrays."""
        optional = self.frame, self.color, self.normals
        return (self.lit, self.both, *(rows is not None for rows in optional))


class CompressedBuffer:
    """Gathers the shapes of one cell."""

    def __init__(self, exponent: int) -> None:
        """``exponent``: of the step of positions."""
        self._exponent = exponent
        self._parts: list[_BufferPart] = []
        self._accessors: list[dict[str, Any]] = []
        self._views: list[dict[str, Any]] = []
        self._streams: list[bytes] = []
        self._size = self._decoded = 0

    def take(self, vertices: Vertices, material: int, sizes: Sizes) -> dict[str, Any] | None:
        """The primitive of a shape, complete after `finish`; None if none of its triangles has
        three corners on the grid."""
        step = np.zeros((len(vertices.point), _BOTH), dtype=np.int64)
        exponent = np.array([self._exponent] * _PLACED + [0] * (_BOTH - _PLACED))
        step[:, :_PLACED] = _steps(vertices.point, exponent[:_PLACED])
        mapped = vertices.uv, vertices.light, vertices.normal
        for first, coordinates, size in zip((_PLACED, _TEXTURED, _LIT), mapped, sizes, strict=True):
            if coordinates is not None:
                pair = slice(first, first + 2)
                exponent[pair] = texture_exponents(coordinates, *(size or (1, 1)))
                step[:, pair] = _steps(coordinates, exponent[pair])
        more = [rows for rows in (vertices.color, vertices.normals) if rows is not None]
        columns = np.hstack([step, *more]) if more else step
        _, first, place = np.unique(columns, axis=0, return_index=True, return_inverse=True)
        corner = step[vertices.triangle, :3]
        flat = (corner == np.roll(corner, 1, axis=1)).all(axis=2).any(axis=1)
        if flat.all():
            return None
        used, triangle = reorder(place.ravel()[vertices.triangle[~flat]])
        rows = first[used]
        color = None if vertices.color is None else vertices.color[rows]
        frame = None if vertices.frame is None else _steps(vertices.frame[rows], _FRAME)
        primitive = {"attributes": {}, "indices": 0, "material": material}
        textured, lit, both = (coordinates is not None for coordinates in mapped)
        self._parts.append(
            _BufferPart(
                primitive,
                material,
                step[rows],
                exponent,
                textured,
                lit,
                both,
                frame,
                color,
                None if vertices.normals is None else vertices.normals[rows],
                triangle,
            )
        )
        return primitive

    def finish(self) -> None:
        """Encodes the arrays and completes the primitives."""
        for kind in sorted({part.kind for part in self._parts}):
            parts = [part for part in self._parts if part.kind == kind]
            self._encode(sorted(parts, key=lambda p: p.material))

    def _encode(self, parts: list[_BufferPart]) -> None:
        """Shapes of one kind."""
        lit, normal, framed, painted, curved = parts[0].kind
        step = np.concatenate([part.step for part in parts])
        exponent = np.repeat([p.exponent for p in parts], [len(p.step) for p in parts], axis=0)
        textured = any(part.textured for part in parts)
        width = _BOTH if normal else _LIT if lit else _TEXTURED if textured else _PLACED
        element = exponential(step[:, :width], exponent[:, :width])
        form = {"mode": "ATTRIBUTES", "filter": "EXPONENTIAL"}
        vertices = self._view(encode_attributes(element, WHOLE_BYTES), element, form)
        count = len(step)
        position = step[:, :3] * 2.0**self._exponent
        ends = {"min": position.min(axis=0), "max": position.max(axis=0)}
        bounds = {name: shortest(end.astype(np.float32)) for name, end in ends.items()}
        attributes = {"POSITION": self._accessor(vertices, 0, FLOAT, count, "VEC3", bounds)}
        if lit:
            place = self._accessor(vertices, _POSITION + _COORDINATES, FLOAT, count, "VEC2")
            # glTF has no second coordinates without first ones.
            attributes |= {"TEXCOORD_0": place, "TEXCOORD_1": place}
        if normal:
            begin = _POSITION + 2 * _COORDINATES
            attributes["TEXCOORD_2"] = self._accessor(vertices, begin, FLOAT, count, "VEC2")
        if framed:
            frame = np.concatenate([p.frame for p in parts if p.frame is not None])
            element = exponential(frame, np.broadcast_to(_FRAME, frame.shape))
            view = self._view(encode_attributes(element, WHOLE_BYTES), element, form)
            attributes |= {
                "NORMAL": self._accessor(view, 0, FLOAT, count, "VEC3"),
                "TANGENT": self._accessor(view, _NORMAL, FLOAT, count, "VEC4"),
            }
        if curved:
            normals = np.concatenate([p.normals for p in parts if p.normals is not None])
            element = np.pad(normals, ((0, 0), (0, 1))).view(np.uint8)
            stream = encode_attributes(element, WHOLE_BYTES)
            view = self._view(stream, element, {"mode": "ATTRIBUTES"})
            attributes["NORMAL"] = self._accessor(view, 0, BYTE, count, "VEC3", _NORMALIZED)
        both = attributes
        if textured:
            place = self._accessor(vertices, _POSITION, FLOAT, count, "VEC2")
            both = attributes | {"TEXCOORD_0": place}
        if painted:
            colors = np.concatenate([p.color for p in parts if p.color is not None]).astype("<u2")
            element = np.ascontiguousarray(colors).view(np.uint8).reshape(count, _COLOR)
            stream = encode_attributes(element, WHOLE_BYTES)
            view = self._view(stream, element, {"mode": "ATTRIBUTES"})
            color = {"COLOR_0": self._accessor(view, 0, SHORT, count, "VEC4", _NORMALIZED)}
            attributes, both = attributes | color, both | color
        self._triangles(parts, count, (attributes, both))

    def _triangles(
        self,
        parts: list[_BufferPart],
        count: int,
        attributes: tuple[dict[str, int], dict[str, int]],
    ) -> None:
        """``attributes``: of shapes without and with texture coordinates."""
        first = np.cumsum([0] + [len(part.step) for part in parts]).tolist()
        triangle = np.concatenate([p.triangle + at for p, at in zip(parts, first, strict=False)])
        kind, size = (SHORT, 2) if count <= NARROW else (INT, 4)
        element = np.empty((triangle.size, size), dtype=np.uint8)
        view = self._view(encode_triangles(triangle), element, {"mode": "TRIANGLES"})
        at = 0
        for part in parts:
            part.primitive["attributes"] = attributes[part.textured]
            corners = part.triangle.size
            part.primitive["indices"] = self._accessor(view, at, kind, corners, "SCALAR")
            at += size * corners

    def _accessor(
        self,
        view: int,
        offset: int,
        component: int,
        count: int,
        form: str,
        more: Mapping[str, Any] | None = None,
    ) -> int:
        begin = {"byteOffset": offset} if offset else {}
        row: dict[str, Any] = {"bufferView": view} | begin | {"componentType": component}
        self._accessors.append(row | {"count": count, "type": form} | dict(more or {}))
        return len(self._accessors) - 1

    def _view(self, stream: bytes, element: NDArray[np.uint8], form: Mapping[str, str]) -> int:
        """A view of encoded (count, stride) elements."""
        count, stride = element.shape
        filling = -self._size % 4
        self._size += filling
        self._streams += [bytes(filling), stream]
        begin = {"byteOffset": self._size} if self._size else {}
        source = {"buffer": 0, **begin, "byteLength": len(stream), "byteStride": stride}
        begin = {"byteOffset": self._decoded} if self._decoded else {}
        view: dict[str, Any] = {"buffer": 1, **begin, "byteLength": element.size}
        if form["mode"] == "ATTRIBUTES":
            view["byteStride"] = stride
        view["extensions"] = {MESHOPT: source | {"count": count} | dict(form)}
        self._views.append(view)
        self._size += len(stream)
        # Views of decoded data begin at multiples of 4.
        self._decoded += element.size + -element.size % 4
        return len(self._views) - 1

    def members(self) -> dict[str, Any]:
        """The members of the document, without those of shapes; none without shapes."""
        if not self._parts:
            return {}
        fallback = {"byteLength": self._decoded, "extensions": {MESHOPT: {"fallback": True}}}
        quantized = [QUANTIZATION] if any(p.normals is not None for p in self._parts) else []
        used = [MESHOPT, *quantized]
        return {
            "extensionsUsed": used,
            "extensionsRequired": used,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._size}, fallback],
        }

    def bytes(self) -> bytes:
        """The encoded arrays."""
        return b"".join(self._streams)


def _steps(values: Singles, exponent: Ints) -> Ints:
    """Coordinates in whole steps."""
    return np.rint(values.astype(np.float64) * 2.0 ** -exponent.astype(np.float64)).astype(np.int64)
