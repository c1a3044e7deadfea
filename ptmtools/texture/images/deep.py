"""Images of 16 bits a component, and TIFFs of floats.

Pillow reads most of them, but keeps only the upper bytes of 16-bit RGB, without a word. It can be
made to keep the lower bytes instead: the unpacker for samples of the other byte order takes the
second byte of each. So a 16-bit PNG is unpacked twice, once for each half, in compiled code and
without another library: 29 MB/s, where imagecodecs (libpng) reaches 50 and pypng, in pure Python,
1.7.

TIFFs are written as one page, one strip for every few rows, deflated (TIFF 6.0; Adobe's
technical note on deflate, compression 8). Pillow writes only some kinds of samples.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Mapping
from typing import IO, TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import OutputError
from ptmtools.lazy import component
from ptmtools.texture.images.opening import ORIENTATION, load, one_frame, open_image, read_strips
from ptmtools.texture.images.picture import (
    Picture,
    check_size,
    check_tile,
    frames_error,
    image_error,
    orient,
    raster,
    samples_error,
)
from ptmtools.texture.model import Description, Limits

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFile import ImageFile


#: Pillow's unpackers that keep the upper and the lower byte of each sample, by mode.
_HALVES = {"RGB": ("RGB;16B", "RGB;16L"), "RGBA": ("RGBA;16B", "RGBA;16L")}
_GREY_ALPHA = 4
#: Magic, width, height, largest sample of a PPM or PGM, with comments between.
_PPM = re.compile(rb"P([2356])" + rb"(?:\s|#[^\n]*\n)+(\d+)" * 3 + rb"\s")
#: Tags of TIFF; `_DEPTH` is libtiff's: an image may have several planes behind each other.
_TAGS = (256, 257, 258, 262, 277, 322, 323, 339, 34675, 32997, ORIENTATION)
_WIDTH, _HEIGHT, _BITS, _PHOTOMETRIC, _SAMPLES, _TILE_WIDTH, _TILE_HEIGHT = _TAGS[:7]
_FORMAT, _ICC, _DEPTH = _TAGS[7:10]
#: No tag: where the next page is, 0 if there is none.
_NEXT = 0
#: Bits and sample format of a TIFF → the type that holds its samples exactly.
_TYPES = {(16, 1): "uint16", (16, 3): "float16", (32, 3): "float32"}
Tags = Mapping[int, Any]
#: Bytes of a plain PPM read at a time, and the most digits of a number.
_BLOCK, _DIGITS_MAX = 1 << 20, 10


def read_png(file: BinaryIO, image: ImageFile, colour: int, limits: Limits) -> Picture:
    """A PNG of 16 bits a sample; ``colour`` is its colour type."""
    components = {0: 1, 2: 3, 4: 2, 6: 4}.get(colour, 3)
    check_size(*image.size, 2 * components, limits)
    key = image.info.get("transparency")
    if image.mode.startswith("I"):  # I;16, or I in older Pillows
        load(image)
        halves = [image]
    elif colour == _GREY_ALPHA:
        # Four bytes a texel, as RGBA has, and the same filters: the bytes as they are.
        halves = [_unpack(image, "RGBA", "RGBA")]
    else:
        upper, lower = _HALVES[image.mode]
        halves = [_unpack(image, image.mode, upper)]
        halves.append(_unpack(open_image(file, limits), image.mode, lower))

    def texels(upper: Image, lower: Image | None = None) -> NDArray[Any]:
        samples: NDArray[Any] = np.asarray(upper)
        if colour == _GREY_ALPHA:
            samples = samples.view(">u2")
        samples = samples.astype(np.uint16)
        if lower is not None:
            samples = samples << 8 | np.asarray(lower)
        return samples.reshape(*samples.shape[:2], components)

    return read_strips(halves, components, "uint16", texels, key)


def _unpack(image: ImageFile, mode: str, raw: str) -> ImageFile:
    """An image loaded by an unpacker other than its own."""
    image._mode = mode
    image.tile = [tile._replace(args=raw) for tile in image.tile]
    load(image)
    return image


def tiff_tags(file: BinaryIO) -> Tags:
    """The tags of the first page of a TIFF. Raises what Pillow raises."""
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    file.seek(0)
    head = file.read(8)
    if head[2] == 43 or head[3] == 43:
        head += file.read(8)
    directory = ImageFileDirectory_v2(head)
    assert directory.next is not None
    file.seek(directory.next)
    directory.load(file)
    # The first access parses a value: all of them here, where Pillow's errors are expected.
    return {tag: directory[tag] for tag in _TAGS if tag in directory} | {_NEXT: directory.next}


def is_deep(tags: Tags) -> bool:
    """Whether the samples of a TIFF need more than 8 bits."""
    return max(tags.get(_BITS, (1,))) > 8 or set(tags.get(_FORMAT, (1,))) != {1}


def read_tiff(file: BinaryIO, tags: Tags, limits: Limits) -> Picture:
    """A TIFF of samples that 8 bits do not hold.

    Raises InputError PTM-I126, LimitError PTM-L104, MissingComponentError PTM-M100.
    """
    width, height, components = tags[_WIDTH], tags[_HEIGHT], tags.get(_SAMPLES, 1)
    bits, formats = tags.get(_BITS, (1,)), tags.get(_FORMAT, (1,))
    photometric = tags.get(_PHOTOMETRIC, 1)
    same = len(set(bits)) == len(set(formats)) == 1
    dtype = _TYPES.get((bits[0], formats[0])) if same else None
    if dtype is None or photometric not in (1, 2) or components > 4:
        raise samples_error(
            f"{'/'.join(map(str, bits))} bits of TIFF sample format "
            f"{formats[0]}, photometric interpretation {photometric}"
        )
    texel_bytes = components * np.dtype(dtype).itemsize
    check_size(width, height, texel_bytes, limits)
    check_tile(tags.get(_TILE_WIDTH), tags.get(_TILE_HEIGHT), texel_bytes, limits)
    if components == 1 and dtype != "float16":
        image = open_image(file, limits)
        one_frame(image)
        load(image)
        return read_strips([image], 1, dtype, lambda strip: np.asarray(strip)[:, :, None])
    codecs = component(
        "imagecodecs",
        "PTM-M100",
        "a TIFF of more than one component deeper than 8 bits needs imagecodecs",
        "codecs",
    )
    if tags[_NEXT] or tags.get(_DEPTH, 1) != 1:
        raise frames_error("several pages")
    file.seek(0)
    try:
        texels = codecs.tiff_decode(file.read(), index=0)
    except Exception as error:  # its errors have no class in common
        raise image_error(error) from None
    texels = texels.reshape(height, width, components).astype(dtype, copy=False)
    icc = tags.get(_ICC) or None
    return Picture(orient(texels, tags.get(ORIENTATION, 1)), Description(icc=icc))


def read_ppm(file: BinaryIO, path: str | None, limits: Limits) -> Picture | None:
    """A PPM or PGM of 16 bits a sample; None for others. A binary one is mapped if it is a file.

    Raises InputError PTM-I125, LimitError PTM-L104, and ValueError for text that is not a number.
    """
    file.seek(0)
    head = _PPM.match(file.read(4096))
    if head is None or int(head[4]) != 0xFFFF:
        return None
    plain = head[1] in b"23"
    width, height, components = int(head[2]), int(head[3]), 1 if head[1] in b"25" else 3
    check_size(width, height, 2 * components, limits if plain or path is None else None)
    file.seek(head.end())
    if plain:
        samples = _plain_samples(file, width * height * components)
        return Picture(samples.reshape(height, width, components))
    return Picture(raster(file, path, np.dtype(">u2"), (height, width, components)))


def _plain_samples(file: BinaryIO, count: int) -> NDArray[np.uint16]:
    """Reads (count,) samples from decimal numbers. Raises InputError PTM-I125, ValueError."""
    # Before memory is taken: each has a digit, and all but the last something after it.
    start, end = file.tell(), file.seek(0, 2)
    if end - start < 2 * count - 1:
        raise image_error(f"after {end} bytes")
    file.seek(start)
    samples = np.empty(count, np.uint16)
    have, rest = 0, b""
    while have < count:
        block = file.read(_BLOCK)
        words = (rest + block).split()
        # The last may go on in the next block.
        rest = words.pop() if words and block and not block[-1:].isspace() else b""
        if max(map(len, [*words, rest]), default=0) > _DIGITS_MAX:
            raise image_error("a number is too long")
        numbers = np.array([int(word) for word in words[: count - have]], np.int64)
        if numbers.size and not 0 <= numbers.min() <= numbers.max() <= 0xFFFF:
            raise image_error("a sample is out of range")
        samples[have : have + numbers.size] = numbers
        have += numbers.size
        if not block and have < count:
            raise image_error(f"after {have} of {count} samples")
    return samples


_STRIP_BYTES = 1 << 20
#: Magic, and where the directory is.
_HEAD = struct.Struct("<4sI")
_SHORT, _LONG, _BYTES = 3, 4, 7
_SIZES = {_SHORT: ("H", 2), _LONG: ("I", 4), _BYTES: ("B", 1)}


def save_tiff(file: IO[bytes], texels: NDArray[Any], description: Description) -> None:
    """(h, w, c) of any kind, 1 to 4 components, as a little-endian TIFF, in an empty file.

    The second of two components and the fourth of four are alpha, not premultiplied.

    Raises OutputError PTM-O101 for what does not fit into 4 GiB.
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
            "PTM-O101", "a .tif holds no more than 4 GiB", remedy="name the output .npy"
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
