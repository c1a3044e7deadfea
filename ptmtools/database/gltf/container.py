"""The GLBs that `emit` writes: JSON and the bytes of one buffer, see `ptmtools.glb`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from ptmtools import schemas
from ptmtools.database.fault import FileError, shaped
from ptmtools.errors import LimitError
from ptmtools.glb import BINARY, JSON, glb, glb_chunks

_LARGEST = 2**32 - 1
#: The most bytes around JSON and buffer: headers and padding.
_AROUND = 34


def pack(document: Mapping[str, Any], binary: bytes) -> bytes:
    """A GLB of a JSON document and the bytes of its only buffer, which may be empty.

    Raises LimitError: PTM-L600 it is longer than a GLB can be, 4 GiB.
    """
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode(
        "utf-8", "replace"
    )
    if (length := len(text) + len(binary) + _AROUND) > _LARGEST:
        raise LimitError(
            "PTM-L600",
            f"a cell takes {length:,} bytes as GLB, more than the format can hold",
            remedy="make smaller cells, or leave gltf out of --format",
        )
    return glb([(JSON, text), (BINARY, binary)][: 2 if binary else 1])


def unpack(data: bytes) -> tuple[Any, bytes]:
    """The JSON document of a GLB and its bytes, padding included.

    Raises FileError: PTM-D731 if it is not what `pack` writes.
    """
    try:
        chunks = [(kind, body) for kind, _, body in glb_chunks(data)]
        if [kind for kind, _ in chunks[1:]] not in ([], [BINARY]) or glb(chunks) != data:
            raise ValueError("not JSON and BIN alone, each of a multiple of 4 bytes", "byte 12")
    except ValueError as fault:
        raise FileError("PTM-D731", fault.args[1], fault.args[0]) from None
    with shaped("PTM-D731", "JSON"):
        return schemas.parse(chunks[0][1]), b"".join(body for _, body in chunks[1:])
