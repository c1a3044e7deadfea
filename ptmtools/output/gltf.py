"""A cell as a GLB: a node and a mesh for each object, a primitive for each of its shapes.

Of an object with levels of detail (`ptmtools.output.mesh_levels`) it holds the coarsest mesh, and
further GLBs hold one finer mesh each. The material of a coarsest mesh names its row in the hints,
as materials are all that the GLBs of a site keep of objects.

The shapes are those of the VRML file, in its order. Triangles are indexed; a vertex is a position
with, where the material has an image, its texture coordinates, whose origin is the upper left in
glTF, its colour where the shape has several, and its coordinates in the lightmap of the cell, or
in the normal map of the object with normal and tangent of the frame there. Other shapes have no
normals: the scene has none, and surfaces without are flat (glTF 2.0, section 3.7.2.1).

The buffer is compressed (`ptmtools.output.gltf_compressed`) or plain
(`ptmtools.output.gltf_shapes`). docs/formats/gltf.md lists the members of a material by the
properties of the scene's.

(Tried: the texture as emissiveTexture over black, which shows it texel for texel as VRML does,
without KHR_materials_unlit. Clients then have no base colour texture to replace with their own, and
alpha still needs one.)
"""

from __future__ import annotations

import json
from collections.abc import Container, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import PurePath
from types import MappingProxyType
from typing import Any
from urllib.parse import quote

import numpy as np

from ptmtools import schemas
from ptmtools.errors import LimitError
from ptmtools.glb import BINARY, JSON, glb, glb_chunks
from ptmtools.output.content import Content
from ptmtools.output.geometry import Shape
from ptmtools.output.gltf_compressed import CompressedBuffer
from ptmtools.output.gltf_shapes import PlainBuffer, Sizes, VertexTables, vertices_of
from ptmtools.output.model import FileError, TextureRecord, convert_shape_errors
from ptmtools.output.names import GLTF_FILES, UP, cell_name, mesh_name, mesh_path, path_of
from ptmtools.output.numbers import significant
from ptmtools.output.representation import node_extras, replaced_objects
from ptmtools.scene.colors import to_linear
from ptmtools.scene.model import Material, Wrap

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
    with convert_shape_errors("PTM-D731", "JSON"):
        return schemas.parse(chunks[0][1]), b"".join(body for _, body in chunks[1:])


