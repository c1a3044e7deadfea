"""A strict reader of the GLBs that `emit` writes, plain or compressed, and of no others.

Other features of glTF are refused; `schemas/glb.schema.json` describes the accepted ones. The
reader stops at the first fault. It compares every count with the available bytes before it
allocates an array.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.glb import BYTE, COMPONENTS, ITEMS, QUANTIZATION, elements, meaning
from ptmtools.meshopt.decoding import decode
from ptmtools.output.gltf import WHITE, WRAPS, unpack
from ptmtools.output.gltf_compressed import MESHOPT
from ptmtools.output.gltf_shapes import stride_of
from ptmtools.output.model import FileError

_VERTICES, _INDICES, _FLOAT = 34962, 34963, 5126
_WRAPS = ("wrapS", "wrapT")
#: Largest difference of the length of a normal of bytes from 1.
_LENGTH = 0.01


@dataclass(frozen=True)
class ReadMaterial:
    """The material of a primitive.

    Attributes
    ----------
    factor: (r, g, b, a), linear light.
    two_sided, blends: `doubleSided`; whether `alphaMode` is not OPAQUE.
    cutoff: `alphaCutoff` if `alphaMode` is MASK, else None.
    image: URI of the base colour texture, or None.
    ptm, texture: URI of the `.ptm` and its index in the hints, or None.
    wrap: numbers of the sampler for s and t.
    mesh: its object's row in the hints if this mesh is the coarsest of several, or None.
    white: the light of which the codes of lightmaps and the colours of lit corners are shares, or
        None of what is not lit.
    light, lightmap: index in the hints of the lightmap of the cell, and URI of that as an image, or
        None.
    normal, normal_map: the same for the normal map of the object or of the material; coords,
        scale, normal_wrap: of that of the material, the number of its coordinates, the factor of
        its normals and the numbers of its sampler; coords is None of that of the object.
    metallic, roughness: in [0, 1].
    probe: index in the hints of what it reflects, or None.
    """

    factor: tuple[float, ...]
    two_sided: bool
    blends: bool
    cutoff: float | None
    image: str | None
    ptm: str | None
    texture: int | None
    wrap: tuple[int, int]
    mesh: int | None
    white: float | None = None
    light: int | None = None
    lightmap: str | None = None
    normal: int | None = None
    normal_map: str | None = None
    coords: int | None = None
    scale: float = 1.0
    normal_wrap: tuple[int, int] = (WRAPS["repeat"], WRAPS["repeat"])
    metallic: float = 0.0
    roughness: float = 1.0
    probe: int | None = None


@dataclass(frozen=True)
class ReadPrimitive:
    """Triangles of one shape.

    Attributes
    ----------
    place: of the primitive in the document.
    object, extras: of its node: the name of the object, and the row of each representation of it
        in the hints, by the member of the node's "extras".
    point: (n, 3) float32.
    uv: (n, 2) float32, origin at the upper left, or None.
    color: (n, 3) linear light, or None.
    triangle: (m, 3) int64 indices into `point` and `uv`.
    light: (n, 2) float32 coordinates in the lightmap or in the normal map of the object, origin at
        the upper left, or None.
    normal: (n, 2) likewise in the normal map of the material, or None.
    frame: (n, 7) float32 normal, tangent and sign of the bitangent, or None.
    normals: (n, 3) float32 unit normals of a curved surface that reflects, or None.
    """

    place: str
    object: str
    extras: Mapping[str, int]
    point: Singles
    uv: Singles | None
    color: Floats | None
    triangle: Ints
    material: ReadMaterial
    light: Singles | None = None
    frame: Singles | None = None
    normal: Singles | None = None
    normals: Singles | None = None


@dataclass(frozen=True)
class ReadGlb:
    """The content of a GLB, of a cell or of a finer mesh of an object in it."""

    name: str
    cell: int
    primitives: tuple[ReadPrimitive, ...]


def read_glb(data: bytes) -> ReadGlb:
    """The cell of a GLB.

    Raises FileError PTM-D731: no GLB, or not in the emission pattern.
    """
    document, binary = unpack(data)
    try:
        schemas.check(document, schemas.GLB)
    except schemas.ShapeError as fault:
        raise FileError("PTM-D731", fault.place or "document", fault.message) from None
    return _GlbReader(document, binary).cell()


class _GlbReader:
    def __init__(self, document: dict[str, Any], binary: bytes) -> None:
        self._tree = document
        buffers = document.get("buffers", [])
        images = sorted(
            {name for row in document.get("textures", ()) for name in row.get("extensions", ())}
        )
        required = document.get("extensionsRequired", [])
        self._compressed = MESHOPT in required
        quantized = any(row["componentType"] == BYTE for row in document.get("accessors", ()))
        if required != [MESHOPT] * self._compressed + [QUANTIZATION] * quantized:
            _foreign("document", "requires other extensions than it uses")
        if document.get("extensionsUsed", []) != required + images:
            _foreign("document", "lists other extensions than it uses")
        fallbacks = [MESHOPT in buffer.get("extensions", {}) for buffer in buffers]
        expected = [False, True][: 1 + self._compressed] if binary else []
        if fallbacks != expected:
            _foreign("buffers", f"{len(buffers)} buffers for {len(binary)} bytes")
        length = buffers[0]["byteLength"] if buffers else 0
        if not 0 <= len(binary) - length < 4:
            raise FileError("PTM-D731", "buffers[0]", f"{length} bytes of {len(binary)}")
        self._data = binary[:length]
        self._views: dict[int, tuple[dict[str, Any], bytes]] = {}

    def cell(self) -> ReadGlb:
        scene = self._row("scenes", self._tree["scene"])
        nodes = scene.get("nodes", [])
        if nodes != list(range(len(nodes))) or any(
            len(self._tree.get(name, [])) != len(nodes) for name in ("nodes", "meshes")
        ):
            _foreign("scene", "does not have all nodes and a mesh for each")
        primitives: list[ReadPrimitive] = []
        for index in nodes:
            node = self._row("nodes", index)
            if node["mesh"] != index:
                _foreign(f"nodes[{index}]", "has the mesh of another")
            for n, primitive in enumerate(self._row("meshes", index)["primitives"]):
                place = f"meshes[{index}].primitives[{n}]"
                primitives.append(self._primitive(primitive, place, node))
        return ReadGlb(scene["name"], scene["extras"]["cell"], tuple(primitives))

    def _row(self, name: str, index: int) -> dict[str, Any]:
        """An object of one of the document's lists."""
        rows = self._tree.get(name, [])
        if not 0 <= index < len(rows):
            _foreign(f"{name}[{index}]", "does not exist")
        row: dict[str, Any] = rows[index]
        return row

    def _primitive(
        self, primitive: dict[str, Any], place: str, node: dict[str, Any]
    ) -> ReadPrimitive:
        attributes = primitive["attributes"]
        point = self._vertices(attributes["POSITION"], "VEC3")
        self._check_bounds(attributes["POSITION"], point)
        uv, light, third = (
            self._rows(attributes, f"TEXCOORD_{n}", "VEC2", len(point), place) for n in range(3)
        )
        normals = self._normals(attributes, len(point), place)
        frame = self._frames(attributes, len(point), place) if normals is None else None
        color = self._colors(attributes, len(point), place)
        index = self._elements(primitive["indices"], "SCALAR", (5123, 5125), _INDICES).ravel()
        if len(index) % 3 or int(index.max()) >= len(point):
            message = f"{len(index)} indices up to {index.max()} into {len(point)} vertices"
            raise FileError("PTM-D731", place, message)
        triangle = index.astype(np.int64).reshape(-1, 3)
        if self._compressed:  # the shapes of a cell share their arrays
            used = slice(int(index.min()), int(index.max()) + 1)
            triangle -= used.start
            point = point[used]
            uv = None if uv is None else uv[used]
            light = None if light is None else light[used]
            third = None if third is None else third[used]
            frame = None if frame is None else frame[used]
            normals = None if normals is None else normals[used]
            color = None if color is None else color[used]
        material = self._material(primitive["material"])
        if light is not None and material.texture is None:
            uv = None  # the second coordinates once more
        if (material.normal is None or material.coords is not None) != (frame is None):
            _foreign(place, "has only one of a normal map and its frames")
        if (third is None) != (material.coords != 2) or (material.coords == 0 and uv is None):
            _foreign(place, "has only one of a normal map and its coordinates")
        normal = None
        if material.coords is not None:
            normal = (uv, light, third)[material.coords]
        if material.coords == 1:
            normal, light = light, None
            if normal is None:
                _foreign(place, "has only one of a normal map and its coordinates")
        if (material.light is None and frame is None) != (light is None):
            _foreign(place, "has only one of a lightmap, or normal map, and its coordinates")
        return ReadPrimitive(
            place,
            node["name"],
            node.get("extras", {}),
            point,
            uv,
            color,
            triangle,
            material,
            light,
            frame,
            normal,
            normals,
        )

    def _rows(
        self, attributes: dict[str, int], name: str, form: str, count: int, place: str
    ) -> Singles | None:
        if name not in attributes:
            return None
        rows = self._vertices(attributes[name], form)
        if len(rows) != count:
            _foreign(place, f"{len(rows)} rows of {name} for {count} positions")
        return rows

    def _normals(self, attributes: dict[str, int], count: int, place: str) -> Singles | None:
        """Those of bytes; None without, and for those of floats, which belong to frames."""
        index = attributes.get("NORMAL")
        if index is None or self._row("accessors", index)["componentType"] != BYTE:
            return None
        rows = self._elements(index, "VEC3", (BYTE,), _VERTICES)
        normals = meaning(rows, self._tree["accessors"][index].get("normalized", False))
        if (
            len(rows) != count
            or "TANGENT" in attributes
            or np.abs(np.linalg.norm(normals, axis=1) - 1).max() > _LENGTH
        ):
            _foreign(place, f"{len(rows)} normals for {count} positions, or of another length")
        return normals.astype(np.float32)

    def _frames(self, attributes: dict[str, int], count: int, place: str) -> Singles | None:
        normal = self._rows(attributes, "NORMAL", "VEC3", count, place)
        tangent = self._rows(attributes, "TANGENT", "VEC4", count, place)
        if normal is None or tangent is None:
            if normal is not tangent:
                _foreign(place, "has only one of normals and tangents")
            return None
        if (np.abs(tangent[:, 3]) != 1).any():
            _foreign(place, "a bitangent has no sign")
        return np.hstack([normal, tangent])

    def _colors(self, attributes: dict[str, int], count: int, place: str) -> Floats | None:
        if "COLOR_0" not in attributes:
            return None
        index = attributes["COLOR_0"]
        rows = self._elements(index, "VEC4", (5123,), _VERTICES)
        normalized = self._tree["accessors"][index].get("normalized", False)
        if len(rows) != count or not normalized or (rows[:, 3] != 65535).any():
            _foreign(place, f"{len(rows)} colours for {count} positions, or other than opaque ones")
        return meaning(rows[:, :3], normalized=True)

    def _vertices(self, index: int, form: str) -> Singles:
        rows = self._elements(index, form, (_FLOAT,), _VERTICES)
        if not np.isfinite(rows).all():
            raise FileError("PTM-D731", f"accessors[{index}]", "a number is not finite")
        return rows.astype(np.float32)

    def _elements(
        self, index: int, form: str, components: tuple[int, ...], target: int
    ) -> NDArray[Any]:
        """(count, items) of an accessor; its elements and its view must be of the given kinds."""
        place, accessor = f"accessors[{index}]", self._row("accessors", index)
        component = accessor["componentType"]
        if accessor["type"] != form or component not in components:
            _foreign(place, f"{accessor['type']} of component type {component}")
        unit = np.dtype(COMPONENTS[component]).itemsize
        stride = stride_of(component, form) if target == _VERTICES else ITEMS[form] * unit
        if self._compressed:
            view, data = self._decode_view(accessor["bufferView"], target)
        else:
            view, data = self._row("bufferViews", accessor["bufferView"]), self._data
            self._row("buffers", view["buffer"])
            if view.get("target") != target or view.get("byteStride", stride) != stride:
                _foreign(place, "its buffer view is for other data")
        try:
            rows = elements(accessor, view, data)
        except ValueError as fault:
            raise FileError("PTM-D731", place, str(fault)) from None
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        if begin % unit:
            raise FileError("PTM-D731", place, f"begins at byte {begin}, not a multiple of {unit}")
        return rows

    def _decode_view(self, index: int, target: int) -> tuple[dict[str, Any], bytes]:
        """A compressed view and its bytes, as a view of those bytes alone."""
        if index in self._views:
            return self._views[index]
        place, view = f"bufferViews[{index}]", self._row("bufferViews", index)
        coded = view.get("extensions", {}).get(MESHOPT)
        if coded is None or view["buffer"] != 1 or coded["buffer"] != 0:
            _foreign(place, "is not compressed, or not of the buffers of compressed views")
        if (coded["mode"] == "TRIANGLES") != (target == _INDICES):
            _foreign(place, f"is of mode {coded['mode']}")
        begin, length = coded.get("byteOffset", 0), coded["byteLength"]
        count, stride = coded["count"], coded["byteStride"]
        room = self._tree["buffers"][1]["byteLength"] - view.get("byteOffset", 0)
        if (
            begin + length > len(self._data)
            or count * stride != view["byteLength"]
            or (not 0 <= view["byteLength"] <= room or view.get("byteStride", stride) != stride)
        ):
            raise FileError("PTM-D731", place, "its sizes contradict each other")
        try:
            data = decode(self._data[begin : begin + length], coded)
        except ValueError as fault:
            raise FileError("PTM-D731", place, str(fault)) from None
        layout = {name: view[name] for name in view if name in ("byteLength", "byteStride")}
        self._views[index] = layout, data
        return layout, data

    def _check_bounds(self, index: int, point: Singles) -> None:
        place, accessor = f"accessors[{index}]", self._tree["accessors"][index]
        for name, actual in (("min", point.min(axis=0)), ("max", point.max(axis=0))):
            if name not in accessor:
                _foreign(place, f"has no {name}")
            written = np.array(accessor[name], np.float64)
            # In single precision, as they are written.
            with np.errstate(over="ignore"):
                same = np.array_equal(written.astype(np.float32), actual)
            if not same:
                message = f"{name} does not match the data, which has {actual.tolist()}"
                raise FileError("PTM-D731", place, message)

    def _material(self, index: int) -> ReadMaterial:
        material = self._row("materials", index)
        surface, extras = material["pbrMetallicRoughness"], material.get("extras", {})
        wrap, clamp = _wrap(extras), WRAPS["clamp"]
        place = f"materials[{index}]"
        _check_extras(material, extras, place)
        image = self._image(surface.get("baseColorTexture"), wrap, place)
        lightmap = self._image(material.get("occlusionTexture"), (clamp, clamp), place)
        coords = extras.get("normalCoords")
        normal_wrap = clamp, clamp
        if coords is not None:
            keys = {name: f"normalW{name[1:]}" for name in _WRAPS}
            normal_wrap = _wrap({name: extras[k] for name, k in keys.items() if k in extras})
        normal_map = self._image(material.get("normalTexture"), normal_wrap, place)
        return ReadMaterial(
            factor=tuple(surface.get("baseColorFactor", WHITE)),
            two_sided=material.get("doubleSided", False),
            blends=material.get("alphaMode", "OPAQUE") != "OPAQUE",
            cutoff=material.get("alphaCutoff", 0.5)
            if material.get("alphaMode") == "MASK"
            else None,
            image=image,
            ptm=extras.get("ptm"),
            texture=extras.get("texture"),
            wrap=wrap,
            mesh=extras.get("mesh"),
            white=extras.get("white"),
            light=extras.get("light"),
            lightmap=lightmap,
            normal=extras.get("normal"),
            normal_map=normal_map,
            coords=coords,
            scale=extras.get("normalScale", 1),
            normal_wrap=normal_wrap,
            metallic=surface["metallicFactor"],
            roughness=surface.get("roughnessFactor", 1),
            probe=extras.get("probe"),
        )

    def _image(self, use: dict[str, int] | None, wrap: tuple[int, int], place: str) -> str | None:
        """The URI of the image of a texture, which must wrap like this; None without a texture."""
        if use is None:
            return None
        texture = self._row("textures", use["index"])
        sources = list(texture.get("extensions", {"": texture}).values())
        if len(sources) != 1 or "source" not in sources[0]:
            _foreign(place, "its texture has not one source")
        sampler = self._row("samplers", texture["sampler"]) if "sampler" in texture else {}
        if _wrap(sampler) != wrap:
            _foreign(place, "its sampler and its extras wrap differently")
        return str(self._row("images", sources[0]["source"])["uri"])


