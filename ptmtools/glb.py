r"""What readers and writers of glTF 2.0 share: the container GLB, and the numbers of a buffer.

Sections 3.6.1, 3.6.2 and 4.4 of the specification. Every declared size is checked against the
file's bytes before an array is created. A GLB is a header, a chunk of JSON, a chunk of bytes:

=======  ==========================================================
offset   little-endian uint32
=======  ==========================================================
0        "glTF", version 2, length of the file
12       length of the JSON, "JSON", the JSON, spaces up to 4 bytes
then     length of the bytes, "BIN\0", the bytes, zeros up to 4;
         left out where there are none
=======  ==========================================================

GLBs of one mesh, a buffer view for each array: those of campuses and octree textures.

The cells of a database share arrays and buffer views between their shapes
(`ptmtools.output.gltf`)."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAGIC, JSON, BINARY = b"glTF", b"JSON", b"BIN\0"
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
#: Component types, and how many components an element has.
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
ITEMS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def glb(chunks: Iterable[tuple[bytes, bytes]]) -> bytes:
    """A GLB of chunks, given as (kind, bytes)."""
    parts = []
    for kind, body in chunks:
        filling = (b" " if kind == JSON else b"\0") * (-len(body) % 4)
        parts += [_CHUNK.pack(len(body) + len(filling), kind), body, filling]
    return b"".join([_HEADER.pack(MAGIC, 2, _HEADER.size + sum(map(len, parts))), *parts])


def glb_chunks(data: bytes) -> list[tuple[bytes, int, bytes]]:
    """(kind, offset, bytes with padding) of the chunks of a GLB, the first of them JSON.

    Raises ValueError with the fault and its place.
    """
    if not data.startswith(MAGIC):
        raise ValueError("the magic bytes are missing", "byte 0")
    if len(data) < _HEADER.size + _CHUNK.size:
        raise ValueError("cut short", f"byte {len(data)}")
    _, version, length = _HEADER.unpack_from(data)
    if version != 2:
        raise ValueError(f"version {version}", "byte 4")
    if length > len(data):
        raise ValueError(f"cut short, {length} bytes expected", f"byte {len(data)}")
    result: list[tuple[bytes, int, bytes]] = []
    at = _HEADER.size
    while (begin := at + _CHUNK.size) <= length:
        size, kind = _CHUNK.unpack_from(data, at)
        if begin + size > length:
            raise ValueError("a chunk ends beyond the file", f"byte {at}")
        at = begin + size
        result.append((kind, begin, data[begin:at]))
    if [kind for kind, *_ in result[:1]] != [JSON]:
        raise ValueError("the first chunk is not JSON", f"byte {_HEADER.size}")
    return result


def elements(
    accessor: Mapping[str, Any], view: Mapping[str, Any], data: bytes | memoryview
) -> NDArray[Any]:
    """(count, items) the elements of an accessor whose buffer view lies in ``data``, as stored.

    Raises ValueError if it has no elements or ends beyond its view or the data, and KeyError for a
    member that is missing or another component type than those of `COMPONENTS`.
    """
    kind, items = np.dtype(COMPONENTS[accessor["componentType"]]), ITEMS[accessor["type"]]
    begin, length = natural(view.get("byteOffset", 0)), natural(view["byteLength"])
    first, count = natural(accessor.get("byteOffset", 0)), natural(accessor["count"])
    size = items * kind.itemsize
    stride = natural(view.get("byteStride", size))
    if begin + length > len(data):
        raise ValueError(f"a view of {length} bytes from byte {begin} ends beyond {len(data)}")
    if count < 1 or stride < size or first + (count - 1) * stride + size > length:
        raise ValueError(f"{count} elements from byte {first} end beyond a view of {length}")
    return np.ndarray((count, items), kind, data, begin + first, (stride, kind.itemsize))


def meaning(stored: NDArray[Any], normalized: bool) -> NDArray[np.float64]:
    """The values of stored numbers: normalised integers are shares (section 3.6.2.2)."""
    values = stored.astype(np.float64)
    if normalized and stored.dtype.kind != "f":
        values = np.maximum(values / np.iinfo(stored.dtype).max, -1.0)
    return values


def natural(value: object) -> int:
    """The value, if it is an index or a size; ValueError otherwise."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{value!r} is not an index or a size")
    return value


