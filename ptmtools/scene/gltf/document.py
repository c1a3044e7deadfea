"""Opens the container of a glTF model: JSON, buffers, accessors and extensions.

GLB chunks, data URIs and separate files become `Buffer`s with their location; sizes and ranges are
checked before use (glTF 2.0, sections 3.6 and 4.4). A file that several buffers refer to is read
once, up to the longest of them. A buffer may have no bytes if all its views are compressed
(`meshopt`); these are decompressed on first use.
"""

from __future__ import annotations

import base64
import binascii
import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_regular
from ptmtools.glb import BINARY, COMPONENTS, ITEMS, MAGIC, elements, glb_chunks, meaning, natural
from ptmtools.meshopt.decoding import EXTENSIONS, decode as decode_view
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.reference import ModelFolder
from ptmtools.scene.source import FileFacts, FileRange, HeldBytes, decode

#: A surrogate in JSON; a single one is not valid text.
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
#: Limit of all decompressed bytes: constant, and per byte of the buffers. Constant attributes
#: compress to a thousandth.
_DECODED, _DECODED_PER_BYTE = 1 << 30, 100


@dataclass(frozen=True)
class Buffer:
    """The bytes of a buffer, and their file and offset (no path: a data URI)."""

    data: bytes
    path: Path | None
    offset: int = 0

    def part(self, start: int, length: int) -> Callable[[], bytes]:
        """A reader of ``length`` bytes from ``start``, for later."""
        if self.path is None:
            return HeldBytes(self.data[start : start + length])
        return FileRange(self.path, self.offset + start, length)


class GltfDocument:
    """A glTF model: its file, the parsed JSON and its buffers in order, None for those without
    bytes."""

    def __init__(self, path: Path, tree: dict[str, Any], buffers: Sequence[Buffer | None]) -> None:
        self.path, self.tree = path, tree
        self._buffers = buffers
        self._decoded: dict[int, Buffer] = {}
        size = sum(len(buffer.data) for buffer in buffers if buffer is not None)
        self._budget = _DECODED + _DECODED_PER_BYTE * size

    def view(self, index: int) -> tuple[Buffer, int, int]:
        """Buffer, start and length of a buffer view.

        Raises ValueError if it exceeds the buffer or is damaged, LimitError PTM-L204.
        """
        view = self.tree["bufferViews"][natural(index)]
        extensions = view.get("extensions", {})
        compressed = next((extensions[name] for name in EXTENSIONS if name in extensions), None)
        if compressed is None:
            return self._part(view, f"buffer view {index}")
        if index not in self._decoded:
            self._decoded[index] = self._decompress(index, compressed)
        buffer = self._decoded[index]
        length = natural(view["byteLength"])
        if length > len(buffer.data):
            raise ValueError(f"buffer view {index} exceeds its decompressed bytes")
        return buffer, 0, length

    def _decompress(self, index: int, compressed: dict[str, Any]) -> Buffer:
        size = natural(compressed["count"]) * natural(compressed["byteStride"])
        self._budget -= size
        if self._budget < 0:
            raise LimitError(
                "PTM-L204",
                f"decompresses to {size >> 20:,} MiB, which exceeds the limit of all "
                "decompressed data",
                file=self.path,
                place=f"buffer view {index}",
                remedy="export it without compression",
            )
        buffer, start, length = self._part(compressed, f"buffer view {index}")
        return Buffer(decode_view(buffer.data[start : start + length], compressed), None)

    def _part(self, part: dict[str, Any], place: str) -> tuple[Buffer, int, int]:
        number = natural(part["buffer"])
        buffer = self._buffers[number]
        start, length = natural(part.get("byteOffset", 0)), natural(part["byteLength"])
        if buffer is None:
            raise ValueError(f"buffer {number} has no bytes")
        if start + length > len(buffer.data):
            raise ValueError(f"{place} exceeds its buffer")
        return buffer, start, length

    def values(self, index: int) -> Floats:
        """(count, items) the values of an accessor, sparse ones included (section 3.6.2).

        Raises ValueError, LookupError or TypeError if it is damaged, LimitError PTM-L204.
        """
        accessor = self.tree["accessors"][natural(index)]
        try:
            if "bufferView" in accessor:
                stored = self._elements(accessor, accessor["bufferView"])
            else:
                shape = natural(accessor["count"]), ITEMS[accessor["type"]]
                if not shape[0]:
                    raise ValueError("no elements")
                stored = np.zeros(shape, np.dtype(COMPONENTS[accessor["componentType"]]))
            if "sparse" in accessor:
                stored = self._substitute(stored, accessor)
        except ValueError as error:
            raise ValueError(f"accessor {index}: {error}") from None
        return meaning(stored, bool(accessor.get("normalized")))

    def _substitute(self, stored: NDArray[Any], accessor: dict[str, Any]) -> NDArray[Any]:
        """The elements with the substitutes of a sparse accessor (section 3.6.2.3)."""
        sparse = accessor["sparse"]
        count = natural(sparse["count"])
        form = sparse["indices"] | {"count": count, "type": "SCALAR"}
        place = self._elements(form, form["bufferView"]).ravel()
        if not (np.diff(place.astype(np.int64)) > 0).all() or place[-1] >= len(stored):
            raise ValueError("sparse indices are not increasing, or exceed the elements")
        form = accessor | {"count": count, "byteOffset": sparse["values"].get("byteOffset", 0)}
        result = stored.copy()
        result[place] = self._elements(form, sparse["values"]["bufferView"])
        return result

    def _elements(self, accessor: dict[str, Any], view: int) -> NDArray[Any]:
        buffer, start, length = self.view(view)
        place = {"byteOffset": start, "byteLength": length}
        return elements(accessor, self.tree["bufferViews"][view] | place, buffer.data)