def _wrap(sampler: dict[str, Any]) -> tuple[int, int]:
    return sampler.get("wrapS", WRAPS["repeat"]), sampler.get("wrapT", WRAPS["repeat"])


def _check_extras(material: Mapping[str, Any], extras: Mapping[str, Any], place: str) -> None:
    """Raises FileError PTM-D731 where the extras of a material and its textures differ."""
    of_normal = {name for name in extras if name.startswith("normal")}
    if (
        extras.keys() - {"mesh", "light", "white", "probe"} - of_normal
        and not {"ptm", "texture"} <= extras.keys()
    ):
        _foreign(f"{place}.extras", "has members of a texture, but not its .ptm and its place")
    coords, use = extras.get("normalCoords"), material.get("normalTexture")
    if use is not None and (
        use.get("texCoord", 0) != (1 if coords is None else coords)
        or use.get("scale", 1) != extras.get("normalScale", 1)
    ):
        _foreign(place, "its normal map and its extras differ")
    if of_normal - {"normal"} and not {"normal", "normalCoords"} <= extras.keys():
        _foreign(place, "has members of a normal map, but not its place and coordinates")
    for texture, name in (("occlusionTexture", "light"), ("normalTexture", "normal")):
        if material.get(texture) is not None and name not in extras:
            _foreign(place, f"has an image of {name}, but not its place in the hints")
    if "light" in extras and "white" not in extras:
        _foreign(place, "has a lightmap, but not the light of its codes")
    factor = material["pbrMetallicRoughness"].get("baseColorFactor", WHITE)
    pane = material.get("alphaMode") == "BLEND" and "texture" not in extras and factor[3] < 1
    if "probe" in extras and "white" not in extras and not pane:
        _foreign(place, "reflects, but is neither lit nor a pane")
    if "light" in extras and "normal" in extras and coords is None:
        _foreign(place, "has both a lightmap and a normal map")


def _foreign(place: str, message: str) -> NoReturn:
    raise FileError("PTM-D731", place, message)
