"""A strict reader of the GLBs that `emit` writes, and of nothing else.

What glTF allows beyond them is refused: extensions, strides, sparse accessors, other modes and
component types. The reader stops at the first thing that it does not know; every count is held
against the bytes that are there before an array is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.gltf.container import GlbError, unpack
from ptmtools.database.gltf.material import WHITE, WRAPS

_NUMBER = (int, float)
_VERTICES, _INDICES, _FLOAT = 34962, 34963, 5126
_LARGEST = float(np.finfo(np.float32).max)
_INDEX = {5123: "<u2", 5125: "<u4"}
#: Of every object: members that must be there, and others that may, with their types.
_Members = dict[str, Any]
_DOCUMENT: tuple[_Members, _Members] = (
    {"asset": dict, "scene": int, "scenes": list},
    dict.fromkeys(
        ("nodes", "meshes", "materials", "textures", "images", "samplers")
        + ("accessors", "bufferViews", "buffers"),
        list,
    ),
)
_ASSET: tuple[_Members, _Members] = ({"version": str, "generator": str}, {})
_SCENE: tuple[_Members, _Members] = ({"name": str, "extras": dict}, {"nodes": list})
_CELL: tuple[_Members, _Members] = ({"cell": int}, {})
_NODE: tuple[_Members, _Members] = ({"name": str, "mesh": int}, {})
_MESH: tuple[_Members, _Members] = ({"primitives": list}, {})
_PRIMITIVE: tuple[_Members, _Members] = ({"attributes": dict, "indices": int, "material": int}, {})
_ATTRIBUTES: tuple[_Members, _Members] = ({"POSITION": int}, {"TEXCOORD_0": int})
_MATERIAL: tuple[_Members, _Members] = (
    {"name": str, "pbrMetallicRoughness": dict},
    {"alphaMode": str, "doubleSided": bool, "extras": dict},
)
_SURFACE: tuple[_Members, _Members] = (
    {"metallicFactor": _NUMBER},
    {"baseColorFactor": list, "baseColorTexture": dict},
)
_EXTRAS: tuple[_Members, _Members] = ({"ptm": str, "texture": int}, {"wrapS": int, "wrapT": int})
_USE: tuple[_Members, _Members] = ({"index": int}, {})
_TEXTURE: tuple[_Members, _Members] = ({"source": int}, {"sampler": int})
_IMAGE: tuple[_Members, _Members] = ({"uri": str}, {})
_SAMPLER: tuple[_Members, _Members] = ({}, {"wrapS": int, "wrapT": int})
_ACCESSOR: tuple[_Members, _Members] = (
    {"bufferView": int, "componentType": int, "count": int, "type": str},
    {"byteOffset": int, "min": list, "max": list},
)
_VIEW: tuple[_Members, _Members] = (
    {"buffer": int, "byteLength": int, "target": int},
    {"byteOffset": int, "byteStride": int},
)
_BUFFER: tuple[_Members, _Members] = ({"byteLength": int}, {})


@dataclass(frozen=True)
class ReadMaterial:
    """What a primitive looks like.

    Attributes
    ----------
    factor: (r, g, b, a), linear light.
    two_sided, blends: `doubleSided`; whether `alphaMode` is BLEND.
    image: URI of the base colour texture, or None.
    ptm, texture: URI of the `.ptm` and its place in the hints, or None.
    wrap: numbers of the sampler for s and t.
    """

    factor: tuple[float, float, float, float]
    two_sided: bool
    blends: bool
    image: str | None
    ptm: str | None
    texture: int | None
    wrap: tuple[int, int]


@dataclass(frozen=True)
class ReadPrimitive:
    """Triangles of one shape.

    Attributes
    ----------
    place: of the primitive in the document.
    point: (n, 3) float32.
    uv: (n, 2) float32, origin at the upper left, or None.
    triangle: (m, 3) int64 indices into `point` and `uv`.
    """

    place: str
    point: NDArray[np.float32]
    uv: NDArray[np.float32] | None
    triangle: NDArray[np.int64]
    material: ReadMaterial


@dataclass(frozen=True)
class ReadGlb:
    """A cell as its GLB has it."""

    name: str
    cell: int
    primitives: tuple[ReadPrimitive, ...]


def read_glb(data: bytes) -> ReadGlb:
    """The cell of a GLB.

    Raises
    ------
    GlbError: PTM-D731 no GLB; PTM-D732 not in the emission pattern; PTM-D733 an accessor out of
        its bytes; PTM-D734 indices; PTM-D735 numbers.
    """
    document, binary = unpack(data)
    return _Reader(document, binary).cell()


class _Reader:
    def __init__(self, document: Any, binary: bytes) -> None:
        self._tree: dict[str, Any] = _object(document, _DOCUMENT, "document")
        self._binary = binary
        asset = _object(self._tree["asset"], _ASSET, "asset")
        if asset["version"] != "2.0":
            _foreign("asset", f"version {asset['version']!r}")

    def cell(self) -> ReadGlb:
        scene = self._row("scenes", self._tree["scene"], _SCENE)
        self._check_buffer()
        nodes = scene.get("nodes", [])
        if nodes != list(range(len(nodes))) or any(
            len(self._tree.get(name, [])) != len(nodes) for name in ("nodes", "meshes")
        ):
            _foreign("scene", "has not all nodes, or not a mesh for each")
        primitives: list[ReadPrimitive] = []
        for index in nodes:
            if self._row("nodes", index, _NODE)["mesh"] != index:
                _foreign(f"nodes[{index}]", "has the mesh of another")
            for n, primitive in enumerate(self._row("meshes", index, _MESH)["primitives"]):
                place = f"meshes[{index}].primitives[{n}]"
                primitives.append(self._primitive(_object(primitive, _PRIMITIVE, place), place))
        cell = _object(scene["extras"], _CELL, "scene")["cell"]
        return ReadGlb(scene["name"], cell, tuple(primitives))

    def _row(self, name: str, index: object, members: tuple[_Members, _Members]) -> dict[str, Any]:
        """An object of one of the document's lists."""
        rows = self._tree.get(name, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(rows):
            _foreign(f"{name}[{index}]", "there is no such object")
        return _object(rows[index], members, f"{name}[{index}]")

    def _check_buffer(self) -> None:
        buffers = self._tree.get("buffers", [])
        if len(buffers) != (1 if self._binary else 0):
            _foreign("buffers", f"{len(buffers)} buffers for {len(self._binary)} bytes")
        if buffers:
            length = self._row("buffers", 0, _BUFFER)["byteLength"]
            if not 0 <= len(self._binary) - length < 4:
                _outside("buffers[0]", f"{length} bytes of {len(self._binary)}")

    def _primitive(self, primitive: dict[str, Any], place: str) -> ReadPrimitive:
        attributes = _object(primitive["attributes"], _ATTRIBUTES, place)
        point = self._vertices(attributes["POSITION"], "VEC3", 3)
        self._check_bounds(attributes["POSITION"], point)
        uv = None
        if "TEXCOORD_0" in attributes:
            uv = self._vertices(attributes["TEXCOORD_0"], "VEC2", 2)
            if len(uv) != len(point):
                _foreign(place, f"{len(uv)} texture coordinates for {len(point)} positions")
        index = self._indices(primitive["indices"])
        if len(index) % 3 or int(index.max()) >= len(point):
            message = f"{len(index)} indices up to {index.max()} into {len(point)} vertices"
            raise GlbError("PTM-D734", place, message)
        material = self._material(primitive["material"])
        return ReadPrimitive(place, point, uv, index.reshape(-1, 3), material)

    def _vertices(self, index: int, form: str, width: int) -> NDArray[np.float32]:
        place = f"accessors[{index}]"
        accessor = self._row("accessors", index, _ACCESSOR)
        if (accessor["type"], accessor["componentType"]) != (form, _FLOAT):
            _foreign(place, f"not {form} of floats")
        begin = self._begin(accessor, place, 4 * width, 4, _VERTICES)
        count = accessor["count"] * width
        rows = np.frombuffer(self._binary, "<f4", count, begin).reshape(-1, width)
        if not np.isfinite(rows).all():
            raise GlbError("PTM-D735", place, "a number is not finite")
        return rows.astype(np.float32)

    def _indices(self, index: int) -> NDArray[np.int64]:
        place = f"accessors[{index}]"
        accessor = self._row("accessors", index, _ACCESSOR)
        if accessor["type"] != "SCALAR" or accessor["componentType"] not in _INDEX:
            _foreign(place, "not scalars of 16 or 32 bits")
        form = np.dtype(_INDEX[accessor["componentType"]])
        begin = self._begin(accessor, place, form.itemsize, form.itemsize, _INDICES)
        return np.frombuffer(self._binary, form, accessor["count"], begin).astype(np.int64)

    def _begin(
        self, accessor: dict[str, Any], place: str, size: int, align: int, target: int
    ) -> int:
        """Where an accessor begins in the bytes, once it is known to lie in its view."""
        view = self._row("bufferViews", accessor["bufferView"], _VIEW)
        self._row("buffers", view["buffer"], _BUFFER)
        if view["target"] != target or view.get("byteStride", size) != size:
            _foreign(place, "its buffer view is for other data")
        first, offset = view.get("byteOffset", 0), accessor.get("byteOffset", 0)
        length, count = view["byteLength"], accessor["count"]
        if min(first, offset, length) < 0 or count < 1 or offset + count * size > length:
            _outside(place, f"{count} elements from byte {offset} of a view of {length}")
        if first + length > self._tree["buffers"][0]["byteLength"]:
            _outside(place, f"a view of {length} bytes from byte {first}")
        if (first + offset) % align:
            _outside(place, f"begins at byte {first + offset}, no multiple of {align}")
        return int(first + offset)

    def _check_bounds(self, index: int, point: NDArray[np.float32]) -> None:
        accessor = self._tree["accessors"][index]
        for name, held in (("min", point.min(axis=0)), ("max", point.max(axis=0))):
            bound = accessor.get(name)
            if bound is None or len(bound) != 3 or not all(_is(v, _NUMBER) for v in bound):
                _foreign(f"accessors[{index}]", f"{name} is not three numbers")
            # In single precision, as they are written; an integer may have any length.
            if any(
                abs(v) > _LARGEST or np.float32(v) != h for v, h in zip(bound, held, strict=True)
            ):
                message = f"{name} is not that of the data, {held.tolist()}"
                raise GlbError("PTM-D735", f"accessors[{index}]", message)

    def _material(self, index: int) -> ReadMaterial:
        place = f"materials[{index}]"
        material = self._row("materials", index, _MATERIAL)
        surface = _object(material["pbrMetallicRoughness"], _SURFACE, place)
        factor = surface.get("baseColorFactor", WHITE)
        if len(factor) != 4 or not all(_is(v, _NUMBER) and 0 <= v <= 1 for v in factor):
            _foreign(place, "baseColorFactor is not four numbers from 0 to 1")
        mode = material.get("alphaMode", "OPAQUE")
        if mode not in ("OPAQUE", "BLEND"):
            _foreign(place, f"alphaMode {mode!r}")
        extras = material.get("extras")
        if extras is not None:
            _object(extras, _EXTRAS, place)
        wrap = self._wrap(extras or {}, place)
        image = None
        if "baseColorTexture" in surface:
            use = _object(surface["baseColorTexture"], _USE, place)
            texture = self._row("textures", use["index"], _TEXTURE)
            image = self._row("images", texture["source"], _IMAGE)["uri"]
            sampler: dict[str, Any] = {}
            if "sampler" in texture:
                sampler = self._row("samplers", texture["sampler"], _SAMPLER)
            if self._wrap(sampler, place) != wrap:
                _foreign(place, "its sampler wraps otherwise than its extras say")
        return ReadMaterial(
            factor=(factor[0], factor[1], factor[2], factor[3]),
            two_sided=material.get("doubleSided", False),
            blends=mode == "BLEND",
            image=image,
            ptm=None if extras is None else extras["ptm"],
            texture=None if extras is None else extras["texture"],
            wrap=wrap,
        )

    @staticmethod
    def _wrap(sampler: dict[str, Any], place: str) -> tuple[int, int]:
        s, t = (sampler.get(name, WRAPS["repeat"]) for name in ("wrapS", "wrapT"))
        if not {s, t} <= set(WRAPS.values()):
            _foreign(place, f"wraps {s} and {t}")
        return s, t


def _object(value: object, members: tuple[_Members, _Members], place: str) -> dict[str, Any]:
    """``value``, once it is known to be an object of these members."""
    must, may = members
    if not isinstance(value, dict):
        _foreign(place, "is no object")
    for name in must:
        if name not in value:
            _foreign(place, f"lacks {name!r}")
    for name, held in value.items():
        kind = must.get(name, may.get(name))
        if kind is None:
            _foreign(place, f"{name!r} is not in the emission pattern")
        if not _is(held, kind):
            _foreign(place, f"{name!r} is of another type")
    return value


def _is(value: object, kind: Any) -> bool:
    """Whether a value of JSON has a type; true and false are no numbers."""
    return isinstance(value, kind) and (kind is bool or not isinstance(value, bool))


def _foreign(place: str, message: str) -> NoReturn:
    raise GlbError("PTM-D732", place, message)


def _outside(place: str, message: str) -> NoReturn:
    raise GlbError("PTM-D733", place, message)