#: A sampler's number for each behaviour outside [0, 1]; the first is the default.
WRAPS: dict[Wrap, int] = {"repeat": 10497, "clamp": 33071}
WHITE = [1.0, 1.0, 1.0, 1.0]
#: The extension that names an image, by suffix; glTF itself has PNG and JPEG.
IMAGE_EXTENSIONS = {".avif": "EXT_texture_avif", ".webp": "EXT_texture_webp"}


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
        lightmap: tuple[int, TextureRecord] | None,
        white: float | None,
        reliefs: Mapping[int, tuple[int, TextureRecord]],
        probe: int | None = None,
        lamps: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        """``textures``: for every image its index in the hints' list, and its record; ``lightmap``
        and ``reliefs``: the same for the lightmap of the cell, and for the normal maps of
        objects; ``white``: see `Light`; ``probe``: the index of that of the cell; ``lamps``: the
        `white` of materials that are lamps."""
        self._scene = materials
        self._records = textures
        self._lightmap, self._white, self._probe, self._lamps = lightmap, white, probe, lamps
        self._reliefs = reliefs
        self._fallback = fallback
        self._known: dict[tuple[Any, ...], int] = {}
        self._materials: list[dict[str, Any]] = []
        self._textures: dict[tuple[int, int], int] = {}
        self._images: dict[str, int] = {}
        self._samplers: dict[tuple[Wrap, Wrap], int] = {}

    def take(
        self,
        material: int,
        two_sided: bool,
        mesh: int | None,
        *,
        lit: bool,
        mapped: bool,
        reflects: bool = False,
        relief: int | None = None,
        normal: int | None = None,
    ) -> int:
        """The index of a scene's material, seen from one side or from both; of a coarsest mesh with
        finer ones, its row in the hints is ``mesh``. ``lit``, ``mapped``, ``reflects``: whether it
        has light, and in the lightmap, and shows the probe; ``relief``: the object whose normal map
        it has; ``normal``: the number of the coordinates in its own."""
        key = material, two_sided, mesh, lit, mapped, reflects, relief, normal
        place = self._known.setdefault(key, len(self._materials))
        if place == len(self._materials):
            row = self._material(self._scene[material], two_sided, mesh)
            if lit or material in self._lamps:
                white = self._white if lit else self._lamps[material]
                row["extras"] = row.get("extras", {}) | {"white": white}
            if reflects:
                row["extras"] = row.get("extras", {}) | {"probe": self._probe}
                if not lit:
                    # Panes whose roughness is not stated are smooth.
                    rough = self._scene[material].roughness
                    row["pbrMetallicRoughness"]["roughnessFactor"] = rough if rough < 1 else 0
            if mapped:
                assert self._lightmap
                self._add(row, "light", "occlusionTexture", *self._lightmap)
            if relief is not None:
                self._add(row, "normal", "normalTexture", *self._reliefs[relief])
            elif normal is not None:
                self._add_normal(row, self._scene[material], normal)
            self._materials.append(row)
        return place

    def _add(
        self, row: dict[str, Any], extra: str, member: str, place: int, record: TextureRecord
    ) -> None:
        """Gives a material a texture that is no image of the scene."""
        row["extras"] = row.get("extras", {}) | {extra: place}
        if self._fallback and record.fallback is not None:
            index = self._texture(UP + quote(record.fallback), "clamp", "clamp")
            row[member] = {"index": index, "texCoord": 1}

    def _add_normal(self, row: dict[str, Any], material: Material, coords: int) -> None:
        """Gives a material its normal map."""
        use = material.normal
        assert use
        place, record = self._records[use.image]
        wraps = {
            f"normal{name[0].upper()}{name[1:]}": number
            for name, number in _wrap(use.wrap_s, use.wrap_t).items()
        }
        scale = {} if use.scale == 1 else {"normalScale": use.scale}
        extras = {"normal": place, "normalCoords": coords, **scale, **wraps}
        row["extras"] = row.get("extras", {}) | extras
        if self._fallback and record.fallback is not None:
            index = self._texture(UP + quote(record.fallback), use.wrap_s, use.wrap_t)
            coordinates = {"texCoord": coords} if coords else {}
            row["normalTexture"] = {"index": index, **coordinates} | (
                {"scale": use.scale} if scale else {}
            )

    def members(self) -> dict[str, Any]:
        """The document's "materials", "textures", "images" and "samplers"."""
        uris = list(self._images)
        textures: list[dict[str, Any]] = []
        for image, sampler in self._textures:
            source: dict[str, Any] = {"source": image}
            if extension := IMAGE_EXTENSIONS.get(PurePath(uris[image]).suffix):
                source = {"extensions": {extension: source}}
            textures.append(source | ({} if sampler < 0 else {"sampler": sampler}))
        lists = {
            "materials": self._materials,
            "textures": textures,
            "images": [{"uri": uri} for uri in self._images],
            "samplers": [_wrap(*wraps) for wraps in self._samplers],
        }
        return {name: rows for name, rows in lists.items() if rows}

    @property
    def extensions(self) -> list[str]:
        """The extensions that the images use."""
        used = {IMAGE_EXTENSIONS.get(PurePath(uri).suffix, "") for uri in self._images}
        return sorted(used - {""})

    def _material(self, material: Material, two_sided: bool, mesh: int | None) -> dict[str, Any]:
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
                index = self._texture(UP + quote(record.fallback), material.wrap_s, material.wrap_t)
                surface["baseColorTexture"] = {"index": index}
        if mesh is not None:
            extras["mesh"] = mesh
        row: dict[str, Any] = {"name": material.name}
        surface["metallicFactor"] = material.metallic or 0
        if material.roughness != 1:
            surface["roughnessFactor"] = material.roughness
        row["pbrMetallicRoughness"] = surface
        if cutoff is not None:
            row |= {"alphaMode": "MASK", "alphaCutoff": cutoff}
        elif blends:
            row["alphaMode"] = "BLEND"
        if two_sided:
            row["doubleSided"] = True
        return row | ({"extras": extras} if extras else {})

    def _texture(self, uri: str, *wraps: Wrap) -> int:
        sampler = -1
        if wraps != ("repeat", "repeat"):
            sampler = self._samplers.setdefault((wraps[0], wraps[1]), len(self._samplers))
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
        content.extras.progress(cell, count, "glTF")
        yield (
            path_of(cell, GLTF_FILES),
            _glb(content, cell, cell_name(cell), _drawn_shapes(content, cell)),
        )
    content.extras.progress(count, count, "glTF")
    for mesh in content.meshes:
        finest = [s for s in content.lit_geometry.shapes(mesh.cell) if s.object == mesh.object]
        finer: list[tuple[VertexTables, Iterable[Shape]]] = [(m, m.shapes) for m in mesh.levels[1:]]
        for number, (tables, shapes) in zip(
            mesh.files, [*finer, (content.lit_geometry, finest)], strict=True
        ):
            drawn = ((tables, shape, None) for shape in shapes)
            yield mesh_path(number), _glb(content, mesh.cell, mesh_name(number), drawn)


