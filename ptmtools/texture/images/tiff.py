"""TIFF as it is written: one page, one strip for every few rows, deflated (TIFF 6.0; Adobe's
technical note on deflate, compression 8). Pillow writes only some kinds of samples.
"""

from __future__ import annotations

import struct
import zlib
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import OutputError
from ptmtools.texture.model import Description

_STRIP_BYTES = 1 << 20
#: Magic, and where the directory is.
_HEAD = struct.Struct("<4sI")
_SHORT, _LONG, _BYTES = 3, 4, 7
_SIZES = {_SHORT: ("H", 2), _LONG: ("I", 4), _BYTES: ("B", 1)}


def save_tiff(file: IO[bytes], texels: NDArray[Any], description: Description) -> None:
    """(h, w, c) of any kind, 1 to 4 components, as a little-endian TIFF, in an empty file.

    The second of two components and the fourth of four are alpha, not premultiplied.

    Raises OutputError PTM-O102 for what does not fit into 4 GiB.
    """
    height, width, components = texels.shape
    row = texels[:1].nbytes
    per_strip = max(1, _STRIP_BYTES // row)
    file.write(_HEAD.pack(b"II*\0", 0))
    end = _HEAD.size
    offsets, lengths = [], []
    for y in range(0, height, per_strip):
        part = np.ascontiguousarray(texels[y : y + per_strip])
        packed = zlib.compress(part.astype(part.dtype.newbyteorder("<"), copy=False).data)
        offsets.append(end)
        lengths.append(len(packed))
        file.write(packed)
        end += len(packed)
    icc = description.icc or b""
    if end + len(icc) + 8 * len(offsets) + 1024 > 1 << 32:
        raise OutputError(
            "PTM-O102", "a .tif holds no more than 4 GiB", remedy="name the output .npy"
        )
    sample_format = 3 if texels.dtype.kind == "f" else 1
    tags: list[tuple[int, int, list[int] | bytes]] = [
        (256, _LONG, [width]),
        (257, _LONG, [height]),
        (258, _SHORT, [8 * texels.dtype.itemsize] * components),
        (259, _SHORT, [8]),
        (262, _SHORT, [2 if components > 2 else 1]),
        (273, _LONG, offsets),
        (274, _SHORT, [description.orientation]),
        (277, _SHORT, [components]),
        (278, _LONG, [per_strip]),
        (279, _LONG, lengths),
        *([(338, _SHORT, [2])] if components in (2, 4) else []),
        (339, _SHORT, [sample_format] * components),
        *([(34675, _BYTES, icc)] if icc else []),
    ]
    entries = bytearray()
    body = bytearray(end & 1)
    for tag, kind, values in tags:
        letter, size = _SIZES[kind]
        packed = struct.pack(f"<{len(values)}{letter}", *values)
        place = packed.ljust(4, b"\0")
        if len(packed) > 4:
            place = struct.pack("<I", end + len(body))
            body += packed + bytes(len(packed) & 1)
        entries += struct.pack("<HHI", tag, kind, len(packed) // size) + place
    file.write(body + struct.pack("<H", len(tags)) + entries + bytes(4))
    file.seek(0)
    file.write(_HEAD.pack(b"II*\0", end + len(body)))
    file.seek(0, 2)