def place_of(kind: str, entry: dict[str, Any], index: int | None) -> str:
    """The place of an entry of a list, by its name, else by its number."""
    return f"{kind} {entry.get('name') or index}"


def damage(path: Path, reason: str, place: str | None = None) -> InputError:
    """The error for a file that violates glTF 2.0, PTM-I249."""
    return InputError(
        "PTM-I249",
        f"not a valid glTF 2.0 model: {reason}",
        file=path,
        place=place,
        remedy="export or download it again",
    )


def open_document(path: Path, folder: ModelFolder) -> GltfDocument:
    """Reads a .glb or .gltf file and all its buffers.

    Raises InputError if the container is damaged or a buffer is missing.
    """
    tree, binary = _read_container(path)
    version = str(tree["asset"].get("version", ""))
    if not version.startswith("2."):
        raise damage(path, f"version {version!r}")
    return GltfDocument(path, tree, _buffers(path, tree, folder, binary))


def document_json(path: Path) -> dict[str, Any]:
    """The JSON of a .glb or .gltf file. Raises InputError if the container is damaged."""
    return _read_container(path)[0]


def _read_container(path: Path) -> tuple[dict[str, Any], Buffer | None]:
    """The JSON, and the binary chunk of a GLB."""
    data = path.read_bytes()
    binary: Buffer | None = None
    if data.startswith(MAGIC) or path.suffix.lower() == ".glb":
        try:
            (_, _, text), *more = glb_chunks(data)
        except ValueError as error:
            raise damage(path, *error.args) from None
        bodies = (Buffer(body, path.absolute(), at) for kind, at, body in more if kind == BINARY)
        binary = next(bodies, None)
    else:
        text = data
    try:
        tree = _parse(decode(text))
    except (ValueError, RecursionError) as error:
        raise damage(path, f"invalid JSON ({error})") from None
    if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
        raise damage(path, "the JSON is not a glTF document")
    return tree, binary


def _parse(text: str) -> Any:
    """Parsed JSON, with single surrogates replaced by question marks; ValueError for invalid JSON,
    NaN included."""
    tree = json.loads(text, parse_constant=_reject_constant)
    if _SURROGATE.search(text):
        tree = json.loads(json.dumps(tree, ensure_ascii=False).encode("utf-8", "replace"))
    return tree


def _reject_constant(name: str) -> float:
    raise ValueError(f"{name} is not valid JSON")


def _buffers(
    path: Path, tree: dict[str, Any], folder: ModelFolder, binary: Buffer | None
) -> list[Buffer | None]:
    """The buffers of a document, in order; None for placeholders of compressed data."""
    entries: list[Buffer | Path | None] = []
    lengths: list[int] = []
    longest: dict[Path, int] = {}
    for index, entry in enumerate(tree.get("buffers", [])):
        place = f"buffer {index}"
        lengths.append(natural(entry["byteLength"]))
        extensions = entry.get("extensions", {})
        if any(extensions.get(name, {}).get("fallback") for name in EXTENSIONS):
            entries.append(None)
        elif "uri" not in entry:
            entries.append(None if index else binary)
        elif str(entry["uri"]).startswith("data:"):
            entries.append(Buffer(data_uri(path, entry["uri"], place), None))
        else:
            file = _external_file(path, folder, str(entry["uri"]), place)
            entries.append(file)
            longest[file] = max(lengths[-1], longest.get(file, 0))
    read: dict[Path, Buffer] = {}
    for file, length in longest.items():
        with open_regular(file) as stream:
            # read() allocates the whole requested length.
            read[file] = Buffer(stream.read(min(length, os.fstat(stream.fileno()).st_size)), file)
    buffers = [read[entry] if isinstance(entry, Path) else entry for entry in entries]
    for index, (buffer, length) in enumerate(zip(buffers, lengths, strict=True)):
        if buffer is not None and len(buffer.data) < length:
            raise damage(path, f"{len(buffer.data)} bytes instead of {length}", f"buffer {index}")
    return buffers


