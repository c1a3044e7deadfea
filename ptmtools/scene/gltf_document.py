"""The container of a glTF model: its JSON, its buffers, and where in which file they lie.

GLB chunks, data URIs and separate files all become `Buffer`s; sizes and ranges are checked
before anything is made of them (glTF 2.0, sections 3.6 and 4.4). A file that several buffers name
is read once, and no more of it than the longest of them.
"""

from __future__ import annotations

import base64
import binascii
import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.files import open_regular
from ptmtools.glb import BINARY, MAGIC, elements, glb_chunks, meaning, natural
from ptmtools.scene.reference import Folder
from ptmtools.scene.source import FileRange, HeldBytes, decode

#: How JSON writes halves of characters of UTF-16, of which one alone is no text.
_HALF = re.compile(r"\\u[dD][89a-fA-F]")


@dataclass(frozen=True)
class Buffer:
    """The bytes of a buffer, and the file and offset they come from (no path: a data URI)."""

    data: bytes
    path: Path | None
    offset: int = 0

    def part(self, start: int, length: int) -> Callable[[], bytes]:
        """A reader of ``length`` bytes from ``start``, for later."""
        if self.path is None:
            return HeldBytes(self.data[start : start + length])
        return FileRange(self.path, self.offset + start, length)


@dataclass(frozen=True)
class Document:
    """A glTF model: its file, the parsed JSON and its buffers in order."""

    path: Path
    tree: dict[str, Any]
    buffers: tuple[Buffer, ...]

    def view(self, index: int) -> tuple[Buffer, int, int]:
        """Buffer, start and length of a buffer view; ValueError if it leaves the buffer."""
        view = self.tree["bufferViews"][natural(index)]
        buffer = self.buffers[natural(view["buffer"])]
        start, length = natural(view.get("byteOffset", 0)), natural(view["byteLength"])
        if start + length > len(buffer.data):
            raise ValueError(f"buffer view {index} ends beyond its buffer")
        return buffer, start, length

    def values(self, index: int) -> NDArray[np.float64]:
        """(count, items) the numbers of an accessor. Raises ValueError, LookupError or TypeError
        if it is damaged, NotImplementedError if it is sparse or has no buffer view."""
        accessor = self.tree["accessors"][natural(index)]
        if "sparse" in accessor or "bufferView" not in accessor:
            raise NotImplementedError(f"accessor {index} is sparse or has no buffer view")
        view = self.tree["bufferViews"][natural(accessor["bufferView"])]
        try:
            stored = elements(accessor, view, self.buffers[natural(view["buffer"])].data)
        except ValueError as error:
            raise ValueError(f"accessor {index}: {error}") from None
        return meaning(stored, bool(accessor.get("normalized")))


def damaged(path: Path, what: str, place: str | None = None) -> InputError:
    """The error for a file that is not what glTF 2.0 says."""
    return InputError(
        "PTM-I249",
        f"not a valid glTF 2.0 model: {what}",
        file=path,
        place=place,
        remedy="export or download it again",
    )


def open_document(path: Path, folder: Folder) -> Document:
    """Read a .glb or .gltf file and all buffers it names.

    Raises InputError where the container is damaged or a buffer is missing.
    """
    data = path.read_bytes()
    binary: Buffer | None = None
    if data.startswith(MAGIC) or path.suffix.lower() == ".glb":
        try:
            (_, _, text), *more = glb_chunks(data)
        except ValueError as error:
            raise damaged(path, *error.args) from None
        bodies = (Buffer(body, path.absolute(), at) for kind, at, body in more if kind == BINARY)
        binary = next(bodies, None)
    else:
        text = data
    try:
        tree = _parsed(decode(text))
    except (ValueError, RecursionError) as error:
        raise damaged(path, f"its JSON cannot be read ({error})") from None
    if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
        raise damaged(path, "its JSON is not a glTF document")
    version = str(tree["asset"].get("version", ""))
    if not version.startswith("2."):
        raise damaged(path, f"version {version!r}")

    return Document(path, tree, tuple(_buffers(path, tree, folder, binary)))


def _parsed(text: str) -> Any:
    """JSON; ValueError for what is none, NaN among it. What is no text becomes question marks."""
    tree = json.loads(text, parse_constant=_no_constant)
    if _HALF.search(text):
        tree = json.loads(json.dumps(tree, ensure_ascii=False).encode("utf-8", "replace"))
    return tree


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not valid JSON")


def _buffers(
    path: Path, tree: dict[str, Any], folder: Folder, binary: Buffer | None
) -> list[Buffer]:
    """The buffers of a document, in order."""
    found: list[Buffer | Path] = []
    lengths: list[int] = []
    longest: dict[Path, int] = {}
    for index, entry in enumerate(tree.get("buffers", [])):
        place = f"buffer {index}"
        lengths.append(natural(entry["byteLength"]))
        if "uri" not in entry:
            if binary is None or index:
                raise damaged(path, "a buffer has no bytes", place)
            found.append(binary)
        elif str(entry["uri"]).startswith("data:"):
            found.append(Buffer(data_uri(path, entry["uri"], place), None))
        else:
            file = _external(path, folder, str(entry["uri"]), place)
            found.append(file)
            longest[file] = max(lengths[-1], longest.get(file, 0))
    read: dict[Path, Buffer] = {}
    for file, length in longest.items():
        with open_regular(file) as stream:
            # Reading takes memory for all that is asked for.
            read[file] = Buffer(stream.read(min(length, os.fstat(stream.fileno()).st_size)), file)
    buffers = [read[entry] if isinstance(entry, Path) else entry for entry in found]
    for index, (buffer, length) in enumerate(zip(buffers, lengths, strict=True)):
        if len(buffer.data) < length:
            raise damaged(
                path, f"{length} bytes expected, {len(buffer.data)} found", f"buffer {index}"
            )
    return buffers


def _external(path: Path, folder: Folder, uri: str, place: str) -> Path:
    """The file of a buffer. Raises InputError PTM-I203, PTM-I205."""
    found = folder.find(unquote(uri))
    if found.path is None:
        outside = found.outcome == "outside"
        raise InputError(
            "PTM-I205" if outside else "PTM-I203",
            f"{uri[:80]}: " + ("lies outside the model's folder" if outside else "not found"),
            file=path,
            place=place,
            remedy="give --allow-outside" if outside else "put it into the model's folder",
        )
    return found.path.resolve()


def data_uri(path: Path, uri: str, place: str) -> bytes:
    """The bytes of a base64 data URI."""
    head, comma, body = uri.partition(",")
    try:
        if not comma or not head.endswith(";base64"):
            raise ValueError("not base64")
        return base64.b64decode(unquote(body), validate=True)
    except (ValueError, binascii.Error) as error:
        raise damaged(path, f"data URI {head[:40]}: {error}", place) from None
