"""GLBs of one mesh, a buffer view for each array: those of campuses and octree textures.

The cells of a database share arrays between their shapes; they have a writer of their own
(`ptmtools.database.gltf.buffer`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.glb import BINARY, JSON, glb

FLOAT, SHORT, INT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
#: Narrow indices end before 65535, which restarts a primitive.
_NARROW = 65535


class BufferWriter:
    """Gathers the arrays of one GLB; each method returns the number of the array's accessor."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._accessors: list[dict[str, Any]] = []
        self._views: list[dict[str, Any]] = []
        self._size = 0

    def positions(self, point: NDArray[np.floating[Any]]) -> int:
        """(n, 3), with the bounds that glTF wants of them."""
        held = point.astype("<f4")
        bounds = {"min": _numbers(held.min(axis=0)), "max": _numbers(held.max(axis=0))}
        return self._attribute(held, bounds)

    def vectors(self, values: NDArray[np.floating[Any]]) -> int:
        """(n, 2) or (n, 3) of float32: texture coordinates, normals."""
        return self._attribute(values.astype("<f4"), {})

    def shares(self, values: NDArray[np.uint16]) -> int:
        """(n, 4) of 16 bits, normalised: colours."""
        return self._attribute(values.astype("<u2"), {"normalized": True})

    def indices(self, triangle: NDArray[np.integer[Any]], vertices: int) -> int:
        """(m, 3) indices into so many vertices."""
        kind, form = (SHORT, "<u2") if vertices <= _NARROW else (INT, "<u4")
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


def _numbers(values: NDArray[np.float32]) -> list[float]:
    """The shortest decimals that read back to the same float32."""
    return [float(str(value)) for value in values]