def _external_file(path: Path, folder: ModelFolder, uri: str, place: str) -> Path:
    """The file of a buffer. Raises InputError PTM-I203, PTM-I205."""
    result = folder.find(unquote(uri))
    if result.path is None:
        outside = result.outcome == "outside"
        raise InputError(
            "PTM-I205" if outside else "PTM-I203",
            f"{uri[:80]}: " + ("lies outside the model's folder" if outside else "not found"),
            file=path,
            place=place,
            remedy="use --allow-outside" if outside else "put it into the model's folder",
        )
    return result.path.resolve()


def data_uri(path: Path, uri: str, place: str) -> bytes:
    """The bytes of a base64 data URI."""
    head, comma, body = uri.partition(",")
    try:
        if not comma or not head.endswith(";base64"):
            raise ValueError("not base64")
        return base64.b64decode(unquote(body), validate=True)
    except (ValueError, binascii.Error) as error:
        raise damage(path, f"data URI {head[:40]}: {error}", place) from None


#: Support of an extension: applied; without effect on the emitted files; dropped with a note.
Support = Literal["read", "silent", "noted"]

_SUPPORTED: dict[Support, str] = {
    "read": """
        EXT_mesh_gpu_instancing EXT_meshopt_compression EXT_texture_webp
        KHR_draco_mesh_compression KHR_lights_punctual KHR_materials_emissive_strength
        KHR_materials_pbrSpecularGlossiness KHR_materials_transmission KHR_materials_unlit
        KHR_mesh_quantization KHR_meshopt_compression KHR_node_visibility KHR_texture_basisu
        KHR_texture_transform
    """,
    "silent": """
        KHR_animation_pointer KHR_materials_anisotropy KHR_materials_clearcoat
        KHR_materials_dispersion KHR_materials_ior KHR_materials_iridescence KHR_materials_sheen
        KHR_materials_specular KHR_materials_volume KHR_xmp_json_ld
    """,
    "noted": """
        KHR_materials_diffuse_transmission KHR_materials_variants
    """,
}
KNOWN = {name: support for support, names in _SUPPORTED.items() for name in names.split()}
#: How to remove an extension from a model.
_REMEDIES = {"EXT_texture_avif": "run `npx @gltf-transform/cli png --formats '*' IN.glb OUT.glb`"}
_WORDS: dict[Support, str] = {
    "read": "read",
    "silent": "does not change what is drawn",
    "noted": "not carried over",
}
_ANY = "open it in Blender and export it as glTF again"


def facts_of(model: Path) -> FileFacts:
    """The facts in the JSON of a model. Raises as `document_json`."""
    tree = document_json(model)
    asset = tree["asset"]
    names = tree.get("extensionsUsed", []) + tree.get("extensionsRequired", [])
    support = {name: _WORDS[KNOWN.get(name, "noted")] for name in sorted({*map(str, names)})}
    return FileFacts(str(asset.get("version", "")), str(asset.get("generator", "")), support)


def check_extensions(tree: dict[str, object], notes: IngestNotes) -> None:
    """Notes dropped extensions. Raises InputError PTM-I243 for an unsupported required one."""
    required, used = tree.get("extensionsRequired", []), tree.get("extensionsUsed", [])
    if not isinstance(required, list) or not isinstance(used, list):
        raise ValueError("extensions are not a list")
    for name in sorted({str(name) for name in required} - KNOWN.keys()):
        raise InputError(
            "PTM-I243",
            f"requires the unsupported glTF extension {name}",
            file=notes.model,
            remedy=_REMEDIES.get(name, _ANY),
        )
    for name in sorted({str(name) for name in used}):
        if KNOWN.get(name, "noted") == "noted":
            notes.note("PTM-N215", f"{name} dropped")