#: A shape, the tables that it refers to, and the row of its object's levels in the hints if its
#: mesh is the coarsest.
_Drawn = tuple[VertexTables, Shape, int | None]


def _drawn_shapes(content: Content, cell: int) -> Iterator[_Drawn]:
    """The shapes of a cell, of objects with levels those of the coarsest mesh."""
    done = set()
    for shape in content.lit_geometry.shapes(cell):
        place = content.mesh_of.get((cell, shape.object))
        if place is None:
            yield content.lit_geometry, shape, None
        elif place not in done:
            done.add(place)
            level = content.meshes[place].levels[0]
            yield from ((level, coarse, place) for coarse in level.shapes)


def _normal_coords(content: Content, shape: Shape, replaced: Container[int]) -> int | None:
    """The number of the coordinates of a shape in the normal map of its material; None if that is
    not drawn: replaced objects have other relief, and coarse meshes no coordinates of their own."""
    normal = content.scene.materials[shape.material].normal
    if normal is None or shape.object in replaced or (normal.own and shape.normal is None):
        return None
    return 0 if not normal.own else 1 if shape.light is None else 2


def _texture_sizes(content: Content, cell: int, shape: Shape, normal: int | None) -> Sizes:
    """The sizes of the textures that the three pairs of coordinates of a shape refer to."""
    places, material = content.places, content.scene.materials[shape.material]
    first = places.of_image[material.image] if material.image >= 0 else None
    second = (
        places.of_cell.get(cell) if shape.relief is None else places.of_object.get(shape.object)
    )
    third = None
    if normal:
        third = None if material.normal is None else places.of_image[material.normal.image]
        second = third if normal == 1 else second
    sizes = [None if place is None else place[1].finest for place in (first, second, third)]
    return sizes[0], sizes[1], sizes[2]


def _glb(content: Content, cell: int, name: str, shapes: Iterable[_Drawn]) -> bytes:
    scene, options, places = content.scene, content.options, content.places
    buffer = PlainBuffer() if options.plain_gltf else CompressedBuffer(content.position_exponent)
    lightmap, light = places.of_cell.get(cell), content.extras.light
    white = significant(light.white[cell : cell + 1])[0] if light else 0.0
    materials = MaterialWriter(
        content.shown_materials,
        places.of_image,
        options.fallback,
        lightmap,
        white,
        places.of_object,
        places.probe[cell][0] if cell in places.probe else None,
        content.lamp_whites,
    )
    represented = content.extras.represented
    replaced, extras = replaced_objects(represented), node_extras(represented)
    nodes: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    last = -1
    for tables, shape, place in shapes:
        textured = scene.materials[shape.material].image >= 0
        vertices = vertices_of(tables, shape, textured=textured)
        normal = _normal_coords(content, shape, replaced)
        material = materials.take(
            shape.material,
            shape.two_sided,
            place,
            lit=shape.lit,
            mapped=shape.light is not None,
            reflects=shape.reflects,
            relief=None if shape.relief is None else shape.object,
            normal=normal,
        )
        sizes = _texture_sizes(content, cell, shape, normal)
        primitive = buffer.take(vertices, material, sizes)
        if primitive is None:
            continue
        if shape.object != last:
            last = shape.object
            node: dict[str, Any] = {"name": scene.objects[shape.object], "mesh": len(meshes)}
            if last in extras:
                node["extras"] = extras[last]
            nodes.append(node)
            meshes.append({"primitives": []})
        meshes[-1]["primitives"].append(primitive)
    buffer.finish()
    top: dict[str, Any] = {"name": name, "extras": {"cell": cell}}
    if nodes:
        top["nodes"] = list(range(len(nodes)))
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "ptmtools"},
        "scene": 0,
        "scenes": [top],
    }
    if nodes:
        document |= {"nodes": nodes, "meshes": meshes}
    document |= materials.members() | buffer.members()
    if materials.extensions:
        # Not required: a viewer without them shows the cell untextured.
        document["extensionsUsed"] = document.get("extensionsUsed", []) + materials.extensions
    return pack(document, buffer.bytes())
