"""Images of floats: Radiance, OpenEXR and numpy.

Radiance pictures (.hdr) have RGB floats that share an exponent, four bytes a texel. The format is
that of Greg Ward, "The RADIANCE Picture File Format": text lines, an empty one,
the size, then scanlines; each is plain, or begins with 2, 2 and its length and has the four bytes
of its texels apart, run-length coded. A component is mantissa · 2^(exponent - 136), which a
float32 holds exactly. (Some readers add half a unit to the mantissa. This one does not, like most:
it would make 0 of no value and the means of levels no better.) EXPOSURE and COLORCORR lines are
not applied.

OpenEXR files need the library of that name, an optional component. The head of a `.npy` is checked
before memory is taken for the texels.
"""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryDirectory
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, OutputError
from ptmtools.lazy import component
from ptmtools.texture.images.picture import (
    Picture,
    check_file,
    check_size,
    check_tile,
    format_error,
    frames_error,
    image_error,
    raster,
    samples_error,
)
from ptmtools.texture.model import Description, Limits
from ptmtools.texture.samples import KINDS

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
        raise image_error("in its head")
    if b"32-bit_rle_xyze" in data[:end]:
        raise samples_error("the colour model XYZ")
    if (size[1], size[3]) != (b"-Y", b"+X"):
        raise samples_error("rows that do not go from the top and left")
    height, width = int(size[2]), int(size[4])
    check_size(width, height, 12, limits)
    # A run codes at most 127 bytes in two.
    if (len(data) - size.end()) * 64 < 4 * width * height:
        raise image_error(f"after {len(data)} bytes")
    texels = np.empty((height, width, 4), np.uint8)
    at = size.end()
    for row in texels:
        if width in _CODED and data[at : at + 4] == bytes([2, 2, width >> 8, width & 255]):
            at = _read_coded_row(data, at + 4, row)
        else:
            flat = data[at : at + 4 * width]
            if len(flat) < 4 * width or _old_run(flat):
                raise image_error(f"at byte {at}, or of the oldest kind")
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

    Raises OutputError PTM-O101 unless it holds every one of them exactly.
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
    stored = floats(mantissas)
    if components != 3 or stored.tobytes() != texels.astype(np.float32).tobytes():
        raise OutputError(
            "PTM-O101",
            "a .hdr does not hold these texels exactly",
            remedy="name the output .npy, .tif or .exr",
        )
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    file.write(head.encode() + mantissas.tobytes())


def _read_coded_row(data: bytes, at: int, row: NDArray[np.uint8]) -> int:
    """One run-length coded scanline into (w, 4); where the next one begins."""
    width = len(row)
    for channel in range(4):
        plane = bytearray()
        while len(plane) < width:
            pair = data[at : at + 2]
            if len(pair) < 2:
                raise image_error(f"after {len(data)} bytes")
            count, value = pair
            if count > 128:
                plane += bytes([value]) * (count - 128)
                at += 2
            else:
                part = data[at + 1 : at + 1 + count]
                if not count or len(part) < count:
                    raise image_error(f"at byte {at}")
                plane += part
                at += 1 + count
        if len(plane) > width:
            raise image_error(f"at byte {at}")
        row[:, channel] = np.frombuffer(plane, np.uint8)
    return at


def _old_run(row: bytes) -> bool:
    """Whether a plain scanline has a run of the kind that was used before 1991."""
    texels = np.frombuffer(row, np.uint8).reshape(-1, 4)
    return bool((texels[:, :3] == 1).all(axis=1).any())


OPENEXR_MAGIC = b"v/1\x01"
#: Channels of the images that are read, in the order of the texel's components.
_CHANNELS = {1: ["Y"], 2: ["Y", "A"], 3: ["R", "G", "B"], 4: ["R", "G", "B", "A"]}


