"""Radiance pictures (.hdr): RGB floats that share an exponent, four bytes a texel.

The file format is that of Greg Ward, "The RADIANCE Picture File Format": text lines, an empty one,
the size, then scanlines; each is plain, or begins with 2, 2 and its length and has the four bytes
of its texels apart, run-length coded. A component is mantissa · 2^(exponent - 136), which a
float32 holds exactly. (Some readers add half a unit to the mantissa. This one does not, like most:
it would make 0 of no value and the means of levels no better.) EXPOSURE and COLORCORR lines are
not applied.
"""

from __future__ import annotations

import re
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import OutputError
from ptmtools.texture.images.declared import check_file
from ptmtools.texture.images.picture import Picture, check_size, damaged_image, unsupported
from ptmtools.texture.model import Description, Limits

MAGIC = (b"#?RADIANCE", b"#?RGBE")
_HEAD_MAX = 1 << 16
_SIZE = re.compile(rb"([-+][XY]) (\d+) ([-+][XY]) (\d+)\n")
#: The exponent byte of 1.0 is 129, and mantissas count 256ths.
_BIAS = 136
#: Lengths of scanlines that can be run-length coded.
_CODED = range(8, 1 << 15)


def read_hdr(file: BinaryIO, limits: Limits) -> Picture:
    """A Radiance picture, (h, w, 3) of float32.

    Raises InputError PTM-I125, PTM-I126, LimitError PTM-L104.
    """
    check_file(file, limits)
    file.seek(0)
    data = file.read()
    end = data.find(b"\n\n", 0, _HEAD_MAX)
    size = _SIZE.match(data, end + 2) if end >= 0 else None
    if size is None:
        raise damaged_image("in its head")
    if b"32-bit_rle_xyze" in data[:end]:
        raise unsupported("the colour model XYZ")
    if (size[1], size[3]) != (b"-Y", b"+X"):
        raise unsupported("rows that do not go from the top and left")
    height, width = int(size[2]), int(size[4])
    check_size(width, height, 12, limits)
    # A run codes at most 127 bytes in two.
    if (len(data) - size.end()) * 64 < 4 * width * height:
        raise damaged_image(f"after {len(data)} bytes")
    texels = np.empty((height, width, 4), np.uint8)
    at = size.end()
    for row in texels:
        if width in _CODED and data[at : at + 4] == bytes([2, 2, width >> 8, width & 255]):
            at = _coded_row(data, at + 4, row)
        else:
            flat = data[at : at + 4 * width]
            if len(flat) < 4 * width or _old_run(flat):
                raise damaged_image(f"at byte {at}, or of the oldest kind")
            row[:] = np.frombuffer(flat, np.uint8).reshape(width, 4)
            at += 4 * width
    return Picture(floats(texels))


def floats(texels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Mantissas and exponents (h, w, 4) as numbers (h, w, 3). An exponent of 0 is black."""
    exponent = texels[:, :, 3:].astype(np.int16)
    scale = np.where(exponent > 0, np.ldexp(1.0, exponent - _BIAS), 0)
    return (texels[:, :, :3] * scale).astype(np.float32)


def save_radiance(file: IO[bytes], texels: NDArray[Any], description: Description) -> None:
    """(h, w, 3) floats as a Radiance picture, scanlines plain, without the description.

    Raises OutputError PTM-O102 unless it holds every one of them exactly.
    """
    height, width, components = texels.shape
    mantissas = np.zeros((height, width, 4), np.uint8)
    if components == 3:
        top = texels.max(axis=2).astype(np.float64)
        with np.errstate(all="ignore"):
            # The least exponent byte is 1.
            exponent = np.maximum(np.frexp(top)[1], 1 - 128)
            units = np.ldexp(texels.astype(np.float64), (8 - exponent)[:, :, None])
            mantissas[:, :, :3] = units
            mantissas[:, :, 3] = np.where(top > 0, exponent + 128, 0)
    held = floats(mantissas)
    if components != 3 or held.tobytes() != texels.astype(np.float32).tobytes():
        raise OutputError(
            "PTM-O102",
            "a .hdr does not hold these texels exactly",
            remedy="name the output .npy, .tif or .exr",
        )
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    file.write(head.encode() + mantissas.tobytes())


def _coded_row(data: bytes, at: int, row: NDArray[np.uint8]) -> int:
    """One run-length coded scanline into (w, 4); where the next one begins."""
    width = len(row)
    for component in range(4):
        plane = bytearray()
        while len(plane) < width:
            pair = data[at : at + 2]
            if len(pair) < 2:
                raise damaged_image(f"after {len(data)} bytes")
            count, value = pair
            if count > 128:
                plane += bytes([value]) * (count - 128)
                at += 2
            else:
                part = data[at + 1 : at + 1 + count]
                if not count or len(part) < count:
                    raise damaged_image(f"at byte {at}")
                plane += part
                at += 1 + count
        if len(plane) > width:
            raise damaged_image(f"at byte {at}")
        row[:, component] = np.frombuffer(plane, np.uint8)
    return at


def _old_run(row: bytes) -> bool:
    """Whether a plain scanline has a run of the kind that was used before 1991."""
    texels = np.frombuffer(row, np.uint8).reshape(-1, 4)
    return bool((texels[:, :3] == 1).all(axis=1).any())
