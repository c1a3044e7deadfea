"""Small models written on the spot."""

from __future__ import annotations

import base64
import io
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from PIL import Image

from ptmtools.progress import silent
from ptmtools.scene import IngestOptions
from ptmtools.scene.formats import format_of
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import ModelSource

#: A quad of 10 x 4 m, standing, with texture coordinates over the whole image.
QUAD = """v 0 0 0
v 10 0 0
v 10 4 0
v 0 4 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
"""
FACE = "f 1/1 2/2 3/3 4/4\n"


def read_source(path: Path, notes: IngestNotes | None = None, **options: Any) -> ModelSource:
    """What the reader of a file's format returns."""
    notes = notes or IngestNotes(path)
    return format_of(path).read(path, notes, IngestOptions(**options), silent)


def png(pixels: np.ndarray, **options: Any) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "png", **options)
    return stream.getvalue()


def noise(seed: int, size: int = 8, bands: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 255, (size, size, bands), dtype=np.uint8)


Put = Callable[..., Path]


@pytest.fixture
def put(tmp_path: Path) -> Put:
    """``put(name, content)``: write text or bytes below the test's folder."""

    def write(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.fixture
def textured(put: Put) -> Callable[..., Path]:
    """``textured(mtl_lines, **files)``: one textured quad whose material has these lines."""

    def write(mtl: str, files: dict[str, bytes] | None = None, faces: str = FACE) -> Path:
        put("room.mtl", "newmtl wall\n" + mtl + "\n")
        for name, data in (files or {}).items():
            put(name, data)
        return put("room.obj", "mtllib room.mtl\n" + QUAD + "usemtl wall\n" + faces)

    return write


class GltfModel:
    """Builds a document: ``add`` appends an array and returns its accessor."""

    types: ClassVar = {
        np.float32: 5126,
        np.uint8: 5121,
        np.uint16: 5123,
        np.uint32: 5125,
        np.int16: 5122,
    }

    def __init__(self) -> None:
        self.blob = b""
        self.spare: list[dict[str, Any]] = []
        self.tree: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "bufferViews": [],
            "accessors": [],
            "scene": 0,
        }

    @classmethod
    def wall(
        cls, change: Callable[[GltfModel], object] = lambda doc: None, **node: Any
    ) -> GltfModel:
        """A quad at one node; then changed."""
        doc = cls()
        doc.place(doc.quad(), **node)
        change(doc)
        return doc

    def view(self, data: bytes, **more: Any) -> int:
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.tree["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), **more}
        )
        self.blob += data
        return len(self.tree["bufferViews"]) - 1

    def add(self, values: np.ndarray, **more: Any) -> int:
        self.tree["accessors"].append(
            {
                "bufferView": self.view(values.tobytes()),
                "componentType": self.types[values.dtype.type],
                "count": len(values),
                "type": "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}",
                **more,
            }
        )
        return len(self.tree["accessors"]) - 1

    def quad(self, **more: Any) -> dict[str, Any]:
        """A primitive: a quad of 10 x 4 in the plane z = 0, facing +z."""
        corners = np.array([[0, 0, 0], [10, 0, 0], [10, 4, 0], [0, 4, 0]], np.float32)
        coords = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
        return {
            "attributes": {"POSITION": self.add(corners), "TEXCOORD_0": self.add(coords)},
            "indices": self.add(np.array([0, 1, 2, 0, 2, 3], np.uint16)),
            **more,
        }

    def place(self, *primitives: dict[str, Any], **node: Any) -> None:
        """One mesh at one node."""
        self.tree.setdefault("meshes", []).append({"name": "quad", "primitives": [*primitives]})
        self.tree.setdefault("nodes", []).append(
            {"mesh": len(self.tree["meshes"]) - 1, "name": "wall", **node}
        )
        self.tree["scenes"] = [{"nodes": list(range(len(self.tree["nodes"])))}]

    def glb(self) -> bytes:
        self.tree["buffers"] = [{"byteLength": len(self.blob)}, *self.spare]
        text = json.dumps(self.tree).encode()
        text += b" " * (-len(text) % 4)
        blob = self.blob + b"\0" * (-len(self.blob) % 4)
        return (
            struct.pack("<IIIII", 0x46546C67, 2, 28 + len(text) + len(blob), len(text), 0x4E4F534A)
            + text
            + struct.pack("<II", len(blob), 0x004E4942)
            + blob
        )

    def gltf(self, uri: str = "") -> bytes:
        body = base64.b64encode(self.blob).decode()
        uri = uri or f"data:application/octet-stream;base64,{body}"
        self.tree["buffers"] = [{"byteLength": len(self.blob), "uri": uri}]
        return json.dumps(self.tree).encode()


def broken(change: Callable[[GltfModel], object]) -> bytes:
    """The GLB of a wall, changed."""
    return GltfModel.wall(change).glb()