def read_exr(file: BinaryIO, path: str | None, limits: Limits) -> Picture:
    """An OpenEXR file of one part, its data window; (h, w, c) of float16 or float32.

    Raises InputError PTM-I125, PTM-I126, LimitError PTM-L104, MissingComponentError PTM-M100.
    """
    library = _library()
    if path is None:
        return _from_memory(file, limits)
    try:
        # First the head alone: the size is checked before texels are unpacked.
        with library.File(path, header_only=True) as exr:
            head = exr.parts[0].header
            parts = len(exr.parts)
            low, high = ([int(n) for n in corner] for corner in head["dataWindow"])
            tiles = head.get("tiles")
            names = {channel.name for channel in head["channels"]}
            sampled = any((c.xSampling, c.ySampling) != (1, 1) for c in head["channels"])
    except Exception as error:  # its errors have no class in common
        raise image_error(error) from None
    if parts > 1:
        raise frames_error(f"{parts} parts", "export only the one you want")
    wanted = next((order for order in _CHANNELS.values() if set(order) == names), None)
    if wanted is None or sampled:
        raise samples_error(f"the channels {', '.join(sorted(names))}")
    check_size(high[0] - low[0] + 1, high[1] - low[1] + 1, 4 * len(wanted), limits)
    if tiles is not None:
        check_tile(int(tiles.xSize), int(tiles.ySize), 4 * len(wanted), limits)
    try:
        with library.File(path, separate_channels=True) as exr:
            planes = [exr.channels()[name].pixels for name in wanted]
    except Exception as error:
        raise image_error(error) from None
    types = {plane.dtype.name for plane in planes}
    if len(types) != 1 or not types <= {"float16", "float32"}:
        raise samples_error(f"channels of {', '.join(sorted(types))}")
    return Picture(np.stack(planes, axis=2))


def save_openexr(file: IO[bytes], texels: NDArray[Any], description: Description) -> None:
    """(h, w, c) float16 or float32 as an OpenEXR file, ZIP-compressed, without the description.

    Raises MissingComponentError PTM-M100, OutputError PTM-O101.
    """
    if texels.dtype.kind != "f":
        raise format_error("exr", texels, ".png, .npy or .tif")
    library = _library()
    names = _CHANNELS[texels.shape[2]]
    channels = {name: np.ascontiguousarray(texels[:, :, i]) for i, name in enumerate(names)}
    head = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
    with TemporaryDirectory() as folder:  # the library writes files that have a name
        path = Path(folder) / "image.exr"
        with library.File(head, channels) as exr:
            exr.write(os.fspath(path))
        file.write(path.read_bytes())


def _from_memory(file: BinaryIO, limits: Limits) -> Picture:
    """The library reads files that have a name."""
    check_file(file, limits)
    file.seek(0)
    with NamedTemporaryFile(suffix=".exr") as named:
        named.write(file.read())
        named.flush()
        return read_exr(file, named.name, limits)


def _library() -> Any:
    return component("OpenEXR", "PTM-M100", "OpenEXR files need OpenEXR", "exr")


NPY_MAGIC = b"\x93NUMPY"
#: Longest head that is read, bytes: numpy evaluates it, and writes 118 for an image.
_NPY_HEAD_MAX = 1 << 12


def read_npy(file: BinaryIO, path: str | None, limits: Limits) -> Picture:
    """An array (h, w) or (h, w, 1 to 4), mapped if it is a file.

    Raises InputError PTM-I125, PTM-I126, LimitError PTM-L104.
    """
    shape, in_columns, dtype = _head(file)
    components = shape[2] if len(shape) == 3 else 1
    if len(shape) not in (2, 3) or not 1 <= components <= 4:
        raise InputError(
            "PTM-I126",
            f"holds an array of shape {shape}; an image has the shape (height, width) or "
            "(height, width, 1 to 4 components)",
            remedy="reshape it",
        )
    if dtype.name not in KINDS:
        raise samples_error(f"samples of type {dtype}")
    height, width = shape[:2]
    check_size(width, height, components * dtype.itemsize, None if path is not None else limits)
    return Picture(raster(file, path, dtype, shape, "F" if in_columns else "C"))


def save_npy(file: IO[bytes], texels: NDArray[Any], description: Description) -> None:
    """(h, w, c) of any kind as an array of that shape, without the description."""
    np.lib.format.write_array(file, np.ascontiguousarray(texels), allow_pickle=False)


def _head(file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether columns come first, type; the file then stands at the samples."""
    from numpy.lib import format as npy

    file.seek(0)
    head = io.BytesIO(file.read(_NPY_HEAD_MAX))
    try:
        # Version 3 differs in the names of fields only, which no image has.
        readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
        shape, in_columns, dtype = readers[npy.read_magic(head)](head)
    except Exception as error:  # a damaged head can make Python's parser raise nearly anything
        raise image_error(f"in its head: {error}") from None
    file.seek(head.tell())
    return shape, in_columns, dtype
