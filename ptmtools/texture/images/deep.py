"""Images of 16 bits a component, and TIFFs of floats.

Pillow reads most of them, but keeps only the upper bytes of 16-bit RGB, without a word. It can be
made to keep the lower bytes instead: the unpacker for samples of the other byte order takes the
second byte of each. So a 16-bit PNG is unpacked twice, once for each half, in compiled code and
without another library: 29 MB/s, where imagecodecs (libpng) reaches 50 and pypng, in pure Python,
1.7.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.texture.images.declared import check_tile
from ptmtools.texture.images.eight_bit import one_frame, with_key
from ptmtools.texture.images.opening import ORIENTATION, described, load, opened
from ptmtools.texture.images.picture import (
    Picture,
    Strips,
    check_size,
    damaged_image,
    oriented,
    unsupported,
)
from ptmtools.texture.model import Description, Limits

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from PIL.ImageFile import ImageFile

#: Pillow's unpackers that keep the upper and the lower byte of each sample, by mode.
_HALVES = {"RGB": ("RGB;16B", "RGB;16L"), "RGBA": ("RGBA;16B", "RGBA;16L")}
_GREY_ALPHA = 4
#: Magic, width, height, largest sample of a PPM or PGM, with comments between.
_PPM = re.compile(rb"P([2356])" + rb"(?:\s|#[^\n]*\n)+(\d+)" * 3 + rb"\s")
_ICC = 34675
#: Tag of libtiff's: an image may have several planes behind each other.
_DEPTH = 32997
#: So much of a plain PPM is read at a time, and so many digits are the most that a number has.
_BLOCK, _DIGITS_MAX = 1 << 20, 10


def read_png(file: BinaryIO, image: ImageFile, colour: int, limits: Limits) -> Picture:
    """A PNG of 16 bits a sample; ``colour`` is its colour type."""
    import numpy as np

    components = {0: 1, 2: 3, 4: 2, 6: 4}.get(colour, 3)
    check_size(*image.size, 2 * components, limits)
    key = image.info.get("transparency")
    if image.mode.startswith("I"):  # I;16, or I in older Pillows
        load(image)
        halves = [image]
    elif colour == _GREY_ALPHA:
        # Four bytes a texel, as RGBA has, and the same filters: the bytes as they are.
        halves = [_unpacked(image, "RGBA", "RGBA")]
    else:
        upper, lower = _HALVES[image.mode]
        halves = [_unpacked(image, image.mode, upper)]
        halves.append(_unpacked(opened(file, limits), image.mode, lower))
    keyed = key is not None and components in (1, 3)

    def strip(y0: int, y1: int) -> NDArray[Any]:
        parts: list[NDArray[Any]] = [
            np.asarray(half.crop((0, y0, half.width, y1))) for half in halves
        ]
        if len(parts) == 2:
            texels = parts[0].astype(np.uint16) << np.uint16(8)
            texels |= parts[1]
        elif colour == _GREY_ALPHA:
            texels = parts[0].view(">u2").astype(np.uint16)
        else:
            texels = parts[0].astype(np.uint16)[:, :, None]
        return with_key(texels, key) if keyed else texels

    shape = (image.height, image.width, components + keyed)
    return Picture(Strips(shape, np.dtype(np.uint16), strip), described(image))


def _unpacked(image: ImageFile, mode: str, raw: str) -> ImageFile:
    """An image loaded by an unpacker other than its own."""
    image._mode = mode
    image.tile = [tile._replace(args=raw) for tile in image.tile]
    load(image)
    return image


class TiffLayout(NamedTuple):
    """What the first page of a TIFF says of its samples."""

    width: int
    height: int
    components: int
    bits: tuple[int, ...]
    sample_format: tuple[int, ...]
    photometric: int
    pages: int
    orientation: int
    icc: bytes | None
    tile: tuple[object, object]
    depth: object

    @property
    def deep(self) -> bool:
        """Whether 8 bits cannot hold them."""
        return max(self.bits) > 8 or set(self.sample_format) != {1}

    @property
    def dtype(self) -> str | None:
        """The type that holds them exactly, if one does."""
        found = {(*self.bits,), (*self.sample_format,)}
        kinds = {(16, 1): "uint16", (16, 3): "float16", (32, 3): "float32"}
        if any(len(set(values)) != 1 for values in found):
            return None
        return kinds.get((self.bits[0], self.sample_format[0]))


def tiff_layout(file: BinaryIO) -> TiffLayout:
    """The layout of a TIFF. Raises what Pillow raises."""
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    file.seek(0)
    head = file.read(8)
    if head[2] == 43 or head[3] == 43:
        head += file.read(8)
    directory = ImageFileDirectory_v2(head)
    assert directory.next is not None
    file.seek(directory.next)
    directory.load(file)
    samples = directory.get(277, 1)
    return TiffLayout(
        directory[256],
        directory[257],
        samples,
        tuple(directory.get(258, (1,))),
        tuple(directory.get(339, (1,))),
        directory.get(262, 1),
        2 if directory.next else 1,
        directory.get(ORIENTATION, 1),
        directory.get(_ICC) or None,
        (directory.get(322), directory.get(323)),
        directory.get(_DEPTH, 1),
    )


def read_tiff(file: BinaryIO, layout: TiffLayout, limits: Limits) -> Picture:
    """A TIFF of samples that 8 bits do not hold.

    Raises InputError PTM-I126, PTM-I127, LimitError PTM-L104, MissingComponentError PTM-M100.
    """
    import numpy as np

    dtype, components = layout.dtype, layout.components
    if dtype is None or layout.photometric not in (1, 2) or components > 4:
        raise unsupported(
            f"{'/'.join(map(str, layout.bits))} bits of TIFF sample format "
            f"{layout.sample_format[0]}, photometric interpretation {layout.photometric}"
        )
    texel_bytes = components * np.dtype(dtype).itemsize
    check_size(layout.width, layout.height, texel_bytes, limits)
    check_tile(*layout.tile, texel_bytes, limits)
    if components == 1 and dtype != "float16":
        image = opened(file, limits)
        one_frame(image)
        load(image)

        def strip(y0: int, y1: int) -> NDArray[Any]:
            return np.asarray(image.crop((0, y0, image.width, y1)))[:, :, None]

        shape = (image.height, image.width, 1)
        return Picture(Strips(shape, np.dtype(dtype), strip), described(image))
    try:
        from imagecodecs import tiff_decode
    except ImportError:
        raise MissingComponentError(
            "PTM-M100",
            "a TIFF of more than one component deeper than 8 bits needs imagecodecs",
            remedy="pip install 'ptmtools[codecs]'",
        ) from None
    if layout.pages > 1 or layout.depth != 1:
        raise InputError(
            "PTM-I127",
            "holds several pages; a texture is one image",
            remedy="export the one you want as PNG",
        )
    file.seek(0)
    try:
        texels = tiff_decode(file.read(), index=0)
    except Exception as error:  # its errors have no class in common
        raise damaged_image(error) from None
    texels = texels.reshape(layout.height, layout.width, components).astype(dtype, copy=False)
    return Picture(oriented(texels, layout.orientation), Description(icc=layout.icc))


def read_ppm(file: BinaryIO, path: str | None, limits: Limits) -> Picture | None:
    """A PPM or PGM of 16 bits a sample; None for others. A binary one is mapped if it is a file.

    Raises InputError PTM-I125, LimitError PTM-L104, and for what is no number ValueError.
    """
    import numpy as np

    file.seek(0)
    head = _PPM.match(file.read(4096))
    if head is None or int(head[4]) != 0xFFFF:
        return None
    plain = head[1] in b"23"
    width, height, components = int(head[2]), int(head[3]), 1 if head[1] in b"25" else 3
    check_size(width, height, 2 * components, limits if plain or path is None else None)
    if 0 in (width, height):
        raise damaged_image("no texels")
    if plain:
        file.seek(head.end())
        samples = _plain_samples(file, width * height * components)
        return Picture(samples.reshape(height, width, components))
    texels: np.ndarray[Any, Any]
    if path is not None:
        file.seek(0, 2)
        if file.tell() < head.end() + 2 * width * height * components:
            raise damaged_image(f"after {file.tell()} bytes")
        texels = np.memmap(path, ">u2", "r", head.end(), (height, width, components))
    else:
        file.seek(head.end())
        data = file.read(2 * width * height * components)
        if len(data) < 2 * width * height * components:
            raise damaged_image(f"after {head.end() + len(data)} bytes")
        texels = np.frombuffer(data, ">u2").reshape(height, width, components)
    return Picture(texels)


def _plain_samples(file: BinaryIO, count: int) -> NDArray[np.uint16]:
    """So many samples (count,) from decimal numbers. Raises InputError PTM-I125, ValueError."""
    import numpy as np

    # Before memory is taken: each has a digit, and all but the last something after it.
    start, end = file.tell(), file.seek(0, 2)
    if end - start < 2 * count - 1:
        raise damaged_image(f"after {end} bytes")
    file.seek(start)
    samples = np.empty(count, np.uint16)
    have, rest = 0, b""
    while have < count:
        block = file.read(_BLOCK)
        words = (rest + block).split()
        # The last may go on in the next block.
        rest = words.pop() if words and block and not block[-1:].isspace() else b""
        if max(map(len, [*words, rest]), default=0) > _DIGITS_MAX:
            raise damaged_image("a number is too long")
        numbers = np.array([int(word) for word in words[: count - have]], np.int64)
        if numbers.size and not 0 <= numbers.min() <= numbers.max() <= 0xFFFF:
            raise damaged_image("a sample is out of range")
        samples[have : have + numbers.size] = numbers
        have += numbers.size
        if not block and have < count:
            raise damaged_image(f"after {have} of {count} samples")
    return samples
