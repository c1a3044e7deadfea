"""GLB, the container of glTF 2.0 (section 4.4): a header, a chunk of JSON, a chunk of bytes.

=======  ==========================================================
offset   little-endian uint32
=======  ==========================================================
0        "glTF", version 2, length of the file
12       length of the JSON, "JSON", the JSON, spaces up to 4 bytes
then     length of the bytes, "BIN\\0", the bytes, zeros up to 4;
         left out where there are none
=======  ==========================================================
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any, NoReturn

from ptmtools import schemas
from ptmtools.errors import LimitError

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_MAGIC, _VERSION = b"glTF", 2
_JSON, _BINARY = b"JSON", b"BIN\0"
_LARGEST = 2**32 - 1


class GlbError(Exception):
    """The first thing in a file that is wrong: a code of `validation`, where, and what."""

    def __init__(self, code: str, place: str, message: str) -> None:
        self.code = code
        self.place = place
        self.message = message
        super().__init__(f"{place}: {message}")


def pack(document: Mapping[str, Any], binary: bytes) -> bytes:
    """A GLB of a JSON document and the bytes of its only buffer, which may be empty.

    Raises
    ------
    LimitError: PTM-L600 it is longer than a GLB can be, 4 GiB.
    """
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    chunks = [(_JSON, _padded(text.encode("utf-8", "replace"), b" "))]
    if binary:
        chunks.append((_BINARY, _padded(binary, b"\0")))
    length = _HEADER.size + sum(_CHUNK.size + len(body) for _, body in chunks)
    if length > _LARGEST:
        raise LimitError(
            "PTM-L600",
            f"a cell takes {length:,} bytes as GLB, more than the format can hold",
            remedy="make smaller cells, or leave gltf out of --format",
        )
    parts = [_HEADER.pack(_MAGIC, _VERSION, length)]
    for kind, body in chunks:
        parts += [_CHUNK.pack(len(body), kind), body]
    return b"".join(parts)


def unpack(data: bytes) -> tuple[Any, bytes]:
    """The JSON document of a GLB and its bytes, padding included.

    Raises
    ------
    GlbError: PTM-D731 if it is not what `pack` writes.
    """
    if len(data) < _HEADER.size:
        _damaged(f"byte {len(data)}", "cut short in its header")
    magic, version, length = _HEADER.unpack_from(data)
    if magic != _MAGIC or version != _VERSION:
        _damaged("byte 0", "not a GLB of version 2")
    if length != len(data):
        _damaged("byte 8", f"a length of {length} bytes, not {len(data)}")
    chunks: list[tuple[bytes, bytes]] = []
    at = _HEADER.size
    while at < len(data):
        if at + _CHUNK.size > len(data):
            _damaged(f"byte {at}", "a chunk is cut short")
        size, kind = _CHUNK.unpack_from(data, at)
        begin, at = at + _CHUNK.size, at + _CHUNK.size + size
        if size % 4 or at > len(data):
            _damaged(f"byte {begin}", f"a chunk of {size} bytes does not fit")
        chunks.append((kind, data[begin:at]))
    if [kind for kind, _ in chunks] not in ([_JSON], [_JSON, _BINARY]):
        _damaged(f"byte {_HEADER.size}", "the chunks are not JSON and BIN")
    try:
        document = schemas.parse(chunks[0][1])
    except schemas.ShapeError as fault:
        _damaged("JSON", fault.message)
    return document, chunks[1][1] if len(chunks) > 1 else b""


def _padded(body: bytes, filling: bytes) -> bytes:
    return body + filling * (-len(body) % 4)


def _damaged(place: str, message: str) -> NoReturn:
    raise GlbError("PTM-D731", place, message)