FLOAT, BYTE, UNSIGNED_BYTE, SHORT, INT = 5126, 5120, 5121, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
#: The extension that normals of bytes need; it is required of readers.
QUANTIZATION = "KHR_mesh_quantization"
#: Narrow indices end before 65535, which restarts a primitive.
NARROW = 65535


class BufferWriter:
    """Gathers the arrays of one GLB; each method returns the number of the array's accessor."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._accessors: list[dict[str, Any]] = []
        self._views: list[dict[str, Any]] = []
        self._size = 0

    def positions(self, point: NDArray[np.floating[Any]]) -> int:
        """(n, 3), with the bounds that glTF requires."""
        stored = point.astype("<f4")
        ends = {"min": stored.min(axis=0), "max": stored.max(axis=0)}
        return self._attribute(stored, {name: self._numbers(end) for name, end in ends.items()})

    def vectors(self, values: NDArray[np.floating[Any]]) -> int:
        """(n, 2) or (n, 3) of float32: texture coordinates, normals."""
        return self._attribute(values.astype("<f4"), {})

    def shares(self, values: NDArray[np.uint16]) -> int:
        """(n, 4) of 16 bits, normalised: colours."""
        return self._attribute(values.astype("<u2"), {"normalized": True})

    def directions(self, values: NDArray[np.int8]) -> int:
        """(n, 3) of bytes, normalised, each followed by a byte that is 0: normals."""
        accessor = {"componentType": BYTE, "count": len(values), "type": "VEC3", "normalized": True}
        return self._append(accessor, np.pad(values, ((0, 0), (0, 1))).tobytes(), _VERTICES)

    def indices(self, triangle: NDArray[np.integer[Any]], vertices: int) -> int:
        """(m, 3) indices, below the number of ``vertices``."""
        kind, form = (SHORT, "<u2") if vertices <= NARROW else (INT, "<u4")
        accessor = {"componentType": kind, "count": triangle.size, "type": "SCALAR"}
        return self._append(accessor, triangle.astype(form).tobytes(), _INDICES)

    def _attribute(self, part: NDArray[Any], more: Mapping[str, Any]) -> int:
        accessor: dict[str, Any] = {
            "componentType": SHORT if part.dtype.kind == "u" else FLOAT,
            "count": len(part),
            "type": f"VEC{part.shape[1]}",
        }
        return self._append({**accessor, **more}, part.tobytes(), _VERTICES)

    def _append(self, accessor: dict[str, Any], data: bytes, target: int) -> int:
        view = {"buffer": 0, "byteOffset": self._size, "byteLength": len(data), "target": target}
        self._accessors.append({"bufferView": len(self._views)} | accessor)
        self._views.append(view)
        self._parts.append(data + bytes(-len(data) % 4))
        self._size += len(self._parts[-1])
        return len(self._accessors) - 1

    def _numbers(self, values: NDArray[np.float32]) -> list[float]:
        """The shortest decimals that read back to the same float32."""
        return [float(str(value)) for value in values]

    def members(self) -> dict[str, Any]:
        """The members "accessors", "bufferViews" and "buffers" of the document."""
        return {
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._size}],
        }

    def bytes(self) -> bytes:
        """All arrays."""
        return b"".join(self._parts)


def one_mesh(
    primitives: Sequence[Mapping[str, Any]],
    buffer: BufferWriter,
    more: Mapping[str, Any] | None = None,
) -> bytes:
    """A GLB of one node with one mesh, and with ``more`` members of the document."""
    document = {
        "asset": {"version": "2.0", "generator": "ptmtools"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [*primitives]}],
        **(more or {}),
        **buffer.members(),
    }
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return glb([(JSON, text.encode("utf-8", "replace")), (BINARY, buffer.bytes())])
