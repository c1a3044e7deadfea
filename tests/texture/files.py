"""Image files in memory, as Pillow saves them and by hand."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterable

from PIL import Image


def saved(image: Image.Image, kind: str = "PNG", **options: object) -> bytes:
    """What Pillow writes."""
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def chunk(kind: bytes, data: bytes = b"") -> bytes:
    """One of a PNG, with its checksum."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(
    width: int,
    rows: Iterable[bytes],
    depth: int = 8,
    colour: int = 2,
    *extra: bytes,
    height: int | None = None,
    interlaced: int = 0,
) -> bytes:
    """A PNG by hand, for what Pillow does not write: ``rows`` without filters, ``extra`` chunks
    before the data. ``height``: as it is declared, where rows are not as many."""
    lines = [b"\0" + row for row in rows]
    head = struct.pack(">IIBBBBB", width, height or len(lines), depth, colour, 0, 0, interlaced)
    data = chunk(b"IDAT", zlib.compress(b"".join(lines)))
    return b"\x89PNG\r\n\x1a\n" + b"".join([chunk(b"IHDR", head), *extra, data, chunk(b"IEND")])
