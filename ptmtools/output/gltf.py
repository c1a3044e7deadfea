"""A cell as a GLB: a node and a mesh for each object, a primitive for each of its shapes.

The shapes are those of the VRML file, in its order. Triangles are indexed; a vertex is a position
with, where the material has an image, its texture coordinates, whose origin is the upper left in
glTF, and with its colour where the shape has several. There are no normals: the scene has none, and
surfaces without are flat (glTF 2.0, section 3.7.2.1). Each shape has positions of its own: with one
accessor for the whole cell the files of the sample museum are 13 % smaller, those of the hospital
5 %, but clients take its bounds for the shape's, and some copy all of it for each.

One buffer view holds each kind of data: positions, texture coordinates, colours, wide indices,
narrow ones. Equal arrays share an accessor. Vertices are in the order of their first use, so
rectangles of all sizes share their six indices, and often their texture coordinates.

docs/formats/gltf.md lists the members of a material by the properties of the scene's.

(Tried: the texture as emissiveTexture over black, which shows it texel for texel as VRML does,
without KHR_materials_unlit. Clients then have no base colour texture to replace with their own, and
alpha still needs one.)
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.errors import LimitError
from ptmtools.glb import (
    BINARY,
    COMPONENTS,
    FLOAT,
    INT,
    ITEMS,
    JSON,
    SHORT,
    BufferWriter,
    glb,
    glb_chunks,
)
from ptmtools.output.content import Content, Geometry, Shape
from ptmtools.output.model import FileError, TextureRecord, shaped
from ptmtools.output.names import GLTF_FILES, UP, cell_name, path_of
from ptmtools.scene.colors import packed, to_linear, unpacked
from ptmtools.scene.model import Material, Scene, Wrap

#: In the order of the views: component type and type.
_KINDS = ((FLOAT, "VEC3"), (FLOAT, "VEC2"), (SHORT, "VEC4"), (INT, "SCALAR"), (SHORT, "SCALAR"))
#: Whole numbers below this are written without the ".0" that Python gives them.
_WHOLE = 1e15


class CellBufferWriter(BufferWriter):
    """Gathers the arrays of one cell: one view for each kind, one accessor for equal arrays."""

    def __init__(self) -> None:
        super().__init__()
        self._known: dict[tuple[int, bytes], int] = {}
        self._of_kind: tuple[list[bytes], ...] = tuple([] for _ in _KINDS)
        self._sizes = [0] * len(_KINDS)
        self._targets = [0] * len(_KINDS)

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

    def _numbers(self, values: NDArray[np.float32]) -> list[float]:
        shortest = super()._numbers(values)
        return [int(v) if v.is_integer() and abs(v) < _WHOLE else v for v in shortest]

    def members(self) -> dict[str, Any]:
        """The members "accessors", "bufferViews" and "buffers" of the document; none without
        arrays."""
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
            if form != "SCALAR" and len(self._of_kind[kind]) > 1:
                view["byteStride"] = ITEMS[form] * np.dtype(COMPONENTS[component]).itemsize
            views.append(view | {"target": self._targets[kind]})
            at += self._sizes[kind]
        return (
            {}
            if not views
            else {
                "accessors": [a | {"bufferView": place[a["bufferView"]]} for a in self._accessors],
                "bufferViews": views,
                "buffers": [{"byteLength": at}],
            }
        )

    def bytes(self) -> bytes:
        """All arrays."""
        return b"".join(part for parts in self._of_kind for part in parts)


_LARGEST = 2**32 - 1
#: The most bytes around JSON and buffer: headers and padding.
_AROUND = 34


def pack(document: Mapping[str, Any], binary: bytes) -> bytes:
    """A GLB of a JSON document and the bytes of its only buffer, which may be empty.

    Raises LimitError: PTM-L400 it is longer than a GLB can be, 4 GiB.
    """
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode(
        "utf-8", "replace"
    )
    if (length := len(text) + len(binary) + _AROUND) > _LARGEST:
        raise LimitError(
            "PTM-L400",
            f"a cell takes {length:,} bytes as GLB, more than the format can hold",
            remedy="make smaller cells, or leave gltf out of --format",
        )
    return glb([(JSON, text), (BINARY, binary)][: 2 if binary else 1])


def unpack(data: bytes) -> tuple[Any, bytes]:
    """The JSON document of a GLB and its bytes, padding included.

    Raises FileError: PTM-D731 if `pack` does not write such a file.
    """
    try:
        chunks = [(kind, body) for kind, _, body in glb_chunks(data)]
        if [kind for kind, _ in chunks[1:]] not in ([], [BINARY]) or glb(chunks) != data:
            raise ValueError("not JSON and BIN alone, each of a multiple of 4 bytes", "byte 12")
    except ValueError as fault:
        raise FileError("PTM-D731", fault.args[1], fault.args[0]) from None
    with shaped("PTM-D731", "JSON"):
        return schemas.parse(chunks[0][1]), b"".join(body for _, body in chunks[1:])


#: A sampler's number for each behaviour outside [0, 1]; the first is the default.
WRAPS: dict[Wrap, int] = {"repeat": 10497, "clamp": 33071}
WHITE = [1.0, 1.0, 1.0, 1.0]


@lru_cache(maxsize=4096)
def linear(color: float) -> float:
    """A component encoded as sRGB (IEC 61966-2-1) as linear light, single precision."""
    return float(str(np.float32(to_linear(np.array(color)))))


class MaterialWriter:
    """Gathers the materials of one GLB."""

    def __init__(
        self,
        materials: tuple[Material, ...],
        textures: Mapping[int, tuple[int, TextureRecord]],
        fallback: bool,
    ) -> None:
        """``textures``: for every image its index in the hints' list, and its record."""
        self._scene = materials
        self._records = textures
        self._fallback = fallback
        self._known: dict[tuple[int, bool], int] = {}
        self._materials: list[dict[str, Any]] = []
        self._textures: dict[tuple[int, int], int] = {}
        self._images: dict[str, int] = {}
        self._samplers: dict[tuple[Wrap, Wrap], int] = {}

    def take(self, material: int, two_sided: bool) -> int:
        """The index of a scene's material, seen from one side or from both."""
        place = self._known.setdefault((material, two_sided), len(self._materials))
        if place == len(self._materials):
            self._materials.append(self._material(self._scene[material], two_sided))
        return place

    def members(self) -> dict[str, Any]:
        """The document's "materials", "textures", "images" and "samplers"."""
        textures: list[dict[str, Any]] = []
        for image, sampler in self._textures:
            textures.append({"source": image} | ({} if sampler < 0 else {"sampler": sampler}))
        lists = {
            "materials": self._materials,
            "textures": textures,
            "images": [{"uri": uri} for uri in self._images],
            "samplers": [_wrap(*wraps) for wraps in self._samplers],
        }
        return {name: rows for name, rows in lists.items() if rows}

    def _material(self, material: Material, two_sided: bool) -> dict[str, Any]:
        alpha = min(max(material.opacity, 0.0), 1.0)
        factor = [*map(linear, material.color), float(str(np.float32(alpha)))]
        surface: dict[str, Any] = {} if factor == WHITE else {"baseColorFactor": factor}
        extras: dict[str, Any] = {}
        blends, cutoff = alpha < 1, None
        if material.image >= 0:
            place, record = self._records[material.image]
            if material.transparent and record.components in (2, 4):
                blends, cutoff = True, material.cutoff
            extras = {"ptm": UP + quote(record.file), "texture": place}
            extras |= _wrap(material.wrap_s, material.wrap_t)
            if self._fallback and record.fallback is not None:
                index = self._texture(UP + quote(record.fallback), material)
                surface["baseColorTexture"] = {"index": index}
        row: dict[str, Any] = {"name": material.name}
        row["pbrMetallicRoughness"] = surface | {"metallicFactor": 0}
        if cutoff is not None:
            row |= {"alphaMode": "MASK", "alphaCutoff": cutoff}
        elif blends:
            row["alphaMode"] = "BLEND"
        if two_sided:
            row["doubleSided"] = True
        return row | ({"extras": extras} if extras else {})

    def _texture(self, uri: str, material: Material) -> int:
        wraps = (material.wrap_s, material.wrap_t)
        sampler = -1
        if wraps != ("repeat", "repeat"):
            sampler = self._samplers.setdefault(wraps, len(self._samplers))
        image = self._images.setdefault(uri, len(self._images))
        return self._textures.setdefault((image, sampler), len(self._textures))


def _wrap(s: Wrap, t: Wrap) -> dict[str, int]:
    named = {"wrapS": s, "wrapT": t}
    return {name: WRAPS[wrap] for name, wrap in named.items() if wrap != "repeat"}


def gltf_files(content: Content) -> Iterator[tuple[str, bytes]]:
    """Path, relative to the served folder, and bytes of every GLB.

    Raises LimitError: PTM-L400 a cell is longer than a GLB can be.
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
    scene, geometry, buffer = content.scene, content.geometry, CellBufferWriter()
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
    return pack(document | materials.members() | buffer.members(), buffer.bytes())


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
        attributes["TEXCOORD_0"] = buffer.vectors(flipped(uv))
    if color is not None:
        # 8 bits of linear light would be too few in the dark.
        rgba = np.full((len(color), 4), 65535, "<u2")
        rgba[:, :3] = np.rint(65535 * to_linear(color / 255))
        attributes["COLOR_0"] = buffer.shares(rgba)
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
