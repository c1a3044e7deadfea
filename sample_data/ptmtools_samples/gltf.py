"""The binary chunk of a GLB, with its buffer views and accessors."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.glb import glb

REPEAT, CLAMP, LINEAR, MIPMAPS = 10497, 33071, 9729, 9987
_FLOAT, _UINT32 = 5126, 5125
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}


class GlbBuffer:
    """Collects the arrays and images of a GLB."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, part: bytes) -> int:
        """Index of the view."""
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(part)}
        self.views.append(view)
        self.data += part + bytes(-len(part) % 4)
        return len(self.views) - 1

    def add_array(self, values: NDArray[np.float32] | NDArray[np.uint32]) -> int:
        """Index of the accessor of (n,), (n, 2) or (n, 3) numbers."""
        rows = values.reshape(len(values), -1)
        accessor: dict[str, Any] = {
            "bufferView": self.add(np.ascontiguousarray(values).tobytes()),
            "componentType": _UINT32 if values.dtype == np.uint32 else _FLOAT,
            "count": len(rows),
            "type": _KINDS[rows.shape[1]],
            "min": rows.min(axis=0).tolist(),
            "max": rows.max(axis=0).tolist(),
        }
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def encode(self, document: dict[str, Any]) -> bytes:
        """The GLB of a document, to which accessors, views and the buffer are added."""
        whole = {
            **document,
            "samplers": [
                {"wrapS": wrap, "wrapT": wrap, "magFilter": LINEAR, "minFilter": MIPMAPS}
                for wrap in (REPEAT, CLAMP)
            ],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.data)}],
        }
        text = json.dumps(whole, separators=(",", ":")).encode()
        return glb([(b"JSON", text), (b"BIN\0", bytes(self.data))])
