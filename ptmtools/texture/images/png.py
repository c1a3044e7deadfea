"""PNG: 8 bits through Pillow, 16 bits by hand, and the chunks that describe either.

Pillow writes 16 bits for grey only. A filter is chosen for each row, the one of the least sum of
magnitudes, as the specification proposes (PNG, third edition, 12.7); all of them are computed for a
strip of rows at a time.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.images.opening import LOSSY, ORIENTATION, PNG
from ptmtools.texture.images.picture import format_error, image_error
from ptmtools.texture.model import Description

#: Colour type by number of components.
_COLOUR = {1: 0, 2: 4, 3: 2, 4: 6}
_DEFLATE_LEVEL = 6
_STRIP_BYTES = 1 << 20
_PLAIN = Description()


def png_bytes(image: NDArray[Any], description: Description = _PLAIN, lossy: int = 0) -> bytes:
    """(h, w, c) uint8 or uint16, 1 to 4 components, as the bytes of a PNG. ``lossy``: bytes of the
    lossy image that texels of 8 bits come from, which readers of the PNG then know; or 0."""
    buffer = io.BytesIO()
    if lossy and image.dtype.itemsize == 1:
        _save_shallow(buffer, image, description, lossy)
    else:
        save_png(buffer, image, description)
    return buffer.getvalue()


def save_png(file: IO[bytes], image: NDArray[Any], description: Description = _PLAIN) -> None:
    """As `png_bytes`, into an open file. Raises OutputError PTM-O101 for floats."""
    if image.dtype.kind == "f":
        raise format_error("png", image, ".npy, .tif or .exr")
    (_save_deep if image.dtype.itemsize > 1 else _save_shallow)(file, image, description)


def _save_shallow(
    file: IO[bytes], image: NDArray[np.uint8], description: Description, lossy: int = 0
) -> None:
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    if lossy:
        info.add_text(LOSSY, str(lossy))
    for kind, data in _colour_chunks(description):
        if kind != b"iCCP":
            info.add(kind, data)
    settings: dict[str, Any] = {"pnginfo": info}
    if description.icc is not None:
        settings["icc_profile"] = description.icc
    if description.orientation != 1:
        settings["exif"] = _exif(description.orientation)
    flat = image[:, :, 0] if image.shape[2] == 1 else image
    Image.fromarray(flat).save(file, "PNG", **settings)


def _save_deep(file: IO[bytes], image: NDArray[np.uint16], description: Description) -> None:
    def put(kind: bytes, data: bytes) -> None:
        file.write(struct.pack(">I", len(data)) + kind + data)
        file.write(struct.pack(">I", zlib.crc32(kind + data)))

    height, width, components = image.shape
    file.write(PNG)
    put(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, _COLOUR[components], 0, 0, 0))
    for kind, data in _colour_chunks(description):
        put(kind, data)
    if description.orientation != 1:
        put(b"eXIf", _exif(description.orientation).removeprefix(b"Exif\0\0"))
    packer = zlib.compressobj(_DEFLATE_LEVEL, zlib.DEFLATED, 15, 9)
    for strip in _filter_rows(image):
        if packed := packer.compress(strip):
            put(b"IDAT", packed)
    put(b"IDAT", packer.flush())
    put(b"IEND", b"")


def check_chunks(file: BinaryIO) -> None:
    """Checks that every chunk up to the last, IEND, is present and that the checksums of those that
    texels depend on match. Pillow checks neither once it has all rows.

    Raises InputError PTM-I125.
    """
    file.seek(len(PNG))
    kind = b""
    while kind != b"IEND":
        head = file.read(8)
        kind, remaining = head[4:], int.from_bytes(head[:4], "big")
        if kind[:1].islower():  # texels do not depend on it
            file.seek(remaining + 4, 1)
            continue
        checksum = zlib.crc32(kind)
        while remaining and (part := file.read(min(remaining, _STRIP_BYTES))):
            checksum = zlib.crc32(part, checksum)
            remaining -= len(part)
        stored = file.read(4)
        if len(stored) < 4:
            raise image_error("it ends before its chunk IEND")
        if stored != checksum.to_bytes(4, "big"):
            raise image_error(f"the checksum of {kind!r} before byte {file.tell()} is wrong")


def _filter_rows(image: NDArray[np.uint16]) -> Iterator[bytes]:
    """Rows as PNG has them before deflating: number of the filter, filtered bytes."""
    height, width, components = image.shape
    texel = 2 * components
    step = max(1, _STRIP_BYTES // (width * texel))
    for y in range(0, height, step):
        first = max(0, y - 1)
        rows = image[first : y + step].astype(">u2").view(np.uint8).reshape(-1, width * texel)
        padded = np.zeros((len(rows) + (y == 0), (width + 1) * texel), np.uint8)
        padded[y == 0 :, texel:] = rows
        row, west = padded[1:, texel:], padded[1:, :-texel]
        north, corner = padded[:-1, texel:], padded[:-1, :-texel]
        mean = (west.astype(np.uint16) + north) >> 1
        filtered = np.stack(
            [row, row - west, row - north, row - mean, row - _paeth(west, north, corner)],
            dtype=np.uint8,
            casting="unsafe",
        )
        cost = np.abs(filtered.view(np.int8).astype(np.int16)).sum(axis=2)
        best = cost.argmin(axis=0)
        out = np.empty((len(row), 1 + width * texel), np.uint8)
        out[:, 0] = best
        out[:, 1:] = filtered[best, np.arange(len(row))]
        yield out.tobytes()


def _paeth(
    west: NDArray[np.uint8], north: NDArray[np.uint8], corner: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Whichever of the three is nearest to left + above - corner."""
    a, b, c = (part.astype(np.int16) for part in (west, north, corner))
    to_west, to_north, to_corner = abs(b - c), abs(a - c), abs(a + b - 2 * c)
    return np.where(
        (to_west <= to_north) & (to_west <= to_corner),
        west,
        np.where(to_north <= to_corner, north, corner),
    )


def _colour_chunks(description: Description) -> Iterator[tuple[bytes, bytes]]:
    """Chunks that describe the colours, in the order that PNG prescribes."""
    if description.chromaticities is not None:
        yield b"cHRM", struct.pack(">8I", *description.chromaticities)
    if description.gamma is not None:
        yield b"gAMA", struct.pack(">I", description.gamma)
    if description.icc is not None:
        yield b"iCCP", b"ICC Profile\0\0" + zlib.compress(description.icc)
    elif description.srgb is not None:
        yield b"sRGB", bytes([description.srgb])


def _exif(orientation: int) -> bytes:
    from PIL.Image import Exif

    exif = Exif()
    exif[ORIENTATION] = orientation
    return exif.tobytes()
