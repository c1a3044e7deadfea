"""The textures of a campus: each distinct image as squares of three sizes, a file for each channel.

The set is complete: an image of 200 texels has a file of 512, too, and the index records its size,
so that a client may leave the file out. A smaller texel is the mean of the encoded values that it
covers, a larger one is interpolated. Colours are not multiplied by alpha; but where alpha counts,
each has the weight of its alpha, so that transparent texels do not fringe opaque ones.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Singles
from ptmtools.errors import naming
from ptmtools.texture.images import load_image
from ptmtools.texture.model import Limits
from ptmtools.texture.samples import in_eight_bits
from ptmtools_systems.campus.model import ALPHA, DIFFUSE, MASK, SIZES, TextureFile, texture_file

if TYPE_CHECKING:
    from PIL import Image

    from ptmtools.scene.model import SourceImage

#: A file's record and its bytes.
Written = tuple[TextureFile, bytes]


@dataclass(frozen=True)
class Mask:
    """The source of a reflection mask: `load` returns the bytes of an image, whose ``band``, 0 to 2
    or -1 for the luminance, is the reflectance, or one minus it if ``inverted``."""

    load: Callable[[], bytes]
    label: str
    band: int = -1
    inverted: bool = False


@dataclass(frozen=True)
class BaseImage:
    """The sources of the textures of a base name; `alpha`: whether they include that channel."""

    base: str
    image: SourceImage | None
    alpha: bool
    mask: Mask | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Its channels, in their order."""
        layers = (DIFFUSE, self.image), (ALPHA, self.alpha), (MASK, self.mask)
        return tuple(channel for channel, wanted in layers if wanted)


def texture_files(limits: tuple[int, int], base: BaseImage) -> list[Written]:
    """The files of a base name. ``limits``: the most bytes of a decoded image, and the quality.

    Raises as decoding.
    """
    limit, quality = limits
    result: list[Written] = []

    def put(size: int, channel: str, image: Image.Image, source: tuple[int, int]) -> None:
        result.append(_texture_file(base.base, size, channel, jpeg(image, quality), source))

    if base.image is not None:
        image = _decode_image(base.image.load(), limit, base.image.name)
        alpha = None
        if base.alpha:
            alpha = image.getchannel("A") if "A" in image.getbands() else _white(image)
        colors = image.convert("RGB")
        for size in SIZES:
            if alpha is None:
                put(size, DIFFUSE, square_image(colors, size), image.size)
            else:
                put(size, DIFFUSE, weight_colors(colors, alpha, size), image.size)
                put(size, ALPHA, square_image(alpha, size), image.size)
    if base.mask is not None:
        image, band = _decode_image(base.mask.load(), limit, base.mask.label), base.mask.band
        grey = np.asarray(image.convert("L") if band < 0 else image.convert("RGB").getchannel(band))
        shine = _grey(255 - grey if base.mask.inverted else grey)
        for size in SIZES:
            put(size, MASK, square_image(shine, size), shine.size)
    return result


def light_files(
    base: str, maps: list[tuple[int, NDArray[np.uint8], tuple[int, int]]], quality: int
) -> list[Written]:
    """The files of a lightmap, given as side, (side, side) or (side, side, 3) texels, source."""
    return [
        _texture_file(base, size, "l", jpeg(_grey(texels), quality), source)
        for size, texels, source in maps
    ]


def jpeg(image: Image.Image, quality: int) -> bytes:
    """The bytes of a JPEG file, the same for the same texels."""
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=quality, optimize=True)
    return buffer.getvalue()


def square_image(image: Image.Image, size: int) -> Image.Image:
    """An image as a square: averaged along an axis that shrinks, interpolated along one that
    grows."""
    from PIL.Image import Resampling

    for axis in (0, 1):
        if image.size[axis] != size:
            shape = (size, image.height) if axis == 0 else (image.width, size)
            less = size < image.size[axis]
            image = image.resize(shape, Resampling.BOX if less else Resampling.BICUBIC)
    return image


def weight_colors(colors: Image.Image, alpha: Image.Image, size: int) -> Image.Image:
    """The colours of an image as a square, each with the weight of its ``alpha``; unweighted where
    that is 0."""
    from PIL import Image

    share = np.asarray(alpha, np.float32)
    total = _resize(share, size)
    plain = square_image(colors, size)
    result = np.asarray(plain, np.float32).copy()
    # Interpolation overshoots beside transparent texels.
    covered = total >= 1
    for band in range(3):
        band_sum = _resize(np.asarray(colors.getchannel(band), np.float32) * share, size)
        result[covered, band] = band_sum[covered] / total[covered]
    return Image.fromarray(np.rint(np.clip(result, 0, 255)).astype(np.uint8))


def _resize(texels: Singles, size: int) -> Singles:
    from PIL import Image

    return np.asarray(square_image(Image.fromarray(texels), size), np.float32)


def _texture_file(
    base: str, size: int, channel: str, data: bytes, source: tuple[int, int]
) -> Written:
    name, crc = texture_file(base, size, channel), zlib.crc32(data)
    return TextureFile(name, base, size, channel, len(data), crc, source), data


def _decode_image(data: bytes, limit: int, label: str) -> Image.Image:
    """An image of 8 bits: L, RGB or RGBA. Its orientation is ignored, as for all textures."""
    from PIL import Image

    with naming(label):
        texels = in_eight_bits(load_image(data, Limits(limit)).array())
    kinds = {1: "L", 2: "LA", 3: "RGB", 4: "RGBA"}
    shown = texels[:, :, 0] if texels.shape[2] == 1 else texels
    image = Image.fromarray(np.ascontiguousarray(shown), kinds[texels.shape[2]])
    return image.convert("RGBA") if image.mode == "LA" else image


def _grey(texels: NDArray[np.uint8]) -> Image.Image:
    from PIL import Image

    return Image.fromarray(np.ascontiguousarray(texels))


def _white(image: Image.Image) -> Image.Image:
    from PIL import Image

    return Image.new("L", image.size, 255)
